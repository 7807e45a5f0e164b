// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/guard.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <utility>

#include "bridges/dds/guard/handshake.h"
#include "bridges/dds/guard/protection.h"

namespace linegate::dds::guard {
namespace {

constexpr std::size_t kPrefixAt = 8;          // offset in the RTPS header
constexpr std::size_t kInfoSourcePrefix = 8;  // offset in INFO_SRC
constexpr std::size_t kStatistics = 56;       // octets of the statistics submessage of Fast DDS
constexpr std::uint8_t kBuiltin = 0xC0;       // bits of an entity kind, RTPS 2.3 9.3.1.2

Prefix prefix_at(Octets octets, std::size_t at) {
  Prefix out{};
  std::copy_n(octets.begin() + static_cast<std::ptrdiff_t>(at), out.size(), out.begin());
  return out;
}

// The octets that all Fast DDS participants of a process have in common
// (GUID_t::is_on_same_process_as): vendor, host, process. Never 0.
std::uint64_t process_of(const Prefix& prefix) {
  std::uint64_t out = 0;
  std::memcpy(&out, prefix.data(), sizeof(out));
  return out == 0 ? 1 : out;
}

bool is_builtin(const Guid& guid) {
  return (guid[15] & kBuiltin) == kBuiltin;
}

// RTPS 2.3 9.4.5.11.
SampleTime sent_at(const Submessage& info_ts) {
  const Wire& body = info_ts.body;
  return (info_ts.flags & kInvalidate) != 0
             ? 0
             : static_cast<SampleTime>(std::uint64_t{body.u32(0)} << 32U | body.u32(4));
}

bool carries_parameters(std::uint32_t writer) {
  switch (writer & ~entity::kSecure) {
    case entity::kTopics & ~entity::kSecure:
    case entity::kPublications & ~entity::kSecure:
    case entity::kSubscriptions & ~entity::kSecure:
    case entity::kParticipants & ~entity::kSecure:
    case 0x000101C2:  // FF0101C2h, SPDP after authentication
      return true;
    default:
      return false;
  }
}

// A reader of Fast DDS 2.9.1 keeps one highest number for all writers with the same persistence
// GUID. When one of these writers ends, its samples that wait for an earlier number are then read
// instead of removed, and the next sample of their instance aborts the process
// (DataReaderInstance.hpp:105).
bool shares_numbers(const Announcement& writer) {
  return writer.persistence && *writer.persistence != Guid{} &&
         writer.persistence != writer.endpoint;
}

// The readers of these writers are stateless: sequence numbers have no effect, and participants
// must be discovered even if the table is full.
bool is_stateless(std::uint32_t writer) {
  return writer == entity::kParticipants || writer == entity::kStateless;
}

}  // namespace

struct Guard::Datagram {
  Octets octets;
  std::int64_t now = 0;
  Address from{};
  Prefix source{};       // prefix in the last INFO_SRC, or in the header
  std::size_t size = 0;  // octets to pass on
  Protection protection;
  SampleTime sent = 0;  // timestamp of the last INFO_TS; 0: invalid
  // These belong to the submessage in progress:
  bool left_out = false;
  std::optional<SampleTime> time;  // timestamp of a sample
  Wire announced;                  // parameter list of an announcement
  Announcer announcer = Announcer::other;
  Wire inline_qos;  // parameter list of fragments
};

Guard::Verdict Guard::judge(Octets octets, std::int64_t now, const Address& from, PassedOn* out) {
  received_.fetch_add(1, std::memory_order_relaxed);
  Verdict verdict{Reason::header, 0};
  if (has_header(octets)) {
    Datagram datagram{octets,        now,
                      from,          prefix_at(octets, kPrefixAt),
                      octets.size(), Protection(protection_required_)};
    verdict.reason = walk(datagram, out);
    verdict.size = datagram.size;
  }
  if (verdict.reason != Reason::none)
    count(verdict.reason);
  return verdict;
}

void Guard::set_process_of(const Prefix& it) {
  process_ = process_of(it);
}

void Guard::set_utc(SampleTime (*utc)()) {
  utc_ = utc;
}

void Guard::watch_certificates(std::function<bool(Octets pem)> accepts) {
  accepts_certificate_ = std::move(accepts);
}

void Guard::count(Reason reason) {
  dropped_[static_cast<std::size_t>(reason)].fetch_add(1, std::memory_order_relaxed);
}

void Guard::sent(Octets datagram) {
  if (!has_header(datagram))
    return;
  Prefix to{};
  Submessage submessage;
  for (std::size_t at = kHeader; at < datagram.size(); at += 4 + submessage.body.size()) {
    if (split(datagram, at, submessage) != Reason::none)
      return;
    Content content;
    if (submessage.kind == Kind::info_dst && check(submessage, content) == Reason::none)
      to = prefix_at(submessage.body.octets(), 0);
    else if (submessage.kind == Kind::acknack && check(submessage, content) == Reason::none)
      writers_.find(make_guid(to, content.writer),
                    [&](WriterNumbers& numbers) { numbers.kept.acknowledged(content.first); });
  }
}

Reason Guard::walk(Datagram& datagram, PassedOn* out) {
  if (out != nullptr)
    out->begin(datagram.octets);
  std::size_t at = kHeader;
  while (at < datagram.octets.size()) {
    Submessage submessage;
    datagram.left_out = false;
    datagram.time.reset();
    datagram.announced = {};
    datagram.inline_qos = {};
    Reason reason = split(datagram.octets, at, submessage);
    if (reason == Reason::none)
      reason = judge_submessage(datagram, submessage);
    if (reason != Reason::none)
      return reason;
    if (datagram.size <= at)  // the rest is not passed on
      break;
    if (out != nullptr && !datagram.left_out)
      pass_on(datagram, submessage, *out);
    at += 4 + submessage.body.size();
  }
  return datagram.protection.end();
}

void Guard::pass_on(const Datagram& datagram, const Submessage& submessage, PassedOn& out) const {
  if (submessage.kind == Kind::gap)
    return out.add_gap(submessage);
  const Octets octets = datagram.octets.subspan(submessage.at, 4 + submessage.body.size());
  if (datagram.time)
    out.stamp(*datagram.time);
  out.add(submessage, octets);
  const auto copy_of = [&](const Wire& part) {
    return out.last().subspan(static_cast<std::size_t>(part.octets().data() - octets.data()),
                              part.size());
  };
  if (datagram.announced.size() != 0)
    pad_types(copy_of(datagram.announced), datagram.announced.little());
  if (datagram.announced.size() != 0 && group_)
    confine_locators(copy_of(datagram.announced), datagram.announced.little(), datagram.announcer,
                     *group_);
  if (datagram.inline_qos.size() != 0)
    pad_key_hash(copy_of(datagram.inline_qos), datagram.inline_qos.little());
}

Reason Guard::judge_submessage(Datagram& datagram, const Submessage& submessage) {
  Content content;
  Reason reason = check(submessage, content);
  if (reason == Reason::none)
    reason = datagram.protection.next(submessage, content);
  if (reason != Reason::none)
    return reason;
  if (is_own(datagram, submessage, content)) {
    datagram.left_out = true;
    return Reason::none;
  }
  switch (submessage.kind) {
    case Kind::info_ts:
      datagram.sent = sent_at(submessage);
      return Reason::none;
    case Kind::info_src:
      datagram.source = prefix_at(submessage.body.octets(), kInfoSourcePrefix);
      return Reason::none;
    case Kind::acknack:
    case Kind::nack_frag:
      return judge_acknowledgement(datagram, content);
    case Kind::heartbeat:
      return judge_numbers(datagram, content);
    case Kind::gap:
      reason = judge_numbers(datagram, content);
      return reason == Reason::none ? judge_gap(datagram, submessage, content) : reason;
    case Kind::data_frag:
      reason = judge_numbers(datagram, content);
      return reason == Reason::none ? judge_fragments(datagram, content) : reason;
    case Kind::data:
      leave_out_end(datagram, submessage, content);
      reason = judge_numbers(datagram, content);
      return reason == Reason::none ? judge_payload(datagram, content) : reason;
    case Kind::statistics:
      return judge_statistics(datagram, submessage);
    default:
      return Reason::none;
  }
}

// Fast DDS 2.9.1 asserts that the statistics submessage is the last one and has the right length.
// It is never passed on, because it is not used. Other vendors may use kind 80h differently.
Reason Guard::judge_statistics(Datagram& datagram, const Submessage& submessage) const {
  if (datagram.octets[6] != 0x01 || datagram.octets[7] != 0x0F)
    return Reason::none;
  const std::size_t end = submessage.at + 4 + submessage.body.size();
  if (end != datagram.octets.size() || submessage.body.size() != kStatistics)
    return Reason::statistics;
  datagram.size = std::min(datagram.size, submessage.at);
  return Reason::none;
}

// Whether the announced end of a participant refers to its sender.
bool Guard::names_itself(const Datagram& datagram, const Content& content) {
  if (content.instance.prefix)
    return content.instance.is(datagram.source);
  Announcement announcement;
  return check_parameter_list(content.payload, announcement) &&
         announcement.owner.is(datagram.source);
}

// If a thread of Fast DDS 2.9.1 removes a participant while the timer of its lease fires in another
// thread, an assertion aborts the process (PDP.cpp:1140). So the end of a participant is dropped,
// together with the rest of the datagram, and the participant is removed when its lease expires;
// the ends of its endpoints were announced before. An infinite lease has no timer that could fire.
void Guard::leave_out_end(Datagram& datagram, const Submessage& submessage,
                          const Content& content) const {
  if (content.writer == entity::kParticipants && content.ends_instance && discovered_.simple() &&
      !(names_itself(datagram, content) && discovered_.is_endless(datagram.source)))
    datagram.size = std::min(datagram.size, submessage.at);
}

Reason Guard::judge_numbers(Datagram& datagram, const Content& content) {
  if (is_stateless(content.writer))
    return Reason::none;
  const Guid writer = make_guid(datagram.source, content.writer);
  const Number most = entity::announces_endpoints(content.writer) ? WriterNumbers::kFirstOfSedp
                                                                  : WriterNumbers::kFirst;
  return writers_.with(
      writer, datagram.now, [&] { return is_known(writer); },
      [&](WriterNumbers& numbers, bool) {
        if (!numbers.advance(content.highest, datagram.now, most))
          return Reason::rate;
        if (content.is_sample)
          datagram.time = numbers.times.of(content.highest, datagram.sent, utc_);
        return Reason::none;
      },
      Reason::writers);
}

// The library ignores a GAP of a writer that it has not discovered, so such a GAP takes no tokens
// of other writers.
Reason Guard::judge_gap(Datagram& datagram, const Submessage& submessage, const Content& content) {
  if (is_stateless(content.writer) || content.listed == 0)
    return Reason::none;
  const Guid writer = make_guid(datagram.source, content.writer);
  const bool found = is_known(writer);
  bool kept = false;
  bool ok = false;
  writers_.find(writer, [&](WriterNumbers& numbers) {
    kept = numbers.kept.keep(content.first, content.listed, found, kept_);
    ok = kept && numbers.walk(content.listed, datagram.now);
  });
  if (!kept) {
    leave_out(datagram, submessage);
    return Reason::none;
  }
  return ok && (!found || take_walk(datagram, content)) ? Reason::none : Reason::rate;
}

// The GAP of a writer that was discovered takes tokens, and is expected to take its time.
bool Guard::take_walk(const Datagram& datagram, const Content& content) {
  const bool announces = entity::announces_endpoints(content.writer);
  if (content.listed <= (announces ? kFewAnnouncements : kFewNumbers))
    return true;
  const std::lock_guard lock(walked_mutex_);
  if (!(announces ? walked_announcements_.take(content.listed, datagram.now)
                  : walked_.take(content.listed, datagram.now)))
    return false;
  calls_.expect(datagram.now, content.listed * kWalkTime);
  return true;
}

// The other submessages of the datagram are passed on.
void Guard::leave_out(Datagram& datagram, const Submessage& submessage) {
  datagram.left_out = true;
  if (submessage.open_end)
    datagram.size = std::min(datagram.size, submessage.at);
  count(Reason::gap);
}

// Announcements fit into one datagram; fragmented ones would bypass the checks. If a fragment has a
// key hash, the incomplete sample is added to its instance, and remains there when a GAP removes
// and frees it (StatefulReader::processGapMsg). Without key hash, the key is read when the sample
// is complete.
Reason Guard::judge_fragments(Datagram& datagram, const Content& content) {
  if (carries_parameters(content.writer))
    return Reason::discovery;
  datagram.inline_qos = content.inline_qos;
  const Guid writer = make_guid(datagram.source, content.writer);
  return fragmented_.with(
      writer, datagram.now, [&] { return is_known(writer); },
      [&](IncompleteSamples& samples, bool) {
        return samples.add(content.highest, content.fragments, datagram.now) ? Reason::none
                                                                             : Reason::fragment;
      },
      Reason::writers);
}

// The key of an endpoint's announcement is its GUID: sent as key hash (Fast DDS), or alone in the
// payload (Cyclone DDS).
void Guard::note_end(const Datagram& datagram, const Content& content) {
  if (content.writer != entity::kPublications && content.writer != entity::kSubscriptions)
    return;
  Announcement announcement;
  std::optional<Guid> endpoint = content.key;
  if (!endpoint && content.has_key && check_parameter_list(content.payload, announcement))
    endpoint = announcement.endpoint;
  if (endpoint &&
      (prefix_of(*endpoint) == datagram.source || discovered_.is_server(datagram.source)))
    discovered_.ends(*endpoint);
}

Reason Guard::judge_payload(Datagram& datagram, const Content& content) {
  if (content.ends_instance)
    note_end(datagram, content);
  if (!content.has_data)
    return Reason::none;
  if (content.writer == entity::kLiveliness)
    return check_liveliness_message(content.payload) ? Reason::none : Reason::discovery;
  if (content.writer == entity::kStateless)
    return judge_handshake(content);
  if (!carries_parameters(content.writer))
    return Reason::none;
  Announcement announcement;
  if (!check_parameter_list(content.payload, announcement))
    return Reason::discovery;
  datagram.announced = announcement.list;
  datagram.announcer =
      content.writer == entity::kSubscriptions ? Announcer::reader : Announcer::other;
  if (content.writer == entity::kParticipants)
    return judge_participant(datagram, announcement);
  if (content.writer != entity::kSubscriptions && content.writer != entity::kPublications)
    return Reason::none;
  if (shares_numbers(announcement))
    return Reason::discovery;
  const Reason reason = judge_endpoint(datagram, content, announcement);
  return reason == Reason::none && content.writer == entity::kSubscriptions
             ? judge_announcement(datagram, announcement)
             : reason;
}

Reason Guard::judge_handshake(const Content& content) const {
  if (!check_stateless_message(content.payload))
    return Reason::discovery;
  if (!accepts_certificate_)
    return Reason::none;
  const auto certificate = certificate_in(content.payload.octets());
  const bool accepted = certificate && (certificate->empty() || accepts_certificate_(*certificate));
  return accepted ? Reason::none : Reason::discovery;
}

// Fast DDS takes the announced participant from the payload, and the source from the header. Both
// must be equal, but if the source is a discovery server.
Reason Guard::judge_participant(const Datagram& datagram, const Announcement& announcement) {
  const Owner& owner = announcement.owner;
  const bool may_announce = owner.is(datagram.source) || (owner.prefix && !owner.several &&
                                                          discovered_.is_server(datagram.source));
  if (!may_announce)
    return Reason::discovery;
  return discovered_.admits(*owner.prefix, datagram.source, datagram.from, announcement.lease,
                            datagram.now)
             ? Reason::none
             : Reason::participants;
}

// An announced end takes no place. A participant may only announce its own endpoints, a discovery
// server those of one participant at a time.
Reason Guard::judge_endpoint(const Datagram& datagram, const Content& content,
                             const Announcement& announcement) {
  const Owner& owner = announcement.owner;
  const bool may_announce =
      owner.may_be(datagram.source) || (!owner.several && discovered_.is_server(datagram.source));
  if (!may_announce)
    return Reason::discovery;
  if (!announcement.endpoint || content.ends_instance)
    return Reason::none;
  return discovered_.admits(prefix_of(*announcement.endpoint), *announcement.endpoint, datagram.now)
             ? Reason::none
             : Reason::endpoints;
}

// The reliability of a reader cannot change (DDS 1.4 2.2.3.14). Fast DDS 2.9.1 has no timers for a
// reader that was best-effort, and aborts when it becomes reliable or acknowledges
// (ReaderProxy.cpp:464).
Reason Guard::judge_announcement(const Datagram& datagram, const Announcement& announcement) {
  if (!announcement.endpoint)
    return Reason::none;
  const Guid& reader = *announcement.endpoint;
  const Reliability announced =
      announcement.reliable ? Reliability::reliable : Reliability::best_effort;
  return readers_.with(
      reader, datagram.now, [&] { return is_known(reader); },
      [&](Reliability& known, bool fresh) {
        if (fresh)
          known = announced;
        return known == announced ? Reason::none : Reason::reliability;
      },
      Reason::reliability);
}

Reason Guard::judge_acknowledgement(const Datagram& datagram, const Content& content) {
  Reason reason = Reason::none;
  readers_.find(make_guid(datagram.source, content.reader), [&](Reliability known) {
    if (known == Reliability::best_effort)
      reason = Reason::reliability;
  });
  return reason;
}

bool Guard::is_own(const Datagram& datagram, const Submessage& submessage,
                   const Content& content) const {
  switch (submessage.kind) {
    case Kind::heartbeat:
    case Kind::heartbeat_frag:
    case Kind::gap:
    case Kind::data:
    case Kind::data_frag:
      return process_of(datagram.source) == process_.load(std::memory_order_relaxed) &&
             !is_stateless(content.writer);
    default:
      return false;
  }
}

bool Guard::is_known(const Guid& guid) const {
  return is_builtin(guid) ? discovered_.has_participant(prefix_of(guid))
                          : discovered_.has_endpoint(guid);
}

void Guard::participant_found(const Prefix& prefix, bool endless) {
  discovered_.participant_found(prefix, endless);
  const auto is_its = [&](const Guid& guid) {
    return is_builtin(guid) && prefix_of(guid) == prefix;
  };
  writers_.pin(is_its);
  fragmented_.pin(is_its);
}

void Guard::participant_lost(const Prefix& prefix) {
  discovered_.participant_lost(prefix);
  const auto is_its = [&](const Guid& guid) { return prefix_of(guid) == prefix; };
  writers_.release(is_its, [](WriterNumbers& numbers) { numbers.forget(); });
  readers_.forget(is_its);
  fragmented_.forget(is_its);
}

void Guard::endpoint_found(const Guid& endpoint) {
  discovered_.endpoint_found(endpoint);
  const auto is_it = [&](const Guid& guid) { return guid == endpoint; };
  writers_.pin(is_it);
  readers_.pin(is_it);
  fragmented_.pin(is_it);
}

void Guard::endpoint_lost(const Guid& endpoint) {
  discovered_.endpoint_lost(endpoint);
  const auto is_it = [&](const Guid& guid) { return guid == endpoint; };
  writers_.release(is_it, [](WriterNumbers& numbers) { numbers.forget(); });
  readers_.forget(is_it);
  fragmented_.forget(is_it);
}

Counters Guard::counters() const {
  Counters out;
  out.endpoints = discovered_.endpoints();
  out.received = received_.load(std::memory_order_relaxed);
  for (std::size_t i = 0; i < kReasons; ++i)
    out.dropped[i] = dropped_[i].load(std::memory_order_relaxed);
  return out;
}

}  // namespace linegate::dds::guard
