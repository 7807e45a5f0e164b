// SPDX-License-Identifier: Apache-2.0
// Ten thousand SDO transfers over random systems of networks, while devices and clients are
// terminated: at the end every transfer has the right bytes or an abort, every channel is free, and
// every counter adds up.
#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/plant/routed_world.h"

namespace linegate::plant {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::size_t kTransfers = 10'000;
constexpr std::size_t kWorlds = 10;
constexpr std::size_t kAtOnce = 10;

struct Tally {
  std::size_t done = 0;
  std::size_t right = 0;
  std::size_t aborted = 0;
  std::size_t died = 0;  // terminated clients, whose transfers have no outcome
  std::size_t wrong = 0;
  std::size_t repeated = 0;  // written a second time
  std::size_t to_fd = 0;     // right transfers to a line of CANopen FD, and from one
  std::size_t from_fd = 0;
  std::size_t blocks = 0;
  std::size_t far = 0;  // over at least three gateways
  std::size_t on_one_node = 0;
  std::size_t kills = 0;  // terminated clients and servers, each in the middle of a transfer
  std::size_t gateways_died = 0;
  // Right, although a gateway of the shortest route was terminated all the time
  std::size_t rerouted = 0;
  std::size_t undisturbed = 0;  // without a termination or start of a gateway near it
  std::map<std::uint32_t, std::size_t> codes;
};

struct Transfer {
  std::uint32_t id = 0;
  std::size_t from = 0;     // network
  std::size_t process = 0;  // the process whose server or command is used
  std::size_t to = 0;       // network
  std::size_t last = 0;     // the last process on the route
  bool command = false;
  bool write = false;
  od::Address address;
  std::vector<std::byte> expected;
  Instant dies = kNever;
  bool client_dies = false;
  bool gateway_dies = false;
  std::size_t gateway = 0;  // process
  std::size_t dead = 0;     // terminated gateways of the shortest route
  bool quiet = false;       // no gateway was terminated or started for a while
  std::size_t changes = 0;  // value of changes_ at its beginning
};

class RoutedRun {
 public:
  RoutedRun(std::uint64_t seed, std::size_t count, std::uint32_t first_id, Tally& tally)
      : chance_(seed),
        topology_(Topology::random(5 + seed % 4, chance_)),
        world_(topology_, seed),
        left_(count),
        next_id_(first_id),
        tally_(tally) {
    choose_hot();
  }
  // With lines of CANopen FD at the ends of the routes.
  static RoutedRun with_fd(std::uint64_t seed, std::size_t count, Tally& tally) {
    std::mt19937_64 chance(seed);
    Topology topology = Topology::random(5 + seed % 4, chance);
    topology.make_leaves_fd(chance);
    return {topology, seed, count, 1, tally};
  }
  // With redundant gateways, which are terminated at random.
  RoutedRun(const Topology& topology, std::uint64_t seed, std::size_t count, Tally& tally)
      : chance_(seed),
        topology_(topology),
        world_(topology_, seed),
        left_(count),
        next_id_(1),
        redundant_(true),
        tally_(tally) {
    choose_hot();
  }
  RoutedRun(const Topology& topology, std::uint64_t seed, std::size_t count, std::uint32_t first_id,
            Tally& tally)
      : chance_(seed),
        topology_(topology),
        world_(topology_, seed),
        left_(count),
        next_id_(first_id),
        tally_(tally) {
    choose_hot();
  }

  void transfers() {
    world_.run(world_.now() + milliseconds(100));
    world_.lose(chance_() % 3 == 0 && !redundant_ ? 300 : 0);
    const Instant limit = world_.now() + seconds(redundant_ ? 6000 : 600);
    const std::size_t at_once = redundant_ ? 1 : kAtOnce;  // redundant gateways share SDO servers
    while (left_ > 0 || !active_.empty()) {
      ASSERT_LT(world_.now(), limit)
          << left_ << " left, " << active_.size() << " under way, one to " << active_.front().to
          << " by " << active_.front().process
          << (active_.front().command ? " command" : " client");
      while (left_ > 0 && active_.size() < at_once && begin()) {
      }
      world_.run(world_.now() + microseconds(500));
      kill_some();
      finish_some();
      if (std::size_t running = count_running(); running != running_) {
        running_ = running;
        ++changes_;
        changed_ = world_.now();
      }
    }
    world_.run(world_.now() + seconds(10));
  }

