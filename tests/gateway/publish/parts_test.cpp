// SPDX-License-Identifier: Apache-2.0
// The small parts of publishing: selection of samples, their rate, and their texts.
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "gateway/publish/access.h"
#include "gateway/publish/controller_text.h"
#include "gateway/publish/deferred_image.h"
#include "gateway/publish/event_logger.h"
#include "gateway/publish/event_text.h"
#include "gateway/publish/foreign_text.h"
#include "gateway/publish/image_sequence.h"
#include "gateway/publish/library_logger.h"
#include "gateway/publish/notice_limit.h"
#include "gateway/publish/pdo_updates.h"
#include "stack/can/bus_state.h"
#include "stack/lss/assigner.h"
#include "stack/routing/post.h"

#include "tests/gateway/log_keeper.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;

image::Snapshot snapshot_with(std::uint16_t local_pdo, std::uint32_t count) {
  image::Snapshot out;
  out.changed = {0};
  out.valid = {1};
  image::PdoMark mark;
  mark.local_pdo = local_pdo;
  mark.count = count;
  out.marks.push_back(mark);
  return out;
}

TEST(NoticeLimit, TellsEachReasonOnceASecond) {
  NoticeLimit limit;
  const Instant start(10s);
  const auto output = [](unsigned refusal) {
    return event::OutputRefused{.refusal = line::OutputRefusal(refusal), .group = 7};
  };
  const event::CommandRefused command{.refusal = line::Refusal(1), .command = line::CommandKind(7)};
  EXPECT_TRUE(limit.admit(output(1), start));
  EXPECT_FALSE(limit.admit(output(1), start + 999ms));
  EXPECT_TRUE(limit.admit(output(2), start + 999ms));
  EXPECT_TRUE(limit.admit(command, start + 999ms));
  EXPECT_TRUE(limit.admit(output(1), start + 1s));
  EXPECT_EQ(limit.pop_suppressed(), 0U) << "a reason that was reported already is not suppressed";
}

TEST(NoticeLimit, OneClientHasAPartOfThePlaces) {
  NoticeLimit limit;
  const Instant start(10s);
  const auto output = [](std::uint32_t client, std::uint16_t group) {
    return event::OutputRefused{
        .refusal = line::OutputRefusal::bad_length, .group = group, .client = client};
  };
  for (std::uint16_t group = 0; group < NoticeLimit::kOfOneClient; ++group)
    EXPECT_TRUE(limit.admit(output(1, group), start));
  EXPECT_FALSE(limit.admit(output(1, 100), start + 999ms));
  EXPECT_EQ(limit.pop_suppressed(start + 999ms), 1U);
  EXPECT_FALSE(limit.admit(event::CommandRefused{.client = 1}, start + 999ms));
  EXPECT_TRUE(limit.admit(output(2, 100), start + 999ms));
  EXPECT_TRUE(limit.admit(event::CommandRefused{.client = 3}, start + 999ms));
  EXPECT_TRUE(limit.admit(output(1, 100), start + 1s));
}

