// SPDX-License-Identifier: Apache-2.0
#include "stack/storage/parameters.h"

#include "stack/od/objects.h"

namespace linegate::storage {
namespace {

struct Range {
  std::uint16_t first;
  std::uint16_t last;

  constexpr bool has(std::uint16_t index) const { return index >= first && index <= last; }
};

constexpr Range kCommunicationRange{od::objects::kFirstCommunication,
                                    od::objects::kLastCommunication};
constexpr Range kManufacturerRange{0x2000, 0x5FFF};
constexpr Range kApplicationRange{0x6000, 0x9FFF};

constexpr Range kNoParameters[] = {
    {od::objects::kErrorHistory, od::objects::kErrorHistory},              // past errors
    {od::objects::kStoreParameters, od::objects::kRestoreDefaults},        // commands
    {od::objects::kHighResolutionTime, od::objects::kHighResolutionTime},  // the time
    {od::objects::kStoredEds, od::objects::kOsPrompt},  // stored EDS, operating system commands
    {od::objects::kStoredDcf, 0x1F7F},                  // DCFs, programs, requests to configure
    {od::objects::kRequestNmt,
     od::objects::kRequestGuarding},  // requests for NMT commands and guarding
};

}  // namespace

bool covers(std::uint8_t group, std::uint16_t index) {
  switch (group) {
    case kAll:
      return true;
    case kCommunication:
      return kCommunicationRange.has(index);
    case kApplication:
      return kApplicationRange.has(index);
    case kManufacturer:
      return kManufacturerRange.has(index);
    default:
      return false;
  }
}

bool is_parameter(std::uint16_t index, const od::VariableDescription& variable) {
  if (!od::readable(variable.access) || !od::writable(variable.access) ||
      variable.type == od::DataType::domain) {
    return false;
  }
  if (kManufacturerRange.has(index) || kApplicationRange.has(index)) {
    return !variable.mappable;
  }
  if (!kCommunicationRange.has(index)) {
    return false;
  }
  for (const Range& range : kNoParameters) {
    if (range.has(index)) {
      return false;
    }
  }
  return true;
}

void mark_parameters(od::DeviceDescription& device) {
  for (od::ObjectDescription& object : device.objects) {
    for (od::VariableDescription& variable : object.variables) {
      variable.store = is_parameter(object.index, variable);
    }
  }
}

}  // namespace linegate::storage
