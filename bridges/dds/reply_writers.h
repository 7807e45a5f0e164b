// SPDX-License-Identifier: Apache-2.0
// The writers of CommandReply by their partitions: with DDS-Security one for each identity that has
// sent a request, so that no identity reads the replies to another one (security.h); otherwise one
// in the default partition.
//
// A single writer that changes its partitions would not do: a reader that matches it at the wrong
// moment receives what was written for the reader before.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include <linegate.h>

#include "bridges/dds/endpoints.h"
#include "bridges/dds/reply_writer.h"
#include "stack/base/time.h"

namespace linegate::dds {

class ReplyWriters {
 public:
  // Each participant has one identity, so authenticated participants cannot exceed this.
  static constexpr std::size_t kMost = 2 * kMostParticipants;
  // Longer than an identity needs to match the writer that was created for its first request.
  static constexpr Duration kUnread = std::chrono::seconds(30);

  // endpoints must outlive it, and reports whether a writer could be created. by_partition: no
  // writer in the default partition. renew_after: see ReplyWriter.
  ReplyWriters(Endpoints& endpoints, std::uint64_t renew_after, bool by_partition);

  // From any thread. Creates the writer of the partition if there is none. At kMost it replaces the
  // one that has been without a reader the longest; returns false if each has one, if the partition
  // is not of the kind that the constructor selected, or if DDS refused the sample. now: monotonic
  // time.
  bool write(v1::CommandReply& sample, const std::string& partition, Instant now);
  // Waits until every reader has acknowledged all replies, at most `most` for all writers.
  void wait_for_acknowledgments(Duration most);
  // Removes the writers that had no reader for kUnread. Call it about every second.
  void remove_unread(Instant now);
  std::size_t size() const;

 private:
  struct Slot {
    std::unique_ptr<ReplyWriter> writer;
    Instant read{};  // when it was created, or last found to have a reader
  };
  using Slots = std::map<std::string, Slot>;

  bool make_room(Instant now);
  void note_readers(Instant now);
  void remove(Slots::iterator slot);

  Endpoints& endpoints_;
  const std::uint64_t renew_after_;
  const bool by_partition_;
  mutable std::mutex mutex_;
  Slots writers_;  // by partition
};

}  // namespace linegate::dds
