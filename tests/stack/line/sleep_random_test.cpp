// SPDX-License-Identifier: Apache-2.0
// A manager, a slave and an observer on one bus sleep, wake, stop and lose their bus at random
// times. At any time: no process value is valid from prepare on; valid values are those of the last
// frame on the bus, outputs of one since the last start of the slave; a silent line sends nothing;
// no node is lost; what is answered as done was on the bus.
#include <array>
#include <cstdlib>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "stack/base/byte_order.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using nmt::SleepPhase;

constexpr std::uint8_t kSlave = 5;
constexpr std::uint8_t kManager = 127;

OwnObject object_of_axis(std::uint16_t index, od::DataType type, std::size_t bytes,
                         od::Access access) {
  OwnObject out{.index = index, .variable = {}};
  out.variable.type = type;
  out.variable.access = access;
  out.variable.mappable = true;
  out.variable.value.resize(bytes);
  out.in_image = true;
  return out;
}

LineConfig config_on_bus(Role role) {
  LineConfig config = config_with_axis();
  config.role = role;
  config.heartbeat = milliseconds(100);
  config.sleep = {.request = 0x690, .objection = 0x691};
  config.sleep.check_time = milliseconds(200);
  config.sleep.prepare_time = milliseconds(300);
  config.sleep.silent_time = milliseconds(200);
  config.node_id = role == Role::manager ? kManager : role == Role::device ? kSlave : 0;
  NodeConfig& node = config.nodes[0];
  node.boot = false;
  node.heartbeat = {};
  node.heartbeat_consumer = milliseconds(500);
  if (role != Role::device) {
    return config;
  }
  node.id = kManager;
  node.device = *eds::load(kDeviceFile, "axis.eds", kManager).value;
  config.own_values = {{{0x1F80, 0}, std::vector<std::byte>(4)}};  // starts by itself
  config.own_objects = {object_of_axis(0x2000, od::DataType::unsigned16, 2, od::Access::rwr),
                        object_of_axis(0x2001, od::DataType::integer32, 4, od::Access::rwr),
                        object_of_axis(0x2002, od::DataType::integer32, 4, od::Access::rww),
                        object_of_axis(0x2003, od::DataType::unsigned8, 1, od::Access::rww)};
  pdo::Parameters tpdo{.number = 100, .cob_id = {0x180 + kSlave}};
  tpdo.event_timer = milliseconds(50);
  tpdo.mapping = {{{0x2000, 0}, 16}, {{0x2001, 0}, 32}};
  pdo::Parameters rpdo{.number = 100, .cob_id = {0x200 + kSlave}};
  rpdo.mapping = {{{0x2002, 0}, 32}, {{0x2003, 0}, 8}};
  config.forwarding.tpdos = {tpdo};
  config.forwarding.rpdos = {rpdo};
  return config;
}

class SleepingBus {
 public:
  explicit SleepingBus(unsigned seed) : random_(seed) {
    for (std::size_t who = 0; who < 3; ++who) {
      seats_.push_back(new_seat(who));
      seats_.back().line->start(now_);
    }
    run(seconds(2));
  }

  void step() {
    switch (pick(9)) {
      case 0:
        ask(0, SleepAction::sleep);
        break;
      case 1:
        ask(0, SleepAction::prepare);
        break;
      case 2:
        ask(pick(2), SleepAction::wake);
        break;
      case 3:
        ask(pick(2), SleepAction::check);
        break;
      case 4:
        ask(1, pick(3) == 0 ? SleepAction::object : SleepAction::consent);
        break;
      case 5:
        send_foreign(static_cast<std::uint8_t>(pick(5)));
        break;
      case 6:
        cut();
        break;
      case 7:
        restart(pick(2));
        break;
      default:
        write();
        break;
    }
    run(milliseconds(1 + pick(pick(4) == 0 ? 2000 : 400)));
  }

  // All are awake in the end, with their values.
  void recover() {
    ask(1, SleepAction::consent);
    run(seconds(3));
    ask(0, SleepAction::wake);
    ask(1, SleepAction::wake);
    run(seconds(3));
    write();
    run(seconds(1));
    for (const Seat& seat : seats_) {
      EXPECT_EQ(phase(seat), SleepPhase::awake);
    }
    EXPECT_EQ(seats_[0].line->node_state(kSlave).state, nmt::State::operational);
    EXPECT_TRUE(seats_[0].line->input(0).valid);
    EXPECT_TRUE(seats_[2].line->input(0).valid);
    EXPECT_TRUE(image_of(seats_[0], Direction::outputs).is_valid(0));
  }

 private:
  struct Seat {
    std::unique_ptr<Line> line;
    std::optional<can::Frame> slot{};  // in the controller, until the bus acknowledges it
    std::uint64_t handed_out = 0;
  };

