// SPDX-License-Identifier: Apache-2.0
#include "bridges/named/set_plan.h"

#include <algorithm>
#include <string_view>
#include <type_traits>

#include "stack/base/byte_order.h"
#include "stack/base/utf8.h"

namespace linegate::named {
namespace {

constexpr std::size_t kSetHeader = 4;  // octets of an encapsulation, before the origin of alignment
constexpr std::size_t kLongestName = 64;  // string<64> of the contract
constexpr std::size_t kMostPadding = 3;   // RTPS aligns the end of a sample (RTPS 2.3, 9.4.5.3)

constexpr std::int64_t kMillisecond = 1'000'000;  // in nanoseconds
constexpr std::int64_t kDay = 86'400'000'000'000;
constexpr std::int64_t kEpochOfCia301 = 5'113 * kDay;  // 1984-01-01, since 1970

// Reads CDR from an untrusted writer: after the first error all values are 0 and empty.
class CdrReader {
 public:
  explicit CdrReader(std::span<const std::byte> from) : from_(from) {
    if (from.size() < kSetHeader || from[0] != std::byte{0} || from[1] > std::byte{1}) {
      ok_ = false;
    } else {
      little_ = from[1] == std::byte{1};
    }
  }

  bool ok() const { return ok_; }
  std::size_t left() const { return from_.size() - at_; }

  template <class T>
  T number() {
    static_assert(std::is_unsigned_v<T>);
    const std::span<const std::byte> octets = aligned(sizeof(T));
    T value = 0;
    for (std::size_t i = 0; i < octets.size(); ++i) {
      const std::byte octet = octets[little_ ? octets.size() - 1 - i : i];
      value = static_cast<T>(std::uint64_t{value} << 8U | std::to_integer<std::uint64_t>(octet));
    }
    return value;
  }
  bool boolean() {
    const auto value = number<std::uint8_t>();
    ok_ = ok_ && value <= 1;
    return value == 1;
  }
  // Of up to `most` octets, without a zero.
  std::string_view text(std::size_t most) {
    const auto length = number<std::uint32_t>();
    if (length == 0 || length - 1 > most) {
      ok_ = false;
    }
    const std::span<const std::byte> all = octets(length);
    if (!ok_ || std::ranges::find(all, std::byte{0}) != all.end() - 1) {
      ok_ = false;
      return {};
    }
    return {reinterpret_cast<const char*>(all.data()), all.size() - 1};
  }
  // Empty after an error.
  std::span<const std::byte> octets(std::size_t size) {
    if (!ok_ || size > left()) {
      ok_ = false;
      return {};
    }
    at_ += size;
    return from_.subspan(at_ - size, size);
  }

 private:
  std::span<const std::byte> aligned(std::size_t size) {
    const std::size_t over = (at_ - kSetHeader) % size;
    (void)octets(over == 0 ? 0 : size - over);
    return octets(size);
  }

  std::span<const std::byte> from_;
  std::size_t at_ = kSetHeader;
  bool little_ = true;
  bool ok_ = true;
};

// The key of an instance: each part aligned as in CDR, big-endian.
class KeyWriter {
 public:
  void text(std::string_view text) {
    align(4);
    put(text.size() + 1, 4);
    for (const char c : text) {
      octet(static_cast<std::uint8_t>(c));
    }
    octet(0);
  }
  void group(std::uint16_t number) {
    align(2);
    put(number, 2);
  }
  const SetKey& key() const { return key_; }

 private:
  void align(std::size_t size) {
    while (key_.size % size != 0) {
      octet(0);
    }
  }
  void put(std::uint64_t value, unsigned size) {
    for (unsigned i = size; i > 0; --i) {
      octet(static_cast<std::uint8_t>(value >> 8U * (i - 1)));
    }
  }
  void octet(std::uint8_t value) { key_.octets[key_.size++] = std::byte{value}; }

