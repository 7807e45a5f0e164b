// SPDX-License-Identifier: Apache-2.0
#include "stack/line/srdo_plan.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/srdo/parameters.h"

namespace linegate::line {
namespace {

std::vector<srdo::Parameters> described_srdos(const NodeConfig& node) {
  return srdo::describe_srdos(node.device).value.value_or(std::vector<srdo::Parameters>());
}

std::uint8_t frame_bytes(const srdo::Parameters& srdo) {
  unsigned bits = 0;
  for (const pdo::Mapping& mapping : srdo.normal()) {
    bits += mapping.bits;
  }
  return static_cast<std::uint8_t>((bits + 7) / 8);
}

Duration cycle_of(const NodeConfig& node, const srdo::Parameters& srdo) {
  const auto configured = node.srdo_cycle.find(srdo.number);
  return configured != node.srdo_cycle.end() ? configured->second
                                             : 2 * std::chrono::milliseconds(srdo.cycle_ms);
}

Duration validation_of(const NodeConfig& node, const srdo::Parameters& srdo) {
  const auto configured = node.srdo_validation.find(srdo.number);
  return configured != node.srdo_validation.end() ? configured->second
                                                  : std::chrono::milliseconds(srdo.validation_ms);
}

manager::ObjectWrite srdo_parameter(od::Address address, std::uint64_t value, std::size_t bytes) {
  manager::ObjectWrite out{address, std::vector<std::byte>(bytes)};
  store_le(std::span(out.data), value);
  return out;
}

std::vector<manager::ObjectWrite> parameters_of_srdo(const srdo::Parameters& srdo) {
  const std::uint16_t record = srdo::communication_record(srdo.number);
  const std::uint16_t mapping = srdo::mapping_record(srdo.number);
  std::vector<manager::ObjectWrite> out{
      srdo_parameter({record, srdo::kDirection}, static_cast<std::uint64_t>(srdo.direction), 1),
      srdo_parameter({record, srdo::kCobId}, srdo.cob_id, 4),
      srdo_parameter({record, srdo::kInvertedCobId}, srdo.inverted_cob_id, 4),
      srdo_parameter({mapping, 0}, srdo.mapping.size(), 1)};
  for (std::size_t i = 0; i < srdo.mapping.size(); ++i) {
    const auto sub = static_cast<std::uint8_t>(i + 1);
    out.push_back(srdo_parameter({mapping, sub}, srdo.mapping[i].raw(), 4));
  }
  return out;
}

std::optional<std::uint16_t> signature_of(const NodeConfig& node, const srdo::Parameters& srdo) {
  const bool exists =
      node.device.find(od::Address{od::objects::kSrdoSignature, srdo.number}) != nullptr;
  return exists ? std::optional(srdo::signature(srdo)) : std::nullopt;
}

}  // namespace

std::vector<pdo::Parameters> transmitted_srdos(const NodeConfig& node) {
  std::vector<pdo::Parameters> out;
  for (const srdo::Parameters& each : described_srdos(node)) {
    if (each.direction == srdo::Direction::transmit) {
      out.push_back(srdo::as_pdo(each));
    }
  }
  return out;
}

std::vector<srdo::Source> srdo_sources(const LineConfig& config) {
  std::vector<srdo::Source> out;
  for (const NodeConfig& node : config.nodes) {
    for (const srdo::Parameters& each : described_srdos(node)) {
      if (each.direction == srdo::Direction::transmit) {
        out.push_back({.node = node.id,
                       .number = each.number,
                       .length = frame_bytes(each),
                       .cob_id = static_cast<std::uint16_t>(each.cob_id),
                       .inverted_cob_id = static_cast<std::uint16_t>(each.inverted_cob_id),
                       .validation = validation_of(node, each),
                       .cycle = cycle_of(node, each),
                       .signature = signature_of(node, each)});
      }
    }
  }
  return out;
}

std::vector<std::vector<manager::ObjectWrite>> srdo_parameters(const LineConfig& config) {
  std::vector<std::vector<manager::ObjectWrite>> out;
  for (const NodeConfig& node : config.nodes) {
    for (const srdo::Parameters& each : described_srdos(node)) {
      if (each.direction == srdo::Direction::transmit) {
        out.push_back(parameters_of_srdo(each));
      }
    }
  }
  return out;
}

std::vector<manager::AssumedPdo> assumed_srdos(const NodeConfig& node) {
  std::vector<manager::AssumedPdo> out;
  for (const srdo::Parameters& each : described_srdos(node)) {
    const bool is_compared =
        srdo::is_configured(node.device, each.number) || !signature_of(node, each);
    if (each.direction == srdo::Direction::transmit && is_compared) {
      out.push_back({.parameters = parameters_of_srdo(each), .remedy = {}});
    }
  }
  return out;
}

std::vector<Diagnostic> leave_out_srdos(LineConfig& config) {
  std::vector<Diagnostic> out;
  std::map<std::uint16_t, unsigned> transmitters;  // by COB-ID 1
  const std::vector<srdo::Source> sources = srdo_sources(config);
  for (const srdo::Source& source : sources) {
    ++transmitters[source.cob_id];
  }
  for (const srdo::Source& source : sources) {
    NodeConfig& node = *std::ranges::find(config.nodes, source.node, &NodeConfig::id);
    if (transmitters[source.cob_id] == 1 || srdo::is_configured(node.device, source.number)) {
      continue;
    }
    for (od::ObjectDescription& object : node.device.objects) {
      if (object.index == srdo::communication_record(source.number)) {
        for (od::VariableDescription& variable : object.variables) {
          if (variable.sub == srdo::kDirection) {
            std::ranges::fill(variable.value, std::byte{0});
          }
        }
      }
    }
    out.push_back({Severity::warning, node.device.file, 0, 0,
                   "SRDO " + std::to_string(source.number) + " of " + node.name +
                       " has the COB-IDs of an SRDO of another node, and is left out: give it "
                       "others (srdo, cob_id)"});
  }
  return out;
}

std::vector<Diagnostic> check_srdos(const LineConfig& config) {
  std::vector<Diagnostic> out;
  std::set<std::uint32_t> transmitted;
  for (const NodeConfig& node : config.nodes) {
    Loaded<std::vector<srdo::Parameters>> described = srdo::describe_srdos(node.device);
    out.insert(out.end(), described.diagnostics.begin(), described.diagnostics.end());
    for (const srdo::Parameters& each : described_srdos(node)) {
      if (each.direction == srdo::Direction::transmit) {
        transmitted.insert(each.cob_id);
      }
    }
  }
  for (const NodeConfig& node : config.nodes) {
    for (const srdo::Parameters& each : described_srdos(node)) {
      if (each.direction == srdo::Direction::receive && !transmitted.contains(each.cob_id)) {
        out.push_back({Severity::warning, node.device.file, 0, 0,
                       "SRDO " + std::to_string(each.number) + " of " + node.name +
                           " is received from no node of this line, and Linegate produces no "
                           "SRDOs: its values are no outputs"});
      }
    }
  }
  return out;
}

std::uint8_t received_srdo(const NodeConfig& node, od::Address address) {
  for (const srdo::Parameters& each : described_srdos(node)) {
    const bool maps = std::ranges::any_of(
        each.mapping, [address](const pdo::Mapping& entry) { return entry.address == address; });
    if (each.direction == srdo::Direction::receive && maps) {
      return each.number;
    }
  }
  return 0;
}

}  // namespace linegate::line
