// Which sections of an EDS belong to which object; private to stack/eds.
#pragma once

#include <cstdint>
#include <map>

#include "stack/eds/ini.h"

namespace linegate::eds {

// The sections [1018], [1018sub1] ..., [1018Name], [1018Value] of one object.
struct ObjectSections {
  const Section* object = nullptr;
  std::map<std::uint8_t, const Section*> subs;
  const Section* names = nullptr;   // of CompactSubObj
  const Section* values = nullptr;  // of CompactSubObj
};

// By index, 1h to FFFFh. Reports names of sections that CiA 306 does not know.
std::map<std::uint16_t, ObjectSections> sort_sections(const Ini& ini, Report& report);

}  // namespace linegate::eds
