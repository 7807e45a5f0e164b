// SPDX-License-Identifier: Apache-2.0
// The configuration of a node beyond its device file: `restore:`, `store:`, `concise_dcf:`,
// `program:`.
#include <filesystem>
#include <span>

#include "gateway/config/concise_file.h"
#include "gateway/config/patch.h"
#include "gateway/config/sections.h"
#include "stack/manager/program_objects.h"
#include "stack/srdo/parameters.h"

namespace linegate::config {
namespace {

constexpr std::uint64_t kHighestGroup = 127;  // sub-indices of 1010h and 1011h

// `all`, or a sub-index of 1010h and 1011h.
void read_group(Section& section, const char* key, std::uint8_t& target) {
  constexpr std::pair<const char*, std::uint8_t> kGroups[] = {
      {"all", 1}, {"communication", 2}, {"application", 3}, {"manufacturer", 4}};
  const YAML::Node node = section.find(key);
  if (!node.IsDefined()) {
    return;
  }
  for (const auto& [name, group] : kGroups) {
    if (node.IsScalar() && node.Scalar() == name) {
      target = group;
      return;
    }
  }
  const auto number = node.IsScalar() ? parse_unsigned(node.Scalar()) : std::nullopt;
  if (!number || *number < 1 || *number > kHighestGroup) {
    section.findings().error(place_of(node),
                             "expected all, communication, application, manufacturer or a "
                             "sub-index 1..127");
    return;
  }
  target = static_cast<std::uint8_t>(*number);
}

// A concise DCF replaces all configured values of the device file; PDOs are linked as it leaves
// them.
void add_writes(Findings& findings, Place place, std::vector<manager::ObjectWrite> writes,
                line::NodeConfig& config) {
  for (od::ObjectDescription& object : config.device.objects) {
    for (od::VariableDescription& variable : object.variables) {
      variable.configured = false;
    }
  }
  for (manager::ObjectWrite& write : writes) {
    const auto* variable = config.device.find(write.address);
    if (variable == nullptr) {
      findings.warning(place, "the concise DCF writes to " + format_address(write.address) +
                                  ", which " + config.device.file + " does not have");
    } else if (is_pdo_record(write.address.index) || srdo::is_srdo_object(write.address.index)) {
      check_pdo_cob_id(findings, place, write.address, write.data);
      set_value(config.device, write.address, write.data);
    }
    config.objects.push_back({write.address, std::move(write.data)});
  }
}

void read_concise(Section& section, const YAML::Node& node, line::NodeConfig& config) {
  Findings& findings = section.findings();
  const auto text = section.text(node);
  if (!text) {
    return;
  }
  for (const char* other : {"objects", "pdos", "srdo"}) {
    if (const YAML::Node unused = section.find(other); unused.IsDefined()) {
      findings.warning(place_of(unused), std::string(other) +
                                             " has no effect beside concise_dcf, which takes the "
                                             "place of all other values of the node");
    }
  }
  add_writes(findings, place_of(node), read_concise_file(findings, place_of(node), *text), config);
}

void read_program(Section& section, line::NodeConfig& config) {
  Findings& findings = section.findings();
  const YAML::Node node = section.find("program");
  if (!node.IsDefined()) {
    return;
  }
  Section from(findings, node, "a program");
  if (const auto number = from.number(from.require("identification"), 1, 0xFFFF'FFFF)) {
    config.software = static_cast<std::uint32_t>(*number);
  }
  from.read("update", config.update_software);
  const YAML::Node file = from.find("file");
  if (const auto text = from.text(file)) {
    const auto path =
        (std::filesystem::path(findings.file()).parent_path() / *text).lexically_normal().string();
    const auto content = read_file(findings, path, place_of(file));
    if (content && (content->empty() || content->size() > manager::kLongestProgram)) {
      findings.error(place_of(file), path + " has " + std::to_string(content->size()) +
                                         " bytes; a program has 1 to 16777216");
    } else if (content) {
      const auto bytes = std::as_bytes(std::span(*content));
      config.program = std::make_shared<const std::vector<std::byte>>(bytes.begin(), bytes.end());
    }
  } else if (config.update_software && !file.IsDefined()) {
    findings.error(place_of(node), "a program that may be updated needs the key \"file\"");
  }
  from.done();
}

}  // namespace

void read_configuration(Section& section, bool has_device, line::NodeConfig& config) {
  read_group(section, "restore", config.restore);
  read_group(section, "store", config.store);
  read_program(section, config);
  const YAML::Node concise = section.find("concise_dcf");
  if (concise.IsDefined() && has_device) {
    read_concise(section, concise, config);
  }
}

}  // namespace linegate::config
