// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/watched_line.h"

#include <algorithm>
#include <utility>

#include "bridges/sim/device.h"
#include "stack/base/time.h"
#include "stack/eds/reader.h"
#include "stack/lss/procedure.h"

#include "tests/fuzz/expect.h"

namespace linegate::fuzz {
namespace {

using line::CommandKind;
using std::chrono::milliseconds;

// A larger number of calls at one instant means that the line never becomes idle.
constexpr unsigned kMostTurns = 1000;

void check_error(const Error& error) {
  switch (error.domain) {
    case Domain::none:
      return;
    case Domain::sdo:
      LINEGATE_EXPECT(error.code != 0);
      return;
    case Domain::command:
      LINEGATE_EXPECT(error.code > 0);
      LINEGATE_EXPECT(error.code <= static_cast<std::uint32_t>(line::Refusal::image_pdo));
      return;
    default:
      LINEGATE_EXPECT(false);
  }
}

bool is_way(const line::ReplyData& data) {
  const auto* const way = std::get_if<line::WrittenByPdo>(&data);
  return std::holds_alternative<std::monostate>(data) ||  // an object of the own node
         std::holds_alternative<line::WrittenBySdo>(data) ||
         (way != nullptr && static_cast<std::size_t>(way->wait) < line::kPdoWaits &&
          (way->wait == line::PdoWait::values) == !way->missing.empty());
}

// The data have the type of result that belongs to the kind of request.
void check_data(CommandKind kind, const line::ReplyData& data) {
  switch (kind) {
    case CommandKind::scan:
    case CommandKind::scan_apply:
      LINEGATE_EXPECT(std::holds_alternative<std::vector<scan::ScannedNode>>(data));
      break;
    case CommandKind::boot:
      LINEGATE_EXPECT(std::holds_alternative<std::vector<manager::BootOutcome>>(data));
      break;
    case CommandKind::configure:
      LINEGATE_EXPECT(std::holds_alternative<std::vector<manager::NodeReport>>(data));
      break;
    case CommandKind::lss:
      LINEGATE_EXPECT(line::bytes_of(data).size() >= lss::kReplyHead);
      break;
    case CommandKind::object_write:
    case CommandKind::output_write:
      LINEGATE_EXPECT(is_way(data));
      break;
    case CommandKind::pdo_trigger:
      LINEGATE_EXPECT(std::holds_alternative<line::TriggeredPdos>(data));
      break;
    case CommandKind::mpdo_write:
      LINEGATE_EXPECT(std::holds_alternative<line::SentByMpdo>(data));
      break;
    case CommandKind::connection_open:
    case CommandKind::connection_list:
      LINEGATE_EXPECT(std::holds_alternative<line::SdoConnections>(data));
      break;
    default:
      break;
  }
}

}  // namespace

const od::DeviceDescription& description(std::size_t member, bool fd) {
  static const auto kDescriptions = [] {
    std::array<std::array<od::DeviceDescription, kMembers.size()>, 2> out;
    for (std::size_t i = 0; i < kMembers.size(); ++i) {
      const Member& m = kMembers[i];
      for (const bool is_fd : {false, true}) {
        const std::string_view profile = is_fd ? "fd-io" : m.profile;
        auto loaded = eds::load(sim::eds_text(profile), sim::eds_name(profile), m.id);
        LINEGATE_EXPECT(loaded.ok());
        out[is_fd ? 1 : 0][i] = *std::move(loaded.value);
      }
    }
    return out;
  }();
  return kDescriptions[fd ? 1 : 0][member];
}

line::NodeConfig member_node(std::size_t member, bool fd) {
  line::NodeConfig node;
  node.id = kMembers[member].id;
  node.device = description(member, fd);
  node.heartbeat = milliseconds(member == 1 ? 0 : 100);
  node.pdo_deadline = milliseconds(member == 2 ? 50 : 0);
  return node;
}

// --- forms of the input -------------------------------------------------------------------------

void read_rest(Input& input, can::Frame& frame) {
  const std::uint8_t wish = input.byte();
  frame.length = frame.fd() ? can::fd_length(wish % (can::kMaxFdData + 1))
                            : static_cast<std::uint8_t>(wish % (can::kMaxClassicData + 1));
  if (!frame.remote()) {
    std::ranges::copy(input.bytes(frame.length), frame.data.begin());
  }
}

can::Frame read_strange_head(Input& input) {
  can::Frame frame;
  const std::uint32_t low = input.word();
  const std::uint32_t high = input.word();
  frame.flags = input.byte() & 0x1FU;
  frame.id = frame.extended() ? (low | high << 16U) & 0x1FFF'FFFFU : low & 0x7FFU;
  frame.flags &= frame.fd()
                     ? static_cast<std::uint8_t>(~can::Frame::kRemote)
                     : static_cast<std::uint8_t>(can::Frame::kExtended | can::Frame::kRemote);
  return frame;
}

can::BusEvent read_bus_event(Input& input, Instant now) {
  can::BusEvent event;
  event.kind = static_cast<can::BusEvent::Kind>(input.byte() % 5);
  const std::uint8_t what = input.byte();
  event.state = static_cast<can::BusState>(what % 7);
  event.errors = what;
  event.code = what;
  event.count = input.byte();
  event.transmit_errors = what;
  event.time = now;
  return event;
}

// --- the line
// -------------------------------------------------------------------------------------

WatchedLine::WatchedLine(line::LineConfig config) {
  auto made = line::Line::make(std::move(config));
  LINEGATE_EXPECT(made.ok());
  line_ = *std::move(made.value);
}

void WatchedLine::hear(std::span<const can::Frame> frames, Instant now) {
  line_->receive(frames, now);
  heard_ += frames.size();
}

void WatchedLine::execute(line::Command command, Instant now) {
  command.tag = next_tag_++;
  const bool limited = command.timeout > Duration::zero();
  open_[command.tag] = {line::kind(command), limited ? deadline(now, command.timeout) : kNever};
  line_->execute(std::move(command), now);
}

void WatchedLine::advance(Instant now) {
  for (unsigned turns = 0; turns == 0 || line_->next_wake() <= now; ++turns) {
    LINEGATE_EXPECT(turns < kMostTurns);
    line_->advance(now);
  }
  check_overdue(now);
}

void WatchedLine::check_overdue(Instant now) {
  const auto overdue = [now](const auto& asked) { return asked.second.deadline <= now; };
  if (std::ranges::any_of(open_, overdue)) {
    check_replies();
    LINEGATE_EXPECT(std::ranges::none_of(open_, overdue));
  }
}

bool WatchedLine::next_frame(can::Frame& out, Instant now) {
  const bool wanted = line_->wants_to_send(now);
  const bool given = line_->next_frame(out, now);
  LINEGATE_EXPECT(wanted == given);
  if (given) {
    LINEGATE_EXPECT(out.fd() || out.length <= can::kMaxClassicData);
    LINEGATE_EXPECT(out.id <= (out.extended() ? 0x1FFF'FFFFU : 0x7FFU));
    ++sent_;
  }
  return given;
}

void WatchedLine::pop_events(std::size_t count) {
  std::array<Event, 64> events;
  const std::size_t taken =
      line_->pop_events(std::span(events).first(std::min(count, events.size())));
  LINEGATE_EXPECT(taken <= count);
  std::for_each_n(events.begin(), taken, [this](const Event& event) { check_event(event); });
}

void WatchedLine::check_event(const Event& event) {
  LINEGATE_EXPECT(static_cast<std::size_t>(event.kind()) < kEventKinds);
  LINEGATE_EXPECT(event.node < 128);
  const auto* const lost = event.get<event::EventsLost>();
  if (lost != nullptr && lost->last != 0) {  // 0: one that the input reported
    LINEGATE_EXPECT(lost->first == next_event_);
    LINEGATE_EXPECT(lost->last == event.number);
    LINEGATE_EXPECT(event.number >= next_event_);
    next_event_ = event.number;
  }
  LINEGATE_EXPECT(event.number == next_event_);
  ++next_event_;
}

void WatchedLine::check_replies() {
  line::Reply reply;
  while (line_->pop_reply(reply)) {
    const auto asked = open_.find(reply.tag);
    LINEGATE_EXPECT(asked != open_.end());
    check_reply(asked->second, reply);
    open_.erase(asked);
  }
}

void WatchedLine::check_reply(const Asked& asked, const line::Reply& reply) {
  check_error(reply.error);
  if (!reply.ok()) {
    return;
  }
  LINEGATE_EXPECT(line_->config().role != line::Role::observer ||
                  asked.kind == CommandKind::can_listen);
  check_data(asked.kind, reply.data);
  if (asked.kind == CommandKind::scan || asked.kind == CommandKind::scan_apply) {
    found_ = std::get<std::vector<scan::ScannedNode>>(reply.data);
  }
}

void WatchedLine::snapshot(image::Direction direction, bool merge, Instant now) {
  const image::Layout& layout = line_->layout(direction);
  image::Snapshot& into = snapshots_[static_cast<std::size_t>(direction)];
  const std::uint64_t before = into.sequence;
  line_->snapshot(direction, into, now, merge);
  LINEGATE_EXPECT(into.sequence == before + 1 || line_->layout_revision() != 0);
  LINEGATE_EXPECT(into.layout_id == layout.id && into.acquired == now);
  LINEGATE_EXPECT(into.bytes.size() == layout.byte_size);
  LINEGATE_EXPECT(into.changed.size() * 64 >= layout.entries.size());
  LINEGATE_EXPECT(into.valid.size() * 64 >= layout.entries.size());
  for (const image::PdoMark& mark : into.marks) {
    LINEGATE_EXPECT(mark.count > 0 && mark.time <= now);
    LINEGATE_EXPECT(mark.first_entry + mark.entries <= layout.entries.size());
  }
  LINEGATE_EXPECT(!line_->image_changed(direction) && !line_->image_touched(direction));
}

void WatchedLine::expect_end() {
  check_replies();
  LINEGATE_EXPECT(open_.empty());
  const line::LineState state = line_->state();
  LINEGATE_EXPECT(state.counters.frames_received == heard_);
  LINEGATE_EXPECT(state.counters.frames_sent == sent_);
  LINEGATE_EXPECT(state.nodes_operational <= state.nodes_configured);
  while (next_event_ <= state.counters.events) {
    const std::uint64_t before = next_event_;
    pop_events(64);
    LINEGATE_EXPECT(next_event_ > before);
  }
  LINEGATE_EXPECT(next_event_ == state.counters.events + 1);
  for (std::uint8_t id = 1; id < 128; ++id) {
    (void)line_->node_state(id);
  }
}

}  // namespace linegate::fuzz
