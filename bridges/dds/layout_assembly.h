// SPDX-License-Identifier: Apache-2.0
// Puts published layouts together from their parts.
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
  // True: the part completes a layout, which `out` then is: its entries lie within its bytes. A
  // layout is given once, and again only after its incarnation or layout_id changed. What
  // contradicts the contract or itself is ignored, and so is more than any plant has.
  bool take(const v1::ImageLayout& part, image::Layout& out);

 private:
  using Key = std::tuple<std::string, std::string, std::uint8_t>;  // gateway, line, direction

  struct Known {
    std::uint64_t incarnation = 0;  // of the layout given last
    std::uint64_t layout_id = 0;
    std::map<std::uint16_t, v1::ImageLayout> parts;  // the newest of each, of any other layout
  };
  static bool complete(const Known& known, const v1::ImageLayout& part);

  std::map<Key, Known> layouts_;
};

}  // namespace linegate::dds
