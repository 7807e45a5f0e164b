// SPDX-License-Identifier: Apache-2.0
// Stored parameters as bytes. All numbers little-endian:
//    0   4  "LGSP"
//    4   2  version of this format, 1
//    6   1  node-ID
//    7   1  0
//    8  12  1018h:1 to 3 of the device: vendor, product, revision
//   20   4  length of the values in bytes
//   24   n  the values as a concise DCF (CiA 302-3): U32 count, then for each
//           U16 index, U8 sub-index, U32 size, data
//   24+n 4  CRC-32 (IEEE 802.3) of all bytes before
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stack/od/description.h"

namespace linegate::storage {

struct StoredValue {
  od::Address address;
  std::vector<std::byte> data;

  friend bool operator==(const StoredValue&, const StoredValue&) = default;
};

// The device that the parameters belong to: those of another device are rejected.
struct Owner {
  std::uint8_t node_id = 0;
  std::array<std::uint32_t, 3> identity{};  // 1018h:1 to 3, 0 if missing

  friend bool operator==(const Owner&, const Owner&) = default;
};

// The reason why stored parameters cannot be used. The numbers are the first manufacturer byte of
// EMCY 6300h.
enum class Damage : std::uint8_t {
  none = 0,
  unreadable = 1,  // the medium could not read its bytes
  damaged = 2,     // length or CRC is wrong
  version = 3,     // another version of the format
  owner = 4,       // parameters of another device
  unusable = 5,    // a value that the device cannot take: no such object, not stored, wrong size
};

std::uint32_t crc32(std::span<const std::byte> bytes);

std::vector<std::byte> encode(const Owner& owner, std::span<const StoredValue> values);

// Accepts any bytes. values stays empty unless the result is Damage::none. Never returns
// Damage::unreadable or Damage::unusable. An empty image is not damaged: nothing was stored.
Damage decode(std::span<const std::byte> image, const Owner& owner,
              std::vector<StoredValue>& values);

}  // namespace linegate::storage
