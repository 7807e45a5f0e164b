// SPDX-License-Identifier: Apache-2.0
#include "stack/diagnosis/emcy_record.h"

#include <algorithm>

namespace linegate::diagnosis {
namespace {

void count_up(std::uint8_t& counter) {
  counter = counter == 0xFF ? counter : static_cast<std::uint8_t>(counter + 1);
}

}  // namespace

void EmcyRecord::note(std::uint8_t node, const emcy::Message& message) {
  History& history = histories_[node];
  count_up(history.count);
  const auto* const counted =
      std::ranges::find(kEmcyClasses, static_cast<std::uint8_t>(message.code >> 8U));
  if (counted != kEmcyClasses.end()) {
    count_up(classes_[static_cast<std::size_t>(counted - kEmcyClasses.begin())]);
  }
  history.erroneous = message.code != emcy::kErrorReset || message.error_register != 0;
  const std::size_t last = std::to_integer<std::size_t>(history.bytes[0]) % kKept;
  emcy::Message classical = message;  // of one of CANopen FD, the fields that 8 bytes have
  classical.fd = {};
  const can::Frame frame = emcy::encode(classical, can::CobId{can::kEmcyBase});
  std::ranges::copy(frame.bytes(), history.bytes.begin() + static_cast<long>(1 + last * 8));
  history.bytes[0] = static_cast<std::byte>(last + 1);
  history.kept = static_cast<std::uint8_t>(std::min<std::size_t>(history.kept + 1U, kKept));
}

std::span<const std::byte> EmcyRecord::history(std::uint8_t node) const {
  const History& history = histories_[node];
  return std::span(history.bytes).first(1U + history.kept * 8U);
}

}  // namespace linegate::diagnosis