  // No resource is occupied, and every client still reaches every device.
  void check() {
    for (line::Line* const line : world_.lines()) {
      const routing::Counters now = line->state().routing;
      const std::string& name = line->config().name;
      EXPECT_EQ(now.open, 0U) << name;
      EXPECT_EQ(now.channels, 0U) << name;
      EXPECT_EQ(now.opened, now.finished + now.aborted + now.timed_out) << name;
      line::Reply reply;
      EXPECT_FALSE(line->pop_reply(reply)) << name << ": a second reply";
    }
    world_.lose(0);
    const std::size_t before = tally_.right;
    std::size_t asked = 0;
    for (std::size_t from = 0; from < topology_.networks; ++from) {
      for (std::size_t to = 0; to < topology_.networks; ++to) {
        if (from != to) {
          Transfer last{.id = next_id_++, .from = from, .to = to};
          last.process = topology_.way(from, to).first;
          last.last = topology_.way(from, to).last;
          choose_object(last, 0);
          last.write = false;
          last.address = {kShortRead, 1};
          last.expected = short_value(last);
          last.command = is_fd(from);
          start(last);
          world_.run(world_.now() + milliseconds(50));
          finish_some();
          ++asked;
        }
      }
    }
    EXPECT_TRUE(active_.empty());
    EXPECT_EQ(tally_.right - before, asked) << "a transfer did not end";
    tally_.right = before;
    tally_.done -= asked;
    for (const auto& [network, process] : targets()) {
      tally_.wrong += world_.device(network, process).wrong();
      tally_.repeated += world_.device(network, process).repeated();
    }
  }

 private:
  std::uint64_t below(std::uint64_t limit) { return chance_() % limit; }
  bool is_fd(std::size_t network) const { return topology_.fd.contains(network); }

  void choose_hot() {
    const std::size_t hot = chance_() % topology_.networks;
    hot_ = {hot, topology_.processes_on(hot).front()};
    running_ = count_running();
  }
  std::size_t count_running() {
    std::size_t out = 0;
    for (std::size_t process = 0; process < topology_.processes.size(); ++process) {
      out += world_.runs(process) ? 1U : 0U;
    }
    return out;
  }

  // Sometimes terminates one of the gateways on the route that has a redundant one.
  void look_at_gateways(Transfer& made) {
    made.changes = changes_;
    made.quiet = changed_ == Instant{} || world_.now() > changed_ + seconds(2);
    std::vector<std::size_t> mortal;
    for (const std::size_t process : topology_.processes_on_way(made.from, made.to)) {
      made.dead += world_.runs(process) ? 0U : 1U;
      const auto twins = topology_.twins_of(process);
      const bool last_one =
          std::ranges::none_of(twins, [&](std::size_t twin) { return world_.runs(twin); });
      if (process != made.process && world_.runs(process) && !last_one) {
        mortal.push_back(process);
      }
    }
    if (!mortal.empty() && below(4) == 0) {
      made.gateway_dies = true;
      made.gateway = mortal[below(mortal.size())];
      made.dies = world_.now() + microseconds(300 + below(8000));
    }
  }

  std::vector<std::pair<std::size_t, std::size_t>> targets() {
    std::vector<std::pair<std::size_t, std::size_t>> out;
    for (std::size_t network = 0; network < topology_.networks; ++network) {
      for (const std::size_t process : topology_.processes_on(network)) {
        out.emplace_back(network, process);
      }
    }
    return out;
  }

  // Starts a random transfer whose client is not busy. Returns false if there is none now.
  bool begin() {
    const std::size_t number = left_;
    const bool block = number % 3 == 0;
    const bool far = number % 4 == 0;
    const bool one_node = !far && number % 4 == 1;
    for (int attempt = 0; attempt < 200; ++attempt) {
      Transfer made{.id = next_id_};
      made.from = below(topology_.networks);
      made.to = one_node ? hot_.first : below(topology_.networks);
      const Topology::Way& way = topology_.way(made.from, made.to);
      const std::size_t gateways = way.gateways;
      if (gateways == 0 || (far && gateways < 3)) {
        continue;
      }
      made.process = way.first;
      made.last = way.last;
      if (one_node && made.last != hot_.second) {
        continue;
      }
      made.command = is_fd(made.from) || (!far && below(2) == 0);
      const bool busy = made.command ? false : world_.client(made.from, made.process).busy();
      if (busy || !world_.device(made.to, made.last).alive() || !world_.runs(made.process)) {
        continue;
      }
      choose_object(made, block ? 2 : below(2));
      if (redundant_) {
        look_at_gateways(made);
      } else if (number % 18 == 0 || owed_kills_ > 0) {
        made.client_dies = !made.command && below(2) == 0;
        made.dies = world_.now() + microseconds(300 + 200 * gateways + below(block ? 6000 : 1500));
        owed_kills_ += number % 18 == 0 ? 1 : 0;
        --owed_kills_;
      }
      tally_.blocks += block ? 1U : 0U;
      tally_.far += gateways >= 3 ? 1U : 0U;
      tally_.on_one_node += std::pair(made.to, made.last) == hot_ ? 1U : 0U;
      ++next_id_;
      --left_;
      start(made);
      return true;
    }
    return false;
  }

