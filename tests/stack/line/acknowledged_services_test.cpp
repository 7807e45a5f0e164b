// SPDX-License-Identifier: Apache-2.0
// PDOs and EMCYs sent by command, MPDOs, and LSS services without a response: the reply follows the
// acknowledgement of the frame on the bus, else it names the reason of the delay.
#include "stack/lss/procedure.h"

#include "tests/stack/line/under_way_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::uint16_t kSent = 0x2100;  // sent by MPDO

class AcknowledgedServices : public AcknowledgedOutputs {
 protected:
  static LineConfig with_mpdo() {
    LineConfig config = config_with_axis();
    OwnObject object{.index = kSent, .variable = {}};
    object.variable.sub = 1;
    object.variable.type = od::DataType::unsigned32;
    object.variable.access = od::Access::rw;
    object.variable.mappable = true;
    object.variable.value.resize(4);
    config.own_objects.push_back(object);
    pdo::Parameters mpdo;
    mpdo.number = 100;
    mpdo.cob_id = {0x1F0 | can::CobId::kNoRtrBit};
    mpdo.mpdo = pdo::MpdoMode::destination;
    mpdo.mapping = {{{kSent, 1}, 32}};
    config.forwarding.tpdos = {mpdo};
    return config;
  }
  void trigger() { line_->execute({.request = PdoTrigger{.number = 1}}, now_); }
  void send_emcy(std::uint16_t code) { line_->execute({.request = EmcySend{.code = code}}, now_); }
  void send_mpdo(std::uint8_t value) {
    line_->execute(
        {.request = MpdoWrite{.node = 5, .address = {0x6200, 1}, .data = {std::byte{value}}}},
        now_);
  }
  void lss(lss::Procedure procedure, std::vector<std::byte> arguments, Duration timeout = {}) {
    line_->execute(
        {.timeout = timeout,
         .request = LssRequest{.procedure = procedure, .arguments = std::move(arguments)}},
        now_);
  }
  static std::ptrdiff_t kinds(const std::vector<Event>& all, EventKind kind) {
    return std::ranges::count(all, kind, &Event::kind);
  }
  void set(std::uint16_t index, std::uint16_t value) {
    ASSERT_TRUE(line_->dictionary().set({index, 0}, value));
  }
};

TEST_F(AcknowledgedServices, ATriggeredPdoIsAnsweredWhenItIsOnTheBus) {
  run();
  write(1);
  hand_out();
  acknowledge_all();
  trigger();
  EXPECT_FALSE(is_answered());
  EXPECT_THAT(hand_out(), ElementsAre("205#0100000002"));
  EXPECT_FALSE(is_answered()) << "only the controller has the frame";
  acknowledge_all();
  const Reply reply = answer();
  EXPECT_TRUE(reply.ok());
  EXPECT_EQ(reply.data, ReplyData{TriggeredPdos{1}});
}

TEST_F(AcknowledgedServices, ATriggeredPdoOnABusWithoutAcknowledgeSaysSo) {
  run();
  write(1);
  hand_out();
  trigger();
  hand_out();
  live(milliseconds(900));
  EXPECT_FALSE(is_answered());
  live(milliseconds(200));
  EXPECT_EQ(answer().error, to_error(Refusal::no_acknowledge));
}

TEST_F(AcknowledgedServices, ATriggeredPdoWithoutSyncWaitsForItsTurn) {
  run(config_with_synchronous_axis());
  write(1);
  hand_out();
  trigger();
  live(milliseconds(1100));
  EXPECT_EQ(answer().error, to_error(Refusal::awaits_turn));
}

TEST_F(AcknowledgedServices, ATriggeredPdoOfAnOwnNodeThatBootsIsGone) {
  run();
  write(1);
  hand_out();
  acknowledge_all();
  trigger();
  line_->execute({.request = NmtRequest{.node = line_->config().node_id,
                                        .command = nmt::Command::reset_communication}},
                 now_);
  EXPECT_EQ(answer().error, to_error(Refusal::wrong_state));
}

