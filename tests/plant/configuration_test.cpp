// SPDX-License-Identifier: Apache-2.0
// The configuration manager of a line with simulated devices, in virtual time.
#include <algorithm>

#include <gtest/gtest.h>

#include "stack/eds/reader.h"
#include "stack/manager/configuration_objects.h"
#include "stack/manager/node_report.h"
#include "stack/manager/plan.h"

#include "tests/plant/manager_fixture.h"

namespace linegate::plant {
namespace {

using manager::Difference;
using manager::NodeReport;

constexpr od::Address kVelocity{0x6081, 0};
constexpr od::Address kAcceleration{0x6083, 0};
// Objects that the simulated drive stores; they cannot be mapped.
constexpr od::Address kAbortOption{0x6007, 0};
constexpr od::Address kQuickStopOption{0x605A, 0};

class ConfigurationTest : public ManagerFixture {
 protected:
  // Two drives and an encoder; two objects of the drives are configured.
  LineSeat& run(std::uint8_t restore = 0, std::uint8_t store = 0) {
    for (const std::uint8_t id : {std::uint8_t{5}, std::uint8_t{6}}) {
      line::NodeConfig node = node_of(id, "drive");
      node.objects = {{kVelocity, number(1'000)}, {kAcceleration, number(2'000)}};
      if (store != 0) {
        node.objects = {{kAbortOption, number(3, 2)}};
      }
      node.restore = restore;
      node.store = store;
      add(std::move(node), "drive");
    }
    add(node_of(7, "encoder"), "encoder");
    return start();
  }

  std::uint64_t value(std::uint8_t node, od::Address address) {
    return seat().find(node)->device->dictionary().number(address).value_or(0);
  }
  void change(std::uint8_t node, od::Address address, std::uint32_t to) {
    ASSERT_EQ(seat().find(node)->device->dictionary().write(address, number(to)), AbortCode::none);
  }

  void power_cycle(std::uint8_t node) {
    sim::Device& device = *seat().find(node)->device;
    device.kill();
    pass(1s);
    seat().frames.clear();
    device.revive(world().now());
    pass(2s);
  }

  std::uint64_t configure(std::uint16_t code, std::uint8_t node = 0, Duration timeout = 0s) {
    line::Command command{.timeout = timeout,
                          .request = line::Configure{.node = node, .apply = code == 1}};
    return execute(std::move(command));
  }
  std::uint64_t verify(std::uint8_t node = 0) { return configure(0, node); }
  std::uint64_t apply(std::uint8_t node = 0) { return configure(1, node); }