  // kind: 0 expedited, 1 segments, 2 blocks.
  void choose_object(Transfer& transfer, std::uint64_t kind) {
    const std::uint8_t node = RoutedWorld::node_of(transfer.last);
    transfer.write = below(2) == 0;
    if (kind == 0) {
      transfer.address = {transfer.write ? kShortWrite : kShortRead, 1};
      transfer.expected = transfer.write ? routed_pattern(transfer.id, 4) : short_value(transfer);
    } else if (transfer.write) {
      transfer.address = {kLongWrite, 0};
      transfer.expected =
          routed_pattern(transfer.id, kind == 1 ? 5 + below(120) : 130 + below(1800));
    } else {
      const std::size_t which = kind == 1 ? below(3) : 3 + below(3);
      transfer.address = {static_cast<std::uint16_t>(kLongRead + which), 0};
      transfer.expected = RoutedDevice::long_value(transfer.to, node, kLongSizes[which]);
    }
  }

  std::vector<std::byte> short_value(const Transfer& transfer) {
    std::vector<std::byte> out(4);
    store_le(out.data(),
             RoutedDevice::short_value(transfer.to, RoutedWorld::node_of(transfer.last)));
    return out;
  }

  void start(const Transfer& transfer) {
    const auto network = static_cast<std::uint16_t>(transfer.to + 1);
    const std::uint8_t node = RoutedWorld::node_of(transfer.last);
    if (transfer.command) {
      const bool as_device = transfer.id % 2 == 0;
      line::Request request = line::NetworkRead{
          .network = network, .node = node, .address = transfer.address, .as_device = as_device};
      if (transfer.write) {
        request = line::NetworkWrite{.network = network,
                                     .node = node,
                                     .address = transfer.address,
                                     .as_device = as_device,
                                     .data = transfer.expected};
      }
      world_.line(transfer.process, transfer.from)
          .execute({.tag = transfer.id, .request = std::move(request)}, world_.now());
    } else {
      ForeignClient::Job job{
          .network = network, .node = node, .address = transfer.address, .write = transfer.write};
      job.transfer =
          transfer.expected.size() >= 130 ? sdo::Transfer::block : sdo::Transfer::segmented;
      job.data = transfer.write ? transfer.expected : std::vector<std::byte>{};
      world_.client(transfer.from, transfer.process).start(std::move(job), world_.now());
    }
    world_.touch(transfer.from);
    active_.push_back(transfer);
  }

  void kill_some() {
    std::erase_if(active_, [&](Transfer& transfer) {
      if (transfer.dies > world_.now()) {
        return false;
      }
      transfer.dies = kNever;
      if (transfer.gateway_dies) {
        ++tally_.gateways_died;
        world_.kill_process(transfer.gateway, world_.now() + milliseconds(4000 + below(4000)));
        return false;
      }
      if (!transfer.client_dies && !world_.device(transfer.to, transfer.last).alive()) {
        ++owed_kills_;
        return false;
      }
      ++tally_.kills;
      if (!transfer.client_dies) {
        world_.kill(transfer.to, transfer.last, world_.now() + milliseconds(100 + below(900)));
        return false;
      }
      world_.client(transfer.from, transfer.process).die();
      ++tally_.died;
      ++tally_.done;
      return true;
    });
  }

  void finish_some() {
    for (line::Line* const line : world_.lines()) {
      line::Reply reply;
      while (line->pop_reply(reply)) {
        const auto it = std::ranges::find_if(
            active_, [&](const Transfer& t) { return t.command && t.id == reply.tag; });
        ASSERT_NE(it, active_.end());
        EXPECT_NE(reply.error.domain, Domain::command);
        judge(*it, {.abort = static_cast<AbortCode>(reply.error.code), .data = reply.bytes()});
        active_.erase(it);
      }
    }
    std::erase_if(active_, [&](const Transfer& transfer) {
      sdo::Outcome outcome;
      if (transfer.command || !world_.client(transfer.from, transfer.process).take(outcome)) {
        return false;
      }
      judge(transfer, outcome);
      return true;
    });
  }

