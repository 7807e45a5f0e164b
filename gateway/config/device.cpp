// SPDX-License-Identifier: Apache-2.0
// `devices:` of a line in the role device: the devices that this line implements.
#include <algorithm>

#include "gateway/config/patch.h"
#include "gateway/config/sections.h"
#include "gateway/config/value.h"
#include "stack/od/objects.h"
#include "stack/pdo/described_cob_id.h"
#include "stack/profile/io_device.h"
#include "stack/storage/parameters.h"

namespace linegate::config {
namespace {

constexpr std::size_t kClassicalPdo = 64;  // bits

using std::chrono::milliseconds;

constexpr od::Address kProducerHeartbeat{od::objects::kProducerHeartbeatTime, 0};
constexpr od::Address kSerialNumber{od::objects::kIdentity, 4};

// Sets the initial value, whatever the access of the object.
void preset(Findings& findings, od::DeviceDescription& device, od::Address address,
            std::uint64_t value, Place place) {
  const od::VariableDescription* variable = device.find(address);
  if (variable == nullptr) {
    findings.error(place, device.file + " has no object " + format_address(address));
    return;
  }
  std::vector<std::byte> data;
  for (unsigned byte = 0; byte < od::byte_size(variable->type); ++byte) {
    data.push_back(static_cast<std::byte>(value >> 8U * byte));
  }
  set_value(device, address, data);
}

void read_presets(Section& section, od::DeviceDescription& device) {
  Findings& findings = section.findings();
  const YAML::Node serial = section.find("serial");
  if (const auto number = section.number(serial, 0, 0xFFFF'FFFF)) {
    preset(findings, device, kSerialNumber, *number, place_of(serial));
  }
  const YAML::Node heartbeat = section.find("heartbeat");
  if (heartbeat.IsDefined()) {
    Duration time{};
    section.read_multiple("heartbeat", time, milliseconds(1), milliseconds(65'535));
    preset(findings, device, kProducerHeartbeat, static_cast<std::uint64_t>(time / milliseconds(1)),
           place_of(heartbeat));
  }
}

// `profile: 401` with numbers of blocks: a device without a file. Returns false without the key.
bool read_io_profile(Section& section, bool stores, line::NodeConfig& config) {
  const YAML::Node node = section.find("profile");
  const std::size_t before = section.findings().errors();
  profile::IoBlocks blocks;
  section.read_number("digital_inputs", blocks.digital_inputs, 0, profile::kMostIoBlocks);
  section.read_number("digital_outputs", blocks.digital_outputs, 0, profile::kMostIoBlocks);
  section.read_number("analogue_inputs", blocks.analogue_inputs, 0, profile::kMostIoBlocks);
  section.read_number("analogue_outputs", blocks.analogue_outputs, 0, profile::kMostIoBlocks);
  Findings& findings = section.findings();
  if (!node.IsDefined()) {
    for (const char* key :
         {"digital_inputs", "digital_outputs", "analogue_inputs", "analogue_outputs"}) {
      if (const YAML::Node blocks_of = section.find(key); blocks_of.IsDefined()) {
        findings.error(place_of(blocks_of),
                       std::string(key) + " is for a device with profile: 401");
      }
    }
    return false;
  }
  bool known = false;
  section.choose<bool>(node, known, {{"401", true}});
  for (const char* key : {"eds", "dcf"}) {
    if (const YAML::Node file = section.find(key); file.IsDefined()) {
      findings.error(place_of(file), "a device has either a profile or a device file");
    }
  }
  if (findings.errors() == before && blocks.digital_inputs + blocks.digital_outputs +
                                             blocks.analogue_inputs + blocks.analogue_outputs ==
                                         0) {
    findings.error(place_of(node),
                   "a device with profile: 401 has at least one of digital_inputs, "
                   "digital_outputs, analogue_inputs, analogue_outputs");
  }
  if (config.id != 0) {
    config.device = profile::make_io_device(blocks, config.name, config.id, stores);
    config.device.file = "profile 401";
  }
  return true;
}

// Configured values no longer depend on the node-ID as the formula of the file does.
void forget_formulas(od::DeviceDescription& device, const od::DeviceDescription& before) {
  for (od::ObjectDescription& object : device.objects) {
    for (od::VariableDescription& variable : object.variables) {
      const od::VariableDescription* was = before.find({object.index, variable.sub});
      if (was != nullptr && was->value != variable.value) {
        variable.notes.value_formula = false;
      }
    }
  }
}

// Reads a device; its description gets all initial values.
line::DeviceConfig read_one(Findings& findings, const YAML::Node& node, bool stores,
                            std::vector<BindingSection>& bindings) {
  line::NodeConfig config;
  Section section(findings, node, "a device");
  if (const auto id = section.number(section.require("id"), 1, 127)) {
    config.id = static_cast<std::uint8_t>(*id);
  }
  config.name = "device" + std::to_string(config.id);
  const YAML::Node name = section.find("name");
  if (auto text = section.text(name)) {
    check_node_name(findings, *text, place_of(name));
    config.name = std::move(*text);
  }
  bool lss = false;
  section.read("lss", lss);
  const YAML::Node objects = section.find("objects");
  const YAML::Node pdos = section.find("pdos");
  const YAML::Node values = section.find("values");
  section.find("serial");
  section.find("heartbeat");
  const bool made = read_io_profile(section, stores, config);
  if (made ? config.id != 0 : read_device_file(section, config, "a device")) {
    const od::DeviceDescription before = config.device;
    pdo::complete_cob_ids(config.device);
    read_presets(section, config.device);
    read_pdos(findings, pdos, config, kClassicalPdo);
    read_objects(findings, objects, config);
    for (const line::ObjectValue& object : config.objects) {
      set_value(config.device, object.address, object.data);
    }
    read_values(findings, values, config.device);
    if (lss) {
      forget_formulas(config.device, before);
    }
  }
  read_bindings(findings, section.find("bind"), config.id, bindings);
  section.done();
  return {.id = config.id,
          .name = std::move(config.name),
          .device = std::move(config.device),
          .lss = lss};
}

void check_clash(Findings& findings, const line::LineConfig& config,
                 const line::DeviceConfig& device, Place place) {
  for (const line::DeviceConfig& other : config.devices) {
    if (other.id == device.id && device.id != 0) {
      findings.error(place, "node-ID " + std::to_string(device.id) + " is that of \"" + other.name +
                                "\" already");
    }
    if (other.name == device.name) {
      findings.error(place, "another device is called \"" + device.name + "\"");
    }
  }
}

// Reports keys that only a line with its own node may have.
void report_keys_of_an_own_node(Section& section) {
  for (const char* key : {"node_id",      "heartbeat",        "sync",           "time",
                          "sdo_timeout",  "save_timeout",     "load_timeout",   "pdo_update_time",
                          "reset_nodes",  "start_nodes",      "startup",        "identity",
                          "strict_ixxat", "keep_operational", "canopenia_base", "own_objects",
                          "own_values",   "own_concise_dcf",  "nodes",          "node_list",
                          "simulate",     "sdo_connections"}) {
    const YAML::Node node = section.find(key);
    if (node.IsDefined()) {
      section.findings().error(place_of(node), std::string(key) +
                                                   " is not for a line with devices: it has no "
                                                   "node of its own beside them");
    }
  }
}

}  // namespace

void read_devices(Section& section, LineSection& line) {
  line::LineConfig& config = line.plan.config;
  Findings& findings = section.findings();
  const YAML::Node list = section.find("devices");
  for (const YAML::Node& element : elements(findings, list, "devices", kMostNodes)) {
    line::DeviceConfig device =
        read_one(findings, element, config.stores_parameters, line.bindings);
    if (config.stores_parameters) {
      storage::mark_parameters(device.device);
    }
    check_clash(findings, config, device, place_of(element));
    config.devices.push_back(std::move(device));
  }
  std::stable_sort(config.devices.begin(), config.devices.end(),
                   [](const auto& a, const auto& b) { return a.id < b.id; });
  if (config.role != line::Role::device) {
    if (list.IsDefined()) {
      findings.error(place_of(list), "devices are for a line with the role device; a " +
                                         std::string(name(config.role)) + " has nodes");
    }
    return;
  }
  if (!list.IsDefined()) {
    return;  // one own node below another master
  }
  config.node_id = 0;
  report_keys_of_an_own_node(section);
  if (config.devices.empty() && section.valid()) {
    findings.error(place_of(list),
                   "devices is empty: name at least one, or leave the key out for a line whose own "
                   "node, node_id, obeys another master");
  }
}

}  // namespace linegate::config
