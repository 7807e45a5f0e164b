// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/line_run.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tests/fuzz/command_form.h"
#include "tests/fuzz/input.h"
#include "tests/fuzz/line_input.h"
#include "tests/fuzz/line_subject.h"

namespace linegate::fuzz {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr unsigned kMostSteps = 2000;
constexpr Duration kMostTime = std::chrono::seconds(60);

class Run {
 public:
  Run(const Setup& setup, Input input) : fd_(setup.fd), subject_(setup), input_(input) {}

  void all() {
    const Instant start = subject_.now();
    for (unsigned steps = 0; !input_.empty() && steps < kMostSteps; ++steps) {
      step(static_cast<Step>(input_.byte() % kSteps));
      if (subject_.now() - start > kMostTime) {
        break;
      }
    }
    subject_.advance();
    subject_.finish();
  }

 private:
  void step(Step step) {
    switch (step) {
      case Step::frame:
      case Step::strange:
      case Step::burst:
        hear(step);
        break;
      case Step::late:
        late_ = microseconds(input_.byte());
        break;
      case Step::advance:
        late_ = Duration::zero();
        subject_.advance();
        break;
      case Step::pass:
        subject_.pass(milliseconds(input_.byte()));
        break;
      case Step::sleep:
        subject_.sleep(milliseconds(100) * input_.byte());
        break;
      case Step::send:
        subject_.send(input_.byte());
        break;
      case Step::lose:
        subject_.lose(input_.byte());
        break;
      case Step::command:
        subject_.execute(to_command(read_form(input_)));
        break;
      case Step::write:
        write();
        break;
      case Step::bus:
        subject_.line().bus_event(read_bus_event(input_, subject_.now()));
        break;
      case Step::report:
        report();
        break;
      case Step::events:
        subject_.pop_events(input_.byte());
        break;
      case Step::replies:
        subject_.check_replies();
        break;
      case Step::snapshot: {
        const bool outputs = input_.flag();
        subject_.snapshot(outputs ? image::Direction::outputs : image::Direction::inputs,
                          input_.flag());
        break;
      }
      case Step::stop:
        subject_.stop();
        break;
      case Step::message:
        message();
        break;
      case Step::wait:
        subject_.pass(milliseconds(100) * input_.byte());
        break;
      case Step::cable:
        subject_.plug(input_.flag());
        break;
    }
  }

  void hear(Step step) {
    can::Frame frame;
    if (step == Step::strange) {
      frame = read_strange_head(input_);
    } else {
      frame.id = input_.word() & 0x7FFU;
    }
    if (fd_ && step != Step::strange) {
      frame.flags = can::Frame::kFd | can::Frame::kBitRateSwitch;
    }
    frame.time = subject_.now() - late_;
    if (step == Step::burst) {
      burst(frame);
      return;
    }
    read_rest(input_, frame);
    subject_.hear(std::span(&frame, 1));
  }

  void burst(can::Frame frame) {
    std::array<can::Frame, 64> frames;
    const std::size_t count = input_.byte() % (frames.size() + 1);
    frame.length = static_cast<std::uint8_t>(fd_ ? can::kMaxFdData : can::kMaxClassicData);
    frame.data.fill(std::byte{input_.byte()});
    frames.fill(frame);
    subject_.hear(std::span(frames).first(count));
  }

  // A connection below 128 selects one of those that the line opened last.
  void message() {
    routing::Message out;
    out.kind = static_cast<routing::MessageKind>(input_.byte());
    out.from = input_.byte();
    out.to = input_.flag() ? input_.byte() : LineSubject::kInterface;
    const std::uint8_t connection = input_.byte();
    out.connection = connection < 128 ? subject_.opened(connection) : connection;
    out.network = input_.byte();
    out.source = input_.byte();
    out.node = input_.byte();
    out.gateway = input_.byte();
    out.hops = input_.byte();
    const auto bytes = input_.bytes(out.data.size());
    std::ranges::copy(bytes, out.data.begin());
    subject_.deliver(out);
  }

  void write() {
    line::OutputWrite out;
    out.group = input_.byte();
    out.arming = input_.byte();
    out.watchdog = time_out(input_.byte());
    out.reactions = input_.byte();
    out.layout_id = subject_.line().layout(image::Direction::outputs).id;
    const unsigned shape = input_.byte();
    out.layout_id ^= shape >> 7U;
    out.values.resize(shape % 8);
    for (line::OutputValue& value : out.values) {
      value.entry = input_.byte();
      value.length = static_cast<std::uint8_t>(input_.byte() % (fd_ ? value.data.size() + 1 : 9));
      const auto bytes = input_.bytes(value.length);
      std::ranges::copy(bytes, value.data.begin());
    }
    out.bytes.resize(shape / 8 % 4);
    for (line::OutputBytes& run : out.bytes) {
      run.offset = input_.byte();
      run.data = read_data(input_);
    }
    if (!subject_.stopped()) {
      (void)subject_.line().write_outputs(out, subject_.now());
    }
  }

  void report() {
    const auto kind = static_cast<EventKind>(input_.byte() % kEventKinds);
    subject_.line().report({.time = subject_.now(), .data = empty_event_data(kind)});
  }

  const bool fd_;
  LineSubject subject_;
  Input input_;
  Duration late_{};
};

}  // namespace

void run_line(Input input, bool fd) {
  SetupBytes chosen;
  for (std::uint8_t& byte : chosen) {
    byte = input.byte();
  }
  Setup made = setup(chosen);
  made.fd = fd;
  Run(made, input).all();
}

}  // namespace linegate::fuzz