TEST(NoticeLimit, AReasonThatAlwaysChangesIsToldSoManyTimesASecond) {
  NoticeLimit limit;
  const Instant start(10s);
  std::size_t reported = 0;
  std::uint64_t held = 0;
  for (std::uint32_t i = 0; i < 65'536; ++i) {  // for two seconds, each time another group
    const Instant now = start + Duration(2s) * i / 65'536;
    const event::OutputRefused refused{.refusal = line::OutputRefusal::not_permitted,
                                       .group = static_cast<std::uint16_t>(i)};
    reported += limit.admit(refused, now) ? 1U : 0U;
    const std::uint64_t more = limit.pop_suppressed(now);
    EXPECT_TRUE(more == 0 || held == 0 || now >= start + 1s) << "reported at most once a second";
    held += more;
  }
  EXPECT_EQ(reported, 2 * NoticeLimit::kReasons);
  EXPECT_EQ(reported + held + limit.pop_suppressed(), 65'536U) << "nothing is lost silently";
  EXPECT_EQ(limit.pop_suppressed(start + 9s), 0U);
}

TEST(ControllerText, TellsWhereTheControllerIsSetOtherwiseThanTheLineNeeds) {
  config::LinePlan plan;
  plan.interface.uri = "socketcan:can0";
  plan.interface.name = "can0";
  can_bridge::ControllerSetup controller;
  EXPECT_TRUE(complaints(plan, controller).empty()) << "vcan reports no settings";

  controller.bit_rate = 250'000;
  controller.listen_only = false;
  EXPECT_TRUE(complaints(plan, controller).empty()) << "the configuration does not name a bit rate";
  plan.config.bit_rate = 250'000;
  EXPECT_TRUE(complaints(plan, controller).empty());
  plan.config.bit_rate = 500'000;
  ASSERT_EQ(complaints(plan, controller).size(), 1U);
  EXPECT_EQ(complaints(plan, controller)[0],
            "socketcan:can0 runs at 250000 bit/s, but the configuration of the line has 500000 "
            "bit/s");

  plan.config.bit_rate = 0;
  plan.config.role = line::Role::observer;
  ASSERT_EQ(complaints(plan, controller).size(), 1U);
  EXPECT_NE(complaints(plan, controller)[0].find("acknowledges"), std::string::npos);
  controller.listen_only = true;
  EXPECT_TRUE(complaints(plan, controller).empty());
  plan.config.role = line::Role::manager;
  ASSERT_EQ(complaints(plan, controller).size(), 1U);
  EXPECT_NE(complaints(plan, controller)[0].find("nothing that the line sends"), std::string::npos);
}

TEST(ControllerText, HasPropertiesOfWhatIsKnown) {
  std::vector<Property> out;
  add_properties({}, out);
  EXPECT_TRUE(out.empty());
  can_bridge::ControllerSetup controller;
  controller.listen_only = true;
  controller.restart_ms = 100;
  controller.hardware_stamps = true;
  add_properties(controller, out);
  ASSERT_EQ(out.size(), 3U);
  EXPECT_EQ(out[0].name + "=" + out[0].value, "listen-only=on");
  EXPECT_EQ(out[1].name + "=" + out[1].value, "restart-ms=100");
  EXPECT_EQ(out[2].name + "=" + out[2].value, "time-stamps=hardware");
}

TEST(PdoUpdates, PassOnceInMinPeriodWithTheReceptionsTheyStandFor) {
  PdoUpdates updates(100ms);
  std::vector<std::uint32_t> passed;
  const auto take = [&](Instant now) {
    return updates.publish_due(now, [&](const image::PdoMark&, std::uint32_t receptions) {
      passed.push_back(receptions);
    });
  };
  const Instant start{1s};
  updates.add(snapshot_with(3, 1));
  EXPECT_EQ(take(start), kNever);
  EXPECT_EQ(passed, std::vector<std::uint32_t>{1}) << "the first reception is published at once";
  updates.add(snapshot_with(3, 4));
  EXPECT_EQ(take(start + 10ms), start + 100ms);
  updates.add(snapshot_with(3, 2));
  EXPECT_EQ(take(start + 99ms), start + 100ms);
  EXPECT_EQ(passed.size(), 1U);
  EXPECT_EQ(take(start + 100ms), kNever);
  EXPECT_EQ(passed, (std::vector<std::uint32_t>{1, 6}));
  EXPECT_EQ(take(start + 300ms), kNever);
  EXPECT_EQ(passed.size(), 2U) << "nothing was received";
}

TEST(PdoUpdates, KeepPdosApart) {
  PdoUpdates updates(100ms);
  std::vector<std::uint16_t> passed;
  const auto take = [&](Instant now) {
    return updates.publish_due(
        now, [&](const image::PdoMark& mark, std::uint32_t) { passed.push_back(mark.local_pdo); });
  };
  const Instant start{1s};
  updates.add(snapshot_with(1, 1));
  take(start);
  updates.add(snapshot_with(1, 1));
  updates.add(snapshot_with(600, 1));
  EXPECT_EQ(take(start + 50ms), start + 100ms);
  EXPECT_EQ(passed, (std::vector<std::uint16_t>{1, 600}));
}

// Their values are valid or not, which PdoUpdate does not have.
TEST(PdoUpdates, LeaveOutSrdos) {
  PdoUpdates updates(100ms);
  image::Snapshot snapshot = snapshot_with(3, 1);
  snapshot.marks[0].remote_pdo = image::kFirstSrdo;
  updates.add(snapshot);
  bool passed = false;
  updates.publish_due(Instant{1s}, [&](const image::PdoMark&, std::uint32_t) { passed = true; });
  EXPECT_FALSE(passed);
}

TEST(ImageSequence, SkipsWhatDidNotChangeAndNumbersTheRestWithoutGaps) {
  ImageSequence sequence(config::Publish::Rule::on_change);
  image::Snapshot first = snapshot_with(1, 1);
  EXPECT_TRUE(sequence.admit(first)) << "the first image is always published";
  EXPECT_EQ(first.sequence, 1U);

  image::Snapshot same = snapshot_with(1, 2);
  EXPECT_FALSE(sequence.admit(same));
  image::Snapshot other = snapshot_with(2, 5);
  EXPECT_FALSE(sequence.admit(other));

  image::Snapshot changed = snapshot_with(1, 1);
  changed.changed = {4};
  EXPECT_TRUE(sequence.admit(changed));
  EXPECT_EQ(changed.sequence, 2U);
  ASSERT_EQ(changed.marks.size(), 2U) << "receptions of skipped images are included";
  EXPECT_EQ(changed.marks[0].local_pdo, 1);
  EXPECT_EQ(changed.marks[0].count, 3U);
  EXPECT_EQ(changed.marks[1].local_pdo, 2);
  EXPECT_EQ(changed.marks[1].count, 5U);
}

TEST(ImageSequence, TakesALostNodeForAChange) {
  ImageSequence sequence(config::Publish::Rule::on_change);
  image::Snapshot first = snapshot_with(1, 1);
  EXPECT_TRUE(sequence.admit(first));
  image::Snapshot invalid = snapshot_with(1, 0);
  invalid.valid = {0};
  EXPECT_TRUE(sequence.admit(invalid));
}

TEST(ImageSequence, PublishesEverythingByPeriod) {
  ImageSequence sequence(config::Publish::Rule::period);
  for (std::uint64_t i = 1; i < 4; ++i) {
    image::Snapshot snapshot = snapshot_with(1, 1);
    EXPECT_TRUE(sequence.admit(snapshot));
    EXPECT_EQ(snapshot.sequence, i);
  }
}

TEST(DeferredImage, IsPublishedWithTheChangesAndReceptionsOfThoseBefore) {
  DeferredImage deferred;
  EXPECT_EQ(deferred.take(nullptr), nullptr);
  std::array<image::Snapshot, 4> images{snapshot_with(1, 2), snapshot_with(2, 5),
                                        snapshot_with(1, 1), snapshot_with(1, 1)};
  for (std::size_t i = 0; i < images.size(); ++i) {
    images[i].layout_id = 7;
    images[i].changed = {std::uint64_t{1} << i};
  }
  const Instant start(10s);
  EXPECT_TRUE(deferred.is_due(start));
  deferred.defer(images[0], start);
  EXPECT_FALSE(deferred.is_due(start + 99ms));
  EXPECT_TRUE(deferred.is_due(start + 100ms));
  deferred.defer(images[1], start + 100ms);
  EXPECT_EQ(deferred.take(nullptr), images.data() + 1);
  EXPECT_EQ(images[1].changed[0], 0b11U);
  ASSERT_EQ(images[1].marks.size(), 2U);
  EXPECT_EQ(deferred.take(nullptr), nullptr) << "it is published once";
  deferred.defer(images[1], start + 200ms);
  EXPECT_EQ(deferred.take(images.data() + 2), images.data() + 2);
  EXPECT_EQ(images[2].changed[0], 0b111U);
  ASSERT_EQ(images[2].marks.size(), 2U);
  EXPECT_EQ(images[2].marks[0].count, 3U);
  EXPECT_EQ(images[2].marks[1].count, 5U);
  EXPECT_EQ(deferred.take(images.data() + 3), images.data() + 3);
  EXPECT_EQ(images[3].marks.size(), 1U) << "those were published";
}

TEST(DeferredImage, OfAnotherLayoutIsNoPartOfALaterOne) {
  DeferredImage deferred;
  image::Snapshot before = snapshot_with(1, 2);
  before.layout_id = 7;
  before.changed = {1};
  image::Snapshot after = snapshot_with(3, 4);
  after.layout_id = 8;
  deferred.defer(before, Instant(10s));
  EXPECT_EQ(deferred.take(&after), &after);
  EXPECT_EQ(after.changed[0], 0U);
  EXPECT_EQ(after.marks.size(), 1U);
}

TEST(ForeignText, CannotEndALineNorSteerATerminal) {
  EXPECT_EQ(printable("press 1~"), "press 1~");
  EXPECT_EQ(printable("a\nb\x1B[2J\x7F\xC2\x9B"), "a.b.[2J...");
}

TEST(LibraryLogger, TellsWarningsAndErrorsAndCutsAStormShort) {
  LogKeeper log;
  LibraryLogger logger;
  const Instant start{1s};
  logger.write(Severity::warning, "first\nsecond", start);
  EXPECT_EQ(log.lines(), std::vector<std::string>{"warning Fast DDS: first.second"});
  for (int i = 0; i < 1000; ++i) {
    logger.write(Severity::error, "storm " + std::to_string(i), start);
  }
  EXPECT_EQ(log.lines().size(), static_cast<std::size_t>(RateLimit::kBurst));
  logger.write(Severity::error, "last", start + 1s);
  EXPECT_EQ(log.lines().back(), "error Fast DDS: last (981 more messages left out)");
}

TEST(LibraryLogger, LeavesOutWhatTheLibraryWritesForEachSubmessage) {
  LogKeeper log;
  LibraryLogger logger;
  logger.write(Severity::warning, "No key material yet", Instant{1s});
  logger.write(Severity::warning, "other", Instant{2min});
  EXPECT_EQ(log.lines(), std::vector<std::string>{"warning Fast DDS: other"});
}

// The program of a revoked identity tries to authenticate about twice a second, as long as it runs.
TEST(LibraryLogger, JoinsEqualMessagesOfAMinute) {
  LogKeeper log;
  LibraryLogger logger;
  const Instant start{1s};
  const std::string text = "Error verifying certificate";
  for (Duration at = 0s; at <= 2min; at += 500ms) {
    logger.write(Severity::warning, text, start + at);
  }
  const std::string line = "warning Fast DDS: " + text;
  std::vector<std::string> expected{line, line + " (119 more suppressed)",
                                    line + " (120 more suppressed)"};
  EXPECT_EQ(log.lines(), expected);
  logger.write(Severity::error, text, start + 2min);
  expected.push_back("error Fast DDS: " + text);
  EXPECT_EQ(log.lines(), expected) << "an error is no warning";
  logger.write(Severity::warning, "other", start + 1h);
  expected.push_back(line + " (1 more suppressed)");
  expected.emplace_back("warning Fast DDS: other");
  EXPECT_EQ(log.lines(), expected) << "suppressed ones are reported with the next message";
  logger.write(Severity::warning, "other", start + 3h);
  expected.emplace_back("warning Fast DDS: other");
  EXPECT_EQ(log.lines(), expected);
}

TEST(RepeatedTexts, FurtherMessagesAreNotLimited) {
  RepeatedTexts texts;
  const Instant start{1s};
  for (std::size_t i = 0; i < RepeatedTexts::kPlaces; ++i) {
    EXPECT_TRUE(texts.admit(Severity::warning, std::to_string(i), start));
    EXPECT_FALSE(texts.admit(Severity::warning, std::to_string(i), start));
  }
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(texts.admit(Severity::warning, "further", start));
    EXPECT_TRUE(texts.admit(Severity::warning, std::string(RepeatedTexts::kLongest + 1, 'x'),
                            start + RepeatedTexts::kPeriod));
  }
  EXPECT_FALSE(texts.pop_due(start + RepeatedTexts::kPeriod - 1ns));
  for (std::size_t i = 0; i < RepeatedTexts::kPlaces; ++i) {
    const auto due = texts.pop_due(start + RepeatedTexts::kPeriod);
    ASSERT_TRUE(due);
    EXPECT_EQ(due->suppressed, 1U);
  }
  EXPECT_FALSE(texts.pop_due(start + RepeatedTexts::kPeriod));
}

