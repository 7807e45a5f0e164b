// SPDX-License-Identifier: Apache-2.0
// The input is a sequence of steps: samples that bridges/dds may pass to the client library,
// however little they fit together, and calls of an application. Promises: no
// crash; a value of good quality has data and is of a line that is ready; no output is written but
// of an armed group, with the layout and the start of the gateway that its values were set for;
// each call ends, once; the numbers of followed events rise, and their position is accepted again.
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "bridges/client/link.h"
#include "bridges/request/journal.h"
#include "stack/base/events.h"

#include "tests/fuzz/expect.h"
#include "tests/fuzz/input.h"

namespace {

using namespace linegate;
using client::Outcome;
using fuzz::Input;

// Few names, so that samples meet.
const std::string kGateways[] = {"gw", "other", ""};
const std::string kLines[] = {"press", "hall", "", "\xFF\x00x"};
const std::string kNames[] = {"a", "inputs:a", "outputs:a", "b", "", "outputs:"};

template <class T, std::size_t N>
const T& one_of(Input& in, const T (&all)[N]) {
  return all[in.byte() % N];
}

// Mostly small numbers, and the ends of the range.
std::uint64_t number(Input& in) {
  const std::uint8_t byte = in.byte();
  switch (byte) {
    case 0xFF:
      return std::numeric_limits<std::uint64_t>::max();
    case 0xFE:
      return std::uint64_t{1} << 63U;
    case 0xFD:
      return std::numeric_limits<std::uint32_t>::max();
    case 0xFC:
      return in.word();
    default:
      return byte % 8;
  }
}

struct World {
  explicit World(Input& the_input) : in(the_input) {}
  Input& in;
  Instant now{std::chrono::seconds(100)};
  std::uint64_t sent = 0;
  std::uint64_t written = 0;
  bool armed = false;  // since then a group may be written
};

class Samples {
 public:
  Samples(World& world, dds::ClientListener& to) : in_(world.in), world_(world), to_(to) {}

  void next() {
    switch (in_.byte() % 10) {
      case 0:
        return gateway();
      case 1:
        return line();
      case 2:
        return node();
      case 3:
        return group();
      case 4:
        return layout();
      case 5:
        return image();
      case 6:
        return event();
      case 7:
        return to_.on_line_gone(one_of(in_, kGateways), one_of(in_, kLines));
      case 8:
        return reply();
      default:
        return whole();
    }
  }

