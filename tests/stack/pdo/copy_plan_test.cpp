// SPDX-License-Identifier: Apache-2.0
#include "stack/pdo/copy_plan.h"

#include <gtest/gtest.h>

#include "stack/image/area.h"

#include "tests/stack/pdo/devices.h"

namespace linegate::pdo {
namespace {

TEST(CopyPlan, NeighboursInFrameAndImageAreOneRun) {
  CopyPlan plan;
  for (std::uint32_t i = 0; i < 4; ++i) {
    plan.add_image(8 * 40 + 16 * i, 16);
  }
  ASSERT_EQ(plan.runs.size(), 1U);
  EXPECT_EQ(plan.runs[0].offset, 40U);
  EXPECT_EQ(plan.runs[0].mask, ~std::uint64_t{0});
  EXPECT_EQ(plan.runs[0].rotate, 0);
  EXPECT_EQ(plan.bytes(), 8U);
}

TEST(CopyPlan, SixtyFourBitsAreOneRun) {
  CopyPlan plan;
  for (std::uint32_t i = 0; i < 64; ++i) {
    plan.add_image(8 + i, 1);
  }
  EXPECT_EQ(plan.runs.size(), 1U);
}

TEST(CopyPlan, FillersBetweenAreLeftOutOfTheMask) {
  CopyPlan plan;
  plan.add_image(0, 8);
  plan.skip(8);
  plan.add_image(16, 8);
  ASSERT_EQ(plan.runs.size(), 1U);
  EXPECT_EQ(plan.runs[0].mask, 0x00FF00FFU);
}

TEST(CopyPlan, AlignmentSplitsIt) {
  CopyPlan plan;
  plan.add_image(0, 8);
  plan.add_image(16, 16);
  EXPECT_EQ(plan.runs.size(), 2U);
}

TEST(ObjectRun, BooleanIsOneByte) {
  std::byte value{};
  const ObjectRun run{&value, 11, 1};
  std::array<std::byte, 64> frame{std::byte{0}, std::byte{0x08}};
  run.to_object(frame.data());
  EXPECT_EQ(value, std::byte{1});
  frame[1] = std::byte{0xF7};
  run.to_object(frame.data());
  EXPECT_EQ(value, std::byte{0});
  value = std::byte{1};
  frame = {};
  run.to_frame(frame.data());
  EXPECT_EQ(frame[1], std::byte{0x08});
}

bool bit(const std::byte* bytes, std::size_t at) {
  return (bytes[at / 8] >> (at % 8) & std::byte{1}) != std::byte{0};
}

void put(std::byte* bytes, std::size_t at, bool value) {
  const std::byte mask = std::byte{1} << (at % 8);
  bytes[at / 8] = value ? bytes[at / 8] | mask : bytes[at / 8] & ~mask;
}

// A random PDO: its values, fillers, and places in an area that do not overlap.
struct RandomPdo {
  struct Piece {
    std::uint32_t frame_bit;
    std::uint32_t image_bit;
    std::uint32_t bits;
  };

  RandomPdo(test::Random& random, std::uint32_t max_bits) {
    std::uint32_t image_bit = random() % 40;
    while (plan.bits < max_bits) {
      const std::uint32_t bits = 1 + random() % std::min(64U, max_bits - plan.bits);
      const std::uint32_t kind = random() % 4;
      if (kind == 0) {
        plan.skip(bits);
        continue;
      }
      image_bit += kind == 1 ? random() % 100 : 0;
      image_bit = kind == 2 ? (image_bit + 7) / 8 * 8 : image_bit;
      pieces.push_back({plan.bits, image_bit, bits});
      plan.add_image(image_bit, bits);
      image_bit += bits;
    }
  }

