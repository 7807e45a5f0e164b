// SPDX-License-Identifier: Apache-2.0
// What is read of a node, one object after the other, each chosen by what was read before:
//
//   1000h; 1005h to 100Ah and 100Ch, 100Dh, 1014h, 1017h; 1018h with its sub-indices;
//   of a device of CiA 401: 6423h (analogue inputs are sent only if it is true);
//   each of the records 1400h..15FFh and 1800h..19FFh that the device has, with its sub-indices,
//   and the mapping that goes with it, 1600h.. and 1A00h..
//
// PDO records need not follow each other, so that the device is asked for each of the 1024.
#pragma once

#include <cstdint>
#include <optional>

#include "stack/base/abort_code.h"
#include "stack/od/objects.h"
#include "stack/scan/scanned_node.h"

namespace linegate::scan {

class Survey {
 public:
  explicit Survey(std::uint8_t node) { node_.id = node; }

  // What is to be read next; nothing when all is done.
  std::optional<od::Address> wanted() const { return wanted_; }
  // What came of it. An abort of the device means that it does not have the object.
  void take(AbortCode abort, std::vector<std::byte> data);
  // The node does not answer any more.
  void give_up(AbortCode why);

  // 1000h was read: there is a device.
  bool present() const { return present_; }
  const ScannedNode& result() const { return node_; }
  ScannedNode take_result() { return std::move(node_); }

 private:
  enum class Part : std::uint8_t { head, identity, communication, mapping, done };

  void advance(std::optional<std::uint64_t> value);
  void next_head(std::optional<std::uint64_t> value);
  void next_identity(std::optional<std::uint64_t> value);
  void next_communication(std::optional<std::uint64_t> value);
  void next_mapping(std::optional<std::uint64_t> value);
  void begin_record(std::uint16_t index);
  void end_record();
  void ask(Part part, od::Address address);

  ScannedNode node_;
  std::optional<od::Address> wanted_{od::Address{od::objects::kDeviceType, 0}};
  Part part_ = Part::head;
  std::size_t head_ = 0;       // place in the list of single objects
  std::uint16_t record_ = 0;   // 1400h.. or 1800h..
  std::uint64_t entries_ = 0;  // sub-indices of what is being read
  bool present_ = false;
};

}  // namespace linegate::scan
