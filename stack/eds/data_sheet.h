// SPDX-License-Identifier: Apache-2.0
// The whole content of an EDS or DCF (CiA 306): the device, and the information for people and
// tools. Plain values; anything missing in the file is empty or 0.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "stack/od/description.h"

namespace linegate::eds {

// [FileInfo], as text: dates are mm-dd-yyyy, times hh:mmAM.
struct FileInfo {
  std::string file_name;
  std::string file_version;
  std::string file_revision;
  std::string eds_version;  // empty = 3.0 (CiA 306)
  std::string description;
  std::string creation_time;
  std::string creation_date;
  std::string created_by;
  std::string modification_time;
  std::string modification_date;
  std::string modified_by;
  std::string last_eds;  // DCF: the EDS that it is based on

  friend bool operator==(const FileInfo&, const FileInfo&) = default;
};

// kbit/s, of the keys BaudRate_10 to BaudRate_1000.
inline constexpr std::uint16_t kBitRates[] = {10, 20, 50, 125, 250, 500, 800, 1000};

// [DeviceInfo], except for names and numbers, which od::DeviceDescription has.
struct DeviceInfo {
  std::string order_code;
  std::vector<std::uint16_t> bit_rates;  // kbit/s, supported by the device
  bool boot_up_master = false;
  bool boot_up_slave = false;
  std::uint8_t granularity = 8;  // of PDO mapping, bits; 0 = mapping cannot be changed
  std::uint8_t dynamic_channels = 0;
  bool group_messaging = false;
  std::uint16_t rpdos = 0;
  std::uint16_t tpdos = 0;
  bool lss = false;
  std::uint8_t compact_pdo = 0;  // bit n: PDOs without a section have communication sub-index n + 1
  bool safety = false;

  friend bool operator==(const DeviceInfo&, const DeviceInfo&) = default;
};

// [DeviceCommissioning] of a DCF. Node-ID and name are in od::DeviceDescription too.
struct Commissioning {
  std::uint8_t node_id = 0;
  std::string node_name;
  std::string node_reference;
  std::uint16_t bit_rate = 0;  // kbit/s
  std::uint32_t net_number = 0;
  std::string network_name;
  std::string network_reference;
  bool manager = false;  // the device is the CANopen manager
  std::uint32_t lss_serial = 0;

  friend bool operator==(const Commissioning&, const Commissioning&) = default;
};

// [DynamicChannels]: a range of objects in which a programmable device creates network variables.
struct DynamicSegment {
  od::DataType type = od::DataType::none;
  od::Access access = od::Access::ro;
  std::uint16_t first = 0;       // index
  std::uint16_t last = 0;        // index
  std::uint32_t offset = 0;      // PPOffset: offset of the segment in the process picture
  std::uint32_t difference = 0;  // BOOLEAN: distance between two addresses there

  friend bool operator==(const DynamicSegment&, const DynamicSegment&) = default;
};

// [MxSubExtxxxx]: sub-indices that each connected module of this kind adds to an object.
struct SubExtension {
  std::uint16_t index = 0;
  od::VariableDescription pattern;
  std::uint8_t count = 0;   // sub-indices that a module adds; 0 = several modules share one,
  std::uint8_t bits = 0;    // of which each module uses this number of bits
  std::uint8_t extend = 0;  // highest sub-index before the next object is used; 0 = 254

  friend bool operator==(const SubExtension&, const SubExtension&) = default;
};

// [MxModuleInfo] and its related sections: one kind of module of a modular device.
struct Module {
  std::uint16_t number = 0;
  std::string product_name;
  std::string product_version;
  std::string product_revision;
  std::string order_code;
  std::vector<std::string> comments;
  std::vector<od::ObjectDescription> fixed_objects;  // added once, for any number of modules
  std::vector<SubExtension> extensions;

  friend bool operator==(const Module&, const Module&) = default;
};

// [ToolN]: a program and its command line.
struct Tool {
  std::string name;
  std::string command;

  friend bool operator==(const Tool&, const Tool&) = default;
};

struct DataSheet {
  od::DeviceDescription device;  // with the objects of the connected modules
  FileInfo file;
  DeviceInfo info;
  std::optional<Commissioning> commissioning;  // present in a DCF
  std::vector<std::string> comments;
  std::vector<DynamicSegment> dynamic_segments;
  std::vector<Module> modules;
  std::vector<std::uint16_t> connected_modules;  // DCF: Module::number by place
  std::map<std::uint16_t, std::vector<std::uint16_t>> object_links;
  std::vector<Tool> tools;

  friend bool operator==(const DataSheet&, const DataSheet&) = default;
};

}  // namespace linegate::eds
