// SPDX-License-Identifier: Apache-2.0
// PDO forwarding between the lines of one process (CiA 302-7): what is mapped in an RPDO of one
// line and in a TPDO of another goes from the one to the other.
//
// OWN definition D, the only place that knows it: the values are objects B000h..B8FFh, in every
// line that maps them, arranged as the network variables of CiA 302-4 (A000h..). B000h..B47Fh may
// be mapped in RPDOs and TPDOs; B480h..B8FFh are the same values, read-only. Unlike network
// variables, elements of different types do not overlay each other.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "stack/base/diagnostic.h"
#include "stack/image/layout.h"
#include "stack/od/data_type.h"
#include "stack/od/description.h"
#include "stack/pdo/parameters.h"

namespace linegate::pdo {
struct LinkPlan;
}

namespace linegate::routing {

// Element 0.. of the array of a type, in the first half. A type without an array takes that of the
// unsigned integer of its size. Nothing if there is no array for so many bits, or no such element
// (64 x 254 of each type).
std::optional<od::Address> forward_address(od::DataType type, std::uint32_t bits,
                                           std::uint32_t element);
// The same value in the second half.
od::Address shown_address(od::Address object);
// The type of an object of the first half, in the order above; nothing if it is none.
std::optional<od::DataType> forward_type(od::Address object);

// One object of the first half.
struct ForwardedObject {
  od::Address address;
  std::string name;
  // It is an entry of the line's image. Else it has a value of its own, which PDOs map at will.
  struct Entry {
    image::Direction direction = image::Direction::inputs;
    std::uint32_t number = 0;
  };
  std::optional<Entry> entry;
};

// What one line has of it.
struct Forwarding {
  std::vector<ForwardedObject> objects;
  // PDOs of the own node for which no device is configured. COB-ID and mapping may be changed over
  // SDO; the list of what is forwarded follows. Their numbers are not those of linked PDOs.
  std::vector<pdo::Parameters> rpdos;
  std::vector<pdo::Parameters> tpdos;
  // Whose event a received PDO is, of the TPDOs that map its objects: of the one with the lowest
  // number alone (the list of what is forwarded hangs on the received PDO), or of each (OWN
  // definition D by the letter). Synchronous ones take the values at the SYNC of their line,
  // always.
  bool feeds_every_tpdo = false;
};

// What is wrong with it, given the PDOs that are linked to devices; file: the line's name.
std::vector<Diagnostic> check(const Forwarding& config, const pdo::LinkPlan& plan,
                              const std::string& file);

// The mapping records of linked PDOs name the objects B000h.. instead of network variables.
// Precondition: check() found no error.
void show_in_records(const Forwarding& config, pdo::LinkPlan& plan);

}  // namespace linegate::routing
