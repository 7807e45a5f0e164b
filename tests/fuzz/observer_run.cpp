// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/observer_run.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stack/usdo/protocol.h"

#include "tests/fuzz/command_form.h"
#include "tests/fuzz/expect.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/watched_line.h"

namespace linegate::fuzz {
namespace observing {
namespace {

using image::Direction;
using std::chrono::milliseconds;

enum class Step : std::uint8_t {
  frame,     // identifier (2, LE), length, data
  strange,   // identifier (4, LE), flags, length, data: extended, remote, FD
  write,     // node, index (2), sub, bytes, value (4): a complete expedited download of a master
  read,      // the same for an upload
  channel,   // identifiers of client and server (2 each), data of both (8 each)
  pass,      // milliseconds
  sleep,     // tenths of a second, in which no timer runs
  snapshot,  // direction, merge
  events,    // number of events
  bus,       // kind, state or class, count
  command,   // see read_form() in command_form.h
  outputs,   // group, entry
  stop,
};
constexpr unsigned kSteps = 13;
constexpr unsigned kMostSteps = 2000;

line::LineConfig config(bool fd) {
  line::LineConfig out;
  out.name = "fuzz";
  out.role = line::Role::observer;
  out.canopen_fd = fd;
  out.sync_period = milliseconds(10);
  for (std::size_t i = 0; i < kMembers.size(); ++i) {
    out.nodes.push_back(member_node(i, fd));
  }
  return out;
}

class Run {
 public:
  Run(Input input, bool fd) : fd_(fd), input_(input), watched_(config(fd)), line_(watched_.line()) {
    line_.start(now_);
    look_at_layouts();
  }

  void all() {
    for (unsigned steps = 0; !input_.empty() && steps < kMostSteps; ++steps) {
      step(static_cast<Step>(input_.byte() % kSteps));
      expect_silence();
      look_at_layouts();
    }
    watched_.advance(now_);
    line_.stop(now_);
    expect_silence();
    watched_.expect_end();
    LINEGATE_EXPECT(line_.state().counters.frames_sent == 0);
  }

 private:
  void step(Step step) {
    switch (step) {
      case Step::frame:
        hear({.id = input_.word() & 0x7FFU, .flags = fd_ ? kFdFlags : std::uint8_t{0}});
        break;
      case Step::strange:
        hear(read_strange_head(input_));
        break;
      case Step::write:
      case Step::read:
        fd_ ? transfer_fd(step == Step::write) : transfer(step == Step::write);
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
        watched_.snapshot(outputs ? Direction::outputs : Direction::inputs, input_.flag(), now_);
        break;
      }
      case Step::events:
        watched_.pop_events(input_.byte());
        break;
      case Step::bus:
        line_.bus_event(read_bus_event(input_, now_));
        break;
      case Step::command:
        watched_.execute(to_command(read_form(input_)), now_);
        break;
      case Step::outputs:
        outputs();
        break;
      case Step::stop:
        line_.stop(now_);
        break;
    }
  }

  // Reads length and data of the frame from the input, too.
  void hear(can::Frame frame) {
    read_rest(input_, frame);
    give(frame);
  }

  void give(can::Frame frame) {
    frame.time = now_;
    watched_.hear(std::span(&frame, 1), now_);
  }

  void say(std::uint32_t id, std::span<const std::byte> data) {
    can::Frame frame;
    frame.id = id;
    frame.length = static_cast<std::uint8_t>(data.size());
    std::ranges::copy(data, frame.data.begin());
    give(frame);
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

  // By USDO, expedited: the session and both nodes from the input.
  void transfer_fd(bool write) {
    using usdo::Command;
    const auto node = static_cast<std::uint8_t>(input_.byte() & 0x7FU);
    const std::uint16_t index = input_.word();
    const od::Address object{index, input_.byte()};
    const std::size_t size = input_.byte() % (usdo::kExpeditedData + 1);
    const std::vector<std::byte> value = input_.bytes(size);
    const std::uint8_t session = input_.byte();
    const auto master = static_cast<std::uint8_t>(input_.byte() & 0x7FU);
    const usdo::Route request{can::kSdoRequestBase + master, node, session};
    const usdo::Route response{can::kSdoResponseBase + node, master, session};
    constexpr auto kType = od::DataType::unsigned32;
    if (write) {
      give(usdo::expedited_frame(request, Command::download, object, kType, value));
      give(usdo::object_frame(response, Command::download_response, object));
    } else {
      give(usdo::object_frame(request, Command::upload, object));
      give(usdo::expedited_frame(response, Command::upload_response, object, kType, value));
    }
  }

  void pass(Duration time) {
    const Instant until = now_ + time;
    watched_.advance(now_);
    while (line_.next_wake() <= until) {
      now_ = std::max(now_, line_.next_wake());
      watched_.advance(now_);
    }
    now_ = until;
  }

  void expect_silence() {
    can::Frame frame;
    LINEGATE_EXPECT(!line_.wants_to_send(now_));
    LINEGATE_EXPECT(!line_.next_frame(frame, now_));
  }

  // A new layout has a new revision, and its entries are adjacent and within the image.
  void look_at_layouts() {
    const std::uint64_t revision = line_.layout_revision();
    const std::array ids{line_.layout(Direction::inputs).id, line_.layout(Direction::outputs).id};
    LINEGATE_EXPECT((ids != ids_) == (revision != revision_) || ids_[0] == 0);
    LINEGATE_EXPECT(revision >= revision_);
    if (ids == ids_) {
      return;
    }
    ids_ = ids;
    revision_ = revision;
    for (const auto direction : {Direction::inputs, Direction::outputs}) {
      const image::Layout& layout = line_.layout(direction);
      std::uint64_t end = 0;
      for (const image::Entry& entry : layout.entries) {
        LINEGATE_EXPECT(entry.bit_offset >= end && entry.bit_length > 0);
        end = std::uint64_t{entry.bit_offset} + entry.bit_length;
      }
      LINEGATE_EXPECT(end <= std::uint64_t{layout.byte_size} * 8U);
    }
    for (std::uint32_t i = 0; i < line_.layout(Direction::inputs).entries.size(); ++i) {
      (void)line_.input(i);
    }
  }

  void outputs() {
    line::OutputWrite write;
    write.group = input_.byte();
    write.layout_id = line_.layout(Direction::outputs).id;
    write.values.push_back({.entry = input_.byte(), .length = 1});
    LINEGATE_EXPECT(line_.write_outputs(write, now_) != line::OutputRefusal::none);
  }

  static constexpr std::uint8_t kFdFlags = can::Frame::kFd | can::Frame::kBitRateSwitch;

  const bool fd_;
  Input input_;
  WatchedLine watched_;
  line::Line& line_;
  std::array<std::uint64_t, 2> ids_{};
  std::uint64_t revision_ = 0;
  Instant now_{std::chrono::seconds(1)};
};

}  // namespace
}  // namespace observing

void run_observer(Input input, bool fd) {
  observing::Run(input, fd).all();
}

}  // namespace linegate::fuzz
