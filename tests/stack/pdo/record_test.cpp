// SPDX-License-Identifier: Apache-2.0
// The permitted SDO writes to PDO records: CiA 301, 7.5.2.35 to 7.5.2.38.
#include "stack/pdo/record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/stack/pdo/device_fixture.h"

namespace linegate::pdo {
namespace {

using namespace test;
using testing::ElementsAre;
using testing::IsEmpty;

struct RecordTest : testing::Test {
  RecordTest() : device(description()) { device.operational(); }
  static od::DeviceDescription description() {
    od::DeviceDescription out = plain_device();
    add_rpdo(out, {.cob_id = 0x201, .mapping = {0x20030010}});
    add_tpdo(out, {.cob_id = 0x181, .mapping = {0x20100010}});
    add_tpdo(out, {.number = 2, .cob_id = 0x80000281});
    return out;
  }

  Device device;
};

TEST(RecordIndex, KnowsTheFourRanges) {
  EXPECT_FALSE(record_index(0x13FF));
  EXPECT_EQ(record_index(0x1400)->kind, PdoKind::rpdo);
  EXPECT_EQ(record_index(0x15FF)->number, 512);
  EXPECT_FALSE(record_index(0x15FF)->mapping);
  EXPECT_TRUE(record_index(0x1600)->mapping);
  EXPECT_EQ(record_index(0x1801)->kind, PdoKind::tpdo);
  EXPECT_EQ(record_index(0x1801)->number, 2);
  EXPECT_TRUE(record_index(0x1BFF)->mapping);
  EXPECT_FALSE(record_index(0x1C00));
}

TEST_F(RecordTest, AFullRemappingTakesEffect) {
  EXPECT_EQ(device.write(0x1400, 1, kInvalid | 0x201), AbortCode::none);
  EXPECT_EQ(device.write(0x1600, 0, 0), AbortCode::none);
  EXPECT_EQ(device.write(0x1600, 1, 0x20020008), AbortCode::none);
  EXPECT_EQ(device.write(0x1600, 2, 0x20050020), AbortCode::none);
  EXPECT_EQ(device.write(0x1600, 0, 2), AbortCode::none);
  EXPECT_EQ(device.write(0x1400, 1, 0x301), AbortCode::none);
  device.receive(frame(0x201, {1, 2}, at(1)));
  EXPECT_EQ(device.read(0x2003), 0U) << "the old identifier is free";
  device.receive(frame(0x301, {0x11, 0x22, 0x33, 0x44, 0x55}, at(2)));
  EXPECT_EQ(device.read(0x2002), 0x11U);
  EXPECT_EQ(device.read(0x2005), 0x55443322U);
}

TEST_F(RecordTest, ATpdoThatBecomesValidIsSent) {
  (void)device.sent(at(0));
  EXPECT_EQ(device.write(0x1A01, 1, 0x20020008), AbortCode::none);
  EXPECT_EQ(device.write(0x1A01, 0, 1), AbortCode::none);
  EXPECT_THAT(device.sent_ids(at(1)), IsEmpty());
  EXPECT_EQ(device.write(0x1801, 1, 0x281), AbortCode::none);
  EXPECT_THAT(device.sent_ids(at(1)), ElementsAre(0x281));
}

TEST_F(RecordTest, AValidPdoKeepsItsIdentifier) {  // 1400h.., 1800h.. communication parameter
  EXPECT_EQ(device.write(0x1400, 1, 0x202), AbortCode::device_state);
  EXPECT_EQ(device.write(0x1400, 1, 0x2000'0201), AbortCode::device_state);
  EXPECT_EQ(device.write(0x1400, 1, 0x201), AbortCode::none) << "the present value";
  EXPECT_EQ(device.write(0x1400, 1, kInvalid | 0x202), AbortCode::none);
  EXPECT_EQ(device.write(0x1400, 1, 0x202), AbortCode::none);
}

// The procedure of CiA 301, 7.5.2.36 and 7.5.2.38, step by step; in each row all steps but the last
// are valid, and the last one has the expected result.
struct Step {
  std::uint16_t index;
  std::uint8_t sub;
  std::uint64_t value;
};
struct Remapping {
  const char* what;
  std::vector<Step> steps;
  AbortCode ends;
};

const Step kDestroyRpdo{0x1400, 1, kInvalid | 0x201};
const Step kEmptyRpdo{0x1600, 0, 0};
const Step kDestroyTpdo{0x1800, 1, kInvalid | 0x181};
const Step kEmptyTpdo{0x1A00, 0, 0};

const Remapping kRemappings[] = {
    {"destroy", {kDestroyRpdo}, AbortCode::none},
    {"destroy twice", {kDestroyRpdo, kDestroyRpdo}, AbortCode::none},
    {"an identifier that may be anything while invalid",
     {{0x1400, 1, kInvalid | 0x601}},
     AbortCode::none},
    {"empty what is valid", {kEmptyRpdo}, AbortCode::unsupported_access},
    {"an entry of what is valid", {{0x1600, 1, 0x20020008}}, AbortCode::unsupported_access},
    {"another identifier of what is valid", {{0x1400, 1, 0x301}}, AbortCode::device_state},
    {"another bit 30 of what is valid", {{0x1800, 1, 0x4000'0181}}, AbortCode::device_state},
    {"inhibit time of what is valid", {{0x1800, 3, 1}}, AbortCode::device_state},
    {"SYNC start value of what is valid", {{0x1800, 6, 1}}, AbortCode::device_state},
    {"an entry before sub-index 0 is 0",
     {kDestroyRpdo, {0x1600, 1, 0x20020008}},
     AbortCode::unsupported_access},
    {"an entry", {kDestroyRpdo, kEmptyRpdo, {0x1600, 1, 0x20020008}}, AbortCode::none},
    {"a dummy entry", {kDestroyRpdo, kEmptyRpdo, {0x1600, 1, 0x00070020}}, AbortCode::none},
    {"an entry that is not there",
     {kDestroyRpdo, kEmptyRpdo, {0x1600, 9, 0x20020008}},
     AbortCode::no_sub_index},
    {"no such object", {kDestroyRpdo, kEmptyRpdo, {0x1600, 1, 0x30000008}}, AbortCode::no_object},
    {"no such sub-index",
     {kDestroyRpdo, kEmptyRpdo, {0x1600, 1, 0x20020108}},
     AbortCode::no_object},
    {"not mappable", {kDestroyRpdo, kEmptyRpdo, {0x1600, 1, 0x20120010}}, AbortCode::not_mappable},
    {"read-only into an RPDO",
     {kDestroyRpdo, kEmptyRpdo, {0x1600, 1, 0x20100010}},
     AbortCode::not_mappable},
    {"write-only into a TPDO",
     {kDestroyTpdo, kEmptyTpdo, {0x1A00, 1, 0x20110010}},
     AbortCode::not_mappable},
    {"a dummy entry of a TPDO",
     {kDestroyTpdo, kEmptyTpdo, {0x1A00, 1, 0x00070020}},
     AbortCode::not_mappable},
    {"another length",
     {kDestroyRpdo, kEmptyRpdo, {0x1600, 1, 0x20050010}},
     AbortCode::length_mismatch},
    {"more bits than a frame has",
     {kDestroyRpdo, kEmptyRpdo, {0x1600, 1, 0x20060040}, {0x1600, 2, 0x20000001}, {0x1600, 0, 2}},
     AbortCode::pdo_length_exceeded},
    {"all bits of a frame",
     {kDestroyRpdo, kEmptyRpdo, {0x1600, 1, 0x20060040}, {0x1600, 0, 1}},
     AbortCode::none},
    {"more entries than the record has",
     {kDestroyRpdo, kEmptyRpdo, {0x1600, 0, 9}},
     AbortCode::pdo_length_exceeded},
    {"more entries than CiA 301 knows",
     {kDestroyRpdo, kEmptyRpdo, {0x1600, 0, 65}},
     AbortCode::pdo_length_exceeded},
    {"an entry that maps nothing",
     {kDestroyRpdo, kEmptyRpdo, {0x1600, 1, 0}, {0x1600, 0, 1}},
     AbortCode::no_object},
    {"create with a restricted identifier",
     {kDestroyRpdo, {0x1400, 1, 0x601}},
     AbortCode::invalid_value},
    {"create with more than 11 bits and not bit 29",
     {kDestroyRpdo, {0x1400, 1, 0x1'0201}},
     AbortCode::invalid_value},
    {"create with 29 bits", {kDestroyRpdo, {0x1400, 1, 0x2001'0201}}, AbortCode::none},
    {"create without entries", {kDestroyRpdo, kEmptyRpdo, {0x1400, 1, 0x301}}, AbortCode::none},
    {"create with a reserved type", {kDestroyRpdo, {0x1400, 2, 252}}, AbortCode::invalid_value},
    {"create once more", {kDestroyRpdo, {0x1400, 1, 0x301}, {0x1400, 1, 0x301}}, AbortCode::none},
};

TEST(RemappingProcedure, EndsWithTheCodeOfItsRow) {
  for (const Remapping& row : kRemappings) {
    Device device(RecordTest::description());
    device.operational();
    for (std::size_t i = 0; i < row.steps.size(); ++i) {
      const Step& step = row.steps[i];
      const bool last = i + 1 == row.steps.size();
      EXPECT_EQ(device.write(step.index, step.sub, step.value), last ? row.ends : AbortCode::none)
          << row.what << ", step " << i + 1;
    }
    EXPECT_EQ(device.emitted().size(), 0U) << row.what;
    EXPECT_THAT(device.listener.unusable, IsEmpty()) << row.what << ": refused, not accepted";
  }
}

// The dictionary refuses values of another size before the PDO engine checks them.
TEST(RemappingProcedure, WantsValuesOfTheRightSize) {
  Device device(RecordTest::description());
  const std::array<std::byte, 8> zeros{};
  EXPECT_EQ(device.dictionary.write({0x1400, 1}, std::span(zeros).first(2)),
            AbortCode::length_too_low);
  EXPECT_EQ(device.dictionary.write({0x1600, 1}, std::span(zeros).first(8)),
            AbortCode::length_too_high);
  EXPECT_EQ(device.dictionary.write({0x1600, 0}, std::span(zeros).first(4)),
            AbortCode::length_too_high);
}

// A mapped object may be removed while the PDO is invalid: the PDO then cannot be made valid.
TEST(RemappingProcedure, ChecksTheMappingOnceMoreWhenThePdoBecomesValid) {
  Device device(RecordTest::description());
  ASSERT_EQ(device.write(0x1400, 1, kInvalid | 0x201), AbortCode::none);
  ASSERT_TRUE(device.dictionary.remove(0x2003).ok());
  EXPECT_EQ(device.write(0x1400, 1, 0x201), AbortCode::no_object);
  EXPECT_THAT(device.listener.unusable, IsEmpty());
}

class Restricted : public RecordTest, public testing::WithParamInterface<std::uint32_t> {};

TEST_P(Restricted, IdentifiersAreRefused) {
  EXPECT_EQ(device.write(0x1801, 1, GetParam()), AbortCode::invalid_value);
  EXPECT_EQ(device.write(0x1801, 1, kInvalid | GetParam()), AbortCode::none);
  EXPECT_EQ(device.write(0x1801, 1, 0x2000'0000U | GetParam()), AbortCode::none)
      << "29-bit identifiers are not restricted";
}

INSTANTIATE_TEST_SUITE_P(Table, Restricted,
                         testing::Values(0x000, 0x001, 0x07F, 0x101, 0x180, 0x581, 0x5FF, 0x601,
                                         0x67F, 0x6E0, 0x6FF, 0x701, 0x77F, 0x780, 0x7FF));

TEST_F(RecordTest, TransmissionTypes) {
  for (unsigned type = 0; type <= 255; ++type) {
    const bool rtr = type == 252 || type == 253;
    const AbortCode reserved = AbortCode::invalid_value;
    const AbortCode tpdo = type > 240 && type < 252 ? reserved : AbortCode::none;
    EXPECT_EQ(device.write(0x1800, 2, type), tpdo) << type;
    EXPECT_EQ(device.write(0x1400, 2, type), rtr ? reserved : tpdo) << type;
  }
}

TEST_F(RecordTest, InhibitTimeAndSyncStartOnlyWhileInvalid) {
  EXPECT_EQ(device.write(0x1800, 3, 10), AbortCode::device_state);
  EXPECT_EQ(device.write(0x1800, 6, 10), AbortCode::device_state);
  EXPECT_EQ(device.write(0x1800, 5, 10), AbortCode::none) << "the event timer at any time";
  EXPECT_EQ(device.write(0x1801, 3, 10), AbortCode::none);
  EXPECT_EQ(device.write(0x1801, 6, 240), AbortCode::none);
  EXPECT_EQ(device.write(0x1801, 6, 241), AbortCode::invalid_value);
}

TEST_F(RecordTest, SubIndex4DoesNotExist) {
  EXPECT_EQ(device.write(0x1800, 4, 0), AbortCode::no_sub_index);
}

TEST_F(RecordTest, MappingOnlyWhileInvalidAndEmpty) {
  EXPECT_EQ(device.write(0x1600, 0, 0), AbortCode::unsupported_access);
  EXPECT_EQ(device.write(0x1600, 1, 0x20020008), AbortCode::unsupported_access);
  EXPECT_EQ(device.write(0x1400, 1, kInvalid), AbortCode::none);
  EXPECT_EQ(device.write(0x1600, 1, 0x20020008), AbortCode::unsupported_access)
      << "sub-index 0 is not 0";
  EXPECT_EQ(device.write(0x1600, 0, 0), AbortCode::none);
  EXPECT_EQ(device.write(0x1600, 1, 0x20020008), AbortCode::none);
}

TEST_F(RecordTest, OnlyWhatCanBeMapped) {
  EXPECT_EQ(device.write(0x1A01, 1, 0x30000010), AbortCode::no_object);
  EXPECT_EQ(device.write(0x1A01, 1, 0x20030110), AbortCode::no_object);
  EXPECT_EQ(device.write(0x1A01, 1, 0x20120010), AbortCode::not_mappable);
  EXPECT_EQ(device.write(0x1A01, 1, 0x20110010), AbortCode::not_mappable) << "write-only";
  EXPECT_EQ(device.write(0x1A01, 1, 0x20030008), AbortCode::length_mismatch);
  EXPECT_EQ(device.write(0x1A01, 1, 0x00050008), AbortCode::not_mappable)
      << "fillers are for RPDOs";
  EXPECT_EQ(device.write(0x1A01, 1, 0), AbortCode::none);
  EXPECT_EQ(device.write(0x1400, 1, kInvalid), AbortCode::none);
  EXPECT_EQ(device.write(0x1600, 0, 0), AbortCode::none);
  EXPECT_EQ(device.write(0x1600, 1, 0x20100010), AbortCode::not_mappable) << "read-only";
  EXPECT_EQ(device.write(0x1600, 1, 0x00050008), AbortCode::none);
}

TEST_F(RecordTest, TheNumberOfEntriesIsChecked) {
  EXPECT_EQ(device.write(0x1A01, 1, 0x20060040), AbortCode::none);
  EXPECT_EQ(device.write(0x1A01, 2, 0x20020008), AbortCode::none);
  EXPECT_EQ(device.write(0x1A01, 0, 2), AbortCode::pdo_length_exceeded);
  EXPECT_EQ(device.write(0x1A01, 0, 3), AbortCode::no_object) << "entry 3 maps nothing";
  EXPECT_EQ(device.write(0x1A01, 0, 9), AbortCode::pdo_length_exceeded) << "the record has 8";
  EXPECT_EQ(device.write(0x1A01, 0, 253), AbortCode::pdo_length_exceeded);
  EXPECT_EQ(device.write(0x1A01, 0, 1), AbortCode::none);
}

struct FdRecordTest : RecordTest {
  FdRecordTest() {
    device.engine->set_max_length(64);
    EXPECT_THAT(device.engine->configure(), IsEmpty());
    device.operational();
  }
};

TEST_F(FdRecordTest, MapsWholeBytesAlone) {
  EXPECT_EQ(device.write(0x1A01, 1, 0x20000001), AbortCode::not_mappable);
  EXPECT_EQ(device.write(0x1A01, 1, 0x20020008), AbortCode::none);
  EXPECT_EQ(device.write(0x1400, 1, kInvalid), AbortCode::none);
  EXPECT_EQ(device.write(0x1600, 0, 0), AbortCode::none);
  EXPECT_EQ(device.write(0x1600, 1, 0x00010001), AbortCode::not_mappable) << "a filler";
  EXPECT_EQ(device.write(0x1600, 1, 0x00050008), AbortCode::none);
}

TEST_F(FdRecordTest, HasRoomFor64Bytes) {
  for (std::uint8_t entry = 1; entry <= 8; ++entry) {
    EXPECT_EQ(device.write(0x1A01, entry, 0x20060040), AbortCode::none);
  }
  EXPECT_EQ(device.write(0x1A01, 0, 8), AbortCode::none);
  EXPECT_EQ(device.write(0x1801, 1, 0x281), AbortCode::none);
}

TEST_F(FdRecordTest, TransmissionTypesByRemoteFrameAreReserved) {
  EXPECT_EQ(device.write(0x1800, 2, 252), AbortCode::invalid_value);
  EXPECT_EQ(device.write(0x1800, 2, 253), AbortCode::invalid_value);
  EXPECT_EQ(device.write(0x1800, 2, 254), AbortCode::none);
}

TEST(FdConfigure, APdoThatMapsBitsIsNotUsed) {
  od::DeviceDescription description = plain_device();
  add_tpdo(description, {.cob_id = 0x181, .mapping = {0x20000001}});
  Device device(description);
  EXPECT_THAT(device.diagnostics, IsEmpty());
  device.engine->set_max_length(64);
  EXPECT_EQ(device.engine->configure().size(), 1U);
}

TEST(Configure, TellsWhatItCannotUse) {
  od::DeviceDescription out = plain_device();
  add_rpdo(out, {.cob_id = 0x201, .mapping = {0x20100010}});
  add_tpdo(out, {.cob_id = 0x181, .mapping = {0x20060040, 0x20020008}});
  add_tpdo(out, {.number = 3, .cob_id = 0x601, .mapping = {0x20020008}});
  add_tpdo(out, {.number = 4, .cob_id = 0x481, .mapping = {0x20020008}});
  Device device(out);
  ASSERT_EQ(device.diagnostics.size(), 3U);
  EXPECT_THAT(device.diagnostics[0].text, testing::HasSubstr("RPDO 1 is not used: 2010:00"));
  EXPECT_THAT(device.diagnostics[1].text,
              testing::HasSubstr("TPDO 1 is not used: it maps 72 bits"));
  EXPECT_THAT(device.diagnostics[2].text, testing::HasSubstr("TPDO 3 is not used: its COB-ID"));
  EXPECT_THAT(device.listener.unusable,
              ElementsAre(Unusable{{0x1600, 1}, AbortCode::not_mappable},
                          Unusable{{0x1A00, 0}, AbortCode::pdo_length_exceeded},
                          Unusable{{0x1802, 1}, AbortCode::invalid_value}));
  device.operational();
  device.receive(frame(0x201, {1, 2}, at(1)));
  EXPECT_EQ(device.read(0x2010), 0U);
  EXPECT_THAT(device.sent_ids(at(1)), ElementsAre(0x481));
}

// A COB-ID that remains invalid is not reported again when another value of the PDO is written.
TEST(Configure, TellsAWrongPdoOnlyOnce) {
  od::DeviceDescription out = plain_device();
  add_tpdo(out, {.cob_id = 0x601, .mapping = {0x20020008}});
  add_tpdo(out, {.number = 2, .cob_id = 0x281, .mapping = {0x20060040, 0x20020008}});
  Device device(out);
  std::vector<RecordingListener::Unusable>& told = device.listener.unusable;
  ASSERT_EQ(told.size(), 2U);
  told.clear();
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(device.write(0x1800, 5, 100), AbortCode::none);
    EXPECT_EQ(device.write(0x1801, 5, 100), AbortCode::none);
  }
  EXPECT_THAT(told, IsEmpty()) << "not reported again";
  EXPECT_EQ(device.write(0x1800, 1, kInvalid | 0x601), AbortCode::none);
  EXPECT_TRUE(device.dictionary.set({0x1800, 1}, 0x601));
  EXPECT_EQ(told.size(), 1U) << "it was valid in between";
  told.clear();
  EXPECT_TRUE(device.dictionary.set({0x1A01, 0}, 1));
  EXPECT_TRUE(device.dictionary.set({0x1A01, 1}, 0x30000040));
  EXPECT_THAT(told, ElementsAre(RecordingListener::Unusable{{0x1A01, 1}, AbortCode::no_object}))
      << "another reason";
  told.clear();
  EXPECT_EQ(device.engine->configure().size(), 2U);
  EXPECT_EQ(told.size(), 2U) << "reported after every reset";
}

}  // namespace
}  // namespace linegate::pdo