  SetKey key_;
};

struct KeyNames {
  std::string_view gateway;
  std::string_view line;
  std::uint16_t group = 0;
};

KeyNames read_key(CdrReader& from) {
  KeyNames out;
  out.gateway = from.text(kLongestName);
  out.line = from.text(kLongestName);
  out.group = from.number<std::uint16_t>();
  return out;
}

using Bits = std::optional<std::uint64_t>;

bool has_room(std::uint64_t value, unsigned bits) {
  return bits >= 64 || value >> bits == 0;
}

Bits signed_bits(std::uint64_t value, unsigned bits) {
  const auto number = static_cast<std::int64_t>(value);
  const std::int64_t rest = bits >= 64 ? 0 : number >> (bits - 1);  // 0 or -1: the sign alone
  if (rest != 0 && rest != -1) {
    return std::nullopt;
  }
  return bits >= 64 ? value : value & ((std::uint64_t{1} << bits) - 1);
}

// 28 bits of ms, 4 reserved ones, 16 bits of days (CiA 301 7.1.6.5, 7.1.6.6). Rounded down.
Bits time_bits(std::int64_t span) {
  if (span < 0 || span / kDay > 0xFFFF) {
    return std::nullopt;
  }
  return static_cast<std::uint64_t>(span / kDay) << 32U |
         static_cast<std::uint64_t>(span % kDay / kMillisecond);
}

Bits number_bits(std::uint64_t value, Reading reading, unsigned bits) {
  const auto time = static_cast<std::int64_t>(value);
  switch (reading) {
    case Reading::signed_bits:
      return signed_bits(value, bits);
    case Reading::time_of_day:
      return time < kEpochOfCia301 ? Bits() : time_bits(time - kEpochOfCia301);
    case Reading::duration:
      return time_bits(time);
    case Reading::bits:
    case Reading::characters:
    case Reading::utf16:
      break;
  }
  return has_room(value, bits) ? Bits(value) : std::nullopt;
}

// The characters of VISIBLE_STRING in Latin-1, or of UNICODE_STRING in UTF-16, from the first
// octet; zeros after them. Returns false if the text does not fit.
bool put_text(std::string_view text, Reading reading, unsigned bits, line::OutputValue& to) {
  const unsigned width = reading == Reading::utf16 ? 16 : 8;
  unsigned used = 0;
  const auto put = [&](std::uint32_t unit) {
    if (used + width <= bits) {
      store_le(std::span(to.data).subspan(used / 8, width / 8), unit);
    }
    used += width;
  };
  while (!text.empty() && used < bits) {
    const auto code = take_code_point(text);
    if (!code || (width == 8 && *code > 0xFF)) {
      return false;
    }
    if (*code > 0xFFFF) {
      put(0xD800 + ((*code - 0x1'0000) >> 10U));
      put(0xDC00 + ((*code - 0x1'0000) & 0x3FFU));
    } else {
      put(*code);
    }
  }
  return text.empty() && used <= bits;
}

// Returns false if the last octet has more bits than the output.
bool put_octets(std::span<const std::byte> octets, unsigned bits, line::OutputValue& to) {
  std::ranges::copy(octets, to.data.begin());
  return bits % 8 == 0 || octets.empty() || (octets.back() >> bits % 8) == std::byte{0};
}

std::uint64_t sign_extended(std::uint64_t value, unsigned octets) {
  const std::uint64_t sign = std::uint64_t{1} << (8 * octets - 1);
  return (value ^ sign) - sign;
}

// Integers of fewer octets than 8 are extended.
std::uint64_t read_number(CdrReader& from, Form form) {
  switch (form) {
    case Form::boolean:
      return from.boolean() ? 1 : 0;
    case Form::int8:
      return sign_extended(from.number<std::uint8_t>(), 1);
    case Form::uint8:
      return from.number<std::uint8_t>();
    case Form::int16:
      return sign_extended(from.number<std::uint16_t>(), 2);
    case Form::uint16:
      return from.number<std::uint16_t>();
    case Form::int32:
      return sign_extended(from.number<std::uint32_t>(), 4);
    case Form::uint32:
    case Form::float32:
      return from.number<std::uint32_t>();
    case Form::int64:
    case Form::uint64:
    case Form::float64:
    case Form::text:
    case Form::octets:
      break;
  }
  return from.number<std::uint64_t>();
}

// Reads the value of an output with that many bits. Returns false if it does not fit. Precondition:
// all bytes of `to` are 0.
bool read_value(CdrReader& from, Form form, Reading reading, std::uint16_t length, unsigned bits,
                line::OutputValue& to) {
  to.length = static_cast<std::uint8_t>((bits + 7) / 8);
  if (form == Form::text) {
    return put_text(from.text(length), reading, bits, to);
  }
  if (form == Form::octets) {
    return put_octets(from.octets(length), bits, to);
  }
  const Bits number = number_bits(read_number(from, form), reading, bits);
  store_le(to.data.data(), number.value_or(0));
  return number.has_value();
}

// Of a value, including what aligns it.
std::size_t most_octets(const Member& member) {
  constexpr std::size_t kLargestNumber = 8 + 7;
  return member.form == Form::text     ? 3U + 4U + member.length + 1U
         : member.form == Form::octets ? member.length
                                       : kLargestNumber;
}

}  // namespace

std::optional<SetKey> key_of_set(std::span<const std::byte> sample) {
  CdrReader from(sample);
  const KeyNames names = read_key(from);
  if (!from.ok()) {
    return std::nullopt;
  }
  KeyWriter writer;
  writer.text(names.gateway);
  writer.text(names.line);
  writer.group(names.group);
  return writer.key();
}

SetPlan::SetPlan(const GroupType& type) : layout_id_(type.layout_id), group_(type.number) {
  constexpr std::size_t kText = 3 + 4 + kLongestName + 1;
  constexpr std::size_t kNumbers = 1 + 2 + 7 + 8 + 7 + 8 + 8 + 1;
  max_size_ = kSetHeader + 3 * kText + kNumbers + kMostPadding;
  steps_.reserve(type.members.size());
  for (const Member& member : type.members) {
    steps_.push_back({member.form, member.reading, member.length, member.bit_length, member.entry,
                      member.identifier});
    max_size_ += 1 + most_octets(member);
  }
}

bool SetPlan::read(std::span<const std::byte> sample, SetSample& to) const {
  CdrReader from(sample);
  const KeyNames names = read_key(from);
  to.gateway = names.gateway;
  to.line = names.line;
  to.group = names.group;
  to.incarnation = from.number<std::uint64_t>();
  to.write.group = group_;
  to.write.layout_id = layout_id_;
  to.write.client = from.text(kLongestName);
  to.write.arming = from.number<std::uint64_t>();
  to.write.watchdog = Duration{static_cast<std::int64_t>(from.number<std::uint64_t>())};
  to.write.reactions = from.number<std::uint8_t>();
  to.write.values.clear();
  to.write.bytes.clear();
  to.refusal = line::OutputRefusal::none;
  to.why.clear();
  const std::span<const std::byte> given = from.octets(steps_.size());
  if (std::ranges::any_of(given, [](std::byte mark) { return mark > std::byte{1}; })) {
    return false;
  }
  for (std::size_t i = 0; i < steps_.size() && from.ok(); ++i) {
    const Step& step = steps_[i];
    line::OutputValue value{.entry = step.entry};
    const bool fits =
        read_value(from, step.form, step.reading, step.length, step.bit_length, value);
    if (given[i] == std::byte{0}) {
      continue;
    }
    if (fits) {
      to.write.values.push_back(value);
    } else if (from.ok() && to.refusal == line::OutputRefusal::none) {
      to.refusal = line::OutputRefusal::bad_value;
      to.why = "the value of " + step.identifier + " does not fit into " +
               std::to_string(step.bit_length) + " bits of its type";
    }
  }
  return from.ok() && from.left() <= kMostPadding;
}

}  // namespace linegate::named
