// SPDX-License-Identifier: Apache-2.0
#include "stack/eds/writer.h"

#include <algorithm>
#include <utility>

#include "stack/eds/object_writer.h"
#include "stack/eds/value.h"
#include "stack/od/objects.h"

namespace linegate::eds {
namespace {

enum class ObjectList { mandatory, optional, manufacturer };

ObjectList list_of(std::uint16_t index) {
  if (index == od::objects::kDeviceType || index == od::objects::kErrorRegister ||
      index == od::objects::kIdentity) {
    return ObjectList::mandatory;
  }
  return index >= 0x2000 && index < 0x6000 ? ObjectList::manufacturer : ObjectList::optional;
}

class Writer {
 public:
  Writer(const DataSheet& sheet, bool dcf) : sheet_(sheet), options_{dcf, sheet.device.node_id} {}

  std::string write() {
    file_info();
    device_info();
    dummy_usage();
    comments("Comments", sheet_.comments);
    if (options_.dcf) {
      commissioning();
    }
    tools();
    dynamic_channels();
    modules();
    list("MandatoryObjects", ObjectList::mandatory);
    objects(ObjectList::mandatory);
    list("OptionalObjects", ObjectList::optional);
    objects(ObjectList::optional);
    list("ManufacturerObjects", ObjectList::manufacturer);
    objects(ObjectList::manufacturer);
    return out_.take();
  }

 private:
  void file_info() {
    const FileInfo& info = sheet_.file;
    out_.section("FileInfo");
    out_.text("FileName", info.file_name);
    out_.text("FileVersion", info.file_version);
    out_.text("FileRevision", info.file_revision);
    out_.text("EDSVersion", info.eds_version);
    out_.text("Description", info.description);
    out_.text("CreationTime", info.creation_time);
    out_.text("CreationDate", info.creation_date);
    out_.text("CreatedBy", info.created_by);
    out_.text("ModificationTime", info.modification_time);
    out_.text("ModificationDate", info.modification_date);
    out_.text("ModifiedBy", info.modified_by);
    if (options_.dcf) {
      out_.text("LastEDS", info.last_eds);
    }
  }

  void device_info() {
    constexpr unsigned kDigits = 8;
    const DeviceInfo& info = sheet_.info;
    const od::DeviceDescription& device = sheet_.device;
    out_.section("DeviceInfo");
    out_.text("VendorName", device.vendor_name);
    out_.entry("VendorNumber", format_hex(device.vendor_number, kDigits));
    out_.text("ProductName", device.product_name);
    out_.entry("ProductNumber", format_hex(device.product_number, kDigits));
    out_.entry("RevisionNumber", format_hex(device.revision_number, kDigits));
    out_.text("OrderCode", info.order_code);
    for (const std::uint16_t rate : kBitRates) {
      out_.flag("BaudRate_" + std::to_string(rate),
                std::ranges::find(info.bit_rates, rate) != info.bit_rates.end());
    }
    out_.flag("SimpleBootUpMaster", info.boot_up_master);
    out_.flag("SimpleBootUpSlave", info.boot_up_slave);
    out_.entry("Granularity", device.dynamic_mapping ? info.granularity : 0U);
    out_.entry("DynamicChannelsSupported", info.dynamic_channels);
    out_.flag("GroupMessaging", info.group_messaging);
    out_.entry("NrOfRXPDO", info.rpdos);
    out_.entry("NrOfTXPDO", info.tpdos);
    out_.flag("LSS_Supported", info.lss);
    if (info.compact_pdo != 0) {
      out_.entry("CompactPDO", format_hex(info.compact_pdo));
    }
    if (info.safety) {
      out_.flag("CANopenSafetySupported", true);
    }
  }

  void dummy_usage() {
    constexpr unsigned kAlways = 7;  // Dummy0001 to Dummy0007
    out_.section("DummyUsage");
    for (unsigned type = 1; type < 32; ++type) {
      const bool used = (sheet_.device.dummy_types >> type & 1U) != 0;
      if (used || type <= kAlways) {
        out_.flag("Dummy" + format_hex(type, 4).substr(2), used);
      }
    }
  }

  void comments(std::string_view section, const std::vector<std::string>& lines) {
    if (lines.empty()) {
      return;
    }
    out_.section(section);
    out_.entry("Lines", lines.size());
    for (std::size_t i = 0; i < lines.size(); ++i) {
      out_.entry("Line" + std::to_string(i + 1), lines[i]);
    }
  }

  // Most tools accept the section under the misspelt name that CiA 306 once gave it, some under the
  // right one: both are written, with the same content.
  void commissioning() {
    for (const char* name : {"DeviceCommissioning", "DeviceComissioning"}) {
      out_.section(name);
      commissioning_entries();
    }
  }

  void commissioning_entries() {
    const Commissioning info = sheet_.commissioning.value_or(Commissioning{});
    out_.entry("NodeID", info.node_id != 0 ? info.node_id : sheet_.device.node_id);
    out_.text("NodeName", info.node_name);
    out_.text("NodeRefd", info.node_reference);
    if (info.bit_rate != 0) {
      out_.entry("Baudrate", info.bit_rate);
    }
    out_.entry("NetNumber", info.net_number);
    out_.text("NetworkName", info.network_name);
    out_.text("NetRefd", info.network_reference);
    out_.flag("CANopenManager", info.manager);
    if (info.lss_serial != 0) {
      out_.entry("LSS_SerialNumber", info.lss_serial);
    }
  }