TEST(EventLogger, JoinsTheHeartbeatsThatAreLostWithTheInterface) {
  EventLogger logger;
  Instant now{std::chrono::seconds(1)};
  const auto joins = [&](std::uint64_t number, std::uint8_t node, const EventData& data) {
    return logger.join({.number = number, .time = now, .node = node, .data = data}, now);
  };
  const event::HeartbeatLost lost;
  EXPECT_FALSE(joins(1, 4, lost)) << "its interface is usable";
  EXPECT_FALSE(joins(2, 0, event::InterfaceFailed{100}));
  EXPECT_FALSE(joins(3, 0, event::BusState{.state = can::BusState::stopped}));
  EXPECT_TRUE(joins(4, 5, lost));
  EXPECT_TRUE(joins(5, 6, lost));
  EXPECT_EQ(logger.pop_joined(now), "") << "more events may be joined";
  now += EventLogger::kJoined;
  EXPECT_EQ(logger.pop_joined(now),
            "bus stopped: the heartbeat of nodes 5, 6 is lost because of it (#4 to #5)");
  EXPECT_EQ(logger.pop_joined(now), "");
  EXPECT_TRUE(joins(6, 7, lost));
  EXPECT_FALSE(joins(7, 0, event::InterfaceReady{}));
  EXPECT_EQ(logger.pop_joined(now),
            "bus stopped: the heartbeat of node 7 is lost because of it (#6)");
  EXPECT_FALSE(joins(8, 5, lost));
}

