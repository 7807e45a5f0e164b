// SPDX-License-Identifier: Apache-2.0
// Commands: what was asked of the line, and its one reply each.
#include <algorithm>
#include <utility>

#include "stack/base/deadline.h"
#include "stack/line/command_checks.h"
#include "stack/line/line_impl.h"

namespace linegate::line {
namespace {

constexpr std::size_t kMaxPending = 1024;  // SDO commands under way, over all nodes of a line

// An answer from another network may take so many SDO time-outs: the gateways on the way give up
// before, and say why.
constexpr int kRemotePatience = 3;

constexpr Error kDone{};

bool is_node(std::uint8_t id) {
  return id >= can::kMinNodeId && id <= can::kMaxNodeId;
}

}  // namespace

void Line::Impl::execute(Command command, Instant now) {
  ++counters.commands;
  if (Service* const service = service_of[static_cast<std::size_t>(command.kind)]) {
    service->execute(std::move(command), now);
    return;
  }
  Error error = kDone;
  switch (command.kind) {
    case CommandKind::sdo_read:
      if ((command.code & kFromImage) != 0 && answer_from_image(command)) {
        return;
      }
      start_sdo(std::move(command), false, now);
      return;
    case CommandKind::sdo_write:
      start_sdo(std::move(command), true, now);
      return;
    case CommandKind::network_read:
    case CommandKind::network_write:
      start_in_network(std::move(command), now);
      return;
    case CommandKind::local_read:
    case CommandKind::local_write:
      access_own(command);
      return;
    case CommandKind::output_write:
      single_output(std::move(command), now);
      return;
    case CommandKind::emcy_send:
      send_emcy(command, now);
      return;
    case CommandKind::nmt:
      command_nmt(command, now);
      return;
    case CommandKind::object_write:
      write_object(std::move(command), now);
      return;
    case CommandKind::object_create:
      error = create_object(command);
      break;
    case CommandKind::pdo_trigger:
      answer_trigger(command, now);
      return;
    case CommandKind::mpdo_write:
      write_by_mpdo(command, now);
      return;
    case CommandKind::can_send:
      send_frame(command, now);
      return;
    case CommandKind::can_listen:
      error = listening.ask(command, now);
      break;
    case CommandKind::routing_trace:
    case CommandKind::lss:
    case CommandKind::scan:
    case CommandKind::scan_apply:
    case CommandKind::pdo_request:
    case CommandKind::boot:
    case CommandKind::configure:
    case CommandKind::program:
    case CommandKind::versions:
    case CommandKind::bus_restart:
    case CommandKind::bus_fault:
      error = to_error(Refusal::bad_request);
      break;
  }
  answer(command, error, {}, now);
}

void Line::Impl::start_in_network(Command command, Instant now) {
  if (command.network == config.network_id) {
    const bool write = command.kind == CommandKind::network_write;
    start_sdo(std::move(command), write, now);
    return;
  }
  if (command.network == 0 || command.node > can::kMaxNodeId) {
    refuse(command, Refusal::bad_request, now);
    return;
  }
  if (!routing.takes_part()) {
    reply(command.tag, to_error(AbortCode::invalid_value));  // there is no route
    return;
  }
  if (pending.size() >= kMaxPending) {
    refuse(command, Refusal::busy, now);
    return;
  }
  const Duration timeout = std::max(command.timeout, Duration::zero());
  const Duration share = timeout / (1 + command.repeats);
  const Duration patience = kRemotePatience * config.sdo_timeout;
  const std::uint64_t number = ++transfers;
  pending.push_back({.number = number,
                     .tag = command.tag,
                     .deadline = timeout > Duration::zero() ? deadline(now, timeout) : kNever});
  routing.start({.owner = &command_transfers,
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

// A transfer with the own node is a local access: there is no bus between the two.
void Line::Impl::start_sdo(Command command, bool write, Instant now) {
  if (!is_node(command.node)) {
    refuse(command, Refusal::bad_request, now);
    return;
  }
  if (command.node == config.node_id) {
    command.kind = write ? CommandKind::local_write : CommandKind::local_read;
    command.code = 0;
    access_own(command);
    return;
  }
  const od::Address address{command.index, command.sub};
  if (write) {
    scanning.forget_cached(command.node, address);
  } else if ((command.code & kFromCache) != 0 || records.settings().use_scanned_entries) {
    if (const auto* const known = scanning.cached(command.node, address)) {
      reply(command.tag, kDone, *known);
      return;
    }
  }
  if (!manages()) {  // the default SDO servers are the master's (IXXAT 8.1.9)
    refuse(command, Refusal::wrong_role, now);
    return;
  }
  if (!usable()) {
    refuse(command, Refusal::line_down, now);
    return;
  }
  const Duration timeout = command.timeout > Duration::zero() ? command.timeout : Duration::zero();
  const Duration share = timeout / (1 + command.repeats);
  const std::uint64_t number = ++transfers;
  sdo::Request request{.owner = &command_transfers,
                       .number = number,
                       .node = command.node,
                       .address = {command.index, command.sub},
                       .write = write,
                       .data = std::move(command.data),
                       .timeout = share > Duration::zero() ? std::min(share, config.sdo_timeout)
                                                           : config.sdo_timeout,
                       .priority = sdo::Priority::command,
                       .options = {.repeats = command.repeats}};
  if (pending.size() >= kMaxPending || !sdo.submit(std::move(request), now)) {
    refuse(command, Refusal::busy, now);
    return;
  }
  pending.push_back({.number = number,
                     .node = command.node,
                     .tag = command.tag,
                     .deadline = timeout > Duration::zero() ? deadline(now, timeout) : kNever,
                     .tells_way = command.kind == CommandKind::object_write});
}

Error Line::Impl::list_device_file(const Command& command, std::vector<std::byte>& data) const {
  const auto found = std::find_if(config.nodes.begin(), config.nodes.end(),
                                  [&](const auto& one) { return one.id == command.node; });
  if (found == config.nodes.end() || found->device.objects.empty()) {
    return to_error(Refusal::bad_request);
  }
  data = list_objects(found->device, command.index, last_of_list(command));
  return kDone;
}

void Line::Impl::access_own(const Command& command) {
  if (command.kind == CommandKind::local_read) {
    std::vector<std::byte> data;
    const bool of_node =
        (command.code & kListObjects) != 0 && command.node != 0 && command.node != config.node_id;
    const Error error =
        of_node ? list_device_file(command, data) : read_object(node.dictionary(), command, data);
    reply(command.tag, error, std::move(data));
    return;
  }
  od::Ticket ticket = 0;
  const OwnObjects::OwnWrites by_itself(own_objects);
  const AbortCode code =
      node.dictionary().write({command.index, command.sub}, command.data, ticket);
  if (code == od::kLater) {
    local_writes.push_back({ticket, command.tag, command.data});
    return;
  }
  reply(command.tag, code == AbortCode::none ? kDone : to_error(code));
}

void Line::Impl::finish_local_writes() {
  std::erase_if(local_writes, [this](const LocalWrite& write) {
    if (!node.dictionary().outcome(write.ticket)) {
      return false;
    }
    const AbortCode code = node.dictionary().finish_write(write.ticket, write.data);
    reply(write.tag, code == AbortCode::none ? kDone : to_error(code));
    return true;
  });
}

// Applied after a watchdog's reaction too.
void Line::Impl::single_output(Command command, Instant now) {
  const image::Layout& layout = image.layout(image::Direction::outputs);
  if (const Error why = check_single_output(command, layout, outputs); why != kDone) {
    answer(command, why, {}, now);
    return;
  }
  const image::Entry& entry = layout.entries[command.entry];
  if (!takes_single_writes(entry.node)) {
    command.node = entry.node;  // the event names it
    refuse(command, Refusal::wrong_state, now);
    return;
  }
  image.write_entry(image::Direction::outputs, command.entry, command.data);
  outputs_written(entry.bit_offset, entry.bit_length, true, now);
  if (entry.local_pdo == 0) {
    answer_scanned(std::move(command), now);
    return;
  }
  answer_write(std::move(command), entry.local_pdo, wait_of(entry.local_pdo), now);
}

// Of a value that was written to that TPDO of the line.
void Line::Impl::answer_write(Command command, std::uint16_t tpdo, PdoWait wait, Instant now) {
  std::vector<std::byte> way = way_of(tpdo, wait);
  if (wait != PdoWait::none) {
    reply(command.tag, kDone, std::move(way));
    return;
  }
  answer_when_sent({.command = std::move(command),
                    .frames = {{.tpdo = tpdo, .samples = node.pdos().samples(tpdo)}},
                    .data = std::move(way)},
                   now);
}

void Line::Impl::send_emcy(const Command& command, Instant now) {
  Error why = check_emcy(command, node.state());
  if (why == kDone) {
    std::array<std::byte, 5> manufacturer{};
    std::ranges::copy(command.data, manufacturer.begin());
    why = to_error(node.report_error(command.code, command.error_register, manufacturer, now));
  }
  if (why != kDone) {
    answer(command, why, {}, now);
    return;
  }
  answer_when_sent({.command = command, .frames = {{.frame = node.emcy().newest()}}}, now);
}

// A command to other nodes is answered when it is on the bus.
void Line::Impl::command_nmt(const Command& command, Instant now) {
  const bool anew = manages() && diagnosing.diagnosis().fatal() && nmt::is_reset(command.nmt) &&
                    command.node == 0;
  const bool own = command.node == config.node_id || anew;
  const Error why = send_nmt(command, now);
  if (why != kDone || own) {
    answer(command, why, {}, now);
    return;
  }
  const can::Frame frame = nmt::encode({command.nmt, command.node});
  answer_when_sent({.command = command, .frames = {{.frame = frame}}}, now);
}

Error Line::Impl::send_nmt(const Command& command, Instant now) {
  if (const Error why = check_nmt(command); why != kDone) {
    return why;
  }
  const bool own = command.node == config.node_id;
  if (manages() && diagnosing.diagnosis().fatal() && nmt::is_reset(command.nmt) &&
      (own || command.node == 0)) {
    begin_anew(command.nmt, now);
    return kDone;
  }
  if (own) {
    command_own(command.nmt, now);
    if (nmt::is_reset(command.nmt)) {
      manager.own_reset();
    }
    return kDone;
  }
  if (!manages()) {
    return to_error(Refusal::wrong_role);
  }
  if (!nmt.send(command.nmt, command.node, now)) {
    return to_error(Refusal::busy);
  }
  note_sent(command.nmt, command.node, now);
  manager.commanded(command.nmt, command.node, now);
  return kDone;
}

void Line::Impl::send_frame(const Command& command, Instant now) {
  can::Frame frame;
  Error why = generic_frame(command, frame);
  if (why == kDone && uses_identifier(node, plan.tpdos, frame)) {
    why = to_error(Refusal::identifier_in_use);
  }
  if (why == kDone) {
    why = usable() ? send_generic(node, frame) : to_error(Refusal::line_down);
  }
  if (why != kDone) {
    answer(command, why, {}, now);
    return;
  }
  answer_when_sent({.command = command, .frames = {{.frame = frame}}}, now);
}

void Line::Impl::command_completed(sdo::Completion& completion) {
  const auto it = std::ranges::find(pending, completion.number, &Pending::number);
  if (it == pending.end()) {
    return;  // its command was answered when its own time-out passed
  }
  if (it->tells_way && completion.abort == AbortCode::none) {
    completion.data.assign(1, std::byte{kBySdo});
  }
  reply(it->tag, completion.abort == AbortCode::none ? kDone : to_error(completion.abort),
        std::move(completion.data));
  *it = pending.back();
  pending.pop_back();
}

void Line::Impl::expire_commands(Instant now) {
  expire_sendings(now);
  for (std::size_t i = 0; i < pending.size();) {
    if (pending[i].deadline > now) {
      ++i;
      continue;
    }
    sdo.cancel(command_transfers, pending[i].node, pending[i].number);
    routing.cancel(command_transfers, pending[i].number, now);
    reply(pending[i].tag, to_error(Refusal::timed_out));
    pending[i] = pending.back();
    pending.pop_back();
  }
}

Instant Line::Impl::next_command_deadline() const {
  Instant wake = under_way.next_deadline();
  for (const Pending& command : pending) {
    wake = earlier(wake, command.deadline);
  }
  return wake;
}

}  // namespace linegate::line
