// SPDX-License-Identifier: Apache-2.0
// The state of the console: the last received sample of each kind.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bridges/console/client.h"
#include "stack/image/layout_match.h"

namespace linegate::console {

// One direction of a line's image. Values can be read only if layout and image match: a foreign
// publisher's image may be shorter than its layout, and after a restart of the line an image may
// belong to another layout with the same ID (stack/image/layout_match.h).
struct Area {
  std::optional<image::Layout> layout;
  std::optional<image::Snapshot> image;
  // By entry: last reception (inputs) or transmission (outputs) of its PDO; 0 = never
  std::vector<Instant> received;

  bool complete() const { return is_certain_ && fits(); }
  bool valid(std::size_t entry) const { return complete() && image->is_valid(entry); }
  // Outputs: the entry was written or has a default.
  bool known(std::size_t entry) const {
    return complete() && entry / 64 < image->known.size() && image->is_known(entry);
  }
  // The entry's bytes, shifted to bit 0; empty if layout and image do not match.
  std::vector<std::byte> value(std::size_t entry) const;
  // The time between the last PDO with the entry and the image, on the gateway's clock; nothing if
  // no PDO was received since this program started.
  std::optional<Duration> age(std::size_t entry) const;

  void take(const image::Layout& fresh, Instant now);
  void take(const image::Snapshot& fresh, Instant now);
  // Time has passed.
  void at(Instant now) { is_certain_ = match_.is_certain(now); }

 private:
  bool fits() const {
    return layout && image && layout->id == image->layout_id &&
           image->changed.size() * 64 >= layout->entries.size() &&
           image->valid.size() * 64 >= layout->entries.size();
  }

  image::LayoutMatch match_;
  bool is_certain_ = true;
};

// How reliable the data of a line is.
enum class Freshness {
  unheard,  // no LineState was received
  live,
  silent,  // its gateway is alive but published nothing for kSilence
  gone,    // its gateway left or is unreachable
};

struct Line {
  LineId id;
  bool gone = false;  // its gateway left
  std::optional<LineView> view;
  std::map<std::uint8_t, NodeView> nodes;
  std::array<Area, 2> areas;                        // by image::Direction
  std::map<std::uint16_t, OutputStateView> groups;  // groups of outputs, by number
  std::uint64_t images = 0;                         // samples received
  Instant heard{};  // time of the last LineState, on the clock of Model::at()
  Instant begun{};  // of the first one after that of another start of the gateway
  // Frames a second over the last second or more; nothing until two states were received.
  std::optional<double> received_per_second;
  std::optional<double> sent_per_second;

 private:
  friend class Model;
  std::optional<LineView> baseline_;  // reference for the rates
};

struct KnownEvent {
  LineId id;
  EventView view;
};

class Model : public Listener {
 public:
  static constexpr std::size_t kKeptEvents = 1000;
  // Bounded: a participant may publish any number of names
  static constexpr std::size_t kMaxLines = 4096;
  // A gateway publishes the state of each line every second.
  static constexpr Duration kSilence = std::chrono::seconds(3);

  // Sets the current time, by any clock that never goes back. Call it before samples are passed in.
  void at(Instant now);
  Freshness freshness(const Line& line) const;
  // Time since its last state.
  Duration silence(const Line& line) const { return now_ - line.heard; }

  void on_gateway(const std::string& name, const GatewayView& gateway) override;
  void on_line(const LineId& id, const LineView& line) override;
  void on_line_gone(const LineId& id) override;
  void on_node(const LineId& id, const NodeView& node) override;
  void on_output_state(const LineId& id, const OutputStateView& state) override;
  void on_node_gone(const LineId& id, std::uint8_t node) override;
  void on_output_state_gone(const LineId& id, std::uint16_t group) override;
  void on_layout(const LineId& id, const image::Layout& layout) override;
  void on_image(const LineId& id, const image::Snapshot& image) override;
  void on_event(const LineId& id, const EventView& event) override;
  void on_unreadable(std::uint64_t samples) override { unreadable_ += samples; }
  void on_left_out(std::uint64_t samples) override { left_out_ += samples; }

  const std::map<LineId, Line>& lines() const { return lines_; }
  // By name; at most kMaxLines.
  const std::map<std::string, GatewayView>& gateways() const { return gateways_; }
  // In order of arrival, newest last; at most kKeptEvents.
  const std::deque<KnownEvent>& events() const { return events_; }
  // Whether another gateway of the domain has the same name as the sender.
  static bool has_namesake(const LineView& view);
  // Incremented by each sample.
  std::uint64_t revision() const { return revision_; }
  std::uint64_t events_seen() const { return events_seen_; }
  // Number of dropped samples: malformed, or of lines beyond kMaxLines.
  std::uint64_t unreadable() const { return unreadable_; }
  std::uint64_t left_out() const { return left_out_; }
  // The kinds of dropped samples in words; each kind is returned once.
  std::vector<std::string> pop_warnings();

  // Lines with the name or network-ID `text`; with "GATEWAY/" in front only those of that gateway.
  // An empty text selects all.
  std::vector<const Line*> find(const std::string& text) const;

 private:
  Line* line(const LineId& id);  // nullptr if there are kMaxLines other lines
  static void count_rates(Line& line);

  std::map<LineId, Line> lines_;
  std::map<std::string, GatewayView> gateways_;
  std::deque<KnownEvent> events_;
  Instant now_{};
  std::uint64_t revision_ = 0;
  std::uint64_t events_seen_ = 0;
  std::uint64_t unreadable_ = 0;
  std::uint64_t left_out_ = 0;
  bool unreadable_reported_ = false;
  bool left_out_reported_ = false;
  std::map<std::string, bool> namesakes_;  // gateways with a namesake; true: reported
};

}  // namespace linegate::console
