// SPDX-License-Identifier: Apache-2.0
#include "stack/pdo/mpdo.h"

#include <algorithm>
#include <tuple>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/od/objects.h"

namespace linegate::pdo {
namespace {

constexpr std::uint8_t kDestinationBit = 0x80;
constexpr std::uint8_t kNodeBits = 0x7F;
constexpr std::size_t kValueAt = 4;

// Calls visit(raw) for each entry that is not 0.
template <class Visit>
void for_each_entry(const od::Dictionary& dictionary, std::uint16_t first, Visit visit) {
  for (std::uint16_t i = 0; i < kMpdoLists; ++i) {
    const auto index = static_cast<std::uint16_t>(first + i);
    const std::uint64_t count = dictionary.number({index, 0}).value_or(0);
    for (unsigned sub = 1; sub <= count && sub <= 0xFE; ++sub) {
      const auto raw = dictionary.number({index, static_cast<std::uint8_t>(sub)});
      if (raw.value_or(0) != 0) {
        visit(*raw);
      }
    }
  }
}

}  // namespace

MpdoData encode(const Mpdo& mpdo) {
  LINEGATE_ASSERT_HOT(mpdo.mode != MpdoMode::none, "the mode is source or destination");
  MpdoData out{};
  const std::uint8_t mode = mpdo.mode == MpdoMode::destination ? kDestinationBit : std::uint8_t{0};
  out[0] = static_cast<std::byte>(mode | mpdo.node);
  store_le(out.data() + 1, mpdo.address.index);
  out[3] = std::byte{mpdo.address.sub};
  std::ranges::copy(mpdo.value, out.begin() + kValueAt);
  return out;
}

std::optional<Mpdo> decode_mpdo(const can::Frame& frame) {
  if (frame.length != can::kMaxClassicData) {
    return std::nullopt;
  }
  Mpdo out;
  const auto head = std::to_integer<std::uint8_t>(frame.data[0]);
  out.mode = (head & kDestinationBit) != 0 ? MpdoMode::destination : MpdoMode::source;
  out.node = head & kNodeBits;
  out.address = {load_le<std::uint16_t>(frame.data.data() + 1),
                 std::to_integer<std::uint8_t>(frame.data[3])};
  std::copy_n(frame.data.begin() + kValueAt, out.value.size(), out.value.begin());
  return out.mode == MpdoMode::source && out.node == 0 ? std::nullopt : std::optional(out);
}

MpdoBlock ScannerList::entry(std::uint32_t raw) {
  return {{static_cast<std::uint16_t>(raw >> 8U), static_cast<std::uint8_t>(raw)},
          static_cast<std::uint8_t>(raw >> 24U)};
}

void ScannerList::read(const od::Dictionary& dictionary) {
  blocks_.clear();
  for_each_entry(dictionary, od::objects::kScannerList, [this](std::uint64_t raw) {
    blocks_.push_back(entry(static_cast<std::uint32_t>(raw)));
  });
  std::ranges::stable_sort(blocks_, {}, [](const MpdoBlock& block) { return block.first.index; });
}

bool ScannerList::contains(od::Address address) const {
  const auto index = [](const MpdoBlock& block) { return block.first.index; };
  return std::any_of(std::ranges::lower_bound(blocks_, address.index, {}, index),
                     std::ranges::upper_bound(blocks_, address.index, {}, index),
                     [address](const MpdoBlock& block) { return block.contains(address); });
}

DispatcherList::Entry DispatcherList::entry(std::uint64_t raw) {
  return {static_cast<std::uint8_t>(raw),
          {{static_cast<std::uint16_t>(raw >> 16U), static_cast<std::uint8_t>(raw >> 8U)},
           static_cast<std::uint8_t>(raw >> 56U)},
          {static_cast<std::uint16_t>(raw >> 40U), static_cast<std::uint8_t>(raw >> 32U)}};
}

void DispatcherList::read(const od::Dictionary& dictionary) {
  entries_.clear();
  for_each_entry(dictionary, od::objects::kDispatcherList,
                 [this](std::uint64_t raw) { entries_.push_back(entry(raw)); });
  std::ranges::stable_sort(entries_, {}, [](const Entry& entry) {
    return std::tuple(entry.node, entry.remote.first.index);
  });
}

std::pair<std::size_t, std::size_t> DispatcherList::entries_of(std::uint8_t node,
                                                               std::uint16_t index) const {
  const auto from = [](const Entry& entry) {
    return std::tuple(entry.node, entry.remote.first.index);
  };
  const std::tuple wanted(node, index);
  const auto first = std::ranges::lower_bound(entries_, wanted, {}, from);
  const auto last = std::ranges::upper_bound(entries_, wanted, {}, from);
  return {static_cast<std::size_t>(first - entries_.begin()),
          static_cast<std::size_t>(last - entries_.begin())};
}

AbortCode check_mpdo_object(const od::Dictionary& dictionary, bool received, od::Address address) {
  AbortCode why = AbortCode::none;
  const std::optional<od::Variable> variable = dictionary.find(address, &why);
  if (!variable) {
    return why;
  }
  const bool direction =
      received ? od::rpdo_mappable(variable->access) : od::tpdo_mappable(variable->access);
  const unsigned size = od::byte_size(variable->type);
  const bool fits = size != 0 && size <= Mpdo::kMaxValue;
  return variable->mappable && direction && fits ? AbortCode::none : AbortCode::not_mappable;
}

AbortCode check_mpdo_list_write(const od::Dictionary& dictionary, od::Address address,
                                std::span<const std::byte> value) {
  const std::uint64_t raw = load_le(value);
  if (address.sub == 0 || raw == 0) {
    return AbortCode::none;
  }
  if (is_scanner_list(address.index)) {
    const MpdoBlock block = ScannerList::entry(static_cast<std::uint32_t>(raw));
    return check_mpdo_object(dictionary, false, block.first);
  }
  const DispatcherList::Entry entry = DispatcherList::entry(raw);
  if (entry.node == 0 || entry.node > kNodeBits) {
    return AbortCode::invalid_value;
  }
  return check_mpdo_object(dictionary, true, entry.local);
}

}  // namespace linegate::pdo
