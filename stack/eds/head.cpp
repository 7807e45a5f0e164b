// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <map>
#include <utility>

#include "stack/eds/object.h"
#include "stack/eds/sections.h"
#include "stack/eds/text.h"
#include "stack/eds/value.h"

namespace linegate::eds {
namespace {

constexpr std::uint64_t kLargestU32 = 0xFFFF'FFFF;
constexpr std::uint8_t kHighestNodeId = 127;
constexpr int kKnownEdsVersion = 4;

const Section* expected_section(const Ini& ini, std::string_view name, Report& report) {
  const Section* section = ini.find(name);
  if (section == nullptr) {
    report.warning({}, "there is no section [" + std::string(name) + ']');
  }
  return section;
}

template <class T>
T number(const Fields& fields, std::string_view key, std::uint64_t largest) {
  return static_cast<T>(fields.number(key, largest).value_or(0));
}

void check_version(const Section& section, Report& report) {
  const Entry* entry = section.find("EDSVersion");
  if (entry == nullptr || entry->value.empty()) {
    return;
  }
  int major = 0;
  const char* end = entry->value.data() + entry->value.size();
  const auto [stop, error] = std::from_chars(entry->value.data(), end, major);
  if (error != std::errc() || (stop != end && *stop != '.')) {
    report.warning(entry->value_place,
                   "EDSVersion: " + quote(entry->value) + " is not a version; 4.0 is assumed");
  } else if (major > kKnownEdsVersion) {
    report.warning(entry->value_place,
                   "EDSVersion: " + quote(entry->value) + " is newer than 4.0; it is read as 4.0");
  }
}

// Many files leave these keys empty because the identity object has the values.
std::uint32_t identity_number(const Fields& fields, std::string_view key, Report& report) {
  const Entry* entry = fields.section().find(key);
  if (entry != nullptr && entry->value.empty()) {
    report.warning(entry->key_place, std::string(key) + " has no value; object 1018h is used");
  }
  return number<std::uint32_t>(fields, key, kLargestU32);
}

// Some writers repeat the section under the other spelling, for readers that accept only that one.
bool says_the_same(const Section& a, const Section& b) {
  return std::equal(a.entries.begin(), a.entries.end(), b.entries.begin(), b.entries.end(),
                    [](const Entry& x, const Entry& y) {
                      return equal_ignoring_case(x.key, y.key) && x.value == y.value;
                    });
}

const Section* find_commissioning(const Ini& ini, Report& report) {
  const Section* found = nullptr;
  for (const Section& section : ini.sections()) {
    const std::string name = comparable(section.name);
    if (!is_commissioning(name)) {
      continue;
    }
    if (found != nullptr) {
      if (!says_the_same(*found, section)) {
        report.warning(section.place, "section " + quote(section.name) + " is ignored: there is " +
                                          quote(found->name) + " in line " +
                                          std::to_string(found->place.line));
      }
      continue;
    }
    if (name != "devicecommissioning") {
      report.warning(section.place,
                     "section " + quote(section.name) + " is read as [DeviceCommissioning]");
    }
    found = &section;
  }
  return found;
}

std::uint8_t read_node_id(const Fields& fields, std::uint8_t& node_id, Report& report) {
  const bool needed = node_id == 0;
  const Severity severity = needed ? Severity::error : Severity::warning;
  const auto given = fields.number("NodeID", 0xFF, severity);
  if (!given) {
    return 0;
  }
  const Place place = fields.find("NodeID")->value_place;
  if (*given == 0 || *given > kHighestNodeId) {
    report.add(severity, place, "NodeID: " + std::to_string(*given) + " is not in 1 to 127");
    return 0;
  }
  if (needed) {
    node_id = static_cast<std::uint8_t>(*given);
  } else if (*given != node_id) {
    report.warning(place, "NodeID: the file is made for node " + std::to_string(*given) +
                              ", but is used for node " + std::to_string(node_id));
  }
  return static_cast<std::uint8_t>(*given);
}

// "0xA080-0xA0BF", or one index.
void read_range(const Entry& entry, DynamicSegment& segment, Report& report) {
  const std::string_view content = without_comment(entry.value);
  const std::size_t dash = std::min(content.find('-'), content.size());
  const Number first = parse_number(trim(content.substr(0, dash)));
  const Number last = dash == content.size() ? first : parse_number(trim(content.substr(dash + 1)));
  if (!first.ok() || !last.ok() || first.negative || last.negative || last.magnitude > 0xFFFF ||
      first.magnitude > last.magnitude) {
    report.warning(entry.value_place, quote(entry.key) + ": " + quote(content) +
                                          " is not a range of indices like 0xA080-0xA0BF; ignored");
    return;
  }
  segment.first = static_cast<std::uint16_t>(first.magnitude);
  segment.last = static_cast<std::uint16_t>(last.magnitude);
}

// "0", for BOOLEAN "0, 1".
void read_offset(const Entry& entry, DynamicSegment& segment, Report& report) {
  const std::string_view content = without_comment(entry.value);
  const std::size_t comma = std::min(content.find(','), content.size());
  const Number offset = parse_number(trim(content.substr(0, comma)));
  const Number difference =
      comma == content.size() ? Number{} : parse_number(trim(content.substr(comma + 1)));
  if (!offset.ok() || !difference.ok() || offset.negative || difference.negative ||
      offset.magnitude > kLargestU32 || difference.magnitude > kLargestU32) {
    report.warning(entry.value_place,
                   quote(entry.key) + ": " + quote(content) + " is not an offset; ignored");
    return;
  }
  segment.offset = static_cast<std::uint32_t>(offset.magnitude);
  segment.difference = static_cast<std::uint32_t>(difference.magnitude);
}

}  // namespace

FileInfo read_file_info(const Ini& ini, Report& report) {
  FileInfo out;
  const Section* section = expected_section(ini, "FileInfo", report);
  if (section == nullptr) {
    return out;
  }
  const Fields fields(*section, report);
  out.file_name = fields.text("FileName");
  out.file_version = fields.text("FileVersion");
  out.file_revision = fields.text("FileRevision");
  out.eds_version = fields.text("EDSVersion");
  out.description = fields.text("Description");
  out.creation_time = fields.text("CreationTime");
  out.creation_date = fields.text("CreationDate");
  out.created_by = fields.text("CreatedBy");
  out.modification_time = fields.text("ModificationTime");
  out.modification_date = fields.text("ModificationDate");
  out.modified_by = fields.text("ModifiedBy");
  out.last_eds = fields.text("LastEDS");
  check_version(*section, report);
  return out;
}

void read_device_info(const Ini& ini, DataSheet& out, Report& report) {
  const Section* section = expected_section(ini, "DeviceInfo", report);
  if (section == nullptr) {
    return;
  }
  const Fields fields(*section, report);
  out.device.vendor_name = fields.text("VendorName");
  out.device.product_name = fields.text("ProductName");
  out.device.vendor_number = identity_number(fields, "VendorNumber", report);
  out.device.product_number = identity_number(fields, "ProductNumber", report);
  out.device.revision_number = identity_number(fields, "RevisionNumber", report);
  DeviceInfo& info = out.info;
  info.order_code = fields.text("OrderCode");
  for (const std::uint16_t rate : kBitRates) {
    if (fields.flag("BaudRate_" + std::to_string(rate))) {
      info.bit_rates.push_back(rate);
    }
  }
  info.boot_up_master = fields.flag("SimpleBootUpMaster");
  info.boot_up_slave = fields.flag("SimpleBootUpSlave");
  info.granularity =
      static_cast<std::uint8_t>(fields.number("Granularity", 64).value_or(info.granularity));
  info.dynamic_channels = number<std::uint8_t>(fields, "DynamicChannelsSupported", 0xFF);
  info.group_messaging = fields.flag("GroupMessaging");
  info.rpdos = number<std::uint16_t>(fields, "NrOfRXPDO", 512);
  info.tpdos = number<std::uint16_t>(fields, "NrOfTXPDO", 512);
  info.lss = fields.flag("LSS_Supported");
  info.compact_pdo = number<std::uint8_t>(fields, "CompactPDO", 0xFF);
  info.safety = fields.flag("CANopenSafetySupported");
  out.device.dynamic_mapping = info.granularity != 0;
}

std::optional<Commissioning> read_commissioning(const Ini& ini, std::uint8_t& node_id,
                                                Report& report) {
  if (node_id > kHighestNodeId) {
    report.error({}, "node-ID " + std::to_string(node_id) + " is not in 1 to 127");
  }
  const Section* section = find_commissioning(ini, report);
  if (section == nullptr) {
    return std::nullopt;
  }
  const Fields fields(*section, report);
  Commissioning out;
  out.node_id = read_node_id(fields, node_id, report);
  out.node_name = fields.text("NodeName");
  out.node_reference = fields.text("NodeRefd");
  out.bit_rate = number<std::uint16_t>(fields, "Baudrate", 0xFFFF);
  out.net_number = number<std::uint32_t>(fields, "NetNumber", kLargestU32);
  out.network_name = fields.text("NetworkName");
  out.network_reference = fields.text("NetRefd");
  out.manager = fields.flag("CANopenManager");
  out.lss_serial = number<std::uint32_t>(fields, "LSS_SerialNumber", kLargestU32);
  return out;
}

std::uint32_t read_dummy_usage(const Ini& ini, Report& report) {
  const Section* section = ini.find("DummyUsage");
  if (section == nullptr) {
    return 0;
  }
  std::uint32_t out = 0;
  const Fields fields(*section, report);
  for (const char* key : {"Dummy0001", "Dummy0002", "Dummy0003", "Dummy0004", "Dummy0005",
                          "Dummy0006", "Dummy0007"}) {
    if (section->find(key) == nullptr) {
      report.warning(section->place, quote(section->name) + " has no " + key + "; 0 is assumed");
    }
  }
  for (const Entry& entry : section->entries) {
    const std::string key = lower(entry.key);
    unsigned type = 0;
    const char* end = key.data() + key.size();
    const bool named = key.starts_with("dummy");
    const auto [stop, error] = std::from_chars(key.data() + (named ? 5 : 0), end, type, 16);
    if (!named || error != std::errc() || stop != end || type == 0 || type > 0x1F) {
      report.warning(entry.key_place,
                     "key " + quote(entry.key) + " is not Dummy0001 to Dummy001F; ignored");
    } else if (!entry.value.empty() && fields.number_of(entry, 1).value_or(0) == 1) {
      out |= std::uint32_t{1} << type;
    }
  }
  return out;
}

std::vector<std::string> read_comments(const Section* section, Report& report) {
  std::map<std::uint64_t, std::string> lines;
  if (section != nullptr) {
    for (const Entry& entry : section->entries) {
      const Number number = parse_number(entry.key.substr(
          std::min<std::size_t>(lower(entry.key).starts_with("line") ? 4 : 0, entry.key.size())));
      if (number.ok()) {
        lines.try_emplace(number.magnitude, to_utf8(entry.value));
      } else if (!equal_ignoring_case(entry.key, "Lines")) {
        report.warning(entry.key_place, "key " + quote(entry.key) + " is not Line1 ...; ignored");
      }
    }
  }
  std::vector<std::string> out;
  for (auto& [number, text] : lines) {
    out.push_back(std::move(text));
  }
  return out;
}

std::vector<DynamicSegment> read_dynamic_channels(const Ini& ini, Report& report) {
  std::vector<DynamicSegment> out;
  const Section* section = ini.find("DynamicChannels");
  if (section == nullptr) {
    return out;
  }
  const Fields fields(*section, report);
  const std::uint64_t count = fields.number("NrOfSeg", 0xFF).value_or(0);
  for (std::uint64_t n = 1; n <= count; ++n) {
    const std::string suffix = std::to_string(n);
    DynamicSegment segment;
    segment.type = static_cast<od::DataType>(fields.number("Type" + suffix, 0xFFFF).value_or(0));
    if (const Entry* entry = fields.find("Dir" + suffix)) {
      segment.access = read_access(*entry, report);
    }
    const Entry* range = fields.find("Range" + suffix);
    if (segment.type == od::DataType::none || range == nullptr) {
      report.warning(section->place, "segment " + suffix +
                                         " of the dynamic channels has no Type or no Range; "
                                         "ignored");
      continue;
    }
    read_range(*range, segment, report);
    if (const Entry* entry = fields.find("PPOffset" + suffix)) {
      read_offset(*entry, segment, report);
    }
    if (segment.last != 0) {
      out.push_back(segment);
    }
  }
  return out;
}

std::vector<Tool> read_tools(const Ini& ini, Report& report) {
  std::vector<Tool> out;
  const Section* section = ini.find("Tools");
  if (section == nullptr) {
    return out;
  }
  const std::uint64_t count = Fields(*section, report).number("Items", 0xFF).value_or(0);
  for (std::uint64_t n = 1; n <= count; ++n) {
    if (const Section* tool = ini.find("Tool" + std::to_string(n))) {
      const Fields fields(*tool, report);
      out.push_back({fields.text("Name"), fields.text("Command")});
    }
  }
  return out;
}

}  // namespace linegate::eds
