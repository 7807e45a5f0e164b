// SPDX-License-Identifier: Apache-2.0
// How a node speaks of its errors in EMCYs that it sends by itself.
#pragma once

#include <cstdint>
#include <string_view>

namespace linegate::node {

// What it says in the manufacturer bytes, and when it sends an error reset. 1001h is the sum of
// what is present either way.
enum class ErrorScheme : std::uint8_t {
  // Bytes 3, 4: PDO number or node-ID, else 0. One error reset, when the last error has gone.
  number,
  // Byte 3: errors that are present (bit 0 error control, 1 error passive, 2 bus-off); byte 4:
  // errors there have been since the last reset (bit 0 CAN controller, 1 frames lost, 2 PDO
  // length); bits 5 to 7 of both are the device's, see Node::set_error_bits(). Byte 5: PDO number
  // (its low byte) or node-ID; bytes 6, 7: length of a PDO received and mapped. An error reset for
  // each error that has gone.
  temporary_and_sticky,
};

constexpr std::string_view name(ErrorScheme scheme) {
  return scheme == ErrorScheme::number ? "number" : "temporary_and_sticky";
}

}  // namespace linegate::node
