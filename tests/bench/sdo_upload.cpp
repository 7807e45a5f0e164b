// SPDX-License-Identifier: Apache-2.0
// Expedited SDO upload answered by the line's own server: the request through Line::receive(), the
// answer from Line::next_frame(), one at a time like a client. Objects in seeded random order.
//
// The floor looks up the value in a table over all indices, and puts the answer through a queue of
// frames. It has no access rights, hooks, transfers, states or other services.
#include <array>
#include <chrono>
#include <cstring>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/line/line.h"
#include "stack/od/dictionary.h"

#include "tests/bench/allocations.h"
#include "tests/bench/measure.h"
#include "tests/bench/numbered_objects.h"

namespace {

using namespace linegate;
using bench::Contestant;
using bench::value_of;

constexpr std::uint8_t kNode = 127;
constexpr std::size_t kRequests = 4096;
constexpr double kMaxNanoseconds = 25;

// The request is always at the same address, as in the buffer of a socket.
template <class Exchange>
double measure(const std::vector<std::uint16_t>& order, std::uint64_t& allocated,
               Exchange exchange) {
  can::Frame request = can::make_frame(can::kSdoRequestBase + kNode, {0x40, 0, 0, 0, 0, 0, 0, 0});
  std::uint64_t sum = 0;
  const double time = bench::median_time([&] {
    const std::uint64_t before = bench::allocations();
    for (const std::uint16_t index : order) {
      store_le(request.data.data(), std::uint64_t{0x40} | std::uint64_t{index} << 8U);
      request.time += std::chrono::microseconds(250);
      sum += exchange(request);
    }
    allocated += bench::allocations() - before;
  });
  std::uint64_t expected = 0;
  for (const std::uint16_t index : order) {
    expected += value_of(index);
  }
  bench::require(sum == expected * bench::kPasses, "wrong answers");
  return time / double{kRequests};
}

class Subject {
 public:
  explicit Subject(std::size_t objects) : order_(bench::random_indices(objects, kRequests)) {
    line::LineConfig config;
    config.name = "bench";
    config.bit_rate = 1'000'000;
    config.node_id = kNode;
    auto made = line::Line::make(config);
    bench::require(made.ok(), "no line");
    line_ = *std::move(made.value);
    for (std::size_t i = 0; i < objects; ++i) {
      bench::require(line_->dictionary().add(bench::numbered_object(i, od::Access::ro)).ok(),
                     "no object");
    }
    line_->start(Instant{});
    for (can::Frame frame; line_->next_frame(frame, Instant{});) {
    }
  }

  double repetition() {
    return measure(order_, allocations_, [this](const can::Frame& request) {
      line_->receive(std::span(&request, 1), request.time);
      return line_->next_frame(answer_, request.time)
                 ? load_le<std::uint32_t>(answer_.data.data() + 4)
                 : 0U;
    });
  }

  std::uint64_t allocations() const { return allocations_; }

 private:
  std::vector<std::uint16_t> order_;
  std::unique_ptr<line::Line> line_;
  can::Frame answer_;
  std::uint64_t allocations_ = 0;
};

class FloorSubject {
 public:
  explicit FloorSubject(std::size_t objects)
      : order_(bench::random_indices(objects, kRequests)), place_(0x10000) {
    for (std::size_t i = 0; i < objects; ++i) {
      const auto index = static_cast<std::uint16_t>(bench::kFirstObject + i);
      place_[index] = static_cast<std::uint32_t>(values_.size());
      values_.push_back(value_of(index));
    }
  }

  double repetition() {
    return measure(order_, allocations_, [this](const can::Frame& request) {
      receive(request);
      return next_frame(answer_) ? load_le<std::uint32_t>(answer_.data.data() + 4) : 0U;
    });
  }

 private:
  [[gnu::noinline]] void receive(const can::Frame& request) {
    can::Frame& answer = queue_[tail_++ % queue_.size()];
    const auto word = load_le<std::uint64_t>(request.data.data());
    const std::uint64_t value = values_[place_[word >> 8U & 0xFFFFU]];
    answer.id = can::kSdoResponseBase + kNode;
    answer.length = 8;
    answer.flags = 0;
    store_le(answer.data.data(), 0x43U | (word & 0xFFFFFF00U) | value << 32U);
  }
  [[gnu::noinline]] bool next_frame(can::Frame& out) {
    if (head_ == tail_) {
      return false;
    }
    out = queue_[head_++ % queue_.size()];
    return true;
  }

  std::vector<std::uint16_t> order_;
  std::vector<std::uint32_t> place_;
  std::vector<std::uint32_t> values_;
  std::array<can::Frame, 256> queue_{};
  std::size_t head_ = 0;
  std::size_t tail_ = 0;
  can::Frame answer_;
  std::uint64_t allocations_ = 0;
};

}  // namespace

int main() {
  std::deque<Subject> lines;
  std::deque<FloorSubject> floors;
  std::vector<Contestant> contestants;  // floor and line, for each number of objects
  for (const std::size_t objects : {std::size_t{10}, std::size_t{10'000}}) {
    const std::string of = std::to_string(objects) + " objects";
    floors.emplace_back(objects);
    lines.emplace_back(objects);
    contestants.push_back(
        {"floor, " + of, [&floor = floors.back()] { return floor.repetition(); }, {}});
    contestants.push_back({of, [&line = lines.back()] { return line.repetition(); }, {}});
  }
  bench::interleave(contestants);

  bench::print_heading("Expedited SDO upload answered by the server, one at a time");
  bench::print_beside_floors(contestants, 2, "ns");
  for (const std::size_t i : {std::size_t{1}, std::size_t{3}}) {
    bench::print_target(contestants[i].name, bench::median(contestants[i].figures), kMaxNanoseconds,
                        "ns");
  }
  bench::print_target("allocations",
                      static_cast<double>(lines[0].allocations() + lines[1].allocations()), 0,
                      "in all");
}