 private:
  dds::Source source() {
    dds::Source out;
    out.gateway = one_of(in_, kGateways);
    out.line = one_of(in_, kLines);
    out.incarnation = number(in_);
    return out;
  }
  void gateway() {
    const dds::Source from = source();
    dds::GatewayInfo info;
    info.event_stream = from.incarnation % 4;
    info.events = from.incarnation / 4;
    to_.on_gateway(from, info);
  }
  void line() {
    line::LineState state;
    state.counters.events = number(in_);
    to_.on_line(source(), {}, state, {{"lines", in_.flag() ? "1" : "18446744073709551616"}});
  }
  void node() {
    line::NodeState state;
    state.node = in_.byte();
    state.presence = static_cast<line::Presence>(in_.byte() % 4);
    to_.on_node(source(), {}, state, {});
  }
  void group() {
    line::OutputState state;
    state.group = static_cast<std::uint16_t>(number(in_));
    state.name = one_of(in_, kNames);
    state.owner = in_.flag() ? "app" : "x";
    state.arming = in_.flag() ? arming_ : number(in_);
    state.tripped = in_.flag();
    state.refusal = static_cast<line::OutputRefusal>(in_.byte());
    state.refused_client = in_.flag() ? "app" : "x";
    state.refused_at = Instant{linegate::Duration(static_cast<std::int64_t>(number(in_)))};
    for (std::uint8_t waits = in_.byte() % 4; waits > 0; --waits)
      state.waits.push_back(
          {static_cast<std::uint32_t>(number(in_)), static_cast<line::OutputWait>(in_.byte())});
    to_.on_output_state(source(), state);
  }
  void layout() {
    image::Layout out;
    out.direction = static_cast<image::Direction>(in_.byte() % 2);
    out.id = number(in_);
    out.byte_size = static_cast<std::uint32_t>(number(in_));
    for (std::uint8_t entries = in_.byte() % 4; entries > 0; --entries) {
      image::Entry& entry = out.entries.emplace_back();
      entry.bit_offset = static_cast<std::uint32_t>(number(in_));
      entry.bit_length = in_.flag() ? in_.word() : static_cast<std::uint16_t>(8U << in_.byte() % 4);
      entry.type = static_cast<od::DataType>(in_.byte() % 0x40);
      entry.node = in_.byte();
      entry.name = one_of(in_, kNames);
      if (in_.flag()) {  // any bits: a number, an infinity, or none
        entry.scaling.scale = std::bit_cast<double>(number(in_));
        entry.scaling.offset = std::bit_cast<double>(number(in_));
        entry.low = std::bit_cast<double>(number(in_));
      }
    }
    to_.on_layout(source(), out);
  }
  void image() {
    image::Snapshot out;
    out.direction = static_cast<image::Direction>(in_.byte() % 2);
    out.layout_id = number(in_);
    out.sequence = number(in_);
    out.acquired = Instant{linegate::Duration(static_cast<std::int64_t>(number(in_)))};
    out.bytes = in_.bytes(in_.byte() % 20);
    if (in_.flag())
      out.valid = {number(in_)};
    if (in_.flag())
      out.known = {number(in_)};
    if (in_.flag()) {
      image::PdoMark& mark = out.marks.emplace_back();
      mark.first_entry = static_cast<std::uint32_t>(number(in_));
      mark.entries = static_cast<std::uint32_t>(number(in_));
      mark.time = Instant{linegate::Duration(static_cast<std::int64_t>(number(in_)))};
    }
    to_.on_image(source(), out);
  }
  void event() {
    dds::ReceivedEvent out;
    out.number = number(in_);
    out.kind = static_cast<EventKind>(in_.byte());
    out.severity = static_cast<EventSeverity>(in_.byte());
    out.node = in_.byte();
    if (in_.flag()) {
      out.kind = EventKind::command_progress;
      out.data = event::CommandProgress{static_cast<line::CommandKind>(in_.byte()),
                                        static_cast<std::uint32_t>(number(in_)), 1};
    }
    const dds::Source from = source();
    out.stream = from.incarnation % 4;
    to_.on_event(from, out, one_of(in_, kLines), {});
  }
  void reply() {
    dds::CommandResult out;
    out.id = in_.flag() ? world_.sent : number(in_);
    out.reply.error = {static_cast<Domain>(in_.byte() % 5),
                       static_cast<std::uint32_t>(number(in_))};
    out.bytes = in_.bytes(in_.byte() % 20);
    if (out.bytes.size() == 19)
      out.reply = page(out.bytes);
    to_.on_reply({}, out);
  }
  // Of the journal.
  static line::Reply page(const std::vector<std::byte>& random) {
    request::JournalPage out;
    for (std::size_t i = 0; i + 2 < random.size() && random[i] != std::byte{}; i += 3)
      out.records.push_back({.stream = std::to_integer<std::uint64_t>(random[i]) % 4,
                             .line = "press",
                             .number = std::to_integer<std::uint64_t>(random[i + 1]) % 8,
                             .kind = static_cast<EventKind>(random[i + 2])});
    out.more = std::to_integer<unsigned>(random.back()) % 2 != 0;
    out.unknown_stream = std::to_integer<unsigned>(random.back()) % 8 > 5;
    line::Reply reply;
    reply.data = encode(out);
    return reply;
  }
  // A line that is ready.
  void whole() {
    const dds::Source from{.gateway = "gw", .line = "press", .incarnation = number(in_)};
    to_.on_line(from, {}, {}, {{"lines", "1"}});
    for (const auto direction : {image::Direction::inputs, image::Direction::outputs}) {
      image::Layout layout;
      layout.direction = direction;
      layout.id = 7;
      image::Entry& entry = layout.entries.emplace_back();
      entry.bit_length = 32;
      entry.type = in_.flag() ? od::DataType::real32 : od::DataType::unsigned32;
      entry.name = "a";
      to_.on_layout(from, layout);
      image::Snapshot image;
      image.direction = direction;
      image.layout_id = 7;
      image.bytes = in_.bytes(4);
      image.valid = image.known = {1};
      to_.on_image(from, image);
    }
    to_.on_output_state(from, {});
  }