TEST(EventLogger, LeavesOutWhatComesTooOftenAndCountsIt) {
  EventLogger logger;
  const Instant start{1s};
  std::uint64_t left_out = 0;
  int written = 0;
  for (int i = 0; i < 1000; ++i) {
    written += logger.admit(EventKind::bus_error, start, left_out) ? 1 : 0;
  }
  EXPECT_EQ(written, static_cast<int>(RateLimit::kBurst));
  EXPECT_TRUE(logger.admit(EventKind::emcy, start, left_out)) << "other kinds are not touched";
  EXPECT_EQ(left_out, 0U);
  EXPECT_TRUE(logger.admit(EventKind::bus_error, start + 1s, left_out));
  EXPECT_EQ(left_out, 980U);
}

line::LineConfig line_with_node() {
  line::LineConfig config;
  line::NodeConfig node;
  node.id = 5;
  node.name = "ram";
  config.nodes.push_back(node);
  return config;
}

std::string words(std::uint8_t node, const EventData& data) {
  return describe({.node = node, .data = data}, line_with_node(), "socketcan:can0");
}

TEST(EventText, NamesTheNodeAndSaysWhatHappened) {
  EXPECT_EQ(words(5, event::HeartbeatLost{.time = 500ms}),
            "node 5 (ram): heartbeat lost for 500 ms");
  EXPECT_EQ(words(5, event::HeartbeatLost{.by = event::ErrorControl::node_guarding, .time = 500ms}),
            "node 5 (ram): no answer to node guarding for 500 ms");
  EXPECT_EQ(words(6, event::NodeState{.state = nmt::State::operational,
                                      .before = nmt::State::pre_operational}),
            "node 6: operational (was pre-operational)");
  EXPECT_EQ(words(5, event::Emcy{.code = 0x8130,
                                 .error_register = 0x11,
                                 .manufacturer = {std::byte{1}, std::byte{2}, std::byte{3},
                                                  std::byte{4}, std::byte{5}}}),
            "node 5 (ram): EMCY 8130h, error register 11h, data 01 02 03 04 05");
  EXPECT_EQ(words(5, event::SdoAbort{.abort = AbortCode::no_object, .index = 0x6000, .sub = 1}),
            "node 5 (ram): SDO transfer of 6000:01 ended: object does not exist in the object "
            "dictionary (06020000)");
  EXPECT_EQ(words(5, event::BootResult{}), "node 5 (ram): booted");
  EXPECT_EQ(words(5, event::ConfigurationError{.abort = AbortCode::no_object, .index = 0x1017}),
            "node 5 (ram): object 1017:00 could not be configured: object does not exist in the "
            "object dictionary (06020000)");
  EXPECT_EQ(
      words(5, event::ConfigurationError{.abort = AbortCode::no_object, .index = 0x1800, .sub = 1}),
      "node 5 (ram): object 1800:01 could not be read or configured: object does not exist "
      "in the object dictionary (06020000)");
  EXPECT_EQ(words(0, event::OutputWatchdog{.group = 3, .reactions = 0x21}),
            "watchdog of output group 3 fired: outputs set to zero, EMCY sent or queued");
  EXPECT_EQ(words(0, event::FramesLost{12}), "12 frames lost before they could be read");
}

