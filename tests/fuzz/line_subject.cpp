#include "tests/fuzz/line_subject.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "bridges/sim/device.h"
#include "stack/base/byte_order.h"
#include "stack/eds/reader.h"
#include "stack/od/dictionary.h"

#include "tests/fuzz/expect.h"

namespace linegate::fuzz {
namespace {

using std::chrono::milliseconds;

constexpr std::uint8_t kOwnNode = 10;
// More work at one instant than any of it is worth: time stands still.
constexpr unsigned kMostTurns = 1000;

struct Member {
  std::uint8_t id;
  std::string_view profile;
  bool answers;  // the encoder's part is played by the input
};
constexpr std::array<Member, 3> kMembers{
    {{5, "drive", true}, {6, "digital-io", true}, {7, "encoder", false}}};

// Read once: thousands of inputs have the same device files.
const od::DeviceDescription& description(std::size_t member) {
  static const auto kDescriptions = [] {
    std::array<od::DeviceDescription, kMembers.size()> out;
    for (std::size_t i = 0; i < kMembers.size(); ++i) {
      const Member& m = kMembers[i];
      auto loaded = eds::load(sim::eds_text(m.profile), sim::eds_name(m.profile), m.id);
      LINEGATE_EXPECT(loaded.ok());
      out[i] = *std::move(loaded.value);
    }
    return out;
  }();
  return kDescriptions[member];
}

// Entries 0 and 1 in one group, 2 in another, the others in none.
void divide_outputs(line::LineConfig& config) {
  config.groups = {{.number = 1, .name = "first", .entries = {0, 1}},
                   {.number = 2, .name = "second", .entries = {2}, .send_always = true}};
  config.defaults = {{.entry = 1, .value = 7}};
}

// The line is network 1; network 2 is that of another line, 3 and 4 lie behind gateways on either.
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

line::LineConfig config_for(const Setup& setup) {
  line::LineConfig config;
  config.name = "fuzz";
  config.bit_rate = 500'000;
  config.node_id = kOwnNode;
  config.role = setup.device_role ? line::Role::device : line::Role::manager;
  config.heartbeat = setup.heartbeat ? milliseconds(100) : Duration::zero();
  config.sync_period = setup.sync ? milliseconds(10) : Duration::zero();
  config.reset_nodes = setup.reset_nodes;
  config.time_period = setup.time ? milliseconds(50) : Duration::zero();
  config.stores_parameters = setup.time;
  for (std::size_t i = 0; i < kMembers.size(); ++i) {
    line::NodeConfig node;
    node.id = kMembers[i].id;
    node.device = description(i);
    node.mandatory = i == 0;
    node.heartbeat = milliseconds(i == 1 ? 0 : 100);
    node.guard_time = milliseconds(i == 1 && setup.guarding ? 100 : 0);
    node.life_time_factor = i == 1 && setup.guarding ? 3 : 0;
    node.pdo_deadline = milliseconds(i == 2 ? 50 : 0);
    config.nodes.push_back(std::move(node));
  }
  if (setup.groups) {
    divide_outputs(config);
  }
  route(config);
  return config;
}

void check_frame(const can::Frame& frame) {
  LINEGATE_EXPECT(!frame.fd() && frame.length <= can::kMaxClassicData);
  LINEGATE_EXPECT(frame.id <= (frame.extended() ? 0x1FFF'FFFFU : 0x7FFU));
}

}  // namespace

LineSubject::Device::Device(const od::DeviceDescription& description, std::uint8_t id)
    : events(64),
      node(std::make_unique<node::Node>(od::Dictionary(description), node::Options{.node_id = id},
                                        events, nullptr)) {
}

LineSubject::LineSubject(const Setup& setup) {
  auto made = line::Line::make(config_for(setup));
  LINEGATE_EXPECT(made.ok());
  line_ = *std::move(made.value);
  if (setup.time) {
    line_->set_utc(std::chrono::hours(24 * 365 * 20));
  }
  for (std::size_t i = 0; i < kMembers.size(); ++i) {
    if (setup.answering && kMembers[i].answers) {
      devices_.push_back(std::make_unique<Device>(description(i), kMembers[i].id));
      devices_.back()->node->start(now_);
    }
  }
  line_->start(now_);
}

void LineSubject::hear(std::span<const can::Frame> frames) {
  line_->receive(frames, now_);
  take_messages();
  heard_ += frames.size();
}

void LineSubject::execute(line::Command command) {
  if (stopped_) {
    return;
  }
  command.tag = next_tag_++;
  open_.insert(command.tag);
  line_->execute(std::move(command), now_);
  take_messages();
}

void LineSubject::deliver(const routing::Message& message) {
  line_->deliver(message, now_);
  take_messages();
}

// What the others have to do with it is up to the input.
void LineSubject::take_messages() {
  routing::Message message;
  while (line_->take_message(message)) {
    LINEGATE_EXPECT(message.from == kInterface && message.to != kInterface);
    LINEGATE_EXPECT(message.kind <= routing::MessageKind::pdo);
    if (message.kind == routing::MessageKind::sdo_open) {
      LINEGATE_EXPECT(message.connection != 0 && message.node < 128 && message.gateway < 128);
      std::shift_right(opened_.begin(), opened_.end(), 1);
      opened_[0] = message.connection;
    }
  }
}

// Nobody says anything any more: no connection is kept for longer than its time-outs.
void LineSubject::expect_no_connection() {
  for (int i = 0; i < 3; ++i) {
    sleep(std::chrono::seconds(10));
    advance();
    lose(~0U);
    take_messages();
  }
  const routing::Counters counters = line_->state().routing;
  LINEGATE_EXPECT(counters.open == 0 && counters.channels == 0);
  LINEGATE_EXPECT(counters.opened == counters.finished + counters.aborted + counters.timed_out);
}

void LineSubject::stop() {
  line_->stop(now_);
  stopped_ = true;
}

void LineSubject::advance() {
  for (unsigned turns = 0; turns == 0 || line_->next_wake() <= now_; ++turns) {
    LINEGATE_EXPECT(turns < kMostTurns);
    line_->advance(now_);
    take_messages();
  }
}

void LineSubject::pass(Duration time) {
  const Instant until = now_ + time;
  advance();
  send(~0U);
  while (true) {
    Instant wake = line_->next_wake();
    for (const auto& device : devices_) {
      wake = earlier(wake, device->node->next_wake());
    }
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
  const bool wanted = line_->wants_to_send(now_);
  const bool given = line_->next_frame(frame, now_);
  LINEGATE_EXPECT(wanted == given);
  if (given) {
    check_frame(frame);
    ++sent_;
  }
  return given;
}

void LineSubject::send(unsigned frames) {
  can::Frame frame;
  for (unsigned i = 0; i < frames; ++i) {
    turn_devices();
    if (!next(frame)) {
      return;
    }
    LINEGATE_EXPECT(i < 100 * kMostTurns);
    frame.time = now_;
    for (const auto& device : devices_) {
      device->node->receive(std::span(&frame, 1));
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
  can::Frame frame;
  std::array<Event, 16> events;
  for (const auto& device : devices_) {
    device->node->advance(now_);
    while (device->node->next_frame(frame, now_)) {
      check_frame(frame);
      frame.time = now_;
      for (const auto& other : devices_) {
        if (other != device) {
          other->node->receive(std::span(&frame, 1));
        }
      }
      hear(std::span(&frame, 1));
    }
    device->events.take(events);
  }
}

void LineSubject::take_events(std::size_t count) {
  std::array<Event, 64> events;
  const std::size_t taken =
      line_->take_events(std::span(events).first(std::min(count, events.size())));
  LINEGATE_EXPECT(taken <= count);
  std::for_each_n(events.begin(), taken, [this](const Event& event) { check_event(event); });
}

void LineSubject::check_event(const Event& event) {
  LINEGATE_EXPECT(static_cast<std::size_t>(event.kind) < kEventKinds);
  LINEGATE_EXPECT(event.length <= event.data.size() && event.node < 128);
  if (event.kind == EventKind::events_lost && event.length == 16) {
    LINEGATE_EXPECT(load_le<std::uint64_t>(event.data.data()) == next_event_);
    LINEGATE_EXPECT(load_le<std::uint64_t>(event.data.data() + 8) == event.number);
    LINEGATE_EXPECT(event.number >= next_event_);
    next_event_ = event.number;
  }
  LINEGATE_EXPECT(event.number == next_event_);
  ++next_event_;
}

void LineSubject::take_replies() {
  line::Reply reply;
  while (line_->take_reply(reply)) {
    LINEGATE_EXPECT(open_.erase(reply.tag) == 1);
  }
}

void LineSubject::snapshot(image::Direction direction, bool merge) {
  const image::Layout& layout = line_->layout(direction);
  image::Snapshot& into = snapshots_[static_cast<std::size_t>(direction)];
  const std::uint64_t before = into.sequence;
  line_->snapshot(direction, into, now_, merge);
  LINEGATE_EXPECT(into.sequence == before + 1 && into.layout_id == layout.id);
  LINEGATE_EXPECT(into.direction == direction && into.acquired == now_);
  LINEGATE_EXPECT(into.bytes.size() == layout.byte_size);
  LINEGATE_EXPECT(into.changed.size() * 64 >= layout.entries.size());
  LINEGATE_EXPECT(into.valid.size() * 64 >= layout.entries.size());
  for (const image::PdoMark& mark : into.marks) {
    LINEGATE_EXPECT(mark.count > 0 && mark.time <= now_);
    LINEGATE_EXPECT(mark.first_entry + mark.entries <= layout.entries.size());
  }
  LINEGATE_EXPECT(!line_->image_changed(direction) && !line_->image_touched(direction));
}

void LineSubject::finish() {
  pass(milliseconds(20));
  stop();
  take_replies();
  LINEGATE_EXPECT(open_.empty());
  lose(~0U);
  expect_no_connection();
  const line::LineState state = line_->state();
  LINEGATE_EXPECT(state.counters.frames_received == heard_);
  LINEGATE_EXPECT(state.counters.frames_sent == sent_);
  LINEGATE_EXPECT(state.nodes_operational <= state.nodes_configured);
  const std::uint64_t events = state.counters.events;
  while (next_event_ <= events) {
    const std::uint64_t before = next_event_;
    take_events(64);
    LINEGATE_EXPECT(next_event_ > before);
  }
  LINEGATE_EXPECT(next_event_ == events + 1);
  for (std::uint8_t id = 1; id < 128; ++id) {
    (void)line_->node_state(id);
  }
}

}  // namespace linegate::fuzz
