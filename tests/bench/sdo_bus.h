// SPDX-License-Identifier: Apache-2.0
// A bus at 1 Mbit/s in real time on a socket pair, with devices that answer SDO uploads. Frames
// from the measured end are sent one after the other, each for as long as it occupies a wire, and
// so are the answers. SYNCs get the time at which they were written to the socket.
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

// Nodes 1 to kUploadNodes have a DOMAIN (transfer_device.h) of kUploadBytes. The last one is read
// in blocks: while it sends a block, no request of an upload wins the arbitration. The others do
// not indicate the size and are read in segments: they use the bus for about a third of the time.
inline constexpr std::uint8_t kUploadNodes = 8;
inline constexpr std::uint32_t kUploadBytes = 889;  // one block
constexpr bool uploads_in_blocks(std::uint8_t node) {
  return node == kUploadNodes;
}

// Time-out of both sides: a machine with other load is no reason to abort a transfer.
inline constexpr Duration kSdoPatience = std::chrono::seconds(10);

struct SyncTimes {
  std::vector<std::int64_t> stamps;    // send times in ns of the wall clock
  std::vector<std::uint8_t> counters;  // 1..kSyncOverflow
  double bus_use = 0;                  // fraction of the time between the first and the last SYNC
};
inline constexpr std::uint8_t kSyncOverflow = 240;

class SdoBus {
 public:
  SdoBus();
  ~SdoBus();
  SdoBus(const SdoBus&) = delete;
  SdoBus& operator=(const SdoBus&) = delete;

  Wire wire;

  // Starts a thread that reads the wire, until stop(). The far end may be closed after stop().
  void start();
  void stop();

  // Records the next `count` SYNCs. Ends the program if no SYNC arrives for seconds.
  SyncTimes record_syncs(std::size_t count);

 private:
  class Device;

  void run();
  void take(const can_frame& frame, std::int64_t stamp, Instant now);
  void receive_sync(const can_frame& frame, std::int64_t stamp, Instant now);
  void deliver(Instant now);
  void submit_answers(Instant now);

  sim::Bus bus_;
  sim::Bus::Endpoint measured_;  // sends the frames that arrive over the wire
  sim::Bus::Endpoint devices_;   // all devices behind one controller
  std::vector<std::unique_ptr<Device>> all_;
  std::size_t turn_ = 0;  // the device whose turn it is
  std::atomic<bool> stop_{false};

  // SYNCs to record; 0: the record belongs to the thread that requested it.
  std::atomic<std::size_t> wanted_{0};
  SyncTimes record_;
  Instant recorded_from_{};
  Duration busy_before_{};

  std::thread thread_;
};

}  // namespace linegate::bench
