// SPDX-License-Identifier: Apache-2.0
// Received PDO -> image, through the whole of Line::receive(): 8 bytes, batches of 64, 4096 frames
// in seeded random order, half of their bytes changing, with deadlines. Compared with the floor
// (pdo_to_image_floor.h). Figures are nanoseconds per PDO frame.
//
// Synchronous PDOs are sent as in CiA 301: each once a cycle, and SYNC ends the cycle. The cost of
// SYNC itself is measured on the same line, in a pass of SYNC alone after each pass of PDOs, and
// the figure is the difference of the two passes: with one PDO, every second frame is SYNC. Also
// printed, without a budget: 64 frames per SYNC in any order. If they are all of one PDO, most of
// them are replaced before SYNC.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "stack/line/line.h"

#include "tests/bench/allocations.h"
#include "tests/bench/measure.h"
#include "tests/bench/pdo_line.h"
#include "tests/bench/pdo_to_image_floor.h"

namespace {

using namespace linegate;
using bench::Contestant;
using bench::Mapping;
using bench::Order;

constexpr std::size_t kFrames = 4096;
constexpr std::size_t kBatch = 64;
constexpr std::size_t kPasses = 32;  // over all frames, in each repetition
constexpr Duration kFrameTime = std::chrono::microseconds(114);  // on a full bus at 1 Mbit/s
constexpr int kRepetitions = 3 * bench::kRepetitions;  // differences of two figures vary more
constexpr double kMaxNanoseconds = 15;

double nanoseconds(std::chrono::steady_clock::duration time) {
  return std::chrono::duration<double, std::nano>(time).count();
}

// Batches of PDOs, and of the SYNCs between them.
class Input {
 public:
  // sync_every: number of PDOs between two SYNCs; 0: no SYNC. batch: number of PDOs in each batch.
  Input(const std::vector<can::Frame>& pdos, std::size_t sync_every, std::size_t batch = kBatch) {
    std::size_t begin = 0;
    for (std::size_t i = 0; i < pdos.size(); ++i) {
      frames_.push_back(pdos[i]);
      if (sync_every != 0 && i % sync_every == sync_every - 1)
        frames_.push_back(can::make_frame(0x080));
      if (i % batch == batch - 1) {
        batches_.push_back({begin, frames_.size() - begin});
        begin = frames_.size();
      }
    }
  }

  // now: time of the previous frame; on return, time of the last frame of this pass.
  template <class Receive>
  double pass(Instant& now, Receive receive) {
    for (can::Frame& frame : frames_)
      frame.time = now += kFrameTime;
    const auto begin = std::chrono::steady_clock::now();
    for (const Batch& batch : batches_)
      receive(std::span(frames_).subspan(batch.begin, batch.size));
    return nanoseconds(std::chrono::steady_clock::now() - begin);
  }

  std::size_t frames() const { return frames_.size(); }

 private:
  struct Batch {
    std::size_t begin;
    std::size_t size;
  };
  std::vector<can::Frame> frames_;
  std::vector<Batch> batches_;
};

Input only_syncs() {
  return {std::vector<can::Frame>(kFrames, can::make_frame(0x080)), 0};
}

struct Case {
  const char* name;
  Mapping mapping;
  Order order = Order::random;
  std::size_t sync_every = 0;  // kCycle: after each cycle
  std::size_t batch = kBatch;
};
constexpr std::size_t kCycle = ~std::size_t{0};
constexpr Case kCases[] = {
    {"4 x 16 bit", Mapping::event_driven},
    {"64 x 1 bit", Mapping::bits},
    {"4 x 16 bit, synchronous, with SYNC", Mapping::synchronous, Order::cycles, kCycle},
    {"4 x 16 bit, synchronous, 64 frames a SYNC", Mapping::synchronous, Order::random, kBatch},
    {"4 x 16 bit, one frame per call", Mapping::event_driven, Order::random, 0, 1}};
constexpr std::size_t kPdos[] = {1, 64, 512};
constexpr std::size_t kSizes = std::size(kPdos);

// The result of one repetition, in ns per PDO frame; sync: ns per SYNC alone.
struct Times {
  double with_sync = 0;  // as received, with the SYNCs between the PDOs, if any
  double sync = 0;
  double without_sync = 0;  // the median of the differences of two consecutive passes
  std::uint64_t allocations = 0;
};

// Alternates passes over the PDOs and, if those are synchronous, over as many SYNCs alone, so that
// both run with the same memory layout and machine load.
template <class Receive>
Times measure(Input& pdos, Input* syncs, Instant& now, Receive receive) {
  std::vector<double> with_sync(kPasses);
  std::vector<double> sync(kPasses);
  std::vector<double> without_sync(kPasses);
  const auto syncs_per_pdo = static_cast<double>(pdos.frames() - kFrames) / double{kFrames};
  const std::uint64_t allocated = bench::allocations();
  for (std::size_t i = 0; i < kPasses; ++i) {
    with_sync[i] = pdos.pass(now, receive) / double{kFrames};
    sync[i] = syncs == nullptr ? 0 : syncs->pass(now, receive) / double{kFrames};
    without_sync[i] = with_sync[i] - syncs_per_pdo * sync[i];
  }
  const std::uint64_t allocations = bench::allocations() - allocated;
  return {bench::median(std::move(with_sync)), bench::median(std::move(sync)),
          bench::median(std::move(without_sync)), allocations};
}

class Subject {
 public:
  Subject(const Case& c, std::size_t pdos)
      : ids_(bench::pdo_identifiers(pdos)),
        pdos_(bench::pdo_frames(ids_, kFrames, c.order),
              c.sync_every == kCycle ? pdos : c.sync_every, c.batch),
        in_cycles_(c.sync_every == kCycle),
        line_(make(c.mapping, ids_, now_)) {
    (void)repetition();
  }

