// SPDX-License-Identifier: Apache-2.0
// A manager's line that is run by the gateway's executor: it produces SYNC, and reads the DOMAINs
// of all devices of an SdoBus by commands.
#pragma once

#include <atomic>
#include <cstdint>

#include "gateway/runtime/executor.h"
#include "gateway/runtime/line_port.h"

#include "tests/bench/measured_line.h"
#include "tests/bench/sdo_bus.h"

namespace linegate::bench {

class UploadLine {
 public:
  // Uses the wire of that bus, and starts the bus.
  UploadLine(SdoBus& bus, Duration sync_period);
  // Also stops the bus.
  ~UploadLine();
  UploadLine(const UploadLine&) = delete;
  UploadLine& operator=(const UploadLine&) = delete;

  // Starts SYNCs and uploads. An upload that ends is started again, until stop(), which waits until
  // neither is on the bus.
  void start();
  void stop();

  // Number of complete uploads.
  std::uint64_t ended() const { return ended_.load(); }

 private:
  void take();
  void take(const line::Reply& reply);
  void turn(bool on);
  void read(std::uint8_t node);
  void ask(line::Command command);

  SdoBus& bus_;
  gateway::LinePort port_;
  gateway::Executor executor_;
  std::atomic<bool> manager_runs_{false};
  std::atomic<bool> wanted_{false};  // whether SYNCs and uploads are requested
  std::atomic<unsigned> asked_{0};   // commands without a reply yet
  std::atomic<std::uint64_t> ended_{0};
  bool on_ = false;  // used only by the publisher's thread, which also sends the commands
  PublisherThread publisher_;
};

}  // namespace linegate::bench
