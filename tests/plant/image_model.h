// SPDX-License-Identifier: Apache-2.0
// The expected input image of a line, derived in a simple way from the received frames: the oracle
// for the compiled copy plans.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "stack/can/frame.h"
#include "stack/line/line.h"

namespace linegate::plant {

class ImageModel {
 public:
  explicit ImageModel(line::Line& line);

  // Call it before the line receives the frame.
  void before_receive(const can::Frame& frame);
  // Call it after each call of the line, with the events of that call: the line may have processed
  // a SYNC, become Operational, or been reset.
  void after_call(std::span<const Event> events);

  // Compares every valid entry of a new snapshot with the model. Returns a description of the first
  // difference, or nothing.
  std::string compare(line::Line& line, Instant now);

 private:
  struct Field {
    std::size_t entry = 0;  // index in the input layout
    unsigned frame_bit = 0;
    unsigned bits = 0;
  };
  struct Pdo {
    bool synchronous = false;
    unsigned bytes = 0;  // number of mapped bytes
    std::vector<Field> fields;
    bool pending = false;
    can::Frame shadow;
    bool has_value = false;
    can::Frame value;
  };

  void add_node(const line::NodeConfig& node, const image::Layout& layout);

  line::Line& line_;
  std::map<std::uint32_t, Pdo> pdos_;  // by identifier, with bit 31 for extended ones
  std::uint32_t syncs_ = 0;
  image::Snapshot snapshot_;
};

}  // namespace linegate::plant
