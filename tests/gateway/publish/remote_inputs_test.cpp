// SPDX-License-Identifier: Apache-2.0
// Values of other gateways: which samples become a value of an output, and which never do.
#include "gateway/publish/remote_inputs.h"

#include <algorithm>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/base/byte_order.h"

namespace linegate::gateway {
namespace {

using line::OutputRefusal;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr Duration kTimeout = seconds(3);
const config::RemoteLine kPress{"hall-b", "press"};

image::Entry remote_entry(const std::string& name, std::uint32_t bit, std::uint16_t bits,
                          od::DataType type = od::DataType::unsigned16) {
  image::Entry out;
  out.name = name;
  out.bit_offset = bit;
  out.bit_length = bits;
  out.type = type;
  return out;
}

// inlet.Pressure is at `bit`.
image::Layout remote_layout(std::uint64_t id, std::uint32_t bit) {
  image::Layout out;
  out.id = id;
  out.byte_size = 16;
  out.entries = {remote_entry("inlet.Level", 64, 16), remote_entry("inlet.Pressure", bit, 16)};
  return out;
}

// All entries are valid.
image::Snapshot remote_image(std::uint64_t layout, std::uint32_t bit, std::uint16_t value) {
  image::Snapshot out;
  out.layout_id = layout;
  out.bytes.resize(16);
  store_le(std::span(out.bytes).subspan(bit / 8, 2), value);
  out.valid = {0b11};
  return out;
}

class RemoteInputsTest : public testing::Test, public RemoteInputs::Sink {
 protected:
  RemoteInputsTest() { inputs.set_rules({rule("inlet.Pressure")}); }

  static RemoteInputs::Rule rule(const std::string& entry) {
    return {"pack",
            77,
            {.from = kPress,
             .entry = entry,
             .group = 9,
             .output = 4,
             .output_name = "display.Value",
             .type = od::DataType::unsigned16,
             .bit_length = 16,
             .timeout = kTimeout,
             .reactions = line::kZeroOutputs}};
  }

  bool write(const std::string& line, const line::OutputWrite& write) override {
    EXPECT_EQ(line, "pack");
    EXPECT_EQ(write.group, 9U);
    EXPECT_EQ(write.layout_id, 77U);
    EXPECT_EQ(write.watchdog, timeout - age);
    EXPECT_EQ(write.reactions, line::kZeroOutputs);
    EXPECT_TRUE(write.forwarded);
    EXPECT_EQ(write.values.size(), 1U);
    if (!room)
      return false;
    const line::OutputValue& value = write.values.at(0);
    octets.assign(value.data.begin(), value.data.begin() + value.length);
    values.push_back(load_le(std::span(octets).first(std::min<std::size_t>(octets.size(), 8))));
    armings.push_back(write.arming);
    return true;
  }
  void refuse(const RemoteInputs::Rule& rule, OutputRefusal why) override {
    EXPECT_EQ(rule.input.group, 9U);
    refusals.push_back(why);
  }

  // The values that were written since the last call.
  std::vector<std::uint64_t> written() { return std::exchange(values, {}); }

  void layout(std::uint64_t incarnation, const image::Layout& layout) {
    inputs.take_layout({kPress, incarnation}, layout, now);
  }
  // With the next number, if it has none.
  void image(std::uint64_t incarnation, image::Snapshot image) {
    if (image.sequence == 0)
      image.sequence = ++sequence;
    inputs.take_image({kPress, incarnation}, image, now);
  }
  void state(std::uint64_t incarnation) {
    inputs.take_state({kPress, incarnation}, ++state_time, now);
  }
  // States of the line once a second for that time.
  void pass(std::uint64_t incarnation, Duration time) {
    for (const Instant end = now + time; now < end;) {
      now += seconds(1);
      state(incarnation);
    }
  }
  void is_live(std::uint64_t incarnation) {
    state(incarnation);
    state(incarnation);
  }
  void has_nothing_written(std::uint64_t incarnation, std::uint16_t value) {
    is_live(incarnation);
    layout(incarnation, remote_layout(5, 16));
    image(incarnation, remote_image(5, 16, value));
    ASSERT_THAT(written(), IsEmpty());
  }
  void has_value(std::uint64_t incarnation, std::uint16_t value) {
    is_live(incarnation);
    layout(incarnation, remote_layout(5, 16));
    image(incarnation, remote_image(5, 16, value));
    ASSERT_THAT(written(), ElementsAre(value));
  }