TEST(EventText, NamesTheNodeIdThatLssGaveAnOwnDevice) {
  const auto with = [](std::uint8_t node_id) {
    return words(5, event::OwnState{.state = nmt::State::pre_operational,
                                    .before = nmt::State::initialising,
                                    .node_id = node_id});
  };
  EXPECT_EQ(with(9), "node 5 (ram): own node pre-operational (was initialising), node-ID 9 by LSS");
  EXPECT_EQ(with(5), "node 5 (ram): own node pre-operational (was initialising)");
}

TEST(EventText, NamesTheNodeIdOnTheBusBesideTheConfiguredOne) {
  const auto with = [](std::uint8_t node, const EventData& data, std::uint8_t node_id) {
    return describe({.node = node, .data = data}, line_with_node(), "socketcan:can0", nullptr,
                    node_id);
  };
  EXPECT_EQ(with(5, event::TimeReceived{}, 9), "node 5 (ram) (node-ID 9): TIME received");
  EXPECT_EQ(with(6, event::TimeReceived{}, 9), "node 6 (node-ID 9): TIME received");
  EXPECT_EQ(with(5, event::TimeReceived{}, 5), "node 5 (ram): TIME received");
  EXPECT_EQ(with(5, event::TimeReceived{}, 0), "node 5 (ram): TIME received");
  EXPECT_EQ(with(5, event::BootUp{}, 9), "node 5 (ram): boot-up") << "of another node";
  EXPECT_EQ(with(5,
                 event::OwnState{.state = nmt::State::pre_operational,
                                 .before = nmt::State::initialising,
                                 .node_id = 9},
                 9),
            "node 5 (ram): own node pre-operational (was initialising), node-ID 9 by LSS");
}

