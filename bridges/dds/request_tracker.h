// SPDX-License-Identifier: Apache-2.0
// The pending requests of a client: schedules repetitions, assembles answers from chunks, and
// accepts them only from the participant that publishes the line. No DDS except the types of the
// contract.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <linegate.h>

#include "bridges/dds/client.h"
#include "bridges/dds/line_publishers.h"
#include "bridges/request/request.h"
#include "stack/base/time.h"

namespace linegate::dds {

struct Request {
  Target target;
  request::Request request;
  Duration timeout{};           // of the gateway, 0 = none
  std::vector<std::byte> data;  // of the request
  std::uint64_t id = 0;
  std::uint64_t layout_id = 0;
  Instant deadline{};  // time at which the request times out
  // The gateway must not carry it out twice, nor after the deadline: see RequestTracker.
  bool once = false;
  // The number of the participant of the client that sends it: gateways distinguish participants,
  // so another one would have it carried out again.
  std::uint64_t participant = 0;
};

// Of a request that is to be carried out once (Request::once): so long DDS may repeat a sample that
// the gateway did not acknowledge. The gateway's time-out ends that much before the deadline.
inline constexpr Duration kSampleLifetime = std::chrono::milliseconds(200);

// A gateway keeps its last 256 answers to a client for each line, and so recognises a repeated
// request. A request that writes is repeated only while the gateway certainly has its answer: while
// fewer than kMostOthers of its line were pending when it was sent first, or were sent after it;
// cancelled ones have answers, too. For Request::once: while fewer than kMostSince further ones
// were sent to that line, of which at most kMostUnderWay are unanswered. Then it waits for an
// answer until its deadline.
class RequestTracker {
 public:
  static constexpr std::uint64_t kMostOthers = 192;
  static constexpr std::uint64_t kMostSince = 128;
  static constexpr std::size_t kMostUnderWay = 64;  // requests to a line, for the owner to respect

  // retry: pause before the first repetition. It doubles with each repetition, up to 16 times, and
  // for requests in several chunks up to 256 times, because each repetition sends all chunks.
  explicit RequestTracker(Duration retry) : retry_(retry) {}

  void add(Request request, Instant now);
  bool empty() const { return waiting_.empty(); }

  struct Done {
    Target target;
    CommandResult result;
  };
  // Processes a reply to any client, of that participant. Returns the answer once it is complete. A
  // reply of a participant that does not publish the line is counted and ignored; while that is not
  // known yet, the reply is ignored and requested again.
  std::optional<Done> take(const v1::CommandReply& reply, const ParticipantPrefix& sender,
                           const LinePublishers& publishers, Instant now);
  // The host of a participant as it announced it; empty if it is unknown.
  using HostOf = std::function<std::string(const ParticipantPrefix&)>;
  // Ends a request for a line that several participants publish, with an error that names their
  // hosts and GUID prefixes.
  std::optional<Done> disputed(const LinePublishers& publishers, const HostOf& host_of);
  // Ends a pending request that cannot be sent, with Refusal::not_permitted and that text.
  Done refuse(std::uint64_t id, std::string text);
  // Ends a request without a result; no effect if it is not pending.
  void cancel(std::uint64_t id) { waiting_.erase(id); }
  // The participant that sends the request; 0: it is not pending.
  std::uint64_t participant_of(std::uint64_t id) const;
  bool has_requests_of(std::uint64_t participant) const;
  // Requests that another participant may send: those that were not sent yet, and those that only
  // read and have no part of their answers.
  void move(std::uint64_t from, std::uint64_t to);
  // Number of replies to pending requests that were ignored because of their sender.
  std::uint64_t foreign() const { return foreign_; }

  // Returns the next request to be sent (again) now, or nullptr. It is sent completely, or, if
  // reply_offset() > 0, only its head, to fetch the rest of its answer. Valid until the next call.
  const Request* due(Instant now);
  // The time-out for the gateway if the request is sent now; 0 = none.
  static Duration gateway_timeout(const Request& request, Instant now);
  std::uint32_t reply_offset(std::uint64_t id) const;
  std::optional<Done> expired(Instant now);
  Instant next_wake() const;

 private:
  struct Waiting {
    Request request;
    CommandResult result;       // the part received so far
    Instant send_at{};          // time of the next transmission
    unsigned sent = 0;          // number of transmissions
    std::uint64_t place = 0;    // among the requests to its line, by their first transmission
    std::uint64_t beside = 0;   // others of its line that were pending at that time
    std::size_t chunks = 0;     // received since it was last sent
    std::uint64_t foreign = 0;  // replies of other participants
  };
  Done finish(std::map<std::uint64_t, Waiting>::iterator waiting);
  Done fail(std::map<std::uint64_t, Waiting>::iterator waiting, line::Refusal refusal,
            std::string text);

  bool may_send(const Waiting& waiting, Instant now) const;
  // A repetition may have been refused because another start of the gateway received it, or one
  // whose plant has not that line, while the first transmission was carried out.
  static bool may_have_been_carried_out(const Waiting& waiting, const v1::CommandReply& reply);
  // Whether the reply of that participant is accepted.
  bool admit(Waiting& waiting, const ParticipantPrefix& sender, const LinePublishers& publishers,
             Instant now);

  Duration retry_;
  std::uint64_t foreign_ = 0;
  std::map<std::uint64_t, Waiting> waiting_;  // by id
  // Requests that were sent to each line, by gateway and line
  std::map<std::pair<std::string, std::string>, std::uint64_t> sent_;
};

}  // namespace linegate::dds
