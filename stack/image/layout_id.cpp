// SPDX-License-Identifier: Apache-2.0
#include <bit>

#include "stack/image/layout.h"

namespace linegate::image {
namespace {

class Fnv1a {
 public:
  template <class T>
  void add(T value) {
    auto bits = static_cast<std::uint64_t>(value);
    for (std::size_t i = 0; i < sizeof(T); ++i, bits >>= 8U) {
      hash_ = (hash_ ^ (bits & 0xFFU)) * 0x0000'0100'0000'01B3U;
    }
  }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  void add(const std::string& text) {
    add(text.size());
    for (const char c : text) {
      add(static_cast<std::uint8_t>(c));
    }
  }
  template <class T>
  void add(const std::optional<T>& value) {
    add(std::uint8_t{value.has_value()});
    add(value.value_or(T{}));
  }
  std::uint64_t value() const { return hash_ == 0 ? 1 : hash_; }

 private:
  std::uint64_t hash_ = 0xCBF2'9CE4'8422'2325U;
};

void add(Fnv1a& hash, const Entry& entry) {
  hash.add(entry.bit_offset);
  hash.add(entry.bit_length);
  hash.add(entry.type);
  hash.add(entry.node);
  hash.add(entry.index);
  hash.add(entry.sub);
  hash.add(entry.remote_pdo);
  hash.add(entry.local_pdo);
  hash.add(entry.variable_index);
  hash.add(entry.variable_sub);
  hash.add(entry.profile);
  hash.add(entry.product_code);
  hash.add(entry.scaling.unit);
  hash.add(entry.scaling.scale);
  hash.add(entry.scaling.offset);
  hash.add(entry.low);
  hash.add(entry.high);
  hash.add(entry.access);
  hash.add(entry.transmission_type);
  hash.add(entry.inhibit.count());
  hash.add(entry.event_timer.count());
}

}  // namespace

std::uint64_t layout_id(const Layout& layout) {
  Fnv1a hash;
  hash.add(layout.direction);
  hash.add(layout.byte_size);
  for (const Entry& entry : layout.entries) {
    add(hash, entry);
  }
  return hash.value();
}

}  // namespace linegate::image
