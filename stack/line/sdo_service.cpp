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
  if (const auto* const read = std::get_if<SdoRead>(&command.request)) {
    if (!read->from_image || !answer_from_image(command.tag, *read)) {
      start(command,
            {.node = read->node,
             .address = read->address,
             .repeats = read->repeats,
             .from_scan = read->from_scan},
            now);
    }
  } else if (auto* const write = std::get_if<SdoWrite>(&command.request)) {
    start(command,
          {.node = write->node,
           .address = write->address,
           .write = true,
           .data = std::move(write->data),
           .repeats = write->repeats},
          now);
  } else if (auto* const object = std::get_if<ObjectWrite>(&command.request)) {
    start(command,
          {.node = object->node,
           .address = object->address,
           .write = true,
           .data = std::move(object->data)},
          now);
  } else {
    execute_in_network(command, now);
  }
}

// In the own network as SdoRead and SdoWrite.
void SdoService::execute_in_network(Command& command, Instant now) {
  Way way;
  Transfer transfer;
  if (const auto* const read = std::get_if<NetworkRead>(&command.request)) {
    way = {read->network, read->as_device, read->hops};
    transfer = {.node = read->node, .address = read->address, .repeats = read->repeats};
  } else {
    auto& write = std::get<NetworkWrite>(command.request);
    way = {write.network, write.as_device, write.hops};
    transfer = {.node = write.node,
                .address = write.address,
                .write = true,
                .data = std::move(write.data),
                .repeats = write.repeats};
  }
  if (way.network == config_.network_id) {
    start(command, std::move(transfer), now);
  } else {
    start_in_network(command, way, std::move(transfer), now);
  }
}

bool SdoService::answer_from_image(std::uint64_t tag, const SdoRead& request) {
  const image::Layout& layout = parts_.image.layout(Direction::inputs);
  for (const std::uint32_t position : entries_of(layout, request.node, request.address)) {
    const image::Entry& entry = layout.entries[position];
    const std::size_t size = byte_length(entry);
    if (size > sizeof(std::uint64_t) || !parts_.image.is_valid(Direction::inputs, position) ||
        parts_.node.pdos().timed_out(entry.local_pdo)) {
      continue;
    }
    std::vector<std::byte> data(size);
    store_le(std::span(data), parts_.image.read_entry(Direction::inputs, position));
    host().reply(tag, Error{}, std::move(data));
    return true;
  }
  return false;
}

bool SdoService::answer_from_cache(std::uint64_t tag, const Transfer& transfer) {
  if (!transfer.from_scan && !parts_.settings.use_scanned_entries) {
    return false;
  }
  const auto* const known = parts_.cache.cached(transfer.node, transfer.address);
  if (known == nullptr) {
    return false;
  }
  host().reply(tag, Error{}, *known);
  return true;
}

// A transfer with the own node is a local access, without the bus. A write may order a frame.
void SdoService::access_own(const Command& command, Transfer transfer, Instant now) {
  Command local{.tag = command.tag, .request = LocalRead{.what = transfer.address}};
  if (transfer.write) {
    parts_.sdo.charge(command.client, 1);
    local.request = LocalWrite{.address = transfer.address, .data = std::move(transfer.data)};
  }
  parts_.local.execute(std::move(local), now);
}

