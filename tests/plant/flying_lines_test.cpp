// SPDX-License-Identifier: Apache-2.0
// Several lines on one bus as flying masters (CiA 302-2), and one of another manufacturer.
#include <algorithm>
#include <cstdio>
#include <random>

#include <gtest/gtest.h>

#include "tests/plant/environment.h"
#include "tests/plant/flying_world.h"

namespace linegate::plant {
namespace {

using namespace std::chrono_literals;
using line::OutputRefusal;

OutputRefusal write_flying_outputs(line::Line& line, std::uint64_t arming, Instant now) {
  const image::Layout& layout = line.layout(image::Direction::outputs);
  line::OutputWrite write{.layout_id = layout.id, .arming = arming};
  for (std::uint32_t i = 0; i < layout.entries.size(); ++i) {
    const auto length = static_cast<std::uint8_t>((layout.entries[i].bit_length + 7) / 8);
    write.values.push_back({.entry = i, .length = length, .data = {std::byte{1}}});
  }
  return line.write_outputs(write, now);
}

std::uint8_t operational_nodes(const line::Line& line) {
  return line.state().nodes_operational;
}

TEST(FlyingLines, TheSecondTakesOverWhenTheFirstDies) {
  FlyingWorld world({.lines = {{.node = 20, .priority = 1}, {.node = 21, .priority = 1}}});
  world.pass(5s);
  ASSERT_EQ(world.wrong_masters(), "") << world.describe();
  ASSERT_TRUE(world.is_master(0));
  EXPECT_EQ(operational_nodes(world.line(0)), 2);
  EXPECT_EQ(operational_nodes(world.line(1)), 2) << "the slave observes the nodes";
  EXPECT_EQ(world.line(1).state().active_master, 20);
  EXPECT_EQ(world.line(1).dictionary().number({0x1016, 1}), 20U << 16U | 400U);
  EXPECT_EQ(write_flying_outputs(world.line(0), 1, world.now()), OutputRefusal::none);
  EXPECT_EQ(write_flying_outputs(world.line(1), 1, world.now()), OutputRefusal::wrong_role);
  const std::uint64_t layout = world.line(1).layout(image::Direction::inputs).id;

  world.kill(0);
  world.pass(world.bound());
  EXPECT_TRUE(world.is_master(1));
  EXPECT_EQ(world.line(1).layout(image::Direction::inputs).id, layout);
  world.pass(3s);
  EXPECT_EQ(operational_nodes(world.line(1)), 2);
  EXPECT_TRUE(world.line(1).input(0).valid);
  EXPECT_EQ(write_flying_outputs(world.line(1), 1, world.now()), OutputRefusal::none);

  world.revive(0);
  world.pass(world.bound());
  EXPECT_TRUE(world.is_master(1)) << "the same priority: it follows";
  EXPECT_EQ(world.line(0).state().active_master, 21);
  EXPECT_EQ(world.failure(), "");
}

TEST(FlyingLines, AHigherPriorityTakesTheRoleOver) {
  FlyingWorld world({.lines = {{.node = 20, .priority = 0}, {.node = 21, .priority = 2}}});
  world.kill(0);
  world.pass(world.bound() + 2s);
  ASSERT_TRUE(world.is_master(1));
  EXPECT_EQ(write_flying_outputs(world.line(1), 7, world.now()), OutputRefusal::none);
  world.revive(0);
  world.pass(world.bound());
  EXPECT_TRUE(world.is_master(0)) << world.describe();
  EXPECT_EQ(world.wrong_masters(), "");
  EXPECT_EQ(write_flying_outputs(world.line(1), 7, world.now()), OutputRefusal::wrong_role);
  world.pass(3s);
  EXPECT_EQ(operational_nodes(world.line(0)), 2);
  world.kill(0);
  world.pass(world.bound());
  EXPECT_EQ(write_flying_outputs(world.line(1), 7, world.now()), OutputRefusal::not_armed);
  EXPECT_EQ(write_flying_outputs(world.line(1), 8, world.now()), OutputRefusal::none);
  EXPECT_EQ(world.failure(), "");
}

TEST(FlyingLines, AKeepAliveNodeIsTakenOverWithoutReset) {
  FlyingWorld world(
      {.lines = {{.node = 20, .priority = 1}, {.node = 21, .priority = 1}}, .keep_alive = true});
  world.pass(5s);
  ASSERT_TRUE(world.is_master(0)) << world.describe();
  ASSERT_EQ(operational_nodes(world.line(0)), 2);
  const std::uint64_t resets = world.device(1).node().counters().resets;
  const std::uint64_t others = world.device(0).node().counters().resets;
  world.kill(0);
  world.pass(world.bound() + 3s);
  ASSERT_TRUE(world.is_master(1));
  EXPECT_EQ(operational_nodes(world.line(1)), 2);
  EXPECT_EQ(world.line(1).node_state(6).boot, 'L');
  EXPECT_EQ(world.device(1).node().counters().resets, resets);
  EXPECT_GT(world.device(0).node().counters().resets, others);
  EXPECT_EQ(world.failure(), "");
}

TEST(FlyingLines, TwoPartsAreJoined) {
  FlyingWorld world({.lines = {{.node = 20, .priority = 1}, {.node = 21, .priority = 1}}});
  world.pass(5s);
  world.connect(0, false);
  world.pass(world.bound());
  EXPECT_EQ(world.wrong_masters(), "");
  EXPECT_TRUE(world.is_master(0));
  EXPECT_TRUE(world.is_master(1));
  world.connect(0, true);
  world.pass(world.bound());
  EXPECT_EQ(world.wrong_masters(), "") << world.describe();
  EXPECT_TRUE(world.is_master(0)) << "the lower node-ID";
  world.pass(5s);
  EXPECT_EQ(operational_nodes(world.line(0)), 2);
  EXPECT_EQ(world.failure(), "");
}

TEST(FlyingLines, ALineThatNoticesTheCutComesBackWithoutAReset) {
  for (const CutEnd cut : {CutEnd::acknowledgement, CutEnd::bus_off}) {
    FlyingWorld world({.lines = {{.node = 20, .priority = 1}, {.node = 21, .priority = 1}},
                       .sync = true,
                       .defaults = true,
                       .cut = cut});
    world.pass(8s);
    ASSERT_TRUE(world.is_master(0));
    const std::uint64_t resets = world.resets();
    world.connect(1, false);
    world.pass(20s);
    EXPECT_FALSE(world.is_master(1)) << world.describe();
    world.connect(1, true);
    world.pass(world.bound() + 5s);
    EXPECT_TRUE(world.is_master(0)) << world.describe();
    EXPECT_EQ(world.line(1).state().active_master, 20);
    EXPECT_EQ(world.resets(), resets) << "the line that was cut off";

    world.connect(0, false);
    world.pass(20s);
    ASSERT_TRUE(world.is_master(1));
    EXPECT_FALSE(world.is_master(0));
    const std::uint64_t after = world.resets();
    EXPECT_GT(after, resets) << "a new master";
    world.connect(0, true);
    world.pass(world.bound() + 5s);
    EXPECT_TRUE(world.is_master(1)) << world.describe();
    EXPECT_EQ(world.resets(), after) << "the master that was cut off";
    EXPECT_EQ(world.failure(), "");
  }
}

// A short time without a bus, or without the processor.
TEST(FlyingLines, AMasterThatIsLateKeepsItsRole) {
  for (int phase = 0; phase < 24; ++phase) {
    FlyingWorld world({.lines = {{.node = 20, .priority = 1}, {.node = 21, .priority = 1}},
                       .cut = CutEnd::acknowledgement,
                       .master_heartbeat = 2s});
    world.pass(8s + phase * 100ms);
    ASSERT_TRUE(world.is_master(0));
    const std::uint64_t resets = world.resets();
    world.pause(0, 800ms);
    world.pass(3s);
    EXPECT_TRUE(world.is_master(0)) << world.describe();
    EXPECT_EQ(world.line(1).state().active_master, 20);
    EXPECT_EQ(world.resets(), resets) << "the pause, phase " << phase;
    EXPECT_EQ(world.failure(), "");
  }
}

// Cut and joined at random times, in each state of the line that is cut off.
TEST(FlyingLines, CutsOfOthersNeitherResetNorReplaceTheMaster) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    std::mt19937_64 random(seed);
    const auto ms = [&random](unsigned below) {
      return std::chrono::milliseconds(static_cast<long>(random() % below));
    };
    FlyingWorld world({.lines = {{.node = 20, .priority = 1},
                                 {.node = 21, .priority = 1},
                                 {.node = 22, .priority = 2}},
                       .sync = seed % 2 == 0,
                       .defaults = seed % 3 == 0,
                       .cut = seed % 4 < 2 ? CutEnd::acknowledgement : CutEnd::bus_off});
    world.pass(8s);
    ASSERT_TRUE(world.is_master(0));
    const std::uint64_t resets = world.resets();
    for (int i = 0; i < 8; ++i) {
      const std::size_t which = 1 + random() % 2;
      world.connect(which, false);
      world.pass(ms(random() % 2 == 0 ? 700 : 8000));
      world.connect(which, true);
      world.pass(ms(random() % 2 == 0 ? 700 : 4000));
    }
    world.pass(world.bound());
    ASSERT_TRUE(world.is_master(0)) << "seed " << seed << world.describe();
    ASSERT_EQ(world.wrong_masters(), "") << "seed " << seed;
    ASSERT_EQ(world.resets(), resets) << "seed " << seed;
    ASSERT_EQ(world.failure(), "") << "seed " << seed;
  }
}

