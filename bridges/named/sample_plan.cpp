// SPDX-License-Identifier: Apache-2.0
#include "bridges/named/sample_plan.h"

#include <algorithm>
#include <cstring>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"

namespace linegate::named {
namespace {

constexpr std::size_t kEncapsulation = 4;  // octets before the origin of alignment

constexpr std::int64_t kNanosecondsPerMillisecond = 1'000'000;
constexpr std::int64_t kNanosecondsPerDay = 86'400'000'000'000;
constexpr std::int64_t kDaysFrom1970To1984 = 5'113;

// Appends to a buffer that has room for everything.
class CdrWriter {
 public:
  CdrWriter(std::span<std::byte> to, std::size_t used) : to_(to.data()), at_(used) {}

  std::size_t size() const { return at_; }

  template <class T>
  void put(T value) {
    align(sizeof value);
    store_le(to_ + at_, value);
    at_ += sizeof value;
  }
  // A place for `size` octets, not aligned.
  std::byte* take(std::size_t size) {
    std::byte* const place = to_ + at_;
    at_ += size;
    return place;
  }
  void align(std::size_t size) {
    while ((at_ - kEncapsulation) % size != 0) {
      to_[at_++] = std::byte{0};
    }
  }

 private:
  std::byte* to_;
  std::size_t at_;
};

// A string whose length is not known before its characters are written.
class CdrText {
 public:
  explicit CdrText(CdrWriter& writer) : writer_(writer) {
    writer.align(sizeof(std::uint32_t));
    length_ = writer.take(sizeof(std::uint32_t));
  }
  // A code point of the Basic Multilingual Plane or above, in UTF-8.
  void put(std::uint32_t code) {
    if (code < 0x80) {
      octet(code);
    } else if (code < 0x800) {
      octet(0xC0U | code >> 6U);
      octet(0x80U | (code & 0x3FU));
    } else if (code < 0x1'0000) {
      octet(0xE0U | code >> 12U);
      octet(0x80U | (code >> 6U & 0x3FU));
      octet(0x80U | (code & 0x3FU));
    } else {
      octet(0xF0U | code >> 18U);
      octet(0x80U | (code >> 12U & 0x3FU));
      octet(0x80U | (code >> 6U & 0x3FU));
      octet(0x80U | (code & 0x3FU));
    }
  }
  void end() {
    octet(0);
    store_le(length_, octets_);
  }

 private:
  void octet(std::uint32_t value) {
    *writer_.take(1) = static_cast<std::byte>(value);
    ++octets_;
  }

