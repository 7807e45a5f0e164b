// SPDX-License-Identifier: Apache-2.0
// SDO transfers of an expedited value and of 1 MB, between a client and a server that stream it, on
// the virtual bus at 1 Mbit/s in virtual time: the share of the bus that they use. For comparison,
// the time that the frames occupy the wire, which is the floor. In real time: CPU per frame of
// client, server and virtual bus together, and of client and server alone.
//
// With losses: the slowest of several transfers with other losses each, and beside it the least
// time that any server could reach, because the client sends the rest of a sub-block after a lost
// segment in vain.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <random>
#include <string>

#include "bridges/sim/bus.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/od/dictionary.h"
#include "stack/sdo/protocol.h"
#include "stack/sdo/server.h"

#include "tests/bench/measure.h"
#include "tests/bench/transfer_client.h"
#include "tests/bench/transfer_device.h"

namespace {

using namespace linegate;
using bench::kDomain;
using bench::PatternDomain;
using bench::TransferKind;

constexpr std::uint32_t kBytes = 1'000'000;
constexpr std::uint8_t kNode = 5;
constexpr double kMinUse = 0.95;  // relative to the limit
// Relative to the rate without losses, if 1 % of the segments are lost.
constexpr double kMinRate = 0.8;
constexpr std::size_t kPlaces = 3;  // frames that a controller holds
constexpr unsigned kSeeds = 5;      // transfers with losses

struct Row {
  TransferKind kind;
  const char* name;
  unsigned lost_percent = 0;  // percentage of the data segments
};

struct Figures {
  double seconds = 0;       // virtual time
  double wire_seconds = 0;  // part of it in which the wire was occupied
  std::uint64_t frames = 0;
  double cpu_seconds = 0;
};

class Network {
 public:
  explicit Network(unsigned seed) : random_(seed) {
    bench::require(dictionary_.set_hook(kDomain.index, &domain_).ok(), "no hook");
    client_end_ = bus_.attach();
    server_end_ = bus_.attach();
  }

  Figures run(const Row& row) {
    if (row.lost_percent != 0)
      lose(row.lost_percent, row.kind == TransferKind::block_upload ? server_end_ : client_end_);
    const auto begin = std::chrono::steady_clock::now();
    const std::size_t times = row.kind == TransferKind::expedited_upload ? 10'000 : 1;
    for (std::size_t i = 0; i < times; ++i) {
      transfer_.start(row.kind, now_);
      while (!transfer_.ended()) {
        step();
      }
    }
    const std::chrono::duration<double> real = std::chrono::steady_clock::now() - begin;
    return {std::chrono::duration<double>(now_ - Instant{}).count(),
            std::chrono::duration<double>(bus_.busy()).count(), bus_.frames(), real.count()};
  }

 private:
  void step() {
    submit(transfer_.queue, client_end_);
    submit(from_server_, server_end_);
    const Instant wake =
        earlier(bus_.next_wake(), earlier(transfer_.client.next_wake(), server_.next_wake()));
    bench::require(wake != kNever, "no frame and no time-out is pending");
    now_ = std::max(now_, wake);
    bus_.advance(now_);
    std::array<can::Frame, 8> frames;
    for (std::size_t i = 0, count = bus_.take(server_end_, frames, now_); i < count; ++i)
      server_.receive(frames[i], from_server_);
    for (std::size_t i = 0, count = bus_.take(client_end_, frames, now_); i < count; ++i)
      transfer_.client.receive(frames[i], transfer_.queue);
    server_.advance(now_, from_server_);
    transfer_.client.advance(now_, transfer_.queue);
  }

  void submit(can::TransmitQueue& queue, sim::Bus::Endpoint end) {
    for (can::Frame frame; bus_.room(end) > 0 && queue.pop_rest(frame);)
      bus_.submit(end, frame, now_);
  }

  void lose(unsigned percent, sim::Bus::Endpoint sending_end) {
    bus_.set_disturbance(
        [this, percent, sending_end](const can::Frame& frame, sim::Bus::Endpoint sender) {
          const auto command = std::to_integer<unsigned>(frame.data[0]);
          const bool segment = sender == sending_end && command >= 1 && command <= 127;
          return segment && random_() % 100 < percent ? sim::Fate::lost : sim::Fate::delivered;
        });
  }

