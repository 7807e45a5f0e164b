// SPDX-License-Identifier: Apache-2.0
// PDOs that a command requests with a remote frame, and MPDOs of the own node.
#include "stack/base/byte_order.h"
#include "stack/od/dictionary.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::uint16_t kOwnObject = 0x2100;

OwnObject own_object(std::uint8_t sub, od::DataType type) {
  OwnObject out{.index = kOwnObject, .variable = {}};
  out.variable.sub = sub;
  out.variable.type = type;
  out.variable.access = od::Access::rw;
  out.variable.mappable = true;
  out.variable.value.resize(od::byte_size(type));
  return out;
}

pdo::Parameters own_mpdo(std::uint16_t number, std::uint32_t id, pdo::MpdoMode mode) {
  pdo::Parameters out;
  out.number = number;
  out.cob_id = {id | can::CobId::kNoRtrBit};
  out.mpdo = mode;
  return out;
}

class PdoCommands : public LineTest {
 protected:
  // TPDO 100 is an MPDO in destination address mode, TPDO 101 in source address mode; RPDO 100 and
  // 101 likewise.
  static LineConfig with_mpdos() {
    LineConfig config = config_with_axis();
    for (std::uint8_t sub = 1; sub <= 3; ++sub) {
      config.own_objects.push_back(own_object(sub, od::DataType::unsigned32));
    }
    auto& forwarding = config.forwarding;
    forwarding.tpdos = {own_mpdo(100, 0x1F0, pdo::MpdoMode::destination),
                        own_mpdo(101, 0x1F1, pdo::MpdoMode::source)};
    forwarding.tpdos[0].mapping = {{{kOwnObject, 1}, 32}};
    forwarding.rpdos = {own_mpdo(100, 0x1F2, pdo::MpdoMode::destination),
                        own_mpdo(101, 0x1F3, pdo::MpdoMode::source)};
    config.mpdo_scanner = {0x01'2100'02};
    config.mpdo_dispatcher = {0x01'2100'03'6000'01'05};
    return config;
  }
  void run(LineConfig config) {
    make(std::move(config));
    boot();
    pass(milliseconds(1));
    sent();
    events();
  }
  Reply ask(Command command) {
    line_->execute(std::move(command), now_);
    return answer();
  }
  bool answered() {
    Reply reply;
    return line_->pop_reply(reply);
  }
  static Command request(std::uint8_t node, std::uint16_t code) {
    return {.request = PdoRequest{.node = node, .number = code}};
  }
  static Command by_mpdo(std::uint8_t node, std::vector<std::byte> data) {
    return {.request = MpdoWrite{.node = node, .address = {0x6200, 1}, .data = std::move(data)}};
  }
  static std::vector<std::byte> bytes(std::initializer_list<unsigned> values) {
    std::vector<std::byte> out;
    for (const unsigned value : values) {
      out.push_back(static_cast<std::byte>(value));
    }
    return out;
  }
  std::uint64_t own(std::uint8_t sub) {
    return line_->dictionary().number({kOwnObject, sub}).value_or(~0ULL);
  }
};

TEST_F(PdoCommands, AValueGoesByMpdoToAnObjectOfOneNodeOrOfAll) {
  run(with_mpdos());
  const Reply done = ask(by_mpdo(5, bytes({0x34, 0x12})));
  EXPECT_TRUE(done.ok());
  EXPECT_EQ(done.data, ReplyData{SentByMpdo{100}});
  EXPECT_THAT(sent(), ElementsAre("1F0#8500620134120000"));
  EXPECT_EQ(own(1), 0x1234U) << "the object that the TPDO maps";
  EXPECT_TRUE(ask(by_mpdo(0, bytes({7}))).ok());
  EXPECT_THAT(sent(), ElementsAre("1F0#8000620107000000"));
  EXPECT_EQ(ask(by_mpdo(5, bytes({}))).error, to_error(Refusal::bad_request));
  EXPECT_EQ(ask(by_mpdo(5, bytes({1, 2, 3, 4, 5}))).error, to_error(Refusal::bad_request));
  Command other = by_mpdo(5, bytes({1}));
  std::get<MpdoWrite>(other.request).tpdo = 101;
  EXPECT_EQ(ask(other).error, to_error(Refusal::unknown_entry)) << "it is in the other mode";
  EXPECT_THAT(sent(), IsEmpty());
}

TEST_F(PdoCommands, WithoutSuchATpdoNothingGoesByMpdo) {
  run(config_with_axis());
  EXPECT_EQ(ask(by_mpdo(5, bytes({1}))).error, to_error(Refusal::unknown_entry));
}

TEST_F(PdoCommands, AnObjectOfTheScannerListIsSentWhenItIsWritten) {
  run(with_mpdos());
  LocalWrite write{.address = {kOwnObject, 2}, .data = bytes({9, 0, 0, 0})};
  EXPECT_TRUE(ask({.request = write}).ok());
  EXPECT_THAT(sent(), ElementsAre("1F1#7F00210209000000"));
  write.address.sub = 3;
  EXPECT_TRUE(ask({.request = write}).ok());
  EXPECT_THAT(sent(), IsEmpty()) << "not in the list";
}

// An object of the application in the outputs of the image.
TEST_F(PdoCommands, AnOutputOfTheScannerListIsSentWhenItIsWritten) {
  LineConfig config = with_mpdos();
  for (const std::uint8_t sub : {std::uint8_t{4}, std::uint8_t{5}}) {
    config.own_objects.push_back(own_object(sub, od::DataType::unsigned16));
    config.own_objects.back().variable.access = od::Access::ro;
    config.own_objects.back().in_image = true;
  }
  config.mpdo_scanner.push_back(0x01'2100'04);
  run(std::move(config));
  const auto& entries = line_->layout(Direction::outputs).entries;
  const auto first = static_cast<std::uint32_t>(entries.size() - 2);
  ASSERT_EQ(entries[first].sub, 4);
  const auto write = [&](std::uint8_t value, std::uint8_t other) {
    OutputWrite out{.layout_id = line_->layout(Direction::outputs).id, .arming = 1};
    out.values.push_back({.entry = first, .length = 2, .data = {std::byte{value}}});
    out.values.push_back({.entry = first + 1, .length = 2, .data = {std::byte{other}}});
    EXPECT_EQ(line_->write_outputs(out, now_), OutputRefusal::none);
    pass(milliseconds(1));
    return sent();
  };
  EXPECT_THAT(write(3, 1), ElementsAre("1F1#7F00210403000000"));
  EXPECT_THAT(write(3, 2), IsEmpty()) << "unchanged; the other object is not in the list";
  EXPECT_THAT(write(4, 2), ElementsAre("1F1#7F00210404000000"));
  OutputWrite bytes_of{.layout_id = line_->layout(Direction::outputs).id, .arming = 1};
  bytes_of.bytes.push_back({entries[first].bit_offset / 8U, bytes({5, 0})});
  EXPECT_EQ(line_->write_outputs(bytes_of, now_), OutputRefusal::none);
  EXPECT_THAT(sent(), ElementsAre("1F1#7F00210405000000"));
  Command one{.request = SingleOutput{.entry = first, .data = bytes({5, 0})}};
  EXPECT_TRUE(ask(one).ok());
  EXPECT_THAT(sent(), ElementsAre("1F1#7F00210405000000")) << "a single write is always sent";
}

// Application objects in the outputs of the image, 2100h:04h and the following, all in the scanner
// list.
class ScannedOutputs : public PdoCommands {
 protected:
  void run_with(std::uint8_t count, bool acknowledges = false) {
    LineConfig config = with_mpdos();
    for (std::uint8_t i = 0; i < count; ++i) {
      config.own_objects.push_back(
          own_object(static_cast<std::uint8_t>(4 + i), od::DataType::unsigned16));
      config.own_objects.back().variable.access = od::Access::ro;
      config.own_objects.back().in_image = true;
    }
    config.mpdo_scanner.push_back(static_cast<std::uint32_t>(count) << 24U | 0x2100'04);
    make(std::move(config));
    if (acknowledges) {
      line_->expect_acknowledgements();
    }
    boot();
    pass(milliseconds(1));
    sent();
    events();
    const auto& entries = line_->layout(Direction::outputs).entries;
    first_ = static_cast<std::uint32_t>(entries.size() - count);
    ASSERT_EQ(entries[first_].sub, 4);
  }
  void command_own(nmt::Command what) {
    EXPECT_TRUE(ask({.request = NmtRequest{.node = 127, .command = what}}).ok());
    pass(milliseconds(1));
  }
  void write(std::uint8_t value, std::uint8_t count = 1) {
    OutputWrite out{.layout_id = line_->layout(Direction::outputs).id, .arming = 1};
    for (std::uint8_t i = 0; i < count; ++i) {
      out.values.push_back({.entry = first_ + i, .length = 2, .data = {std::byte{value}}});
    }
    EXPECT_EQ(line_->write_outputs(out, now_), OutputRefusal::none);
  }
  Command by_hand(std::uint8_t value) {
    return {.request = SingleOutput{.entry = first_, .data = bytes({value, 0})}};
  }
  bool valid(std::uint32_t i = 0) { return snapshot(Direction::outputs).is_valid(first_ + i); }
  static std::vector<std::string> of_scanner(std::vector<std::string> frames) {
    std::erase_if(frames, [](const std::string& each) { return !each.starts_with("1F1#"); });
    return frames;
  }

  std::uint32_t first_ = 0;
};

TEST_F(ScannedOutputs, WhatWasWrittenBeforeOperationalIsSentOnEnteringIt) {
  run_with(1);
  command_own(nmt::Command::enter_pre_operational);
  write(7);
  EXPECT_THAT(of_scanner(sent()), IsEmpty());
  EXPECT_FALSE(valid());
  OutputState state;
  line_->output_state(0, state);
  EXPECT_EQ(state.waits.back(), (OutputState::Wait{first_, OutputWait::own_node}));
  command_own(nmt::Command::start);
  EXPECT_THAT(of_scanner(sent()), ElementsAre("1F1#7F00210407000000"));
  EXPECT_TRUE(valid());
  command_own(nmt::Command::enter_pre_operational);
  command_own(nmt::Command::start);
  EXPECT_THAT(of_scanner(sent()), ElementsAre("1F1#7F00210407000000"));
}

TEST_F(ScannedOutputs, ASingleWriteIsAnsweredWithWhatItWaitsFor) {
  run_with(1);
  command_own(nmt::Command::enter_pre_operational);
  Reply reply = ask(by_hand(7));
  EXPECT_TRUE(reply.ok());
  EXPECT_EQ(reply.data, (ReplyData{WrittenByPdo{101, PdoWait::operational}}));
  command_own(nmt::Command::start);
  EXPECT_THAT(of_scanner(sent()), ElementsAre("1F1#7F00210407000000"));
  reply = ask(by_hand(8));
  EXPECT_EQ(reply.data, (ReplyData{WrittenByPdo{101, PdoWait::none}}));
}

TEST_F(ScannedOutputs, WhereThereIsNoRoomTheyAreSentWhenThereIs) {
  constexpr std::uint8_t kCount = 100;
  run_with(kCount);
  write(7, kCount);
  std::vector<std::string> frames = of_scanner(sent());
  EXPECT_EQ(frames.size(), kCount);
  std::ranges::sort(frames);
  EXPECT_TRUE(std::ranges::adjacent_find(frames) == frames.end());
  EXPECT_TRUE(valid(kCount - 1));
}

// The own node is NMT slave; the two commands of its master arrive together.
TEST_F(ScannedOutputs, AreSentAgainAfterAStopAndAStartAtOnce) {
  run_with(1, true);
  ASSERT_TRUE(line_->dictionary().set({0x1F80, 0}, 4U));
  pass(milliseconds(1));
  ASSERT_EQ(line_->state().role, Role::device);
  write(7);
  std::array<can::Frame, 2> frames = {can::make_frame(0x000, {0x02, 0x7F}),
                                      can::make_frame(0x000, {0x01, 0x7F})};
  for (can::Frame& frame : frames) {
    frame.time = now_;
  }
  line_->receive(frames, now_);
  line_->advance(now_);
  ASSERT_EQ(line_->state().own_state, nmt::State::operational);
  EXPECT_FALSE(valid());
  EXPECT_THAT(of_scanner(sent()), ElementsAre("1F1#7F00210407000000"));
  line_->acknowledged(line_->state().counters.frames_sent, now_);
  EXPECT_TRUE(valid());
}

TEST_F(ScannedOutputs, AreValidWhenTheirFrameWasAcknowledged) {
  run_with(1, true);
  line_->acknowledged(line_->state().counters.frames_sent, now_);
  write(7);
  EXPECT_FALSE(valid());
  EXPECT_THAT(of_scanner(sent()), ElementsAre("1F1#7F00210407000000"));
  EXPECT_FALSE(valid());
  const std::uint64_t number = line_->state().counters.frames_sent;
  line_->lost(number, number);
  EXPECT_THAT(of_scanner(sent()), ElementsAre("1F1#7F00210407000000"));
  line_->acknowledged(number, now_);
  EXPECT_FALSE(valid()) << "the lost frame was not acknowledged";
  line_->acknowledged(number + 1, now_);
  EXPECT_TRUE(valid());
  line_->execute(by_hand(8), now_);
  EXPECT_FALSE(answered());
  sent();
  line_->acknowledged(number + 2, now_);
  EXPECT_TRUE(answer().ok());
}

TEST_F(PdoCommands, WhatComesByMpdoIsInTheObjectsOfTheOwnNode) {
  run(with_mpdos());
  hear(0x1F2, {0xFF, 0x00, 0x21, 0x03, 1, 0, 0, 0});
  EXPECT_EQ(own(3), 1U) << "written to the addressed object";
  hear(0x1F3, {0x05, 0x00, 0x60, 0x01, 2, 0, 0, 0});
  EXPECT_EQ(own(3), 2U) << "written by the dispatcher list";
  hear(0x1F3, {0x06, 0x00, 0x60, 0x01, 3, 0, 0, 0});
  EXPECT_EQ(own(3), 2U) << "from another node: ignored";
}

TEST_F(PdoCommands, ARequestIsAnsweredWhenThePdoCame) {
  LineConfig config = config_with_axis();
  run(std::move(config));
  line_->execute(request(5, 1), now_);
  EXPECT_FALSE(answered());
  const auto frames = sent();
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].substr(0, 4), "185#");
  pass(milliseconds(3));
  hear(0x185, {1, 2, 3, 4, 5, 6});
  pass(milliseconds(1));
  EXPECT_TRUE(answer().ok());
}

TEST_F(PdoCommands, ARequestThatIsNotAnsweredTimesOut) {
  run(config_with_axis());
  Command command = request(5, 1);
  command.timeout = milliseconds(50);
  line_->execute(command, now_);
  sent();
  pass(milliseconds(49));
  EXPECT_FALSE(answered());
  pass(milliseconds(1));
  EXPECT_EQ(answer().error, to_error(Refusal::timed_out));
  line_->execute(command, now_);
  line_->stop(now_);
  EXPECT_EQ(answer().error, to_error(Refusal::cancelled));
}

TEST_F(PdoCommands, WhatCannotBeRequestedIsRefused) {
  run(with_mpdos());
  EXPECT_EQ(ask(request(5, 9)).error, to_error(Refusal::unknown_entry));
  EXPECT_EQ(ask(request(6, 1)).error, to_error(Refusal::unknown_entry));
  EXPECT_EQ(ask(request(0, 100)).error, to_error(Refusal::bad_request)) << "RTR not permitted";
}

}  // namespace
}  // namespace linegate::line
