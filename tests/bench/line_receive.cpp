// Received PDO -> image, through the whole of Line::receive(): 8 bytes, batches of 64, 4096 frames
// in seeded random order, half of their bytes changing, deadlines on. Beside the floor
// (pdo_to_image_floor.h). Figures are nanoseconds per PDO frame.
//
// Synchronous PDOs are sent as CiA 301 has it: each once a cycle, and SYNC ends the cycle. What
// SYNC itself costs is measured beside them and taken off: with one PDO, every second frame is
// SYNC. Printed too, without a budget: 64 frames a SYNC in any order, most of which SYNC does not
// find any more when they are all of one PDO.
#include <chrono>
#include <memory>
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
constexpr std::size_t kPasses = 32;                              // over all frames, per repetition
constexpr Duration kFrameTime = std::chrono::microseconds(114);  // of a full bus at 1 Mbit/s
constexpr double kMaxNanoseconds = 15;

double nanoseconds(std::chrono::steady_clock::duration time) {
  return std::chrono::duration<double, std::nano>(time).count();
}

// Batches of 64 PDOs, and of the SYNCs between them.
class Input {
 public:
  // sync_every: after so many PDOs; 0 = none.
  Input(const std::vector<can::Frame>& pdos, std::size_t sync_every) {
    std::size_t begin = 0;
    for (std::size_t i = 0; i < pdos.size(); ++i) {
      frames_.push_back(pdos[i]);
      if (sync_every != 0 && i % sync_every == sync_every - 1)
        frames_.push_back(can::make_frame(0x080));
      if (i % kBatch == kBatch - 1) {
        batches_.push_back({begin, frames_.size() - begin});
        begin = frames_.size();
      }
    }
  }

  template <class Receive>
  double pass(Receive receive) {
    for (can::Frame& frame : frames_)
      frame.time = now_ += kFrameTime;
    const auto begin = std::chrono::steady_clock::now();
    for (const Batch& batch : batches_)
      receive(std::span(frames_).subspan(batch.begin, batch.size));
    return nanoseconds(std::chrono::steady_clock::now() - begin);
  }

  Instant now() const { return now_; }

 private:
  struct Batch {
    std::size_t begin;
    std::size_t size;
  };
  std::vector<can::Frame> frames_;
  std::vector<Batch> batches_;
  Instant now_{std::chrono::seconds(1)};
};

struct Case {
  const char* name;
  Mapping mapping;
  Order order = Order::random;
  std::size_t sync_every = 0;  // kCycle: after each cycle
};
constexpr std::size_t kCycle = ~std::size_t{0};
constexpr Case kCases[] = {
    {"4 x 16 bit", Mapping::event_driven},
    {"64 x 1 bit", Mapping::bits},
    {"4 x 16 bit, synchronous, with SYNC", Mapping::synchronous, Order::cycles, kCycle},
    {"4 x 16 bit, synchronous, 64 frames a SYNC", Mapping::synchronous, Order::random, kBatch}};
constexpr std::size_t kPdos[] = {1, 64, 512};
constexpr std::size_t kSizes = std::size(kPdos);

class Subject {
 public:
  Subject(const Case& c, std::size_t pdos)
      : ids_(bench::pdo_identifiers(pdos)),
        input_(bench::pdo_frames(ids_, kFrames, c.order),
               c.sync_every == kCycle ? pdos : c.sync_every),
        line_(make(c.mapping, ids_, input_.now())) {
    repetition(1);
  }

  static std::unique_ptr<line::Line> make(Mapping mapping, std::span<const std::uint32_t> ids,
                                          Instant now) {
    auto made = line::Line::make(bench::pdo_line(mapping, ids));
    bench::require(made.ok(), made.diagnostics.empty() ? "" : made.diagnostics.front().text);
    (*made.value)->start(now);
    return *std::move(made.value);
  }

  double repetition(std::size_t passes = kPasses) {
    std::vector<double> times(passes);
    const std::uint64_t taken = line_->state().counters.rpdos;
    const std::uint64_t allocated = bench::allocations();
    for (std::size_t pass = 0; pass < passes; ++pass) {
      times[pass] = input_.pass(
          [this](std::span<const can::Frame> batch) { line_->receive(batch, batch.back().time); });
    }
    allocations_ += bench::allocations() - allocated;
    bench::require(line_->state().counters.rpdos - taken == kFrames * passes,
                   "PDOs were not taken");
    return bench::median(std::move(times)) / double{kFrames};
  }

