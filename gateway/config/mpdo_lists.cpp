// SPDX-License-Identifier: Apache-2.0
// `mpdo_scanner:` and `mpdo_dispatcher:` of a line: objects that its own node sends and receives by
// MPDO in source address mode (CiA 301 7.5.2.39 and 7.5.2.40).
#include <algorithm>
#include <optional>
#include <string>

#include "gateway/config/sections.h"
#include "gateway/config/value.h"
#include "stack/pdo/mpdo.h"

namespace linegate::config {
namespace {

// Number of entries in all objects of a list.
constexpr std::size_t kMostListed = std::size_t{254} * pdo::kMpdoLists;
constexpr std::uint64_t kMostSubs = 254;

// Reads the address of `key`; reports an invalid one.
std::optional<od::Address> read_listed(Section& section, const char* key) {
  const YAML::Node node = section.require(key);
  const auto text = section.text(node);
  const auto address = text ? parse_address(*text) : std::nullopt;
  if (text && !address) {
    section.findings().error(place_of(node),
                             "expected an object such as 2100:1, got \"" + *text + "\"");
  }
  return address;
}

// Checks that each of `count` variables from that address on is an own object that an MPDO may send
// or write.
void check_own(Findings& findings, const line::LineConfig& config, Place place, od::Address first,
               std::uint64_t count, bool received) {
  for (std::uint64_t i = 0; i < count; ++i) {
    const od::Address address{first.index, static_cast<std::uint8_t>(first.sub + i)};
    const auto found = std::ranges::find_if(config.own_objects, [&](const line::OwnObject& own) {
      return od::Address{own.index, own.variable.sub} == address;
    });
    const bool there = found != config.own_objects.end() && found->variable.mappable &&
                       od::byte_size(found->variable.type) <= pdo::Mpdo::kMaxValue;
    if (!there || !(received ? od::rpdo_mappable(found->variable.access)
                             : od::tpdo_mappable(found->variable.access))) {
      findings.error(place, format_address(address) +
                                " is no object of own_objects with map: true, at most 4 bytes and "
                                "an access by which an MPDO may " +
                                (received ? "write it" : "send it"));
      return;
    }
  }
}

std::uint64_t read_count(Section& section) {
  std::uint64_t count = 1;
  section.read_number("count", count, 1, kMostSubs);
  return count;
}

bool has_scope(Section& section, const YAML::Node& node, const line::LineConfig& config) {
  if (!node.IsDefined() || config.role == line::Role::observer) {
    return false;  // already reported
  }
  if (!config.devices.empty()) {
    section.findings().error(place_of(node),
                             "MPDO lists of a line are of its one own node, and not of devices");
    return false;
  }
  return true;
}

void read_scanner(Section& section, line::LineConfig& config) {
  const YAML::Node node = section.find("mpdo_scanner");
  if (!has_scope(section, node, config)) {
    return;
  }
  for (const YAML::Node& element :
       elements(section.findings(), node, "mpdo_scanner", kMostListed)) {
    Section entry(section.findings(), element, "an entry of mpdo_scanner");
    const auto object = read_listed(entry, "object");
    const std::uint64_t count = read_count(entry);
    entry.done();
    if (object) {
      check_own(section.findings(), config, place_of(element), *object, count, false);
      config.mpdo_scanner.push_back(static_cast<std::uint32_t>(count << 24U) |
                                    std::uint32_t{object->index} << 8U | object->sub);
    }
  }
}

void read_dispatcher(Section& section, line::LineConfig& config) {
  const YAML::Node node = section.find("mpdo_dispatcher");
  if (!has_scope(section, node, config)) {
    return;
  }
  for (const YAML::Node& element :
       elements(section.findings(), node, "mpdo_dispatcher", kMostListed)) {
    Section entry(section.findings(), element, "an entry of mpdo_dispatcher");
    const auto producer = entry.number(entry.require("node"), 1, 127);
    const auto object = read_listed(entry, "object");
    const auto own = read_listed(entry, "own");
    const std::uint64_t count = read_count(entry);
    entry.done();
    if (producer && object && own) {
      check_own(section.findings(), config, place_of(element), *own, count, true);
      config.mpdo_dispatcher.push_back(
          count << 56U | std::uint64_t{own->index} << 40U | std::uint64_t{own->sub} << 32U |
          std::uint64_t{object->index} << 16U | std::uint64_t{object->sub} << 8U | *producer);
    }
  }
}

}  // namespace

void read_mpdo_lists(Section& section, line::LineConfig& config) {
  read_scanner(section, config);
  read_dispatcher(section, config);
}

}  // namespace linegate::config