TEST(FlyingLines, AForeignMasterIsFollowedAndReplaced) {
  FlyingWorld world({.lines = {{.node = 20, .priority = 1}},
                     .foreign = FlyingPlan::Master{.node = 30, .priority = 0}});
  world.pass(5s);
  EXPECT_TRUE(world.is_master(1));
  EXPECT_EQ(world.wrong_masters(), "");
  world.kill(1);
  world.pass(world.bound() + 3s);
  EXPECT_TRUE(world.is_master(0));
  EXPECT_EQ(operational_nodes(world.line(0)), 2);
  world.revive(1);
  world.pass(world.bound());
  EXPECT_TRUE(world.is_master(1));
  EXPECT_EQ(world.wrong_masters(), "");
  EXPECT_EQ(world.failure(), "");
}

line::Reply result_of(FlyingWorld& world, std::size_t station, line::Request request) {
  world.line(station).execute({.tag = 1, .timeout = 20s, .request = std::move(request)},
                              world.now());
  line::Reply reply;
  for (int i = 0; i < 200 && !world.line(station).pop_reply(reply); ++i) {
    world.pass(100ms);
  }
  return reply;
}

std::size_t connections_of(FlyingWorld& world, std::size_t station) {
  const line::Reply reply = result_of(world, station, line::ConnectionList{});
  const auto* const table = std::get_if<line::SdoConnections>(&reply.data);
  return table == nullptr ? 0 : table->size();
}

