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
constexpr unsigned kLongestPause = 450;      // ms
constexpr unsigned kLongestPauseLate = 230;  // ms, of a side that does not read between two pauses

// What an initiate says. Other devices have no CRC, or do not indicate the size.
enum class Initiate : std::uint8_t { full, without_crc, without_size, bare };

struct Set {
  std::uint32_t queue;
  std::size_t controller;
  Initiate initiate = Initiate::full;
  bool late = false;  // a side reads only when everything that it sent is on the bus
};
// The controller sends at least what a channel gives out at once: Outbox::kMany segments.
constexpr Set kSets[] = {{8, 10},
                         {256, 40},
                         {256, 130},
                         {256, 40, Initiate::full, true},
                         {8, 10, Initiate::without_crc},
                         {256, 40, Initiate::without_crc, true},
                         {8, 10, Initiate::without_size},
                         {256, 40, Initiate::without_size, true},
                         {8, 10, Initiate::bare},
                         {256, 40, Initiate::bare},
                         {256, 130, Initiate::bare},
                         {256, 40, Initiate::bare, true}};

// A side of the transfer: its queue, its controller, and the frames that it has not read yet.
struct Side {
  explicit Side(const Set& set) : queue(set.queue), controller_size(set.controller) {}

  can::TransmitQueue queue;
  std::size_t controller_size;
  std::deque<can::Frame> controller{};
  std::deque<can::Frame> arrived{};
  bool initiated = false;  // its first frame was sent
  Instant paused_until{};
};

class PausedPair : public TransferPair, public testing::WithParamInterface<Set> {
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
      side->initiated = false;
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
    const auto reads = [&] {
      return !GetParam().late || (side.queue.empty() && side.controller.empty());
    };
    for (; !side.arrived.empty() && reads(); side.arrived.pop_front()) {
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
        to->arrived.push_back(as_initiated(from->controller.front(), !from->initiated));
      }
      from->initiated = true;
      from->controller.pop_front();
      maybe_pause();
      return true;
    }
    return false;
  }
  // The frame as such a device sends and reads it.
  static can::Frame as_initiated(can::Frame frame, bool first) {
    const Initiate initiate = GetParam().initiate;
    const bool sends = is_block_send(std::to_integer<std::uint8_t>(frame.data[0]));
    if (first && (initiate == Initiate::without_crc || initiate == Initiate::bare)) {
      frame.data[0] &= ~std::byte{kBlockCrc};
    }
    if (first && sends && (initiate == Initiate::without_size || initiate == Initiate::bare)) {
      frame.data[0] &= ~std::byte{kBlockSize};
      std::fill_n(frame.data.begin() + 4, 4, std::byte{0});
    }
    return frame;
  }
  void maybe_pause() {
    const unsigned longest_pause = GetParam().late ? kLongestPauseLate : kLongestPause;
    for (Side* side : {&client_side, &server_side}) {
      if (random() % frames_between_pauses == 0 && now >= side->paused_until) {
        side->paused_until = now + std::chrono::milliseconds(random() % longest_pause);
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

INSTANTIATE_TEST_SUITE_P(Sets, PausedPair, testing::ValuesIn(kSets));

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
    begin(seed, seed % 2 == 0 ? 10 : 60);
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
