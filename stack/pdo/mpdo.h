// SPDX-License-Identifier: Apache-2.0
// Multiplexed PDOs (CiA 301, 7.2.2.6): one value with its address in the consumer (destination
// address mode) or in the producer (source address mode), and the object lists of source address
// mode.
//
// Frame of 8 bytes:
//   byte 0     bit 7: 1 = destination, 0 = source address mode; bits 0..6: node-ID of the consumer
//              (0 = all) or of the producer (1..127)
//   byte 1..2  index, byte 3 sub-index
//   byte 4..7  the value, little-endian, unused bytes 0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "stack/can/frame.h"
#include "stack/od/dictionary.h"
#include "stack/od/objects.h"

namespace linegate::pdo {

enum class MpdoMode : std::uint8_t { none, source, destination };

// Sub-index 0 of the mapping record of a multiplexed PDO. In a TPDO in destination address mode,
// sub-index 1 maps the object whose value it sends.
inline constexpr std::uint8_t kSourceMode = 254;
inline constexpr std::uint8_t kDestinationMode = 255;

inline constexpr std::uint16_t kMpdoLists = 48;  // number of objects of each list

struct Mpdo {
  static constexpr std::size_t kMaxValue = 4;

  MpdoMode mode = MpdoMode::none;
  std::uint8_t node = 0;
  od::Address address;
  std::array<std::byte, kMaxValue> value{};
};

using MpdoData = std::array<std::byte, can::kMaxClassicData>;
// Precondition: the mode is not none.
MpdoData encode(const Mpdo& mpdo);
// Returns nothing if the frame does not have 8 bytes, or its producer's node-ID is 0.
std::optional<Mpdo> decode_mpdo(const can::Frame& frame);

// Consecutive variables of one object.
struct MpdoBlock {
  od::Address first;
  std::uint8_t count = 1;  // 0 counts as 1

  bool contains(od::Address address) const {
    return address.index == first.index && address.sub >= first.sub &&
           address.sub - first.sub < (count == 0 ? 1 : count);
  }
};

// 1FA0h to 1FCFh: the objects that may be sent. Bits 31..24 of an entry: block size, 23..8:
// index, 7..0: first sub-index.
class ScannerList {
 public:
  static MpdoBlock entry(std::uint32_t raw);

  // Reads the objects; entries of 0 are unused. Allocates.
  void read(const od::Dictionary& dictionary);
  bool contains(od::Address address) const;
  // Calls visit(address) for each address in the list, whether the object exists or not.
  template <class Visitor>
  void for_each(Visitor visit) const {
    for (const MpdoBlock& block : blocks_) {
      const unsigned end = block.first.sub + std::max(1U, unsigned{block.count});
      for (unsigned sub = block.first.sub; sub < end && sub < 0xFF; ++sub) {
        visit(od::Address{block.first.index, static_cast<std::uint8_t>(sub)});
      }
    }
  }

 private:
  std::vector<MpdoBlock> blocks_;  // ascending by index
};

// 1FD0h to 1FFFh: the producers and their objects that are received. Bits 63..56 of an entry: block
// size, 55..40: own index, 39..32: own first sub-index, 31..16: the producer's index, 15..8: its
// first sub-index, 7..0: its node-ID.
class DispatcherList {
 public:
  struct Entry {
    std::uint8_t node = 0;
    MpdoBlock remote;
    od::Address local;
  };
  static Entry entry(std::uint64_t raw);

  // Reads the objects; entries of 0 are unused. Allocates.
  void read(const od::Dictionary& dictionary);

  std::size_t size() const { return entries_.size(); }

  // Calls visit(address) for each own object that receives this value of this node, in the order of
  // the list.
  template <class Visitor>
  void for_each(std::uint8_t node, od::Address address, Visitor visit) const {
    const auto [first, last] = entries_of(node, address.index);
    for (std::size_t i = first; i < last && i < entries_.size(); ++i) {
      const Entry entry = entries_[i];
      if (entry.remote.contains(address)) {
        const int sub = entry.local.sub + address.sub - entry.remote.first.sub;
        visit(od::Address{entry.local.index, static_cast<std::uint8_t>(sub)});
      }
    }
  }

 private:
  std::pair<std::size_t, std::size_t> entries_of(std::uint8_t node, std::uint16_t index) const;

  std::vector<Entry> entries_;  // ascending by node and index of the producer
};

// Result of a write to an entry of one of the lists: invalid_value for a producer outside
// of 1..127; no_object, no_sub_index, not_mappable (not at all, not in this direction, or longer
// than 4 bytes) for the device's own object. 0 (an unused entry) is always valid.
AbortCode check_mpdo_list_write(const od::Dictionary& dictionary, od::Address address,
                                std::span<const std::byte> value);

// Returns none if the variable may be sent (received) by MPDO, otherwise an abort code as above.
AbortCode check_mpdo_object(const od::Dictionary& dictionary, bool received, od::Address address);

constexpr bool is_scanner_list(std::uint16_t index) {
  return index >= od::objects::kScannerList && index < od::objects::kScannerList + kMpdoLists;
}
constexpr bool is_dispatcher_list(std::uint16_t index) {
  return index >= od::objects::kDispatcherList && index < od::objects::kDispatcherList + kMpdoLists;
}

}  // namespace linegate::pdo
