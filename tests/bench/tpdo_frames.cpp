// SPDX-License-Identifier: Apache-2.0
// Value changed -> frame out: a value is set in the dictionary of a node with 4 x UNSIGNED16 in
// each TPDO, and the frame is taken from Node::next_frame(). By object: the dictionary looks up the
// value, and auto-notify looks up its TPDO. By handle (pdo::TpdoValue): both are known, and so is
// the engine of the node. One value and its frame at a time; or all TPDOs at once: one value of
// each, then all frames in the order of the bus. TPDOs in seeded random order.
//
// The floor looks up the place of a value in a table, compares, and keeps a frame for each TPDO and
// a bit for each frame to send, in the order of the bus. It has no dictionary, access rights,
// hooks, inhibit times, timers, states or other services.
#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <deque>
#include <memory>
#include <numeric>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/node/node.h"

#include "tests/bench/allocations.h"
#include "tests/bench/measure.h"
#include "tests/bench/pdo_line.h"

namespace {

using namespace linegate;
using bench::Contestant;

constexpr std::uint16_t kFirst = 0x2000;
constexpr std::size_t kChanges = 4096;
constexpr std::size_t kPasses = 16;
constexpr std::uint8_t kValues = 4;  // in each TPDO

using Ways = std::vector<std::size_t>;  // number of changes before the frames are taken

struct Change {
  std::uint16_t pdo = 0;
  std::uint8_t sub = 1;  // 1..kValues
};

// Cycles that contain each TPDO once.
std::vector<Change> changes(std::size_t pdos) {
  std::mt19937 random(11);
  std::vector<std::uint16_t> order(pdos);
  std::iota(order.begin(), order.end(), std::uint16_t{0});
  std::vector<Change> out;
  while (out.size() < kChanges) {
    std::shuffle(order.begin(), order.end(), random);
    for (const std::uint16_t pdo : order) {
      out.push_back({pdo, static_cast<std::uint8_t>(1 + random() % kValues)});
    }
  }
  out.resize(kChanges);
  return out;
}

// at_once: number of changes before the frames are taken, a divisor of kChanges. Returns ns per
// frame.
template <class Sender>
double measure(const std::vector<Change>& order, std::size_t at_once, Sender& sender,
               std::uint64_t& allocated) {
  std::array<double, kPasses> times{};
  std::uint64_t frames = 0;
  std::uint64_t sum = 0;
  std::uint64_t expected = 0;
  can::Frame frame;
  const std::uint64_t before = bench::allocations();
  for (double& time : times) {
    const auto begin = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < order.size(); i += at_once) {
      for (std::size_t j = i; j < i + at_once; ++j) {
        const std::uint16_t value = ++sender.last;
        sender.change(order[j], value);
        expected += value;
      }
      while (sender.next_frame(frame)) {
        ++frames;
        sum += sender.news(frame);
      }
    }
    const std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - begin;
    time = spent.count();
  }
  allocated += bench::allocations() - before;
  bench::require(frames == order.size() * kPasses,
                 "the number of frames differs from that of changes");
  bench::require(sum == expected, "wrong values");
  return bench::median({times.begin(), times.end()}) / static_cast<double>(order.size());
}

// Finds the new value in a frame. Both sides include its cost.
class Values {
 public:
  explicit Values(std::span<const std::uint32_t> ids) : pdo_of_(0x800), changed_(ids.size()) {
    for (std::size_t i = 0; i < ids.size(); ++i) {
      pdo_of_[ids[i]] = static_cast<std::uint16_t>(i);
    }
  }
  void changed(Change which) { changed_[which.pdo] = which.sub; }
  std::uint64_t news(const can::Frame& frame) const {
    const std::uint16_t pdo = pdo_of_[frame.id];
    return load_le<std::uint16_t>(frame.data.data() + 2 * (changed_[pdo] - 1));
  }

 private:
  std::vector<std::uint16_t> pdo_of_;
  std::vector<std::uint8_t> changed_;
};

