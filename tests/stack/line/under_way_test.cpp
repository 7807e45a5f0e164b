// SPDX-License-Identifier: Apache-2.0
// Replies and reported states when the bus acknowledges frames, does not acknowledge them, or loses
// them.
#include "tests/stack/line/under_way_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST_F(AcknowledgedOutputs, AreValidWhenTheirFrameWasAcknowledged) {
  run();
  write(1);
  EXPECT_FALSE(valid());
  EXPECT_THAT(hand_out(), ElementsAre("205#0100000002"));
  EXPECT_FALSE(valid()) << "only the controller has the frame";
  acknowledge_all();
  EXPECT_TRUE(valid());
}

TEST_F(AcknowledgedOutputs, AreNotValidByTheFrameOfAnOlderValue) {
  run();
  write(1);
  hand_out();
  write(2);
  acknowledge_all();
  EXPECT_FALSE(valid());
  EXPECT_THAT(hand_out(), ElementsAre("205#0200000002"));
  write(3);
  write(2);
  acknowledge_all();
  EXPECT_FALSE(valid()) << "the value changed meanwhile";
  hand_out();
  acknowledge_all();
  EXPECT_TRUE(valid());
}

// Validity is per value: a neighbour in the same PDO that changes faster than the bus acknowledges
// is invalid meanwhile, the other values are valid.
TEST_F(AcknowledgedOutputs, AreValidBesideANeighbourThatChangesFasterThanTheBus) {
  run();
  const auto neighbour_is_valid = [this] { return snapshot(Direction::outputs).is_valid(1); };
  write(1);
  hand_out();
  for (std::uint32_t value = 2; value < 20; ++value) {
    const std::uint64_t earlier = given_;
    write(value);
    hand_out();
    line_->acknowledged(earlier, now_);
    EXPECT_FALSE(valid()) << value;
    EXPECT_TRUE(neighbour_is_valid()) << value;
  }
  acknowledge_all();
  EXPECT_TRUE(valid());
  EXPECT_TRUE(neighbour_is_valid());
}

// A SYNC that waits for the bus does not make the sampled outputs older.
TEST_F(AcknowledgedOutputs, ThatAreSynchronousAreThoseOfTheTimeWhenSyncIsHandedOut) {
  LineConfig config = config_with_synchronous_axis();
  config.sync_period = milliseconds(10);
  run(std::move(config));
  write(1);
  live(milliseconds(30));
  hand_out();
  acknowledge_all();
  write(2);
  live(milliseconds(50));
  write(3);
  EXPECT_THAT(hand_out(), ElementsAre("080#", "205#0300000002"));
  acknowledge_all();
  EXPECT_TRUE(valid());
}

// The outputs have the values of the first frame under way.
TEST_F(AcknowledgedOutputs, AreValidWithTheFirstFrameThatCarriesThem) {
  run();
  write(1);
  hand_out();
  const std::uint64_t first = given_;
  line_->execute({.request = PdoTrigger{.number = 1}}, now_);
  EXPECT_THAT(hand_out(), ElementsAre("205#0100000002"));
  line_->acknowledged(first, now_);
  EXPECT_TRUE(valid());
}

TEST_F(AcknowledgedOutputs, AreNotValidByAFrameFromBeforeTheStartOfTheirNode) {
  run();
  write(1);
  hand_out();
  hear(0x705, {0x7F});
  line_->advance(now_);
  hear(0x705, {0x05});
  line_->advance(now_);
  acknowledge_all();
  EXPECT_FALSE(valid());
  EXPECT_THAT(hand_out(), ElementsAre("205#0100000002"));
  acknowledge_all();
  EXPECT_TRUE(valid());
}

TEST_F(AcknowledgedOutputs, AreNotValidByFramesThatTheBusLost) {
  run();
  write(1);
  hand_out();
  line_->lost(given_, given_);
  start_node();
  EXPECT_THAT(hand_out(), ElementsAre("000#0105", "205#0100000002")) << "the PDO is repeated";
  line_->acknowledged(given_ - 1, now_);
  EXPECT_FALSE(valid()) << "the start was acknowledged, not the PDO";
  acknowledge_all();
  EXPECT_TRUE(valid());
}

TEST_F(AcknowledgedOutputs, AreNotSentAgainToANodeThatIsNotStarted) {
  run();
  write(1);
  hand_out();
  hear(0x705, {0x7F});
  line_->advance(now_);
  line_->lost(given_, given_);
  EXPECT_THAT(hand_out(), IsEmpty());
}

