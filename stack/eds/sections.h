// SPDX-License-Identifier: Apache-2.0
// Assigns the sections of an EDS to objects and modules; private to stack/eds.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stack/eds/data_sheet.h"
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
  const Section* structure = nullptr;  // sub-index FFh, implicit in every dictionary
};

// The sections of one kind of module, without the prefix M1.
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

// Whether the name (in lower case) is a spelling of DeviceCommissioning. CiA 306 once misspelt it
// as DeviceComissioning, and files have other misspellings.
bool is_commissioning(std::string_view name);

// Reports section names that CiA 306 does not define.
SortedSections sort_sections(const Ini& ini, Report& report);

// --- of the file and the device as a whole ------------------------------------------------------

// [FileInfo]; a missing section is reported.
FileInfo read_file_info(const Ini& ini, Report& report);

// [DeviceInfo], including the members of od::DeviceDescription; a missing section is reported.
void read_device_info(const Ini& ini, DataSheet& out, Report& report);

// [DeviceCommissioning] in any spelling; nothing if there is none. If node_id is 0, it is set to
// the file's NodeID.
std::optional<Commissioning> read_commissioning(const Ini& ini, std::uint8_t& node_id,
                                                Report& report);

// [DummyUsage] as od::DeviceDescription::dummy_types.
std::uint32_t read_dummy_usage(const Ini& ini, Report& report);

// Line1, Line2 ... of [Comments]; section may be nullptr.
std::vector<std::string> read_comments(const Section* section, Report& report);

std::vector<DynamicSegment> read_dynamic_channels(const Ini& ini, Report& report);
std::vector<Tool> read_tools(const Ini& ini, Report& report);

}  // namespace linegate::eds
