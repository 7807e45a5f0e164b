// SPDX-License-Identifier: Apache-2.0
#include "stack/pdo/object_names.h"

#include <algorithm>
#include <string_view>

#include "stack/od/description.h"

namespace linegate::pdo {
namespace {

std::string hex_digits(unsigned value, unsigned digits) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string text(digits, '0');
  for (unsigned i = digits; i-- > 0; value >>= 4U) {
    text[i] = kDigits[value & 0xFU];
  }
  return text;
}

bool shares_its_name(const od::ObjectDescription& object, const od::VariableDescription& variable) {
  return std::ranges::any_of(object.variables, [&](const od::VariableDescription& other) {
    return other.sub != 0 && other.sub != variable.sub && other.name == variable.name;
  });
}

}  // namespace

ObjectNames::ObjectNames(const od::DeviceDescription& device) : device_(device) {
  for (const od::ObjectDescription& object : device.objects) {
    for (const od::VariableDescription& variable : object.variables) {
      if (variable.mappable) {
        ++count_[text_of(object, &variable)];
      }
    }
  }
}

std::string ObjectNames::of(od::Address address) const {
  const od::ObjectDescription* object = device_.find(address.index);
  if (object == nullptr) {
    return "unknown";
  }
  const od::VariableDescription* const variable = device_.find(address);
  if (variable != nullptr && !variable->alias.empty()) {
    return variable->alias;
  }
  std::string text = text_of(*object, variable);
  if (const auto known = count_.find(text); known != count_.end() && known->second > 1) {
    text += ' ' + od::to_text(address);
  }
  return text;
}

std::string ObjectNames::text_of(const od::ObjectDescription& object,
                                 const od::VariableDescription* variable) const {
  const bool single = object.variables.size() == 1 || variable == nullptr || variable->name.empty();
  if (single) {
    return object.name;
  }
  std::string text =
      variable->name.starts_with(object.name) ? variable->name : object.name + "." + variable->name;
  if (variable->sub != 0 && shares_its_name(object, *variable)) {
    text += ' ' + hex_digits(variable->sub, 2);
  }
  return text;
}

}  // namespace linegate::pdo
