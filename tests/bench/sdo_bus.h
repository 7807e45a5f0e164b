// SPDX-License-Identifier: Apache-2.0
// A bus at 1 Mbit/s in real time on a socket pair, with devices on it that answer SDO uploads.
// Frames from the measured end go out one after the other as long as each takes on the wire, and so
// do the answers. SYNCs among them are known by the time at which they were handed to the socket.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

#include "bridges/sim/bus.h"

#include "tests/bench/wire.h"

namespace linegate::bench {

// Nodes 1..kUploadNodes have a DOMAIN (transfer_device.h) of kUploadBytes. The last is read in
// blocks: while it sends one, no request of an upload wins the arbitration. The others do not tell
// its size, and are read in segments: the bus is theirs for about a third of the time.
inline constexpr std::uint8_t kUploadNodes = 8;
inline constexpr std::uint32_t kUploadBytes = 889;  // one block
constexpr bool uploads_in_blocks(std::uint8_t node) {
  return node == kUploadNodes;
}

// Time-out of either side: a machine that has other things to do is no reason to abort a transfer.
inline constexpr Duration kSdoPatience = std::chrono::seconds(10);

struct SyncTimes {
  std::vector<std::int64_t> stamps;    // when each was sent; ns of the wall clock
  std::vector<std::uint8_t> counters;  // 1..kSyncOverflow
  double bus_use = 0;                  // of the time between the first and the last of them
};
inline constexpr std::uint8_t kSyncOverflow = 240;

class SdoBus {
 public:
  SdoBus();
  ~SdoBus();
  SdoBus(const SdoBus&) = delete;
  SdoBus& operator=(const SdoBus&) = delete;

  Wire wire;

  // From now on its own thread reads the wire; until stop(), after which the far end may be closed.
  void start();
  void stop();

  // So many SYNCs as they come. Ends the program if none comes for seconds.
  SyncTimes record_syncs(std::size_t count);

 private:
  class Device;

  void run();
  void take(const can_frame& frame, std::int64_t stamp, Instant now);
  void take_sync(const can_frame& frame, std::int64_t stamp, Instant now);
  void deliver(Instant now);
  void submit_answers(Instant now);

  sim::Bus bus_;
  sim::Bus::Endpoint measured_;  // what comes over the wire
  sim::Bus::Endpoint devices_;   // all of them behind one controller
  std::vector<std::unique_ptr<Device>> all_;
  std::size_t turn_ = 0;  // of them
  std::atomic<bool> stop_{false};

  std::atomic<std::size_t> wanted_{0};  // SYNCs; 0: the record belongs to the thread that wants it
  SyncTimes record_;
  Instant recorded_from_{};
  Duration busy_before_{};

  std::thread thread_;
};

}  // namespace linegate::bench