TEST(EventText, SaysHowManyMalformedFramesWereHeldBack) {
  event::MalformedFrame frame{.identifier = 0x585, .length = 2, .data = {std::byte{0x43}}};
  EXPECT_EQ(words(5, frame), "node 5 (ram): frame 585h of 2 bytes not understood: 43 00");
  frame.length = 1;
  frame.suppressed = 265;
  EXPECT_EQ(words(5, frame),
            "node 5 (ram): frame 585h of 1 bytes not understood: 43 (265 more suppressed)");
}

TEST(EventText, SaysHowAnotherManagerShowedItself) {
  const auto commands = [](nmt::Command command, std::uint8_t addressee) {
    return words(0, event::ForeignManager{.evidence = event::ManagerEvidence::nmt_command,
                                          .command = command,
                                          .addressee = addressee});
  };
  EXPECT_EQ(commands(nmt::Command::reset_communication, 0),
            "another NMT master: reset-communication to all nodes");
  EXPECT_EQ(commands(nmt::Command::stop, 5), "another NMT master: stop to node 5");
  EXPECT_EQ(words(0, event::ForeignManager{.evidence = event::ManagerEvidence::flying_master,
                                           .identifier = 0x76}),
            "another NMT master: flying-master message 076h");
  EXPECT_EQ(
      words(0,
            event::ForeignManager{.evidence = event::ManagerEvidence::sleep, .identifier = 0x690}),
      "another NMT master: prepares the nodes for sleep (message 690h), which take no outputs "
      "until they wake");
}

TEST(EventText, NamesTheActiveFlyingMaster) {
  event::FlyingMaster changed{.state = nmt::FlyingMasterState::slave,
                              .before = nmt::FlyingMasterState::detect,
                              .priority = 2};
  EXPECT_EQ(words(6, changed),
            "node 6: flying master: slave, before detect, priority 2; the active NMT master is "
            "node 6");
  changed.state = nmt::FlyingMasterState::negotiate;
  EXPECT_EQ(words(0, changed), "flying master: negotiate, before detect, priority 2");
}

TEST(EventText, SaysHowAnotherWithTheOwnNodeIdShowedItself) {
  EXPECT_EQ(words(6, event::DuplicateNodeId{nmt::State::operational}),
            "node 6: another device has the same node-ID (operational)");
  EXPECT_EQ(words(6, event::DuplicateNodeId{nmt::State::unknown}),
            "node 6: another device has the same node-ID (it sent an EMCY)");
}

TEST(EventText, NamesTheTwoNetworksOfARefusedRequest) {
  EXPECT_EQ(words(0, event::RoutingRefused{.abort = AbortCode::invalid_value,
                                           .source = 1,
                                           .target = 3,
                                           .target_node = 12,
                                           .service = routing::RoutedService::sdo}),
            "SDO from network 1 to node 12 of network 3 refused: invalid value for parameter "
            "(06090030)");
}

TEST(EventText, SaysWhyEmcysOfAnotherGatewayWereNotSent) {
  const auto lost = [](AbortCode why) {
    return words(
        0, event::RoutingRefused{
               .abort = why, .source = 7, .target = 1, .service = routing::RoutedService::emcy});
  };
  EXPECT_EQ(lost(AbortCode::timeout), "EMCYs from network 7 were lost, or were too old to be sent");
  EXPECT_EQ(lost(AbortCode::out_of_memory),
            "EMCYs from network 7 were not sent: there are too many");
}

TEST(EventText, NamesTheSourceOfAForwardedEmcy) {
  EXPECT_EQ(words(5, event::EmcyRouted{.code = 0x8130,
                                       .source = 3,
                                       .source_node = 12,
                                       .error_register = 0x11,
                                       .hops = 2,
                                       .number = 9}),
            "node 5 (ram): EMCY 8130h of node 12 in network 3, error register 11h, 2 hops");
}