  static Seat new_seat(std::size_t who) {
    constexpr Role kRoles[] = {Role::manager, Role::device, Role::observer};
    auto made = Line::make(config_on_bus(kRoles[who]));
    EXPECT_TRUE(made.ok()) << to_string(made.diagnostics.at(0));
    Seat out{.line = *std::move(made.value)};
    out.line->expect_acknowledgements();
    return out;
  }
  unsigned pick(unsigned count) {
    return std::uniform_int_distribution<unsigned>(0, count - 1)(random_);
  }
  static SleepPhase phase(const Seat& seat) {
    return seat.line->state().sleep.value_or(SleepPhase::awake);
  }
  static image::Snapshot image_of(const Seat& seat, Direction direction) {
    image::Snapshot out;
    seat.line->snapshot(direction, out, Instant{}, false);
    return out;
  }

  void ask(std::size_t who, SleepAction action) {
    asked_[++tag_] = {.action = action, .before = phase(seats_[who])};
    seats_[who].line->execute({.tag = tag_, .request = SleepRequest{action}}, now_);
  }
  void write() {
    for (const std::size_t who : {std::size_t{0}, std::size_t{1}}) {
      Line& line = *seats_[who].line;
      OutputWrite out;
      out.layout_id = line.layout(Direction::outputs).id;
      out.arming = 1;
      const auto& entries = line.layout(Direction::outputs).entries;
      for (std::uint32_t i = 0; i < entries.size(); ++i) {
        OutputValue value{
            .entry = i, .length = static_cast<std::uint8_t>(entries[i].bit_length / 8), .data = {}};
        value.data[0] = static_cast<std::byte>(pick(256));
        out.values.push_back(value);
      }
      EXPECT_EQ(line.write_outputs(out, now_), OutputRefusal::none);
    }
  }
  // A node without sleep, or a second master, which may prepare the nodes: the losses are true
  // then.
  void send_foreign(std::uint8_t code) {
    foreign_ = pick(2) == 0 ? can::make_frame(0x7F0, {1}) : can::make_frame(0x690, {code});
    if (foreign_->id == 0x690 && code == 2) {
      losses_until_ = now_ + seconds(4);
    }
  }
  // No station acknowledges for a time: losses are true then.
  void cut() {
    connected_ = false;
    run(milliseconds(pick(1500)));
    connected_ = true;
    losses_until_ = now_ + seconds(2);
  }
  void restart(std::size_t who) {
    losses_until_ = kNever;
    seats_[who].line->stop(now_);
    run(milliseconds(pick(1000)));
    seats_[who] = new_seat(who);
    seats_[who].line->start(now_);
    losses_until_ = now_ + seconds(2);
  }

  void run(Duration time) {
    const Instant end = now_ + time;
    while (now_ < end) {
      for (Seat& seat : seats_) {
        advance(seat);
      }
      check_values();
      if (connected_ && deliver_next()) {
        continue;
      }
      Instant next = end;
      for (const Seat& seat : seats_) {
        next = std::min(next, seat.line->next_wake());
      }
      now_ = std::max(now_ + std::chrono::microseconds(1), next);
    }
  }
  void advance(Seat& seat) {
    seat.line->advance(now_);
    std::array<Event, 64> events;
    for (std::size_t i = 0, count = seat.line->pop_events(events); i < count; ++i) {
      check_event(seat, events.at(i));
    }
    Reply reply;
    while (seat.line->pop_reply(reply)) {
      check_reply(reply);
    }
    can::Frame frame;
    const bool silent = phase(seat) >= SleepPhase::silent;
    if (!seat.slot && seat.line->next_frame(frame, now_)) {
      EXPECT_FALSE(silent) << text(frame) << " of a silent line";
      EXPECT_TRUE(&seat != &seats_[2]) << text(frame) << " of an observer";
      seat.slot = frame;
      ++seat.handed_out;
    }
  }

  // The frame with the lowest identifier wins the arbitration.
  bool deliver_next() {
    if (foreign_) {
      can::Frame frame = *std::exchange(foreign_, std::nullopt);
      deliver(frame, nullptr);
      return true;
    }
    Seat* first = nullptr;
    for (Seat& seat : seats_) {
      if (seat.slot && (first == nullptr || seat.slot->id < first->slot->id)) {
        first = &seat;
      }
    }
    if (first == nullptr) {
      return false;
    }
    can::Frame frame = *std::exchange(first->slot, std::nullopt);
    deliver(frame, first);
    first->line->acknowledged(first->handed_out, now_);
    return true;
  }
  void deliver(can::Frame& frame, const Seat* from) {
    now_ += std::chrono::microseconds(250);
    frame.time = now_;
    note(frame);
    for (Seat& to : seats_) {
      if (&to != from) {
        to.line->receive(std::span(&frame, 1), now_);
      }
    }
  }
  void note(const can::Frame& frame) {
    if (frame.id == 0x690 && frame.length == 1) {
      for (auto& [tag, asked] : asked_) {
        asked.requests.insert(std::to_integer<std::uint8_t>(frame.data[0]));
      }
    } else if (frame.id == 0x691) {
      for (auto& [tag, asked] : asked_) {
        asked.objected = true;
      }
    } else if (frame.id == 0x700 + kSlave && frame.data[0] == std::byte{0}) {
      taken_.reset();
      sent_.reset();
    } else if (frame.id == 0x200 + kSlave) {
      taken_ = load_le<std::uint32_t>(frame.data.data());
    } else if (frame.id == 0x180 + kSlave) {
      sent_ = load_le<std::uint16_t>(frame.data.data());
    }
  }

