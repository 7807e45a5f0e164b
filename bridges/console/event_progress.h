// SPDX-License-Identifier: Apache-2.0
// Progress of a long command: prints events of its line as they arrive.
#pragma once

#include <functional>
#include <initializer_list>
#include <ostream>
#include <string>

#include "bridges/console/client.h"
#include "bridges/console/model.h"
#include "stack/base/event.h"

namespace linegate::console {

// Forwards everything to the model, and prints the texts of new events.
class EventProgress final : public Listener {
 public:
  // The text to print for an event of the line; empty for events that are not printed.
  using Words = std::function<std::string(const EventView&)>;
  EventProgress(Model& model, LineId id, std::ostream& err, Words words);
  // Prints the texts of events of these kinds.
  EventProgress(Model& model, LineId id, std::ostream& err, std::initializer_list<EventKind> kinds);

  void on_line(const LineId& id, const LineView& line) override { model_.on_line(id, line); }
  void on_line_gone(const LineId& id) override { model_.on_line_gone(id); }
  void on_node(const LineId& id, const NodeView& node) override { model_.on_node(id, node); }
  void on_output_state(const LineId& id, const OutputStateView& state) override {
    model_.on_output_state(id, state);
  }
  void on_node_gone(const LineId& id, std::uint8_t node) override { model_.on_node_gone(id, node); }
  void on_output_state_gone(const LineId& id, std::uint16_t group) override {
    model_.on_output_state_gone(id, group);
  }
  void on_layout(const LineId& id, const image::Layout& layout) override {
    model_.on_layout(id, layout);
  }
  void on_image(const LineId& id, const image::Snapshot& image) override {
    model_.on_image(id, image);
  }
  void on_event(const LineId& id, const EventView& event) override;
  void on_unreadable(std::uint64_t samples) override { model_.on_unreadable(samples); }
  void on_left_out(std::uint64_t samples) override { model_.on_left_out(samples); }

 private:
  Model& model_;
  LineId id_;
  std::ostream& err_;
  Words words_;
  Instant since_;
};

}  // namespace linegate::console
