// SPDX-License-Identifier: Apache-2.0
// Outputs that are objects of the own node (own_objects): when they are valid, and what they wait
// for.
#include "stack/line/own_outputs.h"

#include <cstdint>
#include <utility>
#include <vector>

#include "stack/base/byte_order.h"

#include "tests/stack/line/under_way_fixture.h"

namespace linegate::line {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Not;

constexpr std::uint16_t kOwnOutputs = 0x6100;
constexpr std::uint8_t kOwnResult = 1;   // in TPDO 10
constexpr std::uint8_t kOwnCount = 2;    // in TPDO 10
constexpr std::uint8_t kOwnRead = 3;     // in no PDO
constexpr std::uint8_t kOwnScanned = 4;  // in the scanner list of TPDO 11

OwnObject own_output(std::uint8_t sub) {
  OwnObject out{.index = kOwnOutputs, .variable = {}, .in_image = true};
  out.variable.sub = sub;
  out.variable.type = od::DataType::unsigned16;
  out.variable.access = od::Access::rwr;
  out.variable.mappable = true;
  return out;
}

LineConfig with_own_outputs(Role role = Role::manager) {
  LineConfig config = config_with_axis();
  config.role = role;
  for (const std::uint8_t sub : {kOwnResult, kOwnCount, kOwnRead, kOwnScanned}) {
    config.own_objects.push_back(own_output(sub));
  }
  pdo::Parameters tpdo;
  tpdo.number = 10;
  tpdo.cob_id = {0x3AA | can::CobId::kNoRtrBit};
  tpdo.mapping = {{{kOwnOutputs, kOwnResult}, 16}, {{kOwnOutputs, kOwnCount}, 16}};
  pdo::Parameters mpdo;
  mpdo.number = 11;
  mpdo.cob_id = {0x3AB | can::CobId::kNoRtrBit};
  mpdo.mpdo = pdo::MpdoMode::source;
  config.forwarding.tpdos = {tpdo, mpdo};
  config.mpdo_scanner = {0x01'6100'04};
  return config;
}

class OwnOutputsTest : public AcknowledgedOutputs {
 protected:
  void run(LineConfig config = with_own_outputs()) {
    AcknowledgedOutputs::run(std::move(config));
    settle();
  }
  // As a slave, whose own node its master starts.
  void run_as_slave() {
    LineConfig config = with_own_outputs(Role::device);
    config.own_values = {{{0x1F80, 0}, {std::byte{4}, {}, {}, {}}}};  // not self-starting
    make(std::move(config));
    line_->expect_acknowledgements();
    line_->start(now_);
    settle();
  }
  void settle() {
    hand_out();
    acknowledge_all();
  }
  std::uint32_t entry(std::uint8_t sub) {
    const std::vector<image::Entry>& entries = line_->layout(Direction::outputs).entries;
    const auto found = std::ranges::find_if(entries, [sub](const image::Entry& each) {
      return each.index == kOwnOutputs && each.sub == sub;
    });
    return static_cast<std::uint32_t>(found - entries.begin());
  }
  void write(std::uint8_t sub, std::uint8_t value) {
    OutputWrite write{.layout_id = line_->layout(Direction::outputs).id, .arming = 1};
    write.values.push_back({.entry = entry(sub), .length = 2});
    write.values.back().data[0] = std::byte{value};
    EXPECT_EQ(line_->write_outputs(write, now_), OutputRefusal::none);
  }
  void write_by_hand(std::uint8_t sub, std::uint8_t value) {
    line_->execute(
        {.request = SingleOutput{.entry = entry(sub), .data = {std::byte{value}, std::byte{}}}},
        now_);
  }
  // Of another node, to the server of the own node.
  void download(std::uint8_t sub, std::uint8_t value) {
    hear(0x67F, {0x2B, 0x00, 0x61, sub, value, 0, 0, 0});
    line_->advance(now_);
  }
  void command_own(nmt::Command command) {
    line_->execute({.request = NmtRequest{.node = 127, .command = command}}, now_);
    line_->advance(now_);
    EXPECT_TRUE(answer().ok());
  }
  bool valid(std::uint8_t sub) { return snapshot(Direction::outputs).is_valid(entry(sub)); }
  std::optional<OutputWait> reason(std::uint8_t sub) {
    OutputState state;
    line_->output_state(0, state);
    const auto found = std::ranges::find(state.waits, entry(sub), &OutputState::Wait::entry);
    return found == state.waits.end() ? std::nullopt : std::optional(found->reason);
  }
  void set_bus(can::BusEvent::Kind kind) {
    line_->bus_event({.kind = kind, .code = 100, .time = now_});
    line_->advance(now_);
  }
};

TEST_F(OwnOutputsTest, AreValidWhenTheBusAcknowledgedTheirTpdo) {
  run();
  EXPECT_TRUE(valid(kOwnResult)) << "the default";
  write(kOwnResult, 4);
  EXPECT_FALSE(valid(kOwnResult));
  EXPECT_TRUE(valid(kOwnCount));
  EXPECT_EQ(reason(kOwnResult), OutputWait::turn);
  EXPECT_THAT(hand_out(), ElementsAre("3AA#04000000"));
  EXPECT_FALSE(valid(kOwnResult)) << "only the controller has the frame";
  pass(milliseconds(200));
  EXPECT_EQ(reason(kOwnResult), OutputWait::bus);
  acknowledge_all();
  EXPECT_TRUE(valid(kOwnResult));
  EXPECT_EQ(reason(kOwnResult), std::nullopt);
}

TEST_F(OwnOutputsTest, OfASlaveWaitForItsMaster) {
  run_as_slave();
  write(kOwnResult, 4);
  EXPECT_FALSE(valid(kOwnResult));
  EXPECT_FALSE(valid(kOwnRead));
  EXPECT_EQ(reason(kOwnResult), OutputWait::own_node);
  write_by_hand(kOwnResult, 5);
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{10, PdoWait::operational}}));
  hear(0x000, {0x01, 0x7F});
  line_->advance(now_);
  EXPECT_FALSE(valid(kOwnResult));
  EXPECT_TRUE(valid(kOwnRead)) << "its master reads it by SDO";
  EXPECT_THAT(hand_out(), Contains("3AA#05000000"));
  EXPECT_FALSE(valid(kOwnResult));
  acknowledge_all();
  EXPECT_TRUE(valid(kOwnResult));
  hear(0x000, {0x02, 0x7F});
  line_->advance(now_);
  EXPECT_FALSE(valid(kOwnResult));
  EXPECT_FALSE(valid(kOwnRead));
}

