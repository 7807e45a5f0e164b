// SPDX-License-Identifier: Apache-2.0
// Invariant: applying joined writes has the effect of applying each of them, in their order.
#include "stack/line/output_merge.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace linegate::line {
namespace {

constexpr std::size_t kAreaBytes = 40;

// Numbers of 32 bits.
class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  std::uint32_t operator()() { return static_cast<std::uint32_t>(engine_()); }

 private:
  std::mt19937 engine_;
};

// As OutputService::apply() does: values first, then bytes.
class Area {
 public:
  explicit Area(std::vector<OutputPlace> places) : places_(std::move(places)) {}

  void apply(const OutputWrite& write) {
    for (const OutputValue& value : write.values) {
      const OutputPlace& place = places_[value.entry];
      for (std::uint32_t i = 0; i < place.bit_length; ++i) {
        const bool set = (std::to_integer<unsigned>(value.data[i / 8]) >> (i % 8) & 1U) != 0;
        bits_[place.bit_offset + i] = set;
      }
    }
    for (const OutputBytes& run : write.bytes) {
      for (std::size_t i = 0; i < 8 * run.data.size(); ++i) {
        bits_[8 * run.offset + i] =
            (std::to_integer<unsigned>(run.data[i / 8]) >> (i % 8) & 1U) != 0;
      }
    }
  }
  bool operator==(const Area& other) const { return bits_ == other.bits_; }

 private:
  std::vector<OutputPlace> places_;
  std::vector<bool> bits_ = std::vector<bool>(8 * kAreaBytes);
};

// Entries side by side, of 1 to 24 bits, and some of 65 to 255, as on lines of CANopen FD.
std::vector<OutputPlace> random_places(Random& random) {
  std::vector<OutputPlace> out;
  for (std::uint32_t at = 0; at < 8 * kAreaBytes;) {
    const std::uint32_t wanted = random() % 8 == 0 ? 65 + random() % 191 : 1 + random() % 24;
    const std::uint32_t bits = std::min<std::uint32_t>(wanted, 8 * kAreaBytes - at);
    out.push_back({.bit_offset = at, .bit_length = bits});
    at += bits;
  }
  return out;
}

// Whole entries, as Outputs::check() demands.
bool is_whole(const OutputBytes& run, const std::vector<OutputPlace>& places) {
  const std::size_t begin = 8 * run.offset;
  const std::size_t end = begin + 8 * run.data.size();
  return std::ranges::all_of(places, [&](const OutputPlace& place) {
    const std::size_t last = place.bit_offset + place.bit_length;
    return last <= begin || place.bit_offset >= end || (place.bit_offset >= begin && last <= end);
  });
}

OutputWrite random_write(Random& random, const std::vector<OutputPlace>& places) {
  OutputWrite out;
  for (std::uint32_t i = random() % 4; i > 0; --i) {
    OutputValue value{.entry = static_cast<std::uint32_t>(random() % places.size())};
    value.length = static_cast<std::uint8_t>((places[value.entry].bit_length + 7) / 8);
    for (std::size_t byte = 0; byte < value.length; ++byte) {
      value.data[byte] = static_cast<std::byte>(random());
    }
    out.values.push_back(value);
  }
  for (std::uint32_t i = random() % 4; i > 0; --i) {
    OutputBytes run{.offset = static_cast<std::uint32_t>(random() % kAreaBytes), .data = {}};
    run.data.resize(1 + random() % (kAreaBytes - run.offset));
    for (std::byte& byte : run.data) {
      byte = static_cast<std::byte>(random());
    }
    if (is_whole(run, places)) {
      out.bytes.push_back(std::move(run));
    }
  }
  return out;
}

TEST(OutputMerge, HasTheEffectOfEachWriteInTheirOrder) {
  for (unsigned seed = 1; seed <= 5000; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Random random(seed);
    const std::vector<OutputPlace> places = random_places(random);
    Area expected(places);
    OutputWrite joined = random_write(random, places);
    expected.apply(joined);
    for (std::uint32_t i = 1 + random() % 4; i > 0; --i) {
      OutputWrite newer = random_write(random, places);
      expected.apply(newer);
      add_earlier(newer, joined, places);
      joined = std::move(newer);
    }
    Area area(places);
    area.apply(joined);
    ASSERT_TRUE(area == expected);
    std::size_t bytes = 0;
    for (const OutputBytes& run : joined.bytes) {
      ASSERT_TRUE(is_whole(run, places)) << "the line would refuse it";
      bytes += run.data.size();
    }
    ASSERT_LE(bytes, kAreaBytes) << "it does not grow with the number of writes";
  }
}

TEST(OutputMerge, AHandshakeKeepsTheValuesThatWait) {
  const std::vector<OutputPlace> places{{.bit_offset = 0, .bit_length = 8}};
  OutputWrite earlier;
  earlier.values.push_back({.entry = 0, .length = 1, .data = {std::byte{7}}});
  OutputWrite handshake;
  add_earlier(handshake, earlier, places);
  ASSERT_EQ(handshake.values.size(), 1U);
  EXPECT_EQ(handshake.values[0].data[0], std::byte{7});
  EXPECT_TRUE(earlier.values.empty());
}

}  // namespace
}  // namespace linegate::line