TEST_F(AcknowledgedServices, AnEmcyIsAnsweredWhenItIsOnTheBus) {
  run();
  send_emcy(0x5000);
  EXPECT_FALSE(is_answered());
  EXPECT_THAT(hand_out(), ElementsAre("0FF#0050010000000000"));
  EXPECT_FALSE(is_answered());
  acknowledge_all();
  EXPECT_TRUE(answer().ok());
  send_emcy(0x5100);
  hand_out();
  live(milliseconds(1100));
  EXPECT_EQ(answer().error, to_error(Refusal::no_acknowledge));
}

TEST_F(AcknowledgedServices, AnEmcyIsReportedAsSentWhenItIsOnTheBus) {
  run();
  send_emcy(0x5000);
  EXPECT_FALSE(emitted(EventKind::emcy_sent, 127));
  hand_out();
  EXPECT_FALSE(emitted(EventKind::emcy_sent, 127)) << "only the controller has the frame";
  pass(milliseconds(5));
  acknowledge_all();
  const std::vector<Event> reported = events();
  ASSERT_EQ(reported.size(), 1U);
  EXPECT_EQ(std::get<event::EmcySent>(reported[0].data).code, 0x5000U);
  EXPECT_EQ(reported[0].time, now_);
  acknowledge_all();
  EXPECT_THAT(events(), IsEmpty()) << "reported once";
}

TEST_F(AcknowledgedServices, AnEmcyThatTheBusLostIsNotReportedAsSent) {
  run();
  send_emcy(0x5000);
  hand_out();
  line_->lost(given_, given_);
  send_emcy(0x5000);
  hand_out();
  acknowledge_all();
  EXPECT_EQ(kinds(events(), EventKind::emcy_sent), 1) << "the second EMCY";
}

TEST_F(AcknowledgedServices, EachOfEqualEmcysIsReported) {
  run();
  send_emcy(0x5000);
  send_emcy(0x5000);
  EXPECT_EQ(hand_out().size(), 2U);
  line_->acknowledged(given_ - 1, now_);
  EXPECT_TRUE(answer().ok());
  EXPECT_FALSE(is_answered());
  EXPECT_EQ(kinds(events(), EventKind::emcy_sent), 1);
  acknowledge_all();
  EXPECT_TRUE(answer().ok());
  EXPECT_EQ(kinds(events(), EventKind::emcy_sent), 1);
}