bool is_connected(FlyingWorld& world) {
  const auto valid = [&world](std::size_t device, std::uint16_t channel) {
    return (*world.device(device).dictionary().number({channel, 1}) >> 31U) == 0;
  };
  return valid(0, FlyingWorld::kClientChannel) || valid(1, FlyingWorld::kServerChannel);
}

// The new master resets the nodes, which ends the connections that the former one has made.
TEST(FlyingLines, ConnectionsAreOfTheActiveMaster) {
  FlyingWorld world(
      {.lines = {{.node = 20, .priority = 0}, {.node = 21, .priority = 1}}, .connects = true});
  world.kill(0);
  world.pass(world.bound() + 3s);
  ASSERT_TRUE(world.is_master(1)) << world.describe();
  ASSERT_TRUE(result_of(world, 1, line::ConnectionOpen{.node = 5, .server = 6}).ok());
  ASSERT_TRUE(is_connected(world));
  world.revive(0);
  world.pass(world.bound() + 3s);
  ASSERT_TRUE(world.is_master(0)) << world.describe();
  EXPECT_FALSE(is_connected(world));
  EXPECT_EQ(connections_of(world, 0), 0U);
  const line::Reply refused = result_of(world, 1, line::ConnectionOpen{.node = 5, .server = 6});
  EXPECT_EQ(refused.error, to_error(line::Refusal::wrong_role));
  EXPECT_EQ(refused.bytes(), std::vector{std::byte{20}});
  ASSERT_TRUE(result_of(world, 0, line::ConnectionOpen{.node = 5, .server = 6}).ok());
  EXPECT_TRUE(is_connected(world));
  world.kill(0);
  world.pass(world.bound() + 3s);
  ASSERT_TRUE(world.is_master(1)) << world.describe();
  EXPECT_FALSE(is_connected(world));
  EXPECT_EQ(connections_of(world, 1), 0U) << "that of before is released";
  EXPECT_EQ(world.failure(), "");
}

