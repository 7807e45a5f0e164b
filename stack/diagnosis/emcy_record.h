// SPDX-License-Identifier: Apache-2.0
// Statistics of received EMCYs: counters for each node and for each class, and the last four of
// each node (IXXAT manual 7.3, objects 5F10h to 5F18h).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "stack/can/cob_id.h"
#include "stack/emcy/message.h"

namespace linegate::diagnosis {

// Classes of emergency error codes with a counter of their own, by their high byte: 5F11h, 5F12h,
// ...
inline constexpr std::array<std::uint8_t, 7> kEmcyClasses{0x10, 0x50, 0x60, 0x81, 0x82, 0x90, 0xFF};

class EmcyRecord {
 public:
  static constexpr std::size_t kKept = 4;
  static constexpr std::size_t kLongest = 1 + kKept * 8;

  // node: 1..127.
  void note(std::uint8_t node, const emcy::Message& message);

  // EMCYs received from the node, including error resets. The counters saturate at 255.
  std::uint8_t count(std::uint8_t node) const { return histories_[node].count; }
  // kEmcyClasses[which].
  std::uint8_t of_class(std::size_t which) const { return classes_[which]; }
  // Whether the last EMCY reported an error. Error code 0000h with error register 0 means that the
  // node is free of errors.
  bool erroneous(std::uint8_t node) const { return histories_[node].erroneous; }

  // In the format of 5F18h: U8 position of the last message, 1..4, 0 = none; then up to four
  // messages of 8 bytes as received. The fifth message overwrites the first.
  std::span<const std::byte> history(std::uint8_t node) const;

 private:
  struct History {
    std::array<std::byte, kLongest> bytes{};
    std::uint8_t kept = 0;
    std::uint8_t count = 0;
    bool erroneous = false;
  };
  std::array<History, can::kMaxNodeId + 1> histories_{};
  std::array<std::uint8_t, kEmcyClasses.size()> classes_{};
};

}  // namespace linegate::diagnosis
