// SPDX-License-Identifier: Apache-2.0
#include "stack/lss/assigner.h"

#include <algorithm>
#include <memory>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "tests/stack/lss/slaves.h"

namespace linegate::lss {
namespace {

using namespace std::chrono_literals;
using testing::Subject;

constexpr Address address_of(std::uint32_t product, std::uint32_t serial) {
  return {0x4C47, product, 0x10000, serial};
}
Known known(std::uint32_t product) {
  return {0x4C47, product, 0x10000, std::nullopt};
}
Known known(std::uint32_t product, std::uint32_t serial) {
  return {0x4C47, product, 0x10000, serial};
}

struct Nodes final : AssignerHost {
  bool is_present(std::uint8_t node) const override { return present.contains(node); }
  bool is_watched(std::uint8_t node) const override { return watched.contains(node); }
  std::set<std::uint8_t> present;
  std::set<std::uint8_t> watched;
  std::set<std::uint8_t> used;  // by devices that are not monitored
  std::vector<int> checks;
};

// Slaves and a master on a bus that loses each frame with the same probability.
class Assignment : public ::testing::Test {
 protected:
  Subject& add(const Address& address, Settings kept = {}) {
    return *slaves.emplace_back(std::make_unique<Subject>(kept, address));
  }
  void make(std::vector<Candidate> candidates, AssignerOptions options = {}) {
    assigner.emplace(std::move(candidates), options, nodes);
  }
  Answer ask(const Request& request) {
    Master master;
    master.start(request);
    can::Frame frame;
    ++services;
    while (master.next_frame(frame, Instant{0ms})) {
      ++frames;
      const bool gone = lost(random);
      for (const auto& subject : slaves) {
        if (gone) {
          break;
        }
        subject->slave.receive(frame, subject->out);
        can::Frame answer;
        while (subject->out.pop(answer)) {
          heard.push_back(answer);
        }
      }
    }
    for (const can::Frame& answer : std::exchange(heard, {})) {
      if (!lost(random)) {
        master.receive(answer);
      }
    }
    for (const auto& subject : slaves) {
      if (subject->slave.pop_reset()) {
        subject->slave.reset(false);
      }
    }
    master.advance(Instant{10s});
    return master.take().value();
  }
  // Executes a round and returns the reported verdicts with their nodes.
  std::vector<std::pair<Verdict, int>> round() {
    std::vector<std::pair<Verdict, int>> out;
    assigner->begin();
    while (assigner->active()) {
      if (const auto node = assigner->node_to_check()) {
        nodes.checks.push_back(*node);
        assigner->checked(!nodes.used.contains(*node));
        continue;
      }
      assigner->answered(ask(assigner->request()));
      while (const auto finding = assigner->take()) {
        out.emplace_back(finding->verdict, finding->node);
      }
      if (services > 50'000) {
        ADD_FAILURE() << "the round does not end";
        break;
      }
    }
    return out;
  }
  int node_id(std::size_t slave) const { return slaves[slave]->slave.active_node_id(); }
  bool nobody_in_configuration() const {
    return std::ranges::all_of(
        slaves, [](const auto& subject) { return subject->slave.state() == SlaveState::waiting; });
  }

