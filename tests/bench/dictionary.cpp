// SPDX-License-Identifier: Apache-2.0
// Look-up in an object dictionary: find() returns the variable; read() returns its value as for
// SDO, with access rights and hooks checked. Objects of one UNSIGNED32 each, in seeded random
// order.
//
// The floor is a plain array over all indices. The peer is a binary search in a table that is
// sorted by index and sub-index.
#include "stack/od/dictionary.h"

#include <algorithm>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "stack/base/byte_order.h"

#include "tests/bench/allocations.h"
#include "tests/bench/measure.h"
#include "tests/bench/numbered_objects.h"

namespace {

using namespace linegate;
using bench::Contestant;
using bench::value_of;

constexpr std::size_t kLookUps = 4096;
constexpr std::size_t kWays = 4;

struct Objects {
  explicit Objects(std::size_t count) : array(0x10000) {
    for (const std::uint16_t index : bench::random_indices(count, kLookUps)) {
      order.push_back({index, 0});
      sum += value_of(index);
    }
    for (std::size_t i = 0; i < count; ++i) {
      const od::ObjectDescription object = bench::numbered_object(i, od::Access::rw);
      array[object.index] = value_of(object.index);
      sorted.push_back({std::uint32_t{object.index} << 8U, value_of(object.index)});
      bench::require(dictionary.add(object).ok(), "no object");
    }
  }

  // Returns ns per look-up. look_up(address) returns the value.
  template <class LookUp>
  double measure(LookUp look_up) {
    std::uint64_t found = 0;
    const double time = bench::median_time([&] {
      const std::uint64_t before = bench::allocations();
      for (const od::Address address : order) {
        found += look_up(address);
      }
      allocated += bench::allocations() - before;
    });
    bench::require(found == sum * bench::kPasses, "wrong values");
    return time / double{kLookUps};
  }

  double plain_array() {
    return measure([this](od::Address address) { return array[address.index]; });
  }
  double binary_search() {
    return measure([this](od::Address address) {
      const std::uint32_t key = std::uint32_t{address.index} << 8U | address.sub;
      const auto found = std::ranges::lower_bound(sorted, key, {}, &Entry::key);
      return found != sorted.end() && found->key == key ? found->value : 0U;
    });
  }
  double find() {
    return measure([this](od::Address address) {
      const std::optional<od::Variable> variable = dictionary.find(address);
      return variable ? load_le<std::uint32_t>(variable->data) : 0U;
    });
  }
  double read() {
    return measure([this](od::Address address) {
      const Result<std::span<const std::byte>> value = dictionary.read(address);
      return value.ok() ? load_le<std::uint32_t>(value->data()) : 0U;
    });
  }

  struct Entry {
    std::uint32_t key = 0;
    std::uint32_t value = 0;
  };
  std::vector<od::Address> order;
  std::uint64_t sum = 0;
  std::vector<std::uint32_t> array;
  std::vector<Entry> sorted;
  od::Dictionary dictionary;
  std::uint64_t allocated = 0;
};

}  // namespace

int main() {
  std::deque<Objects> dictionaries;
  std::vector<Contestant> contestants;  // kWays for each number of objects, the floor first
  for (const std::size_t count : {std::size_t{10}, std::size_t{1000}, std::size_t{10'000}}) {
    const std::string of = ", " + std::to_string(count) + " objects";
    Objects& objects = dictionaries.emplace_back(count);
    contestants.push_back({"floor: array" + of, [&objects] { return objects.plain_array(); }, {}});
    contestants.push_back(
        {"peer: binary search" + of, [&objects] { return objects.binary_search(); }, {}});
    contestants.push_back({"find" + of, [&objects] { return objects.find(); }, {}});
    contestants.push_back({"read" + of, [&objects] { return objects.read(); }, {}});
  }
  bench::interleave(contestants);

  bench::print_heading("Look-up in the object dictionary");
  std::uint64_t allocated = 0;
  bench::print_beside_floors(contestants, kWays, "ns");
  for (const Objects& objects : dictionaries) {
    allocated += objects.allocated;
  }
  bench::print_target("allocations", static_cast<double>(allocated), 0, "in all");
}