  Times repetition() {
    const std::uint64_t taken = counters().rpdos;
    const std::uint64_t synced = counters().syncs;
    const Times out = measure(
        pdos_, in_cycles_ ? &syncs_ : nullptr, now_,
        [this](std::span<const can::Frame> batch) { line_->receive(batch, batch.back().time); });
    const std::size_t syncs = pdos_.frames() - kFrames + (in_cycles_ ? kFrames : 0);
    bench::require(counters().rpdos - taken == kFrames * kPasses, "PDOs were not received");
    bench::require(counters().syncs - synced == syncs * kPasses, "SYNC was not received");
    return out;
  }

 private:
  static std::unique_ptr<line::Line> make(Mapping mapping, std::span<const std::uint32_t> ids,
                                          Instant now) {
    auto made = line::Line::make(bench::pdo_line(mapping, ids));
    bench::require(made.ok(), made.diagnostics.empty() ? "" : made.diagnostics.front().text);
    (*made.value)->start(now);
    return *std::move(made.value);
  }
  line::Counters counters() const { return line_->state().counters; }

  std::vector<std::uint32_t> ids_;
  Input pdos_;
  Input syncs_ = only_syncs();
  bool in_cycles_;
  Instant now_{std::chrono::seconds(1)};
  std::unique_ptr<line::Line> line_;
};

class FloorSubject {
 public:
  FloorSubject(std::size_t pdos, bool synchronous, std::size_t batch = kBatch)
      : synchronous_(synchronous),
        ids_(bench::pdo_identifiers(pdos)),
        floor_(ids_),
        pdos_(bench::pdo_frames(ids_, kFrames, synchronous ? Order::cycles : Order::random),
              synchronous ? pdos : 0, batch) {
    (void)repetition();
  }

  Times repetition() {
    std::uint64_t taken = 0;
    const Times out = measure(
        pdos_, synchronous_ ? &syncs_ : nullptr, now_, [&](std::span<const can::Frame> batch) {
          taken += synchronous_ ? floor_.receive_synchronous(batch) : floor_.receive(batch);
        });
    bench::require(taken == kFrames * kPasses && floor_.checksum() != 0, "the floor is invalid");
    return out;
  }

 private:
  bool synchronous_;
  std::vector<std::uint32_t> ids_;
  bench::Floor floor_;
  Input pdos_;
  Input syncs_ = only_syncs();
  Instant now_{std::chrono::seconds(1)};
};

// One contestant for each of kPdos, with the results of its repetitions.
struct Group {
  std::array<std::vector<Times>, kSizes> times;

