// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/json_text.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <chrono>
#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "bridges/console/object_text.h"
#include "bridges/console/one_line.h"
#include "bridges/console/output_text.h"
#include "bridges/console/tables.h"
#include "bridges/console/value_text.h"
#include "stack/base/byte_order.h"
#include "stack/image/scaling.h"

namespace linegate::console {
namespace {

using Json = nlohmann::ordered_json;

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
          {"events_lost", c.events_lost},
          {"receptions_lost", c.receptions_lost},
          {"fd_frames_received", c.fd_frames_received},
          {"fd_frames_sent", c.fd_frames_sent},
          {"usdo_transfers", c.usdo_transfers},
          {"usdo_aborts", c.usdo_aborts}};
}

// The devices of a line in the role device are the gateway's own: it boots none of them.
bool is_own_device(const Line& line) {
  return line.view && line.view->state.role == line::Role::device;
}

Json node_json(const Line& line, const NodeView& node) {
  const line::NodeState& state = node.state;
  Json properties = Json::object();
  for (const auto& [name, value] : node.properties) {
    properties[name] = value;
  }
  return {{"gateway", line.id.gateway},
          {"line", line.id.line},
          {"node", state.node},
          {"name", node.name},
          {"configured", state.configured},
          {"presence", line::name(state.presence)},
          {"state", nmt::name(state.state)},
          {"boot", state.boot == manager::kBooted ? "" : std::string(1, state.boot)},
          {"boot_text", is_own_device(line) ? "" : boot_words(node)},
          {"since", date_text(node.since)},
          {"heartbeat_monitored", state.heartbeat_monitored},
          {"heartbeats_lost", state.heartbeats_lost},
          {"cause", line::name(state.cause)},
          {"spontaneous_changes", state.spontaneous_changes},
          {"device_type", state.device_type},
          {"vendor", state.vendor},
          {"product", state.product},
          {"revision", state.revision},
          {"serial", state.serial},
          {"error_register", state.error_register},
          {"last_emcy", state.last_emcy},
          {"emcy_count", state.emcy_count},
          {"properties", properties}};
}

Json nodes_array(const std::vector<const Line*>& lines, std::uint8_t only = 0) {
  Json out = Json::array();
  for (const Line* line : lines) {
    for (const auto& [id, node] : line->nodes) {
      if (only == 0 || only == id) {
        out.push_back(node_json(*line, node));
      }
    }
  }
  return out;
}

Json rate_json(const std::optional<double>& rate) {
  return rate ? Json(*rate) : Json(nullptr);
}

std::string_view freshness_name(Freshness freshness) {
  switch (freshness) {
    case Freshness::unheard:
      return "unheard";
    case Freshness::live:
      return "live";
    case Freshness::silent:
      return "silent";
    case Freshness::gone:
      return "gone";
  }
  return "unheard";
}

Json line_json(const Model& model, const Line& line, std::uint8_t node) {
  Json out = {{"gateway", line.id.gateway},
              {"line", line.id.line},
              {"gone", line.gone},
              {"freshness", freshness_name(model.freshness(line))}};
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
    out["flying_master"] = nmt::name(state.flying_master);
    out["active_master"] = state.active_master;
    out["master_priority"] = state.master_priority;
    out["bus"] = can::name(state.bus);
    out["transmit_errors"] = state.transmit_errors;
    out["receive_errors"] = state.receive_errors;
    out["load_permille"] = state.load_permille;
    out["received_per_second"] = rate_json(line.received_per_second);
    out["sent_per_second"] = rate_json(line.sent_per_second);
    out["nodes_configured"] = state.nodes_configured;
    out["nodes_operational"] = state.nodes_operational;
    out["counters"] = counters_json(state.counters);
    out["properties"] = Json::object();
    for (const auto& [name, value] : line.view->properties) {
      out["properties"][name] = value;
    }
  }
  out["nodes"] = nodes_array({&line}, node);
  return out;
}

Json real_json(double value) {
  if (std::isnan(value)) {
    return "nan";
  }
  return std::isinf(value) ? Json(value < 0 ? "-inf" : "inf") : Json(value);
}

// The number with the shortest text that is this REAL32: 0.1, not 0.10000000149011612.
double shortest(float value) {
  if (!std::isfinite(value)) {
    return value;
  }
  std::array<char, 32> digits{};
  const auto written = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  double out = value;
  std::from_chars(digits.data(), written.ptr, out);
  return out;
}

