// SPDX-License-Identifier: Apache-2.0
// The ranges of the parameters of typed commands. They are checked here alone, for each language: a
// number comes in a type that is wider than its range, so that none is cut on its way.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>

#include "bridges/request/journal.h"
#include "stack/can/cob_id.h"
#include "stack/can/frame.h"
#include "stack/line/requests.h"

namespace linegate::client {

struct Parameter {
  std::string_view name;   // that of C++, C and Python
  bool valid = false;      // it is in its range
  std::string_view range;  // "1..127"
};

// "node is not 1..127", of the first that is out of its range; empty: none is.
inline std::string out_of_range(std::initializer_list<Parameter> parameters) {
  const auto* const found = std::ranges::find(parameters, false, &Parameter::valid);
  return found == parameters.end()
             ? std::string()
             : std::string(found->name) + " is not " + std::string(found->range);
}

inline Parameter one_node(unsigned value, std::string_view name = "node") {
  return {name, value >= can::kMinNodeId && value <= can::kMaxNodeId, "1..127"};
}
// 0: all, the only one, or the own node.
inline Parameter node_or_0(unsigned value) {
  return {"node", value <= can::kMaxNodeId, "0..127"};
}
inline Parameter byte_number(unsigned value, std::string_view name) {
  return {name, value <= 0xFF, "0..255"};
}
inline Parameter word_number(unsigned value, std::string_view name) {
  return {name, value <= 0xFFFF, "0..FFFFh"};
}
inline Parameter index_of(unsigned value) {
  return word_number(value, "index");
}
inline Parameter sub_of(unsigned value) {
  return byte_number(value, "sub");
}
// Of an object that an application may create.
inline Parameter own_index_of(unsigned value) {
  return {"index", (value >= 0x2000 && value <= 0x5EFF) || (value >= 0x6000 && value <= 0x9FFF),
          "2000h..5EFFh or 6000h..9FFFh"};
}
inline Parameter network_of(unsigned value) {
  return {"network", value >= 1 && value <= 0xFFFF, "1..65535"};
}
// Of a line: also of PDOs without an object.
inline Parameter line_pdo(unsigned value) {
  return {"number", value >= 1 && value <= 0xFFFF, "1..65535"};
}
inline constexpr unsigned kMostPdos = 512;  // of a device: objects 1400h..15FFh, 1800h..19FFh
inline Parameter device_pdo(unsigned value) {
  return {"number", value >= 1 && value <= kMostPdos, "1..512"};
}
inline Parameter identifier_of(std::uint32_t value, bool extended) {
  constexpr std::uint32_t kStandard = 0x7FF;
  return {"identifier", value <= (extended ? line::CanListen::kAllBits : kStandard),
          extended ? "0..1FFFFFFFh" : "0..7FFh"};
}

inline Parameter text_of(std::string_view value, std::string_view name) {
  return {name, value.size() <= request::JournalRead::kLongestText, "0..255 bytes"};
}

}  // namespace linegate::client
