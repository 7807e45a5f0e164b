// SPDX-License-Identifier: Apache-2.0
// The parameters of one SRDO (EN 50325-5: objects 1301h to 1340h, 1381h to 13C0h, 13FEh, 13FFh) as
// plain values.
#pragma once

#include <cstdint>
#include <vector>

#include "stack/base/diagnostic.h"
#include "stack/base/time.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"
#include "stack/pdo/parameters.h"

namespace linegate::srdo {

inline constexpr std::uint8_t kMaxSrdo = 64;               // records 1301h.. and 1381h..
inline constexpr std::uint8_t kMaxMapped = 16;             // entries of a mapping record
inline constexpr std::uint8_t kConfigurationValid = 0xA5;  // 13FEh

inline constexpr std::uint16_t kFirstCobId = 0x101;  // COB-ID 1 is odd, COB-ID 2 the next
inline constexpr std::uint16_t kLastCobId = 0x17F;

// Sub-indices of 1301h..
inline constexpr std::uint8_t kDirection = 1;
inline constexpr std::uint8_t kCycleTime = 2;
inline constexpr std::uint8_t kValidationTime = 3;
inline constexpr std::uint8_t kTransmissionType = 4;
inline constexpr std::uint8_t kCobId = 5;
inline constexpr std::uint8_t kInvertedCobId = 6;

constexpr std::uint16_t communication_record(std::uint8_t number) {
  return static_cast<std::uint16_t>(od::objects::kSrdoCommunication + number - 1);
}
constexpr std::uint16_t mapping_record(std::uint8_t number) {
  return static_cast<std::uint16_t>(od::objects::kSrdoMapping + number - 1);
}
// 1300h to 13FFh: a write to any of them but 13FEh and 13FFh makes the configuration invalid.
constexpr bool is_srdo_object(std::uint16_t index) {
  return index >= od::objects::kFailSafeCommand && index <= od::objects::kSrdoSignature;
}
// The number of the SRDO of a record 1301h to 1340h or 1381h to 13C0h; 0 = no such record.
constexpr std::uint8_t number_of(std::uint16_t index) {
  const auto within = [index](std::uint16_t first) {
    return index >= first && index < first + kMaxSrdo ? index - first + 1 : 0;
  };
  const int number = within(od::objects::kSrdoCommunication) + within(od::objects::kSrdoMapping);
  return static_cast<std::uint8_t>(number);
}

enum class Direction : std::uint8_t { off = 0, transmit = 1, receive = 2 };

struct Parameters {
  std::uint8_t number = 1;
  Direction direction = Direction::off;
  std::uint16_t cycle_ms = 0;      // sub 2: refresh time (transmit), or SCT (receive)
  std::uint8_t validation_ms = 0;  // sub 3: SRVT
  std::uint32_t cob_id = 0;
  std::uint32_t inverted_cob_id = 0;
  std::vector<pdo::Mapping> mapping;  // alternating: an object, its inverted object

  // The objects of the normal frame.
  std::vector<pdo::Mapping> normal() const;
};

// The identifiers of SRDO 1 of a node with node-ID 1..64, unless they are configured.
constexpr std::uint32_t default_cob_id(std::uint8_t node) {
  return 0xFFU + 2U * node;
}

// The signature in 13FFh: CRC-16 (polynomial 1021h, start 0) over sub-indices 1, 2, 3, 5 and 6 of
// 1301h.., then the number of entries of 1381h.. and, for each, its sub-index and its value, all
// little-endian. The identifiers are those in force, also if they are the default ones, as
// CANopenNode computes it.
std::uint16_t signature(const Parameters& srdo);

// An SRDO as the records of a device describe it.
struct Description {
  Parameters parameters;
  bool usable = false;  // it has a direction, and no error is in its parameters
};

// Whether the configuration sets a parameter of the SRDO.
bool is_configured(const od::DeviceDescription& device, std::uint8_t number);

// The SRDO with that number, with its errors: an identifier that is none, a time that is 0, and
// objects that do not exist, have another length, or are not in pairs. An SRDO whose records are
// not configured and have errors is left out with a warning, as with PDOs. A signature in 13FFh
// that does not match is reported, too; signatures of 0 are those of devices that are not
// configured, unless 13FEh is A5h.
Description describe_srdo(const od::DeviceDescription& device, std::uint8_t number,
                          std::vector<Diagnostic>& diagnostics);

// Those that are usable, ascending by number.
Loaded<std::vector<Parameters>> describe_srdos(const od::DeviceDescription& device);

// As the PDO of a manager that receives the SRDO: its number is above those of PDOs, see
// image::kFirstSrdo.
pdo::Parameters as_pdo(const Parameters& srdo);

}  // namespace linegate::srdo
