// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/network_list.h"

#include <string>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"

namespace linegate::manager {
namespace {

using od::Access;
using od::DataType;

constexpr std::uint8_t kNodes = 127;
constexpr std::uint8_t kNodesAndAll = 128;  // 1F82h, 1F83h: the last sub-index stands for all nodes

// One element for each node-ID.
od::ObjectDescription per_node(std::uint16_t index, std::uint8_t count = kNodes) {
  const od::objects::Entry& entry = od::objects::at(index);
  od::ObjectDescription out{
      .index = index, .name = std::string(entry.name), .type = od::ObjectType::array};
  out.variables.reserve(count + 1U);
  out.variables.push_back(od::number_variable(0, "Highest sub-index supported", DataType::unsigned8,
                                              Access::constant, count));
  for (unsigned sub = 1; sub <= count; ++sub) {
    out.variables.push_back(od::number_variable(static_cast<std::uint8_t>(sub),
                                                out.name + ' ' + std::to_string(sub), entry.type,
                                                Access::rw, 0));
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
  add(options.flying, kFlyingMaster);
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
  od::ObjectDescription assignments = per_node(od::objects::kSlaveAssignment);
  std::pair<od::ObjectDescription, std::uint32_t NodePlan::*> expected[] = {
      {per_node(od::objects::kExpectedDeviceType), &NodePlan::device_type},
      {per_node(od::objects::kExpectedVendor), &NodePlan::vendor},
      {per_node(od::objects::kExpectedProduct), &NodePlan::product},
      {per_node(od::objects::kExpectedRevision), &NodePlan::revision},
      {per_node(od::objects::kExpectedSerial), &NodePlan::serial},
  };
  od::ObjectDescription restore = per_node(od::objects::kRestoreConfiguration);
  for (const NodePlan& plan : plans) {
    set(assignments, plan.id, assignment_of(plan));
    for (auto& [array, member] : expected) {
      set(array, plan.id, plan.*member);
    }
    set(restore, plan.id, plan.restore);
  }
  std::vector<od::ObjectDescription> out;
  out.push_back(od::catalogued_variable(od::objects::kNmtInhibitTime, Access::rw,
                                        static_cast<std::uint64_t>(inhibit / kTick)));
  out.push_back(od::catalogued_variable(od::objects::kNmtStartup, Access::rw, startup_of(options)));
  out.push_back(std::move(assignments));
  out.push_back(per_node(od::objects::kRequestNmt, kNodesAndAll));
  out.push_back(per_node(od::objects::kRequestGuarding, kNodesAndAll));
  for (auto& [array, member] : expected) {
    out.push_back(std::move(array));
  }
  out.push_back(od::catalogued_variable(od::objects::kBootTime, Access::rw,
                                        static_cast<std::uint64_t>(boot_time.count())));
  out.push_back(std::move(restore));
  return out;
}

}  // namespace linegate::manager
