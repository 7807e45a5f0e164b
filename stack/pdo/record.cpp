// SPDX-License-Identifier: Apache-2.0
#include "stack/pdo/record.h"

#include <chrono>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/can/frame.h"
#include "stack/od/objects.h"

namespace linegate::pdo {
namespace {

constexpr std::uint8_t kCobId = 1;
constexpr std::uint8_t kType = 2;
constexpr std::uint8_t kInhibit = 3;
constexpr std::uint8_t kEventTimer = 5;
constexpr std::uint8_t kSyncStart = 6;

std::uint16_t communication_index(const RecordIndex& record) {
  return static_cast<std::uint16_t>(communication_base(record.kind) + record.number - 1);
}

std::uint16_t mapping_index(const RecordIndex& record) {
  return static_cast<std::uint16_t>(mapping_base(record.kind) + record.number - 1);
}

can::CobId cob_id(const od::Dictionary& dictionary, const RecordIndex& record) {
  const auto raw = dictionary.number({communication_index(record), kCobId});
  return {static_cast<std::uint32_t>(raw.value_or(can::CobId::kInvalidBit))};
}

MpdoMode mpdo_mode(std::uint64_t entries) {
  return entries == kSourceMode        ? MpdoMode::source
         : entries == kDestinationMode ? MpdoMode::destination
                                       : MpdoMode::none;
}

std::uint64_t entry_count(const od::Dictionary& dictionary, const RecordIndex& record) {
  return dictionary.number({mapping_index(record), 0}).value_or(0);
}

// Examines the first `count` TPDOs.
bool is_other_source_tpdo(const od::Dictionary& dictionary, const RecordIndex& record,
                          std::uint16_t count) {
  for (std::uint16_t number = 1; number <= count; ++number) {
    if (number != record.number &&
        entry_count(dictionary, {PdoKind::tpdo, true, number}) == kSourceMode) {
      return true;
    }
  }
  return false;
}

AbortCode check_multiplexed(const od::Dictionary& dictionary, const RecordIndex& record,
                            MpdoMode mode, std::uint16_t others = kMaxPdo) {
  const auto type = dictionary.number({communication_index(record), kType});
  const bool event_driven =
      is_event_driven(static_cast<std::uint8_t>(type.value_or(kEventProfile)));
  const bool only_one = record.kind == PdoKind::tpdo && mode == MpdoMode::source;
  if (!event_driven || (only_one && is_other_source_tpdo(dictionary, record, others))) {
    return AbortCode::parameter_incompatible;
  }
  if (record.kind == PdoKind::rpdo || mode == MpdoMode::source) {
    return AbortCode::none;
  }
  const std::uint64_t raw = dictionary.number({mapping_index(record), 1}).value_or(0);
  const Mapping sent = Mapping::from_raw(static_cast<std::uint32_t>(raw));
  return check_mpdo_object(dictionary, false, sent.address);
}

AbortCode check_entry_count(const od::Dictionary& dictionary, const RecordIndex& record,
                            std::uint64_t count, std::size_t max_bits) {
  if (const MpdoMode mode = mpdo_mode(count); mode != MpdoMode::none) {
    return check_multiplexed(dictionary, record, mode);
  }
  const std::uint16_t index = mapping_index(record);
  if (count > kMaxMapped || count > dictionary.highest_sub(index).value_or(0)) {
    return AbortCode::pdo_length_exceeded;
  }
  std::size_t bits = 0;
  for (std::uint8_t sub = 1; sub <= count; ++sub) {
    const std::uint64_t raw = dictionary.number({index, sub}).value_or(0);
    const Mapping mapping = Mapping::from_raw(static_cast<std::uint32_t>(raw));
    AbortCode why = check_mapping(dictionary, record.kind, mapping);
    why = why == AbortCode::none ? check_granularity(mapping, max_bits) : why;
    if (why != AbortCode::none) {
      return why;
    }
    bits += mapping.bits;
  }
  return bits > max_bits ? AbortCode::pdo_length_exceeded : AbortCode::none;
}

AbortCode check_cob_id(const od::Dictionary& dictionary, const RecordIndex& record,
                       can::CobId wanted, std::size_t max_bits) {
  if (!wanted.valid()) {
    return AbortCode::none;
  }
  // Bit 30 is not part of the identifier.
  if (!can::has_allowed_id({wanted.raw & ~can::CobId::kNoRtrBit})) {
    return AbortCode::invalid_value;
  }
  const can::CobId present = cob_id(dictionary, record);
  if (present.valid()) {
    return present == wanted ? AbortCode::none : AbortCode::device_state;
  }
  const auto entries = dictionary.number({mapping_index(record), 0});
  return entries ? check_entry_count(dictionary, record, *entries, max_bits) : AbortCode::none;
}

AbortCode check_communication(const od::Dictionary& dictionary, const RecordIndex& record,
                              std::uint8_t sub, std::uint64_t value, std::size_t max_bits) {
  const bool valid = cob_id(dictionary, record).valid();
  switch (sub) {
    case kCobId:
      return check_cob_id(dictionary, record, {static_cast<std::uint32_t>(value)}, max_bits);
    case kType:
      if (value < kEventManufacturer &&
          mpdo_mode(entry_count(dictionary, record)) != MpdoMode::none) {
        return AbortCode::parameter_incompatible;
      }
      return check_transmission_type(record.kind, value, max_bits);
    case kInhibit:
      return valid && record.kind == PdoKind::tpdo ? AbortCode::device_state : AbortCode::none;
    case kSyncStart:
      if (value > kLastCyclic) {
        return AbortCode::invalid_value;
      }
      return valid ? AbortCode::device_state : AbortCode::none;
    default:
      return AbortCode::none;
  }
}

// A violation of the order in CiA 301 7.5.2.36 and 7.5.2.38 yields 0601 0000h.
AbortCode check_mapping_record(const od::Dictionary& dictionary, const RecordIndex& record,
                               std::uint8_t sub, std::uint64_t value, std::size_t max_bits) {
  if (cob_id(dictionary, record).valid()) {
    return AbortCode::unsupported_access;
  }
  if (sub == 0) {
    return check_entry_count(dictionary, record, value, max_bits);
  }
  if (dictionary.number({mapping_index(record), 0}).value_or(0) != 0) {
    return AbortCode::unsupported_access;
  }
  const Mapping mapping = Mapping::from_raw(static_cast<std::uint32_t>(value));
  if (value == 0) {
    return AbortCode::none;
  }
  const AbortCode why = check_mapping(dictionary, record.kind, mapping);
  return why == AbortCode::none ? check_granularity(mapping, max_bits) : why;
}

}  // namespace

std::optional<RecordIndex> record_index(std::uint16_t index) {
  if (!od::objects::is_pdo_record(index)) {
    return std::nullopt;
  }
  return RecordIndex{index < od::objects::kTpdoCommunication ? PdoKind::rpdo : PdoKind::tpdo,
                     (index & 0x0200U) != 0, static_cast<std::uint16_t>((index & 0x01FFU) + 1)};
}

std::optional<Parameters> read_communication(const od::Dictionary& dictionary, PdoKind kind,
                                             std::uint16_t number) {
  const RecordIndex record{kind, false, number};
  const std::uint16_t index = communication_index(record);
  if (number > kMaxPdo || !dictionary.has_object(index)) {
    return std::nullopt;
  }
  const auto read = [&](std::uint8_t sub, std::uint64_t otherwise) {
    return dictionary.number({index, sub}).value_or(otherwise);
  };
  Parameters parameters;
  parameters.number = number;
  parameters.cob_id = cob_id(dictionary, record);
  parameters.type = static_cast<std::uint8_t>(read(kType, kEventProfile));
  parameters.inhibit = std::chrono::microseconds(100) * static_cast<int>(read(kInhibit, 0));
  parameters.event_timer = std::chrono::milliseconds(read(kEventTimer, 0));
  parameters.sync_start = static_cast<std::uint8_t>(read(kSyncStart, 0));
  return parameters;
}

std::vector<Mapping> read_mapping(const od::Dictionary& dictionary, PdoKind kind,
                                  std::uint16_t number) {
  const std::uint16_t index = mapping_index({kind, true, number});
  const std::uint64_t count = dictionary.number({index, 0}).value_or(0);
  std::vector<Mapping> mapping;
  if (count > kMaxMapped) {
    return mapping;
  }
  for (std::uint8_t sub = 1; sub <= count; ++sub) {
    const auto raw = dictionary.number({index, sub});
    if (!raw) {
      return {};
    }
    mapping.push_back(Mapping::from_raw(static_cast<std::uint32_t>(*raw)));
  }
  return mapping;
}

MpdoMode read_mpdo_mode(const od::Dictionary& dictionary, PdoKind kind, std::uint16_t number) {
  return number > kMaxPdo ? MpdoMode::none
                          : mpdo_mode(entry_count(dictionary, {kind, true, number}));
}

AbortCode check_mpdo(const od::Dictionary& dictionary, PdoKind kind, std::uint16_t number) {
  return check_multiplexed(dictionary, {kind, true, number},
                           read_mpdo_mode(dictionary, kind, number), number);
}

AbortCode check_transmission_type(PdoKind kind, std::uint64_t type, std::size_t max_bits) {
  const bool reserved = type > kLastCyclic && type < kRtrOnSync;
  const bool rtr = type >= kRtrOnSync && type < kEventManufacturer;
  const bool has_rtr = kind == PdoKind::tpdo && max_bits <= 8 * can::kMaxClassicData;
  return reserved || (rtr && !has_rtr) ? AbortCode::invalid_value : AbortCode::none;
}

AbortCode check_record_write(const od::Dictionary& dictionary, od::Address address,
                             std::span<const std::byte> value, std::size_t max_bits) {
  const std::optional<RecordIndex> record = record_index(address.index);
  if (is_scanner_list(address.index) || is_dispatcher_list(address.index)) {
    return check_mpdo_list_write(dictionary, address, value);
  }
  if (!record || value.size() > sizeof(std::uint64_t)) {
    return AbortCode::none;
  }
  const std::uint64_t number = load_le(value);
  return record->mapping ? check_mapping_record(dictionary, *record, address.sub, number, max_bits)
                         : check_communication(dictionary, *record, address.sub, number, max_bits);
}

}  // namespace linegate::pdo
