// SPDX-License-Identifier: Apache-2.0
// `lss:` of a line, and its requirements on the nodes.
#include "gateway/config/sections.h"
#include "stack/lss/message.h"

namespace linegate::config {
namespace {

using std::chrono::milliseconds;

void read_lss_bit_rate(Section& section, line::LssConfig& config) {
  const YAML::Node node = section.find("bit_rate");
  const auto text = section.text(node);
  if (!text) {
    return;
  }
  const auto value = parse_bit_rate(*text);
  if (!value || !lss::bit_timing_index(*value)) {
    section.findings().error(
        place_of(node),
        "expected one of the bit rates of CiA 305: 10kbit, 20kbit, 50kbit, 125kbit, 250kbit, "
        "500kbit, 800kbit, 1Mbit, got \"" +
            *text + "\"");
    return;
  }
  config.bit_rate = *value;
  if (!config.store) {
    section.findings().error(place_of(node),
                             "bit_rate needs store: true: devices have it when they are switched "
                             "on the next time");
  }
}

}  // namespace

void read_lss(Section& line, line::LineConfig& config) {
  const YAML::Node node = line.find("lss");
  if (!node.IsDefined()) {
    return;
  }
  Section section(line.findings(), node, "lss");
  section.read("assign", config.lss.assign);
  section.read("timeout", config.lss.timeout, milliseconds(1), std::chrono::seconds(10));
  section.read("period", config.lss.period, Duration::zero(), std::chrono::hours(1));
  section.read("store", config.lss.store);
  read_lss_bit_rate(section, config.lss);
  section.done();
  if (config.role == line::Role::device) {
    line.findings().error(place_of(node),
                          "lss is for a line with the role manager; a device has a key lss of "
                          "its own");
  }
}

}  // namespace linegate::config
