// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/network_list.h"

#include <string>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/od/number_variable.h"

namespace linegate::manager {
namespace {

using od::Access;
using od::DataType;

constexpr std::uint8_t kNodes = 127;
constexpr std::uint8_t kNodesAndAll = 128;  // 1F82h, 1F83h: the last is all of them

od::ObjectDescription object(std::uint16_t index, std::string name, DataType type,
                             std::uint64_t value) {
  od::ObjectDescription out{.index = index, .name = name, .type = od::ObjectType::variable};
  out.variables.push_back(od::number_variable(0, std::move(name), type, Access::rw, value));
  return out;
}

// One element for each node-ID.
od::ObjectDescription per_node(std::uint16_t index, std::string name, DataType type,
                               std::uint8_t count = kNodes) {
  od::ObjectDescription out{.index = index, .name = std::move(name), .type = od::ObjectType::array};
  out.variables.reserve(count + 1U);
  out.variables.push_back(od::number_variable(0, "Highest sub-index supported", DataType::unsigned8,
                                              Access::constant, count));
  for (unsigned sub = 1; sub <= count; ++sub) {
    out.variables.push_back(od::number_variable(
        static_cast<std::uint8_t>(sub), out.name + ' ' + std::to_string(sub), type, Access::rw, 0));
  }
  return out;
}

void set(od::ObjectDescription& object, std::uint8_t sub, std::uint64_t value) {
  store_le(std::span(object.variables[sub].value), value);
}

std::uint32_t assignment_of(const NodePlan& plan) {
  using namespace assignment;
  std::uint32_t out = kListed;
  const auto add = [&out](bool wanted, std::uint32_t bits) { out |= wanted ? bits : 0U; };
  add(plan.boot, kBoot);
  add(plan.mandatory, kMandatory);
  add(plan.keep_alive, kKeepAlive);
  add(plan.restore != 0, kRestore);
  add(plan.software != 0, kVerifySoftware);
  add(plan.update_software, kUpdateSoftware);
  const auto guard_time = std::chrono::duration_cast<std::chrono::milliseconds>(plan.guard_time);
  return out | std::uint32_t{plan.life_time_factor} << 8U |
         static_cast<std::uint32_t>(guard_time.count()) << 16U;
}

std::uint32_t startup_of(const Options& options) {
  using namespace startup;
  std::uint32_t out = options.master ? kMaster : 0U;
  const auto add = [&out](bool wanted, std::uint32_t bits) { out |= wanted ? bits : 0U; };
  add(options.start_all, kStartAll);
  add(!options.own_start, kApplicationStarts);
  add(!options.start_nodes, kSlavesNotStarted);
  add(options.on_error == ErrorReaction::reset_all, kResetAll);
  add(options.on_error == ErrorReaction::stop_all, kStopAll);
  return out;
}

}  // namespace

std::vector<od::ObjectDescription> network_objects(const std::vector<NodePlan>& plans,
                                                   const Options& options) {
  using std::chrono::duration_cast;
  constexpr auto kTick = std::chrono::microseconds(100);  // of 102Ah
  const auto inhibit = duration_cast<std::chrono::microseconds>(options.nmt_inhibit);
  const auto boot_time = duration_cast<std::chrono::milliseconds>(options.boot_time);
  od::ObjectDescription assignments =
      per_node(kSlaveAssignment, "Slave assignment", DataType::unsigned32);
  std::pair<od::ObjectDescription, std::uint32_t NodePlan::*> expected[] = {
      {per_node(kExpectedDeviceType, "Device type identification", DataType::unsigned32),
       &NodePlan::device_type},
      {per_node(kExpectedVendor, "Vendor identification", DataType::unsigned32), &NodePlan::vendor},
      {per_node(kExpectedProduct, "Product code", DataType::unsigned32), &NodePlan::product},
      {per_node(kExpectedRevision, "Revision number", DataType::unsigned32), &NodePlan::revision},
      {per_node(kExpectedSerial, "Serial number", DataType::unsigned32), &NodePlan::serial},
  };
  od::ObjectDescription restore =
      per_node(kRestoreConfiguration, "Restore configuration", DataType::unsigned8);
  for (const NodePlan& plan : plans) {
    set(assignments, plan.id, assignment_of(plan));
    for (auto& [array, member] : expected) {
      set(array, plan.id, plan.*member);
    }
    set(restore, plan.id, plan.restore);
  }
  std::vector<od::ObjectDescription> out;
  out.push_back(object(kNmtInhibitTime, "NMT inhibit time", DataType::unsigned16,
                       static_cast<std::uint64_t>(inhibit / kTick)));
  out.push_back(object(kNmtStartup, "NMT startup", DataType::unsigned32, startup_of(options)));
  out.push_back(std::move(assignments));
  out.push_back(per_node(kRequestNmt, "Request NMT", DataType::unsigned8, kNodesAndAll));
  out.push_back(per_node(kRequestGuarding, "Request guarding", DataType::unsigned8, kNodesAndAll));
  for (auto& [array, member] : expected) {
    out.push_back(std::move(array));
  }
  out.push_back(object(kBootTime, "Boot time", DataType::unsigned32,
                       static_cast<std::uint64_t>(boot_time.count())));
  out.push_back(std::move(restore));
  return out;
}

}  // namespace linegate::manager
