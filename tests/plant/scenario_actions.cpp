// SPDX-License-Identifier: Apache-2.0
// The actions of `at`.
#include <algorithm>
#include <utility>

#include "tests/plant/scenario_run.h"

namespace linegate::plant {

using image::Direction;

namespace {

// Padded with zeros to the next length of CAN FD.
can::Frame fd_frame(std::uint32_t id, std::span<const std::byte> data) {
  if (data.size() > can::kMaxFdData) {
    throw BadStatement("a frame of CAN FD has at most 64 bytes");
  }
  can::Frame out;
  out.id = id;
  out.flags = can::Frame::kFd | can::Frame::kBitRateSwitch;
  out.length = can::fd_length(data.size());
  std::ranges::copy(data, out.data.begin());
  return out;
}

}  // namespace

void Scenario::act(Words& words) {
  if (words.done()) {
    return;
  }
  const std::string verb = words.take();
  if (verb == "node") {
    node_action(words);
  } else if (verb == "sdo") {
    sdo_action(words);
  } else if (verb == "object" || verb == "trigger" || verb == "send" || verb == "listen" ||
             verb == "emcy" || verb == "mpdo" || verb == "request") {
    data_action(verb, words);
  } else if (verb == "nmt") {
    nmt_action(words);
  } else if (verb == "boot") {
    boot_action(words);
  } else if (verb == "scan") {
    const std::string name = words.take();
    command({.request = line::Scan{.node = words.node()}}, name);
  } else if (verb == "output") {
    const std::string name = words.peek();
    line::SingleOutput output{.entry = output_entry(*seat().line, words.take())};
    words.expect("=");
    output.data = words.hex();
    command({.request = std::move(output)}, name);
  } else if (verb == "ours") {
    ours_action(words);
  } else if (verb == "lss") {
    const std::string name = words.take();
    line::LssRequest request{.procedure = static_cast<lss::Procedure>(words.number())};
    request.arguments = words.done() ? std::vector<std::byte>{} : words.hex();
    seat().reports.insert(next_tag_);
    command({.request = std::move(request)}, name);
  } else if (verb == "write") {
    group_write(words);
  } else if (verb == "frame") {
    inject(words);
  } else if (verb == "losses") {
    losses_ = words.number();
    set_disturbance();
  } else if (verb == "doubles") {
    doubles_ = words.number();
    set_disturbance();
  } else if (verb == "swallow") {
    const auto id = static_cast<std::uint32_t>(words.number());
    swallowed_[id] = words.done() ? ~std::uint64_t{0} : words.number();
    set_disturbance();
  } else if (verb == "restart") {
    restart(words);
  } else if (verb == "acknowledge") {
    acknowledge(words.take() == "on");
  } else if (verb == "bus") {
    bus_action(words);
  } else if (verb == "stop") {
    seat().stop(world_.now());
  } else {
    throw BadStatement("unknown action '" + verb + "'");
  }
}

void Scenario::node_action(Words& words) {
  const std::uint8_t id = words.node();
  DeviceSeat* device = seat().find(id);
  if (device == nullptr) {
    throw BadStatement("there is no device " + std::to_string(id));
  }
  const std::string what = words.take();
  if (what == "dies") {
    switch_off(*device);
  } else if (what == "returns") {
    if (!device->device->alive()) {
      device->device->revive(world_.now());
    }
  } else if (what == "blinks") {
    blink(*device);
  } else if (what == "strays") {
    if (device->device->alive()) {
      device->device->node().command(nmt::Command::enter_pre_operational, world_.now());
    }
  } else if (what == "unplugged") {
    seat().bus.set_connected(device->end, false, world_.now());
  } else if (what == "plugged") {
    seat().bus.set_connected(device->end, true, world_.now());
  } else {
    throw BadStatement("a node dies, returns, blinks, strays, is unplugged or plugged; not '" +
                       what + "'");
  }
}

void Scenario::switch_off(DeviceSeat& device) {
  device.device->kill();
  if (device.model) {
    device.model->power_off();
  }
}

// restart [after TIME] [as NAME] [sync TIME] [heartbeat TIME] [without NODE]
// Events of the previous line are ignored from now on.
void Scenario::restart(Words& words) {
  LineSeat& target = seat();
  const Duration pause = words.accept("after") ? words.duration() : Duration{};
  line::LineConfig config = target.line->config();
  while (!words.done()) {
    const std::string key = words.take();
    if (key == "as") {
      config.name = words.take();
    } else if (key == "sync") {
      config.sync_period = words.duration();
    } else if (key == "heartbeat") {
      config.heartbeat = words.duration();
    } else if (key == "without") {
      const std::uint8_t node = words.node();
      if (std::erase_if(config.nodes, [node](const auto& each) { return each.id == node; }) == 0) {
        throw BadStatement("the line has no node " + std::to_string(node));
      }
    } else {
      throw BadStatement("unknown change of a line '" + key + "'");
    }
  }
  world_.restart(target, std::move(config), pause);
  commands_[&target] = 0;
  event_cursor_ = 0;
  observed_cursor_ = 0;
}

// Switches the device off and immediately on.
void Scenario::blink(DeviceSeat& device) {
  if (device.device->alive()) {
    switch_off(device);
    device.device->revive(world_.now());
  }
}

void Scenario::command(line::Command request, const std::string& name) {
  request.tag = next_tag_++;
  tags_[name] = request.tag;
  ++commands_[&seat()];
  seat().silence.commanded(request);
  seat().states->commanded(*seat().line, request);
  seat().answers->commanded(request, world_.now());
  seat().own_outputs->commanded(request);
  seat().outputs->commanded(seat(), request);
  seat().line->execute(std::move(request), world_.now());
}

// object NAME NODE INDEX:SUB HEX; mpdo the same; trigger, request NAME NODE PDO; emcy NAME CODE;
// send NAME ID HEX; listen NAME ID
void Scenario::data_action(const std::string& verb, Words& words) {
  constexpr std::uint8_t kGenericError = 1;
  const std::string name = words.take();
  line::Request request;
  if (verb == "object") {
    line::ObjectWrite write{.node = words.node()};
    write.address = words.address();
    write.data = words.hex();
    request = std::move(write);
  } else if (verb == "mpdo") {
    line::MpdoWrite write{.node = words.node()};
    write.address = words.address();
    write.data = words.hex();
    request = std::move(write);
  } else if (verb == "trigger") {
    line::PdoTrigger trigger{.node = words.node()};
    trigger.number = static_cast<std::uint16_t>(words.number());
    request = trigger;
  } else if (verb == "request") {
    line::PdoRequest pdo{.node = words.node()};
    pdo.number = static_cast<std::uint16_t>(words.number());
    request = pdo;
  } else if (verb == "emcy") {
    request = line::EmcySend{.code = static_cast<std::uint16_t>(words.number()),
                             .error_register = kGenericError};
  } else if (verb == "send") {
    const auto id = static_cast<std::uint32_t>(words.number());
    request = line::CanSend{can::make_frame(id, words.hex())};
  } else {
    request = line::CanListen{.identifier = static_cast<std::uint32_t>(words.number()),
                              .extended = false,
                              .duration = std::chrono::seconds(60)};
  }
  command({.request = std::move(request)}, name);
}

void Scenario::sdo_action(Words& words) {
  line::Command request;
  const bool write = words.accept("write");
  if (!write) {
    words.expect("read");
  }
  const std::string name = words.take();
  const std::uint8_t node = words.node();
  const od::Address address = words.address();
  std::vector<std::byte> data;
  if (write) {
    data = words.accept("pattern") ? pattern(words.number()) : words.hex();
  }
  if (words.accept("network")) {
    const auto network = static_cast<std::uint16_t>(words.number());
    const bool as_device = words.accept("as-device");
    if (write) {
      request.request = line::NetworkWrite{.network = network,
                                           .node = node,
                                           .address = address,
                                           .as_device = as_device,
                                           .data = std::move(data)};
    } else {
      request.request = line::NetworkRead{
          .network = network, .node = node, .address = address, .as_device = as_device};
    }
  } else if (write) {
    request.request = line::SdoWrite{.node = node, .address = address, .data = std::move(data)};
  } else {
    request.request = line::SdoRead{.node = node, .address = address};
  }
  if (words.accept("timeout")) {
    request.timeout = words.duration();
  }
  command(std::move(request), name);
}

void Scenario::nmt_action(Words& words) {
  const std::string name = words.take();
  constexpr std::pair<std::string_view, nmt::Command> kCommands[] = {
      {"start", nmt::Command::start},
      {"stop", nmt::Command::stop},
      {"pre-operational", nmt::Command::enter_pre_operational},
      {"reset-node", nmt::Command::reset_node},
      {"reset-communication", nmt::Command::reset_communication},
  };
  const auto it = std::ranges::find(kCommands, name, [](const auto& c) { return c.first; });
  if (it == std::end(kCommands)) {
    throw BadStatement("unknown NMT command '" + name + "'");
  }
  command({.request = line::NmtRequest{.node = words.node(), .command = it->second}}, "nmt");
}

// write GROUP arming N [watchdog T] [reactions BITS] NODE.INDEX:SUB=HEX ...
void Scenario::group_write(Words& words) {
  const image::Layout& layout = seat().line->layout(Direction::outputs);
  line::OutputWrite write;
  write.group = static_cast<std::uint16_t>(words.number());
  write.layout_id = layout.id;
  words.expect("arming");
  write.arming = words.number();
  if (words.accept("watchdog")) {
    write.watchdog = words.duration();
  }
  if (words.accept("reactions")) {
    write.reactions = static_cast<std::uint8_t>(words.number());
  }
  while (!words.done()) {
    const std::string name = words.take();
    words.expect("=");
    const std::vector<std::byte> data = words.hex();
    for (const std::uint32_t entry : output_entries(*seat().line, name)) {
      line::OutputValue value{.entry = entry, .length = static_cast<std::uint8_t>(data.size())};
      std::copy_n(data.begin(), std::min(data.size(), value.data.size()), value.data.begin());
      write.values.push_back(value);
    }
  }
  seat().answers->written(write);
  seat().own_outputs->written(write);
  seat().line->write_outputs(write, world_.now());
}

// frame ID [HEX], frame ID remote LENGTH, frame ID fd HEX: from a foreign station on the bus. frame
// none: its queued frames are discarded.
void Scenario::inject(Words& words) {
  if (words.accept("none")) {
    seat().bus.flush(seat().witness_end);
    return;
  }
  const auto id = static_cast<std::uint32_t>(words.number());
  if (words.accept("remote")) {
    can::Frame request;
    request.id = id;
    request.flags = can::Frame::kRemote;
    request.length = static_cast<std::uint8_t>(words.number());
    seat().bus.submit(seat().witness_end, request, world_.now());
    return;
  }
  const bool fd = words.accept("fd");
  const std::vector<std::byte> data = words.done() ? std::vector<std::byte>{} : words.hex();
  LineSeat& target = seat();
  if (id > can::kErrorControlBase && id <= can::kErrorControlBase + can::kMaxNodeId) {
    target.identities.imitated(static_cast<std::uint8_t>(id - can::kErrorControlBase));
  }
  target.bus.submit(target.witness_end,
                    fd ? fd_frame(id, data) : can::make_frame(id, std::span(data)), world_.now());
}

// losses N: N of a thousand frames are lost, and as many are destroyed and repeated.
// doubles N: N of a thousand frames arrive twice.
void Scenario::set_disturbance() {
  seat().set_disturbance(
      [this, losses = losses_, doubles = doubles_](const can::Frame& frame, sim::Bus::Endpoint) {
        if (is_silent_) {
          return sim::Fate::disturbed;
        }
        const auto swallowed = swallowed_.find(frame.id);
        if (swallowed != swallowed_.end() && swallowed->second > 0) {
          --swallowed->second;
          return sim::Fate::lost;
        }
        const std::uint64_t dice = chance_() % 1000;
        if (dice < losses) {
          return sim::Fate::lost;
        }
        if (dice < 2 * losses) {
          return sim::Fate::disturbed;
        }
        return dice < 2 * losses + doubles ? sim::Fate::doubled : sim::Fate::delivered;
      });
}

// Without an acknowledgement a device that was switched on or connected cannot be detected.
void Scenario::acknowledge(bool on) {
  const Instant now = world_.now();
  if (on && is_silent_) {
    for (DeviceSeat& device : seat().devices) {
      const bool late = device.use.shows != kNever && device.use.shows > silent_since_;
      device.use.shows += late ? now - silent_since_ : Duration{};
    }
  }
  is_silent_ = !on;
  silent_since_ = now;
  set_disturbance();
}

// The controller of a line goes bus-off, or returns.
can::BusEvent Scenario::connect(sim::Bus::Endpoint end, bool on) {
  can::BusEvent event;
  event.kind = can::BusEvent::Kind::state;
  event.time = world_.now();
  event.state = on ? can::BusState::error_active : can::BusState::bus_off;
  seat().bus.set_connected(end, on, world_.now());
  return event;
}

// bus off|on; off: the controller also loses its frames.
void Scenario::bus_action(Words& words) {
  LineSeat& at = seat();
  const bool on = words.take() == "on";
  at.line->bus_event(connect(at.end, on));
  at.own_outputs->set_bus(on);
  if (!on) {
    const std::uint64_t acknowledged = at.bus.acknowledged(at.end);
    at.bus.flush(at.end);
    at.outputs->flushed();
    at.states->flushed();
    at.answers->lost(acknowledged + 1, at.bus.acknowledged(at.end));
    at.own_outputs->lost(acknowledged + 1, at.bus.acknowledged(at.end));
    at.line->lost(acknowledged + 1, at.bus.acknowledged(at.end));
  }
}

void Scenario::lose_frames_of_ours() {
  LineSeat& at = seat();
  const std::uint64_t first = at.bus.acknowledged(at.ours_end) + 1;
  at.bus.flush(at.ours_end);
  const std::uint64_t last = at.bus.acknowledged(at.ours_end);
  if (first <= last) {
    at.answers_of_ours->lost(first, last);
    ours().lost(first, last);
  }
}

// ours bus off|on; ours loses (the controller loses its frames). Returns false for another action.
bool Scenario::ours_bus_action(const std::string& verb, Words& words) {
  if (verb == "loses") {
    lose_frames_of_ours();
    return true;
  }
  if (verb != "bus") {
    return false;
  }
  const bool on = words.take() == "on";
  line::Line& devices = ours();
  devices.bus_event(connect(seat().ours_end, on));
  seat().answers_of_ours->set_bus(on);
  if (!on) {
    lose_frames_of_ours();
  }
  return true;
}

// ours output NODE.INDEX:SUB = HEX; ours write NODE INDEX:SUB HEX; ours trigger NODE PDO; ours emcy
// NODE CODE; see ours_bus_action()
void Scenario::ours_action(Words& words) {
  line::Command request;
  const std::string verb = words.take();
  if (ours_bus_action(verb, words)) {
    return;
  }
  if (verb == "output") {
    line::SingleOutput output{.entry = output_entry(ours(), words.take())};
    words.expect("=");
    output.data = words.hex();
    request.request = std::move(output);
  } else if (verb == "write") {
    line::LocalWrite write{.node = words.node()};
    write.address = words.address();
    write.as_owner = true;
    write.data = words.hex();
    request.request = std::move(write);
  } else if (verb == "trigger") {
    line::PdoTrigger trigger{.node = words.node()};
    trigger.number = static_cast<std::uint16_t>(words.number());
    request.request = trigger;
  } else if (verb == "emcy") {
    line::EmcySend emcy{.node = words.node()};
    emcy.code = static_cast<std::uint16_t>(words.number());
    emcy.error_register = 1;  // generic error
    request.request = emcy;
  } else {
    throw BadStatement("our devices have no action '" + verb + "'");
  }
  request.tag = next_tag_++;
  line::Line& devices = ours();
  seat().answers_of_ours->commanded(request, world_.now());
  devices.execute(std::move(request), world_.now());
}

line::Line& Scenario::ours() {
  if (seat().ours == nullptr) {
    throw BadStatement("there are no devices of ours");
  }
  return *seat().ours;
}

// NODE.INDEX:SUB -> entries of the output layout: one in each PDO that carries the object.
std::vector<std::uint32_t> Scenario::output_entries(const line::Line& line,
                                                    const std::string& text) {
  const std::size_t dot = text.find('.');
  const auto node = to_number(text.substr(0, dot));
  const od::Address address = parse_address(text.substr(dot + 1));
  const image::Layout& layout = line.layout(Direction::outputs);
  std::vector<std::uint32_t> out;
  for (std::uint32_t i = 0; i < layout.entries.size(); ++i) {
    const image::Entry& entry = layout.entries[i];
    if (entry.node == node && od::Address{entry.index, entry.sub} == address) {
      out.push_back(i);
    }
  }
  if (out.empty()) {
    throw BadStatement("no output entry " + text);
  }
  return out;
}

}  // namespace linegate::plant
