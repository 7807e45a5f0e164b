// SPDX-License-Identifier: Apache-2.0
#include "gateway/runtime/direct_images.h"

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "gateway/runtime/image_record.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;
using image::Direction;

image::Layout layout_of(Direction direction, std::uint16_t pdos) {
  image::Layout layout;
  layout.direction = direction;
  layout.id = 7 + static_cast<std::uint64_t>(direction);
  layout.byte_size = pdos;
  for (std::uint16_t pdo = 1; pdo <= pdos; ++pdo) {
    image::Entry entry;
    entry.bit_offset = 8 * (pdo - 1U);
    entry.bit_length = 8;
    entry.local_pdo = pdo;
    layout.entries.push_back(entry);
  }
  return layout;
}

image::PdoMark mark(std::uint16_t pdo, std::uint32_t count) {
  image::PdoMark out;
  out.local_pdo = pdo;
  out.count = count;
  return out;
}

class DirectImagesTest : public testing::Test {
 protected:
  static config::LinePlan plan(config::Publish::Rule rule) {
    config::LinePlan out;
    out.publish = {rule, Duration::zero()};
    out.pdo_min_period = 100ms;
    return out;
  }
  void use(config::Publish::Rule rule) {
    images_ = std::make_unique<DirectImages>(plan(rule), layouts_, bell_);
    reader_.emplace(images_->records().descriptors());
  }
  // Takes a snapshot in which these PDOs were received with that value; 0: without a change.
  bool take(std::uint8_t value, const std::vector<image::PdoMark>& marks,
            Direction direction = Direction::inputs) {
    image::Snapshot& draft = images_->draft(direction);
    const image::Layout& layout = layouts_.at(static_cast<std::size_t>(direction));
    draft.direction = direction;
    draft.layout_id = layout.id;
    draft.bytes.resize(layout.byte_size);
    draft.changed.assign(1, 0);
    draft.valid.assign(1, 0xF);
    draft.known.assign(1, 0xF);
    draft.marks = marks;
    draft.acquired = now_;
    for (const image::PdoMark& of : marks) {
      if (value != 0) {
        draft.bytes.at(of.local_pdo - 1U) = std::byte{value};
        draft.changed[0] |= std::uint64_t{1} << (of.local_pdo - 1U);
      }
    }
    return images_->taken(direction, clock_, now_, handover_);
  }
  // The next published image; its sequence is 0 if there is none.
  image::Snapshot next(Direction direction = Direction::inputs) {
    image::Snapshot out;
    ClockMap clock;
    const auto series = static_cast<std::size_t>(direction);
    const auto record = reader_->next(series);
    if (record.number != 0) {
      EXPECT_TRUE(read_record(record.data, out, clock));
      EXPECT_EQ(clock.offset, clock_.offset);
      EXPECT_EQ(clock.quality, clock_.quality);
      out.sequence = record.number;
      reader_->done(series);
    }
    return out;
  }

  std::array<image::Layout, 2> layouts_{layout_of(Direction::inputs, 4),
                                        layout_of(Direction::outputs, 4)};
  std::shared_ptr<exchange::Bell> bell_ = std::make_shared<exchange::Bell>();
  std::unique_ptr<DirectImages> images_;
  std::optional<exchange::SlotReader> reader_;
  exchange::Handover<image::Snapshot> handover_;
  ClockMap clock_{5s, ClockQuality::synchronised};
  Instant now_{Duration{1s}};
};

TEST_F(DirectImagesTest, AnImageArrivesAsItWasTaken) {
  use(config::Publish::Rule::on_change);
  take(9, {mark(2, 3)}, Direction::outputs);
  const image::Snapshot image = next(Direction::outputs);
  EXPECT_EQ(image.sequence, 1U);
  EXPECT_EQ(image.direction, Direction::outputs);
  EXPECT_EQ(image.layout_id, 8U);
  EXPECT_EQ(image.acquired, now_);
  EXPECT_EQ(image.bytes[1], std::byte{9});
  EXPECT_TRUE(image.is_changed(1));
  EXPECT_FALSE(image.is_changed(0));
  EXPECT_TRUE(image.is_known(3));
  ASSERT_EQ(image.marks.size(), 1U);
  EXPECT_EQ(image.marks[0].count, 3U);
  EXPECT_EQ(handover_.fetch(), nullptr) << "the publisher needs no outputs";
}

TEST_F(DirectImagesTest, OnChangeSkipsWhatHasNoneAndKeepsItsReceptions) {
  use(config::Publish::Rule::on_change);
  take(1, {mark(1, 1)});
  EXPECT_EQ(next().sequence, 1U);
  take(0, {mark(1, 2)});
  take(0, {mark(2, 5)});
  EXPECT_EQ(next().sequence, 0U);
  take(2, {mark(1, 1)});
  const image::Snapshot image = next();
  EXPECT_EQ(image.sequence, 2U) << "without a gap";
  ASSERT_EQ(image.marks.size(), 2U);
  EXPECT_EQ(image.marks[0].count, 3U);
  EXPECT_EQ(image.marks[1].count, 5U);
}

