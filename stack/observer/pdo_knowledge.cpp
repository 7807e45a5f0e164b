// SPDX-License-Identifier: Apache-2.0
#include "stack/observer/pdo_knowledge.h"

#include <algorithm>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/od/objects.h"
#include "stack/pdo/described_cob_id.h"

namespace linegate::observer {
namespace {

using pdo::PdoKind;

constexpr std::uint32_t kFirstPdoId = 0x180;  // of the pre-defined connection set
constexpr std::uint32_t kEndOfPdoIds = 0x580;
constexpr std::uint16_t kMappingBit = od::objects::kTpdoMapping ^ od::objects::kTpdoCommunication;
constexpr std::uint8_t kCobId = 1;
constexpr std::uint8_t kAllSubIndices = 0xFF;
// A mapping entry has no more bits: a longer PDO whose mapping is not known is not shown.
constexpr std::size_t kMostRawBits = 0xFF;

// TPDO 1, RPDO 1, TPDO 2, ... 180h + node, 200h + node, 280h + node, ...
PdoKind predefined_kind(std::uint32_t id) {
  return ((id - kFirstPdoId) >> 7U) % 2 == 0 ? PdoKind::tpdo : PdoKind::rpdo;
}
std::uint16_t number_of(std::uint32_t id) {
  return static_cast<std::uint16_t>(((id - kFirstPdoId) >> 8U) + 1);
}

// 1400h:0 and 1800h:0 are constant.
bool is_stored(od::Address address) {
  return address.sub != 0 || od::objects::is_pdo_mapping(address.index);
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

PdoKnowledge::PdoKnowledge(od::DeviceDescription device, std::uint8_t node, std::size_t longest)
    : device_(std::move(device)), node_(node), longest_(longest), learned_(device_) {
  pdo::complete_cob_ids(device_);
  read_records();
}

bool PdoKnowledge::learn(od::Address address, std::span<const std::byte> value, Seen seen) {
  learned_.follow_storage(address, value, seen);
  if (!od::objects::is_pdo_record(address.index) || value.empty()) {
    return false;
  }
  od::VariableDescription& present = variable(address, value.size());
  if (is_stored(address) && learned_.refutes_stored(address, value, present.value, seen)) {
    doubt_others(address);
  }
  if (!learned_.learn(address, value, present.value, seen)) {
    return false;
  }
  present.value.assign(value.begin(), value.end());
  read_records();
  return true;
}

// Transmission type and times do not decide what a frame contains: many masters leave them alone.
void PdoKnowledge::doubt_others(od::Address address) {
  const auto doubt_record = [&](unsigned index, std::uint8_t first, std::uint8_t last) {
    const auto* const record = device_.find(static_cast<std::uint16_t>(index));
    if (record == nullptr) {
      return;
    }
    for (const od::VariableDescription& variable : record->variables) {
      const od::Address other{record->index, variable.sub};
      if (other.sub >= first && other.sub <= last && other != address) {
        learned_.doubt(other, variable.value);
      }
    }
  };
  const unsigned communication = address.index & ~unsigned{kMappingBit};
  doubt_record(communication, kCobId, kCobId);
  doubt_record(communication | kMappingBit, 0, kAllSubIndices);
}

void PdoKnowledge::reset() {
  learned_.reset();
  take_learned();
}

void PdoKnowledge::boot_up() {
  learned_.boot_up();
  take_learned();
}

void PdoKnowledge::take_learned() {
  learned_.for_each([this](od::Address address, const LearnedParameters::Value& value) {
    variable(address, value.size()).value = value;
  });
  read_records();
}

bool PdoKnowledge::is_known(pdo::PdoKind kind, std::uint16_t number) const {
  const auto communication = static_cast<std::uint16_t>(communication_base(kind) + number - 1);
  const auto mapping = static_cast<std::uint16_t>(mapping_base(kind) + number - 1);
  const od::VariableDescription* const count = device_.find({mapping, 0});
  const std::uint8_t last = count == nullptr || count->value.size() != 1
                                ? kAllSubIndices
                                : std::to_integer<std::uint8_t>(count->value[0]);
  return learned_.is_known(communication, kAllSubIndices) && learned_.is_known(mapping, last);
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
        const auto loaded = pdo::describe_pdo(device_, kind, number, longest_);
        cob_ids_[cob_id.id()] = {.kind = kind, .complete = !has_errors(loaded.diagnostics)};
      }
    }
  }
}

bool PdoKnowledge::hear(const can::Frame& frame) {
  const bool has_length =
      frame.length != 0 && 8U * frame.length <= std::min(longest_, kMostRawBits);
  if (frame.remote() || frame.extended() || (frame.fd() && longest_ <= 64) || !has_length) {
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
    auto loaded = pdo::describe_pdo(device_, kind, number, longest_);
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