TEST(EventText, TellsOfAConnectionWhoseItIsAndHowItEnded) {
  EXPECT_EQ(words(0, event::RoutingOpened{.connection = 0x0001'0003,
                                          .source = 1,
                                          .target = 12,
                                          .target_node = 5,
                                          .interface = 2,
                                          .gateway = 9,
                                          .hops = 1}),
            "connection 00010003 from network 1 to node 5 of network 12 over interface 2:9 opened");
  EXPECT_EQ(
      words(0,
            event::RoutingOpened{
                .connection = 3, .suppressed = 40, .target = 2, .target_node = 5, .interface = 2}),
      "connection 00000003 from this gateway to node 5 of network 2 over interface 2 opened "
      "(40 more suppressed)");
  event::RoutingEnded ended{.connection = 0x0001'0003,
                            .bytes = 4,
                            .source = 1,
                            .target = 12,
                            .index = 0x1018,
                            .sub = 1,
                            .target_node = 5,
                            .interface = 2,
                            .gateway = 9,
                            .service = event::SdoService::upload};
  EXPECT_EQ(words(0, ended),
            "connection 00010003 from network 1 to node 5 of network 12 over interface 2:9 ended, "
            "upload of 1018:01, 4 bytes: done");
  ended = {.connection = 0x0001'0003,
           .abort = AbortCode::timeout,
           .source = 1,
           .target = 2,
           .target_node = 5,
           .interface = 2};
  EXPECT_EQ(words(0, ended),
            "connection 00010003 from network 1 to node 5 of network 2 over interface 2 ended, no "
            "transfer, 0 bytes: SDO protocol timed out (05040000)");
}

TEST(EventText, SaysHowManyWritesToAnObjectAreNotShown) {
  event::ObjectWritten object{.size = 2, .index = 0x2100, .sub = 1, .data = {std::byte{7}}};
  EXPECT_EQ(words(5, object), "node 5 (ram): object 2100:01 written: 2 bytes");
  object.suppressed = 40;
  EXPECT_EQ(words(5, object),
            "node 5 (ram): object 2100:01 written: 2 bytes, 40 writes before it not shown");
}

TEST(EventText, SaysWhatLssDidWithADevice) {
  event::LssResult result{.verdict = lss::Verdict::given,
                          .address = {{0x4C47, 0x4020, 0x10000, 0x1F5}}};
  EXPECT_EQ(words(5, result),
            "node 5 (ram): LSS: was given its node-ID (vendor 00004C47h, product 00004020h, "
            "revision 00010000h, serial 000001F5h)");
  result.verdict = lss::Verdict::node_id_refused;
  result.error = 255;
  result.specific = 7;
  EXPECT_EQ(words(5, result),
            "node 5 (ram): LSS: refuses its node-ID, error 255/7 (vendor 00004C47h, product "
            "00004020h, revision 00010000h, serial 000001F5h)");
  EXPECT_EQ(words(0, event::LssResult{.verdict = lss::Verdict::nobody_found}),
            "LSS: a device has no node-ID, and neither a known address nor fastscan finds it");
}

TEST(EventText, ShowsAFrameOfNoServiceAsCandumpDoes) {
  EXPECT_EQ(words(0, event::CanFrame{.identifier = 0x150,
                                     .length = 2,
                                     .data = {std::byte{0x11}, std::byte{0x22}}}),
            "frame 150#1122");
  EXPECT_EQ(words(0, event::CanFrame{.identifier = 0x150, .suppressed = 7, .extended = true}),
            "frame 00000150# (7 more suppressed)");
  EXPECT_EQ(words(0, event::CanFrame{.identifier = 0x150, .length = 3, .remote = true}),
            "frame 150#R3");
  EXPECT_EQ(
      words(0, event::CanFrame{.identifier = 0x150,
                               .length = 20,
                               .fd = true,
                               .piece = 1,
                               .data = {std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}}}),
      "frame 150##401020304 (bytes from 16 of 20)");
}

TEST(EventText, HasWordsForEveryKind) {
  for (std::size_t i = 0; i < kEventKinds; ++i) {
    const std::string text = words(5, empty_event_data(static_cast<EventKind>(i)));
    EXPECT_GT(text.size(), std::string("node 5 (ram): ").size()) << i;
    EXPECT_LE(text.size(), 256U);
  }
}

