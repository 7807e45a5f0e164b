// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/device_file.h"

#include <algorithm>
#include <iostream>
#include <iterator>
#include <utility>

#include "gateway/config/data_sheet.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/runtime/log.h"
#include "stack/eds/writer.h"
#include "stack/line/build.h"
#include "stack/line/line.h"
#include "stack/manager/plan.h"
#include "stack/od/dictionary.h"
#include "stack/od/objects.h"
#include "stack/storage/parameters.h"
#include "stack/storage/storage.h"

namespace linegate::gateway {
namespace {

DeviceFile failure(std::string text) {
  return {.ok = false, .content = std::move(text)};
}

const line::LineConfig* find_line(const config::Plant& plant, const std::string& name) {
  const auto at = std::ranges::find_if(plant.lines, [&](const config::LinePlan& line) {
    return line.config.name == name || std::to_string(line.config.network_id) == name;
  });
  return at == plant.lines.end() ? nullptr : &at->config;
}

// Sets the values that the objects to store and restore parameters return: saves on command, or not
// at all (CiA 301 7.5.2.13).
void describe_storage(od::DeviceDescription& device, bool stores) {
  for (od::ObjectDescription& object : device.objects) {
    if (object.index != od::objects::kStoreParameters &&
        object.index != od::objects::kRestoreDefaults) {
      continue;
    }
    for (od::VariableDescription& variable : object.variables) {
      if (variable.sub != 0 && od::byte_size(variable.type) == sizeof(std::uint32_t)) {
        const bool on_command = stores && storage::is_group(variable.sub);
        variable.value.assign(sizeof(std::uint32_t), std::byte{0});
        variable.value[0] = std::byte{on_command};
      }
    }
  }
}

DeviceFile own_eds(const line::LineConfig& config) {
  if (!config.devices.empty()) {
    return failure("line " + config.name + " has devices instead of an own node; name one of them");
  }
  if (config.role == line::Role::observer) {
    return failure("line " + config.name + " is an observer and has no node of its own");
  }
  const auto made = line::Line::make(config);
  if (!made.value) {
    const auto error = std::ranges::find(made.diagnostics, Severity::error, &Diagnostic::severity);
    return failure(to_string(*error));
  }
  od::DeviceDescription device;
  device.objects = (*made.value)->dictionary().describe();
  device.node_id = config.node_id;
  describe_storage(device, config.stores_parameters);
  device.vendor_name = "Linegate";
  device.product_name = "Linegate line " + config.name;
  device.vendor_number = config.identity.vendor;
  device.product_number = config.identity.product;
  device.revision_number = config.identity.revision;
  eds::DataSheet sheet = eds::sheet_of(std::move(device));
  sheet.file.file_name = config.name + ".eds";
  sheet.file.description = "Own node of line " + config.name;
  sheet.info.bit_rates.assign(std::begin(eds::kBitRates), std::end(eds::kBitRates));
  sheet.info.boot_up_master = config.role == line::Role::manager;
  sheet.info.boot_up_slave = config.role == line::Role::device;
  return {.ok = true, .content = eds::write_eds(sheet)};
}

// Default values are the initial values of the device. Objects that it transmits have none, because
// the process determines their values.
void describe_values(od::DeviceDescription& device) {
  for (od::ObjectDescription& object : device.objects) {
    for (od::VariableDescription& variable : object.variables) {
      const bool sent = variable.mappable &&
                        (variable.access == od::Access::rwr || !od::writable(variable.access));
      variable.configured = false;
      if (sent) {
        variable.value.clear();
      }
    }
  }
}

// Includes all data of its source file besides the objects. A device of a profile has no source
// file.
eds::DataSheet sheet_of_device(const line::LineConfig& config, const line::DeviceConfig& device) {
  od::DeviceDescription described = device.device;
  describe_values(described);
  describe_storage(described, config.stores_parameters);
  auto sheet = config::load_sheet(described.file, device.id);
  if (!sheet) {
    sheet = eds::sheet_of(described);
    sheet->info.bit_rates.assign(std::begin(eds::kBitRates), std::end(eds::kBitRates));
    sheet->info.boot_up_slave = true;
  }
  sheet->commissioning.reset();  // belongs into a DCF only
  sheet->connected_modules.clear();
  sheet->modules.clear();  // their objects are already those of the device
  sheet->info.lss = device.lss;
  sheet->device = std::move(described);
  return *std::move(sheet);
}

// EDS of a device of a line in the role device.
DeviceFile device_eds(const line::LineConfig& config, const std::string& name) {
  const auto device = std::ranges::find_if(config.devices, [&](const line::DeviceConfig& d) {
    return d.name == name || std::to_string(d.id) == name;
  });
  if (device == config.devices.end()) {
    return failure("line " + config.name + " has no device " + name);
  }
  eds::DataSheet sheet = sheet_of_device(config, *device);
  sheet.file.file_name = device->name + ".eds";
  if (sheet.file.description.empty()) {
    sheet.file.description = "Device " + device->name + " of line " + config.name;
  }
  return {.ok = true, .content = eds::write_eds(sheet)};
}

// The device after configuration: the values that are written to it become its configured values.
od::DeviceDescription configured(const line::NodeConfig& node,
                                 const std::vector<manager::ObjectWrite>& writes) {
  od::DeviceDescription device = node.device;
  for (const manager::ObjectWrite& write : writes) {
    for (od::ObjectDescription& object : device.objects) {
      const auto variable = object.index == write.address.index
                                ? std::ranges::find(object.variables, write.address.sub,
                                                    &od::VariableDescription::sub)
                                : object.variables.end();
      if (variable != object.variables.end()) {
        variable->value = write.data;
        variable->configured = true;
        variable->notes.value_formula = false;
      }
    }
  }
  return device;
}

DeviceFile node_file(const line::LineConfig& config, const std::string& name, DeviceFileKind kind) {
  const auto node = std::ranges::find_if(config.nodes, [&](const line::NodeConfig& n) {
    return n.name == name || std::to_string(n.id) == name;
  });
  const bool is_own = std::ranges::any_of(config.devices, [&](const line::DeviceConfig& device) {
    return device.name == name || std::to_string(device.id) == name;
  });
  if (is_own) {
    return failure(name + " is an own device of line " + config.name +
                   ", which the gateway does not configure: linegate eds prints its EDS");
  }
  if (node == config.nodes.end()) {
    return failure("line " + config.name + " has no node " + name);
  }
  const auto plans = line::node_plans(config);
  const auto plan = std::ranges::find(plans, node->id, &manager::NodePlan::id);
  const auto& writes = plan->writes;
  if (kind == DeviceFileKind::concise) {
    const std::vector<std::byte> data = manager::write_concise_dcf(writes);
    return {.ok = true,
            .content = std::string(reinterpret_cast<const char*>(data.data()), data.size())};
  }
  eds::DataSheet sheet = eds::sheet_of(configured(*node, writes), true);
  sheet.file.file_name = node->name + ".dcf";
  sheet.file.last_eds = node->device.file;
  sheet.commissioning->node_id = node->id;
  sheet.commissioning->node_name = node->name;
  sheet.commissioning->bit_rate = static_cast<std::uint16_t>(config.bit_rate / 1000);
  sheet.commissioning->net_number = config.network_id;
  sheet.commissioning->network_name = config.name;
  return {.ok = true, .content = eds::write_dcf(sheet)};
}

}  // namespace

DeviceFile write_device_file(const config::Plant& plant, const std::string& of,
                             DeviceFileKind kind) {
  const std::size_t colon = std::min(of.find(':'), of.size());
  const line::LineConfig* line = find_line(plant, of.substr(0, colon));
  if (line == nullptr) {
    return failure("there is no line " + of.substr(0, colon));
  }
  if (kind == DeviceFileKind::eds) {
    return colon == of.size()      ? own_eds(*line)
           : line->devices.empty() ? failure("expected a line, got " + of)
                                   : device_eds(*line, of.substr(colon + 1));
  }
  return colon == of.size() ? failure("expected LINE:NODE, got " + of)
                            : node_file(*line, of.substr(colon + 1), kind);
}

int print_device_file(const std::string& path, const std::string& of, DeviceFileKind kind) {
  // The EDS of a device depends on its own line only, so other lines are not loaded.
  const std::size_t colon = of.find(':');
  const bool alone = kind == DeviceFileKind::eds && colon != std::string::npos;
  const auto loaded = alone ? config::load_line(path, of.substr(0, colon)) : config::load(path);
  print(loaded.diagnostics);
  if (!loaded.value) {
    return kExitUsage;
  }
  const DeviceFile file = write_device_file(*loaded.value, of, kind);
  (file.ok ? std::cout : std::cerr) << file.content << (file.ok ? "" : "\n");
  return file.ok ? kExitOk : kExitUsage;
}

}  // namespace linegate::gateway
