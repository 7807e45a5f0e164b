// SPDX-License-Identifier: Apache-2.0
// A second process of a test, and the lines that it prints.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

#include "tests/paths.h"

namespace linegate::test {

// The domain of this test process: own_domain.h.
std::uint32_t domain();

// What the address sanitizer of a peer does with freed memory, to find its use: keeps up to 256 MB,
// or little, where resident() is judged.
enum class Freed { kept, released };

class Peer {
 public:
  // Starts dds_peer with that role in domain().
  explicit Peer(const std::string& role, const std::string& profiles = paths::kLoopbackProfiles,
                Freed freed = Freed::kept);
  ~Peer();
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  // Reads lines until one begins with `prefix`, and returns it; empty after the deadline.
  std::string expect(std::string_view prefix,
                     std::chrono::milliseconds deadline = std::chrono::seconds(20));
  void signal(int number) const;
  pid_t process() const { return pid_; }
  // Resident memory of the process in octets; 0 once it has ended.
  std::size_t resident() const;
  // Closes its standard input, waits for its end, and kills it after 30 s. Returns false if it had
  // to be killed or did not exit with 0.
  bool end();

 private:
  bool read_more(int timeout_ms);

  pid_t pid_ = -1;
  int to_ = -1;
  int from_ = -1;
  std::string unread_;
};

}  // namespace linegate::test
