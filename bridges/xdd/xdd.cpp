// SPDX-License-Identifier: Apache-2.0
#include "bridges/xdd/xdd.h"

#include <algorithm>
#include <string>
#include <utility>

#include "bridges/xdd/document.h"
#include "bridges/xdd/object.h"
#include "bridges/xdd/sections.h"
#include "stack/eds/text.h"

namespace linegate::xdd {
namespace {

constexpr std::string_view kRoot = "ISO15745ProfileContainer";

class Reader {
 public:
  Reader(std::string_view text, eds::Report& report) : report_(report), document_(text, report) {}

  // After a reported error nothing more may be read.
  void read() {
    const pugi::xml_node root = document_.root();
    if (!root) {
      return;
    }
    if (local_name(root) != kRoot) {
      report_.error(document_.place(root), "this is no XDD or XDC: it begins with " +
                                               eds::quote(local_name(root)) + ", not with " +
                                               std::string(kRoot));
      return;
    }
    find_profiles(root);
    read_file_info();
    read_device_info();
    read_dummy_usage();
    read_dynamic_channels();
    read_commissioning();
    read_parameters();
    read_objects();
  }

  const eds::Ini& sections() const { return sections_.ini(); }

 private:
  using Builder = Sections::Builder;

  void find_profiles(pugi::xml_node root) {
    for (const pugi::xml_node profile : children(root, "ISO15745Profile")) {
      const pugi::xml_node body = child(profile, "ProfileBody");
      if (child(body, "ApplicationLayers")) {
        network_ = body;
      } else if (child(body, "DeviceIdentity")) {
        device_ = body;
      }
    }
    if (!device_) {
      report_.warning(document_.place(root), "there is no profile of the device (DeviceIdentity)");
    }
    if (!network_) {
      report_.warning(document_.place(root),
                      "there is no profile of the network (ApplicationLayers)");
    }
  }

  void add_attribute(Builder& section, std::string_view key, pugi::xml_node node,
                     const char* name) {
    if (const pugi::xml_attribute attribute = node.attribute(name)) {
      section.add(key, attribute.value(), document_.place(node, name));
    }
  }
  // xsd:boolean
  void add_flag(Builder& section, std::string_view key, pugi::xml_node node, const char* name) {
    if (const pugi::xml_attribute attribute = node.attribute(name)) {
      const std::string_view value = attribute.value();
      section.add(key,
                  value == "true"    ? "1"
                  : value == "false" ? "0"
                                     : attribute.value(),
                  document_.place(node, name));
    }
  }
  void add_text(Builder& section, std::string_view key, pugi::xml_node node) {
    if (node) {
      section.add(key, std::string(eds::trim(node.text().get())), document_.place(node));
    }
  }

  void read_file_info() {
    const pugi::xml_node body = device_ ? device_ : network_;
    Builder section(sections_, "FileInfo", document_.place(body));
    add_attribute(section, "FileName", body, "fileName");
    add_attribute(section, "FileVersion", body, "fileVersion");
    add_attribute(section, "CreatedBy", body, "fileCreator");
    add_attribute(section, "CreationDate", body, "fileCreationDate");
    add_attribute(section, "CreationTime", body, "fileCreationTime");
    add_attribute(section, "ModifiedBy", body, "fileModifiedBy");
    add_attribute(section, "ModificationDate", body, "fileModificationDate");
    add_attribute(section, "ModificationTime", body, "fileModificationTime");
    section.finish();
  }

  void read_device_info() {
    const pugi::xml_node identity = child(device_, "DeviceIdentity");
    Builder section(sections_, "DeviceInfo", document_.place(identity));
    add_text(section, "VendorName", child(identity, "vendorName"));
    add_text(section, "VendorNumber", child(identity, "vendorID"));
    add_text(section, "ProductName", child(identity, "productName"));
    add_text(section, "ProductNumber", child(identity, "productID"));
    add_text(section, "OrderCode", child(identity, "orderNumber"));
    const pugi::xml_node management = child(network_, "NetworkManagement");
    const pugi::xml_node general = child(management, "CANopenGeneralFeatures");
    add_attribute(section, "Granularity", general, "granularity");
    add_attribute(section, "NrOfRXPDO", general, "nrOfRxPDO");
    add_attribute(section, "NrOfTXPDO", general, "nrOfTxPDO");
    add_attribute(section, "DynamicChannelsSupported", general, "dynamicChannels");
    add_flag(section, "SimpleBootUpSlave", general, "bootUpSlave");
    add_flag(section, "GroupMessaging", general, "groupMessaging");
    add_flag(section, "LSS_Supported", general, "layerSettingServiceSlave");
    add_flag(section, "SimpleBootUpMaster", child(management, "CANopenMasterFeatures"),
             "bootUpMaster");
    const pugi::xml_node rates =
        child(child(child(network_, "TransportLayers"), "PhysicalLayer"), "baudRate");
    for (const pugi::xml_node rate : children(rates, "supportedBaudRate")) {
      section.add("BaudRate_" + kilobits(rate.attribute("value").value()), "1",
                  document_.place(rate));
    }
    section.finish();
  }

