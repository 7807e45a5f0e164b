// SPDX-License-Identifier: Apache-2.0
// The key hash of a sample depends on the sample alone.
#include "bridges/dds/keyed_type.h"

#include <cstdint>
#include <string>

#include <gtest/gtest.h>
#include <linegatePubSubTypes.h>

namespace linegate::dds {
namespace {

using Handle = eprosima::fastrtps::rtps::InstanceHandle_t;
using OutputType = KeyedType<v1::OutputStatePubSubType>;

v1::OutputState output_state(const std::string& line, std::uint16_t group) {
  v1::OutputState out;
  out.gateway("hall");
  out.line(line);
  out.group(group);
  return out;
}

template <class Type, class Sample>
Handle key_hash(Type& type, Sample sample) {
  Handle handle;
  EXPECT_TRUE(type.getKey(&sample, &handle));
  return handle;
}

// The octet before `group` of line "hall" lies within the name of the other line.
TEST(KeyedType, TheHashDoesNotDependOnEarlierKeys) {
  OutputType first;
  const Handle alone = key_hash(first, output_state("hall", 1));
  OutputType second;
  (void)key_hash(second, output_state("conveyor", 7));
  EXPECT_EQ(key_hash(second, output_state("hall", 1)), alone);
  EXPECT_NE(key_hash(second, output_state("hall", 2)), alone);
}

// RTPS 2.3, 9.6.3.8: MD5 of 00000005h "hall\0" 00h 00h 00h 00000005h "hall\0" 00h 0001h.
TEST(KeyedType, TheHashIsThatOfRtps) {
  OutputType type;
  (void)key_hash(type, output_state("conveyor-of-the-other-hall", 7));
  const std::string key("\0\0\0\5hall\0\0\0\0\0\0\0\5hall\0\0\0\1", 24);
  MD5 md5;
  md5.init();
  md5.update(key.data(), static_cast<MD5::size_type>(key.size()));
  md5.finalize();
  const Handle hash = key_hash(type, output_state("hall", 1));
  for (std::uint8_t i = 0; i < 16; ++i) {
    EXPECT_EQ(hash.value[i], md5.digest[i]) << int{i};
  }
}

TEST(KeyedType, ATypeWithoutKeyHasNone) {
  KeyedType<v1::PropertyPubSubType> type;
  v1::Property sample;
  Handle handle;
  EXPECT_FALSE(type.getKey(&sample, &handle));
  EXPECT_FALSE(handle.isDefined());
}

}  // namespace
}  // namespace linegate::dds
