// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/program_run.h"

#include <array>
#include <optional>

#include <gtest/gtest.h>

#include "stack/manager/program_objects.h"

#include "tests/stack/manager/numbers.h"

namespace linegate::manager {
namespace {

using Loading = ProgramRun::Result;

ProgramOrder program_order() {
  return {.node = 5,
          .number = 2,
          .program = std::make_shared<const std::vector<std::byte>>(std::size_t{20})};
}

// The next access that the run requests: "?1F51", "1F51=3", "1F50<20".
std::string wanted(ProgramRun& run) {
  const auto step = run.wanted();
  if (!step) {
    return "end";
  }
  EXPECT_EQ(step->address.sub, 2);
  char out[48];
  if (step->source != nullptr) {
    std::snprintf(out, sizeof out, "%04X<%u", unsigned{step->address.index},
                  unsigned{*step->source->size()});
  } else if (step->write) {
    std::snprintf(out, sizeof out, "%04X=%u", unsigned{step->address.index},
                  std::to_integer<unsigned>(step->data.at(0)));
  } else {
    std::snprintf(out, sizeof out, "?%04X", unsigned{step->address.index});
  }
  return out;
}

void take(ProgramRun& run, std::uint32_t value) {
  run.take(AbortCode::none, number(value));
}
void take(ProgramRun& run, AbortCode abort) {
  run.take(abort, {});
}

void up_to_flash(ProgramRun& run) {
  EXPECT_EQ(wanted(run), "?1F51");
  take(run, 0);
  EXPECT_EQ(wanted(run), "1F51=3") << "the program is already stopped";
  take(run, AbortCode::none);
  EXPECT_EQ(wanted(run), "1F50<20");
  take(run, AbortCode::none);
  EXPECT_EQ(wanted(run), "?1F57");
}

TEST(ProgramRun, StopsClearsLoadsAndStarts) {
  ProgramRun run(program_order());
  EXPECT_EQ(wanted(run), "?1F51");
  take(run, 1);
  EXPECT_EQ(wanted(run), "1F51=0");
  take(run, AbortCode::none);
  EXPECT_EQ(wanted(run), "?1F51");
  take(run, 0);
  EXPECT_EQ(wanted(run), "1F51=3");
  take(run, AbortCode::none);
  EXPECT_EQ(wanted(run), "1F50<20");
  take(run, AbortCode::none);
  EXPECT_EQ(wanted(run), "?1F57");
  take(run, 1);
  EXPECT_EQ(wanted(run), "?1F57") << "the node was busy";
  take(run, 0);
  EXPECT_EQ(wanted(run), "1F51=1");
  take(run, AbortCode::none);
  EXPECT_EQ(wanted(run), "?1F51");
  take(run, 1);
  EXPECT_EQ(wanted(run), "end");
  EXPECT_EQ(run.result(), Loading::loaded);
  EXPECT_EQ(run.total(), 20U);
}

TEST(ProgramRun, ADeviceThatRestartsIsGivenTimeToAnswer) {
  ProgramRun run(program_order());
  (void)run.wanted();
  take(run, AbortCode::write_only);
  EXPECT_EQ(wanted(run), "1F51=0");
  take(run, AbortCode::timeout);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(wanted(run), "?1F51");
    take(run, AbortCode::timeout);
  }
  EXPECT_EQ(wanted(run), "?1F51");
  take(run, AbortCode::write_only);
  EXPECT_EQ(wanted(run), "1F51=3") << "1F51h is write-only";
}

TEST(ProgramRun, ADeviceThatStaysSilentOrDoesNotStopEndsIt) {
  for (const bool silent : {true, false}) {
    ProgramRun run(program_order());
    (void)run.wanted();
    take(run, 1);
    (void)run.wanted();
    take(run, AbortCode::none);
    int asked = 0;
    for (; wanted(run) != "end" && asked < 1'000; ++asked) {
      silent ? take(run, AbortCode::timeout) : take(run, 1);
    }
    EXPECT_EQ(asked, 50);
    EXPECT_EQ(run.result(), Loading::failed);
    EXPECT_EQ(run.finding().object, (od::Address{0x1F51, 2}));
    EXPECT_EQ(run.finding().abort, silent ? AbortCode::timeout : AbortCode::none);
    EXPECT_EQ(run.finding().found, silent ? 0U : 1U);
  }
}

TEST(ProgramRun, ADeviceThatIsNotThereIsAskedThreeTimesAndNothingElse) {
  ProgramRun run(program_order());
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(wanted(run), "?1F51") << i;
    take(run, AbortCode::timeout);
  }
  EXPECT_EQ(wanted(run), "end");
  EXPECT_EQ(run.result(), Loading::failed);
  EXPECT_EQ(run.finding().abort, AbortCode::timeout);
}

TEST(ProgramRun, OneLostAnswerIsAskedForAgain) {
  ProgramRun run(program_order());
  EXPECT_EQ(wanted(run), "?1F51");
  take(run, AbortCode::timeout);
  up_to_flash(run);
}