  std::vector<NodeReport> report(std::uint64_t tag) {
    const line::Reply reply = wait(tag);
    EXPECT_TRUE(reply.ok());
    const auto* const nodes = std::get_if<std::vector<NodeReport>>(&reply.data);
    EXPECT_NE(nodes, nullptr);
    return nodes == nullptr ? std::vector<NodeReport>{} : *nodes;
  }
};

// several nodes at once
TEST_F(ConfigurationTest, WhatWasConfiguredIsFoundAndVerifyingWritesNothing) {
  run();
  EXPECT_EQ(value(5, kVelocity), 1'000U);
  seat().frames.clear();
  EXPECT_EQ(report(verify()), (std::vector<NodeReport>{{.node = 5}, {.node = 6}, {.node = 7}}));
  EXPECT_TRUE(std::ranges::none_of(seat().frames, is_download));
  EXPECT_TRUE(std::ranges::any_of(seat().frames, [](const can::Frame& frame) {
    return frame.id == 0x605;
  })) << "node 5 was read";
}

TEST_F(ConfigurationTest, ADifferenceNamesObjectExpectedAndFoundAndApplyingRemovesIt) {
  run();
  change(6, kAcceleration, 77);
  const std::vector<NodeReport> found = report(verify());
  ASSERT_EQ(found.size(), 3U);
  EXPECT_TRUE(found[0].good());
  EXPECT_EQ(found[1].differences,
            (std::vector<Difference>{
                {.object = kAcceleration, .expected = number(2'000), .found = number(77)}}));
  EXPECT_EQ(report(apply(6)), (std::vector<NodeReport>{{.node = 6}}));
  EXPECT_EQ(value(6, kAcceleration), 2'000U);
  EXPECT_EQ(report(verify(6)), (std::vector<NodeReport>{{.node = 6}}));
  pass(1s);
  EXPECT_EQ(seat().line->node_state(6).state, nmt::State::operational) << "Operational again";
}

TEST_F(ConfigurationTest, ANodeThatIsSilentEndsItsOwnReportAlone) {
  run();
  seat().find(6)->device->kill();
  const std::vector<NodeReport> found = report(verify());
  ASSERT_EQ(found.size(), 3U);
  EXPECT_TRUE(found[0].good());
  EXPECT_EQ(found[1].end, AbortCode::timeout);
  EXPECT_TRUE(found[2].good());
}

TEST_F(ConfigurationTest, WhatANodeStoredIsNotSentAgain) {  // 1F26h, 1F27h
  run(0, 1);
  EXPECT_NE(value(5, {0x1020, 1}), 0U) << "1020h has a date";
  power_cycle(5);
  EXPECT_EQ(seat().line->node_state(5).state, nmt::State::operational);
  EXPECT_TRUE(std::ranges::none_of(seat().frames, is_download));
  EXPECT_EQ(value(5, kAbortOption), 3U);
  // Another configuration has another date.
  const std::vector<manager::ObjectWrite> other = {{kAbortOption, number(2, 2)}};
  ASSERT_EQ(write_own({0x1F22, 5}, manager::write_concise_dcf(other)), Error{});
  power_cycle(5);
  EXPECT_EQ(value(5, kAbortOption), 2U);
  power_cycle(5);
  EXPECT_TRUE(std::ranges::none_of(seat().frames, is_download));
}

TEST_F(ConfigurationTest, ApplyingAsksNoDate) {
  run(0, 1);
  seat().frames.clear();
  EXPECT_EQ(report(apply(5)), (std::vector<NodeReport>{{.node = 5}}));
  EXPECT_TRUE(std::ranges::any_of(seat().frames, is_download));
}

TEST_F(ConfigurationTest, RestoringBringsBackTheDefaultsOfWhatIsNotConfigured) {
  run(1, 0);
  const std::uint64_t before = value(5, kQuickStopOption);
  od::Dictionary& device = seat().find(5)->device->dictionary();
  ASSERT_EQ(device.write(kQuickStopOption, number(1, 2)), AbortCode::none);
  ASSERT_EQ(device.write({0x1010, 1}, number(0x6576'6173)), AbortCode::none);
  EXPECT_EQ(report(apply(5)), (std::vector<NodeReport>{{.node = 5}}));
  EXPECT_EQ(value(5, kQuickStopOption), before);
  EXPECT_EQ(value(5, kVelocity), 1'000U);
  EXPECT_NE(before, 1U);
}

TEST_F(ConfigurationTest, AnEntryThatIsRefusedIsNamedEverywhere) {
  run();
  const std::vector<manager::ObjectWrite> bad = {{kVelocity, number(5'000)},
                                                 {kAcceleration, number(0)}};
  ASSERT_EQ(write_own({0x1F22, 5}, manager::write_concise_dcf(bad)), Error{});
  const std::vector<NodeReport> found = report(apply(5));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].boot, 'J');
  EXPECT_EQ(found[0].end, AbortCode::value_too_low);
  EXPECT_EQ(found[0].differences, (std::vector<Difference>{{.object = kAcceleration,
                                                            .expected = number(0),
                                                            .abort = AbortCode::value_too_low}}));
  const auto event = std::ranges::find(seat().events, EventKind::configuration_error, &Event::kind);
  ASSERT_NE(event, seat().events.end());
  EXPECT_EQ(event->node, 5);
  const auto& error = std::get<event::ConfigurationError>(event->data);
  EXPECT_EQ(error.abort, AbortCode::value_too_low);
  EXPECT_EQ(error.index, 0x6083);
  EXPECT_EQ(seat().line->node_state(5).boot, 'J');
}

TEST_F(ConfigurationTest, RequestsOverTheOwnDictionaryConfigureToo) {
  run();
  change(5, kVelocity, 7);
  change(6, kVelocity, 8);
  EXPECT_EQ(write_own({0x1F25, 5}, number(1)), to_error(AbortCode::local_control));
  EXPECT_EQ(write_own({0x1F25, 9}, number(manager::kConf)), to_error(AbortCode::invalid_value));
  EXPECT_EQ(write_own({0x1F25, 5}, number(manager::kConf)), Error{});
  pass(1ms);
  EXPECT_EQ(write_own({0x1F25, 5}, number(manager::kConf)), to_error(AbortCode::device_state))
      << "the node is booting";
  pass(2s);
  EXPECT_EQ(value(5, kVelocity), 1'000U);
  EXPECT_EQ(value(6, kVelocity), 8U);
  EXPECT_EQ(write_own({0x1F25, 128}, number(manager::kConf)), Error{});
  pass(2s);
  EXPECT_EQ(value(6, kVelocity), 1'000U);
}

TEST_F(ConfigurationTest, LongOnesTellTheirProgressAndThereIsOneAtATime) {
  config().sdo_timeout = 800ms;
  run();
  seat().find(6)->device->kill();
  const std::uint64_t first = verify();
  EXPECT_EQ(wait(verify()).error, to_error(line::Refusal::busy));
  EXPECT_TRUE(wait(first).ok());
  const auto event = std::ranges::find(seat().events, EventKind::command_progress, &Event::kind);
  ASSERT_NE(event, seat().events.end());
  const auto& progress = std::get<event::CommandProgress>(event->data);
  EXPECT_EQ(progress.command, line::CommandKind::configure);
  EXPECT_LT(progress.done, progress.total);
}

TEST_F(ConfigurationTest, IsRefusedWhereItMakesNoSenseAndEndsWithItsTimeOutAndTheLine) {
  run();
  EXPECT_EQ(wait(verify(9)).error, to_error(line::Refusal::bad_request));
  seat().find(6)->device->kill();
  EXPECT_EQ(wait(configure(0, 6, 300ms)).error, to_error(line::Refusal::timed_out));
  const std::uint64_t last = verify();
  seat().line->stop(world().now());
  world().settle();
  EXPECT_EQ(wait(last).error, to_error(line::Refusal::cancelled));
  EXPECT_EQ(seat().duplicate_replies, 0U);
}

// --- PDOs that are not configured, so that the device may have stored others ---

class StoredPdoTest : public ConfigurationTest {
 protected:
  // The remapping procedure of CiA 301 7.5.2.38, by somebody else: the second object alone.
  void map_another(std::uint8_t node) {
    od::Dictionary& device = seat().find(node)->device->dictionary();
    const std::vector<std::byte> cob_id = number(0x180U + node);
    ASSERT_EQ(device.write({0x1800, 1}, number(0x8000'0180U + node)), AbortCode::none);
    ASSERT_EQ(device.write({0x1A00, 0}, number(0, 1)), AbortCode::none);
    mapped_ = value(node, {0x1A00, 1});
    ASSERT_EQ(device.write({0x1A00, 1}, number(kOther)), AbortCode::none);
    ASSERT_EQ(device.write({0x1A00, 0}, number(1, 1)), AbortCode::none);
    ASSERT_EQ(device.write({0x1800, 1}, cob_id), AbortCode::none);
  }
  void store(std::uint8_t node) {
    ASSERT_EQ(seat().find(node)->device->dictionary().write({0x1010, 1}, number(0x6576'6173)),
              AbortCode::none);
  }

  Error write(std::uint8_t node, od::Address address, std::vector<std::byte> data) {
    return wait(execute({.request =
                             line::SdoWrite{
                                 .node = node, .address = address, .data = std::move(data)}}))
        .error;
  }
  static od::VariableDescription* find(od::Address address, od::DeviceDescription& device) {
    for (od::ObjectDescription& object : device.objects) {
      for (od::VariableDescription& variable : object.variables) {
        if (object.index == address.index && variable.sub == address.sub) {
          return &variable;
        }
      }
    }
    return nullptr;
  }

  const Error kRefused = to_error(line::Refusal::image_pdo);
  static constexpr std::uint32_t kOther = 0x6061'0008;
  std::uint64_t mapped_ = 0;
};

TEST_F(StoredPdoTest, AreThoseOfTheImageAfterTheBoot) {
  run();
  map_another(6);
  store(6);
  power_cycle(6);
  EXPECT_EQ(seat().line->node_state(6).state, nmt::State::operational);
  EXPECT_EQ(value(6, {0x1A00, 1}), mapped_);
  EXPECT_NE(mapped_, kOther);
  EXPECT_TRUE(report(verify(6)).at(0).good());
}

TEST_F(StoredPdoTest, AreADifferenceOfTheConfiguration) {
  run();
  map_another(6);
  const std::vector<NodeReport> found = report(verify(6));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_FALSE(found[0].good());
  const auto entry =
      std::ranges::find(found[0].differences, od::Address{0x1A00, 1}, &Difference::object);
  ASSERT_NE(entry, found[0].differences.end());
  EXPECT_EQ(entry->found, number(kOther));
  EXPECT_TRUE(report(apply(6)).at(0).good());
  EXPECT_EQ(value(6, {0x1A00, 1}), mapped_);
}

// RPDO 2 of node 6 is not in the image, and would receive the outputs of node 5.
TEST_F(StoredPdoTest, OfAnotherNumberDoNotReceiveTheOutputsOfAnotherNode) {
  line::NodeConfig node = node_of(6, "drive");
  od::VariableDescription* const cob_id = find({0x1401, 1}, node.device);
  ASSERT_NE(cob_id, nullptr);
  cob_id->value = number(0x8000'0306);
  add(node_of(5, "drive"), "drive");
  add(std::move(node), "drive");
  start();
  od::Dictionary& device = seat().find(6)->device->dictionary();
  ASSERT_EQ(device.write({0x1401, 1}, number(0x8000'0306)), AbortCode::none);
  ASSERT_EQ(device.write({0x1401, 1}, number(0x205)), AbortCode::none);
  store(6);
  EXPECT_EQ(report(verify(6)).at(0).differences.size(), 1U);
  power_cycle(6);
  EXPECT_EQ(seat().line->node_state(6).state, nmt::State::operational);
  EXPECT_EQ(value(6, {0x1401, 1}), 0x8000'0205U);
  EXPECT_EQ(write(6, {0x1401, 1}, number(0x205)), kRefused);
  EXPECT_EQ(write(6, {0x1401, 1}, number(0x8000'0305)), Error{});
}

// The next heartbeat completes its boot process, and no other one compares its PDOs.
TEST_F(StoredPdoTest, AreNotChangedByAClientWhileErrorControlIsAwaited) {
  run();
  const std::vector<manager::ObjectWrite> none = {{{0x1017, 0}, number(0, 2)}};
  ASSERT_EQ(write_own({0x1F22, 6}, manager::write_concise_dcf(none)), Error{});
  ASSERT_EQ(report(apply(6)).at(0).boot, 'K');
  EXPECT_EQ(write(6, {0x1A00, 0}, number(0, 1)), kRefused);
}

TEST_F(StoredPdoTest, AreNotChangedByAClientUnlessTheNodeDidNotBoot) {
  run();
  const auto write = [this](od::Address address, std::vector<std::byte> data) {
    return StoredPdoTest::write(6, address, std::move(data));
  };
  const Error refused = kRefused;
  EXPECT_EQ(write({0x1800, 1}, number(0x8000'0186)), refused);
  EXPECT_EQ(write({0x1A00, 0}, number(0, 1)), refused);
  EXPECT_EQ(write({0x1400, 2}, number(1, 1)), refused);
  EXPECT_EQ(write({0x1800, 2}, number(253, 1)), refused) << "sent on request alone";
  EXPECT_EQ(write({0x1800, 2}, number(1, 1)), refused) << "there is no SYNC";
  EXPECT_EQ(write({0x1800, 2}, number(254, 1)), Error{});
  EXPECT_NE(write({0x1800, 1}, number(0x186)), refused) << "it has this value";
  EXPECT_EQ(write({0x1800, 5}, number(50, 2)), Error{}) << "the event timer changes no value";
  const std::vector<manager::ObjectWrite> bad = {{kAcceleration, number(0)}};
  ASSERT_EQ(write_own({0x1F22, 6}, manager::write_concise_dcf(bad)), Error{});
  ASSERT_EQ(report(apply(6)).at(0).boot, 'J');
  EXPECT_EQ(write({0x1800, 1}, number(0x8000'0186)), Error{}) << "the next boot compares it";
}

// The image keeps the PDOs of the device file when 1F22h is written while the line runs.
TEST_F(StoredPdoTest, OfAnotherConciseDcfAreNoneOfTheImage) {
  run();
  const std::vector<manager::ObjectWrite> other = {{{0x1800, 1}, number(0x8000'0186)},
                                                   {{0x1A00, 0}, number(0, 1)},
                                                   {{0x1A00, 1}, number(kOther)},
                                                   {{0x1A00, 0}, number(1, 1)},
                                                   {{0x1800, 1}, number(0x186)}};
  ASSERT_EQ(write_own({0x1F22, 6}, manager::write_concise_dcf(other)), Error{});
  const std::vector<NodeReport> found = report(apply(6));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].boot, 'J');
  ASSERT_EQ(found[0].differences.size(), 1U);
  EXPECT_EQ(found[0].differences[0].object.index, 0x1A00);
  EXPECT_EQ(found[0].differences[0].abort, AbortCode::none);
  pass(1s);
  EXPECT_NE(seat().line->node_state(6).state, nmt::State::operational);
}

// Its outputs would be others, and its inputs have other names.
TEST_F(StoredPdoTest, ThatAreNoneOfTheImageAreNotUsedByACommandToStartTheNode) {
  config().defaults = {{.entry = 0, .value = 1}, {.entry = 1, .value = 2}};
  run();
  const std::vector<manager::ObjectWrite> other = {
      {{0x1400, 1}, number(0x8000'0206)}, {{0x1600, 0}, number(0, 1)},
      {{0x1600, 1}, number(0x6060'0008)}, {{0x1600, 2}, number(0x6040'0010)},
      {{0x1600, 0}, number(2, 1)},        {{0x1400, 1}, number(0x206)}};
  ASSERT_EQ(write_own({0x1F22, 6}, manager::write_concise_dcf(other)), Error{});
  ASSERT_EQ(report(apply(6)).at(0).boot, 'J');
  EXPECT_TRUE(
      wait(execute({.request = line::NmtRequest{.node = 6, .command = nmt::Command::start}})).ok());
  pass(1s);
  seat().frames.clear();
  const image::Layout& outputs = seat().line->layout(image::Direction::outputs);
  for (std::uint32_t i = 0; i < outputs.entries.size(); ++i) {
    if (outputs.entries[i].node == 6) {
      const std::vector<std::byte> value = number(1, outputs.entries[i].bit_length / 8U);
      EXPECT_EQ(wait(execute({.request = line::SingleOutput{.entry = i, .data = value}})).error,
                to_error(line::Refusal::wrong_state));
    }
  }
  pass(1s);
  EXPECT_TRUE(std::ranges::none_of(seat().frames, [](const can::Frame& frame) {
    return frame.id == 0x206 || frame.id == 0x306;
  }));
  const image::Layout& inputs = seat().line->layout(image::Direction::inputs);
  for (std::uint32_t i = 0; i < inputs.entries.size(); ++i) {
    if (inputs.entries[i].node == 6) {
      EXPECT_FALSE(seat().line->input(i).valid) << inputs.entries[i].name;
    }
  }
  EXPECT_EQ(report(apply(5)).at(0).boot, manager::kBooted);
}

}  // namespace
}  // namespace linegate::plant
