// SPDX-License-Identifier: Apache-2.0
// A request of a gateway to another one that nobody has received in time is not sent later: the
// other gateway would carry it out when nobody waits for it any more (request_tracker.h).
#include <chrono>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "bridges/dds/endpoints.h"
#include "bridges/dds/request_tracker.h"

#include "tests/dds/fixtures.h"
#include "tests/dds/late_reader.h"
#include "tests/paths.h"

namespace linegate::test {
namespace {

TEST(RequestLifetime, AReaderThatComesLaterReceivesNoOldRequest) {
  std::vector<Diagnostic> diagnostics;
  dds::Endpoints endpoints("reader", domain(), paths::kLoopbackProfiles, diagnostics);
  LateReader reader(endpoints);
  dds::ClientOptions options = client_options("hall-a routes");
  options.of_gateway = true;
  const auto client = make_client(options);
  ASSERT_NE(client, nullptr);
  reader.expect_fresh_requests_only(*client, known_line());
}

}  // namespace
}  // namespace linegate::test
