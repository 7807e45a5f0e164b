// SPDX-License-Identifier: Apache-2.0
#include "stack/eds/object.h"

#include <map>
#include <span>
#include <utility>

#include "stack/eds/fields.h"
#include "stack/eds/text.h"
#include "stack/eds/value.h"
#include "stack/od/objects.h"

namespace linegate::eds {
namespace {

using od::ObjectDescription;
using od::ObjectType;
using od::VariableDescription;

// Limit for all CompactSubObj and modules of a file: allows thousands of full arrays, and no more
// memory than a process can spare.
constexpr std::size_t kMostMegabytes = 64;

using Variables = std::map<std::uint8_t, VariableDescription>;

// A missing ObjectType means VAR (CiA 306).
ObjectType read_object_type(const Fields& fields, const ObjectSections& sections,
                            Context& context) {
  const auto code = fields.number("ObjectType", 0xFF).value_or(7);
  const auto type = static_cast<ObjectType>(code);
  switch (type) {
    case ObjectType::null:
    case ObjectType::array:
    case ObjectType::record:
    case ObjectType::defstruct:
      return type;
    case ObjectType::domain:
    case ObjectType::deftype:
    case ObjectType::variable:
      break;
    default:
      context.report.warning(fields.find("ObjectType")->value_place,
                             "ObjectType: " + std::to_string(code) + " is not known; taken as " +
                                 (sections.subs.empty() ? "VAR" : "RECORD"));
      return sections.subs.empty() ? ObjectType::variable : ObjectType::record;
  }
  if (sections.subs.empty()) {
    return type;
  }
  context.report.warning(sections.object->place,
                         quote(sections.object->name) +
                             " has sub-indices, but its ObjectType has none; taken as RECORD");
  return ObjectType::record;
}

// The sub-index that a key of [xxxxName] or [xxxxValue] refers to; nothing for NrOfEntries and for
// invalid keys, which are reported.
std::optional<std::uint8_t> element(const Entry& entry, const Variables& variables,
                                    Context& context) {
  if (equal_ignoring_case(entry.key, "NrOfEntries") || entry.value.empty()) {
    return std::nullopt;
  }
  const Number number = parse_number(entry.key);
  if (!number.ok() || number.negative || number.magnitude == 0 ||
      number.magnitude > kMostElements ||
      !variables.contains(static_cast<std::uint8_t>(number.magnitude))) {
    context.report.warning(
        entry.key_place, "key " + quote(entry.key) + " is not a sub-index of the object; ignored");
    return std::nullopt;
  }
  return static_cast<std::uint8_t>(number.magnitude);
}

std::span<const Entry> entries_of(const Section* section) {
  return section == nullptr ? std::span<const Entry>() : section->entries;
}

// CompactSubObj: the object's own section describes all sub-indices 1..count.
void read_compact(std::uint8_t count, const Fields& fields, const ObjectSections& sections,
                  Variables& out, Context& context) {
  const auto pattern = read_variable(*sections.object, 1, context);
  if (!pattern || !charge(context, *pattern, count, fields.find("CompactSubObj")->value_place)) {
    return;
  }
  out[0] = count_variable(count, sections.object->place.line);
  for (unsigned sub = 1; sub <= count; ++sub) {
    VariableDescription variable = *pattern;
    variable.sub = static_cast<std::uint8_t>(sub);
    variable.name += std::to_string(sub);
    variable.notes.denotation.clear();  // it belongs to the object
    out[variable.sub] = std::move(variable);
  }
  for (const Entry& entry : entries_of(sections.names)) {
    if (const auto sub = element(entry, out, context)) {
      out[*sub].name = to_utf8(entry.value);
    }
  }
  for (const Entry& entry : entries_of(sections.values)) {
    if (const auto sub = element(entry, out, context)) {
      read_value(entry, context.is_dcf, out[*sub], context);
    }
  }
  for (const Entry& entry : entries_of(sections.denotations)) {
    if (const auto sub = element(entry, out, context)) {
      out[*sub].notes.denotation = to_utf8(entry.value);
    }
  }
}

// Sub-index 0 of these objects is the number of entries in use, not the highest sub-index.
bool counts_what_is_used(std::uint16_t index) {
  return index == od::objects::kErrorHistory || od::objects::is_pdo_mapping(index);
}

// A sub-index 0 that is not writable is the highest existing sub-index.
void check_sub_zero(const ObjectDescription& object, const VariableDescription& zero,
                    std::uint8_t highest, const ObjectSections& sections, Context& context) {
  if (counts_what_is_used(object.index) || od::writable(zero.access) || zero.value.size() != 1 ||
      zero.value[0] == std::byte{highest}) {
    return;
  }
  const auto section = sections.subs.find(0);
  context.report.warning(
      section == sections.subs.end() ? sections.object->place : section->second->place,
      "sub-index 0 of " + hex(object.index, 4) + " says " +
          std::to_string(std::to_integer<unsigned>(zero.value[0])) +
          ", but the highest sub-index described is " + std::to_string(highest));
}

void complete_sub_zero(const ObjectDescription& object, Variables& variables,
                       const ObjectSections& sections, Context& context) {
  const std::uint8_t highest = variables.rbegin()->first;
  if (!variables.contains(0)) {
    context.report.warning(sections.object->place, quote(sections.object->name) +
                                                       " has no sub-index 0; " +
                                                       std::to_string(highest) + " is assumed");
    variables[0] = count_variable(highest, object.line);
  } else if (variables[0].value.empty() && !counts_what_is_used(object.index)) {
    variables[0].value = {std::byte{highest}};
  } else {
    check_sub_zero(object, variables[0], highest, sections, context);
  }
}

// Some files include FFh in SubNumber, others do not.
void check_sub_number(const Fields& fields, const ObjectSections& sections, Context& context) {
  const std::size_t described = sections.subs.size();
  const auto number = fields.number("SubNumber", 0xFF);
  const bool with_structure = number && sections.structure != nullptr && *number == described + 1;
  if (number && *number != described && !with_structure) {
    context.report.warning(fields.find("SubNumber")->value_place,
                           "SubNumber is " + std::to_string(*number) + ", but " +
                               std::to_string(described) + " sub-indices are described");
  }
}

Variables read_subs(const Fields& fields, const ObjectSections& sections, Context& context) {
  Variables variables;
  const auto compact = fields.number("CompactSubObj", kMostElements).value_or(0);
  if (compact != 0) {
    read_compact(static_cast<std::uint8_t>(compact), fields, sections, variables, context);
  } else {
    check_sub_number(fields, sections, context);
  }
  for (const auto& [sub, section] : sections.subs) {
    if (auto variable = read_variable(*section, sub, context)) {
      variables[sub] = *std::move(variable);
    }
  }
  return variables;
}

}  // namespace

bool has_subs(ObjectType type) {
  return type == ObjectType::array || type == ObjectType::record || type == ObjectType::defstruct;
}

VariableDescription count_variable(std::uint8_t value, std::uint32_t line) {
  VariableDescription variable;
  variable.name = "Highest sub-index supported";
  variable.type = od::DataType::unsigned8;
  variable.access = od::Access::ro;
  variable.value = {std::byte{value}};
  variable.line = line;
  return variable;
}

bool charge(Context& context, const VariableDescription& pattern, unsigned count, Place place) {
  constexpr std::size_t kMost = kMostMegabytes << 20U;
  if (context.expanded > kMost) {
    return false;
  }
  context.expanded += count * (sizeof pattern + pattern.name.size() + pattern.value.size() +
                               pattern.low_limit.size() + pattern.high_limit.size());
  if (context.expanded > kMost) {
    context.report.error(
        place, "the arrays and records that compact sections describe take more than " +
                   std::to_string(kMostMegabytes) + " MB so far; from here on they are left out");
  }
  return context.expanded <= kMost;
}

std::optional<ObjectDescription> read_object(std::uint16_t index, const ObjectSections& sections,
                                             Context& context) {
  const Fields fields(*sections.object, context.report);
  ObjectDescription object;
  object.index = index;
  object.line = sections.object->place.line;
  object.type = read_object_type(fields, sections, context);
  object.flags = static_cast<std::uint32_t>(fields.number("ObjFlags", 0xFFFF'FFFF).value_or(0));
  if (index < od::objects::kFirstCommunication || object.type == ObjectType::null) {
    return std::nullopt;
  }
  if (!has_subs(object.type)) {
    auto variable = read_variable(*sections.object, 0, context);
    if (!variable) {
      return std::nullopt;
    }
    object.name = variable->name;
    object.variables.push_back(*std::move(variable));
    return object;
  }
  // read_name() is called for the elements of a CompactSubObj and would report a missing name
  // twice.
  object.name = fields.find("CompactSubObj") == nullptr ? read_name(fields, context)
                                                        : fields.text("ParameterName");
  object.denotation = fields.text("Denotation");
  Variables variables = read_subs(fields, sections, context);
  if (variables.empty()) {
    context.report.warning(sections.object->place,
                           quote(sections.object->name) + " has no sub-indices; it is left out");
    return std::nullopt;
  }
  complete_sub_zero(object, variables, sections, context);
  for (auto& [sub, variable] : variables) {
    object.variables.push_back(std::move(variable));
  }
  return object;
}

}  // namespace linegate::eds
