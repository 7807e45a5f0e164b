// SPDX-License-Identifier: Apache-2.0
// Named topics of a gateway (named_fixture.h).
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "tests/gateway/process/named_fixture.h"

namespace linegate::gateway {
namespace {

TEST_F(NamedGatewayTest, AnInputOfEveryTypeArrivesByName) {
  NamedReader<InputsType> reader("plant/press/every/inputs");
  write("device", "");
  ASSERT_TRUE(until([&] {
    reader.take();
    return reader.sample.values().Duration() == 86'400'002'000'000;  // of the last PDO
  }));
  const InputsType::type& sample = reader.sample;
  EXPECT_EQ(sample.gateway(), "test");
  EXPECT_EQ(sample.line(), "press");
  EXPECT_EQ(sample.incarnation(), kIncarnation);
  EXPECT_EQ(reader.back, 0);
  EXPECT_GT(sample.received().pdo1(), 1'700'000'000'000'000'000);
  EXPECT_GE(sample.time(), sample.received().pdo18());
  EXPECT_EQ(sample.received().pdo19(), 0);
  const auto& values = sample.values();
  EXPECT_TRUE(values.Flag());
  EXPECT_FALSE(values.Second_flag());
  EXPECT_EQ(values.n24V_supply(), 240);
  EXPECT_EQ(values.Signed_16(), -300);
  EXPECT_EQ(values.Unsigned_16(), 65'000);
  EXPECT_EQ(values.Signed_24(), -70'000);
  EXPECT_EQ(values.Unsigned_24(), 16'000'000U);
  EXPECT_EQ(values.Signed_32(), -2'000'000'000);
  EXPECT_EQ(values.Unsigned_32(), 4'000'000'000U);
  EXPECT_EQ(values.Signed_40(), -500'000'000'000);
  EXPECT_EQ(values.Unsigned_40(), 1'000'000'000'000U);
  EXPECT_EQ(values.Signed_48(), -100'000'000'000'000);
  EXPECT_EQ(values.Unsigned_48(), 200'000'000'000'000U);
  EXPECT_EQ(values.Signed_56(), -30'000'000'000'000'000);
  EXPECT_EQ(values.Unsigned_56(), 70'000'000'000'000'000U);
  EXPECT_EQ(values.Signed_64(), -9'000'000'000'000'000'000);
  EXPECT_EQ(values.Unsigned_64(), 18'000'000'000'000'000'000U);
  EXPECT_EQ(values.Real_64(), -0.1);
  EXPECT_EQ(values.Real_32_m_s(), 1.5F);
  EXPECT_EQ(values.Visible(), "Press 01");
  EXPECT_EQ(values.Octets(), (std::array<std::uint8_t, 8>{0, 1, 2, 3, 0xFC, 0xFD, 0xFE, 0xFF}));
  EXPECT_EQ(values.Unicode(),
            "\xE2\x82\xAC"
            "5 m");
  EXPECT_EQ(values.Time_of_day(), 1'796'000'400'001'000'000);
  EXPECT_EQ(values.Duration(), 86'400'002'000'000);
  // A device of ours does not send it.
  EXPECT_FALSE(sample.valid().Domain());
  EXPECT_TRUE(sample.valid().Duration());
  EXPECT_EQ(values.Domain(), (std::array<std::uint8_t, 8>{}));
}

// Nothing changes when the later readers come: they receive what is written because they came. A
// transient-local one would receive a sample of the time before first.
TEST_F(NamedGatewayTest, AReaderThatComesGetsThePresentStateAndNoOldOne) {
  write("device", "");
  const auto alone = [&] { return seen_.participants == 1; };
  ASSERT_TRUE(until(alone));
  std::uint64_t last = 0;
  {
    NamedReader<InputsType> reader("plant/press/every/inputs", fast::VOLATILE_DURABILITY_QOS);
    ASSERT_TRUE(until([&] {
      reader.take();
      return reader.sample.values().Duration() == 86'400'002'000'000;  // of the last PDO
    }));
    last = reader.sample.sequence_number();
  }
  for (const auto durability :
       {fast::VOLATILE_DURABILITY_QOS, fast::TRANSIENT_LOCAL_DURABILITY_QOS}) {
    ASSERT_TRUE(until(alone));  // the gateway has noticed that the reader before has left
    NamedReader<InputsType> reader("plant/press/every/inputs", durability);
    ASSERT_TRUE(until([&] {
      reader.take();
      return reader.first != 0;
    }));
    EXPECT_GT(reader.first, last);
    EXPECT_EQ(reader.sample.values().Duration(), 86'400'002'000'000);
    last = reader.sample.sequence_number();
  }
}

TEST_F(NamedGatewayTest, OutputsHaveTheirMarksAndAnInstanceEndsWithItsLine) {
  NamedReader<OutputsType> reader("plant/press/every/outputs");
  NamedReader<InputsType> stranger("plant/press/every/outputs");  // another type on that topic
  ASSERT_TRUE(until([&] {
    reader.take();
    return reader.sample.waits().Set_Signed_16() == 1;  // OUTPUT_WAIT_VALUE
  }));
  EXPECT_FALSE(reader.sample.valid().Set_Signed_16());
  write("press", "Set ");
  ASSERT_TRUE(until([&] {
    reader.take();
    return reader.sample.valid().Set_Signed_16() && reader.sample.valid().Set_Domain();
  }));
  EXPECT_EQ(reader.sample.waits().Set_Signed_16(), 0);
  EXPECT_TRUE(reader.sample.known().Set_Signed_16());
  EXPECT_EQ(reader.sample.values().Set_Signed_16(), -300);
  EXPECT_EQ(reader.sample.values().Set_Unicode(),
            "\xE2\x82\xAC"
            "5 m");
  EXPECT_EQ(reader.sample.values().Set_Domain()[7], 8);
  EXPECT_GT(reader.sample.sent().pdo1(), 0);
  EXPECT_EQ(stranger.writers(), 0);
  EXPECT_EQ(reader.writers(), 1);

  const auto result = gateway_->reload(named_plant(false));
  ASSERT_TRUE(result.done);
  EXPECT_TRUE(until([&] {
    reader.take();
    return reader.disposed && reader.writers() == 0;
  }));
}

// The device receives what was written; a member that is not given is not written.
TEST_F(NamedSetTest, WhatIsGivenReachesTheDevice) {
  NamedReader<OutputsType> outputs("plant/press/every/outputs");
  SetWriter writer("plc", 5);
  auto& values = writer.sample.values();
  auto& given = writer.sample.given();
  values.every_Set_Flag(true);
  given.every_Set_Flag(true);
  values.every_Set_Second_flag(false);
  given.every_Set_Second_flag(true);
  values.every_Set_class(-5);
  given.every_Set_class(true);
  values.every_Set_24V_supply(240);
  given.every_Set_24V_supply(true);
  values.every_Set_Signed_16(-300);
  given.every_Set_Signed_16(true);
  values.every_Set_Unsigned_16(65'000);
  given.every_Set_Unsigned_16(true);
  values.every_Set_Signed_56(-30'000'000'000'000'000);
  given.every_Set_Signed_56(true);
  values.every_Set_Visible("Press 01");
  given.every_Set_Visible(true);
  values.every_Set_Unicode("\xE2\x82\xAC 5");
  given.every_Set_Unicode(true);
  values.every_Set_Octets(std::array<std::uint8_t, 8>{1, 2, 3, 4, 5, 6, 7, 8});
  given.every_Set_Octets(true);
  values.every_Set_Time_of_day(1'796'000'400'001'000'000);
  given.every_Set_Time_of_day(true);
  values.every_Set_Unsigned_64(99);  // not given
  ASSERT_TRUE(write_until(writer, [&] {
    outputs.take();
    return outputs.sample.valid().Set_Time_of_day() && outputs.sample.valid().Set_Signed_16();
  }));
  const auto& sent = outputs.sample.values();
  EXPECT_TRUE(sent.Set_Flag());
  EXPECT_EQ(sent.Set_class(), -5);
  EXPECT_EQ(sent.Set_24V_supply(), 240);
  EXPECT_EQ(sent.Set_Signed_16(), -300);
  EXPECT_EQ(sent.Set_Signed_56(), -30'000'000'000'000'000);
  EXPECT_EQ(sent.Set_Visible(), "Press 01");
  EXPECT_EQ(sent.Set_Unicode(), "\xE2\x82\xAC 5");
  EXPECT_EQ(sent.Set_Octets(), (std::array<std::uint8_t, 8>{1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(sent.Set_Time_of_day(), 1'796'000'400'001'000'000);
  EXPECT_FALSE(outputs.sample.known().Set_Unsigned_64());
  EXPECT_EQ(state().owner, "plc");
  EXPECT_EQ(state().group, 1);

  // Only one member is given, and of the others other values are in the sample.
  given = plant::press_all_set_6496a29b850773f3_given();
  given.every_Set_Signed_16(true);
  values.every_Set_Signed_16(7);
  values.every_Set_Unsigned_16(8);
  const auto arrived = [&] {
    outputs.take();
    const image::Layout& layout = seen_.layouts["device/inputs"];
    const auto entry =
        std::ranges::find(layout.entries, "every.Set Signed 16", &image::Entry::name);
    const image::Snapshot& image = seen_.images["device/inputs"];
    return entry != layout.entries.end() && image.bytes.size() > entry->bit_offset / 8 &&
           image.bytes[entry->bit_offset / 8] == std::byte{7} &&
           outputs.sample.values().Set_Signed_16() == 7;
  };
  ASSERT_TRUE(write_until(writer, arrived)) << "in the device";
  EXPECT_EQ(outputs.sample.values().Set_Unsigned_16(), 65'000);
}

TEST_F(NamedSetTest, TheWatchdogFiresAndANewArmingNumberEndsItsReaction) {
  SetWriter writer("plc", 5);
  writer.sample.values().every_Set_24V_supply(240);
  writer.sample.given().every_Set_24V_supply(true);
  writer.sample.watchdog_ns(100'000'000);
  writer.sample.reactions(line::kZeroOutputs);
  ASSERT_TRUE(write_until(writer, [&] { return is_applied("plc"); }));
  ASSERT_TRUE(until([&] { return state().arming_wanted; })) << "the writer is silent";
  ASSERT_TRUE(
      write_until(writer, [&] { return state().refusal == line::OutputRefusal::not_armed; }));
  EXPECT_TRUE(state().arming_wanted);
  writer.sample.arming(2);
  writer.sample.watchdog_ns(0);
  EXPECT_TRUE(write_until(writer, [&] { return state().arming == 2 && !state().arming_wanted; }));
}

TEST_F(NamedSetTest, OutputWriteIsRefusedWithAReason) {
  line::OutputWrite write;
  write.group = 1;
  write.layout_id = seen_.layouts["press/outputs"].id;
  write.values.push_back({.entry = 0, .length = 1, .data = {std::byte{1}}});
  ASSERT_TRUE(until([&] {
    client_->write_outputs({"test", "press", 0}, write);
    return state().refusal == line::OutputRefusal::written_by_name;
  }));
  EXPECT_EQ(state().applied, 0U);
}

TEST_F(NamedSetTest, WhatDoesNotFitOrIsOfAnotherGroupIsRefused) {
  SetWriter writer("plc", 5);
  writer.sample.values().every_Set_Signed_24(0x800000);
  writer.sample.given().every_Set_Signed_24(true);
  ASSERT_TRUE(
      write_until(writer, [&] { return state().refusal == line::OutputRefusal::bad_value; }));
  EXPECT_EQ(state().applied, 0U);
  writer.sample.values().every_Set_Signed_24(0x7FFFFF);
  writer.sample.reactions(line::kNmtStop | line::kNmtResetNode);
  ASSERT_TRUE(
      write_until(writer, [&] { return state().refusal == line::OutputRefusal::bad_reaction; }));
  writer.sample.reactions(line::kHoldOutputs);
  writer.sample.incarnation(kIncarnation + 1);
  ASSERT_TRUE(
      write_until(writer, [&] { return state().refusal == line::OutputRefusal::stale_layout; }));
  EXPECT_EQ(state().applied, 0U);
  writer.sample.incarnation(kIncarnation);
  EXPECT_TRUE(write_until(writer, [&] { return is_applied("plc"); }));
  writer.sample.group(2);
  const auto is_unknown = [](const std::string& text) {
    return text.find("outputs of group 2") != std::string::npos;
  };
  EXPECT_TRUE(write_until(writer, [&] { return std::ranges::any_of(seen_.texts, is_unknown); }));
}

TEST_F(NamedSetTest, TheStrongerWriterOwnsTheGroupUntilItIsGone) {
  auto strong = std::make_unique<SetWriter>("strong", 10);
  SetWriter weak("weak", 1);
  ASSERT_TRUE(until([&] { return strong->readers() == 1 && weak.readers() == 1; }));
  ASSERT_TRUE(write_until(*strong, [&] { return is_applied("strong"); }));
  const std::uint64_t before = state().applied;
  bool weak_was_applied = false;
  ASSERT_TRUE(until([&] {
    strong->write();
    weak.write();
    weak_was_applied = weak_was_applied || state().owner == "weak";
    return state().applied > before + 10;
  }));
  EXPECT_FALSE(weak_was_applied);
  strong.reset();
  EXPECT_TRUE(write_until(weak, [&] { return is_applied("weak"); }));
}

// Two gateways may have lines of the same name and type, so their writers are matched with both.
TEST_F(NamedSetTest, ASampleForAnotherGatewayIsIgnored) {
  SetWriter writer("plc", 5);
  std::uint64_t own = 0;
  ASSERT_TRUE(until([&] {
    writer.sample.gateway("other");
    writer.write();
    writer.sample.gateway("test");
    own += writer.write() ? 1U : 0U;
    return state().applied > 5;
  }));
  EXPECT_LE(state().applied, own);
  EXPECT_EQ(state().refused, 0U);
}

// The reader of the gateway has 1024 instances.
TEST_F(NamedSetTest, AWriterWithTooManyKeysDoesNotSilenceOthers) {
  SetWriter hostile("hostile", 9);
  ASSERT_TRUE(until([&] { return hostile.readers() == 1; }));
  for (int i = 0; i < SetWriter::kMostInstances; ++i) {
    hostile.sample.line("line" + std::to_string(i));
    ASSERT_TRUE(hostile.write());
  }
  SetWriter writer("plc", 10);
  EXPECT_TRUE(write_until(writer, [&] {
    hostile.write();  // it stays alive
    return is_applied("plc");
  }));
}

class NamedSetPartitionTest : public NamedSetTest {
 protected:
  NamedSetPartitionTest() : NamedSetTest(", partitions: true") {}
};

TEST_F(NamedSetPartitionTest, ASampleInThePartitionOfTheLineIsReceived) {
  SetWriter writer("plc", 5, "test/press");
  EXPECT_TRUE(write_until(writer, [&] { return is_applied("plc"); }));
  SetWriter other("other", 9);  // in the default partition
  EXPECT_TRUE(write_until(other, [&] { return is_applied("other"); }));
}

// After a reload in which the group is not written by name any more its topic is gone, and
// OutputWrite has an effect.
TEST_F(NamedSetTest, AReloadChangesWhoWritesTheGroup) {
  SetWriter writer("plc", 5);
  ASSERT_TRUE(write_until(writer, [&] { return is_applied("plc"); }));
  ASSERT_TRUE(
      gateway_->reload(named_plant(true, "{groups: [{name: all, entries: [every.*]}]}")).done);
  EXPECT_TRUE(until([&] { return writer.readers() == 0; }));
  ASSERT_TRUE(until([&] {
    line::OutputWrite write;
    write.group = 1;
    write.layout_id = seen_.layouts["press/outputs"].id;
    client_->write_outputs({"test", "press", 0}, write);
    return is_applied(client_->name());
  }));
  ASSERT_TRUE(gateway_->reload(named_plant(true, outputs_)).done);
  EXPECT_TRUE(write_until(writer, [&] { return is_applied("plc"); }));
}

}  // namespace
}  // namespace linegate::gateway
