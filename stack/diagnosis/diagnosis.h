// SPDX-License-Identifier: Apache-2.0
// The diagnosis of a line according to the IXXAT manual (chapters 7 and 8): one state of the
// network, event indications, lists of nodes, EMCY statistics. It observes events and the states of
// nodes and controls nothing.
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

// The present state of the line.
class Source {
 public:
  virtual ~Source() = default;
  // Fills in running, manages, own, manager, starts_nodes and scanning; the diagnosis adds the
  // rest.
  virtual NetworkFacts network() const = 0;
  // node: 1..127.
  virtual const manager::NodeState& node_seen(std::uint8_t node) const = 0;
};

struct Options {
  std::uint8_t own_node = 0;
  // Nodes of the configuration. If the dictionary has 1F81h, its bits 0 and 3 apply instead.
  NodeList assigned;
  NodeList mandatory;
  // Bits of global_events.h that end in the state fatal error
  std::uint16_t fatal_events = kFatalEvents;
};

class Diagnosis final : public EventListener {
 public:
  // dictionary and source must outlive this object. The constructor does not read them.
  Diagnosis(const Options& options, const od::Dictionary& dictionary, const Source& source);

  void emitted(const Event& event) override;
  // node 1..127: an EMCY of the node, and the state in its error control message.
  void emergency(std::uint8_t node, const emcy::Message& message);
  void heard(std::uint8_t node, nmt::State state, Instant now);
  // An NMT command was sent to a node, or to all with 0.
  void commanded(nmt::Command command, std::uint8_t node);
  // All nodes sleep.
  void fell_asleep() {
    changed_ = true;
    node_status_.fell_asleep();
  }
  // A scan of a node began, or of all with 0.
  void scan_begins(std::uint8_t node) { node_status_.scan_begins(node); }
  void scan_ends() { node_status_.scan_ends(); }
  // 1F82h was written for one node, or for all with 0.
  void requested(std::uint8_t node);
  // The state or presence of a node changed without an event.
  void states_changed() { changed_ = true; }
  // Does nothing if nothing has changed.
  void update(Instant now);
  // When a refused configuration becomes a fatal error: call update() then. kNever: none does.
  Instant next_wake() const { return refusal_counts_; }

  std::uint8_t network_state() const;  // see network_state.h
  std::uint16_t events() const { return events_; }
  std::uint8_t communication() const { return communication_.value(); }
  NodeLists lists() const;
  const CommunicationState& communication_state() const { return communication_; }
  const EmcyRecord& emcys() const { return emcys_; }
  const NodeStatus& node_status() const { return node_status_; }
  nmt::State own_state() const { return source_.network().own; }
  // Whether a node, 1..127, that was booted and commanded to start shows another state than
  // Operational.
  bool strayed(std::uint8_t node) const;
  // True once after the network has entered the state fatal error, which only the next
  // initialisation (begin()) ends.
  bool pop_failure() { return std::exchange(failed_, false); }
  bool failed() const { return failed_; }
  bool fatal() const { return state_.fatal(); }

 private:
  void begin();
  void fail();
  void note_refusal(std::uint8_t node, Instant now);
  void forget_refusal(std::uint8_t node);
  void forget_refusals();
  void look_at_refusals(Instant now);
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
  // The state that the last NMT command to the node requests, and its time; unknown: no request.
  struct Expectation {
    nmt::State state = nmt::State::unknown;
    Instant since{};
  };
  std::array<Expectation, can::kMaxNodeId + 1> expected_{};
  NodeList disobedient_;
  // When the refusal of a node that has not booted since becomes a fatal error, and the first of
  // these times.
  std::array<Instant, can::kMaxNodeId + 1> fatal_from_ = [] {
    std::array<Instant, can::kMaxNodeId + 1> out;
    out.fill(kNever);
    return out;
  }();
  Instant refusal_counts_ = kNever;
  Instant latest_{};  // stands in for reports without a time
  Instant began_{};
  Instant boot_time_ends_ = kNever;
  bool boot_time_over_ = false;
  bool changed_ = true;
  bool failed_ = false;
};

}  // namespace linegate::diagnosis
