// Which sections of an EDS belong to which object; private to stack/eds.
#pragma once

#include <cstdint>
#include <map>
#include <string_view>

#include "stack/eds/ini.h"

namespace linegate::eds {

// The sections [1018], [1018sub1] ..., [1018Name], [1018Value] of one object.
struct ObjectSections {
  const Section* object = nullptr;
  std::map<std::uint8_t, const Section*> subs;
  const Section* names = nullptr;   // of CompactSubObj
  const Section* values = nullptr;  // of CompactSubObj
};

// Whether the name (in lower case) is meant to be DeviceComissioning, which CiA 306 itself
// misspells and files misspell in every other way.
bool is_commissioning(std::string_view name);

// By index, 1h to FFFFh. Reports names of sections that CiA 306 does not know.
std::map<std::uint16_t, ObjectSections> sort_sections(const Ini& ini, Report& report);

}  // namespace linegate::eds
