// SPDX-License-Identifier: Apache-2.0
// What a line can be diagnosed by, as its manager's applications know it from the IXXAT manual
// (chapters 7 and 8): one state of the whole, what has happened, lists of nodes, EMCY statistics.
// It hears of events and looks at the states that the manager keeps; it acts on nothing.
#pragma once

#include <array>
#include <cstdint>
#include <utility>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/diagnosis/emcy_record.h"
#include "stack/diagnosis/global_events.h"
#include "stack/diagnosis/network_state.h"
#include "stack/diagnosis/node_list.h"
#include "stack/diagnosis/node_status.h"
#include "stack/manager/state.h"
#include "stack/nmt/state.h"
#include "stack/od/dictionary.h"

namespace linegate::diagnosis {

// What the line says of the moment.
class Source {
 public:
  virtual ~Source() = default;
  // running, manages, own, manager, starts_nodes and scanning; the rest is the diagnosis' own.
  virtual NetworkFacts network() const = 0;
  // node: 1..127.
  virtual const manager::NodeState& node_seen(std::uint8_t node) const = 0;
};

struct Options {
  std::uint8_t own_node = 0;
  // Nodes of the configuration. Where the dictionary has 1F81h its bits 0 and 3 count.
  NodeList assigned;
  NodeList mandatory;
  std::uint16_t fatal_events = kFatalEvents;  // of global_events.h
};

class Diagnosis final : public EventListener {
 public:
  // dictionary and source must outlive it. Nothing is read of them in here.
  Diagnosis(const Options& options, const od::Dictionary& dictionary, const Source& source);

  void told(const Event& event) override;
  // Of a node, 1..127: an EMCY, and the state that its error control message shows.
  void emergency(std::uint8_t node, const emcy::Message& message);
  void heard(std::uint8_t node, nmt::State state, Instant now);
  // An NMT command was sent to a node, or to all with 0.
  void commanded(nmt::Command command, std::uint8_t node);
  // A node is being scanned, or all with 0.
  void scan_begins(std::uint8_t node) { node_status_.scan_begins(node); }
  void scan_ends() { node_status_.scan_ends(); }
  // 1F82h was written: of one node, or of all with 0.
  void requested(std::uint8_t node);
  // The state or presence of a node changed without an event.
  void states_changed() { changed_ = true; }
  // Does nothing as long as nothing has changed.
  void update(Instant now);

  std::uint8_t network_state() const;  // see network_state.h
  std::uint16_t events() const { return events_; }
  std::uint8_t communication() const { return communication_.value(); }
  NodeLists lists() const;
  const CommunicationState& communication_state() const { return communication_; }
  const EmcyRecord& emcys() const { return emcys_; }
  const NodeStatus& node_status() const { return node_status_; }
  nmt::State own_state() const { return source_.network().own; }
  // A node, 1..127, that was booted and told to start shows another state than Operational.
  bool strayed(std::uint8_t node) const;
  // True once when the network has come into the state fatal error: what begin() of the network
  // ends, and nothing else.
  bool take_failure() { return std::exchange(failed_, false); }
  bool failed() const { return failed_; }
  bool fatal() const { return state_.fatal(); }

 private:
  void begin();
  bool mandatory(std::uint8_t node) const;
  bool assigned_to_master(std::uint8_t node) const;
  NodeList monitored() const;
  bool wrong(std::uint8_t node, bool assigned) const;
  NetworkFacts facts(const NodeLists& lists) const;
  bool first_boot_runs() const;
  void look_at_boot_time(Instant now);

  Options options_;
  const od::Dictionary& dictionary_;
  const Source& source_;
  NetworkState state_;
  std::uint16_t events_ = 0;
  CommunicationState communication_;
  EmcyRecord emcys_;
  NodeStatus node_status_;
  NodeLists last_lists_;
  // The state that the last NMT command asks of a node, and since when; unknown: none.
  struct Expectation {
    nmt::State state = nmt::State::unknown;
    Instant since{};
  };
  std::array<Expectation, can::kMaxNodeId + 1> expected_{};
  NodeList disobedient_;
  Instant latest_{};  // what is told without a time happens now
  Instant began_{};
  Instant boot_time_ends_ = kNever;
  bool boot_time_over_ = false;
  bool changed_ = true;
  bool failed_ = false;
};

}  // namespace linegate::diagnosis
