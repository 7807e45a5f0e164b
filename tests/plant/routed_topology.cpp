// SPDX-License-Identifier: Apache-2.0
// The connections between networks, and the shortest routes.
#include <algorithm>
#include <cstddef>
#include <deque>
#include <numeric>
#include <random>
#include <vector>

#include "tests/plant/routed_world.h"

namespace linegate::plant {

// First a chain, so that there is a route over three gateways; then branches, then possibly a ring.
Topology Topology::random(std::size_t networks, std::mt19937_64& chance) {
  Topology out;
  out.networks = networks;
  std::size_t made = 1;
  while (made < networks) {
    std::vector<std::size_t> open;
    for (std::size_t network = 0; network < made; ++network) {
      if (out.processes_on(network).size() < 2) {
        open.push_back(network);
      }
    }
    const bool chain = out.processes.size() < 4;
    const std::size_t from = chain ? made - 1 : open[chance() % open.size()];
    const std::size_t more = chain ? 1 : 1 + chance() % 3;
    std::vector<std::size_t> joined = {from};
    while (joined.size() <= more && made < networks) {
      joined.push_back(made++);
    }
    out.processes.push_back(joined);
  }
  std::vector<std::size_t> ends;
  for (std::size_t network = 0; network < networks; ++network) {
    if (out.processes_on(network).size() < 2) {
      ends.push_back(network);
    }
  }
  if (ends.size() >= 2 && out.distances(ends.front())[ends.back()] > 5) {
    out.processes.push_back({ends.front(), ends.back()});
  }
  out.find_ways();
  return out;
}

void Topology::make_leaves_fd(std::mt19937_64& chance) {
  for (std::size_t network = 0; network < networks; ++network) {
    if (processes_on(network).size() == 1 && (fd.empty() || chance() % 3 != 0)) {
      fd.insert(network);
    }
  }
}

Topology Topology::ring(std::size_t networks) {
  Topology out;
  out.networks = networks;
  for (std::size_t network = 0; network < networks; ++network) {
    out.processes.push_back({network, (network + 1) % networks});
  }
  out.find_ways();
  return out;
}

Topology Topology::redundant(std::size_t networks, std::mt19937_64& chance) {
  Topology out;
  out.networks = networks;
  for (std::size_t network = 0; network + 1 < networks; ++network) {
    const std::size_t copies = network % 2 == 1 ? 2 + chance() % 2 : 1;
    for (std::size_t i = 0; i < copies; ++i) {
      out.processes.push_back({network, network + 1});
    }
  }
  out.find_ways();
  return out;
}

std::vector<std::size_t> Topology::twins_of(std::size_t process) const {
  std::vector<std::size_t> out;
  for (std::size_t other = 0; other < processes.size(); ++other) {
    if (other != process && processes[other] == processes[process]) {
      out.push_back(other);
    }
  }
  return out;
}

std::vector<std::size_t> Topology::next_gateways(std::size_t network, std::size_t to,
                                                 std::size_t process) const {
  std::vector<std::size_t> out;
  for (const std::size_t other : processes_on(network)) {
    const auto nearer = [&](std::size_t beyond) {
      return way(beyond, to).gateways + 1 == way(network, to).gateways;
    };
    if (other != process && std::ranges::any_of(processes[other], nearer)) {
      out.push_back(other);
    }
  }
  return out;
}

std::vector<std::size_t> Topology::processes_on_way(std::size_t from, std::size_t to) const {
  std::vector<std::size_t> out;
  while (from != to) {
    out.push_back(way(from, to).first);
    const auto& joined = processes[out.back()];
    from = *std::ranges::min_element(
        joined, {}, [&](std::size_t network) { return way(network, to).gateways; });
  }
  return out;
}

std::vector<std::size_t> Topology::processes_on(std::size_t network) const {
  std::vector<std::size_t> out;
  for (std::size_t process = 0; process < processes.size(); ++process) {
    if (std::ranges::find(processes[process], network) != processes[process].end()) {
      out.push_back(process);
    }
  }
  return out;
}

std::vector<std::size_t> Topology::distances(std::size_t to) const {
  std::vector<std::size_t> distance(networks, networks + 1);
  std::deque<std::size_t> next = {to};
  distance[to] = 0;
  while (!next.empty()) {
    const std::size_t at = next.front();
    next.pop_front();
    for (const std::size_t process : processes_on(at)) {
      for (const std::size_t beyond : processes[process]) {
        if (distance[beyond] > distance[at] + 1) {
          distance[beyond] = distance[at] + 1;
          next.push_back(beyond);
        }
      }
    }
  }
  return distance;
}

void Topology::find_ways() {
  ways.assign(networks, std::vector<Way>(networks));
  for (std::size_t to = 0; to < networks; ++to) {
    const std::vector<std::size_t> distance = distances(to);
    std::vector<std::size_t> nearest_first(networks);
    std::iota(nearest_first.begin(), nearest_first.end(), std::size_t{0});
    std::ranges::sort(nearest_first, {}, [&](std::size_t from) { return distance[from]; });
    for (const std::size_t from : nearest_first) {
      Way& way = ways[from][to];
      way.gateways = distance[from];
      bool found = false;
      for (const std::size_t process : processes_on(from)) {
        for (const std::size_t beyond : processes[process]) {
          // The first of equal ones, in the same order as the routes.
          if (distance[beyond] + 1 == distance[from] && !found) {
            found = true;
            way.first = process;
            way.last = beyond == to ? process : ways[beyond][to].last;
          }
        }
      }
    }
  }
}

}  // namespace linegate::plant
