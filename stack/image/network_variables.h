// SPDX-License-Identifier: Apache-2.0
// Network variables of CiA 302-4: the bytes of the process image as objects A000h..A8FFh of the
// manager's own dictionary, overlaid (IXXAT CANopen Manager API manual 6.1.3): every type has an
// array over the same bytes, element = offset / size, index = base + element / 254, sub-index = 1 +
// element % 254.
//
// The names are CANopen's: A000h..A47Fh are "input" network variables, sent to the network: the
// OUTPUT area here, read-only by SDO. A480h..A8FFh are "output" network variables, received from
// the network: the INPUT area, writable.
//
// BOOLEAN (A080h, A500h) is our extension, which the IXXAT manager does not have: element = bit
// offset. It allows mapping records to show bit entries. 64 * 254 elements cover the first 2032
// bytes of an area.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "stack/base/result.h"
#include "stack/image/layout.h"
#include "stack/image/process_image.h"
#include "stack/od/dictionary.h"

namespace linegate::image {

// The network variable that shows exactly this range of bits: of the given type if it has an array,
// else of the unsigned integer of the same size. Returns nothing if the range does not consist of
// whole elements or is beyond 64 x 254 elements.
std::optional<od::Address> variable_address(Direction direction, od::DataType type,
                                            std::uint32_t bit_offset, std::uint32_t bit_length);

// The place of a network variable; nothing if the address is not in A000h..A8FFh.
struct VariablePlace {
  Direction direction = Direction::inputs;
  od::DataType type = od::DataType::none;
  std::uint32_t bit_offset = 0;
  std::uint32_t bit_length = 0;
};
std::optional<VariablePlace> variable_place(od::Address address);

// Sub-index 1 of every object with elements that show some of the bits [begin, end), whether the
// object is in a dictionary or not.
std::vector<od::Address> variables_showing(Direction direction, std::uint32_t begin,
                                           std::uint32_t end);

// Adds A000h..A8FFh to the dictionary, with the elements that are in the areas. The image must
// outlive the dictionary. Errors: those of Dictionary::add_window().
Result<void> add_network_variables(od::Dictionary& dictionary, ProcessImage& image);

}  // namespace linegate::image
