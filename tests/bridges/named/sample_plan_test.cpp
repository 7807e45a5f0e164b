// SPDX-License-Identifier: Apache-2.0
// The octets of samples. tests/dds reads them with the code of fastddsgen, tests/interop with that
// of idlc.
#include "bridges/named/sample_plan.h"

#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/bridges/named/layouts.h"

namespace linegate::named {
namespace {

using image::Direction;
using od::DataType;
using Octets = std::vector<std::uint8_t>;

// A sample of the layout, in which all entries have all given marks.
class SampleOf {
 public:
  explicit SampleOf(const std::vector<TestEntry>& entries, Direction direction = Direction::inputs)
      : layout_(layout_of(entries)) {
    layout_.direction = direction;
    snapshot.layout_id = layout_.id;
    snapshot.bytes.resize(layout_.byte_size);
    snapshot.valid = snapshot.known = {~std::uint64_t{0}};
  }

  Octets octets(std::initializer_list<std::int64_t> pdo_times = {11}) const {
    const DeviceTypes made = device_types("line", layout_);
    const DeviceType& type = made.types.at(0);
    EXPECT_EQ(type.pdos.size(), pdo_times.size());
    const SamplePlan plan(type, "gate");
    const std::vector<std::int64_t> times(pdo_times);
    std::vector<std::byte> to(plan.max_size(), std::byte{0xEE});
    to.resize(plan.write({1, 2, 3, 4, times, waits}, snapshot, to));
    EXPECT_LE(to.size(), plan.max_size());
    Octets out;
    for (const std::byte octet : to) {
      out.push_back(std::to_integer<std::uint8_t>(octet));
    }
    return out;
  }
  // Without what all samples with one PDO have in common, the marks and the octets that align.
  Octets value() const {
    const Octets all = octets();
    const std::size_t size = 4 + 24 + 24 + 8 + 8 + 1;
    return {all.begin() + size, all.end()};
  }
  void set(const Octets& bytes) {
    snapshot.bytes.clear();
    for (const std::uint8_t byte : bytes) {
      snapshot.bytes.push_back(std::byte{byte});
    }
  }

  image::Snapshot snapshot;
  std::vector<std::uint8_t> waits;

