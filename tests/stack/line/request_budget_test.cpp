// SPDX-License-Identifier: Apache-2.0
// Invariant: whatever clients request, what they may send stays within the share of the line and of
// each client, and a client within its share is not delayed by one beyond it.
#include "stack/line/request_budget.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::line {
namespace {

using namespace std::chrono_literals;
using Admission = RequestBudget::Admission;
using Put = RequestBudget::Put;

constexpr std::uint32_t kBitRate = 125'000;
constexpr std::int64_t kFullFrame = 122;  // bits: 47 + 64, and 10 % of stuff bits

class RequestBudgetTest : public testing::Test {
 protected:
  void SetUp() override { pass(1s); }

  void pass(Duration time) {
    now += time;
    budget.advance(now);
  }
  Put put(std::uint32_t client, Request request, Duration timeout = {}) {
    Command command{.tag = ++tags, .timeout = timeout, .request = std::move(request)};
    command.client = client;
    return budget.put(command, now);
  }
  // The next command, 0 if there is none.
  std::uint64_t next() { return budget.next(admitted, now) ? admitted.command.tag : 0; }
  // How many commands each client may send now.
  std::map<std::uint32_t, unsigned> drain() {
    std::map<std::uint32_t, unsigned> out;
    while (next() != 0) {
      ++out[admitted.command.client];
    }
    return out;
  }
  // Uses up the account, and fills the queue.
  void exhaust(std::uint32_t client) {
    for (int i = 0; i < 2; ++i) {
      while (put(client, CanSend{.frame = full()}) == Put::queued) {
      }
      (void)drain();
    }
    while (put(client, CanSend{.frame = full()}) == Put::queued) {
    }
  }
  static can::Frame full() {
    can::Frame frame;
    frame.id = 0x7E0;
    frame.length = 8;
    return frame;
  }
  static OutputWrite write(std::uint32_t client, std::uint16_t group, std::uint64_t arming) {
    OutputWrite out{.group = group, .arming = arming};
    out.values.push_back({.entry = group, .length = 1});
    out.client_number = client;
    return out;
  }
  // Entry n is in PDO n + 1.
  void set_outputs(std::size_t entries, bool event_driven = true) {
    image::Layout layout;
    for (std::size_t i = 0; i < entries; ++i) {
      image::Entry entry;
      entry.bit_offset = static_cast<std::uint32_t>(8 * i);
      entry.bit_length = 8;
      entry.local_pdo = static_cast<std::uint16_t>(i + 1);
      layout.entries.push_back(entry);
    }
    budget.set_outputs(layout, std::vector<bool>(entries, event_driven));
  }

