// Received PDO -> image, through the whole of Line::receive(): 8 bytes, batches of 64, 4096 frames
// in seeded random order, half of their bytes changing, deadlines on. Beside the floor
// (pdo_to_image_floor.h). Figures are nanoseconds per PDO frame.
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

constexpr std::size_t kFrames = 4096;
constexpr std::size_t kBatch = 64;
constexpr std::size_t kPasses = 32;                              // over all frames, per repetition
constexpr Duration kFrameTime = std::chrono::microseconds(114);  // of a full bus at 1 Mbit/s
constexpr double kMaxNanoseconds = 15;

double nanoseconds(std::chrono::steady_clock::duration time) {
  return std::chrono::duration<double, std::nano>(time).count();
}

// Batches of 64 PDOs; with SYNC each ends with a 65th frame, which is SYNC.
class Input {
 public:
  Input(std::vector<can::Frame> pdos, bool sync) : size_(kBatch + (sync ? 1 : 0)) {
    for (std::size_t i = 0; i < pdos.size(); ++i) {
      frames_.push_back(pdos[i]);
      if (sync && i % kBatch == kBatch - 1) {
        frames_.push_back(can::make_frame(0x080));
      }
    }
  }

  Instant stamp() {
    for (can::Frame& frame : frames_) {
      frame.time = now_ += kFrameTime;
    }
    return now_;
  }

  template <class Receive>
  double pass(Receive receive) {
    stamp();
    const auto begin = std::chrono::steady_clock::now();
    for (std::size_t at = 0; at < frames_.size(); at += size_) {
      receive(std::span(frames_).subspan(at, size_));
    }
    return nanoseconds(std::chrono::steady_clock::now() - begin);
  }

  Instant now() const { return now_; }

 private:
  std::size_t size_;
  std::vector<can::Frame> frames_;
  Instant now_{std::chrono::seconds(1)};
};

class Subject {
 public:
  Subject(Mapping mapping, std::size_t pdos)
      : ids_(bench::pdo_identifiers(pdos)),
        input_(bench::pdo_frames(ids_, kFrames), mapping == Mapping::synchronous) {
    auto made = line::Line::make(bench::pdo_line(mapping, ids_));
    bench::require(made.ok(), made.diagnostics.empty() ? "" : made.diagnostics.front().text);
    line_ = *std::move(made.value);
    line_->start(input_.now());
    repetition(1);
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
    const auto frames = kFrames * passes;
    bench::require(line_->state().counters.rpdos - taken == frames, "PDOs were not taken");
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
  explicit FloorSubject(std::size_t pdos)
      : ids_(bench::pdo_identifiers(pdos)),
        floor_(ids_),
        input_(bench::pdo_frames(ids_, kFrames), false) {}

  double repetition() {
    std::vector<double> times;
    std::uint64_t taken = 0;
    for (std::size_t i = 0; i < kPasses; ++i) {
      times.push_back(
          input_.pass([&](std::span<const can::Frame> batch) { taken += floor_.receive(batch); }));
    }
    bench::require(taken == kFrames * kPasses && floor_.checksum() != 0, "the floor is broken");
    return bench::median(std::move(times)) / double{kFrames};
  }

 private:
  std::vector<std::uint32_t> ids_;
  bench::Floor floor_;
  Input input_;
};

struct Case {
  Mapping mapping;
  const char* name;
};
constexpr Case kCases[] = {{Mapping::event_driven, "4 x 16 bit"},
                           {Mapping::synchronous, "4 x 16 bit, synchronous"},
                           {Mapping::bits, "64 x 1 bit"}};
constexpr std::size_t kPdos[] = {1, 64, 512};

}  // namespace

int main() {
  std::vector<std::unique_ptr<Subject>> lines;
  std::vector<std::unique_ptr<FloorSubject>> floors;
  std::vector<Contestant> contestants;  // 3 floors, then 3 of each case
  for (const std::size_t pdos : kPdos) {
    floors.push_back(std::make_unique<FloorSubject>(pdos));
    contestants.push_back({"floor, " + std::to_string(pdos) + " PDOs",
                           [floor = floors.back().get()] { return floor->repetition(); },
                           {}});
  }
  for (const Case& c : kCases) {
    for (const std::size_t pdos : kPdos) {
      lines.push_back(std::make_unique<Subject>(c.mapping, pdos));
      contestants.push_back({std::string(c.name) + ", " + std::to_string(pdos) + " PDOs",
                             [line = lines.back().get()] { return line->repetition(); },
                             {}});
    }
  }
  bench::interleave(contestants);

  bench::print_heading("Received PDO -> image, through Line::receive in batches of 64");
  for (std::size_t i = 0; i < contestants.size(); ++i) {
    const std::string ratio =
        std::to_string(bench::median_ratio(contestants[i], contestants[i % 3]));
    bench::print_figure(contestants[i], "ns", i < 3 ? "" : ", " + ratio.substr(0, 4) + " x floor");
  }
  for (std::size_t c = 0; c < std::size(kCases); ++c) {
    const std::string name = kCases[c].name;
    const std::span<const Contestant> of_case = std::span(contestants).subspan(3 + 3 * c, 3);
    double slowest = 0;
    double ratio = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      slowest = std::max(slowest, bench::median(of_case[i].figures));
      ratio = std::max(ratio, bench::median_ratio(of_case[i], contestants[i]));
    }
    bench::print_target(name + ": the slowest", slowest, kMaxNanoseconds, "ns");
    bench::print_target(name + ": to the floor", ratio, 2, "x");
    bench::print_target(name + ": 512 PDOs to 1", bench::median_ratio(of_case[2], of_case[0]), 1.3,
                        "x");
    if (kCases[c].mapping == Mapping::synchronous) {
      // Of 64 frames of one PDO SYNC finds only the last; of 64 PDOs, most.
      bench::print_target(name + ": 512 PDOs to 64", bench::median_ratio(of_case[2], of_case[1]),
                          1.3, "x");
    }
  }
  std::uint64_t allocated = 0;
  for (const auto& line : lines) {
    allocated += line->allocations();
  }
  bench::print_target("allocations", static_cast<double>(allocated), 0, "in all");
}
