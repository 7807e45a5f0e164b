// SPDX-License-Identifier: Apache-2.0
// The input is used three times: as an image of stored parameters; as an image with a corrected
// length and checksum; and as values to store. Promises: no crash, no part of a damaged image is
// used, an intact image yields the stored values, every single-bit error is detected, and a device
// gets only values that fit its objects.
#include "stack/storage/storage.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/od/dictionary.h"
#include "stack/od/objects.h"
#include "stack/storage/image.h"

#include "tests/fuzz/expect.h"
#include "tests/fuzz/input.h"

namespace {

using namespace linegate;
using storage::Damage;

using Bytes = std::vector<std::byte>;

constexpr std::size_t kHeader = 24;
constexpr std::size_t kCrc = 4;
constexpr std::uint8_t kNodeId = 5;

// The owner that the image names, since the fuzzer would hardly guess another one.
storage::Owner owner_of(std::span<const std::byte> image) {
  storage::Owner owner;
  if (image.size() >= kHeader) {
    owner.node_id = std::to_integer<std::uint8_t>(image[6]);
    for (std::size_t i = 0; i < owner.identity.size(); ++i) {
      owner.identity[i] = load_le<std::uint32_t>(image.data() + 8 + 4 * i);
    }
  }
  return owner;
}

// Checks the promises of the decoder for any bytes. Returns the decoded values, if any.
std::vector<storage::StoredValue> check_decoding(std::span<const std::byte> image,
                                                 const storage::Owner& owner) {
  std::vector<storage::StoredValue> values(1);  // decode() must discard previous values
  const Damage damage = storage::decode(image, owner, values);
  LINEGATE_EXPECT(damage != Damage::unreadable && damage != Damage::unusable);
  LINEGATE_EXPECT(damage == Damage::none || values.empty());
  if (damage == Damage::none && !image.empty()) {
    std::vector<storage::StoredValue> again;
    LINEGATE_EXPECT(storage::decode(storage::encode(owner, values), owner, again) == Damage::none);
    LINEGATE_EXPECT(again == values);
    storage::Owner other = owner;
    other.identity[1] ^= 1U;
    LINEGATE_EXPECT(storage::decode(image, other, again) == Damage::owner && again.empty());
  }
  return values;
}

od::ObjectDescription object(std::uint16_t index, od::DataType type, std::size_t size) {
  od::VariableDescription variable;
  variable.type = type;
  variable.access = od::Access::rw;
  variable.value.resize(size);
  variable.store = true;
  od::ObjectDescription out;
  out.index = index;
  out.variables.push_back(std::move(variable));
  return out;
}

// A device that finds this image at power-on.
void check_device(const Bytes& image) {
  od::DeviceDescription device;
  device.objects = {
      object(0x1017, od::DataType::unsigned16, 2), object(0x2001, od::DataType::unsigned8, 1),
      object(0x2002, od::DataType::unsigned64, 8), object(0x2003, od::DataType::visible_string, 4),
      object(0x2004, od::DataType::domain, 3)};
  od::Dictionary dictionary(device);
  storage::MemoryMedium medium;
  (void)medium.keep(image);
  storage::Storage stored(dictionary, kNodeId);
  stored.set_medium(&medium);
  const Damage damage = stored.load();
  LINEGATE_EXPECT(damage == Damage::none || stored.stored().empty());
  const bool any = stored.apply(true);
  LINEGATE_EXPECT(any == !stored.stored().empty());
  const auto all = stored.stored();
  for (auto value = all.begin(); value != all.end(); ++value) {
    const auto variable = dictionary.find(value->address);
    const bool last = std::none_of(value + 1, all.end(), [&](const storage::StoredValue& other) {
      return other.address == value->address;
    });
    LINEGATE_EXPECT(variable && variable->store);
    LINEGATE_EXPECT(!last || std::ranges::equal(variable->bytes(), value->data));
  }
  LINEGATE_EXPECT(dictionary.find({0x1017, 0})->size == 2);
  LINEGATE_EXPECT(dictionary.find({0x2002, 0})->size == 8);
  LINEGATE_EXPECT(dictionary.find({0x2003, 0})->size <= 64);
  // The device can read the image that it stores.
  const std::uint32_t save = storage::kSave;
  constexpr od::Address kAll{od::objects::kStoreParameters, 1};
  const auto signature = std::as_bytes(std::span(&save, 1));
  LINEGATE_EXPECT(stored.check_write(kAll, signature) == AbortCode::none && stored.kept() == 0);
  LINEGATE_EXPECT(stored.execute_write(kAll, signature) == AbortCode::none && stored.kept() == 1);
  LINEGATE_EXPECT(stored.load() == Damage::none);
}

// The input with a valid header, length and checksum. Only the values are those of the input.
Bytes made_right(std::span<const std::byte> input) {
  Bytes image(input.begin(), input.end());
  image.resize(std::max(image.size(), kHeader) + kCrc);
  for (std::size_t i = 0; i < 4; ++i) {
    image[i] = static_cast<std::byte>("LGSP"[i]);
  }
  store_le(image.data() + 4, std::uint16_t{1});
  image[6] = std::byte{kNodeId};
  std::fill_n(image.begin() + 8, 12, std::byte{0});
  const std::size_t body = image.size() - kCrc;
  store_le(image.data() + kHeader - 4, static_cast<std::uint32_t>(body - kHeader));
  store_le(image.data() + body, storage::crc32(std::span(image).first(body)));
  return image;
}

void check_values(fuzz::Input input) {
  storage::Owner owner{.node_id = input.byte()};
  const std::size_t broken = input.word();
  std::vector<storage::StoredValue> values;
  while (!input.empty() && values.size() < 64) {
    const std::uint16_t index = input.word();
    const std::uint8_t sub = input.byte();
    values.push_back({{index, sub}, input.bytes(input.byte())});
  }
  Bytes image = storage::encode(owner, values);
  LINEGATE_EXPECT(check_decoding(image, owner) == values);
  std::vector<storage::StoredValue> none;
  const std::size_t bit = broken % (image.size() * 8);
  image[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
  LINEGATE_EXPECT(storage::decode(image, owner, none) != Damage::none && none.empty());
  image.resize(broken % image.size());
  const Damage cut = storage::decode(image, owner, none);
  LINEGATE_EXPECT((cut == Damage::none) == image.empty() && none.empty());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  check_decoding(bytes, owner_of(bytes));
  check_device({bytes.begin(), bytes.end()});
  const Bytes image = made_right(bytes);
  check_decoding(image, {.node_id = kNodeId});
  check_device(image);
  check_values(fuzz::Input({data, size}));
  return 0;
}
