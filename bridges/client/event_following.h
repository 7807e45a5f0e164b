// SPDX-License-Identifier: Apache-2.0
// The way of an application through the events of all lines: from now, from the oldest one, or from
// where it left off.
//
// Invariant: each event that the journal has after the position is passed on exactly once, in the
// order of its line, and a new one that begins at position() goes on with the next event.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "bridges/client/client.h"
#include "bridges/client/link.h"
#include "bridges/dds/event_follower.h"

namespace linegate::client {

// The newest event numbers of all lines, for one that follows from now on.
class NewestEvents {
 public:
  void note_gateway(const dds::Source& source, const dds::GatewayInfo& info);
  void note_line(const dds::Source& source, std::uint64_t newest);
  void note_event(const dds::Source& source, const dds::ReceivedEvent& event);

  struct Gateway {
    std::uint64_t incarnation = 0;
    std::uint64_t stream = 0;
  };
  std::map<std::string, Gateway> gateways;
  std::map<std::pair<std::string, std::string>, std::uint64_t> lines;  // also of the gateways: ""
};

// As the API has it, with an empty name for kinds that are unknown to this version.
Event event_of(const dds::Source& source, const dds::ReceivedEvent& event, std::string_view text);

class EventFollowing {
 public:
  using Positions = std::map<std::pair<std::string, std::string>, request::EventPosition>;
  // Of a text of position(); nothing if it is none.
  static std::optional<Positions> parse(std::string_view text);

  // after: the position of each line; other lines begin with their oldest event. Nothing: all
  // begin with the first event that happens from now on.
  explicit EventFollowing(std::optional<Positions> after);

  // What was received before this one was made.
  void receive(const NewestEvents& newest, Instant now);
  void receive_gateway(const dds::Source& source, const dds::GatewayInfo& info, Instant now);
  void receive_line(const dds::Source& source, std::uint64_t newest, Instant now);
  void take(dds::FollowedEvent event, Instant now);
  // Returns whether the answer is to a request of this one.
  bool receive_answer(const dds::CommandResult& result, Instant now);

  // Requests what is missing from the journals.
  void ask(Link& link);
  Instant next_wake() const { return follower_.next_wake(); }
  // The next event, in the order of its line. Returns false if there is none.
  bool pop(Event& event);

  // The application has that event.
  void pass(const Event& event);
  std::string position() const;

 private:
  using Key = std::pair<std::string, std::string>;
  struct Gap {
    std::uint64_t missed = 0;
    bool journal_lost = false;
  };
  void begin(const Key& key);

  const bool from_now_;
  dds::EventFollower follower_;
  Positions passed_;
  std::map<Key, Gap> gaps_;                        // before the next event
  std::map<std::uint64_t, dds::Target> requests_;  // by id
  // From now: what the states had at first, and the lines that have begun.
  std::map<std::string, std::uint64_t> streams_;
  std::map<Key, std::uint64_t> newest_;
  std::set<Key> begun_;
};

}  // namespace linegate::client
