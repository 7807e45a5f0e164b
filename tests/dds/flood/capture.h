// SPDX-License-Identifier: Apache-2.0
// Captures the datagrams that live participants of one DDS domain send over the loopback interface.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tests/dds/flood/mutator.h"

namespace linegate::flood {

struct Seen {
  std::uint16_t port = 0;  // destination port
  std::uint16_t from = 0;
  Bytes octets;
};

// A packet socket on "lo". Needs CAP_NET_RAW, which root of a network namespace has.
class Capture {
 public:
  explicit Capture(std::uint32_t domain);
  ~Capture();
  Capture(const Capture&) = delete;
  Capture& operator=(const Capture&) = delete;

  bool ok() const { return socket_ >= 0; }
  // Returns the RTPS datagrams that were received since the last call.
  std::vector<Seen> read();

 private:
  int socket_ = -1;
  std::uint16_t first_;  // first port of the domain
};

// Keeps the newest datagrams of each kind, so that rare kinds are chosen as often as frequent ones.
class Seeds {
 public:
  void add(const Seen& seen);
  bool empty() const { return kinds_.empty(); }
  std::size_t kinds() const { return kinds_.size(); }
  const Seen& pick(Mutator& random) const;

 private:
  static constexpr std::size_t kEach = 16;

  struct Kind {
    std::vector<Seen> newest;
    std::size_t next = 0;
  };
  // By destination, kinds of submessages, and their writers.
  std::map<std::string, std::size_t> places_;
  std::vector<Kind> kinds_;
};

}  // namespace linegate::flood
