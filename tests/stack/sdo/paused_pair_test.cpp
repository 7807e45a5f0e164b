// SPDX-License-Identifier: Apache-2.0
// Block transfer between a client and a server that pause, on a bus that loses nothing: a process
// that does not get the processor, or a device that is busy with its flash memory. What the other
// side sends meanwhile waits, and what was handed to the controller before is still sent.
//
// Invariant: a transfer without lost frames is right, whatever side pauses at whatever moment, if
// the pauses of both together are shorter than the time-out.
#include <deque>
#include <random>

#include "tests/stack/sdo/pair_fixture.h"

namespace linegate::sdo::test {
namespace {

constexpr od::Address kProgram{0x2100, 0};
constexpr unsigned kSeeds = 1000;
constexpr int kMostSteps = 100'000;
constexpr Duration kFrameTime = 100us;
constexpr Duration kLongTimeout = 1s;
constexpr unsigned kLongestPause = 450;  // ms

// The controller sends at least what a channel gives out at once: Outbox::kMany segments.
struct Sizes {
  std::uint32_t queue;
  std::size_t controller;
};
constexpr Sizes kSizes[] = {{8, 10}, {256, 40}, {256, 130}};

// A side of the transfer: its queue, its controller, and the frames that it has not read yet.
struct Side {
  explicit Side(const Sizes& sizes) : queue(sizes.queue), controller_size(sizes.controller) {}

  can::TransmitQueue queue;
  std::size_t controller_size;
  std::deque<can::Frame> controller{};
  std::deque<can::Frame> arrived{};
  Instant paused_until{};
};

class PausedPair : public TransferPair, public testing::WithParamInterface<Sizes> {
 protected:
  // Draws a transfer and its pauses from the seed. loss: so many frames of a thousand are lost.
  void begin(unsigned seed, unsigned loss) {
    random.seed(seed);
    writing = random() % 2 == 0;
    size = 25 + random() % (random() % 2 == 0 ? 200 : 4000);
    frames_between_pauses = 1U << (2 + random() % 7);
    lost_per_mille = loss;
    ASSERT_TRUE(dictionary.set(kProgram, writing ? std::vector<std::byte>{} : pattern(size)));
    const TransferOptions block{.transfer = Transfer::block};
    writing ? client.write(kProgram, pattern(size), kLongTimeout, now, client_side.queue, block)
            : client.read(kProgram, kLongTimeout, now, client_side.queue, block);
  }
  Outcome run_with_pauses() {
    for (int step = 0; step < kMostSteps; ++step) {
      work(client_side, client);
      work(server_side, server);
      if (std::optional<Outcome> outcome = client.take()) {
        return *std::move(outcome);
      }
      const Instant next = transmit() ? now + kFrameTime : next_time();
      if (next == kNever) {
        ADD_FAILURE() << "both sides wait endlessly";
        return {};
      }
      now = next;
    }
    ADD_FAILURE() << "the transfer does not end";
    return {};
  }
  Bytes stored() { return numbers(dictionary.find(kProgram)->bytes()); }
  void settle_all() {
    settle();
    for (Side* side : {&client_side, &server_side}) {
      side->queue.clear();
      side->controller.clear();
      side->arrived.clear();
      side->paused_until = {};
    }
  }

  std::mt19937 random;
  bool writing = false;
  std::size_t size = 0;
  unsigned frames_between_pauses = 1;
  unsigned lost_per_mille = 0;
  Side client_side{GetParam()};
  Side server_side{GetParam()};

 private:
  // A side that does not pause reads what has arrived, then does what is due, as an executor does.
  template <class Of>
  void work(Side& side, Of& of) {
    if (now < side.paused_until) {
      return;
    }
    for (; !side.arrived.empty(); side.arrived.pop_front()) {
      of.receive(side.arrived.front(), side.queue);
    }
    of.advance(now, side.queue);
    can::Frame next;
    while (side.controller.size() < side.controller_size && side.queue.pop_rest(next)) {
      side.controller.push_back(next);
    }
  }
  bool transmit() {
    for (auto [from, to] : {std::pair{&client_side, &server_side}, {&server_side, &client_side}}) {
      if (from->controller.empty()) {
        continue;
      }
      if (random() % 1000 >= lost_per_mille) {
        from->controller.front().time = now + kFrameTime;
        to->arrived.push_back(from->controller.front());
      }
      from->controller.pop_front();
      maybe_pause();
      return true;
    }
    return false;
  }
  void maybe_pause() {
    for (Side* side : {&client_side, &server_side}) {
      if (random() % frames_between_pauses == 0 && now >= side->paused_until) {
        side->paused_until = now + std::chrono::milliseconds(random() % kLongestPause);
      }
    }
  }
  Instant next_time() const {
    Instant next = kNever;
    const auto of = [&](const Side& side, Instant wake) {
      const Instant due = side.arrived.empty() ? wake : now;
      next = earlier(next, std::max(side.paused_until, due));
    };
    of(client_side, client.next_wake());
    of(server_side, server.next_wake());
    return std::max(next, now + 1us);
  }
};

INSTANTIATE_TEST_SUITE_P(Sizes, PausedPair, testing::ValuesIn(kSizes));

TEST_P(PausedPair, ATransferWithoutLostFramesIsRight) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    begin(seed, 0);
    const Outcome outcome = run_with_pauses();
    ASSERT_EQ(outcome.abort, AbortCode::none)
        << describe(outcome.abort) << (writing ? ", written " : ", read ") << size << " bytes";
    EXPECT_EQ(writing ? stored() : numbers(outcome.data), numbers(pattern(size)));
    settle_all();
  }
}

TEST_P(PausedPair, LostFramesNeverSpoilAValue) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    begin(seed, 10);
    const Outcome outcome = run_with_pauses();
    if (outcome.abort == AbortCode::none) {
      ASSERT_EQ(writing ? stored() : numbers(outcome.data), numbers(pattern(size)));
    } else if (writing) {
      ASSERT_TRUE(stored().empty() || stored() == numbers(pattern(size)));
    }
    settle_all();
  }
}

}  // namespace
}  // namespace linegate::sdo::test