  std::vector<Contestant> figures(const std::string& name, double Times::*what) const {
    std::vector<Contestant> out;
    for (std::size_t i = 0; i < kSizes; ++i) {
      out.push_back({name + ", " + std::to_string(kPdos[i]) + " PDOs", {}, {}});
      for (std::size_t k = 1; k < times[i].size(); ++k) {  // the first is a warm-up
        out.back().figures.push_back(times[i][k].*what);
      }
    }
    return out;
  }
};

// Creates the subject anew for each repetition, with its memory at another address: the address
// makes a difference of up to a nanosecond, which would otherwise affect a whole run.
template <class Make>
void enter(std::vector<Contestant>& contestants, Group& group, Make make) {
  for (std::size_t i = 0; i < kSizes; ++i) {
    contestants.push_back({{},
                           [&times = group.times[i], make, pdos = kPdos[i]] {
                             constexpr std::size_t kApart = 64 * 1024;
                             static std::mt19937 random(1);
                             const std::vector<std::byte> before(random() % kApart);
                             times.push_back(make(pdos)->repetition());
                             return times.back().with_sync;
                           },
                           {}});
  }
}

std::uint64_t allocations(std::span<const Group> groups) {
  std::uint64_t sum = 0;
  for (const Group& group : groups) {
    for (const std::vector<Times>& each : group.times) {
      for (const Times& times : each)
        sum += times.allocations;
    }
  }
  return sum;
}

void print_figures(std::span<const Contestant> figures, std::span<const Contestant> floors) {
  for (std::size_t i = 0; i < figures.size(); ++i) {
    const std::string ratio = std::to_string(bench::median_ratio(figures[i], floors[i]));
    bench::print_figure(figures[i], "ns", ", " + ratio.substr(0, 4) + " x floor");
  }
}

double largest_ratio(std::span<const Contestant> figures, std::span<const Contestant> floors) {
  double ratio = 0;
  for (std::size_t i = 0; i < kSizes; ++i)
    ratio = std::max(ratio, bench::median_ratio(figures[i], floors[i]));
  return ratio;
}

void print_targets(const std::string& name, std::span<const Contestant> figures,
                   std::span<const Contestant> floors) {
  double slowest = 0;
  for (const Contestant& each : figures)
    slowest = std::max(slowest, bench::median(each.figures));
  bench::print_target(name + ": the slowest", slowest, kMaxNanoseconds, "ns");
  bench::print_target(name + ": to the floor", largest_ratio(figures, floors), 2, "x");
  bench::print_target(name + ": 512 PDOs to 1", bench::median_ratio(figures[2], figures[0]), 1.3,
                      "x");
}

}  // namespace

int main() {
  std::array<Group, 3> floor_groups;  // applied at once, held until SYNC, one frame per call
  std::array<Group, std::size(kCases)> groups;
  std::vector<Contestant> contestants;
  for (const bool synchronous : {false, true}) {
    enter(contestants, floor_groups[synchronous ? 1 : 0], [synchronous](std::size_t pdos) {
      return std::make_unique<FloorSubject>(pdos, synchronous);
    });
  }
  enter(contestants, floor_groups[2],
        [](std::size_t pdos) { return std::make_unique<FloorSubject>(pdos, false, 1); });
  for (std::size_t c = 0; c < groups.size(); ++c) {
    enter(contestants, groups[c],
          [c](std::size_t pdos) { return std::make_unique<Subject>(kCases[c], pdos); });
  }
  bench::interleave(contestants, kRepetitions);

  const auto floors = floor_groups[0].figures("floor", &Times::with_sync);
  const auto floors_with_sync =
      floor_groups[1].figures("floor, synchronous, with SYNC", &Times::with_sync);
  const auto floors_synchronous =
      floor_groups[1].figures("floor, synchronous", &Times::without_sync);
  const auto floors_alone = floor_groups[2].figures("floor, one frame per call", &Times::with_sync);
  const auto floor_syncs = floor_groups[1].figures("floor, SYNC alone", &Times::sync);
  const auto syncs = groups[2].figures("SYNC alone", &Times::sync);
  const auto synchronous = groups[2].figures("4 x 16 bit, synchronous", &Times::without_sync);
  std::vector<std::vector<Contestant>> cases;
  for (std::size_t c = 0; c < groups.size(); ++c) {
    cases.push_back(groups[c].figures(kCases[c].name, &Times::with_sync));
  }

  bench::print_heading("Received PDO -> image, through Line::receive in batches of 64");
  for (const auto& group :
       {floors, floors_alone, floors_with_sync, floors_synchronous, floor_syncs, syncs}) {
    for (const Contestant& each : group)
      bench::print_figure(each, "ns");
  }
  print_figures(cases[0], floors);
  print_figures(cases[1], floors);
  print_figures(cases[2], floors_with_sync);
  print_figures(cases[3], floors);
  print_figures(cases[4], floors_alone);
  print_figures(synchronous, floors_synchronous);
  print_targets("4 x 16 bit", cases[0], floors);
  print_targets("64 x 1 bit", cases[1], floors);
  print_targets("4 x 16 bit, synchronous", synchronous, floors_synchronous);
  bench::print_target("one frame per call: to the floor", largest_ratio(cases[4], floors_alone), 2,
                      "x");
  bench::print_target("SYNC alone: to an event-driven PDO", largest_ratio(syncs, cases[0]), 2, "x");
  bench::print_target("allocations", static_cast<double>(allocations(groups)), 0, "in all");
}
