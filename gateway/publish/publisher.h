// SPDX-License-Identifier: Apache-2.0
// The thread that publishes: takes data from the lines and passes it to the edge.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "gateway/exchange/cell.h"
#include "gateway/exchange/ring.h"
#include "gateway/exchange/wakeup.h"
#include "gateway/journal/journal_thread.h"
#include "gateway/publish/client_directory.h"
#include "gateway/publish/data_edge.h"
#include "gateway/publish/deferred_image.h"
#include "gateway/publish/event_logger.h"
#include "gateway/publish/gateway_news.h"
#include "gateway/publish/image_sequence.h"
#include "gateway/publish/line_history.h"
#include "gateway/publish/named_samples.h"
#include "gateway/publish/pdo_updates.h"
#include "gateway/publish/value_sampler.h"
#include "gateway/runtime/clock.h"
#include "gateway/runtime/line_host.h"

namespace linegate::gateway {

class Publisher {
 public:
  // The edge and the journal must outlive the publisher, and the lines must exist while it runs.
  // journal: stores the events, and continues their numbers; nullptr = there is none.
  Publisher(DataEdge& edge, std::span<const std::unique_ptr<LineHost>> lines,
            JournalThread* journal = nullptr);
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  // Signal it after a push to a ring that the publisher reads.
  exchange::Wakeup& wakeup() { return wakeup_; }
  // Increases with each iteration and each sample, as a sign of progress.
  const exchange::Counter& rounds() const { return rounds_; }
  // The clients whose requests were received; the publisher names them in the texts of events.
  ClientDirectory& clients() { return clients_; }
  // Replies of the request receiver, as opposed to those of lines.
  exchange::Ring<line::Reply>& refusals() { return refusals_; }
  // Of the request receiver: published once the state of the gateway is known.
  exchange::Ring<GatewayNotice>& notices() { return notices_; }
  // Replies of the thread that reads the journal.
  exchange::Ring<line::Reply>& pages() { return pages_; }

  // Adds a counter of another thread to GatewayState; it must outlive the publisher. Call it before
  // start().
  void add_counter(std::string name, const exchange::Counter& counter) {
    added_counters_.emplace_back(std::move(name), &counter);
  }

  // Reports an event of the gateway itself. Called by the main thread only. Dropped if the ring is
  // full.
  void report(GatewayNews news);

  // May be started again after stop().
  void start();
  // Publishes all pending data, then ends. Call it when the lines have stopped, or let them run:
  // their data waits in the rings.
  void stop();
  // Call it while the publisher is stopped. Lines that remain keep their state; a new line with the
  // name of an earlier one continues its numbers.
  void set_lines(std::span<const std::unique_ptr<LineHost>> lines);

 private:
  struct Node {
    std::string name;
    bool known = false;
    line::NodeState last;
    Instant since{};
  };
  struct Line {
    Line(LineHost& line_host, LineHistory& line_history, NumberedLine* numbered_line);

    LineHost* host;
    LineHistory* history;
    NumberedLine* numbers;  // nullptr without a journal
    bool layouts_known = false;
    LineInfo info;
    std::vector<Property> properties;
    std::vector<Property> routes;  // routes in force, if the line routes
    std::vector<Property> output_groups;
    QueueDepths queues;  // since they were last published
    can_bridge::ControllerSetup controller;
    EventLogger logger;
    std::array<Node, 128> nodes;
    // By configured number: the node-ID of an own device on the bus, 0 = none or unknown
    std::array<std::uint8_t, 128> node_ids{};
    bool state_known = false;
    line::LineState last_state;
    Instant state_published{};
    std::vector<line::OutputState> output_states;  // as last published
    Instant outputs_published{};
    std::array<image::Layout, 2> layouts;  // by image::Direction
    PdoUpdates updates;
    std::array<image::Snapshot*, 2> fetched{};  // the last fetched snapshots
    std::array<ImageSequence, 2> sequences;
    std::array<DeferredImage, 2> deferred;
    std::array<std::unique_ptr<NamedSamples>, 2> named;  // nullptr: not published
    std::unique_ptr<ValueSampler> values;                // nullptr without a value history
    std::uint64_t values_file = 0;  // JournalThread::replaced_files() of the stored ones
  };

  void run();
  // Publishes what is due; returns when it must be called again.
  Instant step(Instant now);
  void refresh_clock(Instant now);
  void publish_layouts();
  void poll_replies(Line& line);
  bool publish_page();
  void publish_replies();
  void publish_events(Line& line, Instant now);
  Instant store_values(Line& line, Instant now);
  Instant end_values();
  void journalise(NumberedLine* numbers, const Event& event, std::string_view text);
  void publish_states(Line& line, Instant now);
  void publish_output_states(Line& line, Instant now);
  bool update_routes(Line& line) const;
  static void update_controller(Line& line, const can_bridge::ControllerSetup& controller);
  void publish_node(Line& line, const NodeStatus& status);
  void publish_new_layouts(Line& line);
  void publish_layout(Line& line, const image::Layout& layout);
  // Returns false if the edge does not accept it yet.
  bool publish_image(Line& line, image::Direction direction, Instant now);
  void add_direct_inputs(Line& line);
  void update_readers();
  Instant publish_named(Line& line, Instant now);
  image::Snapshot* fetch_image(Line& line, image::Direction direction);
  Instant publish_updates(Line& line, Instant now);
  // Returns true if more receptions are waiting.
  bool publish_receptions(Line& line);
  void report_failures(Instant now);
  Instant publish_gateway(Instant now);
  // Assigns the next number of the gateway to the event.
  void publish_gateway_event(Event& event, const std::string& text, Instant now);
  // The identity of the event numbers. Without a journal it comes with GatewayNews.
  std::uint64_t stream() const;
  void refresh_gateway();
  void publish_gateway_state(Instant now);

  // Of a line and the earlier lines with its name.
  struct Past {
    LineHistory history;
    NumberedLine* numbers = nullptr;
  };

  DataEdge& edge_;
  std::vector<std::pair<std::string, const exchange::Counter*>> added_counters_;
  JournalThread* journal_;
  NumberedLine* gateway_numbers_ = nullptr;
  JournalEntry entry_;
  std::uint64_t stream_published_ = 0;
  std::vector<std::unique_ptr<ValueSampler>> ending_;  // of lines that have ended
  std::map<std::string, Past, std::less<>> past_;      // of all present and earlier lines
  std::vector<std::unique_ptr<Line>> lines_;
  // Names of the lines by routing interface
  std::vector<std::pair<std::uint8_t, std::string>> interfaces_;
  exchange::Wakeup wakeup_;
  exchange::Flag stop_;
  exchange::Flag readers_changed_;  // of named topics
  exchange::Counter rounds_;
  exchange::Ring<line::Reply> refusals_{1024};
  exchange::Ring<line::Reply> pages_{16};
  exchange::Ring<GatewayNews> news_{64};
  exchange::Ring<GatewayNotice> notices_{256};
  ClientDirectory clients_;
  GatewayInfo gateway_;
  bool gateway_known_ = false;
  Instant gateway_due_{};
  std::size_t participants_seen_ = 0;
  EventLogger gateway_logger_;
  std::vector<line::Reply> replies_;  // of one line, published after its events
  WallClock clock_;
  Instant clock_due_{};
  std::uint64_t failures_reported_ = 0;
  Instant failures_due_{};
  std::thread thread_;
};

}  // namespace linegate::gateway
