// SPDX-License-Identifier: Apache-2.0
// Invariant: whatever clients request, the heartbeats and SYNC of the line are sent in time,
// another client is answered within twice its unloaded time, and the frames that the requests cause
// stay within the shares in every interval, those of procedures included. flood_kinds_test.cpp has
// a flood of each kind of request.
#include "tests/plant/request_flood.h"

#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace linegate::plant {
namespace {

// 5,000 a second of each kind, for 10 s.
TEST_F(RequestFlood, OfEachKindCostsNoHeartbeatAndNoSync) {
  const Duration unloaded = longest_answer(2s, [] {});
  const Duration loaded = longest_answer(10s, [&] {
    (void)request(kHostile, line::NmtRequest{.node = 5, .command = nmt::Command::start});
    (void)request(kHostile, line::CanSend{.frame = urgent_frame()});
    (void)request(kHostile, line::SdoRead{.node = 5, .address = {0x1000, 0}});
    (void)request(kHostile, line::SdoRead{.node = 6, .address = {0x1018, 1}});
    write_outputs(kHostile, ++value_);
  });
  EXPECT_GT(unloaded, Duration::zero());
  EXPECT_LE(loaded, 2 * unloaded) << loaded.count() << " ns, unloaded " << unloaded.count();
  expect_services_in_time();
  EXPECT_GT(busy_, 150'000U);
  ASSERT_FALSE(reports_.empty());
  EXPECT_LE(reports_.size(), 2U);
  for (const event::ClientLimited& report : reports_) {
    EXPECT_EQ(report.client, kHostile);
    EXPECT_GT(report.refused, 0U);
    EXPECT_GT(report.replaced, 0U);
  }
}

// A flood of one kind alone, on each service.
TEST_F(RequestFlood, OfOneKindCostsNoHeartbeatAndNoSync) {
  const Duration unloaded = longest_answer(1s, [] {});
  const std::vector<line::Request> kinds{
      line::NmtRequest{.node = 5, .command = nmt::Command::start},
      line::CanSend{.frame = urgent_frame()},
      line::SdoRead{.node = 6, .address = {0x1018, 2}},
      line::EmcySend{.code = 0x1000},
      line::PdoTrigger{.node = 5, .number = 1},
  };
  for (const line::Request& kind : kinds) {
    const Duration loaded = longest_answer(2s, [&] { (void)request(kHostile, kind); });
    EXPECT_LE(loaded, 2 * unloaded) << name(line::kind(kind)) << ' ' << loaded.count() << " ns";
  }
  const Duration loaded = longest_answer(2s, [&] { write_outputs(kHostile, ++value_); });
  EXPECT_LE(loaded, 2 * unloaded) << loaded.count() << " ns";
  expect_services_in_time();
}

// Segmented transfers with several devices at once would fill the bus: each sends its next frame
// as soon as it was answered.
TEST_F(RequestFlood, LongTransfersAreSlowedDown) {
  std::uint64_t frames = 0;
  const std::size_t before = seat().frames.size();
  const Instant begin = world().now();
  (void)longest_answer(5s, [&] {
    (void)request(kHostile, line::SdoRead{.node = 5, .address = {0x1008, 0}});
    (void)request(kHostile, line::SdoRead{.node = 7, .address = {0x1008, 0}});
  });
  for (std::size_t i = before; i < seat().frames.size(); ++i) {
    const std::uint32_t id = seat().frames[i].id;
    frames += id == 0x605 || id == 0x585 || id == 0x607 || id == 0x587 ? 1U : 0U;
  }
  const auto bits = static_cast<double>(frames) * 122;
  const double seconds = std::chrono::duration<double>(world().now() - begin).count();
  EXPECT_LE(bits, kBitRate * 0.15 * (seconds + 0.05) + 4 * 122);
  EXPECT_GE(bits, kBitRate * 0.15 * seconds * 0.8) << "the share can be used";
  expect_services_in_time();
}

// --- procedures ----------------------------------------------------------------------------------

struct Procedure {
  const char* name;
  line::Request request;
  std::uint8_t node = 5;  // whose frames are counted
  bool resets = false;    // the node
  // Frames that it sends at least, one after the other, of those that the share permits, in %
  std::uint64_t least = 0;
};

class FloodOfProcedures : public RequestFlood, public testing::WithParamInterface<Procedure> {};

// 5,000 a second, for 10 s.
TEST_P(FloodOfProcedures, StaysWithinTheShareOfTheClient) {
  const Procedure& procedure = GetParam();
  const Duration unloaded = longest_answer(2s, [] {});
  begin_here();
  const Duration loaded = longest_answer(10s, [&] { (void)request(kHostile, procedure.request); });
  EXPECT_LE(loaded, 2 * unloaded) << loaded.count() << " ns, unloaded " << unloaded.count();
  expect_services_in_time(procedure.resets ? procedure.node : std::uint8_t{0});
  EXPECT_LE(burst_at(kClientRate, {procedure.node}), kMostAhead);
  EXPECT_GT(busy_ + seat().replies.size(), 40'000U);
}

// One after the other, so that no refused command uses the share.
TEST_P(FloodOfProcedures, UsesTheShareOfTheClient) {
  const Procedure& procedure = GetParam();
  const Duration unloaded = longest_answer(2s, [] {});
  begin_here();
  const Duration loaded = longest_answer(5s, [&] { repeat(procedure.request); });
  EXPECT_LE(loaded, 2 * unloaded) << loaded.count() << " ns, unloaded " << unloaded.count();
  expect_services_in_time(procedure.resets ? procedure.node : std::uint8_t{0});
  EXPECT_LE(burst_at(kClientRate, {procedure.node}), kMostAhead);
  EXPECT_GE(frames_of_flood_, kClientRate * 5 / 122 * procedure.least / 100);
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, FloodOfProcedures,
    testing::Values(Procedure{"boot", line::Boot{.node = 5}, 5, true, 20},
                    Procedure{"reset",
                              line::NmtRequest{.node = 5, .command = nmt::Command::reset_node}, 5,
                              true, 20},
                    Procedure{"compare", line::Configure{.node = 5}, 5, false, 50},
                    Procedure{"configure", line::Configure{.node = 5, .apply = true}, 5, true, 5},
                    Procedure{"scan", line::Scan{.node = 5}, 5, false, 50},
                    Procedure{"program", long_program(), 7, true, 80},
                    Procedure{"lss",
                              line::LssRequest{.procedure = lss::Procedure::switch_global,
                                               .arguments = {std::byte{0}}},
                              0, false, 50},
                    Procedure{"fastscan", line::LssRequest{.procedure = lss::Procedure::fastscan},
                              0, false, 1}),
    [](const auto& each) { return std::string(each.param.name); });

// A scan of all node-IDs, most of which do not answer.
TEST_F(RequestFlood, AScanOfAllNodesStaysWithinTheShare) {
  const Duration unloaded = longest_answer(2s, [] {});
  begin_here();
  const Duration loaded = longest_answer(10s, [&] { (void)request(kHostile, line::Scan{}); });
  EXPECT_LE(loaded, kWithATransfer * unloaded)
      << loaded.count() << " ns, unloaded " << unloaded.count();
  expect_services_in_time();
  std::set<std::uint32_t> scanned;
  for (std::uint32_t node = 1; node <= can::kMaxNodeId; ++node) {
    if (node != 6) {  // the other client reads it
      scanned.insert(node);
    }
  }
  EXPECT_LE(burst_at(kClientRate, scanned), kMostAhead);
}

// All procedures at once, with transfers and outputs, of one client.
TEST_F(RequestFlood, ProceduresOfAllKindsStayWithinTheShare) {
  const Duration unloaded = longest_answer(2s, [] {});
  begin_here();
  const line::ProgramDownload program = long_program();
  bool loads = false;
  const Duration loaded = longest_answer(10s, [&] {
    if (!std::exchange(loads, true)) {
      (void)request(kHostile, program);
    }
    (void)request(kHostile, line::Boot{.node = 5});
    (void)request(kHostile, line::Configure{.node = 6});
    (void)request(kHostile, line::Scan{.node = 6});
    (void)request(kHostile, line::SdoRead{.node = 5, .address = {0x1018, 1}});
    (void)request(kHostile, line::LssRequest{.procedure = lss::Procedure::inquire_node_id});
  });
  EXPECT_LE(loaded, kWithATransfer * unloaded)
      << loaded.count() << " ns, unloaded " << unloaded.count();
  EXPECT_LE(longest_gap(0x080), kSync + 5ms);
  EXPECT_LE(longest_gap(can::kErrorControlBase + 6), kHeartbeat + 10ms);
  EXPECT_LE(burst_at(kClientRate, {5, 7}), kMostAhead);
}

// What Linegate does on its own is not slowed down by a flood: a node that was switched off and on
// is booted as fast as on a quiet line.
TEST_F(RequestFlood, ARecoveryIsNotSlowedDown) {
  const auto recovery = [&](auto flood) {
    sim::Device& device = *seat().find(7)->device;
    device.kill();
    for (const Instant end = world().now() + 1s; world().now() < end;) {
      flood();
      tick();
    }
    device.revive(world().now());
    const Instant revived = world().now();
    while (world().now() < revived + 10s &&
           seat().line->node_state(7).state != nmt::State::operational) {
      flood();
      tick();
    }
    return world().now() - revived;
  };
  const Duration quiet = recovery([] {});
  const Duration flooded = recovery([&] {
    (void)request(kHostile, line::Scan{});
    (void)request(kHostile, line::Boot{.node = 5});
    (void)request(kHostile, line::SdoRead{.node = 6, .address = {0x1018, 1}});
  });
  EXPECT_LT(quiet, 10s);
  EXPECT_LE(flooded, quiet + 20ms);
}

class FloodOfManyClients : public RequestFlood,
                           public testing::WithParamInterface<std::uint32_t> {};

// Each client sends 5,000 requests a second. The other one uses less than its part of the share.
TEST_P(FloodOfManyClients, DelaysNoClientThatUsesLessThanItsPart) {
  const std::uint32_t clients = GetParam();
  // The time in which its part pays for the two frames of a read.
  constexpr std::int64_t kParts = kBitRate * 30 / 100 * 3 / 4;
  const Duration of_part = Duration(1s) * (2 * 122) * std::int64_t{clients + 1} / kParts;
  const Duration period = std::max<Duration>(50ms, of_part + 5ms);
  const Duration unloaded = longest_answer(2s, [] {});
  std::uint32_t turn = 0;
  const auto flood = [&] {
    ++turn;
    for (std::uint32_t i = 0; i < clients; ++i) {
      switch ((turn + i) % 5) {
        case 0:
          (void)request(10 + i, line::NmtRequest{.node = 5, .command = nmt::Command::start});
          break;
        case 1:
          (void)request(10 + i, line::CanSend{.frame = urgent_frame()});
          break;
        case 2:
          (void)request(10 + i, line::Scan{.node = 7});
          break;
        default:
          (void)request(10 + i, line::SdoRead{.node = static_cast<std::uint8_t>(5 + i % 3),
                                              .address = {0x1018, 1}});
      }
    }
  };
  // They begin together: until each has used its credit, they are served in turns.
  for (const Instant end = world().now() + 5s; world().now() < end;) {
    flood();
    tick();
  }
  const Duration loaded = longest_answer(10s, flood, period);
  EXPECT_LE(loaded, 2 * unloaded) << loaded.count() << " ns, unloaded " << unloaded.count();
  expect_services_in_time();
  constexpr std::int64_t kLineRate = kBitRate * 30 / 100;
  EXPECT_LE(burst_at(kLineRate, {5, 6, 7}), kLineRate / 20 + 8 * 122);
}

INSTANTIATE_TEST_SUITE_P(Clients, FloodOfManyClients, testing::Values(1U, 3U, 10U, 63U));

// These tests see what they are to see: with the whole bus as share a flood exceeds the limits.
class FloodOfTheWholeBus : public RequestFlood {
 protected:
  FloodOfTheWholeBus()
      : RequestFlood({.bit_rates = {.nominal = kBitRate}, .share = 1000, .client_share = 1000}) {}
};

TEST_F(FloodOfTheWholeBus, IsAheadOfTheShare) {
  for (const line::Request& each :
       {line::Request(long_program()), line::Request(line::Scan{.node = 5}),
        line::Request(line::LssRequest{.procedure = lss::Procedure::switch_global,
        .arguments = {std::byte{0}}})}) {
    begin_here();
    for (const Instant end = world().now() + 3s; world().now() < end;) {
      repeat(each);
      tick();
    }
    EXPECT_GT(burst_at(kClientRate, {5, 7}), 2 * kMostAhead) << name(line::kind(each));
  }
}

}  // namespace
}  // namespace linegate::plant
