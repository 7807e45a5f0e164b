// SPDX-License-Identifier: Apache-2.0
// PDO forwarding between the lines of one process (CiA 302-7): values of objects that are mapped
// both in an RPDO of one line and in a TPDO of another line are forwarded from the first to the
// second.
//
// OWN definition D, defined only here: the values are objects B000h..B8FFh in every line that maps
// them, arranged like the network variables of CiA 302-4 (A000h..). B000h..B47Fh can be mapped in
// RPDOs and TPDOs; B480h..B8FFh are the same values, read-only. Unlike network variables, elements
// of different types do not overlay each other.
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

// The address of an element, counted from 0, in the array of its type, in the first half. A type
// without an array uses that of the unsigned integer of its size. Nothing if there is no array for
// this number of bits, or no such element (64 x 254 of each type).
std::optional<od::Address> forward_address(od::DataType type, std::uint32_t bits,
                                           std::uint32_t element);
// The same value in the second half.
od::Address shown_address(od::Address object);
// The type of an object of the first half, in the order above; nothing for other objects.
std::optional<od::DataType> forward_type(od::Address object);

// One object of the first half.
struct ForwardedObject {
  od::Address address;
  std::string name;
  // Set if the object is an entry of the line's image. Otherwise it has a value of its own, which
  // any PDO can map.
  struct Entry {
    image::Direction direction = image::Direction::inputs;
    std::uint32_t number = 0;
  };
  std::optional<Entry> entry;
};

// The forwarding configuration of one line.
struct Forwarding {
  std::vector<ForwardedObject> objects;
  // PDOs of the own node that are not linked to a configured device. COB-ID and mapping can be
  // changed by SDO, and the forwarding list follows. Their numbers differ from those of linked
  // PDOs.
  std::vector<pdo::Parameters> rpdos;
  std::vector<pdo::Parameters> tpdos;
  // false: a received PDO is an event only for the TPDO with the lowest number among those that map
  // its objects (the forwarding list is attached to the received PDO). true: it is an event for
  // each of them (OWN definition D, literally). Synchronous TPDOs always take the values at the
  // SYNC of their line.
  bool feeds_every_tpdo = false;
};

// Checks the configuration against the PDOs that are linked to devices. file: the line's name.
std::vector<Diagnostic> check(const Forwarding& config, const pdo::LinkPlan& plan,
                              const std::string& file);

// The mapping records of linked PDOs name the objects B000h.. instead of network variables.
// Precondition: check() found no error.
void show_in_records(const Forwarding& config, pdo::LinkPlan& plan);

}  // namespace linegate::routing
