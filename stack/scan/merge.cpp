// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "stack/od/objects.h"
#include "stack/scan/describe.h"

namespace linegate::scan {
namespace {

constexpr std::uint32_t kMajor = 0xFFFF'0000;

bool is_communication_or_mapping(std::uint16_t index) {
  return od::objects::is_pdo_record(index);
}

// Objects that a device has and its file lacks: PDOs of modules, or the file is older.
void add_missing(od::DeviceDescription& file, od::DeviceDescription found) {
  for (od::ObjectDescription& object : found.objects) {
    if (file.find(object.index) == nullptr) {
      file.objects.push_back(std::move(object));
      continue;
    }
    for (od::VariableDescription& variable : object.variables) {
      if (file.find(od::Address{object.index, variable.sub}) == nullptr) {
        auto& known = *std::ranges::find(file.objects, object.index, &od::ObjectDescription::index);
        known.variables.push_back(std::move(variable));
        std::ranges::sort(known.variables, {}, &od::VariableDescription::sub);
      }
    }
  }
  std::ranges::sort(file.objects, {}, &od::ObjectDescription::index);
}

}  // namespace

bool matches(const od::DeviceDescription& file, const ScannedNode& node) {
  const auto same = [&](std::uint32_t wanted, std::uint8_t sub, std::uint32_t bits) {
    const auto read =
        static_cast<std::uint32_t>(node.number({od::objects::kIdentity, sub}).value_or(0));
    return wanted == 0 || ((wanted ^ read) & bits) == 0;
  };
  const bool identified = file.vendor_number != 0 ||
                          (file.product_number != 0 && node.number(od::objects::kVendorId) == 0U);
  return identified && same(file.vendor_number, 1, ~0U) && same(file.product_number, 2, ~0U) &&
         same(file.revision_number, 3, kMajor);
}

od::DeviceDescription merge(od::DeviceDescription file, const ScannedNode& node) {
  for (const manager::ObjectWrite& value : node.values) {
    od::VariableDescription* const known = file.find(value.address);
    // The identity and names are the device's own.
    const bool settable = known != nullptr && od::writable(known->access);
    if (known == nullptr || known->value == value.data ||
        (!settable && !is_communication_or_mapping(value.address.index))) {
      continue;
    }
    if (settable) {
      known->configured = true;
      known->notes.default_value = std::move(known->value);
    }
    known->value = value.data;
  }
  add_missing(file, describe(node));
  return file;
}

}  // namespace linegate::scan