  CopyPlan plan;
  std::vector<Piece> pieces;
};

class CopyPlanProperty : public testing::TestWithParam<std::uint32_t> {};

constexpr std::size_t kAreaBytes = 512;

TEST_P(CopyPlanProperty, IntoTheImageIsANaiveCopyOfBits) {
  test::Random random(GetParam());
  for (int round = 0; round < 300; ++round) {
    const RandomPdo pdo(random, GetParam());
    std::array<std::byte, 64> frame;
    random.fill(frame);
    image::Area area(kAreaBytes, 1);
    std::vector<std::byte> naive(kAreaBytes);
    for (std::size_t i = 0; i < kAreaBytes; ++i) {
      naive[i] = static_cast<std::byte>(random());
      area.data()[i] = naive[i];
    }
    for (const RandomPdo::Piece& piece : pdo.pieces) {
      for (std::uint32_t i = 0; i < piece.bits; ++i) {
        put(naive.data(), piece.image_bit + i, bit(frame.data(), piece.frame_bit + i));
      }
    }
    for (const pdo::Run& run : pdo.plan.runs) {
      ASSERT_LE(run.frame_byte, 56);
      area.merge(run.offset, run.to_image(frame.data()), run.mask);
    }
    ASSERT_TRUE(std::equal(naive.begin(), naive.end(), area.data()))
        << "seed " << GetParam() << " round " << round;
  }
}

TEST_P(CopyPlanProperty, OutOfTheImageIsANaiveCopyOfBits) {
  test::Random random(GetParam() + 1);
  for (int round = 0; round < 300; ++round) {
    const RandomPdo pdo(random, GetParam());
    std::vector<std::byte> area(kAreaBytes + image::kSlackBytes);
    random.fill(area);
    std::array<std::byte, 64> naive{};
    for (const RandomPdo::Piece& piece : pdo.pieces) {
      for (std::uint32_t i = 0; i < piece.bits; ++i) {
        put(naive.data(), piece.frame_bit + i, bit(area.data(), piece.image_bit + i));
      }
    }
    std::array<std::byte, 64> frame{};
    for (const pdo::Run& run : pdo.plan.runs) {
      std::byte* const word = frame.data() + run.frame_byte;
      const auto from = load_le<std::uint64_t>(area.data() + run.offset);
      store_le(word, load_le<std::uint64_t>(word) | run.to_frame(from));
    }
    ASSERT_EQ(frame, naive) << "seed " << GetParam() << " round " << round;
  }
}

TEST_P(CopyPlanProperty, ObjectsAreCopiedWhereverTheyLieInTheFrame) {
  test::Random random(GetParam() + 2);
  for (int round = 0; round < 300; ++round) {
    CopyPlan plan;
    std::array<std::array<std::byte, 8>, 64> values{};
    while (plan.bits < GetParam() && plan.objects.size() < values.size()) {
      const std::uint32_t left = GetParam() - plan.bits;
      const std::uint32_t bits =
          left < 8 || random() % 2 == 0 ? 1 : 8 * (1 + random() % (std::min(left, 64U) / 8));
      plan.add_object(values[plan.objects.size()].data(), bits);
    }
    std::array<std::byte, 64> frame;
    random.fill(frame);
    for (std::uint32_t i = plan.bits; i < 512; ++i) {
      put(frame.data(), i, false);
    }
    for (const ObjectRun& object : plan.objects) {
      object.to_object(frame.data());
      for (std::uint32_t i = 0; i < object.bits; ++i) {
        ASSERT_EQ(bit(object.data, i), bit(frame.data(), object.frame_bit + i));
      }
    }
    std::array<std::byte, 64> back{};
    for (const ObjectRun& object : plan.objects) {
      object.to_frame(back.data());
    }
    ASSERT_EQ(back, frame) << "seed " << GetParam() << " round " << round;
  }
}

INSTANTIATE_TEST_SUITE_P(Lengths, CopyPlanProperty, testing::Values(64U, 61U, 8U, 512U, 200U));

}  // namespace
}  // namespace linegate::pdo