TEST(Access, ReadAllowsWhatChangesNothing) {
  using config::Access;
  using line::CommandKind;
  EXPECT_TRUE(permitted(request::Versions{}, Access::off));
  EXPECT_TRUE(permitted(request::JournalRead{}, Access::off));
  for (const request::GatewayRequest& request : {request::GatewayRequest(request::BusRestart{}),
                                                 request::GatewayRequest(request::BusFault{})}) {
    EXPECT_FALSE(permitted(request, Access::read));
    EXPECT_TRUE(permitted(request, Access::all));
  }
  EXPECT_FALSE(permitted(CommandKind::sdo_read, Access::off, Access::all));
  EXPECT_TRUE(permitted(CommandKind::sdo_read, Access::read, Access::off));
  EXPECT_TRUE(permitted(CommandKind::local_read, Access::read, Access::off));
  EXPECT_TRUE(permitted(CommandKind::network_read, Access::read, Access::off));
  EXPECT_TRUE(permitted(CommandKind::routing_trace, Access::read, Access::off));
  EXPECT_FALSE(permitted(CommandKind::routing_trace, Access::off, Access::off));
  EXPECT_TRUE(permitted(CommandKind::can_listen, Access::read, Access::off));
  EXPECT_FALSE(permitted(CommandKind::can_listen, Access::off, Access::all));
  EXPECT_TRUE(permitted(CommandKind::scan, Access::read, Access::off));
  line::Command verify{.request = line::Configure{}};
  EXPECT_TRUE(permitted(verify, Access::read, Access::off));
  EXPECT_FALSE(permitted(verify, Access::off, Access::off));
  line::Command apply{.request = line::Configure{.apply = true}};
  EXPECT_FALSE(permitted(apply, Access::read, Access::off));
  EXPECT_TRUE(permitted(apply, Access::all, Access::off));
  EXPECT_FALSE(permitted(CommandKind::program, Access::read, Access::off));
  EXPECT_FALSE(permitted(CommandKind::scan, Access::off, Access::all));
  EXPECT_TRUE(permitted(CommandKind::connection_list, Access::read, Access::off));
  EXPECT_FALSE(permitted(CommandKind::connection_list, Access::off, Access::all));
  for (const auto kind :
       {CommandKind::sdo_write, CommandKind::network_write, CommandKind::local_write,
        CommandKind::nmt, CommandKind::emcy_send, CommandKind::output_write, CommandKind::lss,
        CommandKind::can_send, CommandKind::object_write, CommandKind::pdo_trigger,
        CommandKind::object_create, CommandKind::pdo_request, CommandKind::mpdo_write,
        CommandKind::connection_open, CommandKind::connection_close, CommandKind::sleep}) {
    EXPECT_FALSE(permitted(kind, Access::read, Access::all)) << name(kind);
    EXPECT_TRUE(permitted(kind, Access::all, Access::all)) << name(kind);
  }
  for (const auto kind :
       {CommandKind::output_write, CommandKind::object_write, CommandKind::pdo_trigger}) {
    EXPECT_FALSE(permitted(kind, Access::all, Access::read)) << name(kind);
  }
}

template <std::size_t... kIndices>
std::vector<line::Command> one_of_each(std::index_sequence<kIndices...>) {
  std::vector<line::Command> out;
  (out.push_back({.request = std::variant_alternative_t<kIndices, line::AnyRequest>{}}), ...);
  return out;
}

// Each kind of command: a new one fails here until it has its place.
TEST(Access, RightsOfCertificates) {
  using line::CommandKind;
  const std::set<CommandKind> of_operators{CommandKind::sdo_read,     CommandKind::network_read,
                                           CommandKind::local_read,   CommandKind::routing_trace,
                                           CommandKind::can_listen,   CommandKind::scan,
                                           CommandKind::output_write, CommandKind::object_write,
                                           CommandKind::pdo_trigger,  CommandKind::pdo_request,
                                           CommandKind::mpdo_write,   CommandKind::nmt,
                                           CommandKind::boot,         CommandKind::emcy_send,
                                           CommandKind::configure,    CommandKind::connection_list,
                                           CommandKind::sleep};
  for (const line::Command& command :
       one_of_each(std::make_index_sequence<std::variant_size_v<line::AnyRequest>>())) {
    const CommandKind kind = line::kind(command);
    EXPECT_TRUE(permitted(command, ClientRight::unlimited)) << name(kind);
    EXPECT_TRUE(permitted(command, ClientRight::engineer)) << name(kind);
    EXPECT_FALSE(permitted(command, ClientRight::none)) << name(kind);
    EXPECT_EQ(permitted(command, ClientRight::operate), of_operators.contains(kind)) << name(kind);
  }
  const line::Command apply{.request = line::Configure{.apply = true}};
  EXPECT_FALSE(permitted(apply, ClientRight::operate)) << "it writes configuration";
}

TEST(Access, RightsOfCertificatesForRequestsToTheGateway) {
  for (const request::GatewayRequest& request : {request::GatewayRequest(request::Versions{}),
                                                 request::GatewayRequest(request::BusRestart{}),
                                                 request::GatewayRequest(request::BusFault{}),
                                                 request::GatewayRequest(request::JournalRead{})}) {
    const std::string_view name = request::command_name(request::kind(request));
    EXPECT_TRUE(permitted(request, ClientRight::unlimited)) << name;
    EXPECT_TRUE(permitted(request, ClientRight::engineer)) << name;
    EXPECT_FALSE(permitted(request, ClientRight::none)) << name;
    EXPECT_EQ(permitted(request, ClientRight::operate), name != "bus-fault") << name;
  }
}

}  // namespace
}  // namespace linegate::gateway
