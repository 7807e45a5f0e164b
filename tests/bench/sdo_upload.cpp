// SPDX-License-Identifier: Apache-2.0
// Expedited SDO upload answered by the line's own server: the request through Line::receive(), the
// answer out of Line::next_frame(), one at a time as a client would. Objects in seeded random
// order.
//
// The floor looks the value up in a table over all indices, and puts the answer through a queue of
// frames: no access rights, hooks, transfers, states, other services.
#include <array>
#include <chrono>
#include <cstring>
#include <deque>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/line/line.h"
#include "stack/od/dictionary.h"

#include "tests/bench/allocations.h"
#include "tests/bench/measure.h"

namespace {

using namespace linegate;
using bench::Contestant;

constexpr std::uint16_t kFirst = 0x2000;
constexpr std::uint8_t kNode = 127;
constexpr std::size_t kRequests = 4096;
constexpr std::size_t kPasses = 16;
constexpr double kMaxNanoseconds = 25;

std::uint32_t value_of(std::uint16_t index) {
  return 0x12340000U + index;
}

std::vector<std::uint16_t> indices(std::size_t objects) {
  std::mt19937 random(7);
  std::vector<std::uint16_t> out;
  for (std::size_t i = 0; i < kRequests; ++i) {
    out.push_back(static_cast<std::uint16_t>(kFirst + random() % objects));
  }
  return out;
}

// The request is always in the same place, as in the buffer of a socket.
template <class Exchange>
double measure(const std::vector<std::uint16_t>& order, std::uint64_t& allocated,
               Exchange exchange) {
  can::Frame request = can::make_frame(can::kSdoRequestBase + kNode, {0x40, 0, 0, 0, 0, 0, 0, 0});
  std::array<double, kPasses> times{};
  std::uint64_t sum = 0;
  const std::uint64_t before = bench::allocations();
  for (double& time : times) {
    const auto begin = std::chrono::steady_clock::now();
    for (const std::uint16_t index : order) {
      store_le(request.data.data(), std::uint64_t{0x40} | std::uint64_t{index} << 8U);
      request.time += std::chrono::microseconds(250);
      sum += exchange(request);
    }
    const std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - begin;
    time = spent.count();
  }
  allocated += bench::allocations() - before;
  std::uint64_t expected = 0;
  for (const std::uint16_t index : order) {
    expected += value_of(index);
  }
  bench::require(sum == expected * kPasses, "wrong answers");
  return bench::median({times.begin(), times.end()}) / double{kRequests};
}

class Subject {
 public:
  explicit Subject(std::size_t objects) : order_(indices(objects)) {
    line::LineConfig config;
    config.name = "bench";
    config.bit_rate = 1'000'000;
    config.node_id = kNode;
    auto made = line::Line::make(config);
    bench::require(made.ok(), "no line");
    line_ = *std::move(made.value);
    for (std::size_t i = 0; i < objects; ++i) {
      add(static_cast<std::uint16_t>(kFirst + i));
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
  void add(std::uint16_t index) {
    od::ObjectDescription object{.index = index, .name = "Value"};
    object.variables.push_back({.sub = 0,
                                .name = "Value",
                                .type = od::DataType::unsigned32,
                                .access = od::Access::ro,
                                .value = std::vector<std::byte>(4)});
    store_le(std::span(object.variables[0].value), std::uint64_t{value_of(index)});
    bench::require(line_->dictionary().add(object).ok(), "no object");
  }

  std::vector<std::uint16_t> order_;
  std::unique_ptr<line::Line> line_;
  can::Frame answer_;
  std::uint64_t allocations_ = 0;
};

class FloorSubject {
 public:
  explicit FloorSubject(std::size_t objects) : order_(indices(objects)), place_(0x10000) {
    for (std::size_t i = 0; i < objects; ++i) {
      const auto index = static_cast<std::uint16_t>(kFirst + i);
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
  for (std::size_t i = 0; i < contestants.size(); ++i) {
    const double ratio = bench::median_ratio(contestants[i], contestants[i & ~std::size_t{1}]);
    bench::print_figure(contestants[i], "ns",
                        i % 2 == 0 ? "" : ", " + std::to_string(ratio).substr(0, 4) + " x floor");
  }
  for (const std::size_t i : {std::size_t{1}, std::size_t{3}}) {
    bench::print_target(contestants[i].name, bench::median(contestants[i].figures), kMaxNanoseconds,
                        "ns");
  }
  bench::print_target("allocations",
                      static_cast<double>(lines[0].allocations() + lines[1].allocations()), 0,
                      "in all");
}
