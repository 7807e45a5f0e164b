#include "bridges/dds/layout_assembly.h"

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

TEST(LayoutAssembly, PartsOfAnotherLayoutDoNotMix) {
  LayoutAssembly assembly;
  image::Layout layout;
  v1::ImageLayout other = part(1);
  other.layout_id(5);
  EXPECT_FALSE(assembly.take(part(0), layout));
  EXPECT_FALSE(assembly.take(other, layout));
  EXPECT_FALSE(assembly.take(part(1), layout));
  EXPECT_TRUE(assembly.take(part(0), layout));
}

TEST(LayoutAssembly, ImplausiblePartsAreIgnored) {
  LayoutAssembly assembly;
  image::Layout layout;
  v1::ImageLayout sample = part(0);
  sample.direction(2);
  EXPECT_FALSE(assembly.take(sample, layout));
  sample = part(0);
  sample.parts(0);
  EXPECT_FALSE(assembly.take(sample, layout));
}

}  // namespace
}  // namespace linegate::dds
