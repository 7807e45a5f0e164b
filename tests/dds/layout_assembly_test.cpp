// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/layout_assembly.h"

#include <cmath>

#include <gtest/gtest.h>

#include "bridges/dds/image_samples.h"

#include "tests/dds/known_values.h"

namespace linegate::dds {
namespace {

v1::ImageLayout part(std::uint16_t number, std::uint64_t incarnation = 1) {
  v1::ImageLayout sample;
  to_wire(known::layout(), number, sample);
  sample.gateway("g");
  sample.line("l");
  sample.incarnation(incarnation);
  return sample;
}

TEST(LayoutAssembly, IsCompleteWithItsLastPartInWhateverOrder) {
  LayoutAssembly assembly;
  image::Layout layout;
  EXPECT_EQ(layout_parts(known::layout()), 2);
  EXPECT_FALSE(assembly.take(part(1), layout));
  ASSERT_TRUE(assembly.take(part(0), layout));
  const image::Layout sent = known::layout();
  EXPECT_EQ(layout.id, sent.id);
  EXPECT_EQ(layout.byte_size, sent.byte_size);
  EXPECT_EQ(layout.direction, sent.direction);
  ASSERT_EQ(layout.entries.size(), sent.entries.size());
  for (std::size_t i = 0; i < sent.entries.size(); ++i) {
    EXPECT_EQ(layout.entries[i].bit_offset, sent.entries[i].bit_offset);
    EXPECT_EQ(layout.entries[i].bit_length, sent.entries[i].bit_length);
    EXPECT_EQ(layout.entries[i].type, sent.entries[i].type);
    EXPECT_EQ(layout.entries[i].node, sent.entries[i].node);
    EXPECT_EQ(layout.entries[i].index, sent.entries[i].index);
    EXPECT_EQ(layout.entries[i].sub, sent.entries[i].sub);
    EXPECT_EQ(layout.entries[i].remote_pdo, sent.entries[i].remote_pdo);
    EXPECT_EQ(layout.entries[i].local_pdo, sent.entries[i].local_pdo);
    EXPECT_EQ(layout.entries[i].variable_index, sent.entries[i].variable_index);
    EXPECT_EQ(layout.entries[i].variable_sub, sent.entries[i].variable_sub);
    EXPECT_EQ(layout.entries[i].profile, sent.entries[i].profile);
    EXPECT_EQ(layout.entries[i].product_code, sent.entries[i].product_code);
    EXPECT_EQ(layout.entries[i].name, sent.entries[i].name);
    EXPECT_EQ(layout.entries[i].scaling, sent.entries[i].scaling);
    EXPECT_EQ(layout.entries[i].low, sent.entries[i].low);
    EXPECT_EQ(layout.entries[i].high, sent.entries[i].high);
    EXPECT_EQ(layout.entries[i].initial, sent.entries[i].initial);
    EXPECT_EQ(layout.entries[i].access, sent.entries[i].access);
    EXPECT_EQ(layout.entries[i].transmission_type, sent.entries[i].transmission_type);
    EXPECT_EQ(layout.entries[i].inhibit, sent.entries[i].inhibit);
    EXPECT_EQ(layout.entries[i].event_timer, sent.entries[i].event_timer);
    EXPECT_EQ(layout.entries[i].group, sent.entries[i].group);
  }
}

TEST(LayoutAssembly, IsGivenOnceAnIncarnation) {
  LayoutAssembly assembly;
  image::Layout layout;
  assembly.take(part(0), layout);
  ASSERT_TRUE(assembly.take(part(1), layout));
  EXPECT_FALSE(assembly.take(part(1), layout));
  EXPECT_FALSE(assembly.take(part(0, 2), layout));
  EXPECT_TRUE(assembly.take(part(1, 2), layout));
}

// A reload may change the names of entries alone.
TEST(LayoutAssembly, IsGivenAgainWithAnotherName) {
  LayoutAssembly assembly;
  image::Layout layout;
  assembly.take(part(0), layout);
  ASSERT_TRUE(assembly.take(part(1), layout));
  v1::ImageLayout renamed = part(1);
  renamed.entries()[0].name("node64.Pressure");
  EXPECT_FALSE(assembly.take(part(0), layout));
  ASSERT_TRUE(assembly.take(renamed, layout));
  EXPECT_EQ(layout.entries.at(256).name, "node64.Pressure");
  EXPECT_EQ(layout.entries.at(0).name, known::layout().entries.at(0).name);
  EXPECT_FALSE(assembly.take(renamed, layout));
}

TEST(LayoutAssembly, PartsOfAnotherLayoutDoNotMix) {
  LayoutAssembly assembly;
  image::Layout layout;
  v1::ImageLayout other = part(1);
  other.layout_id(5);
  EXPECT_FALSE(assembly.take(part(0), layout));
  EXPECT_FALSE(assembly.take(other, layout));
  EXPECT_TRUE(assembly.take(part(1), layout));
}

TEST(LayoutAssembly, PartsLeftOfALongerLayoutDoNotMatter) {
  LayoutAssembly assembly;
  image::Layout layout;
  v1::ImageLayout left = part(1);
  left.part(2);
  left.parts(3);
  left.layout_id(5);
  EXPECT_FALSE(assembly.take(part(0), layout));
  EXPECT_FALSE(assembly.take(left, layout));
  EXPECT_TRUE(assembly.take(part(1), layout));
  EXPECT_FALSE(assembly.take(left, layout));
}

TEST(LayoutAssembly, WhatContradictsTheContractOrItselfIsIgnored) {
  // Whether a layout is assembled from its two parts if one of them is invalid.
  const auto completes = [](std::uint16_t number, auto spoil) {
    LayoutAssembly assembly;
    image::Layout layout;
    v1::ImageLayout spoilt = part(number);
    spoil(spoilt);
    const v1::ImageLayout other = part(number == 0 ? 1 : 0);
    const bool early = assembly.take(other, layout);
    return assembly.take(spoilt, layout) || early;
  };
  const std::uint32_t last_bit = known::layout().byte_size * 8 - 1;
  EXPECT_TRUE(completes(0, [](auto&) {}));
  EXPECT_TRUE(completes(1, [](auto&) {}));
  EXPECT_FALSE(completes(0, [](auto& s) { s.direction(2); }));
  EXPECT_FALSE(completes(0, [](auto& s) { s.parts(0); }));
  EXPECT_FALSE(completes(0, [](auto& s) { s.parts(257); }));
  EXPECT_FALSE(completes(0, [](auto& s) { s.parts(1); }));
  EXPECT_FALSE(completes(0, [](auto& s) { s.part(2); }));
  EXPECT_FALSE(completes(0, [](auto& s) { s.byte_size(image::kMaxAreaBytes + 1); }));
  EXPECT_FALSE(completes(0, [](auto& s) { s.byte_size(s.byte_size() + 1); }));
  EXPECT_FALSE(completes(0, [](auto& s) { s.first_entry(1); }));
  EXPECT_FALSE(completes(1, [](auto& s) { s.first_entry(255); }));
  EXPECT_FALSE(completes(1, [](auto& s) { s.entries().pop_back(); }));
  EXPECT_FALSE(completes(0, [](auto& s) { s.entries().resize(257); }));
  EXPECT_FALSE(completes(0, [&](auto& s) {
    s.entries()[0].bit_offset(last_bit);
    s.entries()[0].bit_length(2);
  }));
  EXPECT_FALSE(completes(0, [](auto& s) { s.entries()[0].bit_offset(0xFFFF'FFFF); }));
  // A scale that cannot be meant must not be replaced by another one.
  EXPECT_FALSE(completes(0, [](auto& s) { s.entries()[0].scale(0); }));
  EXPECT_FALSE(completes(0, [](auto& s) { s.entries()[0].scale(std::nan("")); }));
  EXPECT_FALSE(completes(0, [](auto& s) { s.entries()[0].offset(HUGE_VAL); }));
  EXPECT_FALSE(completes(0, [](auto& s) { s.entries()[0].low(std::nan("")); }));
  EXPECT_FALSE(completes(0, [](auto& s) { s.entries()[0].high(-HUGE_VAL); }));
  EXPECT_FALSE(completes(0, [](auto& s) { s.entries()[0].initial(HUGE_VAL); }));
  EXPECT_FALSE(completes(0, [](auto& s) { s.entries()[0].access(6); }));
  EXPECT_FALSE(completes(0, [](auto& s) { s.entries()[0].inhibit_ns(-1); }));
  EXPECT_FALSE(completes(0, [](auto& s) { s.entries()[0].event_timer_ns(-1); }));
}

TEST(LayoutAssembly, NoMoreThanAnyPlantHasIsKept) {
  LayoutAssembly assembly;
  image::Layout layout;
  const auto completes = [&](int line) {
    v1::ImageLayout sample;
    to_wire(image::Layout{}, 0, sample);
    sample.line(std::to_string(line));
    sample.incarnation(1);
    return assembly.take(sample, layout);
  };
  for (int line = 0; line < 4'096; ++line)
    ASSERT_TRUE(completes(line));
  EXPECT_FALSE(completes(4'096));
}

}  // namespace
}  // namespace linegate::dds
