// SPDX-License-Identifier: Apache-2.0
#include "stack/line/sdo_service.h"

#include <algorithm>
#include <array>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/line/entry_bytes.h"
#include "stack/line/output_service.h"

namespace linegate::line {
namespace {

using image::Direction;

// A response from another network may take this many SDO time-outs: the gateways on the way give up
// earlier, and report the reason.
constexpr int kRemotePatience = 3;

// The time of each attempt; zero: the command has no limit.
Duration share_of(const Command& command) {
  return std::max(command.timeout, Duration::zero()) / (1 + command.repeats);
}

Instant deadline_of(const Command& command, Instant now) {
  return command.timeout > Duration::zero() ? deadline(now, command.timeout) : kNever;
}

}  // namespace

std::span<const CommandKind> SdoService::commands() const {
  static constexpr std::array kCommands{CommandKind::sdo_read, CommandKind::sdo_write,
                                        CommandKind::network_read, CommandKind::network_write};
  return kCommands;
}

void SdoService::execute(Command command, Instant now) {
  const bool in_network =
      command.kind == CommandKind::network_read || command.kind == CommandKind::network_write;
  if (in_network && command.network != config_.network_id) {
    start_in_network(std::move(command), now);
    return;
  }
  const bool read =
      command.kind == CommandKind::sdo_read || command.kind == CommandKind::network_read;
  if (command.kind == CommandKind::sdo_read && (command.code & kFromImage) != 0 &&
      answer_from_image(command)) {
    return;
  }
  start(std::move(command), !read, now);
}

bool SdoService::answer_from_image(const Command& command) {
  const image::Layout& layout = parts_.image.layout(Direction::inputs);
  for (const std::uint32_t position : entries_of(layout, command)) {
    const image::Entry& entry = layout.entries[position];
    const std::size_t size = byte_length(entry);
    if (size > sizeof(std::uint64_t) || !parts_.image.is_valid(Direction::inputs, position) ||
        parts_.node.pdos().timed_out(entry.local_pdo)) {
      continue;
    }
    std::vector<std::byte> data(size);
    store_le(std::span(data), parts_.image.read_entry(Direction::inputs, position));
    host().reply(command.tag, Error{}, std::move(data));
    return true;
  }
  return false;
}

bool SdoService::answer_from_cache(const Command& command) {
  if ((command.code & kFromCache) == 0 && !parts_.settings.use_scanned_entries) {
    return false;
  }
  const auto* const known = parts_.cache.cached(command.node, {command.index, command.sub});
  if (known == nullptr) {
    return false;
  }
  host().reply(command.tag, Error{}, *known);
  return true;
}

// A transfer with the own node is a local access, without the bus.
void SdoService::access_own(Command command, bool write, Instant now) {
  command.kind = write ? CommandKind::local_write : CommandKind::local_read;
  command.code = 0;
  parts_.local.execute(std::move(command), now);
}

void SdoService::start(Command command, bool write, Instant now) {
  if (command.node < can::kMinNodeId || command.node > can::kMaxNodeId) {
    host().refuse(command, Refusal::bad_request, now);
    return;
  }
  if (command.node == config_.node_id) {
    access_own(std::move(command), write, now);
    return;
  }
  if (write) {
    parts_.cache.forget_cached(command.node, {command.index, command.sub});
  } else if (answer_from_cache(command)) {
    return;
  }
  if (!host().manages()) {  // the default SDO servers are the master's (IXXAT 8.1.9)
    host().refuse(command, Refusal::wrong_role, now);
    return;
  }
  if (!host().usable()) {
    host().refuse(command, Refusal::line_down, now);
    return;
  }
  const Duration share = share_of(command);
  const std::uint64_t number = ++transfers_;
  sdo::Request request{.owner = this,
                       .number = number,
                       .node = command.node,
                       .address = {command.index, command.sub},
                       .write = write,
                       .data = std::move(command.data),
                       .timeout = share > Duration::zero() ? std::min(share, config_.sdo_timeout)
                                                           : config_.sdo_timeout,
                       .priority = sdo::Priority::command,
                       .options = {.repeats = command.repeats}};
  if (pending_.size() >= kMost || !parts_.sdo.submit(std::move(request), now)) {
    host().refuse(command, Refusal::busy, now);
    return;
  }
  pending_.push_back({.number = number,
                      .node = command.node,
                      .tag = command.tag,
                      .deadline = deadline_of(command, now),
                      .is_object_write = command.kind == CommandKind::object_write});
}

void SdoService::start_in_network(Command command, Instant now) {
  if (command.network == 0 || command.node > can::kMaxNodeId) {
    host().refuse(command, Refusal::bad_request, now);
    return;
  }
  if (!parts_.routing.takes_part()) {
    host().reply(command.tag, to_error(AbortCode::invalid_value), {});  // there is no route
    return;
  }
  if (pending_.size() >= kMost) {
    host().refuse(command, Refusal::busy, now);
    return;
  }
  const Duration share = share_of(command);
  const Duration patience = kRemotePatience * config_.sdo_timeout;
  const std::uint64_t number = ++transfers_;
  pending_.push_back({.number = number, .tag = command.tag, .deadline = deadline_of(command, now)});
  parts_.routing.start({.owner = this,
                        .number = number,
                        .network = command.network,
                        .node = command.node,
                        .address = {command.index, command.sub},
                        .write = command.kind == CommandKind::network_write,
                        .data = std::move(command.data),
                        .timeout = share > Duration::zero() ? std::min(share, patience) : patience,
                        .repeats = command.repeats,
                        .as_device = (command.entry & kAsDevice) != 0},
                       now);
}

void SdoService::completed(sdo::Completion& completion, Instant /*now*/) {
  const auto it = std::ranges::find(pending_, completion.number, &Pending::number);
  if (it == pending_.end()) {
    return;  // the command was already answered when its own time-out passed
  }
  const bool done = completion.abort == AbortCode::none;
  if (it->is_object_write && done) {
    completion.data.assign(1, std::byte{kBySdo});
  }
  host().reply(it->tag, done ? Error{} : to_error(completion.abort), std::move(completion.data));
  *it = pending_.back();
  pending_.pop_back();
}

void SdoService::advance(Instant now) {
  for (std::size_t i = 0; i < pending_.size();) {
    const Pending command = pending_[i];
    if (command.deadline > now) {
      ++i;
      continue;
    }
    pending_[i] = pending_.back();
    pending_.pop_back();
    parts_.sdo.cancel(*this, command.node, command.number);
    parts_.routing.cancel(*this, command.number, now);
    host().reply(command.tag, to_error(Refusal::timed_out), {});
  }
}

Instant SdoService::next_wake() const {
  Instant wake = kNever;
  for (const Pending& command : pending_) {
    wake = earlier(wake, command.deadline);
  }
  return wake;
}

void SdoService::end(Refusal why, Instant /*now*/) {
  for (const Pending& command : std::exchange(pending_, {})) {
    parts_.sdo.cancel(*this, command.node, command.number);
    host().reply(command.tag, to_error(why), {});
  }
}

}  // namespace linegate::line
