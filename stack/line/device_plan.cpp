// SPDX-License-Identifier: Apache-2.0
// device_plan(): the image of a line that consists of devices.
#include <algorithm>
#include <set>
#include <utility>

#include "stack/can/cob_id.h"
#include "stack/line/build.h"
#include "stack/od/data_type.h"
#include "stack/srdo/parameters.h"

namespace linegate::line {
namespace {

constexpr std::uint16_t kFirstOfDevice = 0x2000;  // lower indices are the communication profile
constexpr std::size_t kMostBits = 64;

// The process data of a device, each object once.
class ProcessData {
 public:
  ProcessData(const od::DeviceDescription& device, const pdo::DevicePdos& pdos) {
    received_ = take(pdos.rpdos);
    sent_ = take(pdos.tpdos);
    for (const od::ObjectDescription& object : device.objects) {
      for (const od::VariableDescription& variable : object.variables) {
        add_unmapped({object.index, variable.sub}, variable);
      }
    }
    keep(received_, std::exchange(unmapped_received_, {}));
    keep(sent_, std::exchange(unmapped_sent_, {}));
  }

  std::vector<pdo::Parameters> received() { return std::move(received_); }
  std::vector<pdo::Parameters> sent() { return std::move(sent_); }

 private:
  std::vector<pdo::Parameters> take(const std::vector<pdo::Parameters>& pdos) {
    std::vector<pdo::Parameters> out;
    for (const pdo::Parameters& pdo : pdos) {
      pdo::Parameters once = pdo;
      std::erase_if(once.mapping, [this](const pdo::Mapping& mapping) {
        return mapping.address.index < kFirstOfDevice || !seen_.insert(mapping.address).second;
      });
      if (!once.mapping.empty()) {
        out.push_back(std::move(once));
      }
    }
    return out;
  }

  void add_unmapped(od::Address address, const od::VariableDescription& variable) {
    const std::size_t bits = od::bit_size(variable.type);
    if (address.index < kFirstOfDevice || !variable.mappable || bits == 0 || bits > kMostBits ||
        !seen_.insert(address).second) {
      return;
    }
    const pdo::Mapping mapping{address, static_cast<std::uint8_t>(bits)};
    if (od::rpdo_mappable(variable.access)) {
      unmapped_received_.push_back(mapping);
    } else if (od::tpdo_mappable(variable.access)) {
      unmapped_sent_.push_back(mapping);
    }
  }

  static void keep(std::vector<pdo::Parameters>& pdos, std::vector<pdo::Mapping> unmapped) {
    if (!unmapped.empty()) {
      pdos.push_back({.number = 0, .cob_id = {}, .mapping = std::move(unmapped)});
    }
  }

  std::set<od::Address> seen_;
  std::vector<pdo::Parameters> received_;
  std::vector<pdo::Parameters> sent_;
  std::vector<pdo::Mapping> unmapped_received_;
  std::vector<pdo::Mapping> unmapped_sent_;
};

// PDOs may share an identifier: that is a matter of the devices and their master. A number of its
// own makes each a separate PDO of the image.
void number_identifiers(std::vector<pdo::Parameters>& pdos, std::uint32_t& next) {
  for (pdo::Parameters& pdo : pdos) {
    pdo.cob_id = {can::CobId::kExtendedBit | next++};
  }
}

// There is no manager dictionary in which network variables could represent the image.
void forget_variables(image::Layout& layout) {
  for (image::Entry& entry : layout.entries) {
    entry.variable_index = 0;
    entry.variable_sub = 0;
  }
  layout.id = image::layout_id(layout);
}

// The objects 1300h to 13FFh of an own device are ordinary objects.
void note_srdos(const DeviceConfig& device, std::vector<Diagnostic>& diagnostics) {
  const auto described = srdo::describe_srdos(device.device);
  if (described.value && !described.value->empty()) {
    diagnostics.push_back({Severity::warning, device.device.file, 0, 0,
                           "SRDOs of " + device.name +
                               " are neither transmitted nor received: Linegate produces no SRDOs, "
                               "and its devices use none"});
  }
}

// Of CANopen FD: the values of own devices are numbers.
void refuse_long_values(const DeviceConfig& device, const pdo::DevicePdos& pdos,
                        std::vector<Diagnostic>& diagnostics) {
  for (const auto* const each : {&pdos.tpdos, &pdos.rpdos}) {
    for (const pdo::Parameters& parameters : *each) {
      for (const pdo::Mapping& mapping : parameters.mapping) {
        if (mapping.bits > 64) {
          diagnostics.push_back({Severity::error, device.device.file, 0, 0,
                                 device.name + ": " + od::to_text(mapping.address) + " has " +
                                     std::to_string(mapping.bits / 8) +
                                     " bytes: own devices exchange values of up to 8 bytes"});
        }
      }
    }
  }
}

}  // namespace

Loaded<pdo::LinkPlan> device_plan(const LineConfig& config) {
  std::vector<Diagnostic> diagnostics;
  std::vector<pdo::RemoteNode> remotes;
  std::uint32_t identifiers = 1;
  for (const DeviceConfig& device : config.devices) {
    Loaded<pdo::DevicePdos> pdos = pdo::describe_pdos(device.device, longest_pdo(config));
    diagnostics.insert(diagnostics.end(), pdos.diagnostics.begin(), pdos.diagnostics.end());
    if (!pdos.ok()) {
      continue;
    }
    refuse_long_values(device, *pdos.value, diagnostics);
    ProcessData data(device.device, *pdos.value);
    pdo::RemoteNode remote{
        .id = device.id, .name = device.name, .pdos = {}, .device = &device.device};
    remote.pdos.tpdos = data.received();
    remote.pdos.rpdos = data.sent();
    number_identifiers(remote.pdos.tpdos, identifiers);
    number_identifiers(remote.pdos.rpdos, identifiers);
    remotes.push_back(std::move(remote));
    note_srdos(device, diagnostics);
  }
  Loaded<pdo::LinkPlan> plan = pdo::plan_links(remotes);
  plan.diagnostics.insert(plan.diagnostics.begin(), diagnostics.begin(), diagnostics.end());
  if (has_errors(plan.diagnostics)) {
    plan.value.reset();
    return plan;
  }
  forget_variables(plan.value->inputs);
  forget_variables(plan.value->outputs);
  return plan;
}

}  // namespace linegate::line
