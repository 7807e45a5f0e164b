// SPDX-License-Identifier: Apache-2.0
#include "tests/dds/flood/target.h"

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>

namespace linegate::flood {

std::map<std::uint16_t, Queue> queues(std::uint32_t domain) {
  std::map<std::uint16_t, Queue> out;
  std::ifstream in("/proc/net/udp");
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    // Columns: sl local remote st tx:rx tr:tm retrnsmt uid timeout inode ref pointer drops.
    std::istringstream words(line);
    std::string word;
    std::string local;
    std::string sizes;
    std::string last;
    words >> word >> local >> word >> word >> sizes;
    while (words >> word)
      last = word;
    const std::size_t colon = local.find(':');
    const std::size_t half = sizes.find(':');
    if (colon == std::string::npos || half == std::string::npos)
      continue;
    const unsigned long port = std::strtoul(local.c_str() + colon + 1, nullptr, 16);
    const unsigned long first = 7'400UL + 250UL * domain;
    if (port < first || port >= first + 250)
      continue;
    Queue& it = out[static_cast<std::uint16_t>(port)];
    it.waiting += std::strtoul(sizes.c_str() + half + 1, nullptr, 16);
    it.dropped += std::strtoul(last.c_str(), nullptr, 10);
  }
  return out;
}

}  // namespace linegate::flood