TEST_F(AcknowledgedServices, AnEmcyThatAResetDropsIsNotReportedAsSent) {
  run();
  set(0x1015, 20'000);  // 2 s
  send_emcy(0x5000);
  send_emcy(0x5100);
  line_->execute({.request = NmtRequest{.node = line_->config().node_id,
                                        .command = nmt::Command::reset_communication}},
                 now_);
  hand_out();
  live(milliseconds(3000));
  hand_out();
  acknowledge_all();
  for (const Event& event : events()) {
    const auto* const emcy = event.get<event::EmcySent>();
    EXPECT_FALSE(emcy != nullptr && emcy->code == 0x5100);
  }
}

TEST_F(AcknowledgedServices, AnEmcyThatWaitsForItsInhibitTimeSaysSo) {
  run();
  set(0x1015, 20'000);  // 2 s
  send_emcy(0x5000);
  hand_out();
  acknowledge_all();
  EXPECT_TRUE(answer().ok());
  send_emcy(0x5100);
  EXPECT_THAT(hand_out(), IsEmpty());
  live(milliseconds(1100));
  EXPECT_EQ(answer().error, to_error(Refusal::awaits_turn));
}

TEST_F(AcknowledgedServices, AValueByMpdoIsAnsweredWhenItIsOnTheBus) {
  run(with_mpdo());
  send_mpdo(7);
  EXPECT_FALSE(is_answered());
  EXPECT_THAT(hand_out(), ElementsAre("1F0#8500620107000000"));
  EXPECT_FALSE(is_answered());
  acknowledge_all();
  const Reply reply = answer();
  EXPECT_TRUE(reply.ok());
  EXPECT_EQ(reply.data, ReplyData{SentByMpdo{100}});
}

TEST_F(AcknowledgedServices, ANewerValueByMpdoToTheSameObjectAnswersBoth) {
  run(with_mpdo());
  send_mpdo(7);
  send_mpdo(8);
  EXPECT_THAT(hand_out(), ElementsAre("1F0#8500620108000000"));
  acknowledge_all();
  EXPECT_TRUE(is_answered());
  EXPECT_TRUE(is_answered());
}

TEST_F(AcknowledgedServices, AValueByMpdoThatABusOffLostIsNotDone) {
  run(with_mpdo());
  send_mpdo(7);
  hand_out();
  line_->lost(given_, given_);
  live(milliseconds(1100));
  EXPECT_EQ(answer().error, to_error(Refusal::no_acknowledge));
}

// A channel refuses a frame that it can never send, while earlier frames are under way.
TEST_F(AcknowledgedServices, AFrameThatIsRefusedLeavesThoseBeforeItUnderWay) {
  run();
  send_emcy(0x6001);
  send_emcy(0x6002);
  EXPECT_THAT(hand_out(), testing::SizeIs(2));
  line_->lost(given_, given_);
  EXPECT_FALSE(is_answered());
  line_->acknowledged(given_ - 1, now_);
  EXPECT_TRUE(answer().ok()) << "the first one was acknowledged";
  EXPECT_FALSE(is_answered());
}

TEST_F(AcknowledgedServices, AValueByMpdoIsGoneWhenTheOwnNodeLeavesOperational) {
  run(with_mpdo());
  send_mpdo(7);
  line_->execute(
      {.request = NmtRequest{.node = line_->config().node_id, .command = nmt::Command::stop}},
      now_);
  EXPECT_TRUE(answer().ok()) << "of the own node";
  line_->advance(now_);
  EXPECT_EQ(answer().error, to_error(Refusal::wrong_state));
}

TEST_F(AcknowledgedServices, AnLssServiceWithoutAResponseIsAnsweredWhenItIsOnTheBus) {
  run();
  lss(lss::Procedure::switch_global, {std::byte{1}});
  EXPECT_FALSE(is_answered());
  EXPECT_THAT(hand_out(), ElementsAre("7E5#0401000000000000"));
  EXPECT_FALSE(is_answered()) << "only the controller has the frame";
  acknowledge_all();
  const Reply reply = answer();
  EXPECT_TRUE(reply.ok());
  EXPECT_THAT(reply.bytes(), ElementsAre(std::byte{0}, std::byte{0}, std::byte{0}));
}

TEST_F(AcknowledgedServices, AnLssServiceOnABusWithoutAcknowledgeSaysSo) {
  run();
  lss(lss::Procedure::activate_bit_timing, {std::byte{0xE8}, std::byte{3}});
  hand_out();
  live(milliseconds(900));
  EXPECT_FALSE(is_answered());
  live(milliseconds(200));
  EXPECT_EQ(answer().error, to_error(Refusal::no_acknowledge));
  lss(lss::Procedure::switch_global, {std::byte{0}}, milliseconds(300));
  hand_out();
  live(milliseconds(350));
  EXPECT_EQ(answer().error, to_error(Refusal::no_acknowledge)) << "after its own time-out";
}

// The controller accepts no frame.
TEST_F(AcknowledgedServices, AnLssServiceWhoseFrameNobodyTakesSaysSo) {
  run();
  lss(lss::Procedure::inquire_node_id, {});
  lss(lss::Procedure::switch_global, {std::byte{0}});
  live(milliseconds(1100));
  EXPECT_EQ(answer().error, to_error(Refusal::no_acknowledge));
  EXPECT_FALSE(is_answered());
  live(milliseconds(1100));
  EXPECT_EQ(answer().error, to_error(Refusal::no_acknowledge));
  EXPECT_THAT(hand_out(), IsEmpty()) << "a refused frame is not sent later";
}

TEST_F(AcknowledgedServices, AnNmtCommandThatWaitsForTheInhibitTimeSaysSo) {
  run();
  set(0x102A, 30'000);  // 3 s
  start_node();
  EXPECT_THAT(hand_out(), ElementsAre("000#0105"));
  acknowledge_all();
  EXPECT_TRUE(answer().ok());
  start_node();
  EXPECT_THAT(hand_out(), IsEmpty());
  live(milliseconds(900));
  EXPECT_FALSE(is_answered());
  live(milliseconds(200));
  EXPECT_EQ(answer().error, to_error(Refusal::awaits_turn));
}

}  // namespace
}  // namespace linegate::line
