// SPDX-License-Identifier: Apache-2.0
// A manager's line that the gateway's executor runs: it produces SYNC, and reads the DOMAINs of all
// devices of an SdoBus by commands.
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
  // On the wire of that bus, which it starts.
  UploadLine(SdoBus& bus, Duration sync_period);
  // Stops the bus, too.
  ~UploadLine();
  UploadLine(const UploadLine&) = delete;
  UploadLine& operator=(const UploadLine&) = delete;

  // SYNCs and uploads, each of which is begun again when it has ended; until stop(), after which
  // there is nothing of either on the bus.
  void start();
  void stop();

  // Uploads that have ended, with all the bytes there are.
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
  std::atomic<bool> wanted_{false};  // SYNCs and uploads
  std::atomic<unsigned> asked_{0};   // commands without their replies yet
  std::atomic<std::uint64_t> ended_{0};
  bool on_ = false;  // of the publisher's thread alone, which gives the commands, too
  PublisherThread publisher_;
};

}  // namespace linegate::bench
