// SPDX-License-Identifier: Apache-2.0
// Samples of outputs by name as DDS delivers them: their key hash, and what is discarded.
#include "bridges/dds/named_read_type.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include <fastdds/rtps/common/SerializedPayload.h>
#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>

#include "bridges/dds/keyed_type.h"

namespace linegate::dds {
namespace {

using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

constexpr std::size_t kMostOfSample = 200;

// An OutputWrite begins with the same key, so its samples serve as input.
v1::OutputWrite write_of(const std::string& line, std::uint16_t group) {
  v1::OutputWrite sample;
  sample.gateway("gate");
  sample.line(line);
  sample.group(group);
  return sample;
}

class NamedReadTypeTest : public testing::Test {
 protected:
  bool read(v1::OutputWrite sample, std::uint32_t cut = 0) {
    v1::OutputWritePubSubType generated;
    SerializedPayload_t payload(generated.getSerializedSizeProvider(&sample)());
    EXPECT_TRUE(generated.serialize(&sample, &payload));
    payload.length -= std::min(cut, payload.length);
    return type_.deserialize(&payload, &received_);
  }

  std::shared_ptr<UnreadableCount> unreadable_ = std::make_shared<UnreadableCount>();
  NamedReadType type_{"plant::type", kMostOfSample, unreadable_};
  NamedReceived received_;
};

TEST_F(NamedReadTypeTest, HasTheKeyHashThatEveryOtherTypeWithThisKeyHas) {
  for (const char* line : {"p", "press", "a-long-name-of-a-line"}) {
    v1::OutputWrite sample = write_of(line, 0x1234);
    ASSERT_TRUE(read(sample));
    InstanceHandle_t handle;
    InstanceHandle_t expected;
    ASSERT_TRUE(type_.getKey(&received_, &handle));
    KeyedType<v1::OutputWritePubSubType> other;
    ASSERT_TRUE(other.getKey(&sample, &expected));
    EXPECT_EQ(handle, expected) << line;
  }
  EXPECT_EQ(unreadable_->take(), 0U);
}

TEST_F(NamedReadTypeTest, DiscardsAndCountsASampleWithoutKeyOrOfNoPossibleSize) {
  const v1::OutputWrite good = write_of("press", 1);
  ASSERT_TRUE(read(good));
  EXPECT_FALSE(read(good, 1'000));
  InstanceHandle_t handle;
  EXPECT_FALSE(type_.getKey(&received_, &handle)) << "no key is left of the sample before";
  v1::OutputWrite longer = good;
  longer.values().resize(100);
  EXPECT_FALSE(read(longer));
  EXPECT_EQ(unreadable_->take(), 2U);
  // In an object of the library it is not counted.
  void* const object = type_.createData();
  SerializedPayload_t empty(4);
  EXPECT_FALSE(type_.deserialize(&empty, object));
  type_.deleteData(object);
  EXPECT_EQ(unreadable_->take(), 0U);
}

}  // namespace
}  // namespace linegate::dds
