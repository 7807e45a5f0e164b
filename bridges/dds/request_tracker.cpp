// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/request_tracker.h"

#include <algorithm>
#include <string>
#include <utility>

#include "bridges/dds/bytes.h"
#include "bridges/dds/reply_codec.h"
#include "stack/base/assert.h"

namespace linegate::dds {
namespace {

constexpr unsigned kMostSlowing = 4;      // 2^4 times the first pause
constexpr unsigned kMostSlowingLong = 8;  // for requests with many chunks to repeat
constexpr Duration kShortest = std::chrono::milliseconds(1);  // time-out for a gateway
constexpr unsigned kMostRestarts = 3;  // of a request of which a chunk was lost
constexpr const char* kMayBeDone = ". The request was sent before, and may have been carried out";
constexpr std::size_t kMostReplyBytes = 64U << 20U;  // largest reply that a client accepts

bool lost_a_chunk(const v1::CommandReply& reply, const Request& request) {
  return request.data.size() > kChunkBytes && reply.domain() == v1::RESULT_REFUSED &&
         reply.code() == v1::REFUSAL_BAD_REQUEST;
}

}  // namespace

void RequestTracker::add(Request request, Instant now) {
  const std::uint64_t id = request.id;
  Waiting& waiting = waiting_[id];
  waiting.result.id = id;
  waiting.result.reply.tag = id;
  waiting.request = std::move(request);
  waiting.send_at = now;
}

bool RequestTracker::admit(Waiting& waiting, const ParticipantPrefix& sender,
                           const LinePublishers& publishers, Instant now) {
  using Right = LinePublishers::Right;
  const Target& target = waiting.request.target;
  switch (publishers.right_of(target.gateway, target.line, sender, now)) {
    case Right::publisher:
      return true;
    case Right::unknown:  // the first state of the line arrives soon
      waiting.send_at = earlier(waiting.send_at, now + retry_ / 4);
      return false;
    case Right::contested:
      waiting.send_at = earlier(waiting.send_at, now + retry_);
      return false;
    case Right::disputed:
    case Right::foreign:
      break;
  }
  ++waiting.foreign;
  ++foreign_;
  return false;
}

std::optional<RequestTracker::Done> RequestTracker::take(const v1::CommandReply& reply,
                                                         const ParticipantPrefix& sender,
                                                         const LinePublishers& publishers,
                                                         Instant now) {
  const auto found = waiting_.find(reply.id());
  if (found == waiting_.end())
    return std::nullopt;
  Waiting& waiting = found->second;
  const Request& request = waiting.request;
  if (reply.gateway() != request.target.gateway.c_str() ||
      reply.line() != request.target.line.c_str() || reply.domain() > v1::RESULT_REFUSED) {
    return std::nullopt;
  }
  if (!admit(waiting, sender, publishers, now))
    return std::nullopt;
  if (may_have_been_carried_out(waiting, reply)) {
    return fail(found, line::Refusal::timed_out,
                "the gateway was started again, or has the line no more: " +
                    reply.text().to_string() + kMayBeDone);
  }
  if (lost_a_chunk(reply, request) && waiting.sent <= kMostRestarts) {
    waiting.send_at = earlier(waiting.send_at, now + retry_);
    return std::nullopt;
  }
  auto& data = waiting.result.bytes;
  if (reply.offset() != data.size() || data.size() + reply.data().size() > kMostReplyBytes) {
    return std::nullopt;  // a chunk is missing: the rest is requested again when due
  }
  append_bytes(reply.data(), data);
  waiting.result.reply.error = {static_cast<Domain>(reply.domain()), reply.code()};
  waiting.result.text = reply.text().to_string();
  if (reply.last()) {
    line::Reply& whole = waiting.result.reply;
    auto read = decode_reply(request.request, whole.error, data);
    whole.data = read ? *std::move(read) : line::ReplyData{data};
    return finish(found);
  }
  if (++waiting.chunks >= kChunksPerReply)
    waiting.send_at = now;
  return std::nullopt;
}

bool RequestTracker::may_have_been_carried_out(const Waiting& waiting,
                                               const v1::CommandReply& reply) {
  const bool other_start =
      reply.domain() == v1::RESULT_REFUSED &&
      (reply.code() == v1::REFUSAL_WRONG_INCARNATION || reply.code() == v1::REFUSAL_UNKNOWN_LINE);
  // Without an incarnation the line was perhaps never there.
  return other_start && waiting.sent > 1 && waiting.request.target.incarnation != 0 &&
         !request::only_reads(request::kind(waiting.request.request));
}

RequestTracker::Done RequestTracker::finish(std::map<std::uint64_t, Waiting>::iterator waiting) {
  Done done{std::move(waiting->second.request.target), std::move(waiting->second.result)};
  waiting_.erase(waiting);
  return done;
}

std::uint64_t RequestTracker::participant_of(std::uint64_t id) const {
  const auto found = waiting_.find(id);
  return found == waiting_.end() ? 0 : found->second.request.participant;
}

bool RequestTracker::has_requests_of(std::uint64_t participant) const {
  return std::ranges::any_of(
      waiting_, [&](const auto& entry) { return entry.second.request.participant == participant; });
}

void RequestTracker::move(std::uint64_t from, std::uint64_t to) {
  for (auto& [id, waiting] : waiting_) {
    Request& request = waiting.request;
    const bool may_repeat =
        waiting.sent == 0 ||
        (request::only_reads(request::kind(request.request)) && waiting.result.bytes.empty());
    if (request.participant == from && may_repeat)
      request.participant = to;
  }
}

const Request* RequestTracker::due(Instant now) {
  for (auto& [id, waiting] : waiting_) {
    if (waiting.send_at > now)
      continue;
    if (!may_send(waiting, now)) {
      waiting.send_at = kNever;
      continue;
    }
    if (waiting.sent == 0) {
      const Target& target = waiting.request.target;
      waiting.place = ++sent_[{target.gateway, target.line}];
      waiting.beside =
          static_cast<std::uint64_t>(std::ranges::count_if(waiting_, [&](const auto& other) {
            return other.second.sent != 0 &&
                   other.second.request.target.gateway == target.gateway &&
                   other.second.request.target.line == target.line;
          }));
    }
    const bool is_long = waiting.request.data.size() > kChunkBytes;
    const unsigned slowing = std::min(waiting.sent, is_long ? kMostSlowingLong : kMostSlowing);
    const bool answering = !waiting.result.bytes.empty();
    waiting.send_at = now + retry_ * (answering ? 1 : 1LL << slowing);
    waiting.chunks = 0;
    ++waiting.sent;
    return &waiting.request;
  }
  return nullptr;
}

// The rest of an answer may be requested at any time: the gateway then carries out nothing.
bool RequestTracker::may_send(const Waiting& waiting, Instant now) const {
  const Request& request = waiting.request;
  if (!waiting.result.bytes.empty())
    return true;
  if (request.once && request.deadline - now <= kSampleLifetime)
    return false;
  const auto sent = sent_.find({request.target.gateway, request.target.line});
  if (waiting.sent == 0 || sent == sent_.end())
    return true;
  const std::uint64_t since = sent->second - waiting.place;
  if (request.once)
    return since < kMostSince;
  return request::only_reads(request::kind(request.request)) ||
         since + waiting.beside < kMostOthers;
}

Duration RequestTracker::gateway_timeout(const Request& request, Instant now) {
  if (!request.once)
    return request.timeout;
  const Duration left = std::max(request.deadline - now - kSampleLifetime, kShortest);
  return request.timeout > Duration::zero() ? std::min(request.timeout, left) : left;
}

std::uint32_t RequestTracker::reply_offset(std::uint64_t id) const {
  const auto found = waiting_.find(id);
  if (found == waiting_.end())
    return 0;
  return static_cast<std::uint32_t>(found->second.result.bytes.size());
}

std::optional<RequestTracker::Done> RequestTracker::expired(Instant now) {
  const auto found = std::find_if(waiting_.begin(), waiting_.end(), [&](const auto& entry) {
    return entry.second.request.deadline <= now;
  });
  if (found == waiting_.end())
    return std::nullopt;
  const std::uint64_t foreign = found->second.foreign;
  const bool may_be_done =
      found->second.sent != 0 && !request::only_reads(request::kind(found->second.request.request));
  Done done =
      fail(found, line::Refusal::timed_out,
           std::string("no answer from the gateway in time") + (may_be_done ? kMayBeDone : ""));
  if (foreign != 0) {
    done.result.text += "; " + std::to_string(foreign) +
                        " replies of participants that do not publish its state were ignored";
  }
  return done;
}

std::optional<RequestTracker::Done> RequestTracker::disputed(const LinePublishers& publishers,
                                                             const HostOf& host_of) {
  const auto found = std::ranges::find_if(waiting_, [&](const auto& entry) {
    const Target& target = entry.second.request.target;
    return publishers.disputed(target.gateway, target.line);
  });
  if (found == waiting_.end())
    return std::nullopt;
  const Target& target = found->second.request.target;
  std::string text = "several DDS participants publish ";
  text += target.line.empty() ? "gateway " + target.gateway
                              : "line " + target.gateway + "/" + target.line;
  text += ", so no answer is trustworthy:";
  std::string_view separator = " ";
  for (const ParticipantPrefix& publisher : publishers.publishers(target.gateway, target.line)) {
    const std::string host = host_of(publisher);
    text += std::string(std::exchange(separator, ", ")) + to_string(publisher) + " at " +
            (host.empty() ? "an unknown host" : host);
  }
  text += "; end all but one, or give each gateway its own name";
  const bool was_sent = found->second.sent != 0;
  if (was_sent)
    text += kMayBeDone;
  return fail(found, was_sent ? line::Refusal::timed_out : line::Refusal::not_permitted,
              std::move(text));
}

RequestTracker::Done RequestTracker::refuse(std::uint64_t id, std::string text) {
  const auto found = waiting_.find(id);
  LINEGATE_ASSERT(found != waiting_.end(), "only a pending request is refused");
  return fail(found, line::Refusal::not_permitted, std::move(text));
}

RequestTracker::Done RequestTracker::fail(std::map<std::uint64_t, Waiting>::iterator waiting,
                                          line::Refusal refusal, std::string text) {
  Done done = finish(waiting);
  done.result.reply.error = line::to_error(refusal);
  done.result.reply.data = {};
  done.result.bytes.clear();
  done.result.text = std::move(text);
  return done;
}

Instant RequestTracker::next_wake() const {
  Instant next = kNever;
  for (const auto& [id, waiting] : waiting_) {
    next = earlier(next, earlier(waiting.send_at, waiting.request.deadline));
  }
  return next;
}

}  // namespace linegate::dds
