// SPDX-License-Identifier: Apache-2.0
// Counts the datagrams that were sent, and those that a guard passes to the library: by kind of
// submessage, by writer, and by parameter.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>

#include "bridges/dds/guard/guard.h"

#include "tests/dds/flood/mutator.h"

namespace linegate::flood {

class Census {
 public:
  void add(const Bytes& datagram, dds::guard::Reason reason);

  std::uint64_t sent() const { return sent_; }
  // The counts as a table in plain text.
  std::string text() const;

 private:
  struct Count {
    std::uint64_t sent = 0;
    std::uint64_t passed = 0;
  };

  void print(std::string& out, const char* title, const std::map<std::uint32_t, Count>& counts,
             std::string (*name)(std::uint32_t)) const;

  std::uint64_t sent_ = 0;
  std::array<std::uint64_t, dds::guard::kReasons> reasons_{};
  std::map<std::uint32_t, Count> kinds_;
  // Builtin writers by entity ID; all application writers as 0.
  std::map<std::uint32_t, Count> writers_;
  std::map<std::uint32_t, Count> parameters_;  // in DATA of builtin writers, and in inline QoS
};

}  // namespace linegate::flood
