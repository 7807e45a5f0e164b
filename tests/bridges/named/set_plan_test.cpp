// SPDX-License-Identifier: Apache-2.0
// Samples by which applications write outputs by name, octet by octet, also as hostile writers may
// send them.
#include "bridges/named/set_plan.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/bridges/named/layouts.h"

namespace linegate::named {
namespace {

using line::OutputRefusal;
using od::DataType;
using Octets = std::vector<std::uint8_t>;

// Writes CDR.
class Cdr {
 public:
  explicit Cdr(bool little = true) : little_(little) {
    out_ = {0, static_cast<std::uint8_t>(little ? 1 : 0), 0, 0};
  }
  Cdr& number(std::uint64_t value, unsigned size) {
    align(size);
    for (unsigned i = 0; i < size; ++i)
      out_.push_back(static_cast<std::uint8_t>(value >> 8U * (little_ ? i : size - 1 - i)));
    return *this;
  }
  Cdr& text(std::string_view value) {
    number(value.size() + 1, 4);
    out_.insert(out_.end(), value.begin(), value.end());
    out_.push_back(0);
    return *this;
  }
  Cdr& octets(const Octets& more) {
    out_.insert(out_.end(), more.begin(), more.end());
    return *this;
  }
  Cdr& align(unsigned size) {
    while ((out_.size() - 4) % size != 0)
      out_.push_back(0);
    return *this;
  }
  std::vector<std::byte> take() const {
    std::vector<std::byte> out;
    for (const std::uint8_t octet : out_)
      out.push_back(std::byte{octet});
    return out;
  }

