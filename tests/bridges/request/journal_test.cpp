// SPDX-License-Identifier: Apache-2.0
// The bytes of requests for pages of the journal and of the pages; malformed bytes.
#include "bridges/request/journal.h"

#include <chrono>
#include <limits>

#include <gtest/gtest.h>

namespace linegate::request {
namespace {

using Bytes = std::vector<std::byte>;

JournalRecord record() {
  return {.stream = 1,
          .incarnation = 2,
          .line = "press",
          .number = 3,
          .time = Instant(std::chrono::nanoseconds(4)),
          .clock = 2,
          .kind = EventKind::emcy,
          .severity = EventSeverity::error,
          .node = 5,
          .code = 6,
          .value = 7,
          .data = {std::byte{8}},
          .text = "words"};
}

TEST(JournalCodec, ARequestHasTheLayoutOfTheContract) {
  const JournalRead request{.line = "ab", .least = EventSeverity::warning, .text = "c"};
  Bytes expected(2 + 3 + 8 * 6);
  expected[0] = std::byte{1};
  expected[4] = std::byte{1};
  for (const int octet : {2, int{'a'}, int{'b'}, 1, int{'c'}})
    expected.push_back(static_cast<std::byte>(octet));
  EXPECT_EQ(encode(request), expected);
}

TEST(JournalCodec, MalformedRequestsAreRefusedWithTheReason) {
  const Bytes good = encode(JournalRead{.line = "ab", .text = "c"});
  JournalRead read;
  ASSERT_EQ(decode(good, read), nullptr);
  for (std::size_t length = 0; length < good.size(); ++length)
    EXPECT_NE(decode(std::span(good).first(length), read), nullptr) << length;
  const auto spoilt = [&](std::size_t at, int octet) {
    Bytes bytes = good;
    bytes[at] = static_cast<std::byte>(octet);
    const char* const why = decode(bytes, read);
    return std::string(why == nullptr ? "" : why);
  };
  EXPECT_EQ(spoilt(1, 1), "the flags have unknown bits");
  EXPECT_EQ(spoilt(2, 128), "the node is not 0..127");
  EXPECT_EQ(spoilt(4, 3), "the severity is not 0..2");
  EXPECT_EQ(spoilt(0, 32), "a stream and number need a line, and the order of publication");
  EXPECT_EQ(spoilt(0, 1 | 32 | 64),
            "a stream and number need a line, and the order of publication");
  for (const int flags : {1 | 4, 1 | 32})
    EXPECT_EQ(spoilt(0, 128 | flags), "values have no kind, severity, stream and number");
  EXPECT_EQ(spoilt(0, 128), "");
  EXPECT_TRUE(read.values);
  EXPECT_NE(spoilt(good.size() - 2, 255), "") << "a length beyond the end";
  Bytes longer = good;
  longer.push_back(std::byte{0});
  EXPECT_NE(decode(longer, read), nullptr);
}

TEST(JournalCodec, APageComesBackAsItWent) {
  const JournalPage page{.cursor = {5, 6},
                         .newest = {7, 8},
                         .more = true,
                         .unknown_stream = true,
                         .records = {record(), {}, record()}};
  const auto back = decode_page(encode(page));
  ASSERT_TRUE(back);
  EXPECT_EQ(*back, page);
}

TEST(JournalCodec, TheSizeOfARecordIsKnownBeforeItIsEncodedAndItsStringsAreCut) {
  JournalRecord longest = record();
  longest.line.assign(300, 'l');
  longest.data.resize(300);
  longest.text.assign(300, 't');
  for (const JournalRecord& one : {JournalRecord{}, record(), longest}) {
    const std::size_t empty = encode(JournalPage{}).size();
    EXPECT_EQ(encode(JournalPage{.records = {one}}).size(), empty + encoded_size(one));
  }
  const auto back = decode_page(encode(JournalPage{.records = {longest}}));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->records[0].line.size(), 64U);
  EXPECT_EQ(back->records[0].data.size(), 64U);
  EXPECT_EQ(back->records[0].text.size(), 256U);
}

JournalValue value(std::uint16_t bits, std::optional<std::uint64_t> of, std::string name = "a.b") {
  return {.series = {.line = "press",
                     .direction = 1,
                     .node = 5,
                     .type = 6,
                     .bits = bits,
                     .name = std::move(name),
                     .unit = "K",
                     .scale = 0.5,
                     .offset = -2},
          .time = Instant(std::chrono::nanoseconds(0x0102)),
          .clock = 2,
          .value = of};
}

TEST(JournalCodec, APageOfValuesHasTheLayoutOfTheContract) {
  const Bytes page = encode(JournalPage{.values = {value(16, 7), value(16, {})}});
  Bytes expected(1 + 16 + 16);
  expected[0] = std::byte{4};
  // clang-format off
  for (const int octet :
       {0, 0,  // a new series
        1, 5, 6, 0, 16, 0, 5, int{'p'}, int{'r'}, int{'e'}, int{'s'}, int{'s'}, 3, 0, int{'a'}, int{'.'}, int{'b'},
        0, 0, 0, 0, 0, 0, 0xE0, 0x3F,  // 0.5
        0, 0, 0, 0, 0, 0, 0, 0xC0,     // -2
        1, int{'K'},
        2, 1, 0, 0, 0, 0, 0, 0, 2, 1, 7, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 2, 1, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0})
    // clang-format on
    expected.push_back(static_cast<std::byte>(octet));
  EXPECT_EQ(page, expected);
}

TEST(JournalCodec, APageOfValuesComesBackAsItWent) {
  const JournalPage page{.cursor = {5, 6},
                         .newest = {7, 8},
                         .more = true,
                         .unknown_entry = true,
                         .values = {value(16, 7), value(64, ~std::uint64_t{0}, "c.d"),
                                    value(16, std::nullopt), value(8, 1)}};
  const Bytes bytes = encode(page);
  const auto back = decode_page(bytes);
  ASSERT_TRUE(back);
  EXPECT_EQ(*back, page);
  std::size_t size = encode(JournalPage{}).size();
  for (std::size_t i = 0; i < page.values.size(); ++i)
    size += encoded_size(page.values[i], i != 2);
  EXPECT_EQ(bytes.size(), size);
}

TEST(JournalCodec, MalformedPagesOfValuesAreNotRead) {
  const JournalPage page{.values = {value(16, 7), value(16, 8)}};
  const Bytes good = encode(page);
  const std::size_t first = encode(JournalPage{}).size();
  const std::size_t second = first + encoded_size(page.values[0], true);
  for (std::size_t length = 0; length < good.size(); ++length)
    EXPECT_EQ(decode_page(std::span(good).first(length)).has_value(),
              length == first || length == second)
        << length;
  const auto spoilt = [&](std::size_t at, int octet) {
    Bytes bytes = good;
    bytes[at] = static_cast<std::byte>(octet);
    return decode_page(bytes).has_value();
  };
  EXPECT_FALSE(spoilt(first, 1)) << "a series that was not described";
  EXPECT_FALSE(spoilt(first + 2, 2)) << "the direction";
  EXPECT_FALSE(spoilt(first + 6, 0)) << "no bits";
  EXPECT_FALSE(spoilt(first + 6, 65)) << "more than 64 bits";
  EXPECT_FALSE(spoilt(second + 11, 2)) << "neither valid nor invalid";
  EXPECT_TRUE(spoilt(second + 11, 0));
  EXPECT_FALSE(spoilt(second + 1, 1)) << "a series far beyond";
}

TEST(JournalCodec, AValueHasAScalingThatAnEntryCanHave) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
  const auto is_read = [](double scale, double offset, std::string unit) {
    JournalPage page{.values = {value(16, 7)}};
    page.values[0].series.scale = scale;
    page.values[0].series.offset = offset;
    page.values[0].series.unit = std::move(unit);
    return decode_page(encode(page)).has_value();
  };
  EXPECT_TRUE(is_read(-0.1, 1e300, ""));
  EXPECT_FALSE(is_read(0, 0, ""));
  for (const double wrong : {kInfinite, -kInfinite, kNoNumber}) {
    EXPECT_FALSE(is_read(wrong, 0, ""));
    EXPECT_FALSE(is_read(1, wrong, ""));
  }
  EXPECT_TRUE(is_read(1, 0, std::string(40, 'x'))) << "it is cut";
  Bytes page = encode(JournalPage{.values = {value(16, 7)}});
  const std::size_t length = encode(JournalPage{}).size() + 35;
  ASSERT_EQ(page.at(length), std::byte{1});
  page[length] = std::byte{33};
  page.insert(page.begin() + static_cast<std::ptrdiff_t>(length) + 1, 32, std::byte{'x'});
  EXPECT_FALSE(decode_page(page).has_value());
}

TEST(JournalCodec, CutPagesAreNotRead) {
  const Bytes good = encode(JournalPage{.records = {record()}});
  const std::size_t without_records = encode(JournalPage{}).size();
  for (std::size_t length = 0; length < good.size(); ++length)
    EXPECT_EQ(decode_page(std::span(good).first(length)).has_value(), length == without_records);
}

}  // namespace
}  // namespace linegate::request