TEST_F(OwnOutputsTest, AFrameFromBeforeAResetDoesNotCount) {
  run();
  write(kOwnResult, 4);
  hand_out();
  command_own(nmt::Command::reset_communication);
  command_own(nmt::Command::start);
  acknowledge_all();
  EXPECT_FALSE(valid(kOwnResult));
  settle();
  EXPECT_TRUE(valid(kOwnResult));
}

TEST_F(OwnOutputsTest, AValueThatChangedMeanwhileWaits) {
  run();
  write(kOwnResult, 4);
  hand_out();
  write(kOwnResult, 7);
  write(kOwnCount, 1);
  acknowledge_all();
  EXPECT_FALSE(valid(kOwnResult));
  EXPECT_FALSE(valid(kOwnCount));
  settle();
  EXPECT_TRUE(valid(kOwnResult));
  EXPECT_TRUE(valid(kOwnCount));
}

TEST_F(OwnOutputsTest, AWriterThatRepeatsAnUnchangedValueSendsOneMpdo) {
  run();
  write(kOwnScanned, 5);
  EXPECT_THAT(hand_out(), ElementsAre(testing::StartsWith("3AB#")));
  const std::uint64_t first = given_;
  for (int i = 0; i < 5; ++i) {
    write(kOwnScanned, 5);
    EXPECT_THAT(hand_out(), IsEmpty());
  }
  line_->acknowledged(first, now_);
  EXPECT_TRUE(valid(kOwnScanned));
}