TEST(ProgramRun, CountsWhatTheDeviceAcknowledged) {
  ProgramRun run(program_order());
  (void)run.wanted();
  take(run, 0);
  (void)run.wanted();
  take(run, AbortCode::none);
  const auto step = run.wanted();
  std::array<std::byte, 20> all{};
  EXPECT_EQ(*step->source->read(all), 20U);
  EXPECT_EQ(run.done(), 0U) << "only read ahead";
  step->source->acknowledged(7);
  EXPECT_EQ(run.done(), 7U);
  EXPECT_TRUE(step->source->rewind());
  EXPECT_EQ(run.done(), 0U) << "the transfer begins again";
}

TEST(ProgramRun, ADeviceThatRestartsDuringTheDownloadIsTheReasonOfItsFailure) {
  for (const bool late : {true, false}) {
    ProgramRun run(program_order());
    (void)run.wanted();
    run.boot_up();
    take(run, 0);
    (void)run.wanted();
    run.boot_up();
    take(run, AbortCode::none);
    const auto step = run.wanted();
    if (late) {
      step->source->acknowledged(7);
    }
    run.boot_up();  // the restart to its boot loader, if it has not acknowledged anything
    take(run, AbortCode::timeout);
    EXPECT_EQ(wanted(run), "end");
    EXPECT_EQ(run.result(), Loading::failed);
    EXPECT_EQ(run.finding().kind, late ? BootFinding::Kind::last : BootFinding::Kind::abort);
    EXPECT_EQ(run.finding().object, (od::Address{0x1F50, 2}));
    if (late) {
      EXPECT_EQ(describe_boot('I', run.finding()),
                "software update failed: the device restarted while 1F50:02 was written");
    }
  }
}