  Nodes nodes;
  std::vector<std::unique_ptr<Subject>> slaves;
  std::optional<Assigner> assigner;
  std::vector<can::Frame> heard;
  std::bernoulli_distribution lost{0.0};
  std::mt19937 random{1};
  int services = 0;
  int frames = 0;
};

using Told = std::vector<std::pair<Verdict, int>>;

TEST_F(Assignment, OneQuestionWhereNobodyIsWithoutANodeId) {
  add(address_of(1, 1), {.node_id = 5});
  make({{.node = 5, .address = known(1, 1)}});
  EXPECT_EQ(round(), Told{});
  EXPECT_EQ(services, 3) << "switch global twice, and a fastscan request";
  EXPECT_EQ(frames, 4);
}

TEST_F(Assignment, ByTheWholeAddress) {
  add(address_of(1, 501));
  add(address_of(1, 502));
  make({{.node = 6, .address = known(1, 502)}, {.node = 5, .address = known(1, 501)}});
  EXPECT_EQ(round(), (Told{{Verdict::given, 6}, {Verdict::given, 5}}));
  EXPECT_EQ(node_id(0), 5);
  EXPECT_EQ(node_id(1), 6);
  EXPECT_TRUE(nobody_in_configuration());
  EXPECT_EQ(slaves[0]->slave.persistent().node_id, kNoNodeId) << "stored only if configured";
}

TEST_F(Assignment, ByWhatIsKnownOfTheIdentity) {
  add(address_of(1, 0xDEAD));
  add(address_of(2, 0xBEEF));
  make({{.node = 5, .address = known(1)}, {.node = 6, .address = known(2)}});
  EXPECT_EQ(round(), (Told{{Verdict::given, 5}, {Verdict::given, 6}}));
  EXPECT_EQ(node_id(0), 5);
  EXPECT_EQ(node_id(1), 6);
}

TEST_F(Assignment, ADeviceThatHasANodeIdKeepsIt) {
  add(address_of(1, 501), {.node_id = 9});
  add(address_of(1, 502));
  make({{.node = 5, .address = known(1, 501)}, {.node = 6, .address = known(1, 502)}});
  EXPECT_EQ(round(), (Told{{Verdict::given, 6}}));
  EXPECT_EQ(node_id(0), 9);
}

TEST_F(Assignment, StoresAndSetsTheBitTimingWhereAsked) {
  Subject& device = add(address_of(1, 501));
  make({{.node = 5, .address = known(1, 501)}}, {.store = true, .bit_timing = 3});
  EXPECT_EQ(round(), (Told{{Verdict::given, 5}}));
  EXPECT_EQ(device.slave.persistent(), (Settings{.node_id = 5, .bit_timing = 3}));
}

TEST_F(Assignment, WhatADeviceRefusesIsToldAndItHasItsNodeId) {
  add(address_of(1, 501)).host.result = StoreResult::failed;
  add(address_of(1, 502));
  make({{.node = 5, .address = known(1, 501)}}, {.store = true});
  EXPECT_EQ(round().front(), (std::pair{Verdict::not_stored, 5}));
  EXPECT_EQ(assigner->found().front().error, kMediumFailed);
  EXPECT_EQ(node_id(0), 5);
  make({{.node = 6, .address = known(1, 502)}}, {.bit_timing = 0});
  EXPECT_EQ(round(), (Told{{Verdict::bit_timing_refused, 6}}));
  EXPECT_EQ(node_id(1), 6);
}

TEST_F(Assignment, AStrangerIsToldOnceAndTheNextOneToo) {
  add(address_of(7, 1));
  add(address_of(7, 2));
  make({{.node = 5, .address = known(1, 501)}});
  EXPECT_EQ(round(), (Told{{Verdict::unknown_device, 0}, {Verdict::unknown_device, 0}}));
  EXPECT_EQ(round(), Told{});
  EXPECT_EQ(assigner->found().size(), 0U) << "switched by its known address";
  add(address_of(1, 501));
  EXPECT_EQ(round(), (Told{{Verdict::given, 5}})) << "foreign devices hide no node";
  EXPECT_TRUE(nobody_in_configuration());
}

// The slave of CANopenNode also answers fastscan in configuration state.
TEST_F(Assignment, ASlaveThatAnswersInConfigurationEndsTheSearchAndIsToldOnce) {
  add(address_of(7, 1)).slave.set_faults({.answers_in_configuration = true});
  add(address_of(1, 501));
  add(address_of(2, 9));
  make({{.node = 5, .address = known(1, 501)}, {.node = 6, .address = known(2)}});
  const Told first = round();
  EXPECT_EQ(first, (Told{{Verdict::given, 5},
                         {Verdict::given, 6},
                         {Verdict::unknown_device, 0},
                         {Verdict::answers_in_configuration, 0}}));
  EXPECT_LT(services, 1000);
  EXPECT_TRUE(nobody_in_configuration());
  services = 0;
  add(address_of(1, 502));
  EXPECT_LE(round().size(), 1U) << "at most the new device is reported";
  EXPECT_EQ(round(), Told{});
  EXPECT_LT(services, 1000);
}

// Another slave with the same device type is also checked for this behaviour, which it does not
// have.
TEST_F(Assignment, ASlaveThatAnswersInConfigurationBesideOneOfItsTypeEndsTheSearch) {
  add(address_of(7, 1));
  add(address_of(7, 2)).slave.set_faults({.answers_in_configuration = true});
  make({});
  EXPECT_EQ(round(), (Told{{Verdict::unknown_device, 0},
                           {Verdict::unknown_device, 0},
                           {Verdict::answers_in_configuration, 0}}));
  EXPECT_LT(services, 1000);
}

TEST_F(Assignment, ASlaveThatAnswersInConfigurationHidesNoKnownLateComer) {
  add(address_of(7, 1)).slave.set_faults({.answers_in_configuration = true});
  make({{.node = 5, .address = known(1, 501)}});
  (void)round();
  add(address_of(1, 501));
  const Told late = round();
  EXPECT_EQ(std::ranges::count(late, std::pair{Verdict::given, 5}), 1);
  EXPECT_EQ(node_id(1), 5);
}

TEST_F(Assignment, ANodeIdInUseIsNotGivenAndHoldsUpNobody) {
  add(address_of(1, 501));
  add(address_of(2, 601));
  add(address_of(3, 701));
  make({{.node = 5, .address = known(1, 501)},
        {.node = 6, .address = known(2)},
        {.node = 7, .address = known(3)}});
  nodes.used = {5, 6};
  EXPECT_EQ(
      round(),
      (Told{{Verdict::node_id_not_free, 5}, {Verdict::node_id_not_free, 6}, {Verdict::given, 7}}));
  EXPECT_EQ(nodes.checks, (std::vector{5, 6, 7})) << "each node-ID is checked once";
  EXPECT_EQ(node_id(0), kNoNodeId);
  EXPECT_EQ(node_id(1), kNoNodeId);
  EXPECT_EQ(node_id(2), 7);
  EXPECT_TRUE(nobody_in_configuration());
  EXPECT_EQ(round(), Told{}) << "reported once";
  nodes.used = {};
  EXPECT_EQ(round(), (Told{{Verdict::given, 5}, {Verdict::given, 6}}));
  EXPECT_TRUE(nobody_in_configuration());
}

TEST_F(Assignment, NoNodeIdIsCheckedThatNobodyIsGiven) {
  add(address_of(7, 1));
  add(address_of(1, 501), {.node_id = 5});
  make({{.node = 5, .address = known(1, 501)}, {.node = 6, .address = known(2)}});
  round();
  EXPECT_EQ(nodes.checks, std::vector<int>{});
}

TEST_F(Assignment, ASlaveThatTakesNoNodeIdStarvesNobody) {
  add(address_of(2, 1)).slave.set_faults({.takes_no_node_id = true});
  add(address_of(2, 2));
  add(address_of(3, 3));
  make({{.node = 5, .address = known(2)}, {.node = 6, .address = known(3)}});
  EXPECT_EQ(round(), (Told{{Verdict::no_answer, 5}, {Verdict::given, 5}, {Verdict::given, 6}}));
  EXPECT_LT(services, 1500);
  EXPECT_EQ(node_id(1), 5);
  EXPECT_EQ(node_id(2), 6);
}

TEST_F(Assignment, ASlaveThatAnswersInConfigurationHidesNoOtherIdentity) {
  add(address_of(1, 1)).slave.set_faults({.answers_in_configuration = true});
  add(address_of(1, 2));
  make({{.node = 4, .address = known(1)},
        {.node = 5, .address = known(1)},
        {.node = 6, .address = known(2)}});
  (void)round();
  add(address_of(2, 9));
  const Told late = round();
  EXPECT_EQ(std::ranges::count(late, std::pair{Verdict::given, 6}), 1);
  EXPECT_EQ(node_id(2), 6);
  EXPECT_LT(services, 3000);
}

TEST_F(Assignment, SeveralNodesOfOneIdentityAreToldApartByWhoIsThere) {
  add(address_of(1, 1));
  make({{.node = 5, .address = known(1)}, {.node = 6, .address = known(1)}});
  EXPECT_EQ(round(), (Told{{Verdict::ambiguous, 0}}));
  EXPECT_EQ(node_id(0), kNoNodeId);
  nodes.present = {5};
  EXPECT_EQ(round(), (Told{{Verdict::given, 6}}));
  EXPECT_EQ(node_id(0), 6);
}

TEST_F(Assignment, ASecondDeviceOfOneIdentityDoesNotGetTheSameNodeId) {
  add(address_of(1, 1));
  add(address_of(1, 2));
  make({{.node = 5, .address = known(1)}});
  const Told told = round();
  ASSERT_GE(told.size(), 2U);
  EXPECT_EQ(told[0], (std::pair{Verdict::given, 5}));
  EXPECT_EQ(told[1], (std::pair{Verdict::node_id_in_use, 5}));
  EXPECT_EQ(std::ranges::count(std::vector{node_id(0), node_id(1)}, 5), 1);
}

TEST_F(Assignment, NodesThatAreWatchedAreLeftAlone) {
  Subject& working = add(address_of(1, 501), {.node_id = 5});
  add(address_of(1, 502));
  nodes.present = nodes.watched = {5};
  make({{.node = 5, .address = known(1, 501)}, {.node = 6, .address = known(1, 502)}});
  EXPECT_EQ(round(), (Told{{Verdict::given, 6}}));
  EXPECT_EQ(working.slave.state(), SlaveState::waiting);
}

TEST_F(Assignment, OthersAreSearchedForWhenTheNodesHaveHadTheirTurn) {
  add(address_of(7, 1));
  make({{.node = 5, .address = known(1, 501)}});
  assigner->begin();
  EXPECT_FALSE(assigner->nodes_done());
  int before = 0;
  while (assigner->active() && !assigner->nodes_done()) {
    assigner->answered(ask(assigner->request()));
    ++before;
  }
  EXPECT_EQ(before, 6) << "before the search for other devices";
  assigner->end_early();
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(assigner->request().service, Service::switch_global);
    assigner->answered(ask(assigner->request()));
  }
  EXPECT_FALSE(assigner->active());
  EXPECT_TRUE(nobody_in_configuration());
}

// With any losses, two devices never have the same node-ID, and eventually every device has its
// node-ID.
TEST_F(Assignment, OnABusThatLosesFramesNobodyGetsTheNodeIdOfAnother) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    slaves.clear();
    services = 0;
    random.seed(seed);
    std::vector<Candidate> candidates;
    for (std::uint32_t i = 0; i < 6; ++i) {
      add(address_of(i / 2, 500 + i));
      candidates.push_back({.node = static_cast<std::uint8_t>(i + 1),
                            .address = i < 4 ? known(i / 2, 500 + i) : Known{}});
    }
    candidates.resize(4);
    make(candidates, {.store = true});
    lost = std::bernoulli_distribution(0.01);
    for (int i = 0; i < 20; ++i) {
      round();
    }
    lost = std::bernoulli_distribution(0.0);
    round();
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_EQ(node_id(i), static_cast<int>(i + 1)) << "seed " << seed;
    }
    EXPECT_EQ(node_id(4), kNoNodeId);
    EXPECT_TRUE(nobody_in_configuration());
  }
}

}  // namespace
}  // namespace linegate::lss
