// SPDX-License-Identifier: Apache-2.0
#include "stack/storage/image.h"

#include <algorithm>

#include "stack/base/byte_order.h"

namespace linegate::storage {
namespace {

constexpr std::array<std::byte, 4> kMagic{std::byte{'L'}, std::byte{'G'}, std::byte{'S'},
                                          std::byte{'P'}};
constexpr std::uint16_t kVersion = 1;
constexpr std::size_t kHeader = 24;
constexpr std::size_t kCrc = 4;
constexpr std::size_t kValueHeader = 7;

template <class T>
void put(std::vector<std::byte>& out, T number) {
  const std::size_t at = out.size();
  out.resize(at + sizeof number);
  store_le(out.data() + at, number);
}

// Decodes the values of a concise DCF; returns false if it is malformed.
bool read_values(std::span<const std::byte> from, std::vector<StoredValue>& values) {
  if (from.size() < sizeof(std::uint32_t)) {
    return false;
  }
  auto left = load_le<std::uint32_t>(from.data());
  from = from.subspan(sizeof left);
  for (; left > 0 && from.size() >= kValueHeader; --left) {
    const od::Address address{load_le<std::uint16_t>(from.data()),
                              std::to_integer<std::uint8_t>(from[2])};
    const auto size = load_le<std::uint32_t>(from.data() + 3);
    from = from.subspan(kValueHeader);
    if (size > from.size()) {
      return false;
    }
    values.push_back({address, {from.begin(), from.begin() + size}});
    from = from.subspan(size);
  }
  return left == 0 && from.empty();
}

Owner owner_of(std::span<const std::byte> image) {
  Owner owner{.node_id = std::to_integer<std::uint8_t>(image[6])};
  for (std::size_t i = 0; i < owner.identity.size(); ++i) {
    owner.identity[i] = load_le<std::uint32_t>(image.data() + 8 + 4 * i);
  }
  return owner;
}

}  // namespace

std::uint32_t crc32(std::span<const std::byte> bytes) {
  constexpr std::uint32_t kReflected = 0xEDB8'8320;
  std::uint32_t crc = 0xFFFF'FFFF;
  for (const std::byte byte : bytes) {
    crc ^= std::to_integer<std::uint32_t>(byte);
    for (int bit = 0; bit < 8; ++bit) {
      crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? kReflected : 0U);
    }
  }
  return ~crc;
}

std::vector<std::byte> encode(const Owner& owner, std::span<const StoredValue> values) {
  std::vector<std::byte> out(kMagic.begin(), kMagic.end());
  put(out, kVersion);
  out.push_back(std::byte{owner.node_id});
  out.push_back(std::byte{0});
  for (const std::uint32_t number : owner.identity) {
    put(out, number);
  }
  put(out, std::uint32_t{0});
  put(out, static_cast<std::uint32_t>(values.size()));
  for (const StoredValue& value : values) {
    put(out, value.address.index);
    out.push_back(std::byte{value.address.sub});
    put(out, static_cast<std::uint32_t>(value.data.size()));
    out.insert(out.end(), value.data.begin(), value.data.end());
  }
  store_le(out.data() + kHeader - 4, static_cast<std::uint32_t>(out.size() - kHeader));
  put(out, crc32(out));
  return out;
}

Damage decode(std::span<const std::byte> image, const Owner& owner,
              std::vector<StoredValue>& values) {
  values.clear();
  if (image.empty()) {
    return Damage::none;
  }
  if (image.size() < kHeader + kCrc || !std::ranges::equal(image.first(kMagic.size()), kMagic)) {
    return Damage::damaged;
  }
  if (load_le<std::uint16_t>(image.data() + 4) != kVersion) {
    return Damage::version;
  }
  const std::span<const std::byte> checked = image.first(image.size() - kCrc);
  const std::span<const std::byte> body = checked.subspan(kHeader);
  if (load_le<std::uint32_t>(image.data() + kHeader - 4) != body.size() ||
      load_le<std::uint32_t>(image.data() + checked.size()) != crc32(checked)) {
    return Damage::damaged;
  }
  if (owner_of(image) != owner) {
    return Damage::owner;
  }
  if (!read_values(body, values)) {
    values.clear();
    return Damage::damaged;
  }
  return Damage::none;
}

}  // namespace linegate::storage
