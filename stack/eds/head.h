// SPDX-License-Identifier: Apache-2.0
// The sections of an EDS about the file and the device as a whole; private to stack/eds.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "stack/eds/data_sheet.h"
#include "stack/eds/ini.h"

namespace linegate::eds {

// [FileInfo]; a missing one is reported.
FileInfo read_file_info(const Ini& ini, Report& report);

// [DeviceInfo], with what od::DeviceDescription has of it; a missing one is reported.
void read_device_info(const Ini& ini, DataSheet& out, Report& report);

// [DeviceCommissioning] in any spelling; nothing if there is none. node_id 0 becomes the file's.
std::optional<Commissioning> read_commissioning(const Ini& ini, std::uint8_t& node_id,
                                                Report& report);

// [DummyUsage] as od::DeviceDescription::dummy_types.
std::uint32_t read_dummy_usage(const Ini& ini, Report& report);

// Line1, Line2 ... of [Comments]; section may be nullptr.
std::vector<std::string> read_comments(const Section* section, Report& report);

std::vector<DynamicSegment> read_dynamic_channels(const Ini& ini, Report& report);
std::vector<Tool> read_tools(const Ini& ini, Report& report);

}  // namespace linegate::eds