TEST_F(AcknowledgedOutputs, WithoutErrorControlAreNotValidByALostStart) {
  boot_unwatched();
  EXPECT_THAT(hand_out(), ElementsAre("000#0105"));
  line_->lost(given_, given_);
  EXPECT_EQ(line_->node_state(5).state, nmt::State::pre_operational) << "the start was lost";
  line_->advance(now_);
  EXPECT_THAT(hand_out(), ElementsAre("000#0105")) << "the start is repeated";
  EXPECT_EQ(line_->node_state(5).state, nmt::State::pre_operational);
  acknowledge_all();
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  EXPECT_FALSE(valid());
  EXPECT_THAT(hand_out(), ElementsAre("205#0900000003"));
  acknowledge_all();
  EXPECT_TRUE(valid());
}

// A message received before the NMT command was on the bus does not show the state of the node
// after the command.
TEST_F(AcknowledgedOutputs, AreNotSentToANodeWhoseResetIsOnItsWayToTheBus) {
  run_unwatched();
  line_->execute({.request = NmtRequest{.node = 5, .command = nmt::Command::reset_node}}, now_);
  EXPECT_THAT(hand_out(), ElementsAre("000#8105"));
  ASSERT_TRUE(line_->dictionary().set({0x1F80, 0}, 4U));
  pass(milliseconds(1));
  ASSERT_EQ(line_->state().role, Role::device);
  hear(0x705, {0x00});
  hear(0x000, {0x01, 0x05});
  line_->advance(now_);
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  EXPECT_THAT(hand_out(), IsEmpty()) << "a reset is under way";
  acknowledge_all();
  EXPECT_EQ(line_->node_state(5).state, nmt::State::unknown);
  EXPECT_THAT(hand_out(), IsEmpty());
  EXPECT_FALSE(valid());
  hear(0x705, {0x00});
  hear(0x000, {0x01, 0x05});
  line_->advance(now_);
  EXPECT_THAT(hand_out(), ElementsAre("205#0900000003"));
  acknowledge_all();
  EXPECT_TRUE(valid());
}

// After the first of two commands the node is not in its previous state, even before the second one
// is acknowledged.
TEST_F(AcknowledgedOutputs, AreThoseOfAStoppedNodeFromTheFirstOfTwoCommandsOn) {
  run_unwatched();
  for (const nmt::Command command :
       {nmt::Command::reset_node, nmt::Command::enter_pre_operational}) {
    line_->execute({.request = NmtRequest{.node = 5, .command = command}}, now_);
  }
  EXPECT_THAT(hand_out(), ElementsAre("000#8105", "000#8005"));
  ASSERT_TRUE(line_->dictionary().set({0x1F80, 0}, 4U));
  pass(milliseconds(1));
  hear(0x705, {0x00});
  hear(0x000, {0x01, 0x05});
  line_->advance(now_);
  EXPECT_EQ(line_->node_state(5).state, nmt::State::operational);
  line_->acknowledged(given_ - 1, now_);
  EXPECT_EQ(line_->node_state(5).state, nmt::State::unknown);
  hear(0x705, {0x00});
  EXPECT_THAT(hand_out(), IsEmpty()) << "the second command is under way";
  hear(0x000, {0x01, 0x05});
  acknowledge_all();
  EXPECT_EQ(line_->node_state(5).state, nmt::State::pre_operational);
  EXPECT_FALSE(valid());
}

TEST_F(AcknowledgedOutputs, AreThoseOfAStoppedNodeThoughBothCommandsAreAcknowledgedTogether) {
  boot_unwatched();
  hand_out();
  acknowledge_all();
  for (const nmt::Command command :
       {nmt::Command::stop, nmt::Command::reset_node, nmt::Command::enter_pre_operational}) {
    line_->execute({.request = NmtRequest{.node = 5, .command = command}}, now_);
  }
  EXPECT_EQ(hand_out().size(), 4U) << "3 commands and the outputs";
  acknowledge_all();
  EXPECT_EQ(line_->node_state(5).state, nmt::State::unknown) << "unknown until its boot-up";
  EXPECT_FALSE(valid());
}

// The acknowledgements of both commands arrive together, and the boot-up message of the node may be
// lost.
TEST_F(AcknowledgedOutputs, AreNotSentToANodeThatIsResetAfterItsStart) {
  boot_unwatched();
  line_->execute({.request = NmtRequest{.node = 5, .command = nmt::Command::reset_node}}, now_);
  EXPECT_THAT(hand_out(), ElementsAre("000#0105", "000#8105"));
  acknowledge_all();
  EXPECT_EQ(line_->node_state(5).state, nmt::State::unknown);
  EXPECT_THAT(hand_out(), IsEmpty());
}

TEST_F(AcknowledgedOutputs, AreNotSentToANodeThatIsStartedBeforeItsBootUpMessage) {
  boot_unwatched();
  hand_out();
  acknowledge_all();
  line_->execute({.request = NmtRequest{.node = 5, .command = nmt::Command::reset_node}}, now_);
  start_node();
  hand_out();
  acknowledge_all();
  EXPECT_EQ(line_->node_state(5).state, nmt::State::unknown);
  hear(0x705, {0x00});
  EXPECT_EQ(line_->node_state(5).state, nmt::State::pre_operational);
}