  Input& in_;
  World& world_;
  dds::ClientListener& to_;
  std::uint64_t arming_ = 1;
};

class FuzzedLink : public client::Link {
 public:
  explicit FuzzedLink(std::shared_ptr<World> world) : world_(std::move(world)) {}

  void poll(linegate::Duration timeout, dds::ClientListener& listener) override {
    // An end: an application may poll until a call is answered.
    const std::uint8_t samples = world_->in.byte() % 8;
    world_->now += samples == 0 ? std::max(timeout, linegate::Duration(1)) : linegate::Duration(1);
    Samples source(*world_, listener);
    for (std::uint8_t i = 0; i < samples; ++i)
      source.next();
  }
  void wake() override {}
  std::uint64_t send(const dds::Target& /*target*/, const request::Request& /*request*/,
                     linegate::Duration timeout, std::uint64_t /*layout_id*/) override {
    LINEGATE_EXPECT(timeout > linegate::Duration::zero());
    return world_->in.byte() == 0xFF ? 0 : ++world_->sent;
  }
  void cancel(std::uint64_t /*id*/) override {}
  bool write_outputs(const dds::Target& target, const line::OutputWrite& write) override {
    LINEGATE_EXPECT(world_->armed);
    LINEGATE_EXPECT(write.arming != 0 && !target.line.empty());
    ++world_->written;
    return world_->in.flag();
  }
  dds::Peers peers() const override { return {{"gw"}, std::chrono::seconds(1)}; }
  std::string name() const override { return "app"; }
  Instant now() const override { return world_->now; }
  std::int64_t utc() const override { return 1; }

 private:
  std::shared_ptr<World> world_;
};

void check(const client::Value& value, const client::Line& line) {
  if (value.good())
    LINEGATE_EXPECT(value.data.index() != 0 && line.status() != client::LineStatus::lost);
  (void)value.as<int>();
  (void)value.as<std::uint64_t>();
  (void)value.as<float>();
  (void)value.text();
  (void)describe(value.quality);
}

client::Data data_of(Input& in) {
  switch (in.byte() % 6) {
    case 0:
      return in.flag();
    case 1:
      return static_cast<std::int64_t>(number(in));
    case 2:
      return number(in);
    case 3:
      return in.flag() ? std::nan("") : 1e300;
    case 4:
      return std::string(in.byte() % 12, 'x');
    default:
      return in.bytes(in.byte() % 12);
  }
}

// Steps of an application; handles end with it, in any order with the client.
class Application {
 public:
  explicit Application(const std::shared_ptr<World>& world)
      : world_(world),
        in_(world->in),
        client_(make_client(client::make_core(std::make_unique<FuzzedLink>(world)))),
        line_(client_.line(in_.flag() ? "press" : "gw/press")),
        group_(group_of(in_, line_)) {
    values_ = line_.on_change({"a", "outputs:a"}, [this](const client::Snapshot& now) {
      for (const client::Value& value : now.values)
        check(value, line_);
    });
    lines_ = client_.on_line([](const client::Change& change) { (void)describe(change.status); });
    events_ = client_.on_event([](const client::Event&) {});
    following_ = follow(std::nullopt);
    oldest_ = follow("");
    states_ = group_.on_state([](const client::Group& group) { (void)group.text(); });
  }