// CANopen FD has the NMT of CANopen, by classical frames.
TEST(FlyingLines, MastersOfCanopenFdTakeTurns) {
  FlyingWorld world({.lines = {{.node = 20, .priority = 1}, {.node = 21, .priority = 1}},
                     .keep_alive = true,
                     .fd = true});
  world.pass(5s);
  ASSERT_TRUE(world.is_master(0)) << world.describe();
  EXPECT_EQ(operational_nodes(world.line(0)), 2);
  EXPECT_EQ(operational_nodes(world.line(1)), 2);
  EXPECT_EQ(write_flying_outputs(world.line(0), 1, world.now()), OutputRefusal::none);
  EXPECT_EQ(write_flying_outputs(world.line(1), 1, world.now()), OutputRefusal::wrong_role);
  world.pass(100ms);
  EXPECT_TRUE(world.line(1).input(0).valid);
  const std::uint64_t resets = world.device(1).node().counters().resets;
  world.kill(0);
  world.pass(world.bound() + 3s);
  ASSERT_TRUE(world.is_master(1)) << world.describe();
  EXPECT_EQ(operational_nodes(world.line(1)), 2);
  EXPECT_EQ(world.device(1).node().counters().resets, resets) << "kept alive";
  EXPECT_EQ(write_flying_outputs(world.line(1), 1, world.now()), OutputRefusal::none);
  world.revive(0);
  world.pass(world.bound());
  EXPECT_EQ(world.wrong_masters(), "") << world.describe();
  EXPECT_EQ(world.failure(), "");
}

// One random network with faults; returns what was wrong.
class RandomFlyingLines {
 public:
  explicit RandomFlyingLines(std::uint64_t seed) : random_(seed), world_(plan()) {}

