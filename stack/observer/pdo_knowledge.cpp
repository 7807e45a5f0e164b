// SPDX-License-Identifier: Apache-2.0
#include "stack/observer/pdo_knowledge.h"

#include <algorithm>
#include <array>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/od/objects.h"

namespace linegate::observer {
namespace {

using pdo::PdoKind;

constexpr std::uint32_t kFirstPdoId = 0x180;  // of the pre-defined connection set
constexpr std::uint32_t kEndOfPdoIds = 0x580;

// Values that are written to 1010h and 1011h (CiA 301, 7.5.2.13 and 7.5.2.14).
constexpr std::uint32_t kSave = 0x6576'6173;
constexpr std::uint32_t kLoad = 0x6461'6F6C;
constexpr std::uint8_t kAllParameters = 1;
constexpr std::uint8_t kCommunicationParameters = 2;
constexpr std::uint8_t kFirstOfManufacturer = 4;
constexpr std::uint32_t kStoresItself = 2;

bool is_number(std::span<const std::byte> value, std::uint32_t wanted) {
  return value.size() == sizeof wanted && load_le<std::uint32_t>(value.data()) == wanted;
}

bool stores_itself(const od::DeviceDescription& device) {
  return std::ranges::any_of(std::array{kAllParameters, kCommunicationParameters}, [&](std::uint8_t
                                                                                           sub) {
    const od::VariableDescription* const found = device.find({od::objects::kStoreParameters, sub});
    return found != nullptr && found->value.size() == sizeof kStoresItself &&
           (load_le<std::uint32_t>(found->value.data()) & kStoresItself) != 0;
  });
}

// TPDO 1, RPDO 1, TPDO 2, ... 180h + node, 200h + node, 280h + node, ...
PdoKind predefined_kind(std::uint32_t id) {
  return ((id - kFirstPdoId) >> 7U) % 2 == 0 ? PdoKind::tpdo : PdoKind::rpdo;
}
std::uint16_t number_of(std::uint32_t id) {
  return static_cast<std::uint16_t>(((id - kFirstPdoId) >> 8U) + 1);
}

template <class Range, class Projection, class Value>
auto place_of(Range& range, const Value& value, Projection projection) {
  return std::ranges::lower_bound(range, value, {}, projection);
}

bool takes_number(const std::vector<KnownPdo>& pdos, PdoKind kind, std::uint16_t number) {
  return std::ranges::any_of(pdos, [&](const KnownPdo& known) {
    return known.kind == kind && known.parameters.number == number;
  });
}

}  // namespace

PdoKnowledge::PdoKnowledge(od::DeviceDescription device, std::uint8_t node)
    : device_(std::move(device)), node_(node), stores_itself_(stores_itself(device_)) {
  read_records();
}

bool PdoKnowledge::learn(od::Address address, std::span<const std::byte> value, Seen seen) {
  if (address.index == od::objects::kStoreParameters && seen == Seen::written &&
      is_number(value, kSave)) {
    store(address.sub);
  } else if (address.index == od::objects::kRestoreDefaults && seen == Seen::written &&
             is_number(value, kLoad)) {
    restore(address.sub);
  }
  if (!od::objects::is_pdo_record(address.index) || value.empty()) {
    return false;
  }
  od::VariableDescription& present = variable(address, value.size());
  const bool same = std::ranges::equal(present.value, value);
  const auto found = learned_.find(address);
  if (same && found == learned_.end()) {
    return false;
  }
  Learned& known = found != learned_.end()
                       ? found->second
                       : learned_[address] = {.file = present.value, .stored = present.value};
  note_stored(known, value, seen);
  if (!std::exchange(known.unknown, false) && same) {
    return false;
  }
  present.value.assign(value.begin(), value.end());
  read_records();
  return true;
}

void PdoKnowledge::note_stored(Learned& known, std::span<const std::byte> value, Seen seen) const {
  if (seen == Seen::written) {
    known.written = true;
    if (stores_itself_) {
      known.stored.reset();
    }
  } else if (!known.written && booted_) {
    known.stored.emplace(value.begin(), value.end());
  } else if (!known.written && known.stored && !std::ranges::equal(*known.stored, value)) {
    known.stored.reset();
  }
}

// 1010h. Sub-index 3: parameters of the application, to which PDO parameters do not belong.
void PdoKnowledge::store(std::uint8_t sub) {
  for (auto& [address, known] : learned_) {
    const std::vector<std::byte>& present = variable(address, 0).value;
    if (sub == kAllParameters || sub == kCommunicationParameters) {
      known.stored = known.unknown ? std::nullopt : std::optional(present);
    } else if (sub >= kFirstOfManufacturer && known.stored != present) {
      known.stored.reset();
    }
  }
}

// 1011h. The present values remain until the reset.
void PdoKnowledge::restore(std::uint8_t sub) {
  for (auto& [address, known] : learned_) {
    if (sub == kAllParameters || sub == kCommunicationParameters) {
      known.stored = known.file;
    } else if (sub >= kFirstOfManufacturer && known.stored != known.file) {
      known.stored.reset();
    }
  }
}

void PdoKnowledge::reset() {
  for (auto& [address, known] : learned_) {
    known.written = false;
    known.unknown = !known.stored;
    if (known.stored) {
      variable(address, 0).value = *known.stored;
    }
  }
  read_records();
}

void PdoKnowledge::boot_up() {
  booted_ = true;
  reset();
}

bool PdoKnowledge::is_known(pdo::PdoKind kind, std::uint16_t number) const {
  const auto communication = static_cast<std::uint16_t>(communication_base(kind) + number - 1);
  const auto mapping = static_cast<std::uint16_t>(mapping_base(kind) + number - 1);
  return std::ranges::none_of(learned_, [&](const auto& entry) {
    return entry.second.unknown &&
           (entry.first.index == communication || entry.first.index == mapping);
  });
}

std::optional<pdo::PdoKind> PdoKnowledge::kind_of(const can::Frame& frame) const {
  if (frame.extended() || frame.remote()) {
    return std::nullopt;
  }
  if (const auto record = cob_ids_.find(frame.id); record != cob_ids_.end()) {
    return record->second.kind;
  }
  const auto heard = heard_.find(frame.id);
  return heard != heard_.end() && heard->second.frames >= kUnknownFrames
             ? std::optional(predefined_kind(frame.id))
             : std::nullopt;
}

// A device may have objects that its file lacks.
od::VariableDescription& PdoKnowledge::variable(od::Address address, std::size_t size) {
  auto object = place_of(device_.objects, address.index, &od::ObjectDescription::index);
  if (object == device_.objects.end() || object->index != address.index) {
    object = device_.objects.insert(
        object, {.index = address.index, .name = "PDO", .type = od::ObjectType::record});
  }
  auto found = place_of(object->variables, address.sub, &od::VariableDescription::sub);
  if (found == object->variables.end() || found->sub != address.sub) {
    od::VariableDescription added;
    added.sub = address.sub;
    added.type = size == 1   ? od::DataType::unsigned8
                 : size == 2 ? od::DataType::unsigned16
                             : od::DataType::unsigned32;
    found = object->variables.insert(found, std::move(added));
  }
  return *found;
}

void PdoKnowledge::read_records() {
  cob_ids_.clear();
  for (const PdoKind kind : {PdoKind::tpdo, PdoKind::rpdo}) {
    for (std::uint16_t number = 1; number <= pdo::kMaxPdo; ++number) {
      const auto record = static_cast<std::uint16_t>(communication_base(kind) + number - 1);
      const od::VariableDescription* variable = device_.find({record, 1});
      if (variable == nullptr || variable->value.size() != sizeof(std::uint32_t) ||
          !is_known(kind, number)) {
        continue;
      }
      const can::CobId cob_id{load_le<std::uint32_t>(variable->value.data())};
      if (cob_id.valid()) {
        const auto loaded = pdo::describe_pdo(device_, kind, number);
        cob_ids_[cob_id.id()] = {.kind = kind, .complete = !has_errors(loaded.diagnostics)};
      }
    }
  }
}

bool PdoKnowledge::hear(const can::Frame& frame) {
  if (frame.remote() || frame.extended() || frame.fd() || frame.length == 0 || frame.length > 8) {
    return false;
  }
  const auto record = cob_ids_.find(frame.id);
  const bool predefined =
      frame.id >= kFirstPdoId && frame.id < kEndOfPdoIds && (frame.id & 0x7FU) == node_;
  if (record == cob_ids_.end() ? !predefined : record->second.complete) {
    return false;
  }
  Heard& heard = heard_[frame.id];
  const unsigned enough = record == cob_ids_.end() ? kUnknownFrames : 1;
  if (heard.frames >= enough) {
    return false;  // pdos() already contains it
  }
  const bool alike = heard.length == frame.length;
  if (alike && heard.counted != kNever && frame.time - heard.counted < kRepeated) {
    return false;
  }
  heard.counted = frame.time;
  heard.frames = alike ? heard.frames + 1 : 1;
  heard.length = frame.length;
  return heard.frames >= enough;
}

std::vector<KnownPdo> PdoKnowledge::pdos() const {
  std::vector<KnownPdo> out;
  add_recorded(PdoKind::tpdo, out);
  add_recorded(PdoKind::rpdo, out);
  add_unrecorded(out);
  std::ranges::stable_sort(out, {}, [](const KnownPdo& known) { return known.parameters.number; });
  return out;
}

void PdoKnowledge::add_recorded(PdoKind kind, std::vector<KnownPdo>& out) const {
  for (std::uint16_t number = 1; number <= pdo::kMaxPdo; ++number) {
    const auto record = static_cast<std::uint16_t>(communication_base(kind) + number - 1);
    if (device_.find(record) == nullptr || !is_known(kind, number)) {
      continue;
    }
    auto loaded = pdo::describe_pdo(device_, kind, number);
    if (loaded.value) {
      out.push_back({.kind = kind, .parameters = *std::move(loaded.value)});
      continue;
    }
    const od::VariableDescription* cob_id = device_.find({record, 1});
    if (!has_errors(loaded.diagnostics) || cob_id == nullptr || cob_id->value.size() != 4) {
      continue;
    }
    KnownPdo raw{.kind = kind, .complete = false};
    raw.parameters.number = number;
    raw.parameters.cob_id.raw = load_le<std::uint32_t>(cob_id->value.data());
    const auto heard = heard_.find(raw.parameters.cob_id.id());
    if (raw.parameters.cob_id.valid() && heard != heard_.end() && heard->second.frames > 0) {
      raw.parameters.mapping.push_back(pdo::raw_mapping(heard->second.length));
      out.push_back(std::move(raw));
    }
  }
}

void PdoKnowledge::add_unrecorded(std::vector<KnownPdo>& out) const {
  for (const auto& [id, heard] : heard_) {
    if (cob_ids_.contains(id) || heard.frames < kUnknownFrames) {
      continue;
    }
    KnownPdo raw{.kind = predefined_kind(id), .complete = false};
    raw.parameters.number = number_of(id);
    while (takes_number(out, raw.kind, raw.parameters.number)) {
      ++raw.parameters.number;
    }
    raw.parameters.cob_id.raw = id;
    raw.parameters.mapping.push_back(pdo::raw_mapping(heard.length));
    out.push_back(std::move(raw));
  }
}

}  // namespace linegate::observer