  void step() {
    switch (in_.byte() % 8) {
      case 0:
        check(line_.read(one_of(in_, kNames)), line_);
        return;
      case 1:
        (void)group_.set(one_of(in_, kNames), data_of(in_));
        return;
      case 2:
        world_->armed = true;
        if (group_.arm() == client::Error::none)
          LINEGATE_EXPECT(group_.state() == client::GroupState::taking);
        return;
      case 3:
        return release();
      case 4:
        return call();
      case 5:
        return look();
      default:
        client_.poll(linegate::Duration(static_cast<std::int64_t>(number(in_) & 0xFFFFFFFF)));
    }
  }

  void end() {
    LINEGATE_EXPECT(client_.follow_events(following_.position(), [](const client::Event&) {}));
    client_ = make_client(client::make_core(nullptr, "ended"));
    for (const auto& [call, ended] : calls_)
      LINEGATE_EXPECT(call.done() && *ended <= 1);
  }

 private:
  static client::Group group_of(Input& in, const client::Line& line) {
    const char* const name = in.flag() ? "" : "a";
    return line.group(name,
                      {.watchdog = linegate::Duration(static_cast<std::int64_t>(number(in)))});
  }
  // Each event is passed on once.
  client::EventReader follow(const std::optional<std::string>& after) {
    using Key = std::tuple<std::string, std::string, std::uint64_t, std::uint64_t>;
    return client_.follow_events(
        after, [seen = std::make_shared<std::set<Key>>()](const client::Event& event) {
          const bool is_new =
              seen->emplace(event.gateway, event.line, event.stream, event.number).second;
          LINEGATE_EXPECT(is_new || event.stream == 0 || event.number == 0);
        });
  }
  void release() {
    group_.release();
    const std::uint64_t before = world_->written;
    client_.poll(linegate::Duration::zero());
    LINEGATE_EXPECT(world_->written == before);
  }
  void call() {
    if (calls_.size() > 50)
      return;
    const client::CallOptions options{.timeout = linegate::Duration(number(in_)),
                                      .attempts = in_.byte() % 3U};
    const client::Request request{.kind = in_.byte(),
                                  .node = in_.byte(),
                                  .sub = in_.byte(),
                                  .data = in_.bytes(in_.byte() % 12)};
    const auto ended = std::make_shared<int>(0);
    calls_.emplace_back(line_.request(request, options), ended);
    calls_.back().first.on_done([ended](const client::Call& done) {
      ++*ended;
      LINEGATE_EXPECT(done.done());
    });
    if (in_.byte() % 8 == 0)
      calls_.back().first.cancel();
  }
  void look() {
    (void)group_.owner();
    (void)group_.waiting();
    (void)line_.inputs();
    (void)line_.outputs();
    (void)client_.lines();
    for (const auto& [call, ended] : calls_) {
      (void)call.number();
      (void)call.text();
      (void)call.progress();
    }
  }

  std::shared_ptr<World> world_;
  Input& in_;
  client::Client client_;
  client::Line line_;
  client::Group group_;
  client::Subscription values_, lines_, events_, states_;
  client::EventReader following_, oldest_;
  std::vector<std::pair<client::Call, std::shared_ptr<int>>> calls_;
};

}  // namespace

// In the place of that of gateway/client, which c_api.cpp links.
namespace linegate::client {

Client::Client(const Options& /*options*/) : Client(make_core(nullptr, "no domain")) {
}

}  // namespace linegate::client

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Input in({data, size});
  Application application(std::make_shared<World>(in));
  for (int steps = 0; !in.empty() && steps < 2000; ++steps)
    application.step();
  application.end();
  return 0;
}