  void judge(const Transfer& transfer, const sdo::Outcome& outcome) {
    ++tally_.done;
    owed_kills_ += transfer.dies != kNever ? 1 : 0;  // it ended before its termination
    // While a gateway waits for a terminated one, the gateways before it wait, too: with two
    // terminated gateways on one route there may be no time left for the redundant gateway of the
    // second.
    if (redundant_ && transfer.quiet && transfer.changes == changes_ &&
        count_running() == running_ && transfer.dead < 2) {
      ++tally_.undisturbed;
      EXPECT_EQ(outcome.abort, AbortCode::none)
          << "from " << transfer.from << " to " << transfer.to << ", dead: " << transfer.dead;
      tally_.rerouted += transfer.dead != 0 && outcome.abort == AbortCode::none ? 1U : 0U;
    }
    if (outcome.abort != AbortCode::none) {
      ++tally_.aborted;
      ++tally_.codes[static_cast<std::uint32_t>(outcome.abort)];
      return;
    }
    const bool right = transfer.write
                           ? world_.device(transfer.to, transfer.last).has_stored(transfer.id)
                           : outcome.data == transfer.expected;
    ++(right ? tally_.right : tally_.wrong);
    tally_.to_fd += right && is_fd(transfer.to) ? 1U : 0U;
    tally_.from_fd += right && is_fd(transfer.from) ? 1U : 0U;
  }