  Instant now{seconds(1000)};
  Duration timeout = kTimeout;
  Duration age{};  // of the value that is written
  std::uint64_t sequence = 100;
  std::int64_t state_time = 0;
  bool room = true;
  std::vector<std::uint64_t> values;
  std::vector<std::byte> octets;  // of the last one
  std::vector<std::uint64_t> armings;
  std::vector<OutputRefusal> refusals;
  RemoteInputs inputs{*this};
};

TEST_F(RemoteInputsTest, AValueIsWrittenWhenItChangesAndRepeatedWhileTheLineIsHeard) {
  has_value(1, 300);
  image(1, remote_image(5, 16, 300));
  EXPECT_THAT(written(), IsEmpty()) << "the same just now";
  image(1, remote_image(5, 16, 301));
  EXPECT_THAT(written(), ElementsAre(301U));
  EXPECT_EQ(armings[0], armings[1]);
  pass(1, seconds(3));
  EXPECT_THAT(written(), ElementsAre(301U, 301U, 301U));
  EXPECT_NE(armings[1], armings[2]) << "so that a watchdog that fired meanwhile is armed again";
}

// Of lines of CANopen FD.
TEST_F(RemoteInputsTest, AValueOfMoreThanEightBytesIsWrittenAsAWhole) {
  RemoteInputs::Rule text = rule("inlet.Text");
  text.input.type = od::DataType::octet_string;
  text.input.bit_length = 96;
  inputs.set_rules({text});
  image::Layout wide = remote_layout(5, 0);
  wide.entries = {remote_entry("inlet.Text", 8, 96, od::DataType::octet_string)};
  is_live(1);
  layout(1, wide);
  image::Snapshot seen = remote_image(5, 0, 0);
  for (std::size_t i = 0; i < seen.bytes.size(); ++i)
    seen.bytes[i] = static_cast<std::byte>(i);
  image(1, seen);
  EXPECT_EQ(written().size(), 1U);
  EXPECT_TRUE(std::ranges::equal(octets, std::span(seen.bytes).subspan(1, 12)));
  seen.sequence = 0;
  image(1, seen);
  EXPECT_EQ(written().size(), 0U) << "it has not changed";
  seen.sequence = 0;
  seen.bytes[12] = std::byte{0xEE};
  image(1, seen);
  EXPECT_EQ(written().size(), 1U);
  EXPECT_EQ(octets[11], std::byte{0xEE}) << "the last byte alone";
}

TEST_F(RemoteInputsTest, TheLayoutMayComeAfterTheImage) {
  is_live(1);
  image(1, remote_image(5, 16, 300));
  EXPECT_THAT(written(), IsEmpty());
  now += milliseconds(50);
  layout(1, remote_layout(5, 16));
  EXPECT_THAT(written(), ElementsAre(300U));
}

TEST_F(RemoteInputsTest, AnInvalidValueIsNotWritten) {
  has_value(1, 300);
  image::Snapshot invalid = remote_image(5, 16, 400);
  invalid.valid = {0b01};
  image(1, invalid);
  pass(1, seconds(5));
  EXPECT_THAT(written(), IsEmpty()) << "the watchdog of the group fires";
  image(1, remote_image(5, 16, 401));
  EXPECT_THAT(written(), ElementsAre(401U));
}

TEST_F(RemoteInputsTest, AValueFromBeforeASilenceDoesNotComeBackByAStateAlone) {
  has_value(1, 300);
  pass(1, seconds(2));
  written();
  now += seconds(60);
  state(1);
  now += milliseconds(100);
  state(1);
  EXPECT_THAT(written(), IsEmpty()) << "a newer image may have been lost and not repeated yet";
  image(1, remote_image(5, 16, 500));
  EXPECT_THAT(written(), ElementsAre(500U));
  now += seconds(60);
  state(1);
  EXPECT_THAT(written(), IsEmpty());
  pass(1, seconds(1));
  EXPECT_THAT(written(), ElementsAre(500U)) << "a newer image would have been repeated";
}

// States come once a second: they cannot confirm that a value is not older than half of one.
TEST_F(RemoteInputsTest, AShortTimeOutNeedsImages) {
  RemoteInputs::Rule brief = rule("inlet.Pressure");
  brief.input.timeout = timeout = milliseconds(500);
  inputs.set_rules({brief});
  has_value(1, 300);
  pass(1, seconds(5));
  EXPECT_THAT(written(), IsEmpty());
  image(1, remote_image(5, 16, 300));
  now += milliseconds(200);
  image(1, remote_image(5, 16, 300));
  EXPECT_THAT(written(), ElementsAre(300U, 300U));
}

TEST_F(RemoteInputsTest, AnImageOfAWriterThatWasReplacedDoesNotComeBack) {
  is_live(1);
  layout(1, remote_layout(5, 16));
  const auto numbered = [&](std::uint64_t number, Duration time, std::uint16_t value) {
    image::Snapshot out = remote_image(5, 16, value);
    out.sequence = number;
    out.acquired = Instant(time);
    image(1, out);
    return written();
  };
  EXPECT_THAT(numbered(20, seconds(50), 300), ElementsAre(300U));
  now += milliseconds(100);
  EXPECT_THAT(numbered(19, seconds(49), 299), IsEmpty());
  EXPECT_THAT(numbered(1, seconds(51), 301), IsEmpty()) << "of a line that was made anew";
  pass(1, seconds(1));
  EXPECT_THAT(written(), ElementsAre(301U)) << "its layout would have come";
  now += seconds(2);
  EXPECT_THAT(numbered(2, seconds(20), 302), ElementsAre(302U)) << "its clock was set";
}

// DDS gives new readers the last image and the last state of a line that stands still.
TEST_F(RemoteInputsTest, AnImageThatIsRepeatedDoesNotBringItsValueBack) {
  has_value(1, 300);
  image::Snapshot last = remote_image(5, 16, 301);
  last.sequence = ++sequence;
  image(1, last);
  written();
  now += seconds(60);
  inputs.set_rules({rule("inlet.Pressure")});
  image(1, last);
  inputs.take_state({kPress, 1}, state_time, now);
  EXPECT_THAT(written(), IsEmpty());
  now += seconds(1);
  state(1);
  EXPECT_THAT(written(), IsEmpty());
  pass(1, seconds(2));
  EXPECT_THAT(written(), testing::Contains(301U)) << "the line runs";
}

TEST_F(RemoteInputsTest, TheFirstSamplesMayBeOld) {
  layout(1, remote_layout(5, 16));
  image(1, remote_image(5, 16, 300));
  state(1);
  EXPECT_THAT(written(), IsEmpty());
  image(1, remote_image(5, 16, 301));
  EXPECT_THAT(written(), ElementsAre(301U)) << "a second image";
}

TEST_F(RemoteInputsTest, APublisherThatIsHeardKeepsItsPlace) {
  has_value(1, 300);
  for (std::uint64_t other = 2; other < 20; ++other) {
    now += milliseconds(10);
    state(other);
  }
  now += RemoteInputs::kSilence;
  pass(1, seconds(3));
  EXPECT_THAT(written(), testing::Contains(300U)) << "its layout is still known";
}

TEST_F(RemoteInputsTest, ANewPublisherWaitsForTheEndOfTheFormerOne) {
  has_value(1, 300);
  for (std::uint64_t other = 2; other < 6; ++other) {
    layout(other, remote_layout(5, 16));
    for (int i = 0; i < 10; ++i) {
      now += milliseconds(150);
      image(1, remote_image(5, 16, 300));
      image(other, remote_image(5, 16, 7));
    }
  }
  EXPECT_THAT(written(), testing::Each(300U)) << "another incarnation again and again";
  EXPECT_THAT(refusals, testing::Contains(OutputRefusal::source_disputed));
}

TEST_F(RemoteInputsTest, AValueThatWaitsForRoomIsNotWrittenOnceItIsDisputed) {
  room = false;
  has_nothing_written(1, 300);
  layout(2, remote_layout(5, 16));
  for (int i = 0; i < 20; ++i) {
    now += milliseconds(100);
    image(1, remote_image(5, 16, 300));
    image(2, remote_image(5, 16, 7));
  }
  room = true;
  inputs.advance(now);
  EXPECT_THAT(written(), IsEmpty());
}

TEST_F(RemoteInputsTest, OutputsAreNoSource) {
  has_value(1, 300);
  image::Layout outputs = remote_layout(5, 32);
  outputs.direction = image::Direction::outputs;
  layout(1, outputs);
  image::Snapshot image = remote_image(5, 16, 301);
  image.direction = image::Direction::outputs;
  RemoteInputsTest::image(1, image);
  pass(1, seconds(2));
  EXPECT_THAT(written(), testing::Each(300U));
}

TEST_F(RemoteInputsTest, ARepeatedStateSaysNothing) {
  has_value(1, 300);
  pass(1, seconds(2));
  written();
  for (int i = 0; i < 10; ++i) {
    now += seconds(1);
    inputs.take_state({kPress, 1}, state_time, now);
  }
  EXPECT_THAT(written(), IsEmpty());
}

TEST_F(RemoteInputsTest, AnotherIncarnationBeginsWithoutLayoutAndImage) {
  has_value(1, 300);
  now += milliseconds(200);
  image(2, remote_image(5, 16, 7));
  EXPECT_THAT(written(), IsEmpty()) << "its layout may be another, with the same number";
  image(1, remote_image(5, 16, 8));
  EXPECT_THAT(written(), IsEmpty()) << "one that ended";
  layout(2, remote_layout(5, 32));
  image(2, remote_image(5, 32, 9));
  EXPECT_THAT(written(), IsEmpty()) << "the former one was heard just now";
  now += RemoteInputs::kHandOver;
  image(2, remote_image(5, 32, 9));
  EXPECT_THAT(written(), ElementsAre(9U));
  EXPECT_THAT(refusals, IsEmpty());
}

TEST_F(RemoteInputsTest, AnEntryThatMovedIsFoundByItsName) {
  has_value(1, 300);
  layout(1, remote_layout(6, 48));
  EXPECT_THAT(written(), IsEmpty());
  image(1, remote_image(5, 16, 301));
  EXPECT_THAT(written(), IsEmpty()) << "an image of the former layout";
  image(1, remote_image(6, 48, 302));
  EXPECT_THAT(written(), ElementsAre(302U)) << "that ID had no other layout";
}

// Two nodes of the source have exchanged their names, which the ID of its layout does not show.
TEST_F(RemoteInputsTest, NamesThatChangePlacesDoNotGiveTheValueOfAnotherInput) {
  const auto both = [&](std::uint64_t number, std::uint16_t at_16, std::uint16_t at_64) {
    image::Snapshot out = remote_image(5, 16, at_16);
    store_le(std::span(out.bytes).subspan(8, 2), at_64);
    out.sequence = number;
    out.acquired = now;
    return out;
  };
  image::Layout exchanged = remote_layout(5, 16);
  std::swap(exchanged.entries[0].name, exchanged.entries[1].name);
  has_value(1, 300);
  now += seconds(10);
  state(1);
  image(1, both(150, 300, 7));
  written();
  layout(1, exchanged);
  EXPECT_THAT(written(), IsEmpty()) << "the image is older than the layout";
  image(1, both(151, 301, 7));
  EXPECT_THAT(written(), IsEmpty()) << "one from before may come after the layout";
  image(1, both(1, 20, 302));
  pass(1, seconds(1));
  EXPECT_THAT(written(), ElementsAre(302U)) << "although nothing has changed since";
  now += milliseconds(100);
  image(1, both(1, 303, 21));
  EXPECT_THAT(written(), IsEmpty()) << "its layout has not come yet: the names are exchanged again";
  layout(1, remote_layout(5, 16));
  EXPECT_THAT(written(), IsEmpty());
  pass(1, seconds(1));
  EXPECT_THAT(written(), ElementsAre(303U));
  EXPECT_THAT(refusals, IsEmpty());
}

TEST_F(RemoteInputsTest, AValueThatWaitsForRoomIsNotReadThroughOtherNames) {
  room = false;
  has_nothing_written(1, 300);
  image::Layout exchanged = remote_layout(5, 16);
  std::swap(exchanged.entries[0].name, exchanged.entries[1].name);
  layout(1, exchanged);
  room = true;
  inputs.advance(now);
  EXPECT_THAT(written(), IsEmpty());
}

TEST_F(RemoteInputsTest, AnEntryIsFoundByItsObjectToo) {
  inputs.set_rules({rule("inlet.6401:2")});
  is_live(1);
  image::Layout known = remote_layout(5, 16);
  known.entries[1].index = 0x6401;
  known.entries[1].sub = 2;
  layout(1, known);
  image(1, remote_image(5, 16, 300));
  EXPECT_THAT(written(), ElementsAre(300U));
  known.entries[0] = known.entries[1];
  layout(1, known);
  EXPECT_THAT(refusals, ElementsAre(OutputRefusal::source_missing)) << "two of that object";
}

TEST_F(RemoteInputsTest, AnSrdoOfTheSameObjectIsNotMeant) {
  inputs.set_rules({rule("inlet.6401:2")});
  is_live(1);
  image::Layout known = remote_layout(5, 16);
  for (image::Entry& entry : known.entries) {
    entry.index = 0x6401;
    entry.sub = 2;
  }
  known.entries[0].remote_pdo = image::kFirstSrdo;
  known.entries[1].remote_pdo = 1;
  layout(1, known);
  image(1, remote_image(5, 16, 300));
  EXPECT_THAT(written(), ElementsAre(300U));
  EXPECT_THAT(refusals, IsEmpty());
}

TEST_F(RemoteInputsTest, WhatDoesNotMatchIsRefusedOnce) {
  has_value(1, 300);
  const auto refused = [&](const image::Layout& other, OutputRefusal why) {
    for (int i = 0; i < 3; ++i) {
      layout(1, other);
      image(1, remote_image(other.id, 16, 301));
    }
    EXPECT_THAT(refusals, ElementsAre(why));
    EXPECT_THAT(written(), IsEmpty());
    layout(1, remote_layout(5, 16));
    image(1, remote_image(5, 16, 300));
    now += seconds(1);
    refusals.clear();
    values.clear();
  };
  image::Layout other = remote_layout(6, 16);
  other.entries[1].name = "inlet.Flow";
  refused(other, OutputRefusal::source_missing);
  other = remote_layout(6, 16);
  other.entries[0].name = "inlet.Pressure";
  refused(other, OutputRefusal::source_missing);
  other = remote_layout(6, 16);
  other.entries[1].type = od::DataType::integer16;
  refused(other, OutputRefusal::source_type);
  other = remote_layout(6, 16);
  other.entries[1].bit_length = 8;
  refused(other, OutputRefusal::source_type);
  RemoteInputs::Rule scaled = rule("inlet.Pressure");
  scaled.input.scaling = {.unit = "bar", .scale = 0.1};
  inputs.set_rules({scaled});
  other = remote_layout(6, 16);
  other.entries[1].scaling = {.unit = "kPa", .scale = 10};
  refused(other, OutputRefusal::source_type);
}

TEST_F(RemoteInputsTest, ASourceThatIsNeverHeardIsReportedOnce) {
  inputs.advance(now);
  now += kTimeout + RemoteInputs::kSilence - milliseconds(1);
  inputs.advance(now);
  EXPECT_THAT(refusals, IsEmpty());
  now += milliseconds(1);
  inputs.advance(now);
  EXPECT_THAT(refusals, ElementsAre(OutputRefusal::source_silent));
  now += seconds(100);
  inputs.advance(now);
  EXPECT_THAT(refusals, ElementsAre(OutputRefusal::source_silent));
  has_value(1, 500);
  now += seconds(100);
  inputs.advance(now);
  EXPECT_THAT(refusals, ElementsAre(OutputRefusal::source_silent));
}

TEST_F(RemoteInputsTest, AnInputThatIsNeverValidIsReportedOnce) {
  inputs.advance(now);
  is_live(1);
  layout(1, remote_layout(5, 16));
  image::Snapshot invalid = remote_image(5, 16, 500);
  invalid.valid = {0b01};
  image(1, invalid);
  pass(1, kTimeout + RemoteInputs::kSilence);
  inputs.advance(now);
  inputs.advance(now);
  EXPECT_THAT(refusals, ElementsAre(OutputRefusal::source_invalid));
}

TEST_F(RemoteInputsTest, AValueThatIsLostIsNotReportedAfterAChangeOfTheRules) {
  has_value(1, 500);
  for (int i = 0; i < 3; ++i) {
    now += kTimeout + RemoteInputs::kSilence;
    inputs.set_rules({rule("inlet.Pressure")});
    inputs.advance(now);
  }
  EXPECT_THAT(refusals, IsEmpty());
  inputs.set_rules({rule("inlet.Level")});
  inputs.advance(now);
  now += kTimeout + RemoteInputs::kSilence;
  inputs.advance(now);
  inputs.set_rules({rule("inlet.Level")});
  inputs.advance(now + seconds(100));
  EXPECT_THAT(refusals, ElementsAre(OutputRefusal::source_silent)) << "another rule, once";
}

TEST_F(RemoteInputsTest, ALineOfWhichOnlyStatesComeIsNotReceived) {
  inputs.advance(now);
  is_live(1);
  pass(1, kTimeout + RemoteInputs::kSilence);
  inputs.advance(now);
  EXPECT_THAT(refusals, ElementsAre(OutputRefusal::source_silent));
  layout(1, remote_layout(5, 16));
  image::Snapshot invalid = remote_image(5, 16, 500);
  invalid.valid = {0b01};
  image(1, invalid);
  inputs.advance(now);
  inputs.advance(now);
  EXPECT_THAT(refusals, ElementsAre(OutputRefusal::source_silent, OutputRefusal::source_invalid))
      << "what is known now";
}

TEST_F(RemoteInputsTest, ASourceThatAppearsLateHasTime) {
  inputs.advance(now);
  now += kTimeout + RemoteInputs::kSilence - milliseconds(200);
  state(1);
  now += milliseconds(200);
  inputs.advance(now);
  EXPECT_THAT(refusals, IsEmpty());
  has_value(1, 500);
  pass(1, kTimeout + RemoteInputs::kSilence);
  inputs.advance(now);
  EXPECT_THAT(refusals, IsEmpty());
}

TEST_F(RemoteInputsTest, AValueThatWaitsForRoomIsNoFaultOfItsSource) {
  inputs.advance(now);
  room = false;
  is_live(1);
  layout(1, remote_layout(5, 16));
  for (const Instant end = now + kTimeout + RemoteInputs::kSilence; now < end; now += seconds(1)) {
    image(1, remote_image(5, 16, 500));
    state(1);
  }
  room = true;
  age = seconds(1);
  inputs.advance(now);
  EXPECT_THAT(refusals, IsEmpty());
}

TEST_F(RemoteInputsTest, AReasonThatWasReportedIsNotJoinedByAnother) {
  inputs.set_rules({rule("inlet.Pression")});
  inputs.advance(now);
  is_live(1);
  layout(1, remote_layout(5, 16));
  pass(1, kTimeout + RemoteInputs::kSilence);
  inputs.advance(now);
  EXPECT_THAT(refusals, ElementsAre(OutputRefusal::source_missing));
}

TEST_F(RemoteInputsTest, TwoGatewaysOfOneNameDisputeTheLine) {
  has_value(1, 300);
  pass(1, seconds(2));
  written();
  layout(2, remote_layout(5, 16));
  image(2, remote_image(5, 16, 7));
  EXPECT_THAT(written(), IsEmpty()) << "the first one may still run";
  for (int i = 0; i < 4; ++i) {
    now += seconds(1);
    state(1);
    state(2);
  }
  EXPECT_THAT(refusals, ElementsAre(OutputRefusal::source_disputed));
  written();
  image(1, remote_image(5, 16, 301));
  image(2, remote_image(5, 16, 8));
  EXPECT_THAT(written(), IsEmpty());
  now += RemoteInputs::kSilence;  // the second one ended
  pass(1, seconds(2));
  EXPECT_THAT(written(), testing::Contains(301U));
}

TEST_F(RemoteInputsTest, WithoutRoomTheValueIsWrittenLater) {
  room = false;
  has_nothing_written(1, 300);
  inputs.advance(now);
  EXPECT_THAT(written(), IsEmpty());
  room = true;
  age = milliseconds(1);
  inputs.advance(now + milliseconds(1));
  EXPECT_THAT(written(), ElementsAre(300U));
  inputs.advance(now + milliseconds(2));
  EXPECT_THAT(written(), IsEmpty());
  room = false;
  age = Duration{};
  image(1, remote_image(5, 16, 301));
  room = true;
  inputs.advance(now + kTimeout);
  EXPECT_THAT(written(), IsEmpty()) << "too old";
}

TEST_F(RemoteInputsTest, WhatIsKnownSurvivesOtherRules) {
  has_value(1, 300);
  inputs.set_rules({rule("inlet.Level")});
  pass(1, seconds(2));
  EXPECT_THAT(written(), testing::Contains(0U));
  inputs.set_rules({});
  EXPECT_THAT(inputs.lines(), IsEmpty());
  image(1, remote_image(5, 16, 301));
  EXPECT_THAT(written(), IsEmpty());
}

// Whatever is received, a value is that of a valid entry with the wanted name and type in the
// newest image of a publisher.
TEST_F(RemoteInputsTest, HostileSamplesNeverMakeAnotherValue) {
  const std::uint64_t seed =
      testing::UnitTest::GetInstance()->random_seed() != 0
          ? static_cast<std::uint64_t>(testing::UnitTest::GetInstance()->random_seed())
          : std::random_device()();
  RecordProperty("seed", std::to_string(seed));
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937_64 random(seed);
  const auto any = [&](std::uint64_t most) { return random() % (most + 1); };
  constexpr std::uint16_t kGood = 0x4711;  // in the only entry that may be used
  for (int i = 0; i < 20'000; ++i) {
    now += milliseconds(any(400));
    const std::uint64_t incarnation = 1 + any(6);
    image::Layout layout = remote_layout(1 + any(2), 0);
    layout.direction = any(7) == 0 ? image::Direction::outputs : image::Direction::inputs;
    layout.entries[1].bit_offset = static_cast<std::uint32_t>(any(3) == 0 ? any(200) : 32);
    layout.entries[1].bit_length = static_cast<std::uint16_t>(any(3) == 0 ? any(600) : 16);
    // An entry at another place than the good value has another name or type.
    if (layout.entries[1].bit_offset != 32) {
      (any(1) == 0 ? layout.entries[1].name : layout.entries[0].name) = "inlet.Pressure";
      layout.entries[1].type = od::DataType::real32;
    }
    layout.entries[0].type = od::DataType::real32;
    image::Snapshot image = remote_image(1 + any(2), 32, kGood);
    image.direction = any(7) == 0 ? image::Direction::outputs : image::Direction::inputs;
    image.bytes.resize(any(3) == 0 ? any(16) : 16);
    image.valid.resize(any(1));
    for (auto& word : image.valid)
      word = any(3);
    switch (any(3)) {
      case 0:
        inputs.take_layout({kPress, incarnation}, layout, now);
        break;
      case 1:
        inputs.take_state({kPress, incarnation}, static_cast<std::int64_t>(any(1000)), now);
        break;
      case 2:
        inputs.advance(now);
        break;
      default:
        inputs.take_image({kPress, incarnation}, image, now);
    }
    for (const std::uint64_t value : written())
      ASSERT_EQ(value, kGood);
  }
}

}  // namespace
}  // namespace linegate::gateway
