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
  // True: the part completes a layout, which `out` then is. A layout is given once, and again only
  // after its incarnation or layout_id changed.
  bool take(const v1::ImageLayout& part, image::Layout& out);

 private:
  struct Partial {
    std::uint64_t incarnation = 0;
    std::uint64_t layout_id = 0;
    bool complete = false;
    std::map<std::uint16_t, v1::ImageLayout> parts;
  };
  std::map<std::tuple<std::string, std::string, std::uint8_t>, Partial> layouts_;
};

}  // namespace linegate::dds
