// SPDX-License-Identifier: Apache-2.0
// An application object of the own node's dictionary, 2000h..5EFFh or 6000h..9FFFh.
#pragma once

#include <cstdint>
#include <string_view>

#include "stack/od/description.h"

namespace linegate::line {

// One sub-index. If no sub-index 0 is configured, it is created with the highest sub-index.
struct OwnObject {
  std::uint16_t index = 0;
  od::VariableDescription variable{};  // value: the default
  // Its bytes are in the image: in the inputs if other nodes may write it, else in the outputs.
  bool in_image = false;
  std::uint32_t offset = 0;  // byte offset in the image: of objects that are created at run time
};
// The error of the object taken by itself, as the end of a sentence about it; empty if there is
// none.
std::string_view fault_of(const OwnObject& object);

}  // namespace linegate::line
