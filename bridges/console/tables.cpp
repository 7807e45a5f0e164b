// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/tables.h"

#include <algorithm>
#include <array>
#include <utility>

#include "bridges/console/lookup.h"
#include "bridges/console/output_text.h"
#include "bridges/console/value_text.h"
#include "stack/image/scaling.h"
#include "stack/od/description.h"

namespace linegate::console {
namespace {

Cell text_cell(std::string_view text) {
  return {printable(text), std::nullopt};
}

template <class Number>
Cell number_cell(Number number) {
  return {std::to_string(number), static_cast<double>(number)};
}

Cell rate_cell(const std::optional<double>& rate) {
  return rate ? Cell{std::to_string(static_cast<std::uint64_t>(*rate + 0.5)), rate} : Cell{"-", {}};
}

Cell load_cell(const LineView& view) {
  if (view.bit_rate == 0) {
    return {"-", {}};  // as of udp: lines, whose load is not known
  }
  const unsigned permille = view.state.load_permille;
  return {std::to_string(permille / 10) + '.' + std::to_string(permille % 10) + '%',
          static_cast<double>(permille)};
}

// Why the data of a line is not reliable; nothing if it is.
std::optional<Note> trouble(const Model& model, const Line& line) {
  const std::string name = printable(line.id.line);
  switch (model.freshness(line)) {
    case Freshness::live:
    case Freshness::unheard:
      break;
    case Freshness::silent:
      return Note{name + ": nothing received for " + duration_text(model.silence(line)) +
                      "; the last received values are shown",
                  Style::error};
    case Freshness::gone:
      return Note{name + ": the gateway is gone; the last received values are shown", Style::error};
  }
  return std::nullopt;
}

std::string bus_text(const Model& model, const Line& line) {
  switch (model.freshness(line)) {
    case Freshness::gone:
      return "gateway gone";
    case Freshness::silent:
      return "silent " + duration_text(model.silence(line));
    case Freshness::live:
    case Freshness::unheard:
      break;
  }
  return std::string(can::name(line.view->state.bus));
}

// Of a flying master its state, and the active master if that is another node.
std::string role_text(const line::LineState& state) {
  if (state.flying_master == nmt::FlyingMasterState::none) {
    return std::string(line::name(state.role));
  }
  std::string out = "flying ";
  out += nmt::name(state.flying_master);
  if (state.flying_master == nmt::FlyingMasterState::slave) {
    out += " of " + std::to_string(state.active_master);
  }
  return out;
}

Row line_row(const Model& model, const Line& line) {
  Row row{{line.id}, {text_cell(line.id.line)}, style_of(model, line)};
  if (!line.view) {
    row.cells.resize(14);
    row.cells[2] = text_cell(is_removed(model, line) ? "removed"
                             : line.gone             ? "gateway gone"
                                                     : "(no state yet)");
    row.cells[13] = text_cell(line.id.gateway);
    return row;
  }
  const line::LineState& state = line.view->state;
  Cell nodes{std::to_string(state.nodes_operational) + '/' + std::to_string(state.nodes_configured),
             static_cast<double>(state.nodes_operational)};
  for (Cell& cell : std::array{
           number_cell(state.network_id), text_cell(bus_text(model, line)), load_cell(*line.view),
           rate_cell(line.received_per_second), rate_cell(line.sent_per_second),
           text_cell(line::name(state.manager)), std::move(nodes),
           number_cell(state.counters.frames_lost), text_cell(line.view->interface_uri),
           text_cell(role_text(state)), number_cell(state.counters.bus_errors),
           number_cell(state.counters.frames_malformed), text_cell(line.id.gateway)}) {
    row.cells.push_back(std::move(cell));
  }
  return row;
}

// Adds the active node-ID if it differs from the configured one.
std::string node_name(const NodeView& node) {
  const auto id = std::ranges::find(node.properties, "node-id",
                                    [](const auto& property) { return property.first; });
  const std::string name = node.name.empty() ? "(not configured)" : node.name;
  if (id == node.properties.end() || id->second == std::to_string(node.state.node)) {
    return name;
  }
  return name + (id->second == "none" ? " (no node-ID)" : " (node-ID " + id->second + ')');
}

Row node_row(const Model& model, const Line& line, const NodeView& node, Stamp stamp) {
  const line::NodeState& state = node.state;
  const bool live = model.freshness(line) == Freshness::live;
  return {{line.id, state.node},
          {text_cell(line.id.line),
           number_cell(state.node),
           text_cell(node_name(node)),
           text_cell(nmt::name(state.state)),
           text_cell(line::name(state.presence)),
           text_cell(boot_text(state.boot)),
           number_cell(state.emcy_count),
           text_cell(state.emcy_count == 0 ? "" : hex_digits(state.last_emcy, 4) + 'h'),
           {stamp(node.since), static_cast<double>(node.since.time_since_epoch().count())},
           number_cell(state.heartbeats_lost)},
          live ? style_of(node) : Style::stale};
}

Style style_of_value(const Model& model, const Line& line, const Area& area, std::size_t entry) {
  if (model.freshness(line) != Freshness::live) {
    return Style::stale;
  }
  if (!area.valid(entry)) {
    return Style::warning;
  }
  return area.image->is_changed(entry) ? Style::changed : Style::plain;
}

// Marks a known output that was not transmitted since its node's last start as waiting.
std::string value_cell(const Area& area, std::size_t number) {
  const std::string value = to_text(area.layout->entries[number], area.value(number));
  if (area.valid(number)) {
    return value;
  }
  return area.known(number) ? value + " (waits)" : "(invalid)";
}

std::string value_with_unit(const Area& area, std::size_t number) {
  if (!area.valid(number) && !area.known(number)) {
    return value_cell(area, number);
  }
  return text_with_unit(area.layout->entries[number], area.value(number)) +
         (area.valid(number) ? "" : " (waits)");
}

Row value_row(const Model& model, const Line& line, const Area& area, std::size_t number) {
  const image::Entry& entry = area.layout->entries[number];
  const std::vector<std::byte> value = area.value(number);
  const auto age = area.age(number);
  const bool out = area.layout->direction == image::Direction::outputs;
  Cell shown = text_cell(value_cell(area, number));
  if (area.valid(number) || area.known(number)) {
    shown.number = to_number(entry, value);
  }
  return {{line.id, entry.node, 2 * number + (out ? 1 : 0)},
          {text_cell(line.id.line), number_cell(entry.node),
           text_cell(od::to_text({entry.index, entry.sub})), text_cell(entry.name),
           std::move(shown), text_cell(unit_of(entry)), text_cell(od::name(entry.type)),
           age ? Cell{duration_text(*age), std::chrono::duration<double>(*age).count()}
               : text_cell("-"),
           text_cell(out ? output_state(line, number) : ""), text_cell(out ? "out" : "in"),
           Cell{image::pdo_cell(entry.remote_pdo), static_cast<double>(entry.remote_pdo)},
           text_cell(to_hex(value))},
          style_of_value(model, line, area, number)};
}

std::string missing_text(const Line& line, image::Direction direction) {
  const Area& area = line.areas[static_cast<std::size_t>(direction)];
  const std::string what = printable(line.id.line) + ": ";
  const std::string name(image::name(direction));
  if (!area.layout) {
    return what + "no layout of the " + name + " received yet";
  }
  return what + (area.image ? "the layout of the " + name + " is not that of the values"
                            : "no values of the " + name + " received yet");
}

void add_values(const Model& model, const Line& line, image::Direction direction, std::uint8_t node,
                Table& out) {
  const Area& area = line.areas[static_cast<std::size_t>(direction)];
  if (!area.complete()) {
    const bool has_values = !area.layout || !area.layout->entries.empty();
    if (has_values && !is_removed(model, line)) {
      out.notes.push_back({missing_text(line, direction), Style::warning});
    }
    return;
  }
  for (std::size_t i = 0; i < area.layout->entries.size(); ++i) {
    if (node == 0 || area.layout->entries[i].node == node) {
      out.rows.push_back(value_row(model, line, area, i));
    }
  }
}

// Adds the notes about the lines, then keeps the rows that match the words of the filter.
void finish(const Model& model, const Filter& filter, Table& table) {
  std::vector<Note> notes;
  for (const Line* line : model.find(filter.line)) {
    if (auto note = trouble(model, *line)) {
      notes.push_back(*std::move(note));
    }
  }
  table.notes.insert(table.notes.begin(), notes.begin(), notes.end());
  keep_matches(table, filter.words);
}

}  // namespace

bool is_meant(const std::vector<const Line*>& lines, const LineId& id) {
  return std::any_of(lines.begin(), lines.end(), [&](const Line* line) { return line->id == id; });
}

Table lines_of(const Model& model, const Filter& filter) {
  Table out{{{"LINE"},
             {"NET", true},
             {"BUS"},
             {"LOAD", true},
             {"RX/s", true},
             {"TX/s", true},
             {"MANAGER"},
             {"NODES"},
             {"LOST", true},
             {"INTERFACE", false, true},
             {"ROLE", false, false, true},
             {"ERRORS", true, false, true},
             {"MALFORMED", true, false, true},
             {"GATEWAY", false, false, true}},
            {},
            {}};
  for (const Line* line : model.find(filter.line)) {
    out.rows.push_back(line_row(model, *line));
  }
  keep_matches(out, filter.words);
  return out;
}

Table nodes_of(const Model& model, const Filter& filter, Stamp stamp) {
  Table out{{{"LINE"},
             {"NODE", true},
             {"NAME", false, true},
             {"STATE"},
             {"PRESENCE"},
             {"BOOT"},
             {"EMCY", true},
             {"LAST"},
             {"SINCE"},
             {"HB LOST", true, false, true}},
            {},
            {}};
  for (const Line* line : model.find(filter.line)) {
    for (const auto& [id, node] : line->nodes) {
      if (filter.node == 0 || filter.node == id) {
        out.rows.push_back(node_row(model, *line, node, stamp));
      }
    }
  }
  finish(model, filter, out);
  return out;
}

Table values_of(const Model& model, const Filter& filter, Directions directions) {
  Table out{{{"LINE"},
             {"NODE", true},
             {"OBJECT"},
             {"NAME", false, true},
             {"VALUE", true},
             {"UNIT"},
             {"TYPE"},
             {"AGE", true},
             {"STATE", false, false, true},
             {"DIR", false, false, true},
             {"PDO", true, false, true},
             {"BYTES", false, false, true}},
            {},
            {}};
  for (const Line* line : model.find(filter.line)) {
    if (directions != Directions::outputs) {
      add_values(model, *line, image::Direction::inputs, filter.node, out);
    }
    if (directions != Directions::inputs) {
      add_values(model, *line, image::Direction::outputs, filter.node, out);
    }
  }
  finish(model, filter, out);
  return out;
}

Table events_of(const Model& model, const Filter& filter, std::size_t count, Stamp stamp) {
  Table out{{{"TIME"}, {"LINE"}, {"NODE", true}, {"KIND"}, {"TEXT"}}, {}, {}};
  const std::vector<const Line*> lines = model.find(filter.line);
  for (auto it = model.events().rbegin(); it != model.events().rend(); ++it) {
    const EventView& event = it->view;
    if (!is_meant(lines, it->id) || (filter.node != 0 && event.node != filter.node)) {
      continue;
    }
    out.rows.push_back(
        {{it->id, event.node, event.number},
         {{stamp(event.time), static_cast<double>(event.time.time_since_epoch().count())},
          text_cell(it->id.line),
          event.node == 0 ? text_cell("") : number_cell(event.node),
          text_cell(name(event.kind)),
          text_cell(it->view.text)},
         style_of(event.severity)});
  }
  keep_matches(out, filter.words);
  out.rows.resize(std::min(out.rows.size(), count));
  return out;
}

Text image_table(const Line& line, image::Direction direction) {
  const Area& area = line.areas[static_cast<std::size_t>(direction)];
  if (!area.complete()) {
    return {printable(line.id.line) + ": no " + std::string(image::name(direction)) +
            " received yet"};
  }
  Table out{{{"ENTRY"}, {"NODE"}, {"OBJECT"}, {"TYPE"}, {"VALUE"}, {"BYTES"}, {"NAME"}}, {}, {}};
  if (direction == image::Direction::outputs) {
    out.columns.push_back({"STATE"});
  }
  for (std::size_t i = 0; i < area.layout->entries.size(); ++i) {
    const image::Entry& entry = area.layout->entries[i];
    const std::vector<std::byte> value = area.value(i);
    out.rows.push_back(
        {{line.id, entry.node, i},
         {number_cell(i), number_cell(entry.node), text_cell(od::to_text({entry.index, entry.sub})),
          text_cell(od::name(entry.type)), text_cell(value_with_unit(area, i)),
          text_cell(to_hex(value)), text_cell(entry.name)}});
    if (direction == image::Direction::outputs) {
      out.rows.back().cells.push_back(text_cell(output_state(line, i)));
    }
  }
  return text_of(out);
}

}  // namespace linegate::console