  void tools() {
    if (sheet_.tools.empty()) {
      return;
    }
    out_.section("Tools");
    out_.entry("Items", sheet_.tools.size());
    for (std::size_t i = 0; i < sheet_.tools.size(); ++i) {
      out_.section("Tool" + std::to_string(i + 1));
      out_.text("Name", sheet_.tools[i].name);
      out_.text("Command", sheet_.tools[i].command);
    }
  }

  void dynamic_channels() {
    if (sheet_.dynamic_segments.empty()) {
      return;
    }
    static constexpr const char* kWords[] = {"ro", "wo", "rw", "rwr", "rww", "const"};
    out_.section("DynamicChannels");
    out_.entry("NrOfSeg", sheet_.dynamic_segments.size());
    std::size_t number = 0;
    for (const DynamicSegment& segment : sheet_.dynamic_segments) {
      const std::string suffix = std::to_string(++number);
      out_.entry("Type" + suffix, format_hex(static_cast<std::uint16_t>(segment.type), 4));
      out_.entry("Dir" + suffix, kWords[static_cast<std::size_t>(segment.access)]);
      out_.entry("Range" + suffix,
                 format_hex(segment.first, 4) + '-' + format_hex(segment.last, 4));
      out_.entry("PPOffset" + suffix,
                 std::to_string(segment.offset) +
                     (segment.difference == 0 ? "" : ", " + std::to_string(segment.difference)));
    }
  }

  void modules() {
    if (!sheet_.modules.empty()) {
      out_.section("SupportedModules");
      out_.entry("NrOfEntries", sheet_.modules.size());
    }
    for (const Module& module : sheet_.modules) {
      this->module(module);
    }
    if (options_.dcf && !sheet_.connected_modules.empty()) {
      numbers("ConnectedModules", "NrOfEntries", sheet_.connected_modules, false);
    }
  }

  void module(const Module& module) {
    const std::string prefix = "M" + std::to_string(module.number);
    out_.section(prefix + "ModuleInfo");
    out_.text("ProductName", module.product_name);
    out_.text("ProductVersion", module.product_version);
    out_.text("ProductRevision", module.product_revision);
    out_.text("OrderCode", module.order_code);
    comments(prefix + "Comments", module.comments);
    std::vector<std::uint16_t> indices;
    for (const od::ObjectDescription& object : module.fixed_objects) {
      indices.push_back(object.index);
    }
    numbers(prefix + "FixedObjects", "NrOfEntries", indices, true);
    for (const od::ObjectDescription& object : module.fixed_objects) {
      write_object(out_, prefix + "Fixed", object, options_);
    }
    indices.clear();
    for (const SubExtension& extension : module.extensions) {
      indices.push_back(extension.index);
    }
    numbers(prefix + "SubExtends", "NrOfEntries", indices, true);
    for (const SubExtension& extension : module.extensions) {
      out_.section(prefix + "SubExt" + format_hex(extension.index, 4).substr(2));
      write_variable(out_, extension.pattern, options_);
      out_.entry("Count", extension.count != 0 ? std::to_string(extension.count)
                                               : "0;" + std::to_string(extension.bits));
      out_.entry("ObjExtend", extension.extend);
    }
  }

  void numbers(std::string_view section, std::string_view count,
               const std::vector<std::uint16_t>& values, bool are_indices) {
    out_.section(section);
    out_.entry(count, values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      out_.entry(std::to_string(i + 1),
                 are_indices ? format_hex(values[i], 4) : std::to_string(values[i]));
    }
  }

  void list(std::string_view section, ObjectList which) {
    std::vector<std::uint16_t> indices;
    for (const od::ObjectDescription& object : sheet_.device.objects) {
      if (list_of(object.index) == which) {
        indices.push_back(object.index);
      }
    }
    numbers(section, "SupportedObjects", indices, true);
  }

  void objects(ObjectList which) {
    for (const od::ObjectDescription& object : sheet_.device.objects) {
      if (list_of(object.index) != which) {
        continue;
      }
      write_object(out_, "", object, options_);
      if (const auto links = sheet_.object_links.find(object.index);
          links != sheet_.object_links.end()) {
        numbers(format_hex(object.index, 4).substr(2) + "ObjectLinks", "ObjectLinks", links->second,
                true);
      }
    }
  }

  const DataSheet& sheet_;
  WriteOptions options_;
  SectionText out_;
};

std::uint16_t count_between(const od::DeviceDescription& device, unsigned first, unsigned last) {
  return static_cast<std::uint16_t>(std::ranges::count_if(device.objects, [&](const auto& object) {
    return object.index >= first && object.index <= last;
  }));
}

}  // namespace

DataSheet sheet_of(od::DeviceDescription device, bool as_dcf) {
  DataSheet sheet;
  sheet.file.eds_version = "4.0";
  sheet.info.rpdos =
      count_between(device, od::objects::kRpdoCommunication, od::objects::kLastRpdoCommunication);
  sheet.info.tpdos =
      count_between(device, od::objects::kTpdoCommunication, od::objects::kLastTpdoCommunication);
  sheet.info.granularity = device.dynamic_mapping ? sheet.info.granularity : 0;
  if (as_dcf) {
    sheet.commissioning.emplace();
    sheet.commissioning->node_id = device.node_id;
    sheet.commissioning->node_name = device.node_name;
  }
  sheet.device = std::move(device);
  return sheet;
}

std::string write_eds(const DataSheet& sheet) {
  return Writer(sheet, false).write();
}

std::string write_dcf(const DataSheet& sheet) {
  return Writer(sheet, true).write();
}

}  // namespace linegate::eds
