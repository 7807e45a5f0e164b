// SPDX-License-Identifier: Apache-2.0
// What the console knows: the last of everything that was received.
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

namespace linegate::console {

// One direction of a line's image. Values can be read when layout and image belong together: a
// stranger's image may be shorter than it says.
struct Area {
  std::optional<image::Layout> layout;
  std::optional<image::Snapshot> image;
  std::vector<Instant> received;  // by entry: when its PDO last came (inputs) or went; 0 = never

  bool complete() const {
    return layout && image && layout->id == image->layout_id &&
           image->changed.size() * 64 >= layout->entries.size() &&
           image->valid.size() * 64 >= layout->entries.size();
  }
  bool valid(std::size_t entry) const { return complete() && image->is_valid(entry); }
  // Of outputs: the entry was written or has a default.
  bool known(std::size_t entry) const {
    return complete() && entry / 64 < image->known.size() && image->is_known(entry);
  }
  // The entry's bytes, shifted to bit 0; empty if the two do not belong together.
  std::vector<std::byte> value(std::size_t entry) const;
  // Between the last PDO with the entry and the image, by the gateway's clock; nothing if there was
  // none since this program listens.
  std::optional<Duration> age(std::size_t entry) const;

  void take(const image::Layout& layout);
  void take(const image::Snapshot& image);
};

// What of a line can be relied on.
enum class Freshness {
  unheard,  // no state of it came yet
  live,
  silent,  // its gateway is there, but has not said anything for kSilence
  gone,    // its gateway has left, or can no longer be reached
};

struct Line {
  LineId id;
  bool gone = false;  // its gateway is no longer heard of
  std::optional<LineView> view;
  std::map<std::uint8_t, NodeView> nodes;
  std::array<Area, 2> areas;                        // by image::Direction
  std::map<std::uint16_t, OutputStateView> groups;  // of outputs, by number
  std::uint64_t images = 0;                         // samples received
  Instant heard{};                                  // the last state, by the clock of Model::at()
  // Frames a second, over the last second or more; nothing until two states have come.
  std::optional<double> received_per_second;
  std::optional<double> sent_per_second;

 private:
  friend class Model;
  std::optional<LineView> baseline_;  // what the rates are counted from
};

struct KnownEvent {
  LineId id;
  EventView view;
};

class Model : public Listener {
 public:
  static constexpr std::size_t kKeptEvents = 1000;
  static constexpr std::size_t kMaxLines = 4096;  // a stranger may publish any number of names
  // A gateway tells the state of a line every second.
  static constexpr Duration kSilence = std::chrono::seconds(3);

  // What time it is, by any clock that does not go back; to be told before samples are handed over.
  void at(Instant now) { now_ = now; }
  Freshness freshness(const Line& line) const;
  // Since its last state.
  Duration silence(const Line& line) const { return now_ - line.heard; }

  void on_gateway(const std::string& name, const GatewayView& gateway) override;
  void on_line(const LineId& id, const LineView& line) override;
  void on_line_gone(const LineId& id) override;
  void on_node(const LineId& id, const NodeView& node) override;
  void on_output_state(const LineId& id, const OutputStateView& state) override;
  void on_layout(const LineId& id, const image::Layout& layout) override;
  void on_image(const LineId& id, const image::Snapshot& image) override;
  void on_event(const LineId& id, const EventView& event) override;
  void on_unreadable(std::uint64_t samples) override { unreadable_ += samples; }
  void on_left_out(std::uint64_t samples) override { left_out_ += samples; }

  const std::map<LineId, Line>& lines() const { return lines_; }
  // By name; at most kMaxLines.
  const std::map<std::string, GatewayView>& gateways() const { return gateways_; }
  // In the order of arrival, the newest last; at most kKeptEvents.
  const std::deque<KnownEvent>& events() const { return events_; }
  // Whether another gateway of the domain has the name of the one that sent it.
  static bool has_namesake(const LineView& view);
  // Grows with every sample.
  std::uint64_t revision() const { return revision_; }
  std::uint64_t events_seen() const { return events_seen_; }
  // Samples that were dropped: damaged, or of lines beyond kMaxLines.
  std::uint64_t unreadable() const { return unreadable_; }
  std::uint64_t left_out() const { return left_out_; }
  // Which of them there are, in words; each kind is told once.
  std::vector<std::string> take_warnings();

  // Lines whose name is `text`, or whose network-ID it is if it is a number; "GATEWAY/" before it:
  // of that gateway alone. All if it is empty.
  std::vector<const Line*> find(const std::string& text) const;

 private:
  Line* line(const LineId& id);  // nullptr: there are kMaxLines others
  static void count_rates(Line& line);

  std::map<LineId, Line> lines_;
  std::map<std::string, GatewayView> gateways_;
  std::deque<KnownEvent> events_;
  Instant now_{};
  std::uint64_t revision_ = 0;
  std::uint64_t events_seen_ = 0;
  std::uint64_t unreadable_ = 0;
  std::uint64_t left_out_ = 0;
  bool unreadable_told_ = false;
  bool left_out_told_ = false;
  std::map<std::string, bool> namesakes_;  // gateways that have some: told
};

}  // namespace linegate::console