  CdrWriter& writer_;
  std::byte* length_;
  std::uint32_t octets_ = 0;
};

// Up to 64 bits.
std::uint64_t bits_at(std::span<const std::byte> bytes, std::uint32_t offset, unsigned bits) {
  std::uint64_t value = 0;
  const std::size_t first = offset / 8;
  const unsigned skipped = offset % 8;
  const std::size_t octets = (skipped + bits + 7) / 8;  // at most 9
  for (std::size_t i = 0; i < std::min<std::size_t>(octets, 8); ++i) {
    value |= std::to_integer<std::uint64_t>(bytes[first + i]) << (8 * i);
  }
  value >>= skipped;
  if (octets > 8) {
    value |= std::to_integer<std::uint64_t>(bytes[first + 8]) << (64 - skipped);
  }
  return bits == 64 ? value : value & ((std::uint64_t{1} << bits) - 1);
}

std::uint64_t extended(std::uint64_t value, unsigned bits) {
  const std::uint64_t sign = std::uint64_t{1} << (bits - 1);
  return (value ^ sign) - sign;
}

// TIME_OF_DAY and TIME_DIFFERENCE: 28 bits of ms, 4 reserved ones, 16 bits of days.
std::int64_t nanoseconds(std::uint64_t value) {
  return static_cast<std::int64_t>(value & 0x0FFF'FFFFU) * kNanosecondsPerMillisecond +
         static_cast<std::int64_t>(value >> 32U & 0xFFFFU) * kNanosecondsPerDay;
}

std::uint64_t number_at(std::span<const std::byte> bytes, std::uint32_t offset, unsigned bits,
                        Reading reading) {
  const std::uint64_t value = bits_at(bytes, offset, bits);
  switch (reading) {
    case Reading::signed_bits:
      return extended(value, bits);
    case Reading::time_of_day:
      return static_cast<std::uint64_t>(nanoseconds(value) +
                                        kDaysFrom1970To1984 * kNanosecondsPerDay);
    case Reading::duration:
      return static_cast<std::uint64_t>(nanoseconds(value));
    case Reading::bits:
    case Reading::characters:
    case Reading::utf16:
      break;
  }
  return value;
}

void put_characters(std::span<const std::byte> bytes, std::uint32_t offset, unsigned bits,
                    CdrText& text) {
  for (unsigned at = 0; at + 8 <= bits; at += 8) {
    const auto code = static_cast<std::uint32_t>(bits_at(bytes, offset + at, 8));
    if (code == 0) {
      return;
    }
    text.put(code);
  }
}

// A surrogate without the other one is a replacement character.
void put_utf16(std::span<const std::byte> bytes, std::uint32_t offset, unsigned bits,
               CdrText& text) {
  constexpr std::uint32_t kReplacement = 0xFFFD;
  for (unsigned at = 0; at + 16 <= bits; at += 16) {
    const auto unit = static_cast<std::uint32_t>(bits_at(bytes, offset + at, 16));
    if (unit == 0) {
      return;
    }
    if (unit < 0xD800 || unit > 0xDFFF) {
      text.put(unit);
      continue;
    }
    const auto next = unit < 0xDC00 && at + 32 <= bits
                          ? static_cast<std::uint32_t>(bits_at(bytes, offset + at + 16, 16))
                          : 0;
    if (next >= 0xDC00 && next <= 0xDFFF) {
      text.put(0x1'0000 + ((unit - 0xD800) << 10U) + (next - 0xDC00));
      at += 16;
    } else {
      text.put(kReplacement);
    }
  }
}

std::size_t size_of(Form form) {
  switch (form) {
    case Form::boolean:
    case Form::int8:
    case Form::uint8:
    case Form::octets:
      return 1;
    case Form::int16:
    case Form::uint16:
      return 2;
    case Form::int32:
    case Form::uint32:
    case Form::float32:
    case Form::text:
      return 4;
    case Form::int64:
    case Form::uint64:
    case Form::float64:
      break;
  }
  return 8;
}

void put_number(CdrWriter& writer, std::size_t size, std::uint64_t value) {
  switch (size) {
    case 1:
      writer.put(static_cast<std::uint8_t>(value));
      return;
    case 2:
      writer.put(static_cast<std::uint16_t>(value));
      return;
    case 4:
      writer.put(static_cast<std::uint32_t>(value));
      return;
    default:
      writer.put(value);
  }
}

void append(std::vector<std::byte>& to, std::string_view name, bool little) {
  while ((to.size() - (little ? kEncapsulation : 0)) % 4 != 0) {
    to.push_back(std::byte{0});
  }
  const auto length = static_cast<std::uint32_t>(name.size() + 1);
  for (unsigned i = 0; i < 4; ++i) {
    to.push_back(static_cast<std::byte>(length >> 8 * (little ? i : 3 - i)));
  }
  for (const char c : name) {
    to.push_back(static_cast<std::byte>(c));
  }
  to.push_back(std::byte{0});
}

bool has(const std::vector<std::uint64_t>& marks, std::uint32_t entry) {
  return (marks[entry / 64] >> (entry % 64) & 1U) != 0;
}

}  // namespace

SamplePlan::SamplePlan(const DeviceType& type, std::string_view gateway)
    : prefix_{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}},
      is_input_(type.direction == image::Direction::inputs) {
  append(prefix_, gateway, true);
  append(prefix_, type.line, true);
  if (!type.ros2) {
    append(key_, gateway, false);
    append(key_, type.line, false);
  }
  constexpr std::size_t kFixed = 7 + 3 * 8 + 1 + 7;  // with what aligns it and the times
  max_size_ = prefix_.size() + kFixed + 8 * type.pdos.size();
  steps_.reserve(type.members.size());
  for (const Member& member : type.members) {
    steps_.push_back({member.form, member.reading, member.length, member.bit_length,
                      member.bit_offset, member.entry});
    const std::size_t size = size_of(member.form);
    max_size_ += 3 + (size - 1) + size + member.length + 1;  // with its marks and what aligns it
  }
}

std::size_t SamplePlan::write(const SampleHead& head, const image::Snapshot& snapshot,
                              std::span<std::byte> to) const {
  LINEGATE_ASSERT(to.size() >= max_size_, "a sample has room");
  LINEGATE_ASSERT(head.waits.empty() || head.waits.size() == steps_.size(),
                  "each member has a wait");
  std::ranges::copy(prefix_, to.begin());
  CdrWriter writer(to, prefix_.size());
  writer.put(head.incarnation);
  writer.put(head.sequence_number);
  writer.put(static_cast<std::uint64_t>(head.time));
  writer.put(head.clock);
  for (const std::int64_t time : head.pdo_times) {
    writer.put(static_cast<std::uint64_t>(time));
  }
  for (const Step& step : steps_) {
    writer.put(static_cast<std::uint8_t>(has(snapshot.valid, step.entry)));
  }
  const std::vector<std::uint64_t>& given = is_input_ ? snapshot.valid : snapshot.known;
  if (!is_input_) {
    for (const Step& step : steps_) {
      writer.put(static_cast<std::uint8_t>(has(given, step.entry)));
    }
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      const std::uint8_t why = head.waits.empty() ? kUnknownWait : head.waits[i];
      writer.put(has(snapshot.valid, steps_[i].entry) ? kNoWait : why);
    }
  }
  for (const Step& step : steps_) {
    const unsigned bits = has(given, step.entry) ? step.bit_length : 0;
    if (step.form == Form::text) {
      CdrText text(writer);
      if (step.reading == Reading::utf16) {
        put_utf16(snapshot.bytes, step.bit_offset, bits, text);
      } else {
        put_characters(snapshot.bytes, step.bit_offset, bits, text);
      }
      text.end();
    } else if (step.form == Form::octets) {
      std::byte* const place = writer.take(step.length);
      for (unsigned i = 0; i < step.length; ++i) {
        const unsigned here = bits > 8 * i ? std::min(bits - 8 * i, 8U) : 0;
        place[i] =
            here == 0
                ? std::byte{0}
                : static_cast<std::byte>(bits_at(snapshot.bytes, step.bit_offset + 8 * i, here));
      }
    } else {
      put_number(writer, size_of(step.form),
                 bits == 0 ? 0 : number_at(snapshot.bytes, step.bit_offset, bits, step.reading));
    }
  }
  return writer.size();
}

}  // namespace linegate::named
