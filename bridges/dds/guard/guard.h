// SPDX-License-Identifier: Apache-2.0
// Judges each datagram before Fast DDS reads it. One guard serves all transports of a participant.
//
// What passes is well-formed RTPS 2.3, names no length beyond its octets, and lets no writer's
// sequence numbers advance faster than samples can. It is no authentication: see
// deploy/SECURITY.md.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <utility>

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
    std::size_t size = 0;  // octets up to where the rest is left out: mostly all
  };

  // now: ns of any clock that does not go back. from: the sender's address, zeros if there is none.
  // out: becomes what is to be passed on, if anything is; nullptr: that is not wanted. From any
  // thread; counts. Does not allocate.
  Verdict judge(Octets datagram, std::int64_t now, const Address& from = {},
                PassedOn* out = nullptr);
  // The library delivers samples between participants of this process without transports
  // (intraprocess delivery), with their own source timestamps: what a transport receives in the
  // name of a writer of this process is forged, or came back, and is left out. it: any participant
  // of it.
  void set_process_of(const Prefix& it);
  // Notes what readers here acknowledge in a datagram that is sent. From any thread. Does not
  // allocate.
  void sent(Octets datagram);

  // What discovery found, so that it keeps its place in the tables, and what it lost. From any
  // thread.
  // endless: its lease is infinite.
  void participant_found(const Prefix& prefix, bool endless = false);
  void participant_lost(const Prefix& prefix);
  void endpoint_found(const Guid& endpoint);
  void endpoint_lost(const Guid& endpoint);

  Counters counters() const;

 private:
  struct Datagram;
  enum class Reliability : std::uint8_t { unknown, best_effort, reliable };

  void count(Reason reason);
  Reason walk(Datagram& datagram, PassedOn* out);
  static void pass_on(const Datagram& datagram, const Submessage& submessage, PassedOn& out);
  Reason judge_submessage(Datagram& datagram, const Submessage& submessage);
  Reason judge_statistics(Datagram& datagram, const Submessage& submessage) const;
  static bool names_itself(const Datagram& datagram, const Content& content);
  void leave_out_end(Datagram& datagram, const Submessage& submessage,
                     const Content& content) const;
  Reason judge_numbers(Datagram& datagram, const Content& content);
  Reason judge_gap(Datagram& datagram, const Submessage& submessage, const Content& content);
  void leave_out(Datagram& datagram, const Submessage& submessage);
  Reason judge_fragments(Datagram& datagram, const Content& content);
  void note_end(const Datagram& datagram, const Content& content);
  Reason judge_payload(Datagram& datagram, const Content& content);
  Reason judge_participant(const Datagram& datagram, const Announcement& announcement);
  Reason judge_endpoint(const Datagram& datagram, const Content& content,
                        const Announcement& announcement);
  Reason judge_announcement(const Datagram& datagram, const Announcement& announcement);
  Reason judge_acknowledgement(const Datagram& datagram, const Content& content);
  bool is_known(const Guid& guid) const;
  bool is_own(const Datagram& datagram, const Submessage& submessage, const Content& content) const;

  const bool protection_required_;
  std::atomic<std::uint64_t> process_{0};  // 0: none
  std::atomic<Number> kept_{0};            // KeptNumbers of all writers
  GuidTable<WriterNumbers, 1024> writers_;
  GuidTable<Reliability, 512> readers_;
  GuidTable<IncompleteSamples, 1024> fragmented_;  // of writers that send fragments
  std::mutex walked_mutex_;
  WalkedNumbers walked_;
  Discovered discovered_;
  std::atomic<std::uint64_t> received_{0};
  std::array<std::atomic<std::uint64_t>, kReasons> dropped_{};
};

}  // namespace linegate::dds::guard
