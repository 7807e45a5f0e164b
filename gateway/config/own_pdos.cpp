// SPDX-License-Identifier: Apache-2.0
// `shared_objects:`: objects from B000h on of all lines; `own_pdos:` of a line, which map them and
// the line's `own_objects:`.
#include <algorithm>
#include <chrono>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gateway/config/joined_lines.h"
#include "gateway/config/sections.h"
#include "gateway/config/value.h"
#include "stack/can/cob_id.h"
#include "stack/od/objects.h"
#include "stack/routing/forward.h"

namespace linegate::config {
namespace {

void read_own_map(Findings& findings, Section& section, OwnPdoSection& out) {
  for (const YAML::Node& element : elements(findings, section.find("map"), "map")) {
    const auto text = section.text(element);
    const auto address = text ? parse_address(*text) : std::nullopt;
    if (address) {
      out.parameters.mapping.push_back({*address, 0});
      out.mapped.push_back(place_of(element));
    } else if (text) {
      findings.error(place_of(element), "expected an object such as B100:1, got \"" + *text + "\"");
    }
  }
}

void check_mpdo(Findings& findings, const OwnPdoSection& pdo) {
  using pdo::MpdoMode;
  const MpdoMode mode = pdo.parameters.mpdo;
  const bool maps_one = pdo.transmit && mode == MpdoMode::destination;
  if (mode != MpdoMode::none && pdo.parameters.mapping.size() != (maps_one ? 1U : 0U)) {
    findings.error(pdo.place, maps_one ? "a TPDO in destination address mode maps the one object "
                                         "whose value it sends: map: [2100:1]"
                                       : "this MPDO maps nothing: leave out map");
  }
  if (mode != MpdoMode::none && pdo::is_synchronous(pdo.parameters.type)) {
    findings.error(pdo.place, "an MPDO is event-driven: leave out type");
  }
}

OwnPdoSection read_own_pdo(Findings& findings, const YAML::Node& key, const YAML::Node& value,
                           PdoName name) {
  OwnPdoSection out;
  out.transmit = name.transmit;
  out.parameters.number = name.number;
  out.place = place_of(key);
  Section section(findings, value, key.Scalar());
  const YAML::Node id = section.require("cob_id");
  if (const auto number = section.number(id, 1, 0x7FF)) {
    if (can::is_restricted(static_cast<std::uint32_t>(*number))) {
      findings.error(place_of(id), "the identifier " + id.Scalar() +
                                       " is reserved for another service (CiA 301, 7.3.5)");
    }
    out.parameters.cob_id = {static_cast<std::uint32_t>(*number) | can::CobId::kNoRtrBit};
  }
  bool rtr = false;
  section.read("rtr", rtr);
  if (rtr) {
    out.parameters.cob_id.raw &= ~can::CobId::kNoRtrBit;
  }
  bool enabled = true;
  section.read("enabled", enabled);
  if (!enabled) {
    out.parameters.cob_id.raw |= can::CobId::kInvalidBit;
  }
  const YAML::Node type = section.find("type");
  if (type.IsDefined()) {
    out.parameters.type = read_transmission_type(section, type).value_or(out.parameters.type);
  }
  section.read_multiple("inhibit", out.parameters.inhibit, std::chrono::microseconds(100),
                        65'535 * std::chrono::microseconds(100));
  section.read_multiple("event_timer", out.parameters.event_timer, std::chrono::milliseconds(1),
                        std::chrono::milliseconds(65'535));
  section.read_choice<pdo::MpdoMode>(
      "mpdo", out.parameters.mpdo,
      {{"source", pdo::MpdoMode::source}, {"destination", pdo::MpdoMode::destination}});
  read_own_map(findings, section, out);
  check_mpdo(findings, out);
  section.done();
  return out;
}

class SharedObjects {
 public:
  SharedObjects(Findings& findings, const std::vector<SharedObjectSection>& objects,
                JoinedLines& lines)
      : findings_(findings), objects_(objects), lines_(lines) {}

  void run() {
    for (std::size_t line = 0; line < lines_.size(); ++line) {
      apply_own_pdos(line);
    }
    for (std::size_t from = 0; from < lines_.size(); ++from) {
      for (std::size_t to = 0; to < lines_.size(); ++to) {
        if (from != to) {
          forward(from, to);
        }
      }
    }
  }

 private:
  routing::Forwarding& forwarding(std::size_t line) {
    return lines_.line(line).plan.config.forwarding;
  }

  void apply_own_pdos(std::size_t line) {
    LineSection& section = lines_.line(line);
    if (section.own_pdos.empty()) {
      return;
    }
    if (!has_own_node(section.plan.config)) {
      findings_.error(section.own_pdos.front().place,
                      "own_pdos are for a line with a node of its own: the role manager, or device "
                      "without devices");
      return;
    }
    for (const SharedObjectSection& object : objects_) {
      forwarding(line).objects.push_back({object.object, object.name, {}});
      section.plan.source += format_address(object.object) + object.name + ';';
    }
    for (OwnPdoSection& pdo : section.own_pdos) {
      check_number(line, pdo);
      measure(line, pdo);
      check_for_fd(line, pdo);
      auto& list = pdo.transmit ? forwarding(line).tpdos : forwarding(line).rpdos;
      list.push_back(pdo.parameters);
    }
  }

  // The first numbers belong to the PDOs of the line's nodes.
  void check_number(std::size_t line, const OwnPdoSection& pdo) {
    const auto direction = pdo.transmit ? image::Direction::outputs : image::Direction::inputs;
    std::uint16_t linked = 0;
    for (const image::Entry& entry : lines_.entries(line, direction)) {
      linked = std::max(linked, entry.local_pdo);
    }
    if (pdo.parameters.number <= linked) {
      findings_.error(pdo.place, "1 to " + std::to_string(linked) +
                                     " are linked to devices of the line: take a higher number");
    }
  }

  // The type of an own object that the PDO may map.
  std::optional<od::DataType> own_type(std::size_t line, bool transmit, od::Address address) {
    for (const line::OwnObject& object : lines_.line(line).plan.config.own_objects) {
      const od::VariableDescription& variable = object.variable;
      const bool allowed = variable.mappable && (transmit ? od::tpdo_mappable(variable.access)
                                                          : od::rpdo_mappable(variable.access));
      if (allowed && od::Address{object.index, variable.sub} == address) {
        return variable.type;
      }
    }
    return std::nullopt;
  }

  void measure(std::size_t line, OwnPdoSection& pdo) {
    unsigned bits = 0;
    for (std::size_t i = 0; i < pdo.parameters.mapping.size(); ++i) {
      pdo::Mapping& mapping = pdo.parameters.mapping[i];
      if (const auto own = own_type(line, pdo.transmit, mapping.address)) {
        mapping.bits = static_cast<std::uint8_t>(od::bit_size(*own));
        bits += mapping.bits;
        continue;
      }
      const auto found =
          std::find_if(objects_.begin(), objects_.end(), [&](const SharedObjectSection& object) {
            return object.object == mapping.address ||
                   (pdo.transmit && routing::shown_address(object.object) == mapping.address);
          });
      if (found == objects_.end()) {
        const bool shared = mapping.address.index >= od::objects::kSharedVariables;
        findings_.error(pdo.mapped[i], "there is no " + format_address(mapping.address) + " in " +
                                           (shared ? "shared_objects" : "own_objects") +
                                           (pdo.transmit ? "" : " that an RPDO may write"));
        continue;
      }
      const auto type = *routing::forward_type(found->object);
      mapping.bits = static_cast<std::uint8_t>(od::bit_size(type));
      bits += mapping.bits;
    }
    if (const std::size_t room = line::longest_pdo(lines_.line(line).plan.config); bits > room) {
      findings_.error(pdo.place, "the objects have " + std::to_string(bits) +
                                     " bits; a PDO has room for " + std::to_string(room));
    }
  }

  // As line::check_pdos() of the PDOs of nodes.
  void check_for_fd(std::size_t line, const OwnPdoSection& pdo) {
    if (!lines_.line(line).plan.config.canopen_fd) {
      return;
    }
    const pdo::Parameters& each = pdo.parameters;
    if ((each.cob_id.raw & can::CobId::kNoRtrBit) == 0) {
      findings_.error(pdo.place, "rtr: CANopen FD has no remote frames");
    }
    if (each.type == pdo::kRtrOnSync || each.type == pdo::kRtrEvent) {
      findings_.error(pdo.place,
                      "CANopen FD lacks the transmission type " + std::to_string(each.type));
    }
    if (each.mpdo != pdo::MpdoMode::none) {
      findings_.error(pdo.place, "MPDO is not defined for CANopen FD: leave out mpdo");
    }
    for (std::size_t i = 0; i < each.mapping.size(); ++i) {
      if (each.mapping[i].bits % 8 != 0) {
        findings_.error(pdo.mapped[i],
                        "CANopen FD maps whole bytes: " + format_address(each.mapping[i].address) +
                            " has " + std::to_string(each.mapping[i].bits) + " bits");
      }
    }
  }

  // Independent of the present mapping, which may change later.
  void forward(std::size_t from, std::size_t to) {
    if (forwarding(from).rpdos.empty() || forwarding(to).tpdos.empty()) {
      return;
    }
    if (!may_enter(from, to)) {
      findings_.warning(first_tpdo(to), "PDOs of line \"" + lines_.name(from) +
                                            "\" may not enter line \"" + lines_.name(to) +
                                            "\": nothing is forwarded to its own PDOs");
      return;
    }
    for (std::uint32_t i = 0; i < objects_.size(); ++i) {
      Binding binding;
      binding.input = {0, objects_[i].object};
      binding.output_entry = line::Line::kForwarded | i;
      binding.forwarded = true;
      binding.from = lines_.name(from);
      binding.to = lines_.name(to);
      binding.input_name = binding.output_name = objects_[i].name;
      binding.object = objects_[i].object;
      lines_.add(std::move(binding));
    }
  }

  Place first_tpdo(std::size_t line) {
    const auto& pdos = lines_.line(line).own_pdos;
    return std::find_if(pdos.begin(), pdos.end(), [](const auto& pdo) { return pdo.transmit; })
        ->place;
  }

  bool may_enter(std::size_t from, std::size_t to) {
    const std::uint16_t network = lines_.line(from).plan.config.network_id;
    const auto& rules = lines_.line(to).plan.config.routing.access;
    return std::any_of(rules.begin(), rules.end(), [&](const routing::AccessRule& rule) {
      return rule.pdo && rule.first <= network && network <= rule.last;
    });
  }

  Findings& findings_;
  const std::vector<SharedObjectSection>& objects_;
  JoinedLines& lines_;
};

}  // namespace

void read_feeds_every_tpdo(Section& section, LineSection& line) {
  const YAML::Node node = section.find("feeds_every_tpdo");
  section.read("feeds_every_tpdo", line.plan.config.forwarding.feeds_every_tpdo);
  if (node.IsDefined() && line.own_pdos.empty()) {
    section.findings().error(place_of(node),
                             "feeds_every_tpdo is about own_pdos, of which there are none");
  }
}

std::vector<OwnPdoSection> read_own_pdos(Findings& findings, const YAML::Node& node) {
  std::vector<OwnPdoSection> out;
  if (!node.IsDefined()) {
    return out;
  }
  Section section(findings, node, "own_pdos");
  if (!section.valid()) {
    return out;
  }
  for (const auto& pair : node) {
    if (!pair.first.IsScalar()) {
      continue;  // already reported by the section
    }
    section.find(pair.first.Scalar());
    if (const auto name = parse_pdo_name(pair.first.Scalar())) {
      out.push_back(read_own_pdo(findings, pair.first, pair.second, *name));
    } else {
      findings.error(place_of(pair.first), "expected tpdo1 to tpdo512 or rpdo1 to rpdo512, got \"" +
                                               pair.first.Scalar() + "\"");
    }
  }
  section.done();
  return out;
}

std::vector<SharedObjectSection> read_shared_objects(Findings& findings, const YAML::Node& node) {
  std::vector<SharedObjectSection> out;
  if (!node.IsDefined()) {
    return out;
  }
  Section section(findings, node, "shared_objects");
  if (!section.valid()) {
    return out;
  }
  std::set<od::Address> seen;
  for (const auto& pair : node) {
    if (!pair.first.IsScalar()) {
      continue;
    }
    section.find(pair.first.Scalar());
    const auto address = parse_address(pair.first.Scalar());
    const auto name = section.text(pair.second);
    if (!address || !routing::forward_type(*address)) {
      findings.error(
          place_of(pair.first),
          "expected an object B000h..B47Fh such as B100:1, got \"" + pair.first.Scalar() + "\"");
    } else if (!seen.insert(*address).second) {
      findings.error(place_of(pair.first), format_address(*address) + " is there twice");
    } else if (name) {
      out.push_back({*address, *name, place_of(pair.first)});
    }
  }
  section.done();
  return out;
}

void resolve_shared_objects(Findings& findings, const std::vector<SharedObjectSection>& objects,
                            JoinedLines& lines) {
  SharedObjects(findings, objects, lines).run();
}

}  // namespace linegate::config
