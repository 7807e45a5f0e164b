// SPDX-License-Identifier: Apache-2.0
// Checks each datagram before Fast DDS reads it. One guard serves all transports of a participant.
//
// A datagram that passes is well-formed RTPS 2.3, claims no length beyond its octets, and does not
// let the sequence numbers of a writer advance faster than samples can. This is not authentication:
// see deploy/SECURITY.md.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>

#include "bridges/dds/guard/announced_locators.h"
#include "bridges/dds/guard/call_watch.h"
#include "bridges/dds/guard/counters.h"
#include "bridges/dds/guard/discovered.h"
#include "bridges/dds/guard/guid_table.h"
#include "bridges/dds/guard/incomplete_samples.h"
#include "bridges/dds/guard/parameters.h"
#include "bridges/dds/guard/passed_on.h"
#include "bridges/dds/guard/reason.h"
#include "bridges/dds/guard/submessages.h"
#include "bridges/dds/guard/wire.h"
#include "bridges/dds/guard/writer_numbers.h"

namespace linegate::dds::guard {

class Guard {
 public:
  // protection_required: the governance of the domain protects RTPS messages.
  explicit Guard(bool protection_required, DiscoveryLimits limits = {})
      : protection_required_(protection_required), discovered_(std::move(limits)) {}

  struct Verdict {
    Reason reason = Reason::none;
    std::size_t size = 0;  // octets that are processed; the rest is dropped. Usually all.
  };

  // now: ns of any monotonic clock. from: the sender's address, zeros if it has none. out: receives
  // the datagram to pass on, if any; may be nullptr. Counts the datagram. From any thread. Does not
  // allocate.
  Verdict judge(Octets datagram, std::int64_t now, const Address& from = {},
                PassedOn* out = nullptr);
  // The library delivers samples between participants of this process without transports
  // (intraprocess delivery), with their own source timestamps. So data that a transport receives
  // from a writer of this process is forged or looped back, and is dropped. it: prefix of any
  // participant of the process.
  void set_process_of(const Prefix& it);
  // Limits the first timestamp of each writer to the present UTC, see SampleTimes. Without this
  // call, there is no limit. Call it before the first datagram. utc: callable from any thread.
  void set_utc(SampleTime (*utc)());
  // accepts: receives the certificate in PEM in each message of a handshake, and the octets behind
  // it; if it returns false, the datagram is dropped, as one in which another certificate could be
  // hidden. Called from any thread. Call it before the first datagram.
  void watch_certificates(std::function<bool(Octets pem)> accepts);
  // The participant accepts the multicast locator of that group and no other, see
  // announced_locators.h. Call it before the first datagram.
  void confine_multicast(const MulticastGroup& group) { group_ = group; }
  // Records the acknowledgements of local readers in a sent datagram. From any thread. Does not
  // allocate.
  void sent(Octets datagram);

  // What discovery found keeps its place in the tables until it is lost. From any thread. endless:
  // its lease is infinite.
  void participant_found(const Prefix& prefix, bool endless = false);
  void participant_lost(const Prefix& prefix);
  void endpoint_found(const Guid& endpoint);
  void endpoint_lost(const Guid& endpoint);

  // Whether that participant was found and not lost. From any thread.
  bool knows(const Prefix& participant) const { return discovered_.has_participant(participant); }
  // Whether it was found with an infinite lease, and not lost. From any thread.
  bool is_endless(const Prefix& participant) const { return discovered_.is_endless(participant); }

  // Counts a TCP connection that was ended, see tcp_input.h. From any thread.
  void connection_ended(Reason reason) { count(reason); }

  Counters counters() const;

  // The datagrams that the library processes now, in ns of steady_clock.
  CallWatch& calls() { return calls_; }
  const CallWatch& calls() const { return calls_; }

 private:
  struct Datagram;
  enum class Reliability : std::uint8_t { unknown, best_effort, reliable };

  void count(Reason reason);
  Reason walk(Datagram& datagram, PassedOn* out);
  void pass_on(const Datagram& datagram, const Submessage& submessage, PassedOn& out) const;
  Reason judge_submessage(Datagram& datagram, const Submessage& submessage);
  Reason judge_statistics(Datagram& datagram, const Submessage& submessage) const;
  static bool names_itself(const Datagram& datagram, const Content& content);
  void leave_out_end(Datagram& datagram, const Submessage& submessage,
                     const Content& content) const;
  Reason judge_numbers(Datagram& datagram, const Content& content);
  Reason judge_gap(Datagram& datagram, const Submessage& submessage, const Content& content);
  bool take_walk(const Datagram& datagram, const Content& content);
  void leave_out(Datagram& datagram, const Submessage& submessage);
  Reason judge_fragments(Datagram& datagram, const Content& content);
  void note_end(const Datagram& datagram, const Content& content);
  Reason judge_payload(Datagram& datagram, const Content& content);
  Reason judge_handshake(const Content& content) const;
  Reason judge_participant(const Datagram& datagram, const Announcement& announcement);
  Reason judge_endpoint(const Datagram& datagram, const Content& content,
                        const Announcement& announcement);
  Reason judge_announcement(const Datagram& datagram, const Announcement& announcement);
  Reason judge_acknowledgement(const Datagram& datagram, const Content& content);
  bool is_known(const Guid& guid) const;
  bool is_own(const Datagram& datagram, const Submessage& submessage, const Content& content) const;

  const bool protection_required_;
  SampleTime (*utc_)() = SampleTimes::no_limit;
  std::function<bool(Octets)> accepts_certificate_;
  std::optional<MulticastGroup> group_;    // nullopt: locators pass
  std::atomic<std::uint64_t> process_{0};  // 0: none
  std::atomic<Number> kept_{0};            // sum over all KeptNumbers
  GuidTable<WriterNumbers, 1024> writers_;
  GuidTable<Reliability, 512> readers_;
  GuidTable<IncompleteSamples, 1024> fragmented_;  // of writers that send fragments
  std::mutex walked_mutex_;
  WalkedNumbers walked_;
  WalkedAnnouncements walked_announcements_;
  Discovered discovered_;
  std::atomic<std::uint64_t> received_{0};
  std::array<std::atomic<std::uint64_t>, kReasons> dropped_{};
  CallWatch calls_;
};

}  // namespace linegate::dds::guard
