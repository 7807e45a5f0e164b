// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/reply_writers.h"

#include <algorithm>
#include <chrono>
#include <iterator>

#include <linegatePubSubTypes.h>

namespace linegate::dds {

ReplyWriters::ReplyWriters(Endpoints& endpoints, std::uint64_t renew_after, bool by_partition)
    : endpoints_(endpoints), renew_after_(renew_after), by_partition_(by_partition) {
  endpoints_.add_topic<v1::CommandReplyPubSubType>(v1::TOPIC_COMMAND_REPLY);
  if (!by_partition)
    writers_[""].writer = std::make_unique<ReplyWriter>(endpoints_, renew_after_);
}

bool ReplyWriters::write(v1::CommandReply& sample, const std::string& partition, Instant now) {
  const std::lock_guard lock(mutex_);
  if (partition.empty() == by_partition_)
    return false;
  auto found = writers_.find(partition);
  if (found == writers_.end()) {
    if (!make_room(now))
      return false;
    auto writer = std::make_unique<ReplyWriter>(endpoints_, renew_after_, partition);
    found = writers_.emplace(partition, Slot{std::move(writer), now}).first;
  }
  return found->second.writer->write(sample);
}

void ReplyWriters::wait_for_acknowledgments(Duration most) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + most;
  const std::lock_guard lock(mutex_);
  for (auto& [partition, slot] : writers_) {
    slot.writer->wait_for_acknowledgments(
        std::max(Duration::zero(), Duration{deadline - Clock::now()}));
  }
}

void ReplyWriters::remove_unread(Instant now) {
  const std::lock_guard lock(mutex_);
  note_readers(now);
  for (auto slot = writers_.begin(); slot != writers_.end();) {
    const auto next = std::next(slot);
    if (!slot->first.empty() && now - slot->second.read >= kUnread)
      remove(slot);
    slot = next;
  }
}

std::size_t ReplyWriters::size() const {
  const std::lock_guard lock(mutex_);
  return writers_.size();
}

bool ReplyWriters::make_room(Instant now) {
  if (writers_.size() < kMost)
    return true;
  note_readers(now);
  const auto oldest =
      std::min_element(writers_.begin(), writers_.end(),
                       [](const auto& a, const auto& b) { return a.second.read < b.second.read; });
  if (oldest->first.empty() || oldest->second.read >= now)
    return false;
  remove(oldest);
  return true;
}

void ReplyWriters::note_readers(Instant now) {
  for (auto& [partition, slot] : writers_) {
    if (slot.writer->has_readers())
      slot.read = now;
  }
}

void ReplyWriters::remove(Slots::iterator slot) {
  slot->second.writer->remove();
  endpoints_.remove_partition(slot->first);
  writers_.erase(slot);
}

}  // namespace linegate::dds