class Subject {
 public:
  explicit Subject(std::span<const std::uint32_t> ids, bool auto_notify = true) : values_(ids) {
    od::DeviceDescription device;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      add_pdo(device, static_cast<std::uint16_t>(i), ids[i]);
    }
    std::ranges::sort(device.objects, {}, &od::ObjectDescription::index);
    node_ = std::make_unique<node::Node>(
        od::Dictionary(device),
        node::Options{.node_id = 1, .self_starting = true, .auto_notify = auto_notify}, events_,
        nullptr);
    node_->start(now_);
    for (can::Frame frame; node_->next_frame(frame, now_);) {
    }
  }

  void change(Change which, std::uint16_t value) {
    values_.changed(which);
    node_->dictionary().set(address(which), value);
  }
  bool next_frame(can::Frame& out) { return node_->next_frame(out, now_); }
  std::uint64_t news(const can::Frame& frame) const { return values_.news(frame); }

  std::uint16_t last = 0;  // last value that was set

 protected:
  static od::Address address(Change which) {
    return {static_cast<std::uint16_t>(kFirst + which.pdo), which.sub};
  }
  node::Node& node() { return *node_; }
  void note(Change which) { values_.changed(which); }

 private:
  static od::VariableDescription variable(std::uint8_t sub, od::DataType type, od::Access access,
                                          std::uint64_t value) {
    od::VariableDescription out{.sub = sub, .name = "Value", .type = type, .access = access};
    out.value.resize(od::byte_size(type));
    store_le(std::span(out.value), value);
    return out;
  }
  static void add_pdo(od::DeviceDescription& device, std::uint16_t pdo, std::uint32_t id) {
    using enum od::DataType;
    constexpr auto kRecord = od::ObjectType::record;
    const auto index = static_cast<std::uint16_t>(kFirst + pdo);
    od::ObjectDescription values{.index = index, .name = "Values", .type = kRecord};
    od::ObjectDescription mapping{
        .index = static_cast<std::uint16_t>(0x1A00 + pdo), .name = "Mapping", .type = kRecord};
    mapping.variables = {variable(0, unsigned8, od::Access::rw, kValues)};
    for (std::uint8_t sub = 1; sub <= kValues; ++sub) {
      values.variables.push_back(variable(sub, unsigned16, od::Access::ro, 0));
      values.variables.back().mappable = true;
      mapping.variables.push_back(
          variable(sub, unsigned32, od::Access::rw,
                   std::uint64_t{index} << 16U | std::uint64_t{sub} << 8U | 16U));
    }
    od::ObjectDescription communication{.index = static_cast<std::uint16_t>(0x1800 + pdo),
                                        .name = "Communication",
                                        .type = kRecord};
    communication.variables = {variable(0, unsigned8, od::Access::constant, 2),
                               variable(1, unsigned32, od::Access::rw, id),
                               variable(2, unsigned8, od::Access::rw, 255)};
    device.objects.insert(device.objects.end(), {values, mapping, communication});
  }

  Values values_;
  EventLog events_;
  Instant now_{std::chrono::seconds(1)};
  std::unique_ptr<node::Node> node_;
};

class HandleSubject : public Subject {
 public:
  explicit HandleSubject(std::span<const std::uint32_t> ids) : Subject(ids, false) {
    for (std::uint16_t pdo = 0; pdo < ids.size(); ++pdo) {
      for (std::uint8_t sub = 1; sub <= kValues; ++sub) {
        const auto handle = node().pdos().value(address({pdo, sub}));
        bench::require(handle.has_value(), "a value is in no TPDO");
        handles_.push_back(*handle);
      }
    }
  }

  void change(Change which, std::uint16_t value) {
    note(which);
    (void)pdos_.set(handles_[std::size_t{kValues} * which.pdo + which.sub - 1], value);
  }

 private:
  pdo::Engine& pdos_ = node().pdos();
  std::vector<pdo::TpdoValue> handles_;
};

class FloorSubject {
 public:
  explicit FloorSubject(std::span<const std::uint32_t> ids)
      : values_(ids),
        place_(0x10000),
        rank_(ids.size()),
        frames_(ids.size()),
        pending_((ids.size() + 63) / 64) {
    std::vector<std::uint16_t> by_rank(ids.size());
    std::iota(by_rank.begin(), by_rank.end(), std::uint16_t{0});
    std::ranges::sort(by_rank, {}, [&](std::uint16_t pdo) { return ids[pdo]; });
    for (std::uint16_t rank = 0; rank < by_rank.size(); ++rank) {
      const std::uint16_t pdo = by_rank[rank];
      rank_[pdo] = rank;
      frames_[rank].id = ids[pdo];
      frames_[rank].length = 8;
      place_[kFirst + std::size_t{pdo}] = pdo;
    }
  }

