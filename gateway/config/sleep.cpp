// SPDX-License-Identifier: Apache-2.0
// `sleep:` of a line: the messages and times of nmt/sleep.h.
#include "gateway/config/sections.h"

namespace linegate::config {

void read_sleep(Section& line, line::LineConfig& config) {
  using std::chrono::milliseconds;
  constexpr Duration kLongestPhase = std::chrono::minutes(10);
  const YAML::Node node = line.find("sleep");
  if (!node.IsDefined()) {
    return;
  }
  nmt::SleepProtocol& sleep = config.sleep;
  Section section(line.findings(), node, "sleep");
  (void)section.require("request");
  (void)section.require("objection");
  section.read_number("request", sleep.request, 1, 0x7FF);
  section.read_number("objection", sleep.objection, 1, 0x7FF);
  section.read_number("check_byte", sleep.check_byte, 0, 0xFF);
  section.read_number("prepare_byte", sleep.prepare_byte, 0, 0xFF);
  section.read_number("wake_byte", sleep.wake_byte, 0, 0xFF);
  section.read_number("objection_byte", sleep.objection_byte, 0, 0xFF);
  section.read("check_time", sleep.check_time, milliseconds(1), kLongestPhase);
  section.read("prepare_time", sleep.prepare_time, milliseconds(1), kLongestPhase);
  section.read("silent_time", sleep.silent_time, milliseconds(1), kLongestPhase);
  section.done();
}

}  // namespace linegate::config
