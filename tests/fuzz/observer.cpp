// A line in the role observer: whatever is on the bus, it sends nothing, and its image is whole.
// The input is a sequence of steps, each one byte and what follows it.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <set>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "bridges/sim/device.h"
#include "stack/base/byte_order.h"
#include "stack/eds/reader.h"
#include "stack/line/line.h"

#include "tests/fuzz/expect.h"
#include "tests/fuzz/input.h"

namespace {

using namespace linegate;
using fuzz::Input;
using image::Direction;
using std::chrono::milliseconds;

enum class Step : std::uint8_t {
  frame,     // identifier (2, LE), length, data
  strange,   // identifier (4, LE), flags, length, data: extended, remote, FD
  write,     // node, index (2), sub, bytes, value (4): by a master, expedited, and answered
  read,      // the same, read by it
  channel,   // identifiers of the client and of the server (2 each), what they say (8 each)
  pass,      // milliseconds
  sleep,     // tenths of a second, and only then time-outs run
  snapshot,  // direction, merge
  events,    // how many
  bus,       // kind, state or class, count
  command,   // kind, node
  outputs,   // group, entry
  stop,
};
constexpr unsigned kSteps = 13;
constexpr unsigned kMostSteps = 2000;
// More work at one instant than any of it is worth: time stands still.
constexpr unsigned kMostTurns = 1000;

// Read once: thousands of inputs have the same device files.
od::DeviceDescription device_file(std::string_view profile, std::uint8_t id) {
  auto loaded = eds::load(sim::eds_text(profile), sim::eds_name(profile), id);
  LINEGATE_EXPECT(loaded.ok());
  return *std::move(loaded.value);
}

line::LineConfig config() {
  static const std::array kDevices{device_file("drive", 5), device_file("digital-io", 6),
                                   device_file("encoder", 7)};
  line::LineConfig out;
  out.name = "fuzz";
  out.role = line::Role::observer;
  out.sync_period = milliseconds(10);
  for (std::size_t i = 0; i < kDevices.size(); ++i) {
    line::NodeConfig node;
    node.id = static_cast<std::uint8_t>(5 + i);
    node.device = kDevices[i];
    node.heartbeat = milliseconds(i == 1 ? 0 : 100);
    node.pdo_deadline = milliseconds(i == 2 ? 50 : 0);
    out.nodes.push_back(std::move(node));
  }
  return out;
}

class Run {
 public:
  explicit Run(Input input) : input_(input) {
    auto made = line::Line::make(config());
    LINEGATE_EXPECT(made.ok());
    line_ = *std::move(made.value);
    line_->start(now_);
    look_at_layouts();
  }

  void all() {
    for (unsigned steps = 0; !input_.empty() && steps < kMostSteps; ++steps) {
      step(static_cast<Step>(input_.byte() % kSteps));
      expect_silence();
      look_at_layouts();
    }
    advance();
    line_->stop(now_);
    expect_silence();
    take_replies();
    LINEGATE_EXPECT(open_.empty());
    LINEGATE_EXPECT(line_->state().counters.frames_received == heard_);
    LINEGATE_EXPECT(line_->state().counters.frames_sent == 0);
    take_all_events();
  }

 private:
  void step(Step step) {
    switch (step) {
      case Step::frame:
        frame(input_.word() & 0x7FFU, 0);
        break;
      case Step::strange:
        strange();
        break;
      case Step::write:
      case Step::read:
        transfer(step == Step::write);
        break;
      case Step::channel: {
        const std::uint16_t request = input_.word();
        const std::uint16_t response = input_.word();
        say(request & 0x7FFU, input_.bytes(8));
        say(response & 0x7FFU, input_.bytes(8));
        break;
      }
      case Step::pass:
        pass(milliseconds(input_.byte()));
        break;
      case Step::sleep:
        now_ += milliseconds(100) * input_.byte();
        break;
      case Step::snapshot: {
        const bool outputs = input_.flag();
        snapshot(outputs ? Direction::outputs : Direction::inputs, input_.flag());
        break;
      }
      case Step::events:
        take_events(input_.byte());
        break;
      case Step::bus:
        bus();
        break;
      case Step::command:
        command();
        break;
      case Step::outputs:
        outputs();
        break;
      case Step::stop:
        line_->stop(now_);
        break;
    }
  }