  [[gnu::noinline]] void change(Change which, std::uint16_t value) {
    values_.changed(which);
    const std::uint16_t rank = rank_[place_[kFirst + std::size_t{which.pdo}]];
    std::byte* const at = frames_[rank].data.data() + 2 * (which.sub - 1);
    if (load_le<std::uint16_t>(at) != value) {
      store_le(at, value);
      pending_[rank / 64] |= std::uint64_t{1} << rank % 64;
    }
  }
  [[gnu::noinline]] bool next_frame(can::Frame& out) {
    for (std::size_t word = 0; word < pending_.size(); ++word) {
      if (pending_[word] != 0) {
        out = frames_[64 * word + static_cast<std::size_t>(std::countr_zero(pending_[word]))];
        pending_[word] &= pending_[word] - 1;
        return true;
      }
    }
    return false;
  }
  std::uint64_t news(const can::Frame& frame) const { return values_.news(frame); }

  std::uint16_t last = 0;  // last value that was set

 private:
  Values values_;
  std::vector<std::uint16_t> place_;
  std::vector<std::uint16_t> rank_;
  std::vector<can::Frame> frames_;
  std::vector<std::uint64_t> pending_;
};

struct Budget {
  std::size_t pdos;
  double by_object;  // times the floor, one at a time
  double by_handle;
};
constexpr Budget kBudgets[] = {{1, 3.5, 1.7}, {64, 3.5, 1.7}, {512, 1.5, 1.2}};
constexpr std::size_t kSides = 3;  // floor, by object, by handle

// The contestants of one row, the floor first.
void enter(std::vector<Contestant>& contestants, const std::string& of,
           const std::vector<Change>& order, std::size_t at_once, std::uint64_t& ignored,
           std::uint64_t& allocated, FloorSubject& floor, Subject& object, HandleSubject& handle) {
  contestants.push_back(
      {"floor, " + of,
       [&order, &floor, &ignored, at_once] { return measure(order, at_once, floor, ignored); },
       {}});
  contestants.push_back({"by object, " + of,
                         [&order, &object, &allocated, at_once] {
                           return measure(order, at_once, object, allocated);
                         },
                         {}});
  contestants.push_back({"by handle, " + of,
                         [&order, &handle, &allocated, at_once] {
                           return measure(order, at_once, handle, allocated);
                         },
                         {}});
}

}  // namespace

int main() {
  std::deque<Subject> objects;
  std::deque<HandleSubject> handles;
  std::deque<FloorSubject> floors;
  std::deque<std::vector<Change>> orders;
  std::uint64_t allocated = 0;
  std::uint64_t ignored = 0;
  // kSides for each combination of a number of TPDOs and a way.
  std::vector<Contestant> contestants;
  for (const Budget& budget : kBudgets) {
    const std::vector<std::uint32_t> ids = bench::pdo_identifiers(budget.pdos);
    FloorSubject& floor = floors.emplace_back(ids);
    Subject& object = objects.emplace_back(ids);
    HandleSubject& handle = handles.emplace_back(ids);
    const std::vector<Change>& order = orders.emplace_back(changes(budget.pdos));
    for (const std::size_t at_once : budget.pdos == 1 ? Ways{1} : Ways{1, budget.pdos}) {
      const std::string of = std::to_string(budget.pdos) + " TPDOs, " +
                             (at_once == 1 ? "one at a time" : "all at once");
      enter(contestants, of, order, at_once, ignored, allocated, floor, object, handle);
    }
  }
  bench::interleave(contestants);

  bench::print_heading("Value set -> frame of its TPDO out, per frame");
  for (std::size_t i = 0; i < contestants.size(); ++i) {
    const double ratio = bench::median_ratio(contestants[i], contestants[i - i % kSides]);
    bench::print_figure(
        contestants[i], "ns",
        i % kSides == 0 ? "" : ", " + std::to_string(ratio).substr(0, 4) + " x floor");
  }
  std::size_t row = 0;
  for (const Budget& budget : kBudgets) {
    const Contestant* const sides = &contestants[kSides * row];
    const std::string pdos = std::to_string(budget.pdos) + " TPDOs, one at a time: ";
    bench::print_target(pdos + "by object", bench::median_ratio(sides[1], sides[0]),
                        budget.by_object, "x floor");
    bench::print_target(pdos + "by handle", bench::median_ratio(sides[2], sides[0]),
                        budget.by_handle, "x floor");
    row += budget.pdos == 1 ? 1 : 2;
  }
  bench::print_target("allocations", static_cast<double>(allocated), 0, "in all");
}
