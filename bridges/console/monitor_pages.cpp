// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/monitor_pages.h"

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "bridges/console/explain_words.h"
#include "bridges/console/value_text.h"

namespace linegate::console {
namespace {

void add_fact(std::vector<Note>& out, const std::string& what, const std::string& text,
              Style style = Style::plain) {
  out.push_back({what + std::string(what.size() < 11 ? 11 - what.size() : 1, ' ') + text, style});
}

void describe_identity(const line::NodeState& state, std::vector<Note>& out) {
  const auto number = [](std::uint32_t value) {
    return value == 0 ? std::string("not read") : hex_digits(value, 8) + 'h';
  };
  add_fact(out, "device", "type " + number(state.device_type) + ", vendor " + number(state.vendor));
  add_fact(out, "",
           "product " + number(state.product) + ", revision " + number(state.revision) +
               ", serial " + number(state.serial));
}

void describe_errors(const line::NodeState& state, std::vector<Note>& out) {
  if (state.emcy_count == 0) {
    add_fact(out, "errors", "no EMCY received");
    return;
  }
  add_fact(out, "errors",
           std::to_string(state.emcy_count) +
               (state.emcy_count == 1 ? " EMCY: " : " EMCYs, the last: ") +
               hex_digits(state.last_emcy, 4) + "h: " + describe_error_code(state.last_emcy),
           state.last_emcy == 0 ? Style::plain : Style::warning);
  const std::string bits = describe_error_register(state.error_register);
  add_fact(out, "",
           "error register " + hex_digits(state.error_register, 2) + 'h' +
               (bits.empty() ? "" : ": " + bits));
}

// Only the nodes of a manager have a boot process.
void describe_node(const NodeView& node, bool is_managed, std::vector<Note>& out) {
  const line::NodeState& state = node.state;
  add_fact(out, "state",
           std::string(nmt::name(state.state)) + ", " + std::string(line::name(state.presence)) +
               ", since " + clock_text(node.since),
           style_of(node));
  if (is_managed) {
    add_fact(out, "boot", boot_text(state.boot) + ": " + boot_words(node),
             manager::is_booted(state.boot) && state.boot != manager::kNotStarted ? Style::plain
                                                                                  : Style::warning);
  }
  add_fact(out, "heartbeat",
           std::string(state.heartbeat_monitored ? "monitored" : "not monitored") + ", lost " +
               std::to_string(state.heartbeats_lost) + " times");
  if (state.spontaneous_changes > 0) {
    add_fact(out, "changed by itself", std::to_string(state.spontaneous_changes) + " times",
             Style::warning);
  }
  describe_identity(state, out);
  describe_errors(state, out);
}

// The reasons why outputs are not sent, each once: the table has no room for them.
std::vector<Note> waiting_outputs(const Table& values) {
  std::map<std::string, std::size_t> reasons;
  for (const Row& row : values.rows) {
    const std::string& state = row.cells[kOutputState].text;
    if (!state.empty() && row.style == Style::warning) {
      ++reasons[state];
    }
  }
  std::vector<Note> out;
  for (const auto& [reason, count] : reasons) {
    out.push_back({std::to_string(count) + (count == 1 ? " output: " : " outputs: ") + reason,
                   Style::warning});
  }
  return out;
}

// A table of one node, without the first two columns, which would repeat its name.
void add_table(Table table, const std::string& headline, const std::string& empty,
               std::vector<std::size_t> columns, std::size_t width, std::vector<Note>& out) {
  out.push_back({"", Style::plain});
  out.push_back({headline, Style::bold});
  out.insert(out.end(), table.notes.begin(), table.notes.end());
  if (table.rows.empty()) {
    out.push_back({empty, Style::plain});
    return;
  }
  for (const std::size_t column : columns) {
    table.columns.erase(table.columns.begin() + static_cast<std::ptrdiff_t>(column));
    for (Row& row : table.rows) {
      row.cells.erase(row.cells.begin() + static_cast<std::ptrdiff_t>(column));
    }
  }
  const Text text = fit(table, width, 0);
  out.push_back({text.front(), Style::headline});
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    out.push_back({text[i + 1], table.rows[i].style});
  }
}

}  // namespace