TEST_F(AcknowledgedOutputs, AreSentToANodeWhoseStopTheBusLost) {
  run();
  write(1);
  hand_out();
  acknowledge_all();
  ASSERT_TRUE(valid());
  line_->execute({.request = NmtRequest{.node = 5, .command = nmt::Command::stop}}, now_);
  EXPECT_THAT(hand_out(), ElementsAre("000#0205"));
  EXPECT_FALSE(valid());
  live(milliseconds(200));
  EXPECT_THAT(hand_out(), IsEmpty()) << "the stop may be on the bus at any time";
  line_->lost(given_, given_);
  line_->advance(now_);
  EXPECT_THAT(hand_out(), ElementsAre("205#0100000002"));
}

TEST_F(AcknowledgedOutputs, NameTheBusAsWhatTheyWaitFor) {
  run();
  write(1);
  hand_out();
  line_->advance(now_);
  EXPECT_EQ(reason(), OutputWait::turn) << "waits for the bus";
  live(milliseconds(150));
  EXPECT_EQ(reason(), OutputWait::bus);
  acknowledge_all();
  EXPECT_TRUE(valid());
}

TEST_F(AcknowledgedCommands, AnNmtCommandIsAnsweredWhenItIsOnTheBus) {
  run();
  start_node();
  EXPECT_FALSE(is_answered());
  EXPECT_THAT(hand_out(), ElementsAre("000#0105"));
  EXPECT_FALSE(is_answered());
  acknowledge_all();
  EXPECT_TRUE(answer().ok());
}

TEST_F(AcknowledgedCommands, AnNmtCommandOnABusWithoutAcknowledgeSaysSo) {
  run();
  start_node();
  hand_out();
  live(milliseconds(900));
  EXPECT_FALSE(is_answered());
  live(milliseconds(200));
  EXPECT_EQ(answer().error, to_error(Refusal::no_acknowledge));
  EXPECT_TRUE(emitted(EventKind::command_refused, 5));
  acknowledge_all();
  EXPECT_FALSE(is_answered()) << "only one reply";
}

TEST_F(AcknowledgedCommands, AnNmtCommandThatABusOffLostIsNotDone) {
  run();
  start_node();
  hand_out();
  line_->lost(given_, given_);
  start_node();
  hand_out();
  acknowledge_all();
  EXPECT_TRUE(answer().ok()) << "the second frame was acknowledged";
  EXPECT_FALSE(is_answered());
  live(milliseconds(1100));
  EXPECT_EQ(answer().error, to_error(Refusal::no_acknowledge));
}

TEST_F(AcknowledgedCommands, AWriteIsAnsweredWhenItsFrameIsOnTheBus) {
  run();
  write(1);
  hand_out();
  acknowledge_all();
  write_by_hand(7);
  EXPECT_FALSE(is_answered());
  EXPECT_THAT(hand_out(), ElementsAre("205#0100000007"));
  EXPECT_FALSE(is_answered());
  acknowledge_all();
  EXPECT_EQ(wait_of(answer()), PdoWait::none);
}

// The frame under way carries the previous value.
TEST_F(AcknowledgedCommands, AWriteIsNotAnsweredByAnEarlierFrame) {
  run();
  write(1);
  hand_out();
  write_by_hand(7);
  acknowledge_all();
  EXPECT_FALSE(is_answered());
  hand_out();
  acknowledge_all();
  EXPECT_EQ(wait_of(answer()), PdoWait::none);
}

TEST_F(AcknowledgedCommands, AWriteOnABusWithoutAcknowledgeWaitsForTheBus) {
  run();
  write(1);
  hand_out();
  write_by_hand(7, milliseconds(300));
  hand_out();
  live(milliseconds(250));
  EXPECT_FALSE(is_answered());
  live(milliseconds(100));
  EXPECT_EQ(wait_of(answer()), PdoWait::bus);
}

// The time-out of an object_write applies to an SDO transfer, and to the caller that waits for the
// reply.
TEST_F(AcknowledgedCommands, AWriteWaitsForTheBusNoLongerThanASecond) {
  run();
  write(1);
  hand_out();
  write_by_hand(7, seconds(5));
  hand_out();
  live(milliseconds(1100));
  EXPECT_EQ(wait_of(answer()), PdoWait::bus);
}

TEST_F(AcknowledgedCommands, AWriteWhoseFrameWasLostIsAnsweredByTheNext) {
  run();
  write(1);
  hand_out();
  acknowledge_all();
  write_by_hand(7);
  hand_out();
  line_->lost(given_, given_);
  pass(milliseconds(10));
  EXPECT_THAT(hand_out(), testing::Not(IsEmpty())) << "the lost frame is repeated";
  acknowledge_all();
  EXPECT_EQ(wait_of(answer()), PdoWait::none);
}

