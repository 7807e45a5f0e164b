// SPDX-License-Identifier: Apache-2.0
// Mutates RTPS datagrams with regard to their structure: submessages, sequence numbers and sets,
// fragments, parameter lists, CDR bodies.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "bridges/dds/guard/wire.h"

namespace linegate::flood {

using Bytes = std::vector<std::uint8_t>;

// A submessage. The body keeps the octet order that the flags specify. length: octetsToNextHeader;
// -1: the length of the body.
struct Part {
  std::uint8_t kind = 0;
  std::uint8_t flags = 0;
  Bytes body;
  int length = -1;

  bool little() const { return (flags & 1U) != 0; }
  bool is_data() const { return kind == 0x15 || kind == 0x16; }
};

// The position of a parameter in the body of DATA or DATA_FRAG.
struct Place {
  std::size_t at = 0;
  std::uint16_t id = 0;
  std::size_t length = 0;
};

// Splits a datagram into submessages, like a lenient receiver.
std::vector<Part> split(const Bytes& datagram);
// The parameters of the first parameter list of DATA or DATA_FRAG, in inline QoS or payload; empty
// if there is no list.
std::vector<Place> parameters(const Part& part);

class Mutator {
 public:
  explicit Mutator(std::uint64_t seed) : random_(seed) {}

  // Applies one to three mutations. other: a datagram from which a submessage may be copied. The
  // result has at most 65,000 octets.
  Bytes mutate(const Bytes& datagram, const Bytes& other);
  std::size_t below(std::size_t end);  // A random number in 0 to end - 1; end > 0

 private:
  void mutate_part(std::vector<Part>& parts, const Bytes& other);
  void mutate_fields(Part& part);
  void mutate_parameters(Part& part);
  void mutate_octets(std::vector<Part>& parts, Part& part, const Bytes& other);
  void insert_parameter(Part& part, const std::vector<Place>& found);
  void put_number(Part& part, std::size_t at);
  void put_word(Part& part, std::size_t at);
  void put_short(Part& part, std::size_t at);
  void put_entity(Part& part, std::size_t at);

  std::mt19937_64 random_;
};

}  // namespace linegate::flood
