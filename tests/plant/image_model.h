// SPDX-License-Identifier: Apache-2.0
// What a line's input image ought to hold, worked out naively from the frames it was given: the
// oracle against which the compiled copy plans are checked.
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

  // The line is about to be given this frame.
  void before_receive(const can::Frame& frame);
  // The line was called, and emitted these events: it may have passed a SYNC, have become
  // Operational, or have been reset.
  void after_call(std::span<const Event> events);

  // Compares every valid entry of a fresh snapshot with the model; a sentence about the first
  // difference, or nothing.
  std::string compare(line::Line& line, Instant now);

 private:
  struct Field {
    std::size_t entry = 0;  // in the input layout
    unsigned frame_bit = 0;
    unsigned bits = 0;
  };
  struct Pdo {
    bool synchronous = false;
    unsigned bytes = 0;  // mapped
    std::vector<Field> fields;
    bool pending = false;
    can::Frame shadow;
    bool has_value = false;
    can::Frame value;
  };

  void add_node(const line::NodeConfig& node, const image::Layout& layout);

  line::Line& line_;
  std::map<std::uint32_t, Pdo> pdos_;  // by identifier, bit 31 for extended ones
  std::uint32_t syncs_ = 0;
  image::Snapshot snapshot_;
};

}  // namespace linegate::plant
