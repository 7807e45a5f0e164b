// SPDX-License-Identifier: Apache-2.0
// The line of a manager in virtual time, on a bus with nodes that boot, answer SDO requests and
// send heartbeats. What their outputs are is seen in the frames.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "stack/line/line.h"

#include "tests/gateway/names/random_device.h"

namespace linegate::names {

// The nodes 1, 2, ... with names n1, n2, ...
class PlantBus {
 public:
  explicit PlantBus(const std::vector<RandomDevice>& devices);

  // Why the line could not be made; empty: it runs.
  const std::string& error() const { return error_; }
  line::Line& line() { return *line_; }
  Instant now() const { return now_; }

  void send(std::uint32_t identifier, std::span<const std::byte> data);
  // For so long, with the nodes.
  void pass(Duration time);
  image::Snapshot snapshot(image::Direction direction);
  // The data of the last frame of the line with that identifier; empty: it sent none.
  std::vector<std::byte> last_frame(std::uint32_t identifier) const;

 private:
  void answer(const can::Frame& frame);
  void answer_sdo(std::uint8_t node, const can::Frame& request);

  std::string error_;
  std::unique_ptr<line::Line> line_;
  Instant now_{std::chrono::seconds(100)};
  Instant heartbeat_{};                          // of all nodes, when the next is due
  std::map<std::uint8_t, std::uint8_t> states_;  // of NMT, by node; 0: it has not booted
  std::map<std::uint32_t, std::vector<std::byte>> frames_;
};

}  // namespace linegate::names
