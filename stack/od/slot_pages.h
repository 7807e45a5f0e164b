// SPDX-License-Identifier: Apache-2.0
// The index of a Dictionary: a slot for each object index, in pages of 256 that are allocated on
// demand and then never move; and the short values of sub-index 0, which most objects have. Private
// to Dictionary, except for the declarations that its header uses.
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

// The result of the fast read path.
struct Glance {
  std::uint32_t word = 0;  // the bytes of the value, little-endian
  std::uint32_t size = 0;  // in bytes, 1 to 4; 0: not readable this way, use read()
};

struct Slot {
  enum class Kind : std::uint8_t { none, plain, window };

  // plain: by sub-index, highest + 1 elements; a gap has DataType::none. window: sub-index 0, and
  // the first element.
  Variable* variables = nullptr;
  std::uint32_t details = 0;  // position of the ObjectDetails
  std::uint8_t highest = 0;   // highest sub-index
  Kind kind = Kind::none;
};

inline constexpr std::size_t kLongestShort = 8;

// The value of sub-index 0, if its type has a fixed size of at most 8 bytes; padded with 0.
using ShortValue = std::array<std::byte, kLongestShort>;

class SlotPages {
 public:
  // nullptr if the object does not exist.
  Slot* find(std::uint16_t index) const {
    Page* const page = pages_[index >> 8U].get();
    if (page == nullptr) {
      return nullptr;
    }
    Slot& slot = page->slots[index & 0xFFU];
    return slot.kind == Slot::Kind::none ? nullptr : &slot;
  }

  // Whether an object with the same high byte was ever added.
  bool has_page(std::uint16_t index) const { return pages_[index >> 8U] != nullptr; }

  // Like Dictionary::glance().
  Glance glance(Address address) const {
    const Page* const page = pages_[address.index >> 8U].get();
    if (page == nullptr || address.sub != 0) {
      return {};
    }
    const std::size_t place = address.index & 0xFFU;
    return {load_le<std::uint32_t>(page->values[place].data()), page->glances[place]};
  }
  // Sets the size that glance() returns; 0: not readable by glance(). Precondition: the page of the
  // index exists.
  void set_glance(std::uint16_t index, std::uint8_t bytes) {
    LINEGATE_ASSERT(has_page(index), "the index has a place");
    pages_[index >> 8U]->glances[index & 0xFFU] = bytes;
  }

  // The slot of an index, whether it has an object or not.
  Slot& place(std::uint16_t index) { return page(index).slots[index & 0xFFU]; }
  ShortValue& value(std::uint16_t index) { return page(index).values[index & 0xFFU]; }
  // Resets the slot of the index. Precondition: the page of the index exists.
  void clear(std::uint16_t index) {
    place(index) = Slot{};
    value(index) = ShortValue{};
    set_glance(index, 0);
  }

 private:
  // The data that glance() reads are adjacent, so that those of many objects stay in the cache.
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