TEST_F(OwnOutputsTest, ALostFrameIsSentAgain) {
  run();
  write(kOwnResult, 4);
  write(kOwnScanned, 5);
  hand_out();
  line_->lost(given_ - 1, given_);
  line_->acknowledged(given_, now_);
  EXPECT_FALSE(valid(kOwnResult));
  EXPECT_FALSE(valid(kOwnScanned));
  EXPECT_THAT(hand_out(), ElementsAre("3AA#04000000", "3AB#7F00610405000000"));
  acknowledge_all();
  EXPECT_TRUE(valid(kOwnResult));
  EXPECT_TRUE(valid(kOwnScanned));
}

TEST_F(OwnOutputsTest, AreNotValidWithoutABusAndAreSentAgainWhenItIsBack) {
  run();
  write(kOwnResult, 4);
  write(kOwnScanned, 5);
  settle();
  set_bus(can::BusEvent::Kind::interface_failed);
  for (const std::uint8_t sub : {kOwnResult, kOwnRead, kOwnScanned}) {
    EXPECT_FALSE(valid(sub)) << int{sub};
    EXPECT_EQ(reason(sub), OutputWait::bus) << int{sub};
  }
  set_bus(can::BusEvent::Kind::interface_ready);
  EXPECT_FALSE(valid(kOwnResult));
  EXPECT_FALSE(valid(kOwnScanned));
  EXPECT_TRUE(valid(kOwnRead));
  const std::vector<std::string> frames = hand_out();
  EXPECT_THAT(frames, Contains("3AA#04000000"));
  EXPECT_THAT(frames, Contains("3AB#7F00610405000000"));
  acknowledge_all();
  EXPECT_TRUE(valid(kOwnResult));
  EXPECT_TRUE(valid(kOwnScanned));
}

TEST_F(OwnOutputsTest, ASingleWriteIsAnsweredWhenItsFrameIsAcknowledged) {
  run();
  write_by_hand(kOwnResult, 4);
  EXPECT_FALSE(is_answered());
  EXPECT_THAT(hand_out(), ElementsAre("3AA#04000000"));
  EXPECT_FALSE(is_answered());
  acknowledge_all();
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{10, PdoWait::none}}));
  write_by_hand(kOwnScanned, 4);
  EXPECT_FALSE(is_answered());
  settle();
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{11, PdoWait::none}}));
  write_by_hand(kOwnRead, 4);
  EXPECT_EQ(answer().data, ReplyData{}) << "no PDO carries it";
}

TEST_F(OwnOutputsTest, ASingleWriteThatIsNotAcknowledgedIsAnsweredWithTheReason) {
  run();
  write_by_hand(kOwnResult, 4);
  hand_out();
  pass(kSendTime);
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{10, PdoWait::bus}}));
  acknowledge_all();
  write_by_hand(kOwnScanned, 4);
  hand_out();
  pass(kSendTime);
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{11, PdoWait::bus}}));
}

// The reset replaces the value by its default, which is sent.
TEST_F(OwnOutputsTest, ASingleWriteIsNotAnsweredByAFrameWithTheDefaultOfAReset) {
  run();
  write_by_hand(kOwnResult, 4);
  write_by_hand(kOwnScanned, 4);
  line_->execute({.request = NmtRequest{.node = 127, .command = nmt::Command::reset_node}}, now_);
  line_->advance(now_);
  settle();
  EXPECT_EQ(answer().error, to_error(Refusal::wrong_state));
  EXPECT_EQ(answer().error, to_error(Refusal::wrong_state));
  EXPECT_TRUE(answer().ok()) << "the NMT command";
}

// Nothing sends the value any more, so it waits for nothing.
TEST_F(OwnOutputsTest, ASingleWriteWhoseFrameIsLostInAResetIsRefused) {
  run();
  write_by_hand(kOwnResult, 4);
  ASSERT_THAT(hand_out(), ElementsAre("3AA#04000000"));
  command_own(nmt::Command::reset_node);
  line_->lost(given_, given_);
  settle();
  EXPECT_FALSE(is_answered());
  pass(kSendTime);
  EXPECT_EQ(answer().error, to_error(Refusal::wrong_state));
}

