// SPDX-License-Identifier: Apache-2.0
// The content of a Dictionary as plain values.
#include <algorithm>
#include <string>

#include "stack/base/byte_order.h"
#include "stack/od/object_table.h"

namespace linegate::od {
namespace {

std::string index_text(std::uint16_t index) {
  std::string out;
  for (int shift = 12; shift >= 0; shift -= 4) {
    out += "0123456789ABCDEF"[index >> shift & 0xF];
  }
  return out;
}

VariableDescription describe_variable(std::uint8_t sub, const Variable& variable) {
  VariableDescription out;
  out.sub = sub;
  out.type = variable.type;
  out.access = variable.access;
  out.mappable = variable.mappable;
  out.store = variable.store;
  return out;
}

void describe_plain(const Slot& slot, const ObjectDetails& details, ObjectDescription& out) {
  for (unsigned sub = 0; sub <= slot.highest; ++sub) {
    const Variable& variable = slot.variables[sub];
    if (variable.type == DataType::none) {
      continue;
    }
    const VariableDetails& cold = details.variables[sub];
    VariableDescription described = describe_variable(static_cast<std::uint8_t>(sub), variable);
    described.name = cold.name.empty() ? out.name + std::to_string(sub) : cold.name;
    described.value = cold.initial;
    described.low_limit = cold.low;
    described.high_limit = cold.high;
    out.variables.push_back(std::move(described));
  }
}

void describe_window(const Slot& slot, ObjectDescription& out) {
  const Variable& element = slot.variables[1];
  VariableDescription count = describe_variable(0, slot.variables[0]);
  count.name = "Highest sub-index supported";
  count.access = Access::ro;
  count.value = {std::byte{slot.highest}};
  out.variables.push_back(std::move(count));
  for (unsigned sub = 1; sub <= slot.highest; ++sub) {
    VariableDescription described = describe_variable(static_cast<std::uint8_t>(sub), element);
    described.name = out.name + std::to_string(sub);
    described.value.resize(element.size);
    out.variables.push_back(std::move(described));
  }
}

}  // namespace

std::vector<ObjectDescription> Dictionary::describe() const {
  std::vector<ObjectDescription> out;
  for (const std::uint16_t index : indices()) {
    const Slot& slot = *objects_->find(index);
    const ObjectDetails& details = objects_->details(slot);
    ObjectDescription object;
    object.index = index;
    object.name = details.name.empty() ? index_text(index) : details.name;
    object.type = details.type;
    if (slot.kind == Slot::Kind::window) {
      describe_window(slot, object);
    } else {
      describe_plain(slot, details, object);
    }
    out.push_back(std::move(object));
  }
  return out;
}

}  // namespace linegate::od
