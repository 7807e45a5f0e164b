// SPDX-License-Identifier: Apache-2.0
// The path of a received frame to its service.
#include <utility>

#include "stack/can/dispatch.h"
#include "stack/nmt/node_control.h"
#include "stack/node/impl.h"

namespace linegate::node {
namespace {

constexpr std::uint16_t kNodeBits = 0x7F;

// Whether nothing but one RPDO uses the frame.
inline bool is_rpdo(const can::Target* target) {
  return target != nullptr && target->alone_of(can::Service::rpdo);
}

}  // namespace

// Fast path of the most frequent SDO request to the default server. Returns false for other frames.
inline bool Node::Impl::answer_sdo_request(const can::Frame& frame) {
  if (!frame.standard_of(sdo::kFrameSize)) {
    return false;
  }
  const can::Target* const target = dispatch.find_standard(frame.id);
  if (target == nullptr || !target->alone_is(can::Service::sdo_server, 0) ||
      !serves(can::Service::sdo_server) ||
      !sdo.default_server().answer_at_once(sdo::word_of(frame), transmit)) {
    return false;
  }
  counters.received.add_standard(sdo::kFrameSize);
  return true;
}

// Processing a frame may change the table (a COB-ID is written, a reset), so a target is not used
// after it was served.
[[gnu::hot]] void Node::Impl::receive(std::span<const can::Frame> frames) {
  if (frames.size() == 1 && !frames.front().extended()) {
    receive_one(frames.front());
    return;
  }
  // This loop makes no call, so no registers have to be saved.
  while (!frames.empty() && answer_sdo_request(frames.front())) {
    frames = frames.subspan(1);
  }
  if (!frames.empty()) {
    receive_others(frames);
  }
}

// Precondition: an 11-bit identifier.
[[gnu::hot]] void Node::Impl::receive_one(const can::Frame& frame) {
  const can::Target* const target = dispatch.find_standard(frame.id);
  if (is_rpdo(target) ? pdos.receive_alone(target->index, frame, counters.received)
                      : answer_sdo_request(frame)) {
    return;
  }
  receive(frame);
}

[[gnu::hot]] void Node::Impl::receive_others(std::span<const can::Frame> frames) {
  while (!frames.empty()) {
    const can::Frame& frame = frames.front();
    const can::Target* const target = dispatch.find(frame);
    std::size_t taken = 0;
    if (is_rpdo(target)) {
      const bool alone = frames.size() == 1 || !is_rpdo(dispatch.find(frames[1]));
      taken = alone && !frame.extended()
                  ? std::size_t{pdos.receive_alone(target->index, frame, counters.received)}
                  : pdos.receive_ordinary(frames, counters.received);
    }
    if (taken == 0) {
      if (!answer_sdo_request(frame)) {
        receive(frame);
      }
      taken = 1;
    }
    frames = frames.subspan(taken);
  }
}

// The monitored nodes shown in 1016h for an answer stay in the dictionary until the next request.
void Node::Impl::hide_monitored() {
  if (heartbeat_times.shows()) [[unlikely]] {
    heartbeat_times.hide(dictionary);
  }
}

void Node::Impl::receive_sdo(std::uint16_t index, const can::Frame& frame) {
  hide_monitored();
  if (index >= kSdoServers) {
    hand_to_master_services({can::Service::sdo_server, index, 0}, frame);
    return;
  }
  if (!serves(can::Service::sdo_server)) {
    return;
  }
  if (frame.length != can::kMaxClassicData || frame.fd()) {
    ++counters.malformed;  // the server reports it
  }
  pdos.pass_time(frame.time);
  if (sdo::Server* const server = sdo.find(index); server != nullptr) {
    server->receive(frame, transmit);
  }
  if (dictionary.writes_reported() != applied_writes) [[unlikely]] {
    apply_writes(frame.time);
  }
}

[[gnu::hot]] void Node::Impl::receive(const can::Frame& frame) {
  counters.received.add(frame);
  ++attended;
  const can::Target* found = dispatch.find(frame);
  if (found == nullptr) {
    unwanted(frame);
    return;
  }
  now = frame.time;
  if (frame.remote()) [[unlikely]] {
    remote_request(*found, frame);
  } else if (found->alone_is(can::Service::sync, 0)) {
    receive_sync(frame);
  } else {
    serve_all(found, frame);
  }
}

// Serves each target that was registered when the frame arrived, and still is when its turn comes.
[[gnu::hot]] void Node::Impl::serve_all(const can::Target* target, const can::Frame& frame) {
  const std::uint64_t arrival = dispatch.changes();
  while (target != nullptr) {
    const can::Target served = *target;
    const std::uint64_t added = served.next == 0 ? arrival : dispatch.added(*target);
    if (served.service == can::Service::rpdo) {
      pdos.receive(served.index, frame);
    } else {
      serve(served.service, served.index, frame);
    }
    target = dispatch.changes() == arrival ? dispatch.next(served)
                                           : dispatch.find_added(frame, added, arrival);
  }
}

void Node::Impl::serve(can::Service service, std::uint16_t index, const can::Frame& frame) {
  switch (service) {
    case can::Service::nmt:
      if (index == 0) {
        receive_node_control(frame);
      } else {
        hand_to_master_services({service, index, 0}, frame);
      }
      return;
    case can::Service::sync:
      receive_sync(frame);
      return;
    case can::Service::sdo_server:
      receive_sdo(index, frame);
      return;
    case can::Service::error_control:
      receive_error_control(index, frame);
      return;
    case can::Service::emcy:
      receive_emergency(index, frame);
      return;
    case can::Service::tpdo_rtr:
    case can::Service::none:
      ++counters.unused;  // an error of another device: data frames on a TPDO of this node
      return;
    case can::Service::sdo_client:
      receive_sdo_answer(index, frame);
      return;
    case can::Service::usdo:
      receive_usdo(frame);
      return;
    case can::Service::time:
      receive_time(frame);
      return;
    case can::Service::rpdo:
    case can::Service::lss:
    case can::Service::srdo:
    case can::Service::sleep:
      hand_to_master_services({service, index, 0}, frame);
      return;
  }
}

void Node::Impl::remote_request(can::Target target, const can::Frame& frame) {
  if (options.fd) {
    unwanted(frame);
    return;
  }
  bool wanted = false;
  for (;;) {
    if (target.service == can::Service::tpdo_rtr) {
      wanted = true;
      if (serves(target.service)) {
        pdos.remote_request(target.index, frame.time);
      }
    } else if (target.service == can::Service::error_control &&
               (target.index & kOwnIdMark) == kOwnIdMark) {
      wanted = true;
      guarding.request(frame.time);
    }
    if (target.next == 0) {
      break;
    }
    target = *dispatch.next(target);
  }
  if (!wanted) {
    unwanted(frame);
  }
}

void Node::Impl::receive_node_control(const can::Frame& frame) {
  const auto control = nmt::decode_node_control(frame);
  if (!control) {
    malformed(frame, 0);
    return;
  }
  if (!options.nmt_slave || master_services != nullptr) {
    hand_to_master_services({can::Service::nmt, 0, 0}, frame);
  }
  if (options.nmt_slave && control->addresses(options.node_id)) {
    command(control->command, frame.time);
  }
}

[[gnu::hot]] void Node::Impl::receive_sync(const can::Frame& frame) {
  if (!serves(can::Service::sync)) {
    return;
  }
  const sync::Reception reception = sync.receive(frame);
  if (reception.wrong_length || reception.wrong_counter) {
    malformed(frame, 0);
  }
  if (reception.error_begins) {
    begin(Fault::sync_length, 0);
  } else if (!reception.wrong_length) {
    end(Fault::sync_length, 0);
  }
  if (reception.is_sync) {
    synced(reception.counter, frame.time);
  }
}

void Node::Impl::receive_usdo(const can::Frame& frame) {
  hide_monitored();
  if (usdo == nullptr || !serves(can::Service::usdo)) {
    return;
  }
  pdos.pass_time(frame.time);
  const std::uint64_t before = usdo->counters().malformed;
  usdo->receive(frame, transmit);
  counters.malformed += usdo->counters().malformed - before;
  if (dictionary.writes_reported() != applied_writes) [[unlikely]] {
    apply_writes(frame.time);
  }
}

void Node::Impl::receive_sdo_answer(std::uint16_t index, const can::Frame& frame) {
  if ((index & SdoClients::kMark) == 0) {
    hand_to_master_services({can::Service::sdo_client, index, 0}, frame);
    return;
  }
  if (serves(can::Service::sdo_client)) {
    const std::uint64_t before = sdo_clients.malformed();
    sdo_clients.receive(index, frame, transmit);
    counters.malformed += sdo_clients.malformed() - before;
  }
}

void Node::Impl::receive_time(const can::Frame& frame) {
  if (!serves(can::Service::time)) {
    return;
  }
  if (!clock.receive(frame)) {
    malformed(frame, 0);
    return;
  }
  ++counters.times;
  if (application != nullptr && clock.received()) {
    application->time_received(clock.received()->time, frame.time);
  }
}

void Node::Impl::receive_error_control(std::uint16_t index, const can::Frame& frame) {
  if ((index & kOwnMark) == 0) {
    hand_to_master_services({can::Service::error_control, index, 0}, frame);
    return;
  }
  if ((index & kOwnIdMark) == kOwnIdMark) {
    check_own_id(frame);
    return;
  }
  const auto node = static_cast<std::uint8_t>(index & kNodeBits);
  if (!serves(can::Service::error_control)) {
    return;
  }
  const nmt::ErrorControlReception reception = heartbeats.receive(node, frame);
  if (reception == nmt::ErrorControlReception::malformed) {
    malformed(frame, node);
  } else if (reception == nmt::ErrorControlReception::not_alternated) {
    ++counters.unused;
  }
}

// An error control message of another device with this node's node-ID.
void Node::Impl::check_own_id(const can::Frame& frame) {
  if (!serves(can::Service::error_control)) {
    return;
  }
  const auto content = static_cast<nmt::State>(frame.data[0] & ~nmt::kToggleBit);
  if (frame.length != 1 || nmt::name(content) == nmt::name(nmt::State::unknown)) {
    malformed(frame, options.node_id);
    return;
  }
  report_duplicate(content, frame.time);
}

// A frame on 1014h. If a PDO or the EMCY of another node also has that COB-ID, it is no evidence.
void Node::Impl::receive_own_emergency(const can::Frame& frame) {
  const can::Target* const target = dispatch.find(frame);
  if (!serves(can::Service::emcy) || target == nullptr || !target->alone_of(can::Service::emcy)) {
    return;
  }
  if (emcy::decode(frame) || (options.emcy_fd && emcy::decode_fd(frame))) {
    report_duplicate(nmt::State::unknown, frame.time);
  } else {
    malformed(frame, options.node_id);
  }
}

// Reports each boot-up message, and the first of the other messages.
void Node::Impl::report_duplicate(nmt::State shown, Instant time) {
  if (shown == nmt::State::initialising || !duplicate_reported) {
    duplicate_reported = true;
    events.emit({.time = time, .node = options.node_id, .data = event::DuplicateNodeId{shown}});
  }
  begin(Fault::node_id, 0);
}

void Node::Impl::receive_emergency(std::uint16_t index, const can::Frame& frame) {
  if ((index & kOwnMark) == 0) {
    hand_to_master_services({can::Service::emcy, index, 0}, frame);
    return;
  }
  if ((index & kOwnIdMark) == kOwnIdMark) {
    receive_own_emergency(frame);
    return;
  }
  const auto node = static_cast<std::uint8_t>(index & kNodeBits);
  if (!serves(can::Service::emcy) || emergencies.receive(node, frame)) {
    return;
  }
  // Count the frame once, even if several sub-indices of 1028h have its COB-ID.
  if (std::exchange(emergency_reported, counters.received.frames) != counters.received.frames) {
    malformed(frame, node);
  }
}

void Node::Impl::hand_to_master_services(can::Target target, const can::Frame& frame) {
  if (master_services == nullptr) {
    ++counters.unused;
  } else {
    master_services->receive(target, frame);
  }
}

void Node::Impl::malformed(const can::Frame& frame, std::uint8_t node) {
  ++counters.malformed;
  events.emit(can::malformed_event(frame, node));
}

void Node::Impl::unwanted(const can::Frame& frame) {
  ++counters.unused;
  if (master_services != nullptr) {
    master_services->unwanted(frame);
  }
}

[[gnu::hot]] void Node::Impl::synced(std::uint8_t counter, Instant time) {
  ++counters.syncs;
  pdos.sync(counter, time);
  if (master_services != nullptr) {
    master_services->synced(time);
  }
}

}  // namespace linegate::node
