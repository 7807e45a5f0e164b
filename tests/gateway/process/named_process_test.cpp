// SPDX-License-Identifier: Apache-2.0
// Named topics while the process that has their endpoints dies, stops and is started again.
#include <algorithm>
#include <array>
#include <csignal>
#include <cstdint>

#include <gtest/gtest.h>

#include "tests/gateway/process/dds_process_fixture.h"
#include "tests/gateway/process/named_fixture.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kLastDuration = 86'400'002'000'000;  // of the last PDO

class NamedProcessTest : public NamedSetTest {
 protected:
  bool replaced(pid_t gone) {
    return until([&] { return dds_process() != 0 && dds_process() != gone; });
  }
};

// Nothing changes meanwhile: the sample is written because a reader has come to the new process.
TEST_F(NamedProcessTest, AReaderOfAnyDurabilityHasThePresentStateAgain) {
  write("device", "");
  for (const auto durability :
       {fast::VOLATILE_DURABILITY_QOS, fast::TRANSIENT_LOCAL_DURABILITY_QOS}) {
    NamedReader<InputsType> reader("plant/press/every/inputs", durability);
    const auto is_new = [&](std::uint64_t before) {
      reader.take();
      return reader.sample.values().Duration() == kLastDuration &&
             reader.sample.sequence_number() > before;
    };
    ASSERT_TRUE(until([&] { return is_new(0); }));
    for (int deaths = 0; deaths < 3; ++deaths) {
      const std::uint64_t before = reader.sample.sequence_number();
      const pid_t first = dds_process();
      kill(first, SIGKILL);
      ASSERT_TRUE(replaced(first));
      ASSERT_TRUE(until([&] { return is_new(before); })) << deaths;
      NamedReader<InputsType> late("plant/press/every/inputs");
      ASSERT_TRUE(until([&] {
        late.take();
        return late.sample.values().Duration() == kLastDuration;
      })) << deaths;
      EXPECT_GE(late.first, reader.sample.sequence_number());
    }
    EXPECT_EQ(reader.back, 0);
    EXPECT_EQ(reader.sample.incarnation(), kIncarnation);
    EXPECT_TRUE(reader.sample.valid().Duration());
  }
}

// The outputs change while no process passes them on.
TEST_F(NamedProcessTest, TheWatchdogFiresWithoutAProcessAndReadersSeeItAfterwards) {
  NamedReader<OutputsType> outputs("plant/press/every/outputs");
  SetWriter writer("plc", 5);
  writer.sample.values().every_Set_24V_supply(240);
  writer.sample.given().every_Set_24V_supply(true);
  writer.sample.watchdog_ns(300'000'000);
  writer.sample.reactions(line::kZeroOutputs);
  const auto seen = [&](int value) {
    outputs.take();
    return outputs.sample.values().Set_24V_supply() == value;
  };
  ASSERT_TRUE(write_until(writer, [&] { return is_applied("plc") && seen(240); }));
  const std::uint64_t before = outputs.sample.sequence_number();
  const pid_t first = dds_process();
  kill(first, SIGSTOP);  // for longer than the watchdog: it is found after 1.5 s
  ASSERT_TRUE(write_until(writer, [&] { return dds_process() != first; }));
  ASSERT_TRUE(write_until(writer, [&] { return state().arming_wanted && seen(0); }));
  EXPECT_GT(outputs.sample.sequence_number(), before);
  ASSERT_TRUE(write_until(writer, [&] {
    return state().refusal == line::OutputRefusal::not_armed;
  })) << "an old set-point has no effect";
  writer.sample.arming(2);
  EXPECT_TRUE(write_until(writer, [&] { return state().arming == 2 && seen(240); }));
  EXPECT_FALSE(state().arming_wanted);
  EXPECT_EQ(outputs.back, 0);
}

TEST_F(NamedProcessTest, AWriterContinuesAfterTheDeathOfTheProcess) {
  SetWriter writer("plc", 5);
  writer.sample.watchdog_ns(20'000'000'000);
  writer.sample.reactions(line::kZeroOutputs);
  ASSERT_TRUE(write_until(writer, [&] { return is_applied("plc"); }));
  for (int deaths = 0; deaths < 3; ++deaths) {
    const std::uint64_t before = state().applied;
    const pid_t first = dds_process();
    kill(first, SIGKILL);
    ASSERT_TRUE(replaced(first));
    ASSERT_TRUE(write_until(writer, [&] { return state().applied > before; })) << deaths;
    EXPECT_EQ(state().owner, "plc");
  }
}

// The topics that the new process has are those of the configuration, not those before.
TEST_F(NamedProcessTest, AReloadDuringADeathChangesTheTopics) {
  NamedReader<InputsType> inputs("plant/press/every/inputs");
  SetWriter writer("plc", 5);
  ASSERT_TRUE(until([&] { return inputs.writers() == 1 && writer.readers() == 1; }));
  const pid_t first = dds_process();
  kill(first, SIGKILL);
  ASSERT_TRUE(gateway_->reload(named_plant(false)).done);
  ASSERT_TRUE(replaced(first));
  ASSERT_TRUE(until([&] { return inputs.writers() == 0 && writer.readers() == 0; }));
  const pid_t second = dds_process();
  ASSERT_TRUE(gateway_->reload(named_plant(true, outputs_)).done);
  kill(second, SIGKILL);
  ASSERT_TRUE(replaced(second));
  const std::int64_t before = inputs.sample.time();
  EXPECT_TRUE(write_until(writer, [&] {
    inputs.take();
    return is_applied("plc") && inputs.sample.time() > before;
  }));
}

}  // namespace
}  // namespace linegate::gateway
