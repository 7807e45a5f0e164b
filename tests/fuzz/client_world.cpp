// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/client_world.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "bridges/client/link.h"
#include "bridges/request/journal.h"
#include "stack/base/events.h"

#include "tests/fuzz/expect.h"

namespace linegate::fuzz {

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

namespace {

const std::string kGateways[] = {"gw", "other", ""};
const std::string kLines[] = {"press", "hall", "", "\xFF\x00x"};

class Samples {
 public:
  Samples(ClientWorld& world, dds::ClientListener& to) : in_(world.in), world_(world), to_(to) {}

  void next() {
    const std::uint8_t kind = in_.byte();
    if (kind >= kFirstOther)  // added later: the kept inputs keep their meaning
      return other(kind);
    switch (kind % 10) {
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
  static constexpr std::uint8_t kFirstOther = 244;

  void other(std::uint8_t kind) {
    switch (kind % 3) {
      case 0:
        return to_.on_line(source(), {}, {}, {{"namesakes", "1"}});
      case 1:
        return to_.on_node_gone(one_of(in_, kGateways), one_of(in_, kLines), in_.byte());
      default:
        return to_.on_output_state_gone(one_of(in_, kGateways), one_of(in_, kLines),
                                        static_cast<std::uint16_t>(number(in_)));
    }
  }
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
    state.arming_wanted = in_.flag();
    state.refusal = static_cast<line::OutputRefusal>(in_.byte());
    state.refused_client = in_.flag() ? "app" : "x";
    state.refused_at = Instant{Duration(static_cast<std::int64_t>(number(in_)))};
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
    out.acquired = Instant{Duration(static_cast<std::int64_t>(number(in_)))};
    out.bytes = in_.bytes(in_.byte() % 20);
    if (in_.flag())
      out.valid = {number(in_)};
    if (in_.flag())
      out.known = {number(in_)};
    if (in_.flag()) {
      image::PdoMark& mark = out.marks.emplace_back();
      mark.first_entry = static_cast<std::uint32_t>(number(in_));
      mark.entries = static_cast<std::uint32_t>(number(in_));
      mark.time = Instant{Duration(static_cast<std::int64_t>(number(in_)))};
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
  ClientWorld& world_;
  dds::ClientListener& to_;
  std::uint64_t arming_ = 1;
};

class FuzzedLink : public client::Link {
 public:
  explicit FuzzedLink(std::shared_ptr<ClientWorld> world) : world_(std::move(world)) {}

  void poll(Duration timeout, dds::ClientListener& listener) override {
    // An end: an application may poll until a call is answered.
    const std::uint8_t samples = world_->in.byte() % 8;
    world_->now += samples == 0 ? std::max(timeout, Duration(1)) : Duration(1);
    Samples source(*world_, listener);
    for (std::uint8_t i = 0; i < samples; ++i)
      source.next();
    end_requests(listener);
  }
  void wake() override {}
  std::uint64_t send(const dds::Target& /*target*/, const request::Request& /*request*/,
                     Duration timeout, std::uint64_t /*layout_id*/) override {
    LINEGATE_EXPECT(timeout > Duration::zero());
    if (world_->in.byte() == 0xFF)
      return 0;
    deadlines_.emplace(++world_->sent, world_->now + timeout);
    return world_->sent;
  }
  void cancel(std::uint64_t id) override { deadlines_.erase(id); }
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
  // An answer that came before is not known here: the library ignores this one.
  void end_requests(dds::ClientListener& listener) {
    dds::CommandResult out;
    out.reply.error = line::to_error(line::Refusal::timed_out);
    while (!deadlines_.empty()) {
      const auto first = std::ranges::min_element(deadlines_, {}, &Deadline::second);
      if (first->second > world_->now)
        return;
      out.id = first->first;
      deadlines_.erase(first);
      listener.on_reply({}, out);
    }
  }

  using Deadline = std::pair<const std::uint64_t, Instant>;
  std::shared_ptr<ClientWorld> world_;
  std::map<std::uint64_t, Instant> deadlines_;  // by id
};

}  // namespace

client::Client client_of(const std::shared_ptr<ClientWorld>& world) {
  return make_client(client::make_core(std::make_unique<FuzzedLink>(world)));
}

}  // namespace linegate::fuzz

// In the place of that of gateway/client, which c_api.cpp links.
namespace linegate::client {

Client::Client(const Options& /*options*/) : Client(make_core(nullptr, "no domain")) {
}

}  // namespace linegate::client