  void hear(can::Frame frame) {
    frame.time = now_;
    line_->receive(std::span(&frame, 1), now_);
    ++heard_;
  }

  void frame(std::uint32_t id, std::uint8_t flags) {
    can::Frame frame;
    frame.id = id;
    frame.flags = flags;
    const std::uint8_t wish = input_.byte();
    frame.length = frame.fd() ? can::fd_length(wish % (can::kMaxFdData + 1))
                              : static_cast<std::uint8_t>(wish % (can::kMaxClassicData + 1));
    if (!frame.remote()) {
      std::ranges::copy(input_.bytes(frame.length), frame.data.begin());
    }
    hear(frame);
  }

  void strange() {
    const std::uint32_t low = input_.word();
    const std::uint32_t high = input_.word();
    auto flags = static_cast<std::uint8_t>(input_.byte() & 0x1FU);
    flags &= (flags & can::Frame::kFd) != 0
                 ? static_cast<std::uint8_t>(~can::Frame::kRemote)
                 : static_cast<std::uint8_t>(can::Frame::kExtended | can::Frame::kRemote);
    const bool extended = (flags & can::Frame::kExtended) != 0;
    frame(extended ? (low | high << 16U) & 0x1FFF'FFFFU : low & 0x7FFU, flags);
  }

  void say(std::uint32_t id, std::span<const std::byte> data) {
    can::Frame frame;
    frame.id = id;
    frame.length = static_cast<std::uint8_t>(data.size());
    std::ranges::copy(data, frame.data.begin());
    hear(frame);
  }

  void transfer(bool write) {
    const std::uint32_t node = input_.byte() & 0x7FU;
    const std::vector<std::byte> place = input_.bytes(3);
    const unsigned unused = 3U - input_.byte() % 4U;
    std::array<std::byte, 8> with_value{
        std::byte{static_cast<std::uint8_t>((write ? 0x23U : 0x43U) | unused << 2U)}};
    std::array<std::byte, 8> without{write ? std::byte{0x60} : std::byte{0x40}};
    std::ranges::copy(place, with_value.begin() + 1);
    std::ranges::copy(place, without.begin() + 1);
    std::ranges::copy(input_.bytes(4), with_value.begin() + 4);
    say(can::kSdoRequestBase + node, write ? with_value : without);
    say(can::kSdoResponseBase + node, write ? without : with_value);
  }

  void advance() {
    for (unsigned turns = 0; turns == 0 || line_->next_wake() <= now_; ++turns) {
      LINEGATE_EXPECT(turns < kMostTurns);
      line_->advance(now_);
    }
  }

  void pass(Duration time) {
    const Instant until = now_ + time;
    advance();
    while (line_->next_wake() <= until) {
      now_ = std::max(now_, line_->next_wake());
      advance();
    }
    now_ = until;
  }

  void expect_silence() {
    can::Frame frame;
    LINEGATE_EXPECT(!line_->wants_to_send(now_));
    LINEGATE_EXPECT(!line_->next_frame(frame, now_));
  }

  // A new layout has a new revision, and its entries lie beside each other, inside.
  void look_at_layouts() {
    const std::uint64_t revision = line_->layout_revision();
    const std::array ids{line_->layout(Direction::inputs).id, line_->layout(Direction::outputs).id};
    LINEGATE_EXPECT((ids != ids_) == (revision != revision_) || ids_[0] == 0);
    LINEGATE_EXPECT(revision >= revision_);
    if (ids == ids_) {
      return;
    }
    ids_ = ids;
    revision_ = revision;
    for (const auto direction : {Direction::inputs, Direction::outputs}) {
      const image::Layout& layout = line_->layout(direction);
      std::uint64_t end = 0;
      for (const image::Entry& entry : layout.entries) {
        LINEGATE_EXPECT(entry.bit_offset >= end && entry.bit_length > 0);
        end = std::uint64_t{entry.bit_offset} + entry.bit_length;
      }
      LINEGATE_EXPECT(end <= std::uint64_t{layout.byte_size} * 8U);
    }
    for (std::uint32_t i = 0; i < line_->layout(Direction::inputs).entries.size(); ++i) {
      (void)line_->input(i);
    }
  }

  void snapshot(Direction direction, bool merge) {
    const image::Layout& layout = line_->layout(direction);
    image::Snapshot& into = snapshots_[static_cast<std::size_t>(direction)];
    line_->snapshot(direction, into, now_, merge);
    LINEGATE_EXPECT(into.layout_id == layout.id && into.bytes.size() == layout.byte_size);
    LINEGATE_EXPECT(into.changed.size() * 64 >= layout.entries.size());
    LINEGATE_EXPECT(into.valid.size() * 64 >= layout.entries.size());
    for (const image::PdoMark& mark : into.marks) {
      LINEGATE_EXPECT(mark.count > 0 && mark.time <= now_);
      LINEGATE_EXPECT(mark.first_entry + mark.entries <= layout.entries.size());
    }
    LINEGATE_EXPECT(!line_->image_changed(direction) && !line_->image_touched(direction));
  }

  void bus() {
    can::BusEvent event;
    event.kind = static_cast<can::BusEvent::Kind>(input_.byte() % 5);
    const std::uint8_t what = input_.byte();
    event.state = static_cast<can::BusState>(what % 7);
    event.errors = what;
    event.code = what;
    event.count = input_.byte();
    event.time = now_;
    line_->bus_event(event);
  }

  void command() {
    constexpr unsigned kKinds = static_cast<unsigned>(line::CommandKind::bus_fault) + 1;
    line::Command command{.tag = next_tag_++};
    command.kind = static_cast<line::CommandKind>(input_.byte() % kKinds);
    command.node = input_.byte();
    command.data.resize(4);
    open_.insert(command.tag);
    line_->execute(std::move(command), now_);
    take_replies();
  }

  void outputs() {
    line::OutputWrite write;
    write.group = input_.byte();
    write.layout_id = line_->layout(Direction::outputs).id;
    write.values.push_back({.entry = input_.byte(), .length = 1});
    LINEGATE_EXPECT(line_->write_outputs(write, now_) != line::OutputRefusal::none);
  }

  void take_replies() {
    line::Reply reply;
    while (line_->take_reply(reply)) {
      LINEGATE_EXPECT(open_.erase(reply.tag) == 1);
      LINEGATE_EXPECT(!reply.ok());
    }
  }

  void take_events(std::size_t count) {
    std::array<Event, 64> events;
    const std::size_t taken =
        line_->take_events(std::span(events).first(std::min(count, events.size())));
    for (const Event& event : std::span(events).first(taken)) {
      LINEGATE_EXPECT(static_cast<std::size_t>(event.kind) < kEventKinds);
      LINEGATE_EXPECT(event.length <= event.data.size() && event.node < 128);
      LINEGATE_EXPECT(event.number >= next_event_);
      LINEGATE_EXPECT(event.number == next_event_ || event.kind == EventKind::events_lost);
      next_event_ = event.number + 1;
    }
  }

  void take_all_events() {
    const std::uint64_t last = line_->state().counters.events;
    while (next_event_ <= last) {
      const std::uint64_t before = next_event_;
      take_events(64);
      LINEGATE_EXPECT(next_event_ > before);
    }
  }

  Input input_;
  std::unique_ptr<line::Line> line_;
  std::array<image::Snapshot, 2> snapshots_;
  std::set<std::uint64_t> open_;  // tags of commands that were not answered yet
  std::array<std::uint64_t, 2> ids_{};
  std::uint64_t revision_ = 0;
  Instant now_{std::chrono::seconds(1)};
  std::uint64_t next_tag_ = 1;
  std::uint64_t next_event_ = 1;
  std::uint64_t heard_ = 0;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Run(Input({data, size})).all();
  return 0;
}