  sim::Bus bus_{{.bit_rate = 1'000'000, .queue_depth = kPlaces}};
  sim::Bus::Endpoint client_end_ = 0;
  sim::Bus::Endpoint server_end_ = 0;
  PatternDomain domain_{kBytes};
  od::Dictionary dictionary_{bench::transfer_device()};
  EventLog events_;
  can::TransmitQueue from_server_{16};
  sdo::Server server_{dictionary_, can::CobId{can::kSdoRequestBase + kNode},
                      can::CobId{can::kSdoResponseBase + kNode}, events_};
  bench::TransferClient transfer_{can::CobId{can::kSdoRequestBase + kNode}, kBytes, domain_};
  Instant now_{};
  std::mt19937 random_;
};

// The slowest of the transfers, if they differ.
Figures measure(const Row& row) {
  Figures slowest;
  for (unsigned seed = 1; seed <= (row.lost_percent != 0 ? kSeeds : 1U); ++seed) {
    const Figures figures = Network(seed).run(row);
    slowest = figures.seconds > slowest.seconds ? figures : slowest;
  }
  return slowest;
}

// The frames for each segment that is received in order, if each sub-block has that many segments,
// each of which is lost with that probability: an acknowledgement follows each sub-block, and the
// segments after the first lost one are sent again. Time-outs cost nothing.
double frames_a_segment(unsigned block_size, double lost) {
  const double in_order = (1 - lost) * (1 - std::pow(1 - lost, block_size)) / lost;
  return (block_size + 1) / in_order;
}

void print_floor(double lost) {
  const double without_losses = (sdo::kMaxBlockSize + 1.0) / sdo::kMaxBlockSize;
  unsigned best = 1;
  for (unsigned size = 2; size <= sdo::kMaxBlockSize; ++size) {
    best = frames_a_segment(size, lost) < frames_a_segment(best, lost) ? size : best;
  }
  std::printf(
      "    at least %.2f x for any server (sub-blocks of %u segments, no time-out), %.2f x for one "
      "that keeps %d\n",
      frames_a_segment(best, lost) / without_losses, best,
      frames_a_segment(sdo::kMaxBlockSize, lost) / without_losses, int{sdo::kMaxBlockSize});
}

constexpr Row kRows[] = {
    {TransferKind::expedited_upload, "expedited upload, 10,000 times"},
    {TransferKind::segmented_upload, "segmented upload, 1 MB"},
    {TransferKind::segmented_download, "segmented download, 1 MB"},
    {TransferKind::block_upload, "block upload, 1 MB"},
    {TransferKind::block_download, "block download, 1 MB"},
    {TransferKind::block_upload, "block upload, 1 MB, 1 % of segments lost", 1},
    {TransferKind::block_download, "block download, 1 MB, 1 % of segments lost", 1}};

}  // namespace

int main() {
  std::map<TransferKind, double> seconds;  // without losses
  bench::print_heading("SDO transfers on a virtual bus at 1 Mbit/s, virtual time");
  for (const Row& row : kRows) {
    const Figures figures = measure(row);
    const double use = figures.wire_seconds / figures.seconds;
    const double amount = row.kind == TransferKind::expedited_upload ? 10'000 : kBytes;
    std::printf("    %-46s %9.0f %s, %.1f %% of the time the wire is busy, %.0f ns CPU a frame\n",
                row.name, amount / figures.seconds,
                row.kind == TransferKind::expedited_upload ? "a second" : "byte/s", 100 * use,
                1e9 * figures.cpu_seconds / static_cast<double>(figures.frames));
    if (row.lost_percent == 0) {
      seconds[row.kind] = figures.seconds;
    } else if (row.kind == TransferKind::block_download) {
      bench::print_target(row.name, figures.seconds / seconds[row.kind], 1 / kMinRate,
                          "x the time without losses");
      print_floor(row.lost_percent / 100.0);
    }
    if (row.kind == TransferKind::block_download && row.lost_percent == 0) {
      // Only the necessary frames are on the wire: 142,858 segments, an acknowledgement for each
      // 127 segments, and two frames each for the beginning and the end.
      const std::uint64_t segments = (kBytes + 6) / 7;
      const std::uint64_t needed = segments + (segments + 126) / 127 + 4;
      bench::require(figures.frames == needed, "more frames than necessary");
      bench::print_target(row.name, figures.seconds / figures.wire_seconds, 1 / kMinUse,
                          "x its frames on the wire");
    }
  }
}
