// SPDX-License-Identifier: Apache-2.0
#include "stack/image/process_image.h"

#include <gtest/gtest.h>

#include "tests/stack/image/layouts.h"

namespace linegate::image {
namespace {

using test::kIn;
using test::kOut;
using test::make_layout;
using test::no_outputs;

std::vector<unsigned> bytes_of(const ProcessImage& image, Direction direction) {
  std::vector<unsigned> out;
  for (const std::byte b : image.bytes(direction)) {
    out.push_back(std::to_integer<unsigned>(b));
  }
  return out;
}

TEST(LayoutId, IsTheSameWithoutNamesAndNeverZero) {
  Layout a = make_layout(kIn, 4, {{1, 0, 16}, {1, 16, 16}});
  Layout b = a;
  b.entries[0].name = "other";
  EXPECT_EQ(layout_id(a), layout_id(b));
  EXPECT_NE(layout_id(a), 0U);
  b.entries[1].sub = 3;
  EXPECT_NE(layout_id(a), layout_id(b));
  b = a;
  b.direction = kOut;
  EXPECT_NE(layout_id(a), layout_id(b));
}

// A reader that knows another scale must not match.
TEST(LayoutId, DependsOnWhatAValueMeans) {
  const Layout a = make_layout(kIn, 4, {{1, 0, 16}, {1, 16, 16}});
  const auto differs = [&a](auto change) {
    Layout b = a;
    change(b.entries[1]);
    return layout_id(a) != layout_id(b);
  };
  EXPECT_FALSE(differs([](Entry&) {}));
  EXPECT_TRUE(differs([](Entry& e) { e.scaling.unit = "bar"; }));
  EXPECT_TRUE(differs([](Entry& e) { e.scaling.scale = 0.1; }));
  EXPECT_TRUE(differs([](Entry& e) { e.scaling.offset = -40; }));
  EXPECT_TRUE(differs([](Entry& e) { e.low = 0; }));
  EXPECT_TRUE(differs([](Entry& e) { e.high = 0; }));
  EXPECT_TRUE(differs([](Entry& e) { e.access = od::Access::ro; }));
  EXPECT_TRUE(differs([](Entry& e) { e.transmission_type = 1; }));
  EXPECT_TRUE(differs([](Entry& e) { e.inhibit = Duration(1); }));
  EXPECT_TRUE(differs([](Entry& e) { e.event_timer = Duration(1); }));
  // How it is written does not change what it means.
  EXPECT_FALSE(differs([](Entry& e) { e.initial = 0; }));
  EXPECT_FALSE(differs([](Entry& e) { e.group = 0; }));
}

TEST(ProcessImage, LongEntriesAreReadAndWrittenInParts) {
  ProcessImage image(make_layout(kIn, 0, {}),
                     make_layout(kOut, 32, {{1, 8, 160}, {2, 168, 64}, {2, 232, 8}}));
  EXPECT_EQ(value_parts(image.layout(kOut).entries[0]), 3U);
  EXPECT_EQ(value_parts(image.layout(kOut).entries[1]), 1U);
  EXPECT_TRUE(image.write_part(kOut, 0, 2, 0xFFFF'FFFF'1234'5678));
  EXPECT_TRUE(image.is_known(kOut, 0));
  EXPECT_TRUE(image.write_part(kOut, 0, 0, 0x0807'0605'0403'0201));
  EXPECT_TRUE(image.write_part(kOut, 0, 1, 0x1817'1615'1413'1211));
  EXPECT_FALSE(image.write_part(kOut, 0, 1, 0x1817'1615'1413'1211));
  EXPECT_EQ(image.read_part(kOut, 0, 0), 0x0807'0605'0403'0201U);
  EXPECT_EQ(image.read_part(kOut, 0, 1), 0x1817'1615'1413'1211U);
  EXPECT_EQ(image.read_part(kOut, 0, 2), 0x1234'5678U) << "the bytes behind it are of others";
  EXPECT_EQ(image.read_entry(kOut, 0), 0x0807'0605'0403'0201U);
  EXPECT_EQ(image.read_entry(kOut, 1), 0U);
  EXPECT_EQ(bytes_of(image, kOut)[0], 0U);
  EXPECT_EQ(bytes_of(image, kOut)[20], 0x12U);
}

// FNV-1a, 64 bit: the value for the five bytes of an empty input layout.
TEST(LayoutId, IsFnv1a) {
  std::uint64_t hash = 0xCBF29CE484222325U;
  for (int i = 0; i < 5; ++i) {
    hash = (hash ^ 0U) * 0x100000001B3U;
  }
  EXPECT_EQ(layout_id(Layout{}), hash);
}

TEST(ProcessImage, BeginsAsZerosThatAreNotValid) {
  const ProcessImage image(make_layout(kIn, 3, {{1, 0, 8}}), no_outputs());
  EXPECT_EQ(bytes_of(image, kIn), (std::vector<unsigned>{0, 0, 0}));
  EXPECT_FALSE(image.is_valid(kIn, 0));
  EXPECT_FALSE(image.changed(kIn));
  EXPECT_FALSE(image.touched(kIn));
}

TEST(ProcessImage, WritesEntriesLittleEndianAndReadsThemBack) {
  ProcessImage image(
      Layout{},
      make_layout(kOut, 16, {{1, 0, 16}, {1, 16, 3}, {1, 19, 1}, {2, 64, 64}, {2, 24, 24}}));
  EXPECT_TRUE(image.write_entry(kOut, 0, 0x1234));
  EXPECT_TRUE(image.write_entry(kOut, 1, 0xFD));  // only three bits are stored: 101
  EXPECT_TRUE(image.write_entry(kOut, 2, 1));
  EXPECT_TRUE(image.write_entry(kOut, 3, 0x8877665544332211U));
  EXPECT_TRUE(image.write_entry(kOut, 4, 0xCCBBAA));
  EXPECT_EQ(bytes_of(image, kOut),
            (std::vector<unsigned>{0x34, 0x12, 0x0D, 0xAA, 0xBB, 0xCC, 0, 0, 0x11, 0x22, 0x33, 0x44,
                                   0x55, 0x66, 0x77, 0x88}));
  EXPECT_EQ(image.read_entry(kOut, 0), 0x1234U);
  EXPECT_EQ(image.read_entry(kOut, 1), 5U);
  EXPECT_EQ(image.read_entry(kOut, 2), 1U);
  EXPECT_EQ(image.read_entry(kOut, 3), 0x8877665544332211U);
  EXPECT_EQ(image.read_entry(kOut, 4), 0xCCBBAAU);
}

TEST(ProcessImage, WritingTheSameValueChangesNothingButMakesItValid) {
  ProcessImage image(Layout{}, make_layout(kOut, 2, {{1, 0, 16}}));
  EXPECT_FALSE(image.write_entry(kOut, 0, 0));
  EXPECT_TRUE(image.is_valid(kOut, 0));
  EXPECT_TRUE(image.changed(kOut)) << "its validity changed";
}

TEST(ProcessImage, EntriesThatAreNotAtAByteAreWrittenWhole) {
  ProcessImage image(Layout{}, make_layout(kOut, 12, {{1, 3, 64}, {1, 67, 5}}));
  image.write_entry(kOut, 1, 0x1F);
  image.write_entry(kOut, 0, 0xF123456789ABCDEFU);
  EXPECT_EQ(image.read_entry(kOut, 0), 0xF123456789ABCDEFU);
  EXPECT_EQ(image.read_entry(kOut, 1), 0x1FU);
  image.write_entry(kOut, 0, 0);
  EXPECT_EQ(image.read_entry(kOut, 1), 0x1FU);
}

TEST(ProcessImage, BytesMakeOnlyWhollyCoveredEntriesValid) {
  ProcessImage image(Layout{}, make_layout(kOut, 8, {{1, 0, 16}, {1, 16, 16}, {1, 32, 32}}));
  const std::array value = {std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}};
  EXPECT_TRUE(image.write_bytes(kOut, 1, value));
  EXPECT_EQ(bytes_of(image, kOut), (std::vector<unsigned>{0, 1, 2, 3, 4, 0, 0, 0}));
  EXPECT_FALSE(image.is_valid(kOut, 0));
  EXPECT_TRUE(image.is_valid(kOut, 1));
  EXPECT_FALSE(image.is_valid(kOut, 2));
  EXPECT_FALSE(image.write_bytes(kOut, 1, value));
}

TEST(ProcessImage, APdoIsKnownWhenAllItsEntriesAre) {
  ProcessImage image(Layout{}, make_layout(kOut, 4, {{1, 0, 8}, {1, 8, 8}, {2, 16, 8}}));
  EXPECT_FALSE(image.pdo_known(kOut, 1));
  image.write_entry(kOut, 0, 7);
  EXPECT_FALSE(image.pdo_known(kOut, 1));
  image.write_entry(kOut, 1, 0);
  EXPECT_TRUE(image.pdo_known(kOut, 1));
  EXPECT_FALSE(image.pdo_known(kOut, 2));
  EXPECT_TRUE(image.pdo_known(kOut, 77)) << "a PDO without entries waits for nothing";
  image.forget_entry(kOut, 1);
  EXPECT_FALSE(image.pdo_known(kOut, 1));
  EXPECT_FALSE(image.is_valid(kOut, 1));
}

TEST(ProcessImage, ATransmittedOutputIsValidUntilAnotherValueIsWritten) {
  ProcessImage image(Layout{}, make_layout(kOut, 4, {{1, 0, 8}, {1, 8, 8}, {2, 16, 8}}));
  image.follow_transmission();
  image.write_entry(kOut, 0, 7);
  image.write_entry(kOut, 1, 8);
  EXPECT_TRUE(image.is_known(kOut, 0));
  EXPECT_FALSE(image.is_valid(kOut, 0));
  image.set_pdo_valid(kOut, 1, true);
  EXPECT_TRUE(image.is_valid(kOut, 0) && image.is_valid(kOut, 1));
  const std::array same = {std::byte{7}, std::byte{9}};
  image.write_bytes(kOut, 0, same);
  EXPECT_TRUE(image.is_valid(kOut, 0)) << "the same value again";
  EXPECT_FALSE(image.is_valid(kOut, 1));
  EXPECT_EQ(image.area(kOut).pdo(0).attention, PdoState::kNotValid);
  image.write_entry(kOut, 0, 6);
  EXPECT_FALSE(image.is_valid(kOut, 0));
  Snapshot seen;
  image.snapshot(kOut, seen, Instant{}, false, 0);
  EXPECT_TRUE(seen.is_known(0) && seen.is_known(1) && !seen.is_known(2));
  EXPECT_EQ(seen.valid[0], 0U);
}

TEST(ProcessImage, AnOutputThatIsWrittenInTheDictionaryIsNotValidUntilItIsTransmitted) {
  ProcessImage image(Layout{}, make_layout(kOut, 4, {{1, 0, 8}, {1, 8, 8}}));
  image.follow_transmission();
  image.write_entry(kOut, 0, 7);
  image.write_entry(kOut, 1, 8);
  image.set_pdo_valid(kOut, 1, true);
  image.mark_written(kOut, 8, 8);
  EXPECT_TRUE(image.is_valid(kOut, 0));
  EXPECT_FALSE(image.is_valid(kOut, 1));
}

// Output 1 is of no PDO.
TEST(ProcessImage, AListenerDecidesWhetherAnOutputOfNoPdoIsValid) {
  struct Listener : OutputListener {
    explicit Listener(ProcessImage& i) : image(i) { image.set_listener(*this); }
    void output_written(std::uint32_t entry) override {
      EXPECT_EQ(entry, 1U);
      last = image.read_entry(kOut, entry);
    }
    std::uint64_t last_of(bool /*changed*/) { return std::exchange(last, 0); }

    ProcessImage& image;
    std::uint64_t last = 0;
  };
  ProcessImage image(Layout{}, make_layout(kOut, 4, {{1, 0, 8}, {0, 8, 8}}));
  Listener listener(image);
  EXPECT_EQ(listener.last_of(image.write_entry(kOut, 1, 7)), 7U);
  EXPECT_FALSE(image.is_valid(kOut, 1));
  EXPECT_TRUE(image.is_known(kOut, 1));
  image.set_entry_valid(kOut, 1, true);
  EXPECT_EQ(listener.last_of(image.write_entry(kOut, 1, 7)), 7U) << "the same value again";
  EXPECT_TRUE(image.is_valid(kOut, 1));
  const std::array other = {std::byte{7}, std::byte{9}};
  EXPECT_EQ(listener.last_of(image.write_bytes(kOut, 0, other)), 9U);
  image.area(kOut).data()[1] = std::byte{5};
  image.mark_written(kOut, 8, 8);
  EXPECT_EQ(listener.last, 5U);
  EXPECT_TRUE(image.is_valid(kOut, 0)) << "nothing follows the transmission of PDO 1";
}

TEST(ProcessImage, ADeadNodeTakesAllItsEntriesWithIt) {
  ProcessImage image(make_layout(kIn, 4, {{1, 0, 8, 5}, {2, 8, 8, 6}, {3, 16, 8, 5}}),
                     no_outputs());
  for (std::uint16_t pdo = 1; pdo <= 3; ++pdo) {
    image.set_pdo_valid(kIn, pdo, true);
    EXPECT_EQ(image.area(kIn).pdo(pdo - 1U).attention, 0U);
  }
  image.set_node_valid(5, false);
  EXPECT_FALSE(image.is_valid(kIn, 0));
  EXPECT_TRUE(image.is_valid(kIn, 1));
  EXPECT_FALSE(image.is_valid(kIn, 2));
  EXPECT_EQ(image.area(kIn).pdo(0).attention, PdoState::kNotValid);
  EXPECT_EQ(image.area(kIn).pdo(1).attention, 0U);
}

TEST(ProcessImage, KnowsWhereItsPdosLie) {
  const ProcessImage image(make_layout(kIn, 4, {{1, 0, 8, 5}, {2, 8, 8, 6}, {2, 16, 8, 6}}),
                           no_outputs());
  EXPECT_EQ(image.entries_of(kIn, 2).first, 1U);
  EXPECT_EQ(image.entries_of(kIn, 2).count, 2U);
  EXPECT_EQ(image.entries_of(kIn, 9).count, 0U);
  EXPECT_EQ(image.node_of(kIn, 2), 6);
  EXPECT_EQ(image.node_of(kIn, 0), 0);
}

TEST(ProcessImage, LocatesItsOwnBytesOnly) {
  ProcessImage image(make_layout(kIn, 4, {{1, 0, 8}}), make_layout(kOut, 2, {{1, 0, 8}}));
  const auto in = image.locate(image.area(kIn).data() + 3);
  ASSERT_TRUE(in);
  EXPECT_EQ(in->direction, kIn);
  EXPECT_EQ(in->bit_offset, 24U);
  EXPECT_EQ(image.locate(image.area(kOut).data() + 1)->direction, kOut);
  EXPECT_FALSE(image.locate(image.area(kOut).data() + 2));
  const std::byte elsewhere{};
  EXPECT_FALSE(image.locate(&elsewhere));
}

}  // namespace
}  // namespace linegate::image
