// SPDX-License-Identifier: Apache-2.0
#include "stack/storage/parameters.h"

namespace linegate::storage {
namespace {

struct Range {
  std::uint16_t first;
  std::uint16_t last;

  constexpr bool has(std::uint16_t index) const { return index >= first && index <= last; }
};

constexpr Range kCommunicationRange{0x1000, 0x1FFF};
constexpr Range kManufacturerRange{0x2000, 0x5FFF};
constexpr Range kApplicationRange{0x6000, 0x9FFF};

constexpr Range kNoParameters[] = {
    {0x1003, 0x1003},  // errors that happened
    {0x1010, 0x1011},  // commands
    {0x1013, 0x1013},  // the time
    {0x1021, 0x1026},  // stored EDS, operating system commands
    {0x1F20, 0x1F7F},  // DCFs, programs, requests to configure
    {0x1F82, 0x1F83},  // requests for NMT commands and guarding
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