void SdoService::start(const Command& command, Transfer transfer, Instant now) {
  if (transfer.node < can::kMinNodeId || transfer.node > can::kMaxNodeId) {
    host().refuse(command, Refusal::bad_request, now);
    return;
  }
  if (transfer.node == config_.node_id) {
    access_own(command, std::move(transfer), now);
    return;
  }
  if (transfer.write) {
    parts_.cache.forget_cached(transfer.node, transfer.address);
  } else if (answer_from_cache(command.tag, transfer)) {
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
  const AbortCode rule =
      transfer.write ? parts_.rule.may_write(transfer.node, transfer.address, transfer.data, now)
                     : AbortCode::none;
  if (rule != AbortCode::none) {
    host().refuse(
        command, rule == AbortCode::invalid_value ? Refusal::identifier_in_use : Refusal::image_pdo,
        now);
    return;
  }
  const Duration share = share_of(command, transfer);
  const std::uint64_t number = ++transfers_;
  sdo::Request request{.owner = this,
                       .number = number,
                       .node = transfer.node,
                       .address = transfer.address,
                       .write = transfer.write,
                       .data = std::move(transfer.data),
                       .timeout = share > Duration::zero() ? std::min(share, config_.sdo_timeout)
                                                           : config_.sdo_timeout,
                       .priority = sdo::Priority::command,
                       .client = command.client,
                       .options = {.repeats = transfer.repeats}};
  if (pending_.size() >= kMost || !parts_.sdo.submit(std::move(request), now)) {
    host().refuse(command, Refusal::busy, now);
    return;
  }
  pending_.push_back({.number = number,
                      .node = transfer.node,
                      .tag = command.tag,
                      .deadline = deadline_of(command, now),
                      .is_object_write = kind(command) == CommandKind::object_write});
}

void SdoService::start_in_network(const Command& command, Way way, Transfer transfer, Instant now) {
  if (way.network == 0 || transfer.node > can::kMaxNodeId) {
    host().refuse(command, Refusal::bad_request, now);
    return;
  }
  if (parts_.flying.is_passive()) {
    host().refuse(command, Refusal::wrong_role, now);
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
  const Duration share = share_of(command, transfer);
  const Duration patience = kRemotePatience * config_.sdo_timeout;
  const std::uint64_t number = ++transfers_;
  pending_.push_back({.number = number, .tag = command.tag, .deadline = deadline_of(command, now)});
  parts_.routing.start({.owner = this,
                        .number = number,
                        .network = way.network,
                        .node = transfer.node,
                        .address = transfer.address,
                        .write = transfer.write,
                        .data = std::move(transfer.data),
                        .timeout = share > Duration::zero() ? std::min(share, patience) : patience,
                        .repeats = transfer.repeats,
                        .hops = way.hops,
                        .as_device = way.as_device,
                        .client = command.client},
                       now);
}

// Of each attempt; zero: the command has no limit.
Duration SdoService::share_of(const Command& command, const Transfer& transfer) {
  return std::max(command.timeout, Duration::zero()) / (1 + transfer.repeats);
}

void SdoService::completed(sdo::Completion& completion, Instant /*now*/) {
  const auto it = std::ranges::find(pending_, completion.number, &Pending::number);
  if (it == pending_.end()) {
    return;  // the command was already answered when its own time-out passed
  }
  const bool done = completion.abort == AbortCode::none;
  ReplyData data;
  if (it->is_object_write && done) {
    data = WrittenBySdo{};
  } else if (!completion.data.empty()) {
    data = std::move(completion.data);
  }
  host().reply(it->tag, done ? Error{} : to_error(completion.abort), std::move(data));
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
    give_up(command, Refusal::timed_out, now);
  }
}

Instant SdoService::next_wake() const {
  Instant wake = kNever;
  for (const Pending& command : pending_) {
    wake = earlier(wake, command.deadline);
  }
  return wake;
}

void SdoService::end(Refusal why, Instant now) {
  for (const Pending& command : std::exchange(pending_, {})) {
    give_up(command, why, now);
  }
}

// A refusal means that the command was not carried out. A write of which the server has received
// all, or may receive it, has no certain result: it is answered as one whose response is missing.
void SdoService::give_up(const Pending& command, Refusal why, Instant now) {
  const bool may_be_carried_out =
      parts_.sdo.may_be_carried_out(*this, command.node, command.number) ||
      parts_.routing.may_be_carried_out(*this, command.number);
  parts_.sdo.cancel(*this, command.node, command.number);
  parts_.routing.cancel(*this, command.number, now);
  host().reply(command.tag, may_be_carried_out ? to_error(AbortCode::timeout) : to_error(why), {});
}

}  // namespace linegate::line
