// SPDX-License-Identifier: Apache-2.0
// Communication and mapping parameters of one PDO (CiA 301, 7.5.2.35 to 7.5.2.38) as plain values.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "stack/base/diagnostic.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"
#include "stack/pdo/mpdo.h"

namespace linegate::pdo {

// Number of records at 1400h.., 1600h.., 1800h.., 1A00h.. each.
inline constexpr std::uint16_t kMaxPdo = 512;
inline constexpr std::uint8_t kMaxMapped = 64;  // entries of one mapping record

enum class PdoKind : std::uint8_t { rpdo, tpdo };

constexpr std::string_view name(PdoKind kind) {
  return kind == PdoKind::rpdo ? "RPDO" : "TPDO";
}

// First indices of the records.
constexpr std::uint16_t communication_base(PdoKind kind) {
  return kind == PdoKind::rpdo ? od::objects::kRpdoCommunication : od::objects::kTpdoCommunication;
}
constexpr std::uint16_t mapping_base(PdoKind kind) {
  return kind == PdoKind::rpdo ? od::objects::kRpdoMapping : od::objects::kTpdoMapping;
}

// Transmission types.
inline constexpr std::uint8_t kSyncAcyclic = 0;
inline constexpr std::uint8_t kLastCyclic = 240;
inline constexpr std::uint8_t kRtrOnSync = 252;  // TPDO: sampled at SYNC, sent on request
inline constexpr std::uint8_t kRtrEvent = 253;   // TPDO: sampled and sent on request
inline constexpr std::uint8_t kEventManufacturer = 254;
inline constexpr std::uint8_t kEventProfile = 255;

constexpr bool is_synchronous(std::uint8_t type) {
  return type <= kLastCyclic;
}
constexpr bool is_on_request(std::uint8_t type) {
  return type == kRtrOnSync || type == kRtrEvent;
}
constexpr bool is_event_driven(std::uint8_t type) {
  return type >= kEventManufacturer;
}

// One entry of a mapping record: index << 16 | sub-index << 8 | bits.
struct Mapping {
  od::Address address;
  std::uint8_t bits = 0;

  constexpr std::uint32_t raw() const {
    return std::uint32_t{address.index} << 16U | std::uint32_t{address.sub} << 8U | bits;
  }
  static constexpr Mapping from_raw(std::uint32_t raw) {
    return {{static_cast<std::uint16_t>(raw >> 16U), static_cast<std::uint8_t>(raw >> 8U)},
            static_cast<std::uint8_t>(raw)};
  }
};

struct Parameters {
  std::uint16_t number = 1;           // 1..512; above: internal to the manager, without an object
  can::CobId cob_id;                  // sub 1
  std::uint8_t type = kEventProfile;  // sub 2
  Duration inhibit{};                 // sub 3, multiples of 100 us
  Duration event_timer{};             // sub 5, ms; RPDO: deadline
  std::uint8_t sync_start = 0;        // sub 6
  // Of a PDO of the own node: the mode of a multiplexed PDO. In destination address mode a TPDO
  // maps the object that it sends; other multiplexed PDOs map nothing.
  MpdoMode mpdo = MpdoMode::none;
  std::vector<Mapping> mapping;  // at most 64 bits in total (CAN FD: 512)
};

// Devices with CANopenNode map a BOOLEAN as a byte, whose lowest bit is the value.
constexpr bool is_boolean_in_a_byte(const Mapping& mapping, od::DataType type) {
  return mapping.bits == 8 && type == od::DataType::boolean;
}

// The PDOs of a device by its file: every record with a valid COB-ID (see described_cob_id()) and a
// mapping. Diagnostics name the device file and the line of the object. A PDO cannot be used if it
// maps objects that do not exist or have another length, more bits than max_bits, or more entries
// than permitted, or has a reserved COB-ID: an error if its records were configured, otherwise one
// warning, and the PDO is left out. Further warnings: objects that may not be mapped, or not in
// this direction, because the device may send them nevertheless; BOOLEAN with 8 bits; PDOs without
// a mapping record and multiplexed ones, which are left out.
struct DevicePdos {
  std::vector<Parameters> tpdos;  // ascending by number
  std::vector<Parameters> rpdos;
};
Loaded<DevicePdos> describe_pdos(const od::DeviceDescription& device, std::size_t max_bits = 64);

// One of these PDOs, with each of its errors. No value and no error: there is no such PDO, it is
// not valid, or it maps nothing.
Loaded<Parameters> describe_pdo(const od::DeviceDescription& device, PdoKind kind,
                                std::uint16_t number, std::size_t max_bits = 64);

// The mapping of a PDO of which only the length in bytes is known, 1 to 8, or on a line of CANopen
// FD 1 to 24 (31 would fit): one entry of the image with the raw content, named by the COB-ID.
inline Mapping raw_mapping(std::size_t bytes) {
  return {{0, 0}, static_cast<std::uint8_t>(8 * bytes)};
}
inline bool is_raw(const Mapping& mapping) {
  return mapping.address == od::Address{0, 0};
}

}  // namespace linegate::pdo
