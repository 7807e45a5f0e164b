// SPDX-License-Identifier: Apache-2.0
// The result of a scan as a table and as JSON.
#include <array>
#include <charconv>

#include <nlohmann/json.hpp>

#include "bridges/console/one_line.h"
#include "bridges/console/scan.h"
#include "bridges/console/tables.h"
#include "stack/base/abort_code.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"
#include "stack/scan/conflicts.h"

namespace linegate::console {
namespace {

using scan::ScannedNode;

constexpr od::Address kDeviceType{od::objects::kDeviceType, 0};
constexpr od::Address kDeviceName{od::objects::kDeviceName, 0};
constexpr od::Address kInterruptEnable{od::objects::cia401::kAnalogueInterrupts, 0};
constexpr std::uint16_t kMappingOffset = 0x200;

struct Kind {
  const char* name;
  std::uint16_t first;
};
constexpr std::array<Kind, 2> kKinds{
    {{"rpdo", od::objects::kRpdoCommunication}, {"tpdo", od::objects::kTpdoCommunication}}};

std::string hex_number(std::uint64_t number, std::size_t digits) {
  std::array<char, 16> text{};
  const auto end = std::to_chars(text.begin(), text.end(), number, 16).ptr;
  std::string out(text.begin(), end);
  for (char& c : out) {
    c = static_cast<char>(c >= 'a' ? c - 'a' + 'A' : c);
  }
  return std::string(digits > out.size() ? digits - out.size() : 0, '0') + out;
}

std::string object_text(od::Address address) {
  return od::to_text(address);
}

std::string hex_cell(const ScannedNode& node, od::Address address) {
  const auto number = node.number(address);
  return number ? hex_number(*number, 8) : "-";
}

std::string name_of(const ScannedNode& node) {
  std::string out;
  if (const auto* data = node.find(kDeviceName)) {
    for (const std::byte character : *data) {
      out += static_cast<char>(character);
    }
  }
  return printable(out);
}

// Counts PDOs that exist: bit 31 of the COB-ID is 0.
std::size_t count_pdos(const ScannedNode& node, std::uint16_t first) {
  std::size_t out = 0;
  for (std::uint16_t i = 0; i < kMappingOffset; ++i) {
    const auto cob = node.number({static_cast<std::uint16_t>(first + i), 1});
    out += cob && can::CobId{static_cast<std::uint32_t>(*cob)}.valid() ? 1U : 0U;
  }
  return out;
}

std::string error_control(const ScannedNode& node) {
  const auto heartbeat = node.number({od::objects::kProducerHeartbeatTime, 0}).value_or(0);
  const auto guard = node.number({od::objects::kGuardTime, 0}).value_or(0);
  const auto factor = node.number({od::objects::kLifeTimeFactor, 0}).value_or(0);
  if (heartbeat != 0) {
    return "heartbeat " + std::to_string(heartbeat) + " ms";
  }
  return guard != 0 && factor != 0
             ? "guarding " + std::to_string(guard) + " ms x " + std::to_string(factor)
             : "none";
}

std::string conflict_text(const scan::Conflict& conflict) {
  return "identifier " + hex_number(conflict.cob_id.id(), 3) + "h is sent by node " +
         std::to_string(conflict.first.node) + " (" + object_text(conflict.first.object) +
         ") and by node " + std::to_string(conflict.second.node) + " (" +
         object_text(conflict.second.object) + ")";
}

// TPDOs are listed as conflicts instead.
std::string rpdo_text(const scan::LeftOut& pdo) {
  return "node " + std::to_string(pdo.node) + ": RPDO " +
         std::to_string(pdo.record - kKinds[0].first + 1) + " is never sent to, its identifier " +
         hex_number(pdo.cob_id.id(), 3) + "h is sent by node " + std::to_string(pdo.other.node) +
         " (" + object_text(pdo.other.object) + ")";
}

void add_notes(const ScannedNode& node, std::vector<Note>& notes) {
  const std::string who = "node " + std::to_string(node.id) + ": ";
  if (node.end != AbortCode::none) {
    notes.push_back({who + "read until it ended with " +
                         hex_number(static_cast<std::uint32_t>(node.end), 8) + "h; scan it again",
                     Style::warning});
  }
  if (node.number(kInterruptEnable) == 0U) {
    notes.push_back(
        {who + "6423h is false: it never sends its analogue inputs by event", Style::warning});
  }
  if (error_control(node) == "none") {
    notes.push_back({who + "no heartbeat and no guarding is set up", Style::warning});
  }
}

nlohmann::ordered_json mapped_json(const ScannedNode& node, std::uint16_t mapping) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  const auto count = node.number({mapping, 0}).value_or(0);
  for (std::uint64_t sub = 1; sub <= count && sub <= 64; ++sub) {
    const auto entry = node.number({mapping, static_cast<std::uint8_t>(sub)});
    if (entry) {
      const od::Address address{static_cast<std::uint16_t>(*entry >> 16U),
                                static_cast<std::uint8_t>(*entry >> 8U)};
      out.push_back({{"object", object_text(address)}, {"bits", *entry & 0xFFU}});
    }
  }
  return out;
}

nlohmann::ordered_json pdos_json(const ScannedNode& node) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const Kind& kind : kKinds) {
    for (std::uint16_t i = 0; i < kMappingOffset; ++i) {
      const auto index = static_cast<std::uint16_t>(kind.first + i);
      const auto cob = node.number({index, 1});
      if (!cob) {
        continue;
      }
      const can::CobId cob_id{static_cast<std::uint32_t>(*cob)};
      nlohmann::ordered_json one{{"direction", kind.name},
                                 {"number", i + 1},
                                 {"cob_id", cob_id.id()},
                                 {"extended", cob_id.extended()},
                                 {"valid", cob_id.valid()}};
      constexpr std::pair<const char*, std::uint8_t> kParameters[] = {
          {"type", 2}, {"inhibit_time", 3}, {"event_timer", 5}, {"sync_start", 6}};
      for (const auto& [name, sub] : kParameters) {
        if (const auto value = node.number({index, sub})) {
          one[name] = *value;
        }
      }
      one["mapping"] = mapped_json(node, static_cast<std::uint16_t>(index + kMappingOffset));
      out.push_back(std::move(one));
    }
  }
  return out;
}