TEST_F(OwnOutputsTest, ASingleWriteWhoseFrameIsUnderWayInAResetWaitsForTheBus) {
  run();
  write_by_hand(kOwnResult, 4);
  ASSERT_THAT(hand_out(), ElementsAre("3AA#04000000"));
  command_own(nmt::Command::reset_node);
  pass(kSendTime);
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{10, PdoWait::bus}}));
}

// Reset communication keeps the value.
TEST_F(OwnOutputsTest, ASingleWriteIsAnsweredByItsFrameAfterResetCommunication) {
  run();
  write_by_hand(kOwnResult, 4);
  command_own(nmt::Command::reset_communication);
  EXPECT_THAT(hand_out(), Contains("3AA#04000000"));
  acknowledge_all();
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{10, PdoWait::none}}));
}

// The frame under way has the present value, but it is not the last one.
TEST_F(OwnOutputsTest, AValueThatReturnsReplacesTheMpdoThatWaits) {
  run();
  write(kOwnScanned, 4);
  ASSERT_THAT(hand_out(), ElementsAre("3AB#7F00610404000000"));
  write(kOwnScanned, 5);
  write(kOwnScanned, 4);
  EXPECT_THAT(hand_out(), ElementsAre("3AB#7F00610404000000"));
  acknowledge_all();
  EXPECT_TRUE(valid(kOwnScanned));
}

TEST_F(OwnOutputsTest, ASingleWriteWhoseMpdoIsLostIsAnsweredByItsRepetition) {
  run();
  write_by_hand(kOwnScanned, 4);
  ASSERT_THAT(hand_out(), ElementsAre("3AB#7F00610404000000"));
  line_->lost(given_, given_);
  line_->acknowledged(given_, now_);
  EXPECT_FALSE(is_answered());
  settle();
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{11, PdoWait::none}}));
  EXPECT_TRUE(valid(kOwnScanned));
}

// TPDO 9 sends the value only with SYNC, and TPDO 10 at once.
TEST_F(OwnOutputsTest, ASingleWriteIsAnsweredByTheFirstOfItsTpdosThatIsAcknowledged) {
  LineConfig config = with_own_outputs();
  pdo::Parameters tpdo = config.forwarding.tpdos.front();
  tpdo.number = 9;
  tpdo.cob_id = {0x3A9 | can::CobId::kNoRtrBit};
  tpdo.type = 1;
  config.forwarding.tpdos.insert(config.forwarding.tpdos.begin(), tpdo);
  run(std::move(config));
  write_by_hand(kOwnResult, 4);
  ASSERT_THAT(hand_out(), ElementsAre("3AA#04000000"));
  EXPECT_FALSE(is_answered());
  acknowledge_all();
  EXPECT_TRUE(valid(kOwnResult));
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{10, PdoWait::none}}));
  write_by_hand(kOwnResult, 5);
  ASSERT_THAT(hand_out(), ElementsAre("3AA#05000000"));
  pass(kSendTime);
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{9, PdoWait::bus}}));
}

