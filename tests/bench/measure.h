// SPDX-License-Identifier: Apache-2.0
// Measuring things against each other: one repetition of each in turn, in a seeded random order,
// medians over all. A disturbance of the machine then hits both sides of a ratio alike.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace linegate::bench {

inline constexpr int kRepetitions = 31;

struct Contestant {
  std::string name;
  std::function<double()> once;  // one repetition; gives its figure, for example ns per frame
  std::vector<double> figures;   // one per repetition
};

// One repetition of each that does not count, then `repetitions` that do.
void interleave(std::vector<Contestant>& contestants, int repetitions = kRepetitions);

double median(std::vector<double> values);
// The time that `pass` takes, ns: the median of kPasses.
inline constexpr std::size_t kPasses = 16;
template <class Pass>
double median_time(Pass pass) {
  std::vector<double> times;
  for (std::size_t i = 0; i < kPasses; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    pass();
    times.push_back(
        std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - begin).count());
  }
  return median(std::move(times));
}
// Median of the ratios within one repetition each.
double median_ratio(const Contestant& of, const Contestant& to);

// --- printing
// -------------------------------------------------------------------------------------

void print_heading(std::string_view text);
// "name   12.3 ns" and what may follow it.
void print_figure(const Contestant& contestant, std::string_view unit, std::string_view note = {});
// Figures of contestants in groups of `size`, each beside the first of its group, which is a floor.
void print_beside_floors(const std::vector<Contestant>& contestants, std::size_t size,
                         std::string_view unit);
// A figure of the budget with its limit, and whether it is met.
void print_target(std::string_view what, double figure, double limit, std::string_view unit);
// Ends the program with that sentence if a measurement would not mean what it says.
void require(bool condition, std::string_view otherwise);

}  // namespace linegate::bench