std::string reference_to(const Model& model, const LineId& id) {
  return model.find(id.line).size() == 1 ? id.line : id.gateway + '/' + id.line;
}

std::vector<Note> node_page(const Model& model, const LineId& line, std::uint8_t node,
                            std::size_t width) {
  std::vector<Note> out;
  const auto found = model.lines().find(line);
  const NodeView* view = nullptr;
  if (found != model.lines().end()) {
    const auto at = found->second.nodes.find(node);
    view = at == found->second.nodes.end() ? nullptr : &at->second;
  }
  out.push_back({"node " + std::to_string(node) + " of " + printable(line.line) + " (gateway " +
                     printable(line.gateway) + ")" +
                     (view == nullptr || view->name.empty() ? "" : ": " + printable(view->name)),
                 Style::bold});
  const Filter filter{.line = reference_to(model, line), .node = node};
  const Table state = nodes_of(model, filter);
  out.insert(out.end(), state.notes.begin(), state.notes.end());
  if (view == nullptr) {
    out.push_back({"nothing was received about its state yet", Style::warning});
  } else {
    const auto& of_line = found->second.view;
    describe_node(*view, !of_line || of_line->state.role == line::Role::manager, out);
  }
  Table values = values_of(model, filter, Directions::both);
  values.notes.erase(values.notes.begin(),
                     values.notes.begin() + static_cast<std::ptrdiff_t>(state.notes.size()));
  const std::vector<Note> waiting = waiting_outputs(values);
  values.notes.insert(values.notes.end(), waiting.begin(), waiting.end());
  add_table(std::move(values), "values", "none in the process image", {1, 0}, width, out);
  add_table(events_of(model, filter), "events, the newest first", "none yet", {2, 1}, width, out);
  return out;
}

std::vector<Note> help_page() {
  constexpr std::pair<std::string_view, std::string_view> kKeys[] = {
      {"1 2 3 4", "lines, nodes, values, events"},
      {"Tab, Shift-Tab", "next page, previous page"},
      {"up, down, k, j", "select a row"},
      {"PgUp, PgDn", "a screen up or down"},
      {"Home, End, g, G",
       "first row, last row; while the first row is selected, a list stays at its beginning"},
      {"left, right", "scroll to columns beyond the right edge"},
      {"Enter", "on a line: its nodes; else: the page of the node"},
      {"Esc, Backspace", "back from a node or from help; else: show everything again"},
      {"s, S", "sort by the next column, by the previous column"},
      {"r", "reverse the order"},
      {"/", "filter: line=NAME, node=NUMBER and words, separated by blanks"},
      {"l", "show only the next line; after the last line all lines"},
      {"n", "show only the node of the row; again: all nodes"},
      {"o", "inputs, outputs, or both"},
      {"p, Space", "stop updating the screen; again: continue"},
      {"?, h", "show these keys"},
      {"q, Ctrl-C", "end"},
  };
  std::vector<Note> out{{"keys", Style::bold}};
  for (const auto& [keys, text] : kKeys) {
    out.push_back(
        {"  " + std::string(keys) + std::string(18 - keys.size(), ' ') + std::string(text),
         Style::plain});
  }
  out.push_back({"", Style::plain});
  out.push_back({"colours", Style::bold});
  out.push_back({"  operational", Style::good});
  out.push_back({"  needs a look: not operational, not valid, bus warning", Style::warning});
  out.push_back({"  failed, missing, gone, bus-off", Style::error});
  out.push_back({"  a value that changed with the last image", Style::changed});
  out.push_back({"  the last received values; the gateway is silent or gone", Style::stale});
  return out;
}

}  // namespace linegate::console
