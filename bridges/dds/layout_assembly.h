// SPDX-License-Identifier: Apache-2.0
// Assembles published layouts from their parts.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include <linegate.h>

#include "stack/image/layout.h"

namespace linegate::dds {

class LayoutAssembly {
 public:
  // Returns true if the part completes a layout, and copies it to `out`; all its entries lie within
  // byte_size. A layout is returned once, and again only after one of its parts changed: names,
  // groups and initial values may, without another layout_id. Parts that are inconsistent, violate
  // the contract or exceed the limits are ignored.
  bool take(const v1::ImageLayout& part, image::Layout& out);

 private:
  using Key = std::tuple<std::string, std::string, std::uint8_t>;  // gateway, line, direction

  struct Known {
    std::uint64_t incarnation = 0;  // of the layout returned last
    std::uint64_t layout_id = 0;
    // The newest of each, of any layout
    std::map<std::uint16_t, v1::ImageLayout> parts;
  };
  static bool complete(const Known& known, const v1::ImageLayout& part);

  std::map<Key, Known> layouts_;
};

}  // namespace linegate::dds
