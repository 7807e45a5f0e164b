// SPDX-License-Identifier: Apache-2.0
// Which sections of an EDS belong to which object or module; private to stack/eds.
#pragma once

#include <cstdint>
#include <map>
#include <string_view>

#include "stack/eds/ini.h"

namespace linegate::eds {

// The sections [1018], [1018sub1] ..., [1018Name], [1018Value] ... of one object.
struct ObjectSections {
  const Section* object = nullptr;
  std::map<std::uint8_t, const Section*> subs;
  const Section* names = nullptr;        // of CompactSubObj
  const Section* values = nullptr;       // of CompactSubObj
  const Section* denotations = nullptr;  // of CompactSubObj
  const Section* links = nullptr;
  const Section* structure = nullptr;  // sub-index FFh, which every object dictionary has by itself
};

// The sections of one kind of module, without the M1 in front.
struct ModuleSections {
  const Section* info = nullptr;
  const Section* comments = nullptr;
  const Section* fixed_list = nullptr;                // [M1FixedObjects]
  std::map<std::uint16_t, ObjectSections> fixed;      // [M1Fixed6000], [M1Fixed6000sub1]
  const Section* extension_list = nullptr;            // [M1SubExtends]
  std::map<std::uint16_t, const Section*> extension;  // [M1SubExt6000]
};

struct SortedSections {
  std::map<std::uint16_t, ObjectSections> objects;  // by index, 1h to FFFFh
  std::map<std::uint16_t, ModuleSections> modules;  // by number
};

// Whether the name (in lower case) is meant to be DeviceCommissioning, which CiA 306 once misspelt
// as DeviceComissioning, and files misspell in every other way.
bool is_commissioning(std::string_view name);

// Reports names of sections that CiA 306 does not know.
SortedSections sort_sections(const Ini& ini, Report& report);

}  // namespace linegate::eds