  // "500" of "500 Kbps".
  static std::string kilobits(std::string_view text) {
    text = eds::trim(text);
    return std::string(text.substr(0, text.find(' ')));
  }

  void read_dummy_usage() {
    const pugi::xml_node usage = child(child(network_, "ApplicationLayers"), "dummyUsage");
    if (!usage) {
      return;
    }
    Builder section(sections_, "DummyUsage", document_.place(usage));
    for (const pugi::xml_node dummy : children(usage, "dummy")) {
      const std::string_view entry = dummy.attribute("entry").value();
      const std::size_t equals = std::min(entry.find('='), entry.size());
      section.append(std::string(eds::trim(entry.substr(0, equals))),
                     std::string(eds::trim(entry.substr(std::min(equals + 1, entry.size())))),
                     document_.place(dummy, "entry"));
    }
    section.finish();
  }

  void read_dynamic_channels() {
    const pugi::xml_node list = child(child(network_, "ApplicationLayers"), "dynamicChannels");
    const auto channels = children(list, "dynamicChannel");
    if (channels.empty()) {
      return;
    }
    Builder section(sections_, "DynamicChannels", document_.place(list));
    section.add("NrOfSeg", std::to_string(channels.size()), document_.place(list));
    std::size_t number = 0;
    for (const pugi::xml_node channel : channels) {
      const std::string suffix = std::to_string(++number);
      const std::string_view access = channel.attribute("accessType").value();
      const char* direction = access == "readOnly"    ? "ro"
                              : access == "writeOnly" ? "wo"
                              : access == "readWriteOutput"
                                  ? "rww"
                                  : channel.attribute("accessType").value();
      section.add("Type" + suffix, "0x" + std::string(channel.attribute("dataType").value()),
                  document_.place(channel, "dataType"));
      section.add("Dir" + suffix, direction, document_.place(channel, "accessType"));
      section.add("Range" + suffix,
                  "0x" + std::string(channel.attribute("startIndex").value()) + "-0x" +
                      channel.attribute("endIndex").value(),
                  document_.place(channel, "startIndex"));
      add_attribute(section, "PPOffset" + suffix, channel, "addressOffset");
    }
    section.finish();
  }

  void read_commissioning() {
    const pugi::xml_node node = child(child(network_, "NetworkManagement"), "deviceCommissioning");
    if (!node) {
      return;
    }
    Builder section(sections_, "DeviceCommissioning", document_.place(node));
    add_attribute(section, "NodeID", node, "nodeID");
    add_attribute(section, "NodeName", node, "nodeName");
    if (const pugi::xml_attribute rate = node.attribute("actualBaudRate")) {
      section.add("Baudrate", kilobits(rate.value()), document_.place(node, "actualBaudRate"));
    }
    add_attribute(section, "NetNumber", node, "networkNumber");
    add_attribute(section, "NetworkName", node, "networkName");
    add_flag(section, "CANopenManager", node, "CANopenManager");
    section.finish();
  }

  void read_parameters() {
    const pugi::xml_node list = child(child(device_, "ApplicationProcess"), "parameterList");
    for (const pugi::xml_node parameter : children(list, "parameter")) {
      parameters_.emplace(parameter.attribute("uniqueID").value(), parameter);
    }
  }

  void read_objects() {
    const pugi::xml_node list = child(child(network_, "ApplicationLayers"), "CANopenObjectList");
    ObjectReader reader(document_, parameters_, sections_, report_);
    Builder listed(sections_, "OptionalObjects", document_.place(list));
    std::size_t number = 0;
    for (const pugi::xml_node object : children(list, "CANopenObject")) {
      if (const std::string index = reader.read(object); !index.empty()) {
        listed.append(std::to_string(++number), "0x" + index, document_.place(object, "index"));
      }
    }
    listed.finish();
  }

  eds::Report& report_;
  Document document_;
  Sections sections_;
  pugi::xml_node device_;
  pugi::xml_node network_;
  Parameters parameters_;
};

}  // namespace

bool is_xdd(std::string_view file_name) {
  const std::string name = eds::lower(file_name);
  return name.ends_with(".xdd") || name.ends_with(".xdc");
}

Loaded<eds::DataSheet> read(std::string_view text, std::string_view file_name,
                            std::uint8_t node_id) {
  eds::Report report(file_name);
  Reader reader(text, report);
  reader.read();
  return eds::read(reader.sections(), std::move(report), file_name, node_id);
}

}  // namespace linegate::xdd
