// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/named_samples.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace linegate::gateway {
namespace {

using image::Direction;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Devices ram (entries 0, 1 in PDOs 1 and 3 of the gateway) and axis (entry 2, PDO 2).
image::Layout two_devices(Direction direction) {
  image::Layout layout{.direction = direction, .id = 1, .byte_size = 3, .entries = {}};
  const auto add = [&](const std::string& name, std::uint8_t node, std::uint16_t remote,
                       std::uint16_t local) {
    layout.entries.push_back({.bit_offset = static_cast<std::uint32_t>(8 * layout.entries.size()),
                              .bit_length = 8,
                              .type = od::DataType::unsigned8,
                              .node = node,
                              .remote_pdo = remote,
                              .local_pdo = local,
                              .name = name});
  };
  add("ram.A", 5, 1, 1);
  add("ram.B", 5, 4, 3);
  add("axis.A", 6, 1, 2);
  return layout;
}

class NamedSamplesTest : public testing::Test {
 protected:
  NamedSamplesTest() {
    plan.config.name = "press";
    snapshot.layout_id = 1;
    snapshot.bytes.resize(3);
    snapshot.changed = snapshot.valid = snapshot.known = {0};
  }

  // "ram 1: 10 0": number and times of the samples that are due.
  std::vector<std::string> due(NamedSamples& samples) {
    std::vector<std::string> out;
    samples.note(snapshot);
    out = emitted(samples);
    snapshot.changed = {0};
    snapshot.marks.clear();
    return out;
  }
  // The same without another image.
  std::vector<std::string> emitted(NamedSamples& samples, bool at_once = false) {
    std::vector<std::string> out;
    const auto accepts = [&](const named::DeviceType& type) { return type.device != refused; };
    next = samples.emit_due(snapshot, now, at_once, accepts, [&](const NamedSample& sample) {
      std::string text = sample.type.device + ' ' + std::to_string(sample.number) + ':';
      for (const Instant time : sample.times) {
        text += ' ' + std::to_string(time.time_since_epoch().count());
      }
      out.push_back(text);
      waits.insert(waits.end(), sample.waits.begin(), sample.waits.end());
    });
    return out;
  }

