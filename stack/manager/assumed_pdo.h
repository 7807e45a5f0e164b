// SPDX-License-Identifier: Apache-2.0
// The PDO parameters of a node that the process image relies on (CiA 301 7.5.2.35 to 7.5.2.38):
// COB-ID, transmission type and mapping. They are what the device file says, but a device may have
// stored others (1010h), or another concise DCF may have been written to 1F22h. An SRDO of the
// image is one of these PDOs, without a remedy: a write would invalidate the safety configuration.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "stack/manager/object_write.h"
#include "stack/od/objects.h"

namespace linegate::manager {

// Whether an object with this index is a parameter of a PDO, or of an SRDO (1301h to 1340h, 1381h
// to 13C0h).
constexpr bool is_assumed_object(std::uint16_t index) {
  constexpr std::uint16_t kSrdos = 64;
  const auto is_of = [index](std::uint16_t first) {
    return index >= first && index < first + kSrdos;
  };
  return od::objects::is_pdo_record(index) || is_of(od::objects::kSrdoCommunication) ||
         is_of(od::objects::kSrdoMapping);
}

// COB-IDs as PdoCheck compares them: identifier and frame format.
using CobIds = std::vector<std::uint32_t>;

// One PDO of the image; or one that is not in it, and so must not have the COB-ID of one that is.
struct AssumedPdo {
  // Of a TPDO.
  struct Transmission {
    std::uint16_t record = 0;  // 1800h to 19FFh
    std::uint8_t type = 0;
  };

  // Those that can be changed; of a TPDO there may be none.
  std::vector<ObjectWrite> parameters;
  // The writes that give the device these parameters, in the order of CiA 301 7.5.2.36; empty:
  // nothing is written to it.
  std::vector<ObjectWrite> remedy;
  // Of a PDO that is not in the image: those of PDOs of the image in the same direction. Its only
  // parameter is its COB-ID.
  std::shared_ptr<const CobIds> taken{};
  // Of a TPDO of the image whose transmission type can be changed; nothing for other PDOs.
  std::optional<Transmission> sent{};
};

}  // namespace linegate::manager
