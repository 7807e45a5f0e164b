// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/world.h"

#include <algorithm>
#include <array>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/lss/message.h"

namespace linegate::plant {
namespace {

constexpr unsigned kMaxStepsPerInstant = 1000;

// The first frame of a download of the object that makes the device boot.
bool is_download(const can::Frame& frame, const DeviceSeat& device) {
  const std::uint32_t request = can::kSdoRequestBase + device.device->node_id();
  return frame.id == request && frame.length == 8 &&
         (frame.data[0] & std::byte{0xE0}) == std::byte{0x20} &&
         load_le<std::uint16_t>(frame.data.data() + 1) == device.reboots_on;
}

RequestModel::Producer producer_of(sim::Device& device) {
  RequestModel::Producer out;
  out.is_operational = device.alive() && device.node_id() == device.options().node_id &&
                       device.node().state() == nmt::State::operational;
  out.is_configured = [&device](const pdo::Parameters& tpdo) {
    const auto record =
        static_cast<std::uint16_t>(pdo::communication_base(pdo::PdoKind::tpdo) + tpdo.number - 1);
    return device.dictionary().number({record, 1}) == tpdo.cob_id.raw &&
           device.dictionary().number({record, 2}) == tpdo.type;
  };
  out.value = [&device](od::Address address) {
    return device.dictionary().number(address).value_or(0);
  };
  return out;
}

// For an own device: its values are the outputs of its line.
RequestModel::Producer producer_of(line::Line& ours, std::uint8_t node, Instant now) {
  RequestModel::Producer out;
  out.is_operational = ours.node_state(node).state == nmt::State::operational;
  out.is_configured = [](const pdo::Parameters&) { return true; };
  out.value = [&ours, node, now](od::Address address) {
    image::Snapshot snapshot;
    ours.snapshot(image::Direction::outputs, snapshot, now, false);
    const image::Layout& layout = ours.layout(image::Direction::outputs);
    for (const image::Entry& entry : layout.entries) {
      if (entry.node == node && od::Address{entry.index, entry.sub} == address) {
        const auto bytes = std::span<const std::byte>(snapshot.bytes).subspan(entry.bit_offset / 8);
        const std::size_t length = std::min<std::size_t>(bytes.size(), 8);
        return load_le(bytes.first(length)) >> (entry.bit_offset % 8);
      }
    }
    return std::uint64_t{0};
  };
  return out;
}

bool gives_node_id(const can::Frame& frame) {
  const auto message = lss::decode(frame);
  return frame.id == lss::kMasterId && !frame.extended() && message &&
         message->command == lss::Command::configure_node_id;
}

}  // namespace

void World::fail(const std::string& text) {
  if (failure_.empty()) {
    failure_ = text;
  }
}

LineSeat& World::add_line(std::unique_ptr<line::Line> line, const sim::BusOptions& options) {
  return *lines_.emplace_back(std::make_unique<LineSeat>(std::move(line), options));
}

DeviceSeat& World::add_device(LineSeat& seat, std::unique_ptr<sim::Device> device) {
  return seat.devices.emplace_back(
      DeviceSeat{.device = std::move(device), .end = seat.bus.attach()});
}

void World::add_ours(LineSeat& seat, std::unique_ptr<line::Line> devices) {
  seat.ours = std::move(devices);
  seat.silence_of_ours = SilenceModel(seat.ours->config());
  seat.ours->expect_acknowledgements();
  seat.answers_of_ours.emplace(*seat.ours);
  seat.ours_end = seat.bus.attach();
}

LineSeat* World::find(const std::string& name) {
  for (const auto& seat : lines_) {
    if (seat->line->config().name == name) {
      return seat.get();
    }
  }
  return nullptr;
}

void World::start() {
  for (const auto& seat : lines_) {
    for (DeviceSeat& device : seat->devices) {
      device.device->start(now_);
    }
    if (seat->ours != nullptr) {
      seat->ours->start(now_);
    }
    seat->line->start(now_);
    seat->observer->start(now_);
    turn(*seat);
  }
}

// The stopped line still sends its last frames: the pre-operational command to its nodes.
void World::restart(LineSeat& seat, line::LineConfig config, Duration pause) {
  seat.stop(now_);
  settle();
  run(now_ + std::max<Duration>(pause, std::chrono::milliseconds(10)));
  auto made = line::Line::make(std::move(config));
  if (!made.ok()) {
    fail("the line cannot be made: " + to_string(made.diagnostics.front()));
    return;
  }
  seat.take(*std::move(made.value));
  seat.line->start(now_);
  seat.observer->start(now_);
  settle();
}

void World::run(Instant until) {
  while (failure_.empty() && step(until)) {
  }
}

bool World::step(Instant until) {
  const Instant wake = next_wake();
  if (wake > until) {
    now_ = std::max(now_, until);
    return false;
  }
  if (wake > now_) {
    now_ = wake;
    steps_at_now_ = 0;
  } else if (++steps_at_now_ > kMaxStepsPerInstant) {
    fail("time stands still: next_wake() is never later than now of" + busy_participants());
    return false;
  }
  ++steps_;
  settle();
  return failure_.empty();
}

std::string World::busy_participants() const {
  std::string out;
  for (const auto& seat : lines_) {
    const std::string& name = seat->line->config().name;
    if (seat->bus.next_wake() <= now_) {
      out += " the bus of " + name;
    }
    if (seat->line->next_wake() <= now_) {
      out += " the line " + name;
    }
    if (seat->ours != nullptr && seat->ours->next_wake() <= now_) {
      out += " our devices of " + name;
    }
    if (seat->observer->next_wake() <= now_) {
      out += " the observer of " + name;
    }
    for (const DeviceSeat& device : seat->devices) {
      if (device.device->alive() && device.device->next_wake() <= now_) {
        out += " device " + std::to_string(device.device->options().node_id) + " of " + name;
      }
    }
  }
  return out;
}

void World::settle() {
  for (const auto& seat : lines_) {
    turn(*seat);
  }
  carry();
  hand_over();
}

void World::carry() {
  routing::Message message;
  for (bool any = true; std::exchange(any, false);) {
    for (const auto& from : lines_) {
      while (from->line->pop_message(message)) {
        any = true;
        const auto to = std::find_if(lines_.begin(), lines_.end(), [&](const auto& seat) {
          return seat->line->config().routing.interface == message.to;
        });
        if (to != lines_.end()) {
          (*to)->line->deliver(message, now_);
          turn_line(**to);
          collect(**to);
        } else if (const auto back = routing::undeliverable(message)) {
          from->line->deliver(*back, now_);
        }
      }
    }
  }
}

void World::join(LineSeat& from, LineSeat& to, std::span<const line::Following> what) {
  joints_.push_back({&from, &to, line::FollowedInputs(what), line::FollowingOutputs(what), {}});
}

// Hands over the newest values; earlier values may be omitted.
void World::hand_over() {
  for (Joint& joint : joints_) {
    if (joint.inputs.look(*joint.from->line)) {
      joint.waiting = joint.inputs.values();
      joint.due = earlier(joint.due, now_ + std::chrono::microseconds(delays_() % 300));
    }
    if (joint.due > now_) {
      continue;
    }
    joint.due = kNever;
    if (joint.outputs.take(*joint.to->line, joint.waiting, now_)) {
      turn(*joint.to);
    }
  }
}

Instant World::next_wake() const {
  Instant wake = kNever;
  for (const Joint& joint : joints_) {
    wake = earlier(wake, joint.due);
  }
  for (const auto& seat : lines_) {
    wake = earlier(wake, earlier(seat->bus.next_wake(), seat->line->next_wake()));
    wake = earlier(wake, seat->observer->next_wake());
    wake = earlier(wake, seat->ours != nullptr ? seat->ours->next_wake() : kNever);
    for (const DeviceSeat& device : seat->devices) {
      if (device.device->alive()) {
        wake = earlier(wake, device.device->next_wake());
        const bool waits = device.late.empty() || seat->bus.room(device.end) == 0;
        wake = earlier(wake, waits ? kNever : device.late.front().first);
      }
    }
  }
  return wake;
}

void World::turn(LineSeat& seat) {
  seat.bus.advance(now_);
  for (DeviceSeat& device : seat.devices) {
    turn_device(seat, device);
  }
  turn_ours(seat);
  seat.states->look_at(
      *seat.line, [&seat](std::uint8_t id) { return seat.real_state(id); },
      seat.bus.acknowledged(seat.end));
  turn_line(seat);
  turn_observer(seat);
  collect(seat);
  if (std::string text = seat.outputs->compare(seat, now_); !text.empty()) {
    fail("outputs: " + text);
  }
}

// A device that is switched on sends a boot-up message; a device whose cable is plugged in may not
// send until it is requested.
void World::follow_node_id(LineSeat& seat, DeviceSeat& device) {
  constexpr Duration kBootUp = std::chrono::milliseconds(10);
  constexpr Duration kQuestions = std::chrono::milliseconds(1600);
  const sim::Device& is = *device.device;
  const std::uint8_t pending = is.lss_slave().pending().node_id;
  const std::uint8_t later = pending == lss::kNoNodeId ? std::uint8_t{0} : pending;
  const bool there = is.alive() && seat.bus.connected(device.end);
  const std::uint8_t node_id = !there ? std::uint8_t{0} : is.node_id() != 0 ? is.node_id() : later;
  if (node_id != device.use.node_id) {
    device.use.node_id = node_id;
    device.use.shows = now_ + (device.use.alive ? kQuestions : kBootUp);
  }
  device.use.alive = is.alive();
  const std::uint8_t active = there ? is.node_id() : std::uint8_t{0};
  if (active != device.use.active) {
    seat.identities.ends(device.use.active, now_);
    seat.identities.begins(active);
    device.use.active = active;
  }
}

// I5: no other device on the bus uses the node-ID that the device was just assigned.
void World::check_given(LineSeat& seat, const DeviceSeat& device) {
  const lss::Slave& slave = device.device->lss_slave();
  const std::uint8_t given = slave.pending().node_id;
  if (!device.device->alive() || slave.state() != lss::SlaveState::configuration ||
      given == lss::kNoNodeId || given == slave.active_node_id()) {
    return;
  }
  for (const DeviceSeat& other : seat.devices) {
    if (&other != &device && other.use.node_id == given && other.use.shows <= now_) {
      fail("LSS gave node-ID " + std::to_string(given) + " to device " +
           std::to_string(device.device->options().node_id) + " while device " +
           std::to_string(other.device->options().node_id) + " uses it");
    }
  }
  if (given == seat.line->config().node_id) {
    fail("LSS gave away the own node-ID");
  }
}

void World::turn_device(LineSeat& seat, DeviceSeat& device) {
  follow_node_id(seat, device);
  bool given = false;
  while (const std::size_t count = seat.bus.take(device.end, batch_)) {
    given |= std::ranges::any_of(std::span(batch_).first(count), gives_node_id);
    if (!device.model && !device.sdo && !device.requests && device.reboots_on == 0) {
      device.device->receive(std::span(batch_).first(count));
      continue;
    }
    for (const can::Frame& frame : std::span(batch_).first(count)) {
      receive_alone(seat, device, frame);
    }
  }
  if (given) {
    check_given(seat, device);
  }
  device.device->advance(now_);
  if (device.model) {
    device.model->after_advance(*device.device, now_);
  }
  transmit(seat, device);
}

void World::transmit(LineSeat& seat, DeviceSeat& device) {
  if (!device.device->alive()) {
    device.late.clear();
    return;
  }
  const RequestModel::Producer producer =
      device.requests ? producer_of(*device.device) : RequestModel::Producer{};
  while (!device.late.empty() && device.late.front().first <= now_ &&
         seat.bus.room(device.end) > 0) {
    seat.bus.submit(device.end, device.late.front().second, now_);
    device.late.pop_front();
  }
  const std::uint32_t response = can::kSdoResponseBase + device.device->node_id();
  can::Frame frame;
  while (seat.bus.room(device.end) > 0 && device.device->next_frame(frame, now_)) {
    if (device.sdo) {
      device.sdo->follow(frame);
    }
    if (device.requests) {
      check_requests(device.requests->submitted(producer, frame));
    }
    if (device.answers_after > Duration::zero() && frame.id == response && !frame.extended()) {
      device.late.emplace_back(now_ + device.answers_after, frame);
    } else {
      seat.outputs->submitted_by_device(frame);
      seat.bus.submit(device.end, frame, now_);
    }
  }
  if (device.requests) {
    check_requests(device.requests->after_turn(producer, seat.bus.room(device.end) > 0));
  }
}

void World::check_requests(const std::string& text) {
  if (!text.empty()) {
    fail("requests: " + text);
  }
}

void World::receive_alone(LineSeat& seat, DeviceSeat& device, const can::Frame& frame) {
  if (device.model) {
    device.model->before_receive(*device.device, frame);
  }
  if (device.requests) {
    device.requests->before_receive(producer_of(*device.device), frame);
  }
  if (device.reboots_on != 0 && is_download(frame, device)) {
    device.device->kill();
    device.device->revive(now_);
    return;
  }
  const ForeignSdo::Verdict verdict =
      device.sdo ? device.sdo->receive(frame) : ForeignSdo::Verdict{};
  if (verdict.abort_device) {
    can::Frame abort = frame;
    abort.data[0] = std::byte{0x80};
    device.device->receive(std::span(&abort, 1));
  }
  if (!verdict.taken) {
    device.device->receive(std::span(&frame, 1));
  }
  if (device.requests) {
    device.requests->after_receive(producer_of(*device.device), frame);
  }
  if (verdict.answer) {
    seat.bus.submit(device.end, *verdict.answer, now_);
  }
}

void World::turn_line(LineSeat& seat) {
  line::Line& line = *seat.line;
  seat.model->after_call(pop_events(seat));
  bool inputs_changed = false;
  while (const std::size_t count = seat.bus.take(seat.end, batch_)) {
    inputs_changed = true;
    for (const can::Frame& frame : std::span(batch_).first(count)) {
      seat.model->before_receive(frame);
      seat.states->before_receive(frame);
      seat.silence.before_receive(frame);
      seat.answers->before_receive(frame);
      seat.own_outputs->before_receive(frame);
      seat.outputs->look_at_sync(seat, now_);
      line.receive(std::span(&frame, 1), now_);
      seat.outputs->look_at_sync(seat, now_);
      seat.model->after_call(pop_events(seat));
    }
  }
  seat.outputs->look_at_sync(seat, now_);
  seat.answers->acknowledged(seat.bus.acknowledged(seat.end));
  seat.outputs->acknowledged(seat.bus.acknowledged(seat.end));
  seat.own_outputs->acknowledged(seat.bus.acknowledged(seat.end));
  if (inputs_changed) {
    seat.idle_inputs.note(line);
  }
  line.acknowledged(seat.bus.acknowledged(seat.end), now_);
  if (line.advance(now_)) {
    seat.idle_inputs.note(line);
  } else if (std::string text = seat.idle_inputs.compare(line); !text.empty()) {
    fail("inputs: " + text);
  }
  seat.outputs->look_at_sync(seat, now_, true);
  seat.model->after_call(pop_events(seat));
  judge_replies(seat);
  can::Frame frame;
  while (seat.bus.room(seat.end) > 0 && line.next_frame(frame, now_)) {
    if (std::string text = seat.silence.sends(frame); !text.empty()) {
      fail("silence: " + text);
    }
    seat.outputs->submitted(seat, frame, now_);
    seat.own_outputs->submitted(frame);
    seat.answers->submitted(frame, now_);
    seat.states->sends(frame);
    seat.bus.submit(seat.end, frame, now_);
  }
  if (std::string text = seat.states->compare(line, now_); !text.empty()) {
    fail("states: " + text);
  }
}

void World::turn_ours(LineSeat& seat) {
  if (seat.ours == nullptr) {
    return;
  }
  line::Line& line = *seat.ours;
  while (const std::size_t count = seat.bus.take(seat.ours_end, batch_)) {
    for (const can::Frame& frame : std::span(batch_).first(count)) {
      seat.silence_of_ours.before_receive(frame);
      seat.answers_of_ours->before_receive(frame);
      for (auto& [id, requests] : seat.requests_of_ours) {
        requests.before_receive(producer_of(line, id, now_), frame);
      }
      line.receive(std::span(&frame, 1), now_);
      for (auto& [id, requests] : seat.requests_of_ours) {
        requests.after_receive(producer_of(line, id, now_), frame);
      }
    }
  }
  seat.answers_of_ours->acknowledged(seat.bus.acknowledged(seat.ours_end));
  line.acknowledged(seat.bus.acknowledged(seat.ours_end), now_);
  line.advance(now_);
  judge_replies_of_ours(seat);
  can::Frame frame;
  while (seat.bus.room(seat.ours_end) > 0 && line.next_frame(frame, now_)) {
    if (std::string text = seat.silence_of_ours.sends(frame); !text.empty()) {
      fail("silence of our devices: " + text);
    }
    for (auto& [id, requests] : seat.requests_of_ours) {
      check_requests(requests.submitted(producer_of(line, id, now_), frame));
    }
    seat.answers_of_ours->submitted(frame, now_);
    seat.bus.submit(seat.ours_end, frame, now_);
  }
  for (auto& [id, requests] : seat.requests_of_ours) {
    const bool has_room = seat.bus.room(seat.ours_end) > 0;
    check_requests(requests.after_turn(producer_of(line, id, now_), has_room));
  }
}

// An observer is asked for frames like any other line, although it must not send any.
void World::turn_observer(LineSeat& seat) {
  line::Line& line = *seat.observer;
  while (const std::size_t count = seat.bus.take(seat.observer_end, batch_)) {
    line.receive(std::span(batch_).first(count), now_);
  }
  line.advance(now_);
  can::Frame frame;
  while (line.wants_to_send(now_) || line.next_frame(frame, now_)) {
    seat.bus.submit(seat.observer_end, frame, now_);
    fail("the observer of " + line.config().name + " has something to send");
    return;
  }
}

// Returns the new events.
std::span<const Event> World::pop_events(LineSeat& seat) {
  const std::size_t before = seat.events.size();
  while (const std::size_t count = seat.line->pop_events(told_)) {
    seat.events.insert(seat.events.end(), told_.begin(), told_.begin() + static_cast<long>(count));
    judge(seat, std::span(told_).first(count));
  }
  return std::span(seat.events).subspan(before);
}

// Checks events of the line or of its observer.
void World::judge(const LineSeat& seat, std::span<const Event> events) {
  for (const Event& event : events) {
    if (std::string text = seat.identities.judge(event, now_); !text.empty()) {
      fail("identities: " + text);
    }
  }
}

void World::judge_replies(LineSeat& seat) {
  line::Reply reply;
  while (seat.line->pop_reply(reply)) {
    if (!seat.replies.emplace(reply.tag, reply).second) {
      ++seat.duplicate_replies;
    }
    if (std::string text = seat.answers->answered(reply, seat.events, now_); !text.empty()) {
      fail("answers: " + text);
    }
    if (std::string text = seat.own_outputs->answered(reply); !text.empty()) {
      fail("answers of own outputs: " + text);
    }
  }
}

void World::judge_replies_of_ours(LineSeat& seat) {
  line::Reply reply;
  while (seat.ours->pop_reply(reply)) {
    if (std::string text = seat.answers_of_ours->answered(reply, now_); !text.empty()) {
      fail("answers of our devices: " + text);
    }
  }
}

void World::collect_of_ours(LineSeat& seat) {
  while (const std::size_t count = seat.ours->pop_events(told_)) {
    seat.ours_events.insert(seat.ours_events.end(), told_.begin(),
                            told_.begin() + static_cast<long>(count));
  }
  judge_replies_of_ours(seat);
  if (std::string text = seat.answers_of_ours->compare(now_); !text.empty()) {
    fail("answers of our devices: " + text);
  }
}

void World::collect(LineSeat& seat) {
  while (const std::size_t count = seat.bus.take(seat.witness_end, batch_)) {
    seat.frames.insert(seat.frames.end(), batch_.begin(),
                       batch_.begin() + static_cast<long>(count));
  }
  pop_events(seat);
  while (const std::size_t count = seat.observer->pop_events(told_)) {
    seat.observed.insert(seat.observed.end(), told_.begin(),
                         told_.begin() + static_cast<long>(count));
    judge(seat, std::span(told_).first(count));
  }
  if (seat.ours != nullptr) {
    collect_of_ours(seat);
  }
  judge_replies(seat);
  if (std::string text = seat.answers->compare(seat.events, now_); !text.empty()) {
    fail("answers: " + text);
  }
  if (std::string text = seat.own_outputs->compare(now_); !text.empty()) {
    fail("own outputs: " + text);
  }
}

}  // namespace linegate::plant