  config::LinePlan plan;
  image::Snapshot snapshot;
  Instant now{};
  std::vector<std::uint8_t> waits;  // of the members of all samples
  Instant next{};                   // when emit_due() must be called again
  std::string refused;              // the device whose samples would wait
};

TEST_F(NamedSamplesTest, ASampleFollowsAChangeOfItsDevice) {
  NamedSamples samples(plan);
  EXPECT_THAT(samples.use(two_devices(Direction::inputs)), IsEmpty());
  EXPECT_THAT(due(samples), ElementsAre("ram 1: 0 0", "axis 1: 0"));
  EXPECT_THAT(due(samples), IsEmpty());
  snapshot.changed = {0b010};
  EXPECT_THAT(due(samples), ElementsAre("ram 2: 0 0"));
  snapshot.valid = {0b100};
  EXPECT_THAT(due(samples), ElementsAre("axis 2: 0"));
  EXPECT_THAT(due(samples), IsEmpty());
  snapshot.known = {0b111};  // has no meaning for inputs
  EXPECT_THAT(due(samples), IsEmpty());
}

TEST_F(NamedSamplesTest, ASampleThatWouldWaitIsMadeLaterWithoutAGapInItsNumbers) {
  NamedSamples samples(plan);
  samples.use(two_devices(Direction::inputs));
  EXPECT_THAT(due(samples), ElementsAre("ram 1: 0 0", "axis 1: 0"));
  refused = "ram";
  snapshot.changed = {0b111};
  EXPECT_THAT(due(samples), ElementsAre("axis 2: 0"));
  EXPECT_GT(next, now);
  EXPECT_NE(next, kNever);
  EXPECT_THAT(emitted(samples), IsEmpty());
  refused = {};
  EXPECT_THAT(emitted(samples), ElementsAre("ram 2: 0 0"));
  EXPECT_EQ(next, kNever);
  refused = "ram";
  snapshot.changed = {0b001};
  EXPECT_THAT(due(samples), IsEmpty());
  EXPECT_THAT(emitted(samples, true), ElementsAre("ram 3: 0 0")) << "the last one";
}

TEST_F(NamedSamplesTest, AnOutputThatBecomesKnownIsAChange) {
  NamedSamples samples(plan);
  samples.use(two_devices(Direction::outputs));
  due(samples);
  snapshot.known = {0b001};
  EXPECT_THAT(due(samples), ElementsAre("ram 2: 0 0"));
}

TEST_F(NamedSamplesTest, AnOutputThatWaitsForSomethingElseIsAChange) {
  NamedSamples samples(plan);
  samples.use(two_devices(Direction::outputs));
  due(samples);
  EXPECT_THAT(waits, ElementsAre(named::kUnknownWait, named::kUnknownWait, named::kUnknownWait));
  line::OutputState state;
  state.waits = {{0, line::OutputWait::value}, {2, line::OutputWait::node}, {99, {}}};
  const auto emitted_after = [&](std::initializer_list<line::OutputState> groups) {
    waits.clear();
    samples.note_waits(std::vector(groups));
    return emitted(samples);
  };
  EXPECT_THAT(emitted_after({state}), ElementsAre("ram 2: 0 0", "axis 2: 0"));
  EXPECT_THAT(waits, ElementsAre(1, named::kUnknownWait, 4));
  EXPECT_THAT(emitted_after({state}), IsEmpty());
  line::OutputState other;
  other.waits = {{1, line::OutputWait::values}};
  EXPECT_THAT(emitted_after({state, other}), ElementsAre("ram 3: 0 0"));
  EXPECT_THAT(waits, ElementsAre(1, 2));
  samples.use(two_devices(Direction::outputs));  // the same types
  EXPECT_THAT(emitted_after({state, other}), IsEmpty());
  EXPECT_THAT(emitted_after({}), ElementsAre("ram 4: 0 0", "axis 3: 0"));
}

TEST_F(NamedSamplesTest, AnInputHasNoReasons) {
  NamedSamples samples(plan);
  samples.use(two_devices(Direction::inputs));
  due(samples);
  EXPECT_THAT(waits, IsEmpty());
}

TEST_F(NamedSamplesTest, TimesAreThoseOfTheLastReceptionOfEachPdo) {
  NamedSamples samples(plan);
  samples.use(two_devices(Direction::inputs));
  due(samples);
  snapshot.marks = {{.local_pdo = 1, .time = Instant{Duration{10}}},
                    {.local_pdo = 2, .time = Instant{Duration{20}}},
                    {.local_pdo = 99, .time = Instant{Duration{90}}}};
  EXPECT_THAT(due(samples), IsEmpty());  // nothing changed
  snapshot.marks = {{.local_pdo = 3, .time = Instant{Duration{30}}}};
  snapshot.changed = {0b101};
  EXPECT_THAT(due(samples), ElementsAre("ram 2: 10 30", "axis 2: 20"));
}

// Topics of ROS 2 have the same times, and numbers and readers of their own.
TEST_F(NamedSamplesTest, MessagesOfRos2AreBesideTheOthers) {
  plan.named.ros2 = true;
  NamedSamples samples(plan);
  EXPECT_THAT(samples.use(two_devices(Direction::inputs)), IsEmpty());
  ASSERT_EQ(samples.types().size(), 4U);
  EXPECT_EQ(samples.types()[2].topic(), "rt/plant/press/ram/inputs");
  samples.update_readers([](const named::DeviceType& type) { return !type.ros2; });
  EXPECT_THAT(due(samples), ElementsAre("ram 1: 0 0", "axis 1: 0"));
  samples.update_readers([](const named::DeviceType& type) { return !type.line.empty(); });
  EXPECT_THAT(due(samples), ElementsAre("ram 1: 0 0", "axis 1: 0"));
  snapshot.marks = {{.local_pdo = 1, .time = Instant{Duration{10}}},
                    {.local_pdo = 3, .time = Instant{Duration{30}}}};
  snapshot.changed = {0b001};
  EXPECT_THAT(due(samples), ElementsAre("ram 2: 10 30", "ram 2: 10 30"));
}

TEST_F(NamedSamplesTest, ADeviceWithoutAMessageHasItsOtherTopic) {
  plan.named.ros2 = true;
  NamedSamples samples(plan);
  image::Layout layout = two_devices(Direction::inputs);
  layout.entries[2].name = "RAM.A";
  layout.entries[0].name = "Ra-m.A";
  layout.entries[1].name = "Ra_m.B";
  EXPECT_THAT(samples.use(layout), ElementsAre(HasSubstr("rt/plant/press/Ra_m/inputs of ROS 2")));
  EXPECT_EQ(samples.types().size(), 5U);
}

TEST_F(NamedSamplesTest, WithOtherRulesEachImageIsASampleOfEachDevice) {
  for (const auto rule : {config::Publish::Rule::on_sync, config::Publish::Rule::period}) {
    plan.publish.rule = rule;
    NamedSamples samples(plan);
    samples.use(two_devices(Direction::inputs));
    EXPECT_THAT(due(samples), ElementsAre("ram 1: 0 0", "axis 1: 0"));
    EXPECT_THAT(due(samples), ElementsAre("ram 2: 0 0", "axis 2: 0"));
  }
}

TEST_F(NamedSamplesTest, ATypeThatRemainsContinues) {
  NamedSamples samples(plan);
  samples.use(two_devices(Direction::inputs));
  snapshot.marks = {{.local_pdo = 1, .time = Instant{Duration{10}}}};
  due(samples);
  image::Layout layout = two_devices(Direction::inputs);
  layout.entries[2].type = od::DataType::integer8;
  layout.entries.insert(layout.entries.begin(), layout.entries[2]);
  layout.entries.front().name = "valve.A";
  layout.entries.front().node = 4;
  samples.use(layout);
  snapshot.valid = {0b0001};
  EXPECT_THAT(due(samples), ElementsAre("valve 1: 0", "axis 1: 0"));
  snapshot.changed = {0b0010};
  EXPECT_THAT(due(samples), ElementsAre("ram 2: 10 0"));
}

TEST_F(NamedSamplesTest, ATopicWithoutReadersHasNoSamplesAndAReaderGetsTheStateAtOnce) {
  NamedSamples samples(plan);
  samples.use(two_devices(Direction::inputs));
  samples.update_readers([](const named::DeviceType& type) { return type.device == "axis"; });
  snapshot.changed = {0b111};
  EXPECT_THAT(due(samples), ElementsAre("axis 1: 0"));
  snapshot.changed = {0b111};
  snapshot.valid = {0b011};
  snapshot.marks = {{.local_pdo = 1, .time = Instant{Duration{10}}}};
  EXPECT_THAT(due(samples), ElementsAre("axis 2: 0"));
  EXPECT_EQ(next, kNever);

  // A reader comes, and no image: one sample, numbered from 1, with the times from before.
  samples.update_readers([](const named::DeviceType&) { return true; });
  EXPECT_THAT(emitted(samples), ElementsAre("ram 1: 10 0"));
  EXPECT_THAT(emitted(samples), IsEmpty());
  EXPECT_THAT(due(samples), IsEmpty());  // its marks are those of that sample
  samples.update_readers([](const named::DeviceType&) { return true; });
  EXPECT_THAT(emitted(samples), IsEmpty());

  // The numbers of the topic have no gap for the next reader either.
  samples.update_readers([](const named::DeviceType&) { return false; });
  snapshot.changed = {0b111};
  EXPECT_THAT(due(samples), IsEmpty());
  samples.update_readers([](const named::DeviceType& type) { return type.device == "ram"; });
  EXPECT_THAT(emitted(samples), ElementsAre("ram 2: 10 0"));
}

TEST_F(NamedSamplesTest, SamplesOfATopicHaveAMinimumSeparation) {
  plan.named.min_separation = Duration{100};
  NamedSamples samples(plan);
  samples.use(two_devices(Direction::inputs));
  EXPECT_THAT(due(samples), ElementsAre("ram 1: 0 0", "axis 1: 0"));
  now = Instant{Duration{60}};
  snapshot.changed = {0b001};
  EXPECT_THAT(due(samples), IsEmpty());
  EXPECT_EQ(next, Instant{Duration{100}});
  now = Instant{Duration{99}};
  EXPECT_THAT(due(samples), IsEmpty());
  now = Instant{Duration{100}};
  EXPECT_THAT(emitted(samples), ElementsAre("ram 2: 0 0"));
  EXPECT_EQ(next, kNever);
  snapshot.changed = {0b101};
  EXPECT_THAT(due(samples), ElementsAre("axis 2: 0"));  // ram waits until 200
  EXPECT_EQ(next, Instant{Duration{200}});
  EXPECT_THAT(emitted(samples, true), ElementsAre("ram 3: 0 0"));  // the gateway ends
}

TEST_F(NamedSamplesTest, ACollisionIsReported) {
  NamedSamples samples(plan);
  image::Layout layout = two_devices(Direction::inputs);
  layout.entries[1].name = "ram.a";
  EXPECT_THAT(samples.use(layout), ElementsAre(HasSubstr("make the same identifier a")));
  EXPECT_THAT(due(samples), ElementsAre("axis 1: 0"));
  plan.named.aliases = {{Direction::inputs, "ram.a", "Other"}};
  NamedSamples named(plan);
  EXPECT_THAT(named.use(layout), IsEmpty());
}

}  // namespace
}  // namespace linegate::gateway
