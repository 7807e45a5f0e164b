// SPDX-License-Identifier: Apache-2.0
// Finds the TPDOs that send an object of the device. Used for every change of a value, so the time
// does not depend on the number of TPDOs.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "stack/od/description.h"

namespace linegate::pdo {

struct ObjectSource {
  od::Address address;
  std::uint16_t slot = 0;

  friend constexpr auto operator<=>(ObjectSource, ObjectSource) = default;
};

class ObjectSources {
 public:
  // Removes duplicates. Precondition: fewer than 65535 sources remain.
  void assign(std::vector<ObjectSource> sources) {
    std::ranges::sort(sources);
    sources.erase(std::unique(sources.begin(), sources.end()), sources.end());
    sources_ = std::move(sources);
    const std::size_t room = std::bit_ceil(2 * sources_.size() + 1);
    places_.assign(room, kNone);
    shift_ = 32U - static_cast<unsigned>(std::countr_zero(room));
    for (std::size_t i = sources_.size(); i-- > 0;) {
      places_[find(sources_[i].address)] = static_cast<std::uint16_t>(i);
    }
  }

  // Ascending by address, and by slot within one.
  const std::vector<ObjectSource>& all() const { return sources_; }

  // Calls visit(slot) for each TPDO that sends the object; visit may call assign(), which ends the
  // loop.
  template <class Visitor>
  void for_each(od::Address address, Visitor visit) const {
    if (places_.empty()) {
      return;
    }
    for (std::size_t i = places_[find(address)];
         i < sources_.size() && sources_[i].address == address; ++i) {
      visit(sources_[i].slot);
    }
  }

 private:
  static constexpr std::uint16_t kNone = 0xFFFF;

  // Returns the place of the address, or a free place, which always exists.
  std::size_t find(od::Address address) const {
    const std::uint32_t key = std::uint32_t{address.index} << 8U | address.sub;
    std::size_t at = shift_ < 32 ? key * 0x9E37'79B1U >> shift_ : 0U;
    while (places_[at] != kNone && sources_[places_[at]].address != address) {
      at = (at + 1) & (places_.size() - 1);
    }
    return at;
  }

  std::vector<ObjectSource> sources_;
  // Hash table of indices in sources_ of the first of each address; at most half full.
  std::vector<std::uint16_t> places_;
  unsigned shift_ = 32;
};

}  // namespace linegate::pdo
