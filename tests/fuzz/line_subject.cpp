// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/line_subject.h"

#include <algorithm>
#include <utility>

#include "stack/scan/describe.h"
#include "stack/scan/scanned_node.h"

#include "tests/fuzz/expect.h"

namespace linegate::fuzz {
namespace {

using std::chrono::milliseconds;

constexpr std::uint8_t kOwnNode = 10;
// A larger number of frames at one instant means that the line never becomes idle.
constexpr unsigned kMostFrames = 100'000;

// Entries 0 and 1 are in one group, 2 in another, and the others in no group.
void divide_outputs(line::LineConfig& config) {
  config.groups = {{.number = 1, .name = "first", .entries = {0, 1}},
                   {.number = 2, .name = "second", .entries = {2}, .send_always = true}};
  config.defaults = {{.entry = 1, .value = 7}};
}

// The line is network 1, and another line is network 2. Network 3 is behind a gateway on line 2,
// and network 4 behind a gateway on this line.
void route(line::LineConfig& config) {
  config.network_id = 1;
  routing::Config& routing = config.routing;
  routing.interface = LineSubject::kInterface;
  routing.interfaces = {{.number = 1, .network = 1, .node = kOwnNode},
                        {.number = 2, .network = 2, .node = 100}};
  routing.routes = {{.first = 2, .last = 2, .interface = 2},
                    {.first = 3, .last = 3, .interface = 2, .gateway = 9, .cost = 10},
                    {.first = 3, .last = 3, .interface = 2, .gateway = 8, .cost = 20},
                    {.first = 4, .last = 4, .interface = 1, .gateway = 5, .cost = 10}};
  routing.gateways = {6};
  routing.emcy_networks.fill(0xF);
  routing.access = {
      {.first = 2, .last = 99, .sdo_read = true, .sdo_write = true, .emcy = true, .pdo = true},
      {.first = 100, .last = 199, .sdo_read = true}};
  routing.channels = routing::ChannelRule::per_node;
  routing.additional_servers = 1;
}

line::OwnObject own_object(std::uint16_t index, od::Access access) {
  line::OwnObject out{.index = index, .variable = {}, .in_image = true};
  out.variable.name = "own";
  out.variable.type = od::DataType::unsigned16;
  out.variable.access = access;
  out.variable.mappable = true;
  out.variable.value.resize(2);
  return out;
}

void set_manager(const Setup& setup, line::LineConfig& config) {
  config.strict_ixxat = setup.strict_ixxat;
  config.keep_operational = setup.keep_operational;
  config.reset_nodes = setup.reset_nodes;
  config.start_all = setup.start_all;
  config.start_nodes = !setup.starts_nobody;
  config.own_start = !setup.starts_nobody;
  if (setup.stop_all || setup.reset_all) {
    config.on_error =
        setup.reset_all ? manager::ErrorReaction::reset_all : manager::ErrorReaction::stop_all;
  }
  config.boot_time = milliseconds(setup.boot_time ? 1000 : 0);
  config.pdo_update_time = milliseconds(setup.update_time ? 50 : 0);
  config.lss.assign = setup.lss && !setup.fd;
  config.lss.store = setup.store;
}

line::NodeConfig node_config(const Setup& setup, std::size_t member) {
  line::NodeConfig node = member_node(member, setup.fd);
  const bool is_guarded = member == 1 && setup.guarding && !setup.fd;
  node.mandatory = member == 0 || setup.all_mandatory;
  node.guard_time = milliseconds(is_guarded ? 100 : 0);
  node.life_time_factor = is_guarded ? 3 : 0;
  node.keep_alive = setup.keep_alive && member < 2;
  node.restore = setup.store ? 1 : 0;
  node.store = setup.store ? 1 : 0;
  if (setup.program && member == 0) {
    node.software = 0x0102'0304;
    node.update_software = true;
    node.program =
        std::make_shared<const std::vector<std::byte>>(std::size_t{100}, std::byte{0x55});
  }
  return node;
}

line::LineConfig devices_config(const Setup& setup) {
  line::LineConfig config;
  config.name = "devices";
  config.role = line::Role::device;
  config.node_id = 0;
  config.bit_rate = 500'000;
  config.canopen_fd = setup.fd;
  for (std::size_t i = 0; i < kMembers.size(); ++i) {
    line::DeviceConfig device{.id = kMembers[i].id, .name = {}, .device = description(i, setup.fd)};
    device.lss = i == 2 && setup.lss && !setup.fd;
    config.devices.push_back(std::move(device));
  }
  return config;
}

bool may_route(const Setup& setup) {
  return (setup.role == Role::manager || setup.role == Role::device) && !setup.fd;
}

line::Role role_of(Role role) {
  switch (role) {
    case Role::manager:
      return line::Role::manager;
    case Role::observer:
      return line::Role::observer;
    case Role::device:
    case Role::devices:
      break;
  }
  return line::Role::device;
}

void add_nodes(const Setup& setup, line::LineConfig& config) {
  for (std::size_t i = 0; i < kMembers.size() && !setup.unknown_nodes; ++i) {
    config.nodes.push_back(node_config(setup, i));
  }
  if (setup.groups && !setup.unknown_nodes) {
    divide_outputs(config);
  }
}

line::LineConfig config_for(const Setup& setup) {
  line::LineConfig config;
  if (setup.role == Role::devices) {
    config = devices_config(setup);
    if (setup.groups) {
      divide_outputs(config);
    }
  } else {
    config.node_id = kOwnNode;
    config.role = role_of(setup.role);
    add_nodes(setup, config);
  }
  config.name = "fuzz";
  config.bit_rate = 500'000;
  config.canopen_fd = setup.fd;
  if (!setup.fd) {
    config.connection_pool = {0x6A0, 0x6A3};
  }
  config.heartbeat = setup.heartbeat ? milliseconds(100) : Duration::zero();
  config.sync_period = setup.sync ? milliseconds(10) : Duration::zero();
  config.time_period = setup.time ? milliseconds(50) : Duration::zero();
  config.stores_parameters = setup.time;
  if (may_route(setup)) {
    route(config);
  }
  if (setup.role == Role::manager || setup.role == Role::device) {
    set_manager(setup, config);
    if (setup.own_objects) {
      config.own_objects = {own_object(0x2000, od::Access::rw), own_object(0x6000, od::Access::ro)};
    }
  }
  return config;
}

// The input plays the encoder, unless the encoder is the device without a node-ID.
line::LineConfig answering_devices(const Setup& setup) {
  line::LineConfig config = devices_config(setup);
  if (!setup.lss) {
    config.devices.pop_back();
  }
  return config;
}

}  // namespace

LineSubject::LineSubject(const Setup& setup)
    : setup_(setup), routes_(may_route(setup)), subject_(config_for(setup)) {
  if (setup.time) {
    line().set_utc(std::chrono::hours(24 * 365 * 20));
  }
  if (setup.answering && setup.role != Role::devices) {
    devices_.emplace(answering_devices(setup));
    devices_->line().start(now_);
  }
  line().start(now_);
}

void LineSubject::hear(std::span<const can::Frame> frames) {
  subject_.hear(frames, now_);
  check_messages();
}

void LineSubject::execute(line::Command command) {
  if (!stopped_) {
    subject_.execute(std::move(command), now_);
    check_messages();
  }
}

void LineSubject::deliver(const routing::Message& message) {
  line().deliver(message, now_);
  if (!routes_) {
    check_refusal(message);
  }
  check_messages();
}

// A line that does not route rejects a message on behalf of the interface it was addressed to.
void LineSubject::check_refusal(const routing::Message& message) {
  const auto refusal = routing::undeliverable(message);
  routing::Message out;
  LINEGATE_EXPECT(line().pop_message(out) == refusal.has_value());
  if (refusal) {
    LINEGATE_EXPECT(out.from == message.to && out.to == message.from);
    LINEGATE_EXPECT(out.kind == refusal->kind && out.connection == message.connection);
  }
}

// Takes the messages to other lines. The input determines the reactions of those lines.
void LineSubject::check_messages() {
  routing::Message message;
  while (line().pop_message(message)) {
    LINEGATE_EXPECT(routes_ && message.from == kInterface && message.to != kInterface);
    LINEGATE_EXPECT(message.kind <= routing::MessageKind::sdo_paced);
    if (message.kind == routing::MessageKind::sdo_open) {
      LINEGATE_EXPECT(message.connection != 0 && message.node < 128 && message.gateway < 128);
      std::shift_right(opened_.begin(), opened_.end(), 1);
      opened_[0] = message.connection;
    }
  }
}

// Without further messages, no connection is kept longer than its time-outs.
void LineSubject::expect_no_connection() {
  for (int i = 0; i < 3; ++i) {
    sleep(std::chrono::seconds(10));
    advance();
    lose(~0U);
    check_messages();
  }
  const routing::Counters counters = line().state().routing;
  LINEGATE_EXPECT(counters.open == 0 && counters.channels == 0);
  LINEGATE_EXPECT(counters.opened == counters.finished + counters.aborted + counters.timed_out);
}

void LineSubject::stop() {
  line().stop(now_);
  stopped_ = true;
}

void LineSubject::advance() {
  subject_.advance(now_);
  check_messages();
}

void LineSubject::pass(Duration time) {
  const Instant until = now_ + time;
  advance();
  send(~0U);
  while (true) {
    const Instant wake =
        earlier(line().next_wake(), devices_ ? devices_->line().next_wake() : kNever);
    if (wake > until) {
      break;
    }
    now_ = std::max(now_, wake);
    advance();
    send(~0U);
  }
  now_ = until;
}

bool LineSubject::next(can::Frame& frame) {
  const bool given = subject_.next_frame(frame, now_);
  LINEGATE_EXPECT(!given || setup_.role != Role::observer);
  return given;
}

void LineSubject::send(unsigned frames) {
  can::Frame frame;
  for (unsigned i = 0; i < frames; ++i) {
    turn_devices();
    if (!next(frame)) {
      return;
    }
    LINEGATE_EXPECT(i < kMostFrames);
    frame.time = now_;
    if (devices_ && plugged_) {
      devices_->hear(std::span(&frame, 1), now_);
    }
  }
}

void LineSubject::lose(unsigned frames) {
  can::Frame frame;
  while (frames != 0 && next(frame)) {
    --frames;
  }
}

void LineSubject::turn_devices() {
  if (!devices_) {
    return;
  }
  can::Frame frame;
  devices_->advance(now_);
  while (devices_->next_frame(frame, now_)) {
    frame.time = now_;
    if (plugged_) {
      hear(std::span(&frame, 1));
    }
  }
  devices_->pop_events(64);
}

void LineSubject::finish() {
  pass(milliseconds(20));
  stop();
  lose(~0U);
  expect_no_connection();
  subject_.expect_end();
  if (devices_) {
    devices_->line().stop(now_);
    can::Frame frame;
    while (devices_->next_frame(frame, now_)) {
    }
    devices_->expect_end();
  }
  run_what_was_found();
}

// The result of a scan, whatever the devices answered, is a valid configuration, or an error says
// why not.
void LineSubject::run_what_was_found() {
  if (subject_.found().empty()) {
    return;
  }
  line::LineConfig config;
  config.name = "found";
  config.canopen_fd = setup_.fd;
  config.node_id = kOwnNode;
  config.scanned = subject_.found();
  for (const scan::ScannedNode& found : config.scanned) {
    line::NodeConfig node;
    node.id = found.id;
    node.device = scan::describe(found);
    node.as_found = true;
    config.nodes.push_back(std::move(node));
  }
  auto made = line::Line::make(std::move(config));
  LINEGATE_EXPECT(made.ok() || has_errors(made.diagnostics));
  if (made.ok()) {
    (*made.value)->start(now_);
    (*made.value)->advance(now_ + std::chrono::seconds(1));
  }
}

}  // namespace linegate::fuzz
