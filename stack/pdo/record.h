// SPDX-License-Identifier: Apache-2.0
// The PDO records 1400h..15FFh, 1600h..17FFh, 1800h..19FFh, 1A00h..1BFFh of a dictionary: reads
// them and checks writes to them (CiA 301, 7.5.2.35 to 7.5.2.38).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "stack/base/abort_code.h"
#include "stack/od/dictionary.h"
#include "stack/pdo/mapping.h"
#include "stack/pdo/mpdo.h"
#include "stack/pdo/parameters.h"

namespace linegate::pdo {

struct RecordIndex {
  PdoKind kind = PdoKind::rpdo;
  bool mapping = false;      // 16xxh, 1Axxh; else 14xxh, 18xxh
  std::uint16_t number = 1;  // 1..512
};
// Returns nothing if the index is not that of a PDO record.
std::optional<RecordIndex> record_index(std::uint16_t index);

// Communication parameters (without the mapping) of the record; for missing sub-indices the
// defaults of Parameters. Returns nothing if there is no record.
std::optional<Parameters> read_communication(const od::Dictionary& dictionary, PdoKind kind,
                                             std::uint16_t number);

// Entries 1..n of the mapping record, n = its sub-index 0; empty if there is no record, n is 0, or
// the record has fewer entries.
std::vector<Mapping> read_mapping(const od::Dictionary& dictionary, PdoKind kind,
                                  std::uint16_t number);

// source or destination by sub-index 0 of the mapping record, else none.
MpdoMode read_mpdo_mode(const od::Dictionary& dictionary, PdoKind kind, std::uint16_t number);

// Checks a multiplexed PDO: returns none, or why it cannot be used, as in check_record_write(). Of
// several TPDOs in source address mode only the first can be used.
AbortCode check_mpdo(const od::Dictionary& dictionary, PdoKind kind, std::uint16_t number);

// Returns none, or invalid_value: 241..251 are reserved; 252 and 253 are valid for TPDOs only, and
// use remote frames, which CAN FD does not have. max_bits: the longest PDO, above 64 on a CAN FD
// line.
AbortCode check_transmission_type(PdoKind kind, std::uint64_t type, std::size_t max_bits);

// Checks a write to a PDO record. Returns none, or the abort code. max_bits: the longest PDO.
//
// The order of a new mapping is: COB-ID invalid, sub-index 0 = 0, entries, sub-index 0 = n, COB-ID
// valid. Abort codes:
//   device_state (0800 0022h)   while the PDO is valid: COB-ID bits other than 31, inhibit time
//                               (TPDO), SYNC start value
//   unsupported_access (0601 0000h)  the mapping while the PDO is valid; entries while sub-index 0
//                               is not 0
//   invalid_value (0609 0030h)  a valid COB-ID with a restricted CAN-ID; types by
//                               check_transmission_type(); SYNC start value above 240
//   no_object (0602 0000h), no_sub_index (0609 0011h), not_mappable (0604 0041h), length_mismatch
//                               (0607 0010h)  by check_mapping() and check_granularity()
//   pdo_length_exceeded (0604 0042h)  entries 1..n have more than max_bits; more entries than the
//                               record has
//   parameter_incompatible (0604 0043h)  a multiplexed PDO (sub-index 0 of the mapping 254 or 255)
//                               that is not of type 254 or 255; a second TPDO in source address
//                               mode, of which a device has one
// The codes from no_object on are returned when an entry or sub-index 0 is written, and when the
// COB-ID becomes valid. The value 0 is always valid for an entry, because it maps nothing until
// sub-index 0 includes it.
AbortCode check_record_write(const od::Dictionary& dictionary, od::Address address,
                             std::span<const std::byte> value, std::size_t max_bits);

}  // namespace linegate::pdo