nlohmann::ordered_json node_json(const ScannedNode& node) {
  nlohmann::ordered_json out{
      {"node", node.id}, {"complete", node.end == AbortCode::none}, {"name", name_of(node)}};
  constexpr std::pair<const char*, od::Address> kNumbers[] = {
      {"device_type", kDeviceType},
      {"vendor", od::objects::kVendorId},
      {"product", od::objects::kProductCode},
      {"revision", od::objects::kRevisionNumber},
      {"serial", od::objects::kSerialNumber},
      {"heartbeat_ms", {od::objects::kProducerHeartbeatTime, 0}},
      {"guard_time_ms", {od::objects::kGuardTime, 0}},
      {"life_time_factor", {od::objects::kLifeTimeFactor, 0}},
      {"cob_id_emcy", {od::objects::kEmcyCobId, 0}},
      {"cob_id_sync", {od::objects::kSyncCobId, 0}}};
  for (const auto& [name, address] : kNumbers) {
    if (const auto number = node.number(address)) {
      out[name] = *number;
    }
  }
  out["pdos"] = pdos_json(node);
  return out;
}

}  // namespace

Table scan_table(const ScanResult& result) {
  Table out{{{"NODE", true},
             {"NAME"},
             {"DEVICE TYPE"},
             {"VENDOR"},
             {"PRODUCT"},
             {"REVISION"},
             {"SERIAL"},
             {"TPDOS", true},
             {"RPDOS", true},
             {"ERROR CONTROL"}},
            {},
            {}};
  for (const ScannedNode& node : result.nodes) {
    const std::size_t sent = count_pdos(node, kKinds[1].first);
    const std::size_t received = count_pdos(node, kKinds[0].first);
    out.rows.push_back({{result.id, node.id},
                        {{std::to_string(node.id), node.id},
                         {name_of(node), {}},
                         {hex_cell(node, kDeviceType), {}},
                         {hex_cell(node, od::objects::kVendorId), {}},
                         {hex_cell(node, od::objects::kProductCode), {}},
                         {hex_cell(node, od::objects::kRevisionNumber), {}},
                         {hex_cell(node, od::objects::kSerialNumber), {}},
                         {std::to_string(sent), static_cast<double>(sent)},
                         {std::to_string(received), static_cast<double>(received)},
                         {error_control(node), {}}}});
    add_notes(node, out.notes);
  }
  for (const scan::Conflict& conflict : scan::conflicts(result.nodes)) {
    out.notes.push_back({conflict_text(conflict), Style::error});
  }
  for (const scan::LeftOut& pdo : scan::left_out(result.nodes)) {
    if (pdo.record < kKinds[1].first) {
      out.notes.push_back({rpdo_text(pdo), Style::warning});
    }
  }
  if (result.nodes.empty()) {
    out.notes.push_back({"no device answered", Style::warning});
  }
  return out;
}

std::string scan_json(const ScanResult& result) {
  nlohmann::ordered_json nodes = nlohmann::ordered_json::array();
  for (const ScannedNode& node : result.nodes) {
    nodes.push_back(node_json(node));
  }
  nlohmann::ordered_json found = nlohmann::ordered_json::array();
  for (const scan::Conflict& conflict : scan::conflicts(result.nodes)) {
    found.push_back(
        {{"cob_id", conflict.cob_id.id()},
         {"first", {{"node", conflict.first.node}, {"object", object_text(conflict.first.object)}}},
         {"second",
          {{"node", conflict.second.node}, {"object", object_text(conflict.second.object)}}}});
  }
  return one_line(nlohmann::ordered_json{{"gateway", result.id.gateway},
                                         {"line", result.id.line},
                                         {"nodes", nodes},
                                         {"conflicts", found}});
}

}  // namespace linegate::console
