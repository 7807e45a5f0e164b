// SPDX-License-Identifier: Apache-2.0
// The objects that are read from a node, one after the other, each selected by the values read
// before:
//
//   1000h; 1005h to 100Ah and 100Ch, 100Dh, 1014h, 1017h; 1018h with its sub-indices;
//   of a device of CiA 401: 6423h (analogue inputs are sent only if it is true);
//   each of the records 1400h..15FFh and 1800h..19FFh that the device has, with its sub-indices,
//   and its mapping record, 1600h.. and 1A00h..
//
// The numbers of a device's PDO records may have gaps, so each of the 1024 records is requested.
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

  // The object to read next; nothing if the survey is complete.
  std::optional<od::Address> wanted() const { return wanted_; }
  // The result of the read. An abort by the device means that it lacks the object.
  void take(AbortCode abort, std::vector<std::byte> data);
  // The node stopped answering.
  void give_up(AbortCode why);

  // The node answered: there is a device.
  bool present() const { return present_; }
  const ScannedNode& result() const { return node_; }
  ScannedNode pop_result() { return std::move(node_); }

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
  std::size_t head_ = 0;       // position in the list of single objects
  std::uint16_t record_ = 0;   // 1400h.. or 1800h..
  std::uint64_t entries_ = 0;  // number of sub-indices of the object that is being read
  bool present_ = false;
};

}  // namespace linegate::scan
