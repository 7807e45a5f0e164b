// SPDX-License-Identifier: Apache-2.0
#include "stack/line/emcy_service.h"

#include <gtest/gtest.h>

#include "stack/od/objects.h"

#include "tests/stack/line/service_fixture.h"

namespace linegate::line {
namespace {

struct EmcyServiceTest : testing::Test {
  void execute(std::uint16_t code) {
    service.execute({.tag = ++tag,
                     .request = EmcySend{.code = code,
                                         .error_register = 0x81,
                                         .manufacturer = {std::byte{0x33}, std::byte{0x33}}}},
                    parts.now);
  }
  std::string next_frame() {
    can::Frame frame;
    return parts.node->next_frame(frame, parts.now) ? text(frame) : "";
  }
  void drain() {
    while (!next_frame().empty()) {
    }
  }

  NodeParts parts{config_with_axis()};
  RecordingHost host;
  EmcyService service{host, *parts.node};
  std::uint64_t tag = 0;
};

TEST_F(EmcyServiceTest, TheReplyWaitsForTheFrameOfTheEmcy) {
  drain();
  execute(0x6200);
  EXPECT_FALSE(host.answer(tag));
  ASSERT_EQ(host.sendings().size(), 1U);
  EXPECT_EQ(text(host.sendings()[0].frames.at(0).frame), "0FF#0062813333000000");
  EXPECT_EQ(next_frame(), "0FF#0062813333000000");
  host.acknowledge();
  EXPECT_EQ(host.answer(tag), Error{});
}

TEST_F(EmcyServiceTest, IsRefusedWhereItMakesNoSense) {
  parts.node->command(nmt::Command::stop, parts.now);
  execute(0x6200);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_state));
}

TEST_F(EmcyServiceTest, WithoutAnAcknowledgementItSaysWhatTheEmcyWaitsFor) {
  parts.node->dictionary().set({od::objects::kEmcyInhibitTime, 0}, std::uint16_t{10'000});  // 1 s
  parts.node->advance(parts.now);
  execute(0x6200);
  execute(0x6300);
  host.sendings()[0].frames[0].number = 1;
  host.expire(service, parts.now);
  EXPECT_EQ(host.answer(1), to_error(Refusal::no_acknowledge)) << "its frame was handed out";
  EXPECT_EQ(host.answer(2), to_error(Refusal::awaits_turn)) << "its inhibit time has not passed";
  host.set_stuck(true);
  execute(0x6400);
  host.expire(service, parts.now);
  EXPECT_EQ(host.answer(3), to_error(Refusal::no_acknowledge)) << "the bus accepts no frame";
}

TEST_F(EmcyServiceTest, AResetOfTheOwnNodeDropsWhatWaits) {
  execute(0x6200);
  service.before_boot(parts.now);
  EXPECT_EQ(host.answer(tag), to_error(Refusal::wrong_state));
}

}  // namespace
}  // namespace linegate::line