TEST(ProgramRun, TheFlashStatusEndsItWithItsError) {
  ProgramRun run(program_order());
  up_to_flash(run);
  take(run, 0x0001'0006);
  EXPECT_EQ(wanted(run), "end");
  EXPECT_EQ(run.result(), Loading::failed);
  EXPECT_EQ(run.finding().kind, BootFinding::Kind::value);
  EXPECT_EQ(run.finding().object, (od::Address{0x1F57, 2}));
  EXPECT_EQ(run.finding().found, 0x0001'0006U);
  EXPECT_EQ(describe_flash_status(0x0001'0006), "format or CRC error in the program");
  EXPECT_EQ(describe_flash_status(2U * 7), "secured");
  EXPECT_EQ(describe_flash_status(2U * 63), "unspecified error");
  EXPECT_EQ(describe_flash_status(2U * 64), "error of the manufacturer's own");
}

TEST(ProgramRun, ADeviceWithoutFlashStatusIsStarted) {
  ProgramRun run(program_order());
  up_to_flash(run);
  take(run, AbortCode::no_object);
  EXPECT_EQ(wanted(run), "1F51=1");
  take(run, AbortCode::timeout);
  EXPECT_EQ(wanted(run), "?1F51");
  take(run, AbortCode::no_object);
  EXPECT_EQ(wanted(run), "end") << "the program has no program control";
  EXPECT_EQ(run.result(), Loading::loaded);
}

TEST(ProgramRun, ARefusalEndsItWithObjectAndCode) {
  ProgramRun run(program_order());
  (void)run.wanted();
  take(run, 0);
  (void)run.wanted();
  take(run, AbortCode::device_state);
  EXPECT_EQ(wanted(run), "end");
  EXPECT_EQ(run.result(), Loading::failed);
  EXPECT_EQ(run.finding().abort, AbortCode::device_state);
  EXPECT_EQ(run.finding().object, (od::Address{0x1F51, 2}));
}

TEST(ProgramRun, WhatANodeHasIsNotLoaded) {  // 1F81h
  auto order = program_order();
  order.check = true;
  order.expected = 0x10002;
  ProgramRun same(order);
  EXPECT_EQ(wanted(same), "?1F56");
  take(same, 0x10002);
  EXPECT_EQ(wanted(same), "end");
  EXPECT_EQ(same.result(), Loading::unchanged);
}

TEST(ProgramRun, AnotherSoftwareIsLoadedIfItMayBeAndComparedAgain) {  // 1F81h
  auto order = program_order();
  order.check = true;
  order.expected = 0x10002;
  for (const std::uint32_t after : {0x10002U, 0x10003U}) {
    ProgramRun run(order);
    (void)run.wanted();
    take(run, 0x10001);
    up_to_flash(run);
    take(run, 0);
    EXPECT_EQ(wanted(run), "?1F56");
    take(run, after);
    EXPECT_EQ(wanted(run), after == 0x10002 ? "1F51=1" : "end");
  }
  order.update = false;
  ProgramRun forbidden(order);
  (void)forbidden.wanted();
  take(forbidden, 0x10001);
  EXPECT_EQ(wanted(forbidden), "end");
  EXPECT_EQ(forbidden.result(), Loading::forbidden);
  EXPECT_EQ(forbidden.finding().expected, 0x10002U);
  EXPECT_EQ(forbidden.finding().found, 0x10001U);
  order.update = true;
  order.program = nullptr;
  ProgramRun none(order);
  (void)none.wanted();
  take(none, 0x10001);
  EXPECT_EQ(none.result(), Loading::forbidden) << "there is no program";
}

TEST(ProgramRun, WithoutAnExpectationOrAnAnswerNothingCanBeVerified) {
  auto order = program_order();
  order.check = true;
  ProgramRun nothing(order);
  EXPECT_EQ(wanted(nothing), "end");
  EXPECT_EQ(nothing.result(), Loading::unverifiable);
  EXPECT_EQ(nothing.finding().object, (od::Address{0x1F55, 5}));
  order.expected = 1;
  ProgramRun silent(order);
  (void)silent.wanted();
  take(silent, AbortCode::no_object);
  EXPECT_EQ(silent.result(), Loading::unverifiable);
}

TEST(ProgramObjects, ProgramsComeFromPlansAndAreReplacedOverSdo) {
  NodePlan plan{.id = 5};
  plan.software = 0x10002;
  plan.program = std::make_shared<const std::vector<std::byte>>(std::size_t{20});
  const std::vector<NodePlan> plans{plan};
  od::DeviceDescription device;
  device.objects = program_objects(plans);
  od::Dictionary dictionary(device);
  ProgramObjects objects(dictionary, plans);
  EXPECT_EQ(objects.expected(5), 0x10002U);
  EXPECT_EQ(objects.expected(6), 0U);
  const auto source = dictionary.open_source({0x1F58, 5});
  ASSERT_TRUE(source.ok());
  EXPECT_EQ((*source)->size(), 20U);
  EXPECT_FALSE(dictionary.open_source({0x1F58, 6}).ok());
  const auto sink = dictionary.open_sink({0x1F58, 6}, 3);
  ASSERT_TRUE(sink.ok());
  const std::vector<std::byte> bytes(3);
  EXPECT_EQ((*sink)->write(bytes), AbortCode::none);
  EXPECT_EQ(objects.program(6), nullptr) << "the download is not complete";
  EXPECT_EQ((*sink)->finish(), AbortCode::none);
  ASSERT_NE(objects.program(6), nullptr);
  EXPECT_EQ(objects.program(6)->size(), 3U);
  EXPECT_EQ(dictionary.write({0x1F58, 7}, bytes), AbortCode::none);
  EXPECT_EQ(objects.program(7)->size(), 3U);
  EXPECT_FALSE(dictionary.open_sink({0x1F58, 6}, 17U << 20U).ok()) << "too long";
}

// The default SDO server, and the server of a connection from another network.
TEST(ProgramObjects, TwoServersTransferTheSameProgramAtTheSameTime) {
  NodePlan plan{.id = 5};
  plan.program = std::make_shared<const std::vector<std::byte>>(std::size_t{20}, std::byte{7});
  const std::vector<NodePlan> plans{plan};
  od::DeviceDescription device;
  device.objects = program_objects(plans);
  od::Dictionary dictionary(device);
  ProgramObjects objects(dictionary, plans);

  const auto first_source = dictionary.open_source({0x1F58, 5});
  const auto second_source = dictionary.open_source({0x1F58, 5});
  ASSERT_TRUE(first_source.ok() && second_source.ok());
  std::array<std::byte, 20> out{};
  EXPECT_TRUE((*first_source)->read(out).ok());
  EXPECT_EQ(out[19], std::byte{7});
  (*first_source)->closed(AbortCode::none);
  EXPECT_TRUE(dictionary.open_source({0x1F58, 5}).ok());
  EXPECT_TRUE((*second_source)->read(out).ok());

  const auto first_sink = dictionary.open_sink({0x1F58, 5}, std::nullopt);
  ASSERT_TRUE(first_sink.ok());
  EXPECT_EQ((*first_sink)->write(std::vector<std::byte>(3)), AbortCode::none);
  const auto second_sink = dictionary.open_sink({0x1F58, 5}, std::nullopt);
  ASSERT_TRUE(second_sink.ok());
  EXPECT_EQ((*second_sink)->write(std::vector<std::byte>(4)), AbortCode::none);
  EXPECT_EQ((*first_sink)->finish(), AbortCode::none);
  EXPECT_EQ(objects.program(5)->size(), 3U);
  EXPECT_TRUE(dictionary.open_sink({0x1F58, 5}, std::nullopt).ok());
  EXPECT_EQ((*second_sink)->finish(), AbortCode::none);
  EXPECT_EQ(objects.program(5)->size(), 4U) << "the last completed download";
}

}  // namespace
}  // namespace linegate::manager