  std::uint64_t allocations() const { return allocations_; }

 private:
  std::vector<std::uint32_t> ids_;
  Input input_;
  std::unique_ptr<line::Line> line_;
  std::uint64_t allocations_ = 0;
};

class FloorSubject {
 public:
  FloorSubject(std::size_t pdos, bool synchronous)
      : synchronous_(synchronous),
        ids_(bench::pdo_identifiers(pdos)),
        floor_(ids_),
        input_(bench::pdo_frames(ids_, kFrames, synchronous ? Order::cycles : Order::random),
               synchronous ? pdos : 0) {}

  double repetition() {
    std::vector<double> times;
    std::uint64_t taken = 0;
    for (std::size_t i = 0; i < kPasses; ++i) {
      times.push_back(input_.pass([&](std::span<const can::Frame> batch) {
        taken += synchronous_ ? floor_.receive_synchronous(batch) : floor_.receive(batch);
      }));
    }
    bench::require(taken == kFrames * kPasses && floor_.checksum() != 0, "the floor is broken");
    return bench::median(std::move(times)) / double{kFrames};
  }

 private:
  bool synchronous_;
  std::vector<std::uint32_t> ids_;
  bench::Floor floor_;
  Input input_;
};

// Nothing but SYNC, for the floor.
class FloorSyncSubject {
 public:
  double repetition() {
    std::vector<double> times;
    std::uint64_t taken = 0;
    for (std::size_t i = 0; i < kPasses; ++i) {
      times.push_back(input_.pass(
          [&](std::span<const can::Frame> batch) { taken += floor_.receive_synchronous(batch); }));
    }
    bench::require(taken == 0, "the floor takes PDOs that nobody sent");
    return bench::median(std::move(times)) / double{kFrames};
  }

 private:
  bench::Floor floor_{bench::pdo_identifiers(1)};
  Input input_{std::vector<can::Frame>(kFrames, can::make_frame(0x080)), 0};
};

// The same line, and nothing but SYNC.
class SyncSubject {
 public:
  double repetition() {
    std::vector<double> times;
    const std::uint64_t taken = line_->state().counters.syncs;
    for (std::size_t i = 0; i < kPasses; ++i) {
      times.push_back(input_.pass(
          [this](std::span<const can::Frame> batch) { line_->receive(batch, batch.back().time); }));
    }
    bench::require(line_->state().counters.syncs - taken == kFrames * kPasses,
                   "SYNC was not taken");
    return bench::median(std::move(times)) / double{kFrames};
  }

 private:
  std::vector<std::uint32_t> ids_ = bench::pdo_identifiers(1);
  Input input_{std::vector<can::Frame>(kFrames, can::make_frame(0x080)), 0};
  std::unique_ptr<line::Line> line_ = Subject::make(Mapping::synchronous, ids_, input_.now());
};

// What is left of a figure without its share of the SYNCs.
Contestant without_sync(std::string name, const Contestant& with, const Contestant& sync,
                        std::size_t pdos) {
  Contestant out{std::move(name) + std::to_string(pdos) + " PDOs", {}, {}};
  for (std::size_t i = 0; i < with.figures.size(); ++i) {
    out.figures.push_back(with.figures[i] - sync.figures[i] / static_cast<double>(pdos));
  }
  return out;
}

void print_figures(std::span<const Contestant> figures, std::span<const Contestant> floors) {
  for (std::size_t i = 0; i < figures.size(); ++i) {
    const std::string ratio = std::to_string(bench::median_ratio(figures[i], floors[i]));
    bench::print_figure(figures[i], "ns", ", " + ratio.substr(0, 4) + " x floor");
  }
}

void print_targets(const std::string& name, std::span<const Contestant> figures,
                   std::span<const Contestant> floors) {
  double slowest = 0;
  double ratio = 0;
  for (std::size_t i = 0; i < kSizes; ++i) {
    slowest = std::max(slowest, bench::median(figures[i].figures));
    ratio = std::max(ratio, bench::median_ratio(figures[i], floors[i]));
  }
  bench::print_target(name + ": the slowest", slowest, kMaxNanoseconds, "ns");
  bench::print_target(name + ": to the floor", ratio, 2, "x");
  bench::print_target(name + ": 512 PDOs to 1", bench::median_ratio(figures[2], figures[0]), 1.3,
                      "x");
}

