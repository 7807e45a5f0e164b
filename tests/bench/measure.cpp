// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/measure.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <random>

namespace linegate::bench {

void interleave(std::vector<Contestant>& contestants, int repetitions) {
  std::mt19937 random(1);
  std::vector<Contestant*> order;
  for (Contestant& contestant : contestants) {
    order.push_back(&contestant);
    (void)contestant.once();
  }
  for (int i = 0; i < repetitions; ++i) {
    std::shuffle(order.begin(), order.end(), random);
    for (Contestant* contestant : order) {
      contestant->figures.push_back(contestant->once());
    }
  }
}

double percentile(std::vector<double> values, double part) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double median_ratio(const Contestant& of, const Contestant& to) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < of.figures.size(); ++i) {
    ratios.push_back(of.figures[i] / to.figures[i]);
  }
  return median(std::move(ratios));
}

void print_heading(std::string_view text) {
  std::printf("\n%.*s\n", static_cast<int>(text.size()), text.data());
}

void print_figure(const Contestant& contestant, std::string_view unit, std::string_view note) {
  std::printf("    %-52s %9.2f %.*s%.*s\n", contestant.name.c_str(), median(contestant.figures),
              static_cast<int>(unit.size()), unit.data(), static_cast<int>(note.size()),
              note.data());
  std::fflush(stdout);
}

void print_beside_floors(const std::vector<Contestant>& contestants, std::size_t size,
                         std::string_view unit) {
  for (std::size_t i = 0; i < contestants.size(); ++i) {
    const double ratio = median_ratio(contestants[i], contestants[i - i % size]);
    print_figure(contestants[i], unit,
                 i % size == 0 ? "" : ", " + std::to_string(ratio).substr(0, 4) + " x floor");
  }
}

void print_target(std::string_view what, double figure, double limit, std::string_view unit) {
  std::printf("  %-3s %-50s   %9.2f %.*s, budget <= %.2f\n", figure <= limit ? "met" : "NOT",
              std::string(what).c_str(), figure, static_cast<int>(unit.size()), unit.data(), limit);
  std::fflush(stdout);
}

void require(bool condition, std::string_view otherwise) {
  if (!condition) {
    std::fprintf(stderr, "cannot be measured: %.*s\n", static_cast<int>(otherwise.size()),
                 otherwise.data());
    std::exit(1);
  }
}

}  // namespace linegate::bench