  std::mt19937_64 chance_;
  Topology topology_;
  RoutedWorld world_;
  std::size_t left_;
  std::uint32_t next_id_;
  std::pair<std::size_t, std::size_t> hot_;  // network and process of one frequently used node
  std::vector<Transfer> active_;
  int owed_kills_ = 0;
  bool redundant_ = false;
  std::size_t running_ = 0;  // number of processes
  std::size_t changes_ = 0;  // number of terminations and starts of processes
  Instant changed_{};        // time of the last change
  Tally& tally_;
};

std::uint64_t seed_of_run() {
  const char* const wanted = std::getenv("LINEGATE_PLANT_SEED");
  return wanted != nullptr ? std::strtoull(wanted, nullptr, 0) : 1;
}

TEST(RoutedPlant, TenThousandTransfersEndRightOrWithAnAbortAndNothingLeaks) {
  const std::uint64_t seed = seed_of_run();
  std::cout << "seed " << seed << std::endl;
  Tally tally;
  for (std::size_t world = 0; world < kWorlds; ++world) {
    SCOPED_TRACE("LINEGATE_PLANT_SEED=" + std::to_string(seed) + ", world " +
                 std::to_string(world));
    RoutedRun run(seed * kWorlds + world, kTransfers / kWorlds,
                  static_cast<std::uint32_t>(1 + world * 100'000), tally);
    run.transfers();
    if (HasFatalFailure()) {
      return;
    }
    run.check();
  }
  std::cout << tally.right << " right, " << tally.aborted << " aborted, " << tally.died
            << " without a client; " << tally.blocks << " in blocks, " << tally.far
            << " over three gateways and more, " << tally.on_one_node << " on one node, "
            << tally.kills << " killed\n";
  for (const auto& [code, count] : tally.codes) {
    std::cout << count << " x " << describe(static_cast<AbortCode>(code)) << '\n';
  }
  EXPECT_EQ(tally.wrong, 0U);
  EXPECT_EQ(tally.repeated, 0U);
  EXPECT_EQ(tally.done, kTransfers);
  EXPECT_EQ(tally.right + tally.aborted + tally.died, kTransfers);
  EXPECT_GE(tally.right, kTransfers / 2);
  EXPECT_GE(tally.blocks, kTransfers / 3 - kWorlds);
  EXPECT_GE(tally.far, kTransfers / 4);
  EXPECT_GE(tally.on_one_node, kTransfers / 5);
  EXPECT_GE(tally.kills, 500U);
}

TEST(RoutedPlant, TransfersFromAndToLinesOfCanopenFdEndRightOrWithAnAbortOnce) {
  const std::uint64_t seed = seed_of_run();
  constexpr std::size_t kSystems = 6;
  constexpr std::size_t kOfEach = 500;
  Tally tally;
  for (std::size_t number = 0; number < kSystems; ++number) {
    SCOPED_TRACE("LINEGATE_PLANT_SEED=" + std::to_string(seed) + ", plant " +
                 std::to_string(number));
    RoutedRun run = RoutedRun::with_fd(seed * kSystems + number, kOfEach, tally);
    run.transfers();
    if (HasFatalFailure()) {
      return;
    }
    run.check();
  }
  std::cout << tally.right << " right (" << tally.to_fd << " to FD, " << tally.from_fd
            << " from FD), " << tally.aborted << " aborted, " << tally.died << " without a client, "
            << tally.kills << " killed\n";
  for (const auto& [code, count] : tally.codes) {
    std::cout << count << " x " << describe(static_cast<AbortCode>(code)) << '\n';
  }
  EXPECT_EQ(tally.wrong, 0U);
  EXPECT_EQ(tally.repeated, 0U);
  EXPECT_EQ(tally.done, kSystems * kOfEach);
  EXPECT_EQ(tally.right + tally.aborted + tally.died, tally.done);
  EXPECT_GE(tally.right, tally.done / 2);
  EXPECT_GE(tally.to_fd, tally.done / 10);
  EXPECT_GE(tally.from_fd, tally.done / 10);
  EXPECT_GE(tally.kills, 100U);
}

// Gateways are terminated, some in the middle of a transfer; the routes over them fail, and the
// next routes are used.
TEST(RoutedPlant, AnotherGatewayStandsInForOneThatHasDied) {
  const std::uint64_t seed = seed_of_run();
  constexpr std::size_t kSystems = 3;
  constexpr std::size_t kOfEach = 200;
  Tally tally;
  for (std::size_t number = 0; number < kSystems; ++number) {
    SCOPED_TRACE("LINEGATE_PLANT_SEED=" + std::to_string(seed) + ", plant " +
                 std::to_string(number));
    std::mt19937_64 chance(seed * kSystems + number);
    RoutedRun run(Topology::redundant(5 + number, chance), seed * kSystems + number, kOfEach,
                  tally);
    run.transfers();
    if (HasFatalFailure()) {
      return;
    }
    run.check();
  }
  std::cout << tally.right << " right, " << tally.aborted << " aborted; " << tally.gateways_died
            << " gateways died, " << tally.rerouted << " right by another one, "
            << tally.undisturbed << " undisturbed\n";
  EXPECT_EQ(tally.wrong, 0U);
  EXPECT_EQ(tally.done, kSystems * kOfEach);
  EXPECT_EQ(tally.right + tally.aborted, tally.done);
  EXPECT_GE(tally.gateways_died, 25U);
  EXPECT_GE(tally.rerouted, 40U);
}

// Every network receives it, at most once from each gateway, and then no more frames are sent.
TEST(RoutedPlant, AnEmcyInALoopOfGatewaysReachesEveryNetworkAndSettles) {
  for (std::size_t networks = 3; networks <= 8; ++networks) {
    SCOPED_TRACE(networks);
    const Topology topology = Topology::ring(networks);
    RoutedWorld world(topology, networks);
    world.run(world.now() + milliseconds(100));
    constexpr unsigned kEmcys = 20;
    constexpr std::uint32_t kEmcyId = 0x080;
    const auto emcys = [&](std::size_t network) {
      return world.frames(network, kEmcyId, 0x780) - world.frames(network, kEmcyId, 0x7FF);
    };
    for (unsigned i = 0; i < kEmcys; ++i) {
      const auto number = static_cast<std::uint8_t>(i);
      world.send(0, 0, can::make_frame(kEmcyId + 1, {0x10, number, 1, 2, 3, 4, 5, 6}));
      world.run(world.now() + milliseconds(20));
    }
    world.run(world.now() + seconds(1));
    std::vector<std::uint64_t> heard;
    EXPECT_EQ(emcys(0), kEmcys) << "no EMCY returns to its network";
    for (std::size_t network = 1; network < networks; ++network) {
      heard.push_back(emcys(network));
      EXPECT_GE(heard.back(), kEmcys) << network;
      EXPECT_LE(heard.back(), 2 * kEmcys) << network << ": at most one from each gateway";
    }
    world.run(world.now() + seconds(60));
    for (std::size_t network = 1; network < networks; ++network) {
      EXPECT_EQ(emcys(network), heard[network - 1]) << network << ": EMCYs circulate";
    }
  }
}

}  // namespace
}  // namespace linegate::plant
