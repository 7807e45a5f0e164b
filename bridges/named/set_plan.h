// SPDX-License-Identifier: Apache-2.0
// Reads the samples by which applications write a group of outputs by name, by a plan that is made
// once from its type. Samples come from untrusted writers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bridges/named/group_types.h"
#include "stack/line/output_write.h"

namespace linegate::named {

// The key of a sample in CDR, big-endian, without a header: what the key hash of its instance is
// made from (RTPS 2.3, 9.6.3.8).
struct SetKey {
  // Two strings of up to 64 characters, each with its length and its end, and the group.
  static constexpr std::size_t kMost = 2 * (4 + 65 + 3) + 2;

  std::array<std::byte, kMost> octets{};
  std::size_t size = 0;
};

// sample: CDR with its encapsulation header, of a type of group_types(); what follows the key may
// be missing. Nothing if the key is malformed.
std::optional<SetKey> key_of_set(std::span<const std::byte> sample);

// What a sample contains.
struct SetSample {
  std::string gateway;
  std::string line;
  std::uint64_t incarnation = 0;
  // With the client and without client_number. Values are those of the members that are given, with
  // the group and the layout of the type.
  line::OutputWrite write;
  std::uint16_t group = 0;  // as in the sample
  // none: `write` is complete. Otherwise why it cannot be made, in words in `why`.
  line::OutputRefusal refusal = line::OutputRefusal::none;
  std::string why;
};

class SetPlan {
 public:
  explicit SetPlan(const GroupType& type);

  // The greatest size of a sample in octets, including its encapsulation header and what aligns it.
  std::size_t max_size() const { return max_size_; }

  // sample: CDR (CDR_LE or CDR_BE of RTPS 2.3, 10.2). Returns false if it is malformed: it ends
  // early or late, a string has no end, has a zero or is too long, a boolean is neither 0 nor 1.
  // `to` is then undefined. A value that is given and does not fit into its output is a refusal.
  // Reuses the memory of `to`; does not allocate more than the type needs.
  bool read(std::span<const std::byte> sample, SetSample& to) const;

 private:
  struct Step {
    Form form;
    Reading reading;
    std::uint16_t length;
    std::uint16_t bit_length;
    std::uint32_t entry;
    std::string identifier;
  };

  std::uint64_t layout_id_;
  std::uint16_t group_;
  std::vector<Step> steps_;
  std::size_t max_size_ = 0;
};

}  // namespace linegate::named
