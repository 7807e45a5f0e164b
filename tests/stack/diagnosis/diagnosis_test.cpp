// SPDX-License-Identifier: Apache-2.0
#include "stack/diagnosis/diagnosis.h"

#include <optional>

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"
#include "stack/diagnosis/objects.h"

namespace linegate::diagnosis {
namespace {

using manager::ManagerState;
using manager::NodeState;
using manager::Presence;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint8_t kManager = 127;
constexpr std::uint8_t kPress = 5;
constexpr std::uint8_t kLamp = 33;
constexpr std::uint8_t kStranger = 64;

od::ObjectDescription numbers(std::uint16_t index, std::size_t count, std::uint8_t sub,
                              std::uint32_t value) {
  od::ObjectDescription out{.index = index, .name = "Test", .type = od::ObjectType::array};
  for (std::size_t i = 0; i <= count; ++i) {
    od::VariableDescription variable;
    variable.sub = static_cast<std::uint8_t>(i);
    variable.type = i == 0 ? od::DataType::unsigned8 : od::DataType::unsigned32;
    variable.value.resize(od::byte_size(variable.type));
    store_le(std::span(variable.value), std::uint64_t{i == 0 ? count : i == sub ? value : 0});
    out.variables.push_back(std::move(variable));
  }
  return out;
}

od::ObjectDescription request_nmt() {
  od::ObjectDescription out{.index = 0x1F82, .name = "Request NMT", .type = od::ObjectType::array};
  for (unsigned sub = 0; sub <= 128; ++sub) {
    od::VariableDescription variable;
    variable.sub = static_cast<std::uint8_t>(sub);
    variable.type = od::DataType::unsigned8;
    variable.value = {std::byte{128}};
    out.variables.push_back(std::move(variable));
  }
  return out;
}

class DiagnosisTest : public testing::Test, public Source {
 protected:
  DiagnosisTest() {
    EXPECT_TRUE(add_objects(dictionary_).ok());
    EXPECT_TRUE(dictionary_.add(request_nmt()).ok());
    objects_.emplace(dictionary_, diagnosis_, kManager);
    log_.set_listener(&diagnosis_);
    facts_.running = true;
    facts_.manages = true;
    facts_.own = nmt::State::operational;
    facts_.starts_nodes = true;
    facts_.manager = ManagerState::running;
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      nodes_[i].node = static_cast<std::uint8_t>(i);
    }
  }

  NetworkFacts network() const override { return facts_; }
  const NodeState& node_seen(std::uint8_t node) const override { return nodes_[node]; }

  static Options options() {
    Options out{.own_node = kManager};
    out.assigned.set(kPress);
    out.assigned.set(kLamp);
    out.mandatory.set(kPress);
    return out;
  }

  void set(std::uint8_t node, nmt::State state, char boot = manager::kBooted) {
    nodes_[node].presence = Presence::present;
    nodes_[node].state = state;
    nodes_[node].boot = boot;
  }
  void all_operational() {
    set(kPress, nmt::State::operational);
    set(kLamp, nmt::State::operational);
  }
  void tell(std::uint8_t node, const EventData& data) {
    log_.emit({.time = now_, .node = node, .data = data});
    diagnosis_.update(now_);
  }
  std::uint64_t read(std::uint16_t index, std::uint8_t sub) {
    const auto value = dictionary_.read({index, sub});
    EXPECT_TRUE(value) << index << ':' << unsigned{sub};
    return value ? load_le(*value) : 0;
  }