  void check_event(const Seat& seat, const Event& event) const {
    const bool is_loss = event.kind() == EventKind::heartbeat_lost ||
                         event.kind() == EventKind::spontaneous_change ||
                         event.kind() == EventKind::shared_node_id ||
                         event.kind() == EventKind::emcy_sent;
    EXPECT_FALSE(is_loss && now_ > losses_until_ && connected_)
        << "event " << static_cast<int>(event.kind()) << " of line " << &seat - seats_.data();
  }
  void check_reply(const Reply& reply) {
    const Asked asked = asked_.at(reply.tag);
    asked_.erase(reply.tag);
    if (!reply.ok()) {
      return;
    }
    const nmt::SleepProtocol bytes;
    switch (asked.action) {
      case SleepAction::check:
        EXPECT_TRUE(asked.requests.contains(bytes.check_byte));
        EXPECT_EQ(asked.objected, !reply.bytes().empty());
        return;
      case SleepAction::sleep:
      case SleepAction::prepare:
        EXPECT_TRUE(asked.requests.contains(bytes.prepare_byte) ||
                    (asked.objected && !reply.bytes().empty()));
        return;
      case SleepAction::wake:
        EXPECT_TRUE(asked.requests.contains(bytes.wake_byte) || asked.before == SleepPhase::check);
        return;
      default:
        return;
    }
  }
  void check_values() {
    for (const Seat& seat : seats_) {
      if (phase(seat) < SleepPhase::prepare) {
        continue;
      }
      const std::uint8_t other = &seat == &seats_[1] ? kManager : kSlave;
      EXPECT_TRUE(phase(seat) == SleepPhase::prepare ||
                  seat.line->node_state(other).state == nmt::State::unknown)
          << "node " << unsigned{other} << " of line " << &seat - seats_.data() << " in phase "
          << nmt::name(phase(seat));
      for (const Direction direction : {Direction::inputs, Direction::outputs}) {
        const auto& entries = seat.line->layout(direction).entries;
        const image::Snapshot image = image_of(seat, direction);
        for (std::uint32_t i = 0; i < entries.size(); ++i) {
          EXPECT_FALSE(entries[i].local_pdo != 0 && image.is_valid(i))
              << entries[i].name << " of line " << &seat - seats_.data() << " in phase "
              << nmt::name(phase(seat));
        }
      }
    }
    const image::Snapshot outputs = image_of(seats_[0], Direction::outputs);
    if (outputs.is_valid(0)) {
      EXPECT_EQ(taken_, load_le<std::uint32_t>(outputs.bytes.data())) << "output of the manager";
    }
    for (const std::size_t who : {std::size_t{0}, std::size_t{2}}) {
      const Line::Input input = seats_[who].line->input(0);
      if (input.valid) {
        EXPECT_EQ(sent_, input.value) << "input of line " << who;
      }
    }
  }

  std::mt19937 random_;
  Instant now_{seconds(100)};
  std::vector<Seat> seats_;
  bool connected_ = true;
  Instant losses_until_{seconds(103)};
  std::optional<can::Frame> foreign_;
  std::optional<std::uint32_t> taken_;  // the output in the last frame to the slave since its boot
  std::optional<std::uint16_t> sent_;   // the input in its last frame
  // A command that was not answered yet, and the messages on the bus since.
  struct Asked {
    SleepAction action = SleepAction::check;
    SleepPhase before = SleepPhase::awake;
    std::set<std::uint8_t> requests{};
    bool objected = false;
  };
  std::map<std::uint64_t, Asked> asked_;  // by tag
  std::uint64_t tag_ = 0;
};

unsigned long number_of_environment(const char* name, unsigned long otherwise) {
  const char* const text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoul(text, nullptr, 10);
}

TEST(SleepRandom, ShowsAndSendsNothingUntrue) {
  const unsigned long first = number_of_environment("LINEGATE_SLEEP_SEED", 1);
  const unsigned long count = number_of_environment("LINEGATE_SLEEP_COUNT", 10);
  for (unsigned long seed = first; seed < first + count; ++seed) {
    SCOPED_TRACE("LINEGATE_SLEEP_SEED=" + std::to_string(seed));
    SleepingBus bus(static_cast<unsigned>(seed));
    for (int i = 0; i < 40; ++i) {
      bus.step();
      if (testing::Test::HasFailure()) {
        return;
      }
    }
    bus.recover();
    if (testing::Test::HasFailure()) {
      return;
    }
  }
}

}  // namespace
}  // namespace linegate::line
