// SPDX-License-Identifier: Apache-2.0
// The console's client made of the subscriber's half of bridges/dds.
#pragma once

#include <memory>

#include "bridges/console/client.h"
#include "bridges/dds/client.h"

namespace linegate::gateway {

class RemoteClient final : public console::Client {
 public:
  explicit RemoteClient(std::unique_ptr<dds::Client> client);

  void poll(Duration timeout, console::Listener& listener) override;
  console::Discovery discovery() const override;
  Answer call(const console::LineId& id, const line::Command& command, Duration timeout,
              std::uint64_t layout_id, console::Listener& listener) override;
  bool write_outputs(const console::LineId& id, const line::OutputWrite& write) override;

 private:
  std::unique_ptr<dds::Client> client_;
};

}  // namespace linegate::gateway
