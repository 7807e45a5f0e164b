// SPDX-License-Identifier: Apache-2.0
// `flying_master:` of a line.
#include "stack/nmt/flying_master.h"

#include "gateway/config/sections.h"

namespace linegate::config {
namespace {

using std::chrono::milliseconds;

void read_flying_master_time(Section& section, std::string_view key, Duration& target) {
  const YAML::Node node = section.find(key);
  section.read_multiple(key, target, milliseconds(1), milliseconds(0xFFFF));
  if (node.IsDefined() && target == Duration::zero()) {
    section.findings().error(place_of(node), std::string(key) + " is not from 1ms to 65535ms");
  }
}

}  // namespace

void read_flying_master(Section& line, line::LineConfig& config) {
  const YAML::Node node = line.find("flying_master");
  if (!node.IsDefined()) {
    return;
  }
  Section section(line.findings(), node, "flying_master");
  line::FlyingMasterConfig flying;
  section.read_number("priority", flying.priority, 0, nmt::kLowestMasterPriority);
  read_flying_master_time(section, "master_timeout", flying.master_timeout);
  read_flying_master_time(section, "negotiation_delay", flying.negotiation_delay);
  read_flying_master_time(section, "priority_slot", flying.priority_slot);
  read_flying_master_time(section, "device_slot", flying.device_slot);
  read_flying_master_time(section, "detect_cycle", flying.detect_cycle);
  read_flying_master_time(section, "master_heartbeat", flying.master_heartbeat);
  section.read_choice<bool>("detection", flying.forces_each_cycle,
                            {{"ask", false}, {"force", true}});
  section.done();
  if (config.role != line::Role::manager) {
    if (config.role == line::Role::device) {
      line.findings().error(place_of(node), "flying_master is for a line with the role manager");
    }
    return;
  }
  if (flying.priority_slot <= can::kMaxNodeId * flying.device_slot) {
    line.findings().error(place_of(node),
                          "priority_slot of flying_master must be more than 127 x device_slot");
  }
  config.flying_master = flying;
}

}  // namespace linegate::config