  RequestBudget budget{{.bit_rates = {.nominal = kBitRate}}};
  RequestBudget::Admitted admitted;
  Instant now{};
  std::uint64_t tags = 0;
};

TEST_F(RequestBudgetTest, ABitOnTheBusIsCountedWithItsShareOfStuffBits) {
  EXPECT_EQ(bits_on_bus({.length = 8}), kFullFrame);
  EXPECT_EQ(bits_on_bus({.length = 0}), 51);
  EXPECT_EQ(bits_on_bus({.length = 8, .flags = can::Frame::kExtended}), 144);
}

TEST_F(RequestBudgetTest, AnFdFrameIsCountedWithItsLengthAndTheBitRateOfItsData) {
  constexpr std::uint8_t kSwitched = can::Frame::kFd | can::Frame::kBitRateSwitch;
  const BitRates rates{.nominal = 1'000'000, .data = 5'000'000};
  EXPECT_EQ(bits_on_bus({.length = 64, .flags = kSwitched}, rates), (30 + 110) * 11 / 10);
  EXPECT_EQ(bits_on_bus({.length = 8, .flags = kSwitched}, rates), (30 + 20) * 11 / 10);
  EXPECT_EQ(bits_on_bus({.length = 17, .flags = kSwitched}, rates),
            bits_on_bus({.length = 20, .flags = kSwitched}, rates));
  EXPECT_EQ(bits_on_bus({.length = 64, .flags = can::Frame::kFd}, rates), (30 + 549) * 11 / 10);
  EXPECT_EQ(bits_on_bus({.length = 64, .flags = kSwitched}), (30 + 549) * 11 / 10);
  EXPECT_EQ(bits_on_bus({.length = 8}, rates), kFullFrame);
  EXPECT_EQ(bits_on_bus({.length = 0, .flags = kSwitched | can::Frame::kExtended}, rates),
            (50 + 7) * 11 / 10);
}

// USDO frames of both lengths use up the same bits.
TEST_F(RequestBudgetTest, TransfersOfAnFdLineAreCountedByTheLengthOfTheirFrames) {
  const BitRates rates{.nominal = 125'000, .data = 500'000};
  const auto bits_until_refused = [&](std::uint8_t length) {
    RequestBudget fd({.bit_rates = rates, .canopen_fd = true});
    fd.advance(now);
    const can::Header frame{.length = length,
                            .flags = can::Frame::kFd | can::Frame::kBitRateSwitch};
    std::int64_t bits = 0;
    do {
      fd.count(1, frame);
      bits += bits_on_bus(frame, rates);
    } while (fd.permits(1, false));
    return bits;
  };
  const std::int64_t burst = std::int64_t{125'000} * 15 / 100 * 25 / 1000;
  for (const std::uint8_t length : {std::uint8_t{6}, std::uint8_t{64}}) {
    const std::int64_t bits = bits_until_refused(length);
    EXPECT_GE(bits, burst) << int{length};
    EXPECT_LE(bits, burst + 250) << int{length};
  }
}

TEST_F(RequestBudgetTest, OutputsOfAnFdLineAreCountedByTheLengthOfTheirPdos) {
  image::Layout layout;  // PDO 1 has 64 bytes, PDO 2 has one
  for (std::uint32_t i = 0; i < 65; ++i) {
    image::Entry entry;
    entry.bit_offset = 8 * i;
    entry.bit_length = 8;
    entry.local_pdo = i < 64 ? 1 : 2;
    layout.entries.push_back(entry);
  }
  const auto writes_until_held = [&](std::uint32_t entry) {
    RequestBudget fd({.bit_rates = {.nominal = 125'000, .data = 500'000}, .canopen_fd = true});
    fd.advance(now);
    fd.set_outputs(layout, std::vector<bool>(65, true));
    OutputWrite one{.values = {{.entry = entry, .length = 1}}};
    one.client_number = 1;
    int count = 0;
    for (; fd.admits(one) == Admission::now; ++count) {
      fd.applied(one);
    }
    return count;
  };
  const int of_long = writes_until_held(0);
  const int of_short = writes_until_held(64);
  EXPECT_GT(of_long, 0);
  EXPECT_GT(of_short, 3 * of_long);
}

// NMT and EMCY are classical frames on lines of CANopen FD, too.
TEST_F(RequestBudgetTest, CommandsOfAnFdLineAreCountedByTheLengthOfTheirFrames) {
  const auto cost_of = [&](bool emcy_fd, Request request) {
    RequestBudget fd({.bit_rates = {.nominal = 125'000}, .canopen_fd = true, .emcy_fd = emcy_fd});
    fd.advance(now);
    int count = 0;
    Command command{.tag = 1, .request = std::move(request)};
    command.client = 1;
    for (; count < 1000; ++count) {
      Command next = command;
      if (fd.put(next, now) != Put::queued || !fd.next(admitted, now)) {
        break;
      }
    }
    return count;
  };
  const int of_write = cost_of(false, SingleOutput{});
  const int of_nmt = cost_of(false, NmtRequest{});
  EXPECT_GT(of_write, 0);
  EXPECT_GT(of_nmt, 3 * of_write);
  EXPECT_EQ(cost_of(false, EmcySend{}), of_nmt);
  EXPECT_LT(cost_of(true, EmcySend{}), of_nmt) << "20 bytes";
  EXPECT_GT(cost_of(true, EmcySend{}), of_write);
}

// Three clients send 5,000 frames a second each, for 10 s, in steps of 1 ms.
TEST_F(RequestBudgetTest, FloodsStayWithinTheShares) {
  std::map<std::uint32_t, std::int64_t> sent;
  for (int ms = 0; ms < 10'000; ++ms) {
    for (std::uint32_t client = 1; client <= 3; ++client) {
      for (int i = 0; i < 5; ++i) {
        (void)put(client, CanSend{.frame = full()});
      }
    }
    for (const auto& [client, frames] : drain()) {
      sent[client] += frames * kFullFrame;
    }
    pass(1ms);
  }
  constexpr std::int64_t kTime = 10'000 + 50;  // ms, with the burst
  constexpr std::int64_t kLine = kBitRate * 30 / 100 * kTime / 1000;
  const std::int64_t all = sent[1] + sent[2] + sent[3];
  EXPECT_LE(all, kLine + kFullFrame);
  EXPECT_GE(all, kLine * 98 / 100) << "the share is used";
  for (const auto& [client, bits] : sent) {
    EXPECT_NEAR(static_cast<double>(bits), static_cast<double>(all) / 3, 3.0 * kFullFrame)
        << "clients take turns: " << client;
  }
}

TEST_F(RequestBudgetTest, OneClientDoesNotGetMoreThanItsOwnShare) {
  std::int64_t sent = 0;
  for (int ms = 0; ms < 10'000; ++ms) {
    for (int i = 0; i < 5; ++i) {
      (void)put(1, CanSend{.frame = full()});
    }
    sent += drain()[1] * kFullFrame;
    pass(1ms);
  }
  constexpr std::int64_t kOwn = kBitRate * 15 / 100 * 10'050 / 1000;
  EXPECT_LE(sent, kOwn + kFullFrame);
  EXPECT_GE(sent, kOwn * 98 / 100);
}

TEST_F(RequestBudgetTest, AClientWithinItsShareIsNotDelayedByAFlood) {
  for (int ms = 0; ms < 1'000; ++ms) {
    for (int i = 0; i < 5; ++i) {
      (void)put(1, NmtRequest{.node = 5});
    }
    (void)drain();
    if (ms % 100 == 99) {
      ASSERT_EQ(put(2, NmtRequest{.node = 6}), Put::queued);
      const std::uint64_t tag = tags;
      bool executed = false;
      while (const std::uint64_t got = next()) {
        executed |= got == tag;
      }
      EXPECT_TRUE(executed) << "at " << ms << " ms";
    }
    pass(1ms);
  }
}

TEST_F(RequestBudgetTest, CommandsThatSendNothingDoNotWait) {
  exhaust(1);
  ASSERT_GT(budget.waiting(), 0U);
  ASSERT_EQ(put(2, LocalRead{}), Put::queued);
  EXPECT_EQ(next(), tags);
}

TEST_F(RequestBudgetTest, AFullQueueIsBusyForItsClientAlone) {
  exhaust(1);
  EXPECT_EQ(put(1, NmtRequest{}), Put::queue_full);
  EXPECT_EQ(put(2, NmtRequest{}), Put::queued);
  EXPECT_EQ(next(), tags);
}

TEST_F(RequestBudgetTest, AtTheBoundOnlyNewClientsAreRefused) {
  for (std::uint32_t client = 1; client <= RequestBudget::kClients; ++client) {
    ASSERT_EQ(put(client, SdoRead{.node = 1}), Put::queued);
  }
  EXPECT_EQ(budget.clients(), RequestBudget::kClients);
  EXPECT_EQ(put(1000, NmtRequest{}), Put::no_place);
  EXPECT_EQ(put(7, NmtRequest{}), Put::queued) << "a known client";
  // The commands of one client end, so it gives its place to another.
  ASSERT_EQ(next(), 1U);
  budget.answered(1);
  EXPECT_EQ(put(1000, NmtRequest{}), Put::queued);
}

TEST_F(RequestBudgetTest, AClientReportIsOneForAFlood) {
  exhaust(1);
  ASSERT_EQ(put(1, NmtRequest{}), Put::queue_full);
  EXPECT_FALSE(budget.pop_report(now));
  EXPECT_LE(budget.next_wake(), now + RequestBudget::kFirstReport);
  pass(1s);
  const auto report = budget.pop_report(now);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->client, 1U);
  EXPECT_EQ(report->refused, 4U) << "three of exhaust(), and one";
  EXPECT_EQ(report->delayed, 1U);
  EXPECT_EQ(report->replaced, 0U);
  EXPECT_FALSE(budget.pop_report(now));
  ASSERT_EQ(put(1, NmtRequest{}), Put::queue_full);
  pass(9s);
  EXPECT_FALSE(budget.pop_report(now));
  pass(1s);
  ASSERT_TRUE(budget.pop_report(now));
  pass(10s);
  EXPECT_FALSE(budget.pop_report(now)) << "nothing happened since";
}

TEST_F(RequestBudgetTest, ANodeHasOneSdoCommandAtATime) {
  ASSERT_EQ(put(1, SdoRead{.node = 5}), Put::queued);
  ASSERT_EQ(put(1, SdoRead{.node = 5}), Put::queued);
  ASSERT_EQ(put(1, SdoRead{.node = 6}), Put::queued);
  ASSERT_EQ(put(2, SdoRead{.node = 5}), Put::queued);
  ASSERT_EQ(put(1, NmtRequest{.node = 5}), Put::queued);
  EXPECT_EQ(next(), 1U);
  EXPECT_EQ(next(), 3U) << "another node does not wait";
  EXPECT_EQ(next(), 0U) << "the order of a client at a node is kept";
  budget.answered(99);
  EXPECT_EQ(next(), 0U);
  budget.answered(1);
  EXPECT_EQ(next(), 4U) << "the other client has its turn";
  budget.answered(4);
  EXPECT_EQ(next(), 2U);
  EXPECT_EQ(next(), 5U);
  EXPECT_EQ(budget.waiting(), 0U);
}

TEST_F(RequestBudgetTest, WaitingCountsForTheTimeOut) {
  exhaust(1);
  ASSERT_EQ(put(2, SdoRead{.node = 5}, 100ms), Put::queued);
  ASSERT_EQ(next(), tags);
  ASSERT_EQ(put(2, SdoRead{.node = 5}, 100ms), Put::queued);
  const std::uint64_t second = tags;
  pass(40ms);
  budget.answered(second - 1);
  for (std::uint64_t got = next(); got != second; got = next()) {
    ASSERT_NE(got, 0U);
  }
  EXPECT_EQ(admitted.command.timeout, 60ms);
  ASSERT_EQ(put(2, SdoRead{.node = 5}, 100ms), Put::queued);
  EXPECT_LE(budget.next_wake(), now + 100ms);
  pass(100ms);
  bool late = false;
  while (next() != 0) {
    late |= admitted.late && admitted.command.tag == tags;
  }
  EXPECT_TRUE(late);
}

// Time must not stand still because of a time-out behind a command that waits.
TEST_F(RequestBudgetTest, ATimeOutDoesNotWaitForTheAccount) {
  exhaust(1);
  Command command;
  ASSERT_TRUE(budget.remove(command));
  ASSERT_EQ(put(1, NmtRequest{}, 1ms), Put::queued);
  EXPECT_EQ(next(), 0U);
  pass(1ms);
  ASSERT_EQ(next(), tags);
  EXPECT_TRUE(admitted.late);
  EXPECT_EQ(next(), 0U);
  EXPECT_GT(budget.next_wake(), now);
}

// The account of a client that is overdrawn further than that of the line is filled later.
TEST_F(RequestBudgetTest, IsInUseWhileAProcedureWaitsForItsClient) {
  EXPECT_FALSE(budget.is_in_use());
  for (int i = 0; i < 64; ++i) {
    budget.count(1);
  }
  pass(300ms);
  EXPECT_FALSE(budget.permits(1, false));
  EXPECT_TRUE(budget.permits(2, false)) << "the line has bits for others";
  EXPECT_TRUE(budget.is_in_use());
  pass(100ms);
  EXPECT_TRUE(budget.permits(1, false));
  EXPECT_TRUE(budget.is_in_use());
  pass(1s);
  EXPECT_TRUE(budget.is_in_use()) << "another frame of the procedure may be counted";
}

TEST_F(RequestBudgetTest, FramesAreCountedForTheirClient) {
  while (budget.permits(1, false)) {
    budget.count(1);
  }
  EXPECT_TRUE(budget.permits(2, false)) << "another client";
  pass(7ms);  // 131 bits
  EXPECT_TRUE(budget.permits(1, false));
  budget.count(1);
  EXPECT_FALSE(budget.permits(1, false));
}

// A command is admitted before its frames are known: it must not be more than the account permits.
TEST_F(RequestBudgetTest, ACommandThatStartsAProcedureWaitsForTheAccount) {
  const std::vector<Request> kinds{
      Boot{.node = 5}, Configure{.node = 5}, Scan{.node = 5},           ScanApply{.node = 5},
      LssRequest{},    SdoRead{.node = 5},   ProgramDownload{.node = 5}};
  while (budget.permits(1, false)) {
    budget.count(1);
  }
  std::uint32_t other = 1;
  for (const Request& each : kinds) {
    ASSERT_EQ(put(1, each), Put::queued);
    EXPECT_EQ(next(), 0U) << name(kind(each));
    Command command;
    ASSERT_TRUE(budget.remove(command));
    ASSERT_EQ(put(++other, each), Put::queued);
    EXPECT_EQ(next(), tags) << name(kind(each)) << ": another client";
    budget.answered(tags);
    pass(10ms);
    while (budget.permits(1, false)) {
      budget.count(1);
    }
  }
}

// A procedure that it orders is counted frame by frame: a cost in advance would keep the other
// clients waiting.
TEST_F(RequestBudgetTest, AWriteToTheOwnDictionaryCostsAFrameWhateverItOrders) {
  for (const std::uint16_t index : std::array<std::uint16_t, 4>{0x2000, 0x1F25, 0x1F82, 0x5F41}) {
    unsigned writes = 0;
    for (; writes < 100; ++writes) {
      EXPECT_EQ(put(1, LocalWrite{.address = {index, 1}}), Put::queued);
      if (next() == 0) {
        break;
      }
    }
    EXPECT_EQ(writes, 4U) << "a frame each, of 468 bits: " << std::hex << index;
    Command command;
    while (budget.remove(command)) {
    }
    pass(1s);
  }
}

// Any number of clients up to the bound exceeds the share; one that uses less than its part does
// not wait for them, neither for the account of the line nor for the turns of the others.
TEST_F(RequestBudgetTest, AClientBelowItsPartDoesNotWaitForAnyNumberOfFloods) {
  for (const std::uint32_t floods : {3U, 16U, 63U}) {
    pass(10s);
    constexpr std::uint32_t kOther = 1000;
    // Less than 3/4 of 37,500 bit/s, among all clients.
    const Duration period = std::chrono::milliseconds(1000 * (floods + 1) * 122 / 28'125 + 20);
    Duration since{};
    for (int ms = 0; ms < 30'000; ++ms) {
      for (std::uint32_t client = 1; client <= floods; ++client) {
        (void)put(client, CanSend{.frame = full()});
      }
      (void)drain();
      since += 1ms;
      // They begin with their credits at once: the line needs time for those.
      if (since >= period && ms > 10'000) {
        since = {};
        ASSERT_EQ(put(kOther, CanSend{.frame = full()}), Put::queued);
        EXPECT_EQ(next(), tags) << floods << " floods, " << ms << " ms";
      }
      pass(1ms);
    }
    Command command;
    while (budget.remove(command)) {
    }
  }
}

TEST_F(RequestBudgetTest, TheClientWithTheMostCreditIsFirstAtANode) {
  for (std::uint32_t client = 1; client <= 4; ++client) {
    budget.count(client);
    ASSERT_EQ(put(client, SdoRead{.node = 5}), Put::queued);
  }
  ASSERT_NE(next(), 0U);
  const std::uint64_t first = admitted.command.tag;
  EXPECT_EQ(next(), 0U) << "the node is occupied";
  ASSERT_EQ(put(21, SdoRead{.node = 5}), Put::queued);
  budget.answered(first);
  EXPECT_EQ(next(), tags);
}

// So the arbiter sees that another client waits for the end of the transfer.
TEST_F(RequestBudgetTest, AClientWithCreditIsAdmittedBehindOneWithout) {
  for (int i = 0; i < 3; ++i) {
    budget.count(1);
  }
  pass(1ms);  // more than a quarter of the burst is left
  ASSERT_EQ(put(1, SdoRead{.node = 5}), Put::queued);
  ASSERT_EQ(next(), tags);
  const std::uint64_t first = tags;
  ASSERT_EQ(put(2, SdoRead{.node = 5}), Put::queued);
  ASSERT_EQ(next(), tags);
  const std::uint64_t second = tags;
  ASSERT_EQ(put(3, SdoRead{.node = 5}), Put::queued);
  EXPECT_EQ(next(), 0U) << "one at a time";
  budget.answered(first);
  EXPECT_EQ(next(), 0U) << "behind one with credit none is admitted";
  budget.answered(second);
  EXPECT_EQ(next(), tags);
}

// The credits change while the command waits for the node.
TEST_F(RequestBudgetTest, AClientIsAdmittedBehindOneThatUsesUpItsCredit) {
  ASSERT_EQ(put(1, SdoRead{.node = 5}), Put::queued);
  ASSERT_EQ(next(), tags);
  ASSERT_EQ(put(2, SdoRead{.node = 5}), Put::queued);
  EXPECT_EQ(next(), 0U) << "both have credit";
  EXPECT_FALSE(budget.pop_next_due());
  for (int i = 0; i < 3; ++i) {
    budget.count(1);
  }
  EXPECT_TRUE(budget.pop_next_due());
  EXPECT_FALSE(budget.pop_next_due());
  EXPECT_EQ(next(), tags);
}

TEST_F(RequestBudgetTest, AClientIsAdmittedBehindAnotherWhenItHasCreditAgain) {
  for (const std::uint32_t client : {1U, 2U}) {
    for (int i = 0; i < 3; ++i) {
      budget.count(client);
    }
  }
  pass(1ms);  // more than a quarter of the burst is left
  ASSERT_EQ(put(1, SdoRead{.node = 5}), Put::queued);
  ASSERT_EQ(next(), tags);
  ASSERT_EQ(put(2, SdoRead{.node = 5}), Put::queued);
  EXPECT_EQ(next(), 0U) << "neither has credit";
  const Instant wake = budget.next_wake();
  ASSERT_LT(wake, now + 1s);
  budget.count(1);
  pass(wake - now);
  EXPECT_EQ(next(), tags);
}

TEST_F(RequestBudgetTest, CreditsAreNotComparedForAClientThatWaitsForNoNode) {
  ASSERT_EQ(put(1, SdoRead{.node = 5}), Put::queued);
  ASSERT_EQ(next(), tags);
  for (int i = 0; i < 4; ++i) {
    budget.count(1);
    budget.count(2);
  }
  pass(10s);
  EXPECT_FALSE(budget.pop_next_due());
  EXPECT_EQ(budget.next_wake(), kNever);
}

TEST_F(RequestBudgetTest, ATransferThatIsAwaitedMayOverdrawItsAccountOnce) {
  while (budget.permits(1, false)) {
    budget.count(1);
  }
  int frames = 0;
  for (; frames < 100 && budget.permits(1, true); ++frames) {
    budget.count(1);
  }
  EXPECT_EQ(frames, 4) << "of a burst of 468 bits";
  pass(7ms);
  EXPECT_TRUE(budget.permits(1, true));
  EXPECT_FALSE(budget.permits(1, false));
}

// Else a client could hold the server of each node with a transfer that it starves.
TEST_F(RequestBudgetTest, TransfersInProgressPrecedeNewRequestsOfTheirClient) {
  budget.count(1);
  int begun = 0;
  for (int ms = 0; ms < 500; ++ms) {
    (void)put(1, CanSend{.frame = full()});
    begun += next() != 0 ? 1 : 0;
    for (; budget.permits(1, false) && ms >= 100; budget.count(1)) {
    }
    pass(1ms);
  }
  EXPECT_GT(begun, 0);
  EXPECT_LE(begun, 25) << "none while there are frames to send";
}

// Any number of them begins: without precedence they would use up the account, and none would end.
TEST_F(RequestBudgetTest, TheFramesOfATransferInANetworkPrecedeOthers) {
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(put(1, NetworkRead{.network = 1, .node = 5}), Put::queued);
  }
  ASSERT_NE(next(), 0U);
  while (!budget.permits(1, false)) {
    pass(1ms);
  }
  EXPECT_EQ(next(), 0U) << "the transfer in progress has the account";
}

// A long value for another network must not keep the clients of this line waiting for minutes.
TEST_F(RequestBudgetTest, ALongWriteToAnotherNetworkDelaysItsClientAlone) {
  NetworkWrite write{.network = 2, .node = 5};
  write.data.resize(1'000'000);
  ASSERT_EQ(put(1, write), Put::queued);
  ASSERT_EQ(next(), tags);
  EXPECT_FALSE(budget.permits(1, false));
  EXPECT_TRUE(budget.permits(2, false));
  pass(60s);
  EXPECT_FALSE(budget.permits(1, false));
}

TEST_F(RequestBudgetTest, WakesWhenTheAccountPermits) {
  exhaust(1);
  for (int i = 0; i < 100; ++i) {
    const Instant wake = budget.next_wake();
    ASSERT_GT(wake, now) << "time stands still";
    pass(wake - now);
    ASSERT_NE(next(), 0U);
    (void)drain();
  }
}

TEST_F(RequestBudgetTest, OutputsOfAnEarlierArmingAreReplaced) {
  set_outputs(2);
  exhaust(1);
  OutputWrite one = write(1, 0, 7);
  ASSERT_EQ(budget.admits(one), Admission::later);
  budget.hold(one, now);
  OutputWrite other = write(1, 1, 8);
  budget.hold(other, now);
  OutputWrite newer = write(1, 0, 9);
  budget.hold(newer, now);
  OutputWrite out;
  EXPECT_FALSE(budget.next_output(out));
  pass(1s);
  ASSERT_TRUE(budget.next_output(out));
  EXPECT_EQ(out.group, 0);
  EXPECT_EQ(out.arming, 9U);
  EXPECT_EQ(budget.admits(write(1, 1, 10)), Admission::later) << "another write of the group waits";
  ASSERT_TRUE(budget.next_output(out));
  EXPECT_EQ(out.arming, 8U);
  EXPECT_FALSE(budget.next_output(out));
  const auto report = budget.pop_report(now);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->replaced, 1U);
}

TEST_F(RequestBudgetTest, OutputsThatWaitAreJoined) {
  set_outputs(3);
  exhaust(1);
  OutputWrite first = write(1, 0, 7);
  first.values[0].data[0] = std::byte{1};
  OutputWrite other = write(1, 0, 7);
  other.values[0].entry = 2;
  OutputWrite handshake{.group = 0, .arming = 7};
  handshake.client_number = 1;
  for (OutputWrite* const each : {&first, &other, &handshake}) {
    ASSERT_EQ(budget.admits(*each), Admission::later);
    budget.hold(*each, now);
  }
  pass(1s);
  OutputWrite out;
  ASSERT_TRUE(budget.next_output(out));
  ASSERT_EQ(out.values.size(), 2U) << "no value is lost";
  EXPECT_EQ(out.values[0].entry + out.values[1].entry, 2U);
  EXPECT_FALSE(budget.next_output(out));
}

TEST_F(RequestBudgetTest, AtTheBoundOutputsOfNewClientsAreRefusedAndThoseThatWaitKeepTheirPlace) {
  set_outputs(2);
  exhaust(1);
  for (std::uint32_t client = 2; client < RequestBudget::kClients; ++client) {
    ASSERT_EQ(put(client, CanSend{.frame = full()}), Put::queued);
  }
  const std::uint32_t last = RequestBudget::kClients;
  OutputWrite waits = write(last, 0, 7);
  for (std::uint32_t client = 2; client < 8; ++client) {
    exhaust(client);  // and so the account of the line
  }
  ASSERT_EQ(budget.admits(waits), Admission::later);
  budget.hold(waits, now);
  EXPECT_EQ(budget.admits(write(last + 1, 1, 7)), Admission::no_place);
  pass(1s);
  OutputWrite out;
  ASSERT_TRUE(budget.next_output(out));
  EXPECT_EQ(out.client_number, last);
}

TEST_F(RequestBudgetTest, OutputsCostTheEventDrivenPdosThatCarryThem) {
  const auto writes_of = [&](const OutputWrite& write) {
    unsigned out = 0;
    for (; out < 1000 && budget.admits(write) == Admission::now; ++out) {
      budget.applied(write);
    }
    return out;
  };
  set_outputs(8);
  OutputWrite all{.group = 0};
  all.bytes.push_back({.offset = 0, .data = std::vector<std::byte>(8)});
  all.client_number = 1;
  EXPECT_EQ(writes_of(all), 1U) << "8 frames, at a burst of 468 bits";
  EXPECT_EQ(writes_of(write(2, 0, 1)), 3U) << "with less credit more of the line's is reserved";
  OutputWrite handshake{.group = 0};
  handshake.client_number = 3;
  EXPECT_EQ(writes_of(write(3, 0, 1)), 2U) << "another credit";
  EXPECT_EQ(writes_of(handshake), 0U) << "and no more";
  pass(1s);
  EXPECT_EQ(writes_of(handshake), 1000U);
  set_outputs(8, false);
  EXPECT_EQ(writes_of(all), 1000U) << "their rate is that of SYNC";
}

TEST_F(RequestBudgetTest, WithoutABitRateItIsThatOfTheFastestClassicalBus) {
  RequestBudget unknown{{}};
  unknown.advance(now);
  std::int64_t bits = 0;
  for (Command command{.request = CanSend{.frame = full()}};
       unknown.put(command, now) == Put::queued && unknown.next(admitted, now);
       command = {.request = CanSend{.frame = full()}}) {
    bits += kFullFrame;
  }
  constexpr std::int64_t kBurst = 1'000'000 * 15 / 100 / 40;
  EXPECT_GE(bits, kBurst);
  EXPECT_LE(bits, kBurst + kFullFrame);
}

TEST_F(RequestBudgetTest, WaitingCommandsCanBeRemoved) {
  exhaust(1);
  const std::size_t waiting = budget.waiting();
  Command command;
  std::size_t removed = 0;
  while (budget.remove(command)) {
    ++removed;
  }
  EXPECT_EQ(removed, waiting);
  EXPECT_EQ(budget.waiting(), 0U);
}

}  // namespace
}  // namespace linegate::line