TEST_F(AcknowledgedCommands, TwoThatAreAlikeHaveAFrameEach) {
  run();
  const Command frame{.request = CanSend{.frame = can::make_frame(0x352, {1})}};
  line_->execute(frame, now_);
  line_->execute(frame, now_);
  can::Frame first;
  ASSERT_TRUE(line_->next_frame(first, now_));
  line_->acknowledged(++given_, now_);
  EXPECT_TRUE(is_answered());
  EXPECT_FALSE(is_answered());
  EXPECT_THAT(hand_out(), ElementsAre("352#01"));
  acknowledge_all();
  EXPECT_TRUE(is_answered());
}

TEST_F(AcknowledgedCommands, AWriteOfAPdoWithoutSyncWaitsForItsTurn) {
  run(config_with_synchronous_axis());
  write(1);
  hand_out();
  write_by_hand(7);
  live(milliseconds(1100));
  EXPECT_EQ(wait_of(answer()), PdoWait::turn);
}

// The PDO is sampled at SYNC, and handed out when the outputs already have another value.
TEST_F(AcknowledgedCommands, AWriteWhoseSampleWaitedForTheBusIsAnsweredByItsFrame) {
  run(config_with_synchronous_axis());
  write(1);
  hear(0x080, {});
  hand_out();
  acknowledge_all();
  write_by_hand(7);
  hear(0x080, {});
  write(3);
  EXPECT_THAT(hand_out(), ElementsAre("205#0100000007"));
  acknowledge_all();
  EXPECT_EQ(wait_of(answer()), PdoWait::none);
}

TEST_F(AcknowledgedCommands, AnOlderSampleIsNoAnswerToAWrite) {
  run(config_with_synchronous_axis());
  write(1);
  hear(0x080, {});
  write_by_hand(7);
  EXPECT_THAT(hand_out(), ElementsAre("205#0100000002"));
  acknowledge_all();
  EXPECT_FALSE(is_answered());
}

TEST_F(AcknowledgedCommands, AWriteToANodeThatLeavesOperationalMeanwhileIsRefused) {
  run();
  write(1);
  hand_out();
  write_by_hand(7, milliseconds(80));
  hear(0x705, {0x7F});
  hand_out();
  pass(milliseconds(90));
  EXPECT_EQ(answer().error, to_error(Refusal::wrong_state));
}

TEST_F(AcknowledgedCommands, AFrameOfNoServiceIsAnsweredWhenItIsOnTheBus) {
  run();
  const Command frame{.request = CanSend{.frame = can::make_frame(0x352, {1})}};
  line_->execute(frame, now_);
  hand_out();
  EXPECT_FALSE(is_answered());
  acknowledge_all();
  EXPECT_TRUE(answer().ok());
  line_->execute(frame, now_);
  live(milliseconds(1100));
  EXPECT_EQ(answer().error, to_error(Refusal::no_acknowledge));
}

TEST_F(AcknowledgedCommands, ThatWaitEndWithTheLine) {
  run();
  start_node();
  line_->stop(now_);
  EXPECT_EQ(answer().error, to_error(Refusal::cancelled));
}

// A write times out while no node acknowledges, and its frame is acknowledged when the bus is
// available again. This does not answer the next write of the same object, whose frame was not sent
// yet.
TEST_F(AcknowledgedCommands, ALateAnswerIsNotThatToTheNextWriteOfTheObject) {
  run();
  const auto write = [this](std::uint64_t tag) {
    line_->execute({.tag = tag,
                    .request = SdoWrite{.node = 5,
                                        .address = {0x2000, 0},
                                        .data = {std::byte{static_cast<std::uint8_t>(tag)}}}},
                   now_);
  };
  write(1);
  EXPECT_THAT(hand_out(), testing::Contains("605#2F00200001000000"));
  live(milliseconds(500));
  EXPECT_EQ(answer().error, to_error(AbortCode::timeout));
  write(2);
  hear(0x585, {0x60, 0x00, 0x20, 0x00, 0, 0, 0, 0});
  EXPECT_FALSE(is_answered());
  EXPECT_THAT(hand_out(), testing::Not(testing::Contains("605#2F00200002000000")));
  acknowledge_all();
  pass(milliseconds(10));
  EXPECT_THAT(hand_out(), testing::Contains("605#2F00200002000000"));
  hear(0x585, {0x60, 0x00, 0x20, 0x00, 0, 0, 0, 0});
  const Reply done = answer();
  EXPECT_EQ(done.tag, 2U);
  EXPECT_TRUE(done.ok());
}

}  // namespace
}  // namespace linegate::line