using Subjects = std::vector<std::unique_ptr<Subject>>;

// Of one kind of floor, one for each number of PDOs.
struct Floors {
  explicit Floors(bool synchronous) {
    for (const std::size_t pdos : kPdos)
      subjects.push_back(std::make_unique<FloorSubject>(pdos, synchronous));
  }
  void add_to(std::vector<Contestant>& contestants, const std::string& name) {
    for (std::size_t i = 0; i < kSizes; ++i) {
      contestants.push_back({name + std::to_string(kPdos[i]) + " PDOs",
                             [floor = subjects[i].get()] { return floor->repetition(); },
                             {}});
    }
  }
  std::vector<std::unique_ptr<FloorSubject>> subjects;
};

Subjects add_lines(std::vector<Contestant>& contestants) {
  Subjects lines;
  for (const Case& c : kCases) {
    for (const std::size_t pdos : kPdos) {
      lines.push_back(std::make_unique<Subject>(c, pdos));
      contestants.push_back({std::string(c.name) + ", " + std::to_string(pdos) + " PDOs",
                             [line = lines.back().get()] { return line->repetition(); },
                             {}});
    }
  }
  return lines;
}

}  // namespace

int main() {
  // The lines come first: in memory that others have used and freed SYNC costs 5 % more.
  SyncSubject sync;
  std::vector<Contestant> cases;
  const Subjects lines = add_lines(cases);
  Floors at_once(false);
  Floors held(true);
  FloorSyncSubject floor_sync;
  std::vector<Contestant>
      contestants;  // 3 floors, 3 that wait for SYNC, 3 of each case, SYNC twice
  at_once.add_to(contestants, "floor, ");
  held.add_to(contestants, "floor, synchronous, with SYNC, ");
  contestants.insert(contestants.end(), cases.begin(), cases.end());
  contestants.push_back({"floor, SYNC alone", [&] { return floor_sync.repetition(); }, {}});
  contestants.push_back({"SYNC alone", [&] { return sync.repetition(); }, {}});
  bench::interleave(contestants);

  const auto three = [&](std::size_t i) {
    return std::span(contestants).subspan(kSizes * i, kSizes);
  };
  const auto of_case = [&](std::size_t c) { return three(c + 2); };
  const std::span<const Contestant> floors = three(0);
  const Contestant& sync_alone = contestants.back();
  const Contestant& floor_sync_alone = contestants[contestants.size() - 2];
  std::vector<Contestant> synchronous;
  std::vector<Contestant> synchronous_floors;
  for (std::size_t i = 0; i < kSizes; ++i) {
    synchronous.push_back(
        without_sync("4 x 16 bit, synchronous, ", of_case(2)[i], sync_alone, kPdos[i]));
    synchronous_floors.push_back(
        without_sync("floor, synchronous, ", three(1)[i], floor_sync_alone, kPdos[i]));
  }

  bench::print_heading("Received PDO -> image, through Line::receive in batches of 64");
  for (const auto& group : {floors, std::span<const Contestant>(three(1)),
                            std::span<const Contestant>(synchronous_floors)}) {
    for (const Contestant& floor : group)
      bench::print_figure(floor, "ns");
  }
  bench::print_figure(floor_sync_alone, "ns");
  bench::print_figure(sync_alone, "ns");
  print_figures(of_case(0), floors);
  print_figures(of_case(1), floors);
  print_figures(of_case(2), three(1));
  print_figures(of_case(3), floors);
  print_figures(synchronous, synchronous_floors);
  print_targets("4 x 16 bit", of_case(0), floors);
  print_targets("64 x 1 bit", of_case(1), floors);
  print_targets("4 x 16 bit, synchronous", synchronous, synchronous_floors);
  std::uint64_t allocated = 0;
  for (const auto& line : lines)
    allocated += line->allocations();
  bench::print_target("allocations", static_cast<double>(allocated), 0, "in all");
}
