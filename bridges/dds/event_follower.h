// SPDX-License-Identifier: Apache-2.0
// Brings the events of each line into order, each exactly once, and requests those that the reader
// missed from the journal of the gateway. No DDS: samples and replies go in, events and requests
// come out.
//
// An event is identified by line, stream and number. The journal has the events of a line in their
// order, also across restarts and streams, but an event only some time after its publication. So a
// line continues with samples while their numbers do, and with pages of the journal after a gap,
// until both meet. Numbers that neither has are reported as missing.
//
// Invariant: each event that the journal has after the first one of a line is passed on exactly
// once. So is each sample with a number, unless its stream is older than the line or ended before
// it. A sample without a stream or a number is passed on as it comes: it is no part of a sequence,
// and no gap is seen before or after it.
//
// Samples of a gateway without a journal wait until it has answered that it has none, at most.
//
// Streams have no order of their own. It is that of the journal, and of samples, which arrive in
// the order of their publication: a stream that has ended begins again if the gateway has it again,
// after its last number that was passed on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "bridges/dds/client.h"
#include "bridges/dds/values.h"
#include "bridges/request/journal.h"
#include "stack/base/time.h"

namespace linegate::dds {

struct FollowedEvent {
  Source source;
  ReceivedEvent event;
  std::string text;
  std::vector<Property> properties;
};

struct MissingEvents {
  std::string gateway;
  std::string line;
  std::uint64_t stream = 0;
  std::uint64_t first = 0;  // numbers, inclusive
  std::uint64_t last = 0;
};

struct NewEventStream {
  std::string gateway;
  std::string line;
  std::uint64_t before = 0;
  std::uint64_t now = 0;
  // The journal has no event of the stream before: it is another one, or there is none.
  bool lost = false;
};

class EventFollower {
 public:
  static constexpr std::size_t kMostLines = 4'096;  // further ones are not followed
  // Samples of a line that wait for those before them. Further ones are dropped: the journal has
  // them.
  static constexpr std::size_t kMostPending = 2'048;
  // The journal is asked again after these pauses while it does not have what is missing.
  static constexpr Duration kFirstPause = std::chrono::milliseconds(250);
  static constexpr Duration kLongestPause = std::chrono::seconds(30);
  // Events that the journal does not have after this time are missing.
  static constexpr Duration kPatience = std::chrono::seconds(5);
  // Time for the samples of events of which a state has the number.
  static constexpr Duration kGrace = std::chrono::seconds(1);

  // from_oldest: lines begin with the oldest event in the journal, instead of the first sample.
  explicit EventFollower(bool from_oldest) : from_oldest_(from_oldest) {}

  // The line begins after that event. Call it before anything else of the line.
  void begin_after(const std::string& gateway, const std::string& line,
                   request::EventPosition position);

  // --- in ---

  // A GatewayState or LineState; newest: the number of the newest event of the line.
  void receive_gateway(const std::string& gateway, std::uint64_t incarnation, std::uint64_t stream,
                       std::uint64_t newest, Instant now);
  void receive_line(const std::string& gateway, const std::string& line, std::uint64_t newest,
                    Instant now);
  void take(FollowedEvent event, Instant now);
  // The answer to the request of due().
  void receive_answer(const std::string& gateway, const std::string& line,
                      const CommandResult& result, Instant now);

  // --- out ---

  using Item = std::variant<FollowedEvent, MissingEvents, NewEventStream>;
  // In the order of their line. Returns false if there are none.
  bool pop(Item& item);

  struct Fetch {
    Target target;
    request::JournalRead read;
  };
  // A request to send now; receive_answer() is expected once for each.
  std::optional<Fetch> due(Instant now);
  // When due() has a request, unless something is taken before.
  Instant next_wake() const;

 private:
  // Samples of a stream that wait for those before them.
  struct Pending {
    std::uint64_t stream = 0;
    bool follows = false;  // a sample of the present stream came before the first one
    std::map<std::uint64_t, FollowedEvent> events;  // by number
  };
  struct Line {
    std::string gateway;
    std::string name;
    std::optional<request::EventPosition> position;  // of the last event that was passed on
    bool from_oldest = false;                        // without a position: of the journal
    bool unchecked = false;        // the journal was not read since the gateway started
    bool lost = false;             // the stream of the position is not in the journal
    bool sampled = false;          // a sample of the stream of the position came
    std::vector<Pending> pending;  // in the order of their first samples; none is empty
    std::size_t pending_count = 0;
    std::deque<request::EventPosition> past;  // the ends of streams, in their order
    std::deque<std::uint64_t> unnumbered;     // streams of which an event without a number was seen
    std::uint64_t newest = 0;
    bool asking = false;
    Instant ask_at = kNever;
    Instant missed_since = kNever;  // the journal did not have what is missing
    Duration pause = kFirstPause;
    request::JournalCursor cursor{};  // of the next page; 0: after `position`
  };
  struct Gateway {
    std::uint64_t incarnation = 0;
    std::uint64_t stream = 0;
  };
  using Key = std::pair<std::string, std::string>;

  Line* line(const std::string& gateway, const std::string& name);
  const Gateway& gateway_of(const Line& line) const;
  bool is_behind(const Line& line) const;
  bool is_passed(const Line& line, request::EventPosition at) const;
  static bool is_first_unnumbered(Line& line, std::uint64_t stream);
  void ask(Line& line, Instant at);
  void deliver(Line& line, FollowedEvent event);
  void deliver_pending(Line& line);
  void deliver_before(Line& line, std::uint64_t number);
  void deliver_all(Line& line);
  void enter_stream(Line& line, std::uint64_t stream, std::uint64_t before_first);
  void change_stream(Line& line, std::uint64_t stream, std::uint64_t before_first);
  void receive_page(Line& line, request::JournalPage page, Instant now);
  void receive_record(Line& line, request::JournalRecord record);
  void receive_refusal(Line& line, const CommandResult& result, Instant now);
  void wait_for_journal(Line& line, Instant now);
  void continue_without_journal(Line& line, Instant now);
  void give_up(Line& line, std::uint64_t before_first);

  const bool from_oldest_;
  std::map<Key, Line> lines_;
  std::map<std::string, Gateway> gateways_;
  std::deque<Item> items_;
};

}  // namespace linegate::dds
