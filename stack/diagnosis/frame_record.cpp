// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/base/byte_order.h"
#include "stack/diagnosis/canopen_ia.h"
#include "stack/diagnosis/record_description.h"

namespace linegate::diagnosis {
namespace {

constexpr std::size_t kIdBytes = sizeof(std::uint16_t);
constexpr std::uint16_t kHighestId = 0x7FF;

}  // namespace

od::ObjectDescription frame_record(std::uint16_t index) {
  std::vector<od::VariableDescription> members;
  for (unsigned bytes = 1; bytes <= can::kMaxClassicData; ++bytes) {
    members.push_back(od::number_variable(static_cast<std::uint8_t>(bytes),
                                          "Frame of " + std::to_string(bytes) + " bytes",
                                          od::DataType::octet_string, od::Access::rw));
  }
  return record(index, "Generic CAN frames", std::move(members));
}

Result<can::Frame> frame_of(std::uint8_t sub, std::span<const std::byte> value) {
  const std::size_t size = kIdBytes + sub;
  if (value.size() != size) {
    return to_error(value.size() > size ? AbortCode::length_too_high : AbortCode::length_too_low);
  }
  const auto id = load_le<std::uint16_t>(value.data());
  if (id > kHighestId) {
    return to_error(AbortCode::invalid_value);
  }
  return can::make_frame(id, value.subspan(kIdBytes));
}

void HeardFrames::note(const can::Frame& frame) {
  if (frame.flags != 0 || frame.length > can::kMaxClassicData) {
    return;
  }
  Heard& heard = heard_[frame.length];
  store_le(heard.bytes.data(), static_cast<std::uint16_t>(frame.id));
  std::ranges::copy(frame.bytes(), heard.bytes.begin() + kIdBytes);
  heard.size = static_cast<std::uint8_t>(kIdBytes + frame.length);
}

std::span<const std::byte> HeardFrames::last(std::uint8_t length) const {
  const Heard& heard = heard_[length];
  return {heard.bytes.data(), heard.size};
}

}  // namespace linegate::diagnosis