 private:
  image::Layout layout_;
};

TEST(SamplePlan, WritesAllPartsInTheirOrder) {
  SampleOf sample({{"ram.A", DataType::unsigned8, 8, 5, 1},
                   {"ram.B", DataType::unsigned16, 16, 5, 2},
                   {"ram.C", DataType::boolean, 1, 5, 2}},
                  Direction::outputs);
  sample.set({0x12, 0x34, 0x56, 0x01});
  sample.snapshot.valid = {0b001};
  sample.snapshot.known = {0b011};
  const Octets expected = {
      0,    1,    0,    0,                                  // CDR_LE
      5,    0,    0,    0, 'g', 'a', 't', 'e', 0, 0, 0, 0,  // gateway
      5,    0,    0,    0, 'l', 'i', 'n', 'e', 0, 0, 0, 0,  // line
      1,    0,    0,    0, 0,   0,   0,   0,                // incarnation
      2,    0,    0,    0, 0,   0,   0,   0,                // sequence_number
      3,    0,    0,    0, 0,   0,   0,   0,                // time
      4,    0,    0,    0, 0,   0,   0,   0,                // clock
      9,    0,    0,    0, 0,   0,   0,   0,                // sent.pdo1
      8,    0,    0,    0, 0,   0,   0,   0,                // sent.pdo2
      1,    0,    0,                                        // valid
      1,    1,    0,                                        // known
      0,    7,    1,                                        // waits; A is valid
      0x12, 0x34, 0x56,                                     // values; C is not known
      0,
  };
  sample.waits = {5, 7, 1};
  EXPECT_EQ(sample.octets({9, 8}), expected);
  sample.waits.clear();
  const Octets unknown = sample.octets({9, 8});
  const auto waits = unknown.begin() + static_cast<std::ptrdiff_t>(expected.size()) - 7;
  EXPECT_EQ(Octets(waits, waits + 3), (Octets{0, kUnknownWait, kUnknownWait}));
}

TEST(SamplePlan, TheKeyIsBigEndianAndItsPaddingIsZero) {
  const DeviceTypes made = device_types("line", layout_of({{"ram.A", DataType::unsigned8, 8}}));
  const SamplePlan plan(made.types.at(0), "gate");
  Octets key;
  for (const std::byte octet : plan.key()) {
    key.push_back(std::to_integer<std::uint8_t>(octet));
  }
  EXPECT_EQ(
      key, (Octets{0, 0, 0, 5, 'g', 'a', 't', 'e', 0, 0, 0, 0, 0, 0, 0, 5, 'l', 'i', 'n', 'e', 0}));
}

struct ValueRow {
  DataType type;
  std::uint16_t bits;
  Octets image;
  Octets value;  // after one mark: what aligns it, too
};

TEST(SamplePlan, WritesEachFormOfValue) {
  const std::vector<ValueRow> rows = {
      {DataType::boolean, 1, {0xFF}, {1}},
      {DataType::integer8, 8, {0x80}, {0x80}},
      {DataType::integer16, 12, {0xFF, 0x0F}, {0, 0xFF, 0xFF}},
      {DataType::unsigned16, 12, {0xFF, 0xFF}, {0, 0xFF, 0x0F}},
      {DataType::integer24, 24, {0, 0, 0x80}, {0, 0, 0, 0, 0, 0x80, 0xFF}},
      {DataType::unsigned24, 24, {0, 0, 0x80}, {0, 0, 0, 0, 0, 0x80, 0}},
      {DataType::integer40,
       40,
       {1, 2, 3, 4, 0x85},
       {0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4, 0x85, 0xFF, 0xFF, 0xFF}},
      {DataType::integer64,
       64,
       {1, 2, 3, 4, 5, 6, 7, 0x88},
       {0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 0x88}},
      {DataType::real32, 32, {0, 0, 0x80, 0x3F}, {0, 0, 0, 0, 0, 0x80, 0x3F}},
      {DataType::visible_string, 32, {'a', 'b', 0, 'c'}, {0, 0, 0, 3, 0, 0, 0, 'a', 'b', 0}},
      {DataType::visible_string, 16, {0xFC, 'b'}, {0, 0, 0, 4, 0, 0, 0, 0xC3, 0xBC, 'b', 0}},
      {DataType::unicode_string,
       48,
       {0xAC, 0x20, 'x', 0, 0, 0},
       {0, 0, 0, 5, 0, 0, 0, 0xE2, 0x82, 0xAC, 'x', 0}},
      // A pair of surrogates, and one alone.
      {DataType::unicode_string,
       48,
       {0x3D, 0xD8, 0x00, 0xDE, 0x3D, 0xD8},
       {0, 0, 0, 8, 0, 0, 0, 0xF0, 0x9F, 0x98, 0x80, 0xEF, 0xBF, 0xBD, 0}},
      {DataType::octet_string, 24, {1, 0, 3}, {1, 0, 3}},
      {DataType::none, 4, {0xFA}, {0x0A}},
      // 1 ms after midnight, 1 January 1985: 15 years with 4 leap days.
      {DataType::time_of_day,
       48,
       {1, 0, 0, 0xF0, 0x6E, 0x01},
       {0, 0, 0, 0, 0, 0, 0, 0x40, 0x42, 0xD8, 0xF1, 0xB1, 0xCD, 0x91, 0x06}},
      {DataType::time_difference,
       48,
       {1, 0, 0, 0xF0, 0, 0},
       {0, 0, 0, 0, 0, 0, 0, 0x40, 0x42, 0x0F, 0, 0, 0, 0, 0}},
  };
  for (const ValueRow& row : rows) {
    SampleOf sample({{"ram.A", row.type, row.bits}});
    sample.set(row.image);
    EXPECT_EQ(sample.value(), row.value) << od::name(row.type) << ' ' << row.bits;
  }
}

// At each position, and of each length.
TEST(SamplePlan, ReadsBitsAtAnyPosition) {
  for (std::uint16_t skipped = 0; skipped < 16; ++skipped) {
    for (std::uint16_t bits = 1; bits <= 64; ++bits) {
      std::vector<TestEntry> entries;
      if (skipped != 0) {
        entries.push_back({"other.A", DataType::none, skipped, 4});
      }
      entries.push_back({"ram.A", DataType::none, bits});
      image::Layout layout = layout_of(entries);
      const DeviceTypes made = device_types("line", layout);
      const SamplePlan plan(made.types.back(), "gate");
      image::Snapshot snapshot;
      snapshot.bytes.resize(layout.byte_size);
      snapshot.valid = {~std::uint64_t{0}};
      std::uint64_t expected = 0;
      for (unsigned i = 0; i < bits; ++i) {
        if (i % 3 != 1) {
          expected |= std::uint64_t{1} << i;
          snapshot.bytes[(skipped + i) / 8] |= std::byte{1} << (skipped + i) % 8;
        }
      }
      std::vector<std::byte> to(plan.max_size());
      const std::vector<std::int64_t> times = {0};
      const std::size_t size = plan.write({.pdo_times = times}, snapshot, to);
      const std::size_t octets = bits <= 8 ? 1 : bits <= 16 ? 2 : bits <= 32 ? 4 : 8;
      std::uint64_t value = 0;
      for (std::size_t i = octets; i > 0; --i) {
        value = value << 8U | std::to_integer<std::uint64_t>(to[size - octets + i - 1]);
      }
      EXPECT_EQ(value, expected) << skipped << ' ' << bits;
    }
  }
}

TEST(SamplePlan, AValueThatIsNotValidIsItsDefault) {
  for (const auto& [type, bits] : {std::pair{DataType::boolean, 1},
                                   {DataType::integer32, 32},
                                   {DataType::time_of_day, 48},
                                   {DataType::real64, 64},
                                   {DataType::visible_string, 64},
                                   {DataType::octet_string, 64},
                                   {DataType::unicode_string, 64}}) {
    SampleOf sample({{"ram.A", type, static_cast<std::uint16_t>(bits)}});
    sample.set({0x41, 0x42, 0x43, 0x44, 0x45, 0x46, 0x47, 0x48});
    const Octets with = sample.value();
    sample.snapshot.valid = {0};
    Octets without = sample.value();
    EXPECT_NE(with, without);
    const bool is_text = type == DataType::visible_string || type == DataType::unicode_string;
    if (is_text) {
      ASSERT_EQ(without.size(), 8U);
      EXPECT_EQ(without[3], 1);  // the length of an empty string, with its zero
      without[3] = 0;
    }
    EXPECT_EQ(without, Octets(without.size())) << od::name(type);
  }
}

}  // namespace
}  // namespace linegate::named
