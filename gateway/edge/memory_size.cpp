// SPDX-License-Identifier: Apache-2.0
#include "gateway/edge/memory_size.h"

#include <array>

#include <fcntl.h>
#include <unistd.h>

namespace linegate::gateway {

MemorySize memory_size(const char* statm) {
  const int file = open(statm, O_RDONLY | O_CLOEXEC);
  if (file < 0) {
    return {};
  }
  std::array<char, 128> text{};
  const ssize_t length = read(file, text.data(), text.size());
  close(file);
  std::array<std::size_t, 7> pages{};  // size, resident, shared, text, lib, data, dt
  std::size_t field = 0;
  for (ssize_t i = 0; i < length && field < pages.size(); ++i) {
    const char c = text[static_cast<std::size_t>(i)];
    if (c == ' ') {
      ++field;
    } else if (c >= '0' && c <= '9') {
      pages[field] = 10 * pages[field] + static_cast<std::size_t>(c - '0');
    }
  }
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  const std::size_t own = pages[1] - (pages[2] < pages[1] ? pages[2] : pages[1]);
  return {.resident = own * page, .data = pages[5] * page};
}

}  // namespace linegate::gateway