Json value_json(od::DataType type, std::span<const std::byte> value) {
  if (type == od::DataType::visible_string) {
    return std::string(reinterpret_cast<const char*>(value.data()), value.size());
  }
  if (od::byte_size(type) != value.size() || value.empty() || value.size() > 8) {
    return packed_hex(value);
  }
  const std::uint64_t raw = load_le(value);
  if (type == od::DataType::boolean) {
    return raw != 0;
  }
  if (type == od::DataType::real32) {
    return real_json(shortest(std::bit_cast<float>(static_cast<std::uint32_t>(raw))));
  }
  if (type == od::DataType::real64) {
    return real_json(std::bit_cast<double>(raw));
  }
  if (od::is_signed(type)) {
    return load_le_signed(value);
  }
  return od::is_integer(type) ? Json(raw) : Json(packed_hex(value));
}

Json text_or_null(std::string_view text) {
  return text.empty() ? Json(nullptr) : Json(text);
}

Json age_json(const std::optional<Duration>& age) {
  return age ? Json(std::chrono::duration_cast<std::chrono::milliseconds>(*age).count())
             : Json(nullptr);
}

Json entry_value_json(const image::Entry& entry, std::span<const std::byte> value) {
  const auto number = entry.scaling.is_scaled() ? image::scaled_number(entry, value) : std::nullopt;
  return number ? real_json(*number) : value_json(entry.type, value);
}

Json entry_json(const Area& area, std::size_t i) {
  const image::Entry& entry = area.layout->entries[i];
  const std::vector<std::byte> value = area.value(i);
  Json out = {{"entry", i},
              {"name", entry.name},
              {"node", entry.node},
              {"index", entry.index},
              {"sub", entry.sub},
              {"type", od::name(entry.type)},
              {"bit_offset", entry.bit_offset},
              {"bit_length", entry.bit_length},
              {"remote_pdo", entry.remote_pdo},
              {"local_pdo", entry.local_pdo},
              {"unit", text_or_null(unit_of(entry))},
              {"age_ms", age_json(area.age(i))},
              {"valid", area.valid(i)},
              {"value", area.valid(i) ? entry_value_json(entry, value) : Json(nullptr)},
              {"bytes", packed_hex(value)}};
  if (entry.scaling.is_scaled()) {
    out["raw"] = area.valid(i) ? value_json(entry.type, value) : Json(nullptr);
    out["scale"] = entry.scaling.scale;
    out["offset"] = entry.scaling.offset;
  }
  for (const auto& [key, number] :
       {std::pair("low", entry.low), {"high", entry.high}, {"initial", entry.initial}}) {
    if (number) {
      out[key] = *number;
    }
  }
  return out;
}

Json lines_array(const Model& model, const std::vector<const Line*>& lines, std::uint8_t node = 0) {
  Json out = Json::array();
  for (const Line* line : lines) {
    out.push_back(line_json(model, *line, node));
  }
  return out;
}

// The PDOs that were received or sent since the previous sample.
Json marks_json(const image::Snapshot& image) {
  Json out = Json::array();
  for (const image::PdoMark& mark : image.marks) {
    out.push_back({{"local_pdo", mark.local_pdo},
                   {"node", mark.node},
                   {"remote_pdo", mark.remote_pdo},
                   {"count", mark.count},
                   {"time", date_text(mark.time)}});
  }
  return out;
}

Json group_json(const OutputStateView& view) {
  const line::OutputState& state = view.state;
  const bool runs = state.deadline != kNever;
  return {{"group", state.group},
          {"name", state.name},
          {"owner", text_or_null(state.owner)},
          {"applied", state.applied},
          {"refused", state.refused},
          {"refusal", state.refused == 0 ? Json(nullptr) : Json(line::describe(state.refusal))},
          {"arming", state.arming},
          {"arming_wanted", state.arming_wanted},
          {"watchdog_left_ms",
           age_json(runs ? std::optional(state.deadline - view.time) : std::optional<Duration>())},
          {"waiting", state.waiting},
          {"text", group_text(view)}};
}

