// SPDX-License-Identifier: Apache-2.0
// Compares measurements: one repetition of each in turn, in a seeded random order, with medians
// over all. A disturbance of the machine then affects both sides of a ratio alike.
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
  // Runs one repetition and returns its figure, for example ns per frame.
  std::function<double()> once;
  std::vector<double> figures;  // one per repetition
};

// Runs one warm-up repetition of each, then `repetitions` that count.
void interleave(std::vector<Contestant>& contestants, int repetitions = kRepetitions);

double median(std::vector<double> values);
// part: 0..1. Of at least one value.
double percentile(std::vector<double> values, double part);
// The time that `pass` takes, in ns: the median of kPasses runs.
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
// The median of the ratios within each repetition.
double median_ratio(const Contestant& of, const Contestant& to);

// --- printing -----------------------------------------------------------------------------------

void print_heading(std::string_view text);
// Prints "name   12.3 ns" and a note.
void print_figure(const Contestant& contestant, std::string_view unit, std::string_view note = {});
// Prints the figures of contestants in groups of `size`. The first of each group is the floor of
// the others.
void print_beside_floors(const std::vector<Contestant>& contestants, std::size_t size,
                         std::string_view unit);
// Prints a figure of the budget with its limit, and whether it is met.
void print_target(std::string_view what, double figure, double limit, std::string_view unit);
// Ends the program with the sentence `otherwise` if a measurement would not be valid.
void require(bool condition, std::string_view otherwise);

}  // namespace linegate::bench