TEST_F(DirectImagesTest, OtherRulesPublishEach) {
  use(config::Publish::Rule::period);
  take(0, {});
  take(0, {});
  EXPECT_EQ(next().sequence, 1U);
  EXPECT_EQ(next().sequence, 2U);
}

// As after the death of the other process.
TEST_F(DirectImagesTest, ImagesThatFindNoRoomBecomeOneWithAllChanges) {
  use(config::Publish::Rule::on_change);
  std::uint8_t value = 0;
  while (images_->next_try() == kNever) {
    take(++value, {mark(1, 1)});
  }
  EXPECT_EQ(value, exchange::SlotWriter::kSlots);
  take(100, {mark(2, 1)});
  take(101, {mark(1, 1), mark(3, 1)});
  reader_.emplace(images_->records().descriptors());
  for (std::uint8_t number = 1; number < value; ++number) {
    EXPECT_EQ(next().sequence, number);
  }
  EXPECT_EQ(next().sequence, 0U);
  now_ = images_->next_try();
  images_->publish_waiting(Direction::inputs, clock_, now_);
  EXPECT_EQ(images_->next_try(), kNever);
  const image::Snapshot image = next();
  EXPECT_EQ(image.sequence, value);
  EXPECT_EQ(image.changed[0], 7U);
  EXPECT_EQ(image.bytes[1], std::byte{100});
  EXPECT_EQ(image.bytes[0], std::byte{101});
  ASSERT_EQ(image.marks.size(), 3U);
  EXPECT_EQ(image.marks[0].count, 2U) << "with that of the first one that found no room";
  take(102, {mark(4, 1)});
  EXPECT_EQ(next().changed[0], 8U) << "only what is new";
}

TEST_F(DirectImagesTest, ThePublisherIsWokenOnlyForPdosWhoseUpdateIsDue) {
  use(config::Publish::Rule::on_change);
  EXPECT_TRUE(take(1, {mark(1, 1)}));
  now_ += 10ms;
  EXPECT_FALSE(take(2, {mark(1, 1)}));
  EXPECT_TRUE(take(3, {mark(1, 1), mark(2, 1)})) << "the first one of another PDO";
  now_ += 90ms;
  EXPECT_TRUE(take(4, {mark(1, 1)}));
  EXPECT_FALSE(take(5, {mark(2, 1)}));
}

// Whether it fetches them or not, it has all receptions once.
TEST_F(DirectImagesTest, ThePublisherLosesNoReceptionAndCountsNoneTwice) {
  const auto seed = std::random_device()();
  std::mt19937 random(seed);
  use(config::Publish::Rule::on_change);
  std::array<std::uint32_t, 4> sent{};
  std::array<std::uint32_t, 4> fetched{};
  std::array<std::uint32_t, 4> published{};
  const auto add = [](const image::Snapshot& from, auto& to) {
    for (const image::PdoMark& of : from.marks) {
      to.at(of.local_pdo - 1U) += of.count;
    }
  };
  for (int round = 0; round < 5'000; ++round) {
    std::vector<image::PdoMark> marks;
    for (std::uint16_t pdo = 1; pdo <= 4; ++pdo) {
      if (const auto count = random() % 3; count != 0) {
        marks.push_back(mark(pdo, static_cast<std::uint32_t>(count)));
        sent.at(pdo - 1U) += static_cast<std::uint32_t>(count);
      }
    }
    take(static_cast<std::uint8_t>(random() % 3), marks);
    if (random() % 4 == 0) {
      if (const image::Snapshot* snapshot = handover_.fetch()) {
        add(*snapshot, fetched);
      }
    }
    for (auto count = random() % 3; count > 0; --count) {
      add(next(), published);
    }
  }
  const auto drain = [&] {
    for (image::Snapshot image = next(); image.sequence != 0; image = next()) {
      add(image, published);
    }
  };
  drain();
  take(7, {mark(1, 1)});
  ++sent[0];
  drain();
  add(*handover_.fetch(), fetched);
  EXPECT_EQ(fetched, sent) << "seed " << seed;
  EXPECT_EQ(published, sent) << "seed " << seed;
}

TEST(ImageRecord, RefusesEveryOtherLength) {
  image::Snapshot snapshot;
  snapshot.bytes.resize(5);
  snapshot.changed.resize(1);
  snapshot.valid = snapshot.known = snapshot.changed;
  snapshot.marks.resize(2);
  std::vector<std::byte> record(1'000);
  const std::size_t length = write_record(snapshot, {}, record);
  ClockMap clock;
  image::Snapshot out;
  for (std::size_t i = 0; i <= record.size(); ++i) {
    EXPECT_EQ(read_record(std::span(record).first(i), out, clock), i == length);
  }
}

}  // namespace
}  // namespace linegate::gateway
