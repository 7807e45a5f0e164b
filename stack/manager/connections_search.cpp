// SPDX-License-Identifier: Apache-2.0
// The search for free records, and for free CAN-IDs.
#include <algorithm>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/manager/connections.h"
#include "stack/od/objects.h"

namespace linegate::manager {
namespace {

constexpr std::uint16_t kFirstServerRecord = od::objects::kSdoServer + 1;
constexpr std::uint8_t kFirstCobIdSub = 1;  // client to server
constexpr std::uint8_t kLastCobIdSub = 2;   // server to client

}  // namespace

// Without a device file the records are read in their order until one does not exist.
void Connections::begin_search(End end, Instant now) {
  const bool of_server = end == End::server;
  const std::uint16_t first = of_server ? kFirstServerRecord : od::objects::kSdoClient;
  const std::uint16_t last = of_server ? od::objects::kLastSdoServer : od::objects::kLastSdoClient;
  task_->searched = end;
  task_->node = node_of(current().value, end);
  task_->candidates = host_.records(task_->node, first, last);
  task_->probes = task_->candidates.empty();
  for (std::uint16_t index = first; task_->probes && index <= last; ++index) {
    task_->candidates.push_back(index);
  }
  task_->candidate = 0;
  task_->sub = kFirstCobIdSub;
  task_->is_free = true;
  task_->has_record = false;
  read_next(now);
}

void Connections::read_next(Instant now) {
  while (task_->candidate < task_->candidates.size() &&
         is_ours(task_->node, task_->candidates[task_->candidate])) {
    task_->has_record = true;
    ++task_->candidate;
  }
  if (task_->candidate >= task_->candidates.size()) {
    fail(task_->has_record ? AbortCode::sdo_connection : AbortCode::no_object, now);
    return;
  }
  submit({task_->candidates[task_->candidate], task_->sub}, std::nullopt, now);
}

// A record whose COB-IDs cannot be read, or have another length, is not used.
void Connections::read_completed(const sdo::Completion& completion, Instant now) {
  if (completion.abort == AbortCode::timeout) {
    fail(completion.abort, now);
    return;
  }
  if (completion.abort == AbortCode::no_object) {
    if (task_->probes) {
      task_->candidate = task_->candidates.size();
    }
    leave_record(now);
    return;
  }
  task_->has_record = true;
  if (completion.abort != AbortCode::none || completion.data.size() != sizeof(std::uint32_t)) {
    leave_record(now);
    return;
  }
  note_taken(load_le<std::uint32_t>(completion.data.data()));
  if (task_->sub < kLastCobIdSub) {
    ++task_->sub;
    read_next(now);
  } else {
    record_read(now);
  }
}

void Connections::leave_record(Instant now) {
  task_->candidate = std::min(task_->candidate + 1, task_->candidates.size());
  task_->sub = kFirstCobIdSub;
  task_->is_free = true;
  read_next(now);
}

// A record with one valid COB-ID may be one that another node is writing.
void Connections::record_read(Instant now) {
  if (!task_->is_free) {
    leave_record(now);
    return;
  }
  const std::uint16_t record = task_->candidates[task_->candidate];
  Connection& connection = current().value;
  if (task_->searched == End::server) {
    connection.server_record = record;
    begin_search(End::client, now);
    return;
  }
  connection.client_record = record;
  const auto pair = free_pair(task_->taken, now);
  if (!pair) {
    fail(AbortCode::sdo_connection, now);
    return;
  }
  connection.response = *pair;
  connection.request = static_cast<std::uint16_t>(*pair + 1);
  begin_writes(now);
}

void Connections::note_taken(std::uint32_t raw) {
  const can::CobId cob_id{raw};
  if (!cob_id.valid()) {
    return;
  }
  task_->is_free = false;
  const std::size_t at = cob_id.id() - options_.pool.first;
  if (!cob_id.extended() && options_.pool.has(cob_id.id()) && at < task_->taken.size()) {
    task_->taken[at] = true;
  }
}

bool Connections::is_ours(std::uint8_t node, std::uint16_t record) const {
  return std::ranges::any_of(table_, [=](const Entry& each) {
    return (each.value.client == node && each.value.client_record == record) ||
           (each.value.server == node && each.value.server_record == record);
  });
}

bool Connections::is_assigned(std::uint16_t id) const {
  return std::ranges::any_of(table_, [id](const Entry& each) {
    return each.value.request == id || each.value.response == id;
  });
}

// Returns the lower CAN-ID of the pair.
std::optional<std::uint16_t> Connections::free_pair(const std::vector<bool>& taken, Instant now) {
  const auto is_free = [&](std::size_t at) {
    const auto id = static_cast<std::uint16_t>(options_.pool.first + at);
    const bool noisy = heard_[at] && now < *heard_[at] + kQuiet;
    return !can::is_restricted(id) && !taken[at] && !noisy && !is_assigned(id) && !host_.uses(id);
  };
  for (std::size_t at = 0; at + 1 < heard_.size(); at += 2) {
    if (is_free(at) && is_free(at + 1)) {
      return static_cast<std::uint16_t>(options_.pool.first + at);
    }
  }
  return std::nullopt;
}

}  // namespace linegate::manager