TEST_F(OwnOutputsTest, OfMpdosWithAnotherCobIdAreSentAgain) {
  run();
  write(kOwnScanned, 5);
  settle();
  ASSERT_TRUE(valid(kOwnScanned));
  od::Dictionary& own = line_->dictionary();
  ASSERT_TRUE(own.set({0x180A, 1}, 0x4000'03ACU));
  line_->advance(now_);
  EXPECT_FALSE(valid(kOwnScanned)) << "its consumers have the value under another COB-ID";
  EXPECT_THAT(hand_out(), ElementsAre("3AC#7F00610405000000"));
  acknowledge_all();
  EXPECT_TRUE(valid(kOwnScanned));
}

TEST_F(OwnOutputsTest, OfMpdosThatAreSwitchedOnAreSent) {
  run();
  od::Dictionary& own = line_->dictionary();
  write(kOwnScanned, 5);
  ASSERT_TRUE(own.set({0x180A, 1}, 0xC000'03ABU));
  line_->advance(now_);
  EXPECT_THAT(hand_out(), IsEmpty());
  EXPECT_TRUE(valid(kOwnScanned)) << "it is read by SDO now";
  ASSERT_TRUE(own.set({0x180A, 1}, 0x4000'03ABU));
  line_->advance(now_);
  EXPECT_FALSE(valid(kOwnScanned));
  EXPECT_THAT(hand_out(), ElementsAre("3AB#7F00610405000000"));
  acknowledge_all();
  EXPECT_TRUE(valid(kOwnScanned));
}

TEST_F(OwnOutputsTest, AnObjectWriteIsAnsweredWhenItsFrameIsAcknowledged) {
  run();
  const auto write_object = [this](std::uint8_t sub, bool keep) {
    line_->execute({.request = ObjectWrite{.node = 127,
                                           .address = {kOwnOutputs, sub},
                                           .data = {std::byte{9}, std::byte{}},
                                           .keep_pdo = keep}},
                   now_);
  };
  write_object(kOwnResult, true);
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{10, PdoWait::trigger}}));
  EXPECT_THAT(hand_out(), IsEmpty());
  EXPECT_EQ(reason(kOwnResult), OutputWait::trigger);
  write_object(kOwnResult, false);
  EXPECT_FALSE(is_answered());
  EXPECT_THAT(hand_out(), ElementsAre("3AA#09000000"));
  acknowledge_all();
  EXPECT_EQ(answer().data, (ReplyData{WrittenByPdo{10, PdoWait::none}}));
  write_object(kOwnRead, false);
  EXPECT_EQ(answer().data, ReplyData{});
}

// A download requests no TPDO; an MPDO is sent by itself.
TEST_F(OwnOutputsTest, AValueOfAnotherNodeWaitsForATrigger) {
  run();
  download(kOwnResult, 5);
  settle();
  EXPECT_FALSE(valid(kOwnResult));
  EXPECT_EQ(reason(kOwnResult), OutputWait::trigger);
  write(kOwnResult, 5);
  EXPECT_THAT(hand_out(), ElementsAre("3AA#05000000")) << "a write is a trigger";
  acknowledge_all();
  EXPECT_TRUE(valid(kOwnResult));
  download(kOwnResult, 6);
  settle();
  write(kOwnResult, 5);
  EXPECT_THAT(hand_out(), ElementsAre("3AA#05000000")) << "as in the last sample";
  acknowledge_all();
  EXPECT_TRUE(valid(kOwnResult));
  download(kOwnScanned, 5);
  EXPECT_FALSE(valid(kOwnScanned));
  EXPECT_THAT(hand_out(), Contains("3AB#7F00610405000000"));
  EXPECT_FALSE(valid(kOwnScanned));
  acknowledge_all();
  EXPECT_TRUE(valid(kOwnScanned));
}

TEST_F(OwnOutputsTest, FollowTheMappingAndTheScannerList) {
  run();
  write(kOwnRead, 4);
  write(kOwnScanned, 5);
  settle();
  od::Dictionary& own = line_->dictionary();
  ASSERT_TRUE(own.set({0x1FA0, 1}, 0x01'6100'03U));
  line_->advance(now_);
  EXPECT_TRUE(valid(kOwnScanned)) << "it is read by SDO now";
  EXPECT_FALSE(valid(kOwnRead)) << "no MPDO had it";
  EXPECT_EQ(reason(kOwnRead), OutputWait::turn);
  EXPECT_THAT(hand_out(), ElementsAre("3AB#7F00610304000000"));
  acknowledge_all();
  EXPECT_TRUE(valid(kOwnRead));
  ASSERT_TRUE(own.set({0x1809, 1}, 0x8000'03AAU));
  line_->advance(now_);
  write(kOwnResult, 8);
  EXPECT_TRUE(valid(kOwnResult)) << "no TPDO carries it";
}

TEST_F(OwnOutputsTest, OfALineThatStopsAreNotValid) {
  run();
  ASSERT_TRUE(valid(kOwnResult));
  line_->stop(now_);
  for (const std::uint8_t sub : {kOwnResult, kOwnRead, kOwnScanned}) {
    EXPECT_FALSE(valid(sub)) << int{sub};
  }
}

}  // namespace
}  // namespace linegate::line
