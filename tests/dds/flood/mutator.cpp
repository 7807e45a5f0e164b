// SPDX-License-Identifier: Apache-2.0
#include "tests/dds/flood/mutator.h"

#include <algorithm>
#include <array>

namespace linegate::flood {
namespace {

using dds::guard::Wire;

constexpr std::size_t kHeader = 20;
constexpr std::size_t kMost = 65'000;

constexpr std::array<std::int64_t, 18> kNumbers = {INT64_MIN,
                                                   -1,
                                                   0,
                                                   1,
                                                   2,
                                                   255,
                                                   256,
                                                   4096,
                                                   60'000,
                                                   std::int64_t{1} << 20U,
                                                   std::int64_t{1} << 24U,
                                                   std::int64_t{1} << 31U,
                                                   std::int64_t{1} << 32U,
                                                   std::int64_t{1} << 40U,
                                                   std::int64_t{1} << 48U,
                                                   std::int64_t{1} << 62U,
                                                   INT64_MAX - 1,
                                                   INT64_MAX};
constexpr std::array<std::int64_t, 8> kSteps = {1,   2,    3,    10,
                                                300, 1000, 5000, std::int64_t{1} << 20U};
constexpr std::array<std::uint32_t, 21> kWords = {
    0,   1,   2,    3,      4,       7,         8,          16,         31,         32,        255,
    256, 257, 1024, 0x8000, 0x10000, 0x1000000, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFC, 0xFFFFFFFF};
constexpr std::array<std::uint16_t, 18> kShorts = {
    0, 1, 2, 3, 4, 8, 15, 16, 17, 20, 28, 64, 255, 1024, 0x7FFF, 0x8000, 0xFFFC, 0xFFFF};
constexpr std::array<std::uint8_t, 20> kKinds = {0x01, 0x06, 0x07, 0x08, 0x09, 0x0C, 0x0D,
                                                 0x0E, 0x0F, 0x12, 0x13, 0x15, 0x16, 0x30,
                                                 0x31, 0x32, 0x33, 0x34, 0x80, 0x81};
constexpr std::array<std::uint32_t, 27> kEntities = {
    0x00000000, 0x000100C2, 0x000100C7, 0x000002C2, 0x000002C7, 0x000003C2, 0x000003C7,
    0x000004C2, 0x000004C7, 0x000200C2, 0x000200C7, 0x000201C3, 0x000201C4, 0xFF0003C2,
    0xFF0004C2, 0xFF0200C2, 0xFF0101C2, 0xFF0202C3, 0x00000102, 0x00000103, 0x00000202,
    0x00000203, 0x00000302, 0x00000303, 0x00000104, 0x00000107, 0x00000507};
// Parameter IDs of RTPS 2.3, DDS-Security, XTypes, Fast DDS and other vendors.
constexpr std::array<std::uint16_t, 68> kParameters = {
    0x02,   0x04,   0x05,   0x06,   0x07,   0x0B,   0x0C,   0x0D,  0x0E,   0x11,   0x15,   0x16,
    0x1A,   0x1B,   0x1D,   0x1E,   0x1F,   0x21,   0x23,   0x25,  0x27,   0x29,   0x2B,   0x2C,
    0x2D,   0x2E,   0x2F,   0x30,   0x31,   0x32,   0x33,   0x34,  0x35,   0x40,   0x41,   0x43,
    0x44,   0x48,   0x49,   0x50,   0x52,   0x53,   0x58,   0x59,  0x5A,   0x60,   0x62,   0x69,
    0x70,   0x71,   0x72,   0x73,   0x74,   0x75,   0x76,   0x83,  0x1001, 0x1002, 0x1003, 0x1004,
    0x1005, 0x1006, 0x8000, 0x8002, 0x8003, 0x8005, 0x8007, 0x800F};

template <class Array>
auto pick(Mutator& random, const Array& from) {
  return from[random.below(from.size())];
}

void store(Bytes& body, std::size_t at, std::uint64_t value, unsigned size, bool little) {
  for (unsigned i = 0; i < size; ++i) {
    const unsigned shift = 8 * (little ? i : size - 1 - i);
    body[at + i] = static_cast<std::uint8_t>(value >> shift);
  }
}

void append(Bytes& out, const Part& part) {
  const std::size_t length =
      part.length >= 0 ? static_cast<std::size_t>(part.length) : part.body.size();
  out.push_back(part.kind);
  out.push_back(part.flags);
  out.resize(out.size() + 2);
  store(out, out.size() - 2, length, 2, part.little());
  out.insert(out.end(), part.body.begin(), part.body.end());
}

// Offsets of the fields in the body of a submessage kind: 8-octet numbers, 4-octet words (0:
// absent), 2-octet shorts.
struct Fields {
  std::uint8_t kind;
  std::array<std::size_t, 2> numbers;
  std::array<std::size_t, 2> words;
  std::array<std::size_t, 3> shorts;
};
constexpr std::array<Fields, 7> kFields = {{
    {0x06, {8, 8}, {16, 20}, {}},
    {0x07, {8, 16}, {24, 24}, {}},
    {0x08, {8, 16}, {24, 24}, {}},
    {0x12, {8, 8}, {16, 20}, {}},
    {0x13, {8, 8}, {16, 20}, {}},
    {0x15, {12, 12}, {}, {1, 3, 3}},
    {0x16, {12, 12}, {20, 28}, {3, 25, 27}},
}};

std::vector<Place> list_at(const Wire& body, std::size_t at) {
  std::vector<Place> out;
  while (at + 4 <= body.size()) {
    const std::uint16_t id = body.u16(at);
    const std::size_t length = body.u16(at + 2);
    if (id == 1)
      return out;
    if (at + 4 + length > body.size())
      break;
    out.push_back({at, id, length});
    at += 4 + length;
  }
  return {};
}

}  // namespace

std::vector<Part> split(const Bytes& datagram) {
  std::vector<Part> out;
  for (std::size_t at = kHeader; at + 4 <= datagram.size();) {
    Part part{datagram[at], datagram[at + 1], {}, -1};
    const Wire rest(dds::guard::Octets(datagram).subspan(at), part.little());
    const std::size_t most = rest.size() - 4;
    std::size_t length = rest.u16(2);
    if (length == 0 && part.kind != 0x01 && part.kind != 0x09)
      length = most;
    length = std::min(length, most);
    const auto begin = datagram.begin() + static_cast<std::ptrdiff_t>(at + 4);
    part.body.assign(begin, begin + static_cast<std::ptrdiff_t>(length));
    out.push_back(std::move(part));
    at += 4 + length;
  }
  return out;
}

std::vector<Place> parameters(const Part& part) {
  const Wire body(part.body, part.little());
  const std::size_t begin = part.kind == 0x16 ? 32 : 20;
  std::vector<Place> found = list_at(body, begin);
  // The list follows the encapsulation header of a payload.
  return found.empty() ? list_at(body, begin + 4) : found;
}

std::size_t Mutator::below(std::size_t end) {
  return static_cast<std::size_t>(random_() % end);
}

Bytes Mutator::mutate(const Bytes& datagram, const Bytes& other) {
  std::vector<Part> parts = split(datagram);
  const std::size_t times = std::array<std::size_t, 6>{1, 1, 1, 2, 2, 3}[below(6)];
  for (std::size_t i = 0; i < times && !parts.empty(); ++i)
    mutate_part(parts, other);
  Bytes out(datagram.begin(),
            datagram.begin() + static_cast<std::ptrdiff_t>(std::min(kHeader, datagram.size())));
  for (const Part& part : parts)
    append(out, part);
  if (out.size() > kMost)
    out.resize(kMost);
  return out;
}

void Mutator::mutate_part(std::vector<Part>& parts, const Bytes& other) {
  Part& part = parts[below(parts.size())];
  const std::size_t action = below(15);
  if (action < 4)
    return mutate_fields(part);
  if (action >= 9)
    return mutate_octets(parts, part, other);
  const auto data =
      std::find_if(parts.begin(), parts.end(), [](const Part& it) { return it.is_data(); });
  if (data != parts.end())
    return mutate_parameters(*data);
  mutate_fields(part);
}

void Mutator::mutate_fields(Part& part) {
  const auto* const it = std::find_if(kFields.begin(), kFields.end(),
                                      [&](const Fields& each) { return each.kind == part.kind; });
  if (it == kFields.end())
    return part.body.size() < 4 ? void() : put_word(part, 4 * below(part.body.size() / 4));
  switch (below(4)) {
    case 0:
      return put_number(part, pick(*this, it->numbers));
    case 1:
      return put_entity(part, (part.is_data() ? 4 : 0) + 4 * below(2));
    case 2:
      return it->words[0] != 0 ? put_word(part, pick(*this, it->words))
                               : put_number(part, it->numbers[0]);
    default:
      return it->shorts[0] != 0 ? put_short(part, pick(*this, it->shorts) - 1)
                                : put_number(part, it->numbers[1]);
  }
}

void Mutator::mutate_parameters(Part& part) {
  const std::vector<Place> found = parameters(part);
  if (found.empty())  // the payload is CDR, without a parameter list
    return part.body.size() < 24 ? void()
                                 : put_word(part, 20 + 4 * below((part.body.size() - 20) / 4));
  const Place& place = found[below(found.size())];
  const auto begin = part.body.begin() + static_cast<std::ptrdiff_t>(place.at);
  const auto end = begin + static_cast<std::ptrdiff_t>(4 + place.length);
  switch (below(7)) {
    case 0:
      return store(part.body, place.at, pick(*this, kParameters), 2, part.little());
    case 1:
      return put_short(part, place.at + 2);
    case 2:
    case 3:
      return place.length < 4 ? void() : put_word(part, place.at + 4 + 4 * below(place.length / 4));
    case 4:
      part.body.erase(begin, end);
      return;
    case 5: {
      const Bytes copy(begin, end);
      part.body.insert(begin, copy.begin(), copy.end());
      return;
    }
    default:
      return insert_parameter(part, found);
  }
}

void Mutator::insert_parameter(Part& part, const std::vector<Place>& found) {
  Bytes fresh(4 + 4 * below(12));
  for (std::size_t i = 4; i < fresh.size(); ++i)
    fresh[i] = below(2) == 0 ? std::uint8_t{0}
                             : static_cast<std::uint8_t>(below(2) == 0 ? below(8) : below(256));
  store(fresh, 0, pick(*this, kParameters), 2, part.little());
  store(fresh, 2, fresh.size() - 4, 2, part.little());
  const Place& place = found[below(found.size())];
  part.body.insert(part.body.begin() + static_cast<std::ptrdiff_t>(place.at), fresh.begin(),
                   fresh.end());
}

void Mutator::mutate_octets(std::vector<Part>& parts, Part& part, const Bytes& other) {
  const auto position = [&] {
    return parts.begin() + static_cast<std::ptrdiff_t>(below(parts.size() + 1));
  };
  switch (below(7)) {
    case 0:
      if (!part.body.empty())
        part.body[below(part.body.size())] = static_cast<std::uint8_t>(below(256));
      return;
    case 1:
      part.flags = static_cast<std::uint8_t>(part.flags ^ 1U << below(8));
      return;
    case 2:
      part.kind = pick(*this, kKinds);
      return;
    case 3:
      part.length = below(2) == 0
                        ? pick(*this, kShorts)
                        : static_cast<int>((part.body.size() + below(9) + 65'532) % 65'536);
      return;
    case 4: {
      const Part copy = part;
      parts.insert(position(), copy);
      return;
    }
    case 5: {
      const std::vector<Part> more = split(other);
      if (!more.empty())
        parts.insert(position(), more[below(more.size())]);
      return;
    }
    default:
      part.body.resize(below(part.body.size() + 1));
  }
}

void Mutator::put_number(Part& part, std::size_t at) {
  if (at + 8 > part.body.size())
    return;
  const Wire body(part.body, part.little());
  const std::int64_t old = body.number(at);
  const auto value = static_cast<std::uint64_t>(below(2) == 0 ? pick(*this, kNumbers) : 0);
  const std::uint64_t next = value != 0 ? value
                                        : static_cast<std::uint64_t>(old) +
                                              static_cast<std::uint64_t>(pick(*this, kSteps));
  store(part.body, at, next >> 32U, 4, part.little());
  store(part.body, at + 4, next & 0xFFFFFFFF, 4, part.little());
}

void Mutator::put_word(Part& part, std::size_t at) {
  if (at + 4 > part.body.size())
    return;
  const std::uint32_t old = Wire(part.body, part.little()).u32(at);
  const std::array<std::uint32_t, 4> near = {old + 1, old - 1, old * 2, old ^ 0x100};
  store(part.body, at, below(4) == 0 ? pick(*this, near) : pick(*this, kWords), 4, part.little());
}

void Mutator::put_short(Part& part, std::size_t at) {
  if (at + 2 > part.body.size())
    return;
  const unsigned old = Wire(part.body, part.little()).u16(at);
  const std::array<unsigned, 4> near = {old + 1, old - 1, old + 4, old * 2};
  store(part.body, at, below(3) == 0 ? pick(*this, near) : pick(*this, kShorts), 2, part.little());
}

void Mutator::put_entity(Part& part, std::size_t at) {
  if (at + 4 <= part.body.size())
    store(part.body, at, pick(*this, kEntities), 4, false);
}

}  // namespace linegate::flood
