#include "bridges/console/tables.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>
#include <ostream>

#include "bridges/console/value_text.h"

namespace linegate::console {
namespace {

using Row = std::vector<std::string>;

// Rows with columns as wide as their widest cell, two blanks apart.
Text align(const std::vector<Row>& rows) {
  std::vector<std::size_t> widths;
  for (const Row& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) {
      widths[i] = std::max(widths[i], row[i].size());
    }
  }
  Text out;
  for (const Row& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      line += row[i];
      if (i + 1 < row.size()) {
        line.append(widths[i] - row[i].size() + 2, ' ');
      }
    }
    out.push_back(std::move(line));
  }
  return out;
}

std::string load_text(std::uint16_t permille) {
  return std::to_string(permille / 10) + '.' + std::to_string(permille % 10) + '%';
}

std::string boot_text(char boot) {
  if (boot == manager::kBooted) {
    return "ok";
  }
  return boot == manager::kBootUnfinished ? "-" : std::string(1, boot);
}

Row node_row(const Line& line, const NodeView& node) {
  const line::NodeState& state = node.state;
  return {line.id.line,
          std::to_string(state.node),
          node.name.empty() ? "(not configured)" : node.name,
          std::string(line::name(state.presence)),
          std::string(nmt::name(state.state)),
          boot_text(state.boot),
          std::to_string(state.emcy_count),
          state.emcy_count == 0 ? "" : hex_digits(state.last_emcy, 4) + 'h',
          clock_text(node.since)};
}

}  // namespace

void print(std::ostream& out, const Text& text) {
  for (const std::string& line : text) {
    out << line << '\n';
  }
}

std::string date_text(Instant utc) {
  const std::int64_t ns = utc.time_since_epoch().count();
  const std::time_t seconds = ns / 1'000'000'000;
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  std::array<char, 40> text;
  const std::size_t length = std::strftime(text.data(), text.size(), "%FT%T", &parts);
  std::snprintf(text.data() + length, text.size() - length, ".%03dZ",
                static_cast<int>(ns / 1'000'000 % 1000));
  return text.data();
}

std::string clock_text(Instant utc) {
  return utc == Instant{} ? "-" : date_text(utc).substr(11, 12);
}

Text lines_table(const Model& model) {
  std::vector<Row> rows = {
      {"LINE", "NET", "INTERFACE", "ROLE", "BUS", "LOAD", "MANAGER", "NODES", "RX", "TX", "LOST"}};
  for (const auto& [id, line] : model.lines()) {
    if (!line.view) {
      rows.push_back({id.line, "", "(no state yet)"});
      continue;
    }
    const line::LineState& state = line.view->state;
    rows.push_back(
        {id.line, std::to_string(state.network_id), line.view->interface_uri,
         std::string(line::name(state.role)),
         line.gone ? "gateway gone" : std::string(can::name(state.bus)),
         load_text(state.load_permille), std::string(line::name(state.manager)),
         std::to_string(state.nodes_operational) + '/' + std::to_string(state.nodes_configured),
         std::to_string(state.counters.frames_received), std::to_string(state.counters.frames_sent),
         std::to_string(state.counters.frames_lost)});
  }
  return align(rows);
}

Text nodes_table(const std::vector<const Line*>& lines) {
  std::vector<Row> rows = {
      {"LINE", "NODE", "NAME", "PRESENCE", "STATE", "BOOT", "EMCY", "LAST", "SINCE"}};
  for (const Line* line : lines) {
    for (const auto& [id, node] : line->nodes) {
      rows.push_back(node_row(*line, node));
    }
  }
  return align(rows);
}

Text image_table(const Line& line, image::Direction direction) {
  const Area& area = line.areas[static_cast<std::size_t>(direction)];
  if (!area.complete()) {
    return {line.id.line + ": no " + std::string(image::name(direction)) + " received yet"};
  }
  std::vector<Row> rows = {{"ENTRY", "NODE", "OBJECT", "TYPE", "VALUE", "BYTES", "NAME"}};
  for (std::size_t i = 0; i < area.layout->entries.size(); ++i) {
    const image::Entry& entry = area.layout->entries[i];
    const std::vector<std::byte> value = area.value(i);
    rows.push_back({std::to_string(i), std::to_string(entry.node),
                    hex_digits(entry.index, 4) + ':' + std::to_string(entry.sub),
                    std::string(od::name(entry.type)),
                    area.valid(i) ? to_text(entry.type, value) : "(invalid)", to_hex(value),
                    entry.name});
  }
  return align(rows);
}

std::string event_text(const LineId& id, const EventView& event) {
  return clock_text(event.event.time) + ' ' + id.line + " #" + std::to_string(event.event.number) +
         ' ' + std::string(name(event.event.kind)) + ": " + event.text;
}

std::string dropped_text(const Model& model) {
  std::string out;
  if (model.unreadable() > 0) {
    out += "   dropped, damaged: " + std::to_string(model.unreadable());
  }
  if (model.left_out() > 0) {
    out += "   dropped, too many lines: " + std::to_string(model.left_out());
  }
  return out;
}

}  // namespace linegate::console
