// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/sections.h"

namespace linegate::config {
namespace {

// Below are the identifiers of SYNC, EMCY, TIME and those that are restricted, above only
// restricted ones (CiA 301 7.3.5).
constexpr std::uint16_t kLowest = 0x181;
constexpr std::uint16_t kHighest = 0x6DF;

}  // namespace

void read_connections(Section& line, line::LineConfig& config) {
  const YAML::Node node = line.find("sdo_connections");
  if (!node.IsDefined()) {
    return;
  }
  Section section(line.findings(), node, "sdo_connections");
  if (section.valid()) {
    (void)section.require("first");
    (void)section.require("last");
    section.read_number("first", config.connection_pool.first, kLowest, kHighest);
    section.read_number("last", config.connection_pool.last, kLowest, kHighest);
    section.done();
  }
  if (config.role != line::Role::manager) {
    config.connection_pool = {};
  }
}

}  // namespace linegate::config