 private:
  Octets out_;
  bool little_;
};

// The members before the marks.
Cdr head(bool little = true) {
  Cdr cdr(little);
  cdr.text("gate").text("press").number(3, 2).number(0x1122, 8).text("hmi");
  cdr.number(0x99, 8).number(5'000'000, 8).number(line::kZeroOutputs, 1);
  return cdr;
}

GroupType type_of(const std::vector<TestEntry>& entries) {
  image::Layout layout = layout_of(entries);
  layout.direction = image::Direction::outputs;
  layout.id = 0xABC;
  Group group{"drives", 3, {}};
  for (std::uint32_t i = 0; i < entries.size(); ++i)
    group.entries.push_back(i);
  GroupTypes made = group_types("press", layout, std::span(&group, 1));
  EXPECT_EQ(made.types.size(), 1U);
  return made.types.at(0);
}

const std::vector<TestEntry> kThree{{"ram.Flag", DataType::boolean, 1},
                                    {"ram.Text", DataType::visible_string, 32},
                                    {"ram.Word", DataType::unsigned16, 16}};

Octets data_of(const line::OutputValue& value) {
  Octets out;
  for (std::size_t i = 0; i < value.length; ++i)
    out.push_back(std::to_integer<std::uint8_t>(value.data[i]));
  return out;
}

TEST(SetPlan, ReadsAllParts) {
  for (const bool little : {true, false}) {
    const auto sample =
        head(little).octets({1, 0, 1}).octets({1}).text("abc").number(0x1234, 2).take();
    const SetPlan plan(type_of(kThree));
    EXPECT_LE(sample.size(), plan.max_size());
    SetSample read;
    ASSERT_TRUE(plan.read(sample, read));
    EXPECT_EQ(read.refusal, OutputRefusal::none);
    EXPECT_EQ(read.gateway, "gate");
    EXPECT_EQ(read.line, "press");
    EXPECT_EQ(read.group, 3);
    EXPECT_EQ(read.incarnation, 0x1122U);
    EXPECT_EQ(read.write.client, "hmi");
    EXPECT_EQ(read.write.group, 3);
    EXPECT_EQ(read.write.layout_id, 0xABCU);
    EXPECT_EQ(read.write.arming, 0x99U);
    EXPECT_EQ(read.write.watchdog, std::chrono::milliseconds(5));
    EXPECT_EQ(read.write.reactions, line::kZeroOutputs);
    EXPECT_TRUE(read.write.bytes.empty());
    ASSERT_EQ(read.write.values.size(), 2U) << "the text is not given";
    EXPECT_EQ(read.write.values[0].entry, 0U);
    EXPECT_EQ(data_of(read.write.values[0]), Octets{1});
    EXPECT_EQ(read.write.values[1].entry, 2U);
    EXPECT_EQ(data_of(read.write.values[1]), (Octets{0x34, 0x12}));
  }
}

TEST(SetPlan, OfNothingGivenIsAHandshake) {
  const SetPlan plan(type_of(kThree));
  SetSample read;
  ASSERT_TRUE(plan.read(head().octets({1, 1, 1, 1}).text("abc").number(0x1234, 2).take(), read));
  EXPECT_EQ(read.write.values.size(), 3U);
  ASSERT_TRUE(plan.read(head().octets({0, 0, 0, 1}).text("abc").number(0x1234, 2).take(), read));
  EXPECT_TRUE(read.write.values.empty());
  EXPECT_EQ(read.refusal, OutputRefusal::none);
}

// A value as CDR, and the data of the OutputValue; empty: it does not fit.
struct ValueCase {
  DataType type;
  std::uint16_t bits;
  unsigned size;  // of the number in CDR; 0: text; 1: octets as they are
  std::uint64_t number;
  std::string_view text;
  Octets data;
};

const std::vector<ValueCase> kValues{
    {DataType::boolean, 1, 1, 1, {}, {1}},
    {DataType::integer8, 8, 1, 0xFB, {}, {0xFB}},
    {DataType::integer16, 16, 2, 0xFED4, {}, {0xD4, 0xFE}},
    {DataType::integer24, 24, 4, 0xFFFEEE90, {}, {0x90, 0xEE, 0xFE}},
    {DataType::integer24, 24, 4, 0x7FFFFF, {}, {0xFF, 0xFF, 0x7F}},
    {DataType::integer24, 24, 4, 0x800000, {}, {}},
    {DataType::integer24, 24, 4, 0xFF7FFFFF, {}, {}},
    {DataType::integer32, 32, 4, 0x80000000, {}, {0, 0, 0, 0x80}},
    {DataType::integer16, 4, 2, 0xFFF8, {}, {0x08}},
    {DataType::integer16, 4, 2, 8, {}, {}},
    {DataType::integer40, 40, 8, 0xFFFFFF8B95AD7800, {}, {0x00, 0x78, 0xAD, 0x95, 0x8B}},
    {DataType::integer48, 48, 8, 0xFFFF800000000000, {}, {0, 0, 0, 0, 0, 0x80}},
    {DataType::integer56, 56, 8, 0x0080000000000000, {}, {}},
    {DataType::integer64, 64, 8, 0x8000000000000001, {}, {1, 0, 0, 0, 0, 0, 0, 0x80}},
    {DataType::unsigned8, 8, 1, 0xF0, {}, {0xF0}},
    {DataType::unsigned16, 16, 2, 0xFDE8, {}, {0xE8, 0xFD}},
    {DataType::unsigned16, 12, 2, 0x0FFF, {}, {0xFF, 0x0F}},
    {DataType::unsigned16, 12, 2, 0x1000, {}, {}},
    {DataType::unsigned24, 24, 4, 0xFFFFFF, {}, {0xFF, 0xFF, 0xFF}},
    {DataType::unsigned24, 24, 4, 0x1000000, {}, {}},
    {DataType::unsigned32, 32, 4, 0xEE6B2800, {}, {0x00, 0x28, 0x6B, 0xEE}},
    {DataType::unsigned40, 40, 8, 0xE8D4A51000, {}, {0x00, 0x10, 0xA5, 0xD4, 0xE8}},
    {DataType::unsigned48, 48, 8, std::uint64_t{1} << 48U, {}, {}},
    {DataType::unsigned56, 56, 8, 1, {}, {1, 0, 0, 0, 0, 0, 0}},
    {DataType::unsigned64, 64, 8, ~std::uint64_t{0}, {}, {255, 255, 255, 255, 255, 255, 255, 255}},
    {DataType::real32, 32, 4, 0x3FC00000, {}, {0x00, 0x00, 0xC0, 0x3F}},
    {DataType::real64,
     64,
     8,
     0xBFB999999999999A,
     {},
     {0x9A, 0x99, 0x99, 0x99, 0x99, 0x99, 0xB9, 0xBF}},
    {DataType::visible_string, 32, 0, 0, "", {0, 0, 0, 0}},
    {DataType::visible_string, 32, 0, 0, "A\xC3\xBCz", {'A', 0xFC, 'z', 0}},
    {DataType::visible_string, 32, 0, 0, "abcd", {'a', 'b', 'c', 'd'}},
    {DataType::visible_string, 32, 0, 0, "abcde", {}},
    {DataType::visible_string, 32, 0, 0, "\xE2\x82\xAC", {}},  // beyond Latin-1
    {DataType::visible_string, 32, 0, 0, "\xFC", {}},          // no UTF-8
    {DataType::visible_string, 32, 0, 0, "\xC1\x81", {}},      // longer than needed
    {DataType::visible_string, 32, 0, 0, "\xC3", {}},          // ends early
    {DataType::unicode_string, 32, 0, 0, "\xE2\x82\xAC", {0xAC, 0x20, 0, 0}},
    {DataType::unicode_string, 32, 0, 0, "\xF0\x9F\x98\x80", {0x3D, 0xD8, 0x00, 0xDE}},
    {DataType::unicode_string, 16, 0, 0, "\xE2\x82\xAC", {0xAC, 0x20}},
    {DataType::unicode_string, 32, 0, 0, "\xED\xA0\x80", {}},  // a surrogate
    {DataType::unicode_string, 32, 0, 0, "abc", {}},
    {DataType::unicode_string, 48, 0, 0, "a\xF0\x9F\x98\x80", {'a', 0, 0x3D, 0xD8, 0x00, 0xDE}},
    {DataType::unicode_string, 48, 0, 0, "ab\xF0\x9F\x98\x80", {}},
    {DataType::time_of_day,
     48,
     8,
     1'796'000'400'001'999'999,
     {},
     {0x81, 0xEE, 0x36, 0x00, 0x3A, 0x3D}},  // rounded down to ms
    {DataType::time_of_day, 48, 8, 441'763'200'000'000'000, {}, {0, 0, 0, 0, 0, 0}},
    {DataType::time_of_day, 48, 8, 441'763'199'999'999'999, {}, {}},
    {DataType::time_of_day, 48, 8, 0x8000000000000000, {}, {}},
    {DataType::time_difference, 48, 8, 86'400'002'000'000, {}, {2, 0, 0, 0, 1, 0}},
    {DataType::time_difference, 48, 8, ~std::uint64_t{0}, {}, {}},
    {DataType::time_difference, 48, 8, 65'536 * std::uint64_t{86'400'000'000'000}, {}, {}},
    {DataType::octet_string, 24, 1, 0, "\x01\x02\xFF", {0x01, 0x02, 0xFF}},
    {DataType::octet_string, 12, 1, 0, "\x01\x0F", {0x01, 0x0F}},
    {DataType::octet_string, 12, 1, 0, "\x01\x10", {}},
    {DataType::domain, 64, 1, 0, "\x01\x02\x03\x04\x05\x06\x07\x08", {1, 2, 3, 4, 5, 6, 7, 8}},
    {DataType::none, 24, 4, 0x010203, {}, {3, 2, 1}},
    // of PDOs of CANopen FD
    {DataType::octet_string, 72, 1, 0, "123456789", {'1', '2', '3', '4', '5', '6', '7', '8', '9'}},
    {DataType::domain, 80, 1, 0, "123456789\x01", {'1', '2', '3', '4', '5', '6', '7', '8', '9', 1}},
    {DataType::visible_string,
     80,
     0,
     0,
     "123456789",
     {'1', '2', '3', '4', '5', '6', '7', '8', '9', 0}},
    {DataType::visible_string, 72, 0, 0, "123456789A", {}},
    {DataType::unicode_string,
     80,
     0,
     0,
     "abcd\xE2\x82\xAC",
     {'a', 0, 'b', 0, 'c', 0, 'd', 0, 0xAC, 0x20}},
};

TEST(SetPlan, ReadsAValueOfEveryType) {
  for (const ValueCase& one : kValues) {
    SCOPED_TRACE(std::string(od::name(one.type)) + " " + std::to_string(one.bits) + " bits, " +
                 std::to_string(one.number) + " " + std::string(one.text));
    const SetPlan plan(type_of({{"ram.A", one.type, one.bits}}));
    for (const bool given : {true, false}) {
      Cdr cdr = head();
      cdr.number(given ? 1 : 0, 1);
      if (one.size == 0)
        cdr.text(one.text);
      else if (!one.text.empty())
        cdr.octets({one.text.begin(), one.text.end()});
      else
        cdr.number(one.number, one.size);
      SetSample read;
      ASSERT_TRUE(plan.read(cdr.take(), read));
      EXPECT_LE(cdr.take().size(), plan.max_size());
      const bool fits = !one.data.empty() || !given;
      EXPECT_EQ(read.refusal, fits ? OutputRefusal::none : OutputRefusal::bad_value);
      EXPECT_EQ(read.why.empty(), fits);
      ASSERT_EQ(read.write.values.size(), given && fits ? 1U : 0U);
      if (given && fits) {
        EXPECT_EQ(data_of(read.write.values[0]), one.data);
      }
    }
  }
}

TEST(SetPlan, NamesTheValueThatDoesNotFit) {
  const SetPlan plan(type_of({{"ram.A", DataType::unsigned24, 24}}));
  SetSample read;
  ASSERT_TRUE(plan.read(head().number(1, 1).number(0x1000000, 4).take(), read));
  EXPECT_EQ(read.why, "the value of ram_A does not fit into 24 bits of its type");
}

TEST(SetPlan, RejectsASampleThatEndsEarlyOrLate) {
  const SetPlan plan(type_of(kThree));
  auto sample = head().octets({1, 1, 1, 1}).text("abc").number(0x1234, 2).take();
  SetSample read;
  for (std::size_t size = 0; size < sample.size(); ++size)
    EXPECT_FALSE(plan.read(std::span(sample).first(size), read)) << size;
  for (int padding = 0; padding < 4; ++padding) {
    EXPECT_TRUE(plan.read(sample, read));
    sample.push_back(std::byte{0});
  }
  EXPECT_FALSE(plan.read(sample, read));
}

TEST(SetPlan, RejectsWhatIsNoCdr) {
  const SetPlan plan(type_of(kThree));
  const auto good = head().octets({1, 1, 1, 1}).text("abc").number(0x1234, 2);
  const auto is_read = [&](const std::vector<std::byte>& sample) {
    SetSample read;
    return plan.read(sample, read);
  };
  ASSERT_TRUE(is_read(good.take()));
  for (const unsigned kind : {2U, 3U, 6U, 7U, 10U, 11U, 255U}) {
    auto sample = good.take();
    sample[1] = static_cast<std::byte>(kind);
    EXPECT_FALSE(is_read(sample)) << "encapsulation " << kind;
  }
  EXPECT_FALSE(is_read(head().octets({1, 2, 1, 1}).text("abc").number(1, 2).take())) << "mark";
  EXPECT_FALSE(is_read(head().octets({1, 1, 1, 2}).text("abc").number(1, 2).take())) << "boolean";
  const auto with_text = [&](std::uint32_t length, const Octets& octets) {
    return head().octets({1, 1, 1, 1}).number(length, 4).octets(octets).number(1, 2).take();
  };
  EXPECT_TRUE(is_read(with_text(4, {'a', 'b', 'c', 0})));
  EXPECT_FALSE(is_read(with_text(4, {'a', 'b', 'c', 'd'}))) << "no end";
  EXPECT_FALSE(is_read(with_text(4, {'a', 0, 'c', 0}))) << "a zero";
  EXPECT_FALSE(is_read(with_text(0, {}))) << "no end";
  EXPECT_FALSE(is_read(with_text(0xFFFFFFFF, {'a', 0})));
  EXPECT_FALSE(is_read(with_text(10, {'1', '2', '3', '4', '5', '6', '7', '8', '9', 0})));
}

TEST(SetPlan, RejectsNamesThatAreTooLong) {
  const SetPlan plan(type_of({{"ram.A", DataType::unsigned8, 8}}));
  const auto with = [](std::size_t gateway, std::size_t client) {
    Cdr cdr;
    cdr.text(std::string(gateway, 'g')).text("press").number(3, 2).number(0, 8);
    cdr.text(std::string(client, 'c')).number(1, 8).number(0, 8).number(0, 1).octets({1, 5});
    return cdr.take();
  };
  SetSample read;
  EXPECT_TRUE(plan.read(with(64, 64), read));
  EXPECT_LE(with(64, 64).size(), plan.max_size());
  EXPECT_FALSE(plan.read(with(65, 64), read));
  EXPECT_FALSE(plan.read(with(64, 65), read));
  EXPECT_TRUE(key_of_set(with(64, 65)).has_value());
  EXPECT_FALSE(key_of_set(with(65, 1)).has_value());
}

TEST(SetPlan, KeyIsBigEndianCdr) {
  const Octets expected = {0, 0, 0, 5, 'g', 'a', 't', 'e', 0,   0, 0, 0,
                           0, 0, 0, 6, 'p', 'r', 'e', 's', 's', 0, 0, 3};
  for (const bool little : {true, false}) {
    const auto key = key_of_set(Cdr(little).text("gate").text("press").number(3, 2).take());
    ASSERT_TRUE(key.has_value());
    Octets octets;
    for (std::size_t i = 0; i < key->size; ++i)
      octets.push_back(std::to_integer<std::uint8_t>(key->octets[i]));
    EXPECT_EQ(octets, expected);
  }
  EXPECT_FALSE(key_of_set({}).has_value());
}

}  // namespace
}  // namespace linegate::named
