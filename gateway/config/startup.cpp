// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/sections.h"

namespace linegate::config {
namespace {

using std::chrono::milliseconds;

constexpr Duration kLongestOfStart = std::chrono::hours(1);

// `sdo: {block: never}`, or the size in bytes from which block transfer is used.
void read_sdo(Section& section, line::NodeConfig& config) {
  const YAML::Node node = section.find("sdo");
  if (!node.IsDefined()) {
    return;
  }
  constexpr std::uint64_t kMost = 1'000'000'000;
  Section from(section.findings(), node, "sdo");
  const YAML::Node block = from.find("block");
  if (const auto text = from.text(block); text == "never") {
    config.block_from = sdo::kNoBlocks;
  } else if (text && text->find_first_not_of("0123456789") != std::string::npos) {
    from.findings().error(place_of(block),
                          "block is never, or the number of bytes from which on "
                          "transfers go in blocks, got \"" +
                              *text + "\"");
  } else if (const auto bytes = from.number(block, 5, kMost)) {
    config.block_from = static_cast<std::uint32_t>(*bytes);
  }
  from.done();
}

}  // namespace

void read_startup(Section& section, line::LineConfig& config) {
  config.own_start = config.role != line::Role::device;  // a device is started by its master
  const YAML::Node node = section.find("startup");
  if (!node.IsDefined()) {
    return;
  }
  Section from(section.findings(), node, "startup");
  from.read("start_all", config.start_all);
  from.read("own_start", config.own_start);
  from.read_choice<manager::ErrorReaction>("on_error", config.on_error,
                                           {{"node", manager::ErrorReaction::node},
                                            {"reset_all", manager::ErrorReaction::reset_all},
                                            {"stop_all", manager::ErrorReaction::stop_all}});
  const YAML::Node time = from.find("boot_time");
  from.read_multiple("boot_time", config.boot_time, milliseconds(1), kLongestOfStart);
  from.read_multiple("nmt_inhibit", config.nmt_inhibit, std::chrono::microseconds(100),
                     milliseconds(6'553));
  from.done();
  for (const line::NodeConfig& each : config.nodes) {
    if (each.mandatory && config.boot_time > Duration::zero() &&
        each.boot_timeout > config.boot_time) {
      section.findings().warning(place_of(time),
                                 "boot_time is shorter than the boot_timeout of \"" + each.name +
                                     "\", which is mandatory");
    }
  }
}

void read_boot(Section& section, line::NodeConfig& config) {
  section.read("boot", config.boot);
  section.read("mandatory", config.mandatory);
  const YAML::Node keep = section.find("keep_alive");
  section.read("keep_alive", config.keep_alive);
  section.read("boot_timeout", config.boot_timeout, milliseconds(1), kLongestOfStart);
  section.read("reset_time", config.reset_time, milliseconds(1), kLongestOfStart);
  section.read("sdo_timeout", config.sdo_timeout, milliseconds(1), std::chrono::minutes(10));
  read_sdo(section, config);
  if (config.keep_alive && !config.boot) {
    section.findings().error(place_of(keep), "keep_alive has no effect, because boot is false");
  }
}

}  // namespace linegate::config
