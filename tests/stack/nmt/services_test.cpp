// SPDX-License-Identifier: Apache-2.0
#include "stack/nmt/services.h"

#include <gtest/gtest.h>

namespace linegate::nmt {
namespace {

// CiA 301, 7.3.2.2.6: NMT states and communication objects.
TEST(Services, StatesAndCommunicationObjects) {
  using enum can::Service;
  struct Row {
    can::Service service;
    bool pre_operational, operational, stopped;
  };
  const Row table[] = {{rpdo, false, true, false},        {tpdo_rtr, false, true, false},
                       {sdo_server, true, true, false},   {sdo_client, true, true, false},
                       {sync, true, true, false},         {time, true, true, false},
                       {emcy, true, true, false},         {nmt, true, true, true},
                       {error_control, true, true, true}, {lss, true, true, true}};
  for (const Row& row : table) {
    EXPECT_EQ(is_served(row.service, State::pre_operational), row.pre_operational);
    EXPECT_EQ(is_served(row.service, State::operational), row.operational);
    EXPECT_EQ(is_served(row.service, State::stopped), row.stopped);
    EXPECT_FALSE(is_served(row.service, State::initialising));
    EXPECT_FALSE(is_served(row.service, State::unknown));
  }
}

}  // namespace
}  // namespace linegate::nmt