  Instant now_{seconds(10)};
  NetworkFacts facts_;
  std::array<NodeState, 128> nodes_{};
  od::Dictionary dictionary_;
  EventLog log_;
  Diagnosis diagnosis_{options(), dictionary_, *this};
  std::optional<Objects> objects_;
};

TEST_F(DiagnosisTest, ListsOfNodesInOrder) {
  all_operational();
  EXPECT_EQ(read(0x5F01, 1), 1U << 4U);
  EXPECT_EQ(read(0x5F01, 2), 1U << 0U);
  EXPECT_EQ(read(0x5F01, 4), 0U) << "the own node is not assigned";
  EXPECT_EQ(read(0x5F02, 1), 1U << 4U);
  EXPECT_EQ(read(0x5F03, 1), 0U);
  EXPECT_EQ(read(0x5F04, 1), 1U << 4U);
  EXPECT_EQ(read(0x5F04, 2), 1U << 0U);
  EXPECT_EQ(read(0x5F04, 4), 1U << 30U) << "the own node";
  EXPECT_EQ(read(0x5F07, 1), 0U);
  diagnosis_.update(now_);
  EXPECT_EQ(read(0x5F00, 2), 0xA0U | 0x0CU);
}

TEST_F(DiagnosisTest, NodesThatAreNotAsExpectedAreFaulty) {
  all_operational();
  set(kStranger, nmt::State::pre_operational, manager::kBootUnfinished);
  EXPECT_EQ(read(0x5F03, 2), 1U << 31U) << "the node is not assigned";
  EXPECT_EQ(read(0x5F06, 2), 1U << 31U);
  for (const Presence presence : {Presence::unknown, Presence::missing}) {
    nodes_[kStranger].presence = presence;
    nodes_[kStranger].state = nmt::State::unknown;
    EXPECT_EQ(read(0x5F03, 2), 0U) << manager::name(presence);
  }
  set(kLamp, nmt::State::pre_operational, 'J');
  EXPECT_EQ(read(0x5F03, 2), 1U << 0U);
  EXPECT_EQ(read(0x5F02, 2), 0U) << "the node is not configured";
  set(kPress, nmt::State::unknown);
  nodes_[kPress].presence = Presence::missing;
  EXPECT_EQ(read(0x5F03, 1), 1U << 4U);
  EXPECT_EQ(read(0x5F04, 1), 0U) << "the state of a missing node is unknown";
}

TEST_F(DiagnosisTest, ANodeThatDoesNotObeyIsFaulty) {
  all_operational();
  diagnosis_.update(now_);
  diagnosis_.commanded(nmt::Command::stop, kLamp);
  diagnosis_.heard(kLamp, nmt::State::operational, now_ + milliseconds(10));
  EXPECT_EQ(read(0x5F03, 2), 0U) << "the command may be under way";
  diagnosis_.heard(kLamp, nmt::State::operational, now_ + milliseconds(500));
  EXPECT_EQ(read(0x5F03, 2), 1U);
  diagnosis_.heard(kLamp, nmt::State::stopped, now_ + milliseconds(600));
  EXPECT_EQ(read(0x5F03, 2), 0U);
  diagnosis_.heard(kLamp, nmt::State::operational, now_ + milliseconds(700));
  EXPECT_EQ(read(0x5F03, 2), 1U);
  tell(kLamp, event::BootUp{});
  EXPECT_EQ(read(0x5F03, 2), 0U) << "a boot-up ends the expected state";
}

TEST_F(DiagnosisTest, AnEventThatTheOwnerOfTheLineReportsNeedNotBeOfANode) {
  all_operational();
  diagnosis_.commanded(nmt::Command::stop, kLamp);
  diagnosis_.heard(kLamp, nmt::State::operational, now_ + milliseconds(500));
  for (const std::uint8_t node : {std::uint8_t{0}, std::uint8_t{128}, std::uint8_t{255}}) {
    tell(node, event::BootUp{});
    EXPECT_EQ(read(0x5F03, 1), 0U);
    EXPECT_EQ(read(0x5F03, 2), 1U);
    EXPECT_EQ(read(0x5F03, 3), 0U);
    EXPECT_EQ(read(0x5F03, 4), 0U);
  }
}

TEST_F(DiagnosisTest, EmergenciesAreCountedAndListed) {
  const emcy::Message fault{.code = 0x8110, .error_register = 0x11, .info = {}};
  diagnosis_.emergency(kLamp, fault);
  EXPECT_EQ(read(0x5F07, 2), 1U);
  EXPECT_EQ(read(0x5F10, kLamp), 1U);
  EXPECT_EQ(read(0x5F10, kPress), 0U);
  EXPECT_EQ(read(0x5F14, 0), 1U);
  const auto history = dictionary_.read({0x5F18, kLamp});
  ASSERT_TRUE(history);
  EXPECT_EQ(history->size(), 9U);
  EXPECT_EQ((*history)[2], std::byte{0x81});
  diagnosis_.emergency(kLamp, {});
  EXPECT_EQ(read(0x5F07, 2), 0U);
  EXPECT_EQ(dictionary_.read({0x5F18, kLamp})->size(), 17U);
  EXPECT_EQ(dictionary_.read({0x5F18, kPress})->size(), 1U);
  EXPECT_EQ(dictionary_.read({0x5F18, kManager}).error(), to_error(AbortCode::local_control));
}

TEST_F(DiagnosisTest, EventsAreKeptUntilTheNetworkIsInitialisedAnew) {
  all_operational();
  tell(kLamp, event::BootUp{});
  EXPECT_EQ(read(0x5F00, 1), kListChanged);
  tell(kLamp, event::HeartbeatLost{});
  EXPECT_EQ(read(0x5F00, 1), kListChanged);
  tell(kPress, event::HeartbeatLost{});
  EXPECT_EQ(read(0x5F00, 1), kListChanged | kMandatoryLost);
  const std::byte stop{4};
  EXPECT_EQ(dictionary_.write({0x1F82, kLamp}, std::span(&stop, 1)), AbortCode::none);
  EXPECT_EQ(read(0x5F00, 1), 0x8000U | kListChanged | kMandatoryLost);
  EXPECT_EQ(dictionary_.write({0x1F82, 128}, std::span(&stop, 1)), AbortCode::none);
  EXPECT_EQ(read(0x1F82, 128), 4U) << "the object of another service";
  EXPECT_EQ(read(0x5F00, 1), 0xC000U | kListChanged | kMandatoryLost);
  log_.emit({.time = now_, .data = event::ManagerState{.state = ManagerState::resetting}});
  EXPECT_EQ(read(0x5F00, 1), 0U);
}

TEST_F(DiagnosisTest, TheCommunicationStateIsThereTwice) {
  tell(0, event::FramesLost{});
  EXPECT_EQ(read(0x5F00, 2) >> 8U, kControllerOverrun);
  EXPECT_EQ(read(0x5F00, 3), kControllerOverrun);
}

TEST_F(DiagnosisTest, TheBootTimeEndsTheWaitForAMandatoryNode) {
  od::ObjectDescription boot_time{.index = 0x1F89, .name = "Boot time"};
  od::VariableDescription value;
  value.type = od::DataType::unsigned32;
  value.value.resize(4);
  store_le(std::span(value.value), std::uint64_t{2000});
  boot_time.variables.push_back(std::move(value));
  ASSERT_TRUE(dictionary_.add(boot_time).ok());
  facts_.own = nmt::State::pre_operational;
  facts_.manager = ManagerState::missing_mandatory;
  set(kLamp, nmt::State::operational);
  nodes_[kPress].boot = 'B';
  tell(0, event::ManagerState{.state = ManagerState::resetting});
  EXPECT_EQ(read(0x5F00, 2), 0x70U);
  diagnosis_.update(now_ + milliseconds(1999));
  EXPECT_EQ(read(0x5F00, 2), 0x70U);
  diagnosis_.update(now_ + milliseconds(2000));
  EXPECT_EQ(read(0x5F00, 2), 0x86U);
}

TEST_F(DiagnosisTest, TheSlaveAssignmentOfTheDictionaryCounts) {
  ASSERT_TRUE(dictionary_.add(numbers(0x1F81, 127, kStranger, 0x9)).ok());
  EXPECT_EQ(read(0x5F01, 1), 0U);
  EXPECT_EQ(read(0x5F01, 2), 1U << 31U);
  set(kStranger, nmt::State::operational, 'M');
  tell(kStranger, event::BootResult{.letter = 'M'});
  EXPECT_EQ(read(0x5F00, 1) & kMandatoryWrongNode, kMandatoryWrongNode);
}

TEST_F(DiagnosisTest, ARefusedConfigurationIsFatalUnlessTheNodeBootsAgain) {
  for (const bool boots : {false, true}) {
    tell(0, event::ManagerState{.state = ManagerState::resetting});
    tell(kLamp, event::BootResult{.letter = 'J'});
    EXPECT_EQ(diagnosis_.next_wake(), kNever) << "not mandatory";
    tell(kPress, event::BootResult{.letter = 'J'});
    EXPECT_EQ(diagnosis_.next_wake(), now_ + milliseconds(100));
    now_ += milliseconds(99);
    if (boots) {
      tell(kPress, event::BootUp{});
    }
    diagnosis_.update(now_);
    EXPECT_FALSE(diagnosis_.fatal());
    now_ += milliseconds(1);
    diagnosis_.update(now_);
    EXPECT_EQ(diagnosis_.fatal(), !boots);
    EXPECT_EQ(diagnosis_.pop_failure(), !boots);
    EXPECT_EQ(diagnosis_.next_wake(), kNever);
  }
}

TEST_F(DiagnosisTest, EachNodeHasTheWholeTimeForItsBootUpMessage) {
  tell(kPress, event::BootResult{.letter = 'J'});
  now_ += milliseconds(60);
  tell(kPress, event::BootUp{});
  tell(kPress, event::BootResult{.letter = 'J'});
  now_ += milliseconds(60);
  diagnosis_.update(now_);
  EXPECT_FALSE(diagnosis_.fatal());
  tell(0, event::ManagerState{.state = ManagerState::resetting});
  EXPECT_EQ(diagnosis_.next_wake(), kNever) << "initialised again";
  tell(kPress, event::BootResult{.letter = 'D'});
  EXPECT_TRUE(diagnosis_.fatal()) << "a restart does not change the identity";
}

TEST_F(DiagnosisTest, ANodeThatRefusesAgainAndAgainDoesNotDelayTheErrorOfAnother) {
  od::ObjectDescription assignment = numbers(0x1F81, 127, kLamp, 0x9);
  assignment.variables[kPress].value = assignment.variables[kLamp].value;
  ASSERT_TRUE(dictionary_.add(assignment).ok());
  tell(kPress, event::BootResult{.letter = 'J'});
  for (int i = 0; i < 3; ++i) {
    now_ += milliseconds(30);
    tell(kLamp, event::BootResult{.letter = 'J'});
    tell(kLamp, event::BootUp{});
    diagnosis_.update(now_);
    EXPECT_FALSE(diagnosis_.fatal());
  }
  EXPECT_EQ(diagnosis_.next_wake(), now_ + milliseconds(10));
  now_ += milliseconds(10);
  diagnosis_.update(now_);
  EXPECT_TRUE(diagnosis_.fatal());
}

TEST_F(DiagnosisTest, ASlaveListsTheNodesItListensTo) {
  facts_.manages = false;
  facts_.manager = ManagerState::inactive;
  ASSERT_TRUE(dictionary_.add(numbers(0x1016, 3, 2, kStranger << 16U | 500U)).ok());
  set(kStranger, nmt::State::stopped);
  set(1, nmt::State::operational);
  EXPECT_EQ(read(0x5F01, 2), 1U << 31U | 1U << 0U);
  EXPECT_EQ(read(0x5F05, 2), 1U << 31U);
  EXPECT_EQ(read(0x5F04, 1), 0U) << "its heartbeat is not consumed";
  EXPECT_EQ(read(0x5F02, 2), 0U);
  EXPECT_EQ(read(0x5F00, 2), 0x43U);
  tell(kPress, event::HeartbeatLost{});
  EXPECT_EQ(read(0x5F00, 1), kListChanged) << "a slave ignores losses of nodes";
}

TEST_F(DiagnosisTest, TaskTimesSayThatThereIsNoTask) {
  EXPECT_EQ(read(0x5F80, 0), 3U);
  EXPECT_EQ(read(0x5F80, 1), 0U);
  EXPECT_EQ(read(0x5F80, 2), 0U);
  EXPECT_EQ(read(0x5F80, 3), 100U);
  const std::byte value{5};
  EXPECT_EQ(dictionary_.write({0x5F80, 1}, std::span(&value, 1)), AbortCode::read_only);
}

}  // namespace
}  // namespace linegate::diagnosis
