// SPDX-License-Identifier: Apache-2.0
// Where a Dictionary finds an object: a slot per index, in pages of 256 that are made when they are
// needed and then stay where they are; and the short values of sub-index 0, as most objects have.
// Part of Dictionary; only what it calls in its header is meant for others.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/od/description.h"

namespace linegate::od {

struct Variable;

// What reading takes where no more than a glance is needed.
struct Glance {
  std::uint32_t word = 0;  // the bytes of the value, little-endian
  std::uint32_t size = 0;  // bytes, 1 to 4; 0: a glance is not enough, use read()
};

struct Slot {
  enum class Kind : std::uint8_t { none, plain, window };

  // plain: by sub-index, highest + 1 of them; a gap has DataType::none. window: sub-index 0, and
  // the first element.
  Variable* variables = nullptr;
  std::uint32_t details = 0;  // position of the ObjectDetails
  std::uint8_t highest = 0;   // sub-index
  Kind kind = Kind::none;
};

inline constexpr std::size_t kLongestShort = 8;

// The value of sub-index 0, if its type is of fixed size and has no more than 8 bytes; 0 above.
using ShortValue = std::array<std::byte, kLongestShort>;

class SlotPages {
 public:
  // nullptr if there is no object.
  Slot* find(std::uint16_t index) const {
    Page* const page = pages_[index >> 8U].get();
    if (page == nullptr) {
      return nullptr;
    }
    Slot& slot = page->slots[index & 0xFFU];
    return slot.kind == Slot::Kind::none ? nullptr : &slot;
  }

  // Whether there ever was an object with the same high byte.
  bool has_page(std::uint16_t index) const { return pages_[index >> 8U] != nullptr; }

  // As Dictionary::glance().
  Glance glance(Address address) const {
    const Page* const page = pages_[address.index >> 8U].get();
    if (page == nullptr || address.sub != 0) {
      return {};
    }
    const std::size_t place = address.index & 0xFFU;
    return {load_le<std::uint32_t>(page->values[place].data()), page->glances[place]};
  }
  // Bytes of the value as glance() gives them; 0: none. Precondition: the index has a place.
  void set_glance(std::uint16_t index, std::uint8_t bytes) {
    LINEGATE_ASSERT(has_page(index), "the index has a place");
    pages_[index >> 8U]->glances[index & 0xFFU] = bytes;
  }

  // The place for an object, whether there is one or not.
  Slot& place(std::uint16_t index) { return page(index).slots[index & 0xFFU]; }
  ShortValue& value(std::uint16_t index) { return page(index).values[index & 0xFFU]; }
  // As if there had never been an object. Precondition: the index has a place.
  void clear(std::uint16_t index) {
    place(index) = Slot{};
    value(index) = ShortValue{};
    set_glance(index, 0);
  }

 private:
  // What a glance needs lies close together, so that those of many objects are in the cache.
  struct alignas(64) Page {
    std::array<std::uint8_t, 256> glances{};
    std::array<ShortValue, 256> values{};
    std::array<Slot, 256> slots{};
  };

  Page& page(std::uint16_t index) {
    std::unique_ptr<Page>& page = pages_[index >> 8U];
    if (page == nullptr) {
      page = std::make_unique<Page>();
    }
    return *page;
  }

  std::array<std::unique_ptr<Page>, 256> pages_;
};

}  // namespace linegate::od
