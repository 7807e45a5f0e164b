// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "stack/base/abort_code.h"
#include "stack/manager/plan.h"

namespace linegate::manager {
namespace {

std::vector<std::byte> bytes(std::initializer_list<unsigned> values) {
  std::vector<std::byte> out;
  for (const unsigned value : values) {
    out.push_back(static_cast<std::byte>(value));
  }
  return out;
}

// 1017:0 = 1000 and 1400:1 = 80000201h.
std::vector<std::byte> example() {
  return bytes({0x02, 0,    0,    0,    0x17, 0x10, 0x00, 0x02, 0,    0,    0,    0xE8,
                0x03, 0x00, 0x14, 0x01, 0x04, 0,    0,    0,    0x01, 0x02, 0x00, 0x80});
}

TEST(ConciseDcf, IsWrittenByteByByte) {  // 1F22h
  const std::vector<ObjectWrite> writes = {{{0x1017, 0}, bytes({0xE8, 0x03})},
                                           {{0x1400, 1}, bytes({0x01, 0x02, 0x00, 0x80})}};
  EXPECT_EQ(write_concise_dcf(writes), example());
  EXPECT_TRUE(write_concise_dcf({}).empty());
}

TEST(ConciseDcf, IsReadInItsOrder) {
  const auto writes = read_concise_dcf(example());
  ASSERT_TRUE(writes.ok());
  ASSERT_EQ(writes->size(), 2U);
  EXPECT_EQ(writes->at(0).address, (od::Address{0x1017, 0}));
  EXPECT_EQ(writes->at(0).data, bytes({0xE8, 0x03}));
  EXPECT_EQ(writes->at(1).address, (od::Address{0x1400, 1}));
  EXPECT_EQ(writes->at(1).data, bytes({0x01, 0x02, 0x00, 0x80}));
  EXPECT_TRUE(read_concise_dcf({})->empty()) << "an empty domain: nothing to do";
  EXPECT_TRUE(read_concise_dcf(bytes({0, 0, 0, 0}))->empty());
}

TEST(ConciseDcf, IsRefusedWhereCountSizesAndBytesDisagree) {
  const auto whole = example();
  for (std::size_t size = 1; size < whole.size(); ++size) {
    const auto cut = read_concise_dcf(std::span(whole).first(size));
    ASSERT_FALSE(cut.ok()) << size;
    EXPECT_EQ(cut.error(), to_error(AbortCode::length_mismatch)) << size;
  }
  auto more = whole;
  more.push_back(std::byte{0});
  EXPECT_FALSE(read_concise_dcf(more).ok());
  auto count = whole;
  count[3] = std::byte{0xFF};
  EXPECT_FALSE(read_concise_dcf(count).ok());
  auto size = whole;
  size[10] = std::byte{0xFF};
  EXPECT_FALSE(read_concise_dcf(size).ok());
}

}  // namespace
}  // namespace linegate::manager