  std::string run() {
    loss_ = below(3) == 0 ? 0 : below(200);
    const Instant faults_end = world_.now() + time_below(15'000);
    world_.set_disturbance([this, faults_end](const can::Frame& /*frame*/, auto /*sender*/) {
      const bool lost = world_.now() < faults_end && below(1000) < loss_;
      last_fault_ = lost ? world_.now() : last_fault_;
      return lost ? sim::Fate::lost : sim::Fate::delivered;
    });
    last_fault_ = world_.now();
    while (world_.now() < faults_end) {
      world_.run(std::min(faults_end, world_.now() + time_below(below(2) == 0 ? 300 : 5000)));
      fault();
      write_somewhere();
    }
    return judge();
  }

 private:
  std::uint64_t below(std::uint64_t limit) { return random_() % limit; }
  Duration time_below(std::uint64_t ms) {
    return std::chrono::milliseconds(static_cast<long>(below(ms)));
  }

  FlyingPlan plan() {
    FlyingPlan out;
    const std::size_t lines = 1 + below(3);
    for (std::size_t i = 0; i < lines; ++i) {
      out.lines.push_back({.node = static_cast<std::uint8_t>(20 + 10 * i + below(10)),
                           .priority = static_cast<std::uint8_t>(below(3)),
                           .forces = below(4) == 0});
    }
    if (below(2) == 0) {
      out.foreign = FlyingPlan::Master{.node = static_cast<std::uint8_t>(60 + below(10)),
                                       .priority = static_cast<std::uint8_t>(below(3))};
    }
    out.keep_alive = below(2) == 0;
    out.fd = below(4) == 0;
    out.sync = below(2) == 0;
    out.defaults = below(2) == 0;
    out.cut = static_cast<CutEnd>(below(3));
    return out;
  }

  void fault() {
    last_fault_ = world_.now();
    const std::size_t which = below(world_.stations());
    switch (below(6)) {
      case 4:
        if (world_.alive(which) && !world_.is_foreign(which)) {
          const Duration pause = time_below(1500);
          world_.pause(which, pause);
          last_fault_ += pause;
        }
        return;
      case 0:
        world_.kill(which);
        return;
      case 1:
        if (!world_.alive(which)) {
          world_.revive(which);
        }
        return;
      case 2:
        world_.connect(which, false);
        return;
      case 3:
        world_.connect(which, true);
        return;
      default:
        for (std::size_t i = 0; i < world_.stations(); ++i) {
          if (world_.is_master(i)) {
            world_.kill(i);
          }
        }
    }
  }

  void write_somewhere() {
    const std::size_t which = below(plan_lines());
    if (world_.alive(which)) {
      const bool may = world_.line(which).state().role == line::Role::manager;
      const OutputRefusal refusal =
          write_flying_outputs(world_.line(which), ++arming_, world_.now());
      if ((refusal == OutputRefusal::none) != may) {
        wrong_ = "a write was " + std::string(line::describe(refusal)) + world_.describe();
      }
    }
  }

  // An NMT start that is lost is not repeated, but reported.
  bool are_operational(std::size_t station) {
    return std::ranges::all_of(FlyingWorld::kDevices, [&](std::uint8_t device) {
      const line::NodeState seen = world_.line(station).node_state(device);
      return seen.state == nmt::State::operational ||
             (loss_ != 0 && seen.boot == manager::kNotStarted);
    });
  }

  std::size_t plan_lines() const {
    std::size_t out = 0;
    while (out < world_.stations() && !world_.is_foreign(out)) {
      ++out;
    }
    return out;
  }

  std::string judge() {
    world_.run(last_fault_ + world_.bound());
    for (int i = 0; i < 60; ++i) {
      if (std::string text = world_.wrong_masters(); !text.empty()) {
        return text + world_.describe();
      }
      write_somewhere();
      world_.pass(100ms);
    }
    for (std::size_t i = 0; i < plan_lines(); ++i) {
      if (world_.is_master(i) && world_.connected(i) && !are_operational(i)) {
        return "the nodes are not Operational" + world_.describe();
      }
    }
    return world_.failure().empty() ? wrong_ : world_.failure();
  }

  std::mt19937_64 random_;
  FlyingWorld world_;
  std::uint64_t loss_ = 0;
  std::uint64_t arming_ = 0;
  Instant last_fault_{};
  std::string wrong_;
};

// LINEGATE_PLANT_SEED and LINEGATE_PLANT_COUNT select other networks, as for the random plants.
TEST(FlyingLines, RandomNetworksHaveOneMasterInTheEnd) {
  const auto [first, count] = seeds_of_run(20260401, 200);
  std::printf("random flying lines: %lu from seed %lu on\n", count, first);
  for (unsigned long seed = first; seed < first + count; ++seed) {
    ASSERT_EQ(RandomFlyingLines(seed).run(), "") << "seed " << seed;
  }
}

}  // namespace
}  // namespace linegate::plant
