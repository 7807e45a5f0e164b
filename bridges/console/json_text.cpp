#include "bridges/console/json_text.h"

#include <nlohmann/json.hpp>

#include "bridges/console/tables.h"
#include "bridges/console/value_text.h"

namespace linegate::console {
namespace {

using Json = nlohmann::ordered_json;

// Device names may hold any bytes; what is no UTF-8 is replaced, not refused.
std::string dump(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string packed_hex(std::span<const std::byte> bytes) {
  std::string text = to_hex(bytes);
  std::erase(text, ' ');
  return text;
}

Json counters_json(const line::Counters& c) {
  return {{"frames_received", c.frames_received},
          {"frames_sent", c.frames_sent},
          {"frames_unused", c.frames_unused},
          {"frames_malformed", c.frames_malformed},
          {"frames_lost", c.frames_lost},
          {"bus_errors", c.bus_errors},
          {"rpdos", c.rpdos},
          {"tpdos", c.tpdos},
          {"tpdos_coalesced", c.tpdos_coalesced},
          {"syncs", c.syncs},
          {"emcys", c.emcys},
          {"heartbeats_lost", c.heartbeats_lost},
          {"sdo_transfers", c.sdo_transfers},
          {"sdo_aborts", c.sdo_aborts},
          {"commands", c.commands},
          {"commands_refused", c.commands_refused},
          {"output_writes", c.output_writes},
          {"output_writes_refused", c.output_writes_refused},
          {"events", c.events},
          {"events_lost", c.events_lost}};
}

Json node_json(const Line& line, const NodeView& node) {
  const line::NodeState& state = node.state;
  return {{"gateway", line.id.gateway},
          {"line", line.id.line},
          {"node", state.node},
          {"name", node.name},
          {"configured", state.configured},
          {"presence", line::name(state.presence)},
          {"state", nmt::name(state.state)},
          {"boot", state.boot == manager::kBooted ? "" : std::string(1, state.boot)},
          {"boot_text", line::describe_boot(state.boot)},
          {"since", date_text(node.since)},
          {"heartbeat_monitored", state.heartbeat_monitored},
          {"heartbeats_lost", state.heartbeats_lost},
          {"device_type", state.device_type},
          {"vendor", state.vendor},
          {"product", state.product},
          {"revision", state.revision},
          {"serial", state.serial},
          {"error_register", state.error_register},
          {"last_emcy", state.last_emcy},
          {"emcy_count", state.emcy_count}};
}

Json nodes_of(const std::vector<const Line*>& lines) {
  Json out = Json::array();
  for (const Line* line : lines) {
    for (const auto& [id, node] : line->nodes) {
      out.push_back(node_json(*line, node));
    }
  }
  return out;
}

Json line_json(const Line& line) {
  Json out = {{"gateway", line.id.gateway}, {"line", line.id.line}, {"gone", line.gone}};
  if (line.view) {
    const line::LineState& state = line.view->state;
    out["interface"] = line.view->interface_uri;
    out["bit_rate"] = line.view->bit_rate;
    out["access"] = line.view->access;
    out["time"] = date_text(line.view->time);
    out["network_id"] = state.network_id;
    out["node_id"] = state.node_id;
    out["role"] = line::name(state.role);
    out["own_state"] = nmt::name(state.own_state);
    out["manager"] = line::name(state.manager);
    out["bus"] = can::name(state.bus);
    out["transmit_errors"] = state.transmit_errors;
    out["receive_errors"] = state.receive_errors;
    out["load_permille"] = state.load_permille;
    out["nodes_configured"] = state.nodes_configured;
    out["nodes_operational"] = state.nodes_operational;
    out["counters"] = counters_json(state.counters);
    out["properties"] = Json::object();
    for (const auto& [name, value] : line.view->properties) {
      out["properties"][name] = value;
    }
  }
  out["nodes"] = nodes_of({&line});
  return out;
}

Json entry_json(const Area& area, std::size_t i) {
  const image::Entry& entry = area.layout->entries[i];
  const std::vector<std::byte> value = area.value(i);
  return {{"entry", i},
          {"name", entry.name},
          {"node", entry.node},
          {"index", entry.index},
          {"sub", entry.sub},
          {"type", od::name(entry.type)},
          {"bit_offset", entry.bit_offset},
          {"bit_length", entry.bit_length},
          {"remote_pdo", entry.remote_pdo},
          {"local_pdo", entry.local_pdo},
          {"valid", area.valid(i)},
          {"value", to_text(entry.type, value)},
          {"bytes", packed_hex(value)}};
}

}  // namespace

std::string lines_json(const std::vector<const Line*>& lines) {
  Json out = {{"lines", Json::array()}};
  for (const Line* line : lines) {
    out["lines"].push_back(line_json(*line));
  }
  return dump(out);
}

std::string nodes_json(const std::vector<const Line*>& lines) {
  return dump(nodes_of(lines));
}

std::string image_json(const Line& line, image::Direction direction) {
  const Area& area = line.areas[static_cast<std::size_t>(direction)];
  Json out = {
      {"gateway", line.id.gateway}, {"line", line.id.line}, {"direction", image::name(direction)}};
  if (area.layout) {
    out["layout_id"] = area.layout->id;
  }
  if (area.image) {
    out["sequence"] = area.image->sequence;
    out["time"] = date_text(area.image->acquired);
    out["bytes"] = packed_hex(area.image->bytes);
  }
  out["entries"] = nullptr;
  if (area.complete()) {
    out["entries"] = Json::array();
    for (std::size_t i = 0; i < area.layout->entries.size(); ++i) {
      out["entries"].push_back(entry_json(area, i));
    }
  }
  return dump(out);
}

std::string event_json(const LineId& id, const EventView& view) {
  const Event& event = view.event;
  return dump({{"time", date_text(event.time)},
               {"gateway", id.gateway},
               {"line", id.line},
               {"number", event.number},
               {"kind", name(event.kind)},
               {"severity", name(severity(event.kind))},
               {"node", event.node},
               {"code", event.code},
               {"value", event.value},
               {"data", packed_hex(std::span(event.data).first(event.length))},
               {"text", view.text}});
}

std::string answer_json(const Client::Answer& answer, const std::string& value) {
  if (answer.reply.ok()) {
    return dump({{"ok", true}, {"data", packed_hex(answer.reply.data)}, {"value", value}});
  }
  const bool abort = answer.reply.error.domain == Domain::sdo;
  return dump({{"ok", false},
               {"domain", abort ? "sdo" : "command"},
               {"code", answer.reply.error.code},
               {"text", answer.text}});
}

}  // namespace linegate::console