Json image_object(const Line& line, image::Direction direction, std::uint8_t node = 0) {
  const Area& area = line.areas[static_cast<std::size_t>(direction)];
  Json out = {
      {"gateway", line.id.gateway}, {"line", line.id.line}, {"direction", image::name(direction)}};
  if (area.layout) {
    out["layout_id"] = format_hex(area.layout->id, 16);
  }
  if (area.image) {
    out["sequence"] = area.image->sequence;
    out["time"] = date_text(area.image->acquired);
    out["bytes"] = packed_hex(area.image->bytes);
    out["pdos"] = marks_json(*area.image);
  }
  if (direction == image::Direction::outputs) {
    out["groups"] = Json::array();
    for (const auto& [number, view] : line.groups) {
      out["groups"].push_back(group_json(view));
    }
  }
  out["entries"] = nullptr;
  if (area.complete()) {
    out["entries"] = Json::array();
    for (std::size_t i = 0; i < area.layout->entries.size(); ++i) {
      if (node == 0 || area.layout->entries[i].node == node) {
        out["entries"].push_back(entry_json(area, i));
        if (direction == image::Direction::outputs) {
          out["entries"].back()["known"] = area.known(i);
          out["entries"].back()["state"] = output_state(line, i);
        }
      }
    }
  }
  return out;
}

Json event_object(const LineId& id, const EventView& view) {
  return {{"time", date_text(view.time)},
          {"gateway", id.gateway},
          {"line", id.line},
          {"number", view.number},
          {"kind", linegate::name(view.kind)},
          {"severity", linegate::name(view.severity)},
          {"node", view.node},
          {"code", view.code},
          {"value", view.value},
          {"data", packed_hex(view.bytes)},
          {"text", view.text}};
}

Json events_array(const Model& model, const Filter& filter) {
  const std::vector<const Line*> lines = model.find(filter.line);
  Json out = Json::array();
  std::vector<KnownEvent> events(model.events().begin(), model.events().end());
  std::ranges::sort(events, {}, [](const KnownEvent& one) {
    return std::tuple(one.view.time, one.id, one.view.number);
  });
  for (const KnownEvent& event : events) {
    const bool of_line = std::any_of(lines.begin(), lines.end(),
                                     [&](const Line* line) { return line->id == event.id; });
    if (of_line && (filter.node == 0 || filter.node == event.view.node)) {
      out.push_back(event_object(event.id, event.view));
    }
  }
  return out;
}

// Puts "type" first.
std::string typed(std::string_view type, const Json& rest) {
  Json out = {{"type", type}};
  out.update(rest);
  return one_line(out);
}

}  // namespace

std::string lines_json(const Model& model, const std::vector<const Line*>& lines) {
  return one_line(Json{{"lines", lines_array(model, lines)}});
}

std::string nodes_json(const std::vector<const Line*>& lines) {
  return one_line(nodes_array(lines));
}

std::string image_json(const Line& line, image::Direction direction) {
  return one_line(image_object(line, direction));
}

std::string plant_json(const Model& model, const Filter& filter, Instant utc) {
  Json out = {{"time", date_text(utc)}, {"lines", Json::array()}};
  for (const Line* line : model.find(filter.line)) {
    Json one = line_json(model, *line, filter.node);
    one["inputs"] = image_object(*line, image::Direction::inputs, filter.node);
    one["outputs"] = image_object(*line, image::Direction::outputs, filter.node);
    out["lines"].push_back(std::move(one));
  }
  out["events"] = events_array(model, filter);
  out["dropped"] = {{"damaged", model.unreadable()}, {"left_out", model.left_out()}};
  return one_line(out);
}

std::string stream_lines_json(const Model& model, const Filter& filter) {
  return typed("lines", {{"lines", lines_array(model, model.find(filter.line), filter.node)}});
}

std::string stream_image_json(const Line& line, image::Direction direction, std::uint8_t node) {
  return typed("image", image_object(line, direction, node));
}

std::string stream_event_json(const LineId& id, const EventView& event) {
  return typed("event", event_object(id, event));
}

std::string event_json(const LineId& id, const EventView& event) {
  return one_line(event_object(id, event));
}

std::string json_of_value(const image::Entry& entry, std::span<const std::byte> value) {
  return entry_value_json(entry, value).dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string answer_json(const Client::Answer& answer, const std::string& value) {
  if (answer.reply.ok()) {
    return one_line(Json{{"ok", true}, {"data", packed_hex(answer.bytes)}, {"value", value}});
  }
  const bool abort = answer.reply.error.domain == Domain::sdo;
  return one_line(Json{{"ok", false},
                       {"domain", abort ? "sdo" : "command"},
                       {"code", answer.reply.error.code},
                       {"text", answer.text}});
}

}  // namespace linegate::console
