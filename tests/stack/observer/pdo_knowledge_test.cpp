// SPDX-License-Identifier: Apache-2.0
// What is known of the PDOs of a node, from its device file and from transfers, over its resets.
#include "stack/observer/pdo_knowledge.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "stack/base/byte_order.h"

namespace linegate::observer {
namespace {

using Seen = PdoKnowledge::Seen;

constexpr std::uint32_t kSave = 0x6576'6173;
constexpr std::uint32_t kLoad = 0x6461'6F6C;
constexpr std::uint32_t kStatus = 0x2000'0010;
constexpr std::uint32_t kPosition = 0x2001'0020;

od::VariableDescription variable(std::uint8_t sub, od::DataType type, std::uint64_t value) {
  od::VariableDescription out{.sub = sub, .type = type, .mappable = true};
  out.value.resize(od::byte_size(type));
  store_le(std::span(out.value), value);
  return out;
}

// TPDO 1 on 185h maps 2000h (Status), and 2001h (Position) if mapped is 2.
od::DeviceDescription device_file(std::uint32_t store_capability = 1, std::uint8_t mapped = 1) {
  using od::DataType;
  const auto object = [](std::uint16_t index, std::vector<od::VariableDescription> variables) {
    return od::ObjectDescription{.index = index, .variables = std::move(variables)};
  };
  od::DeviceDescription out;
  out.objects = {
      object(0x1010, {variable(1, DataType::unsigned32, store_capability)}),
      object(0x1800, {variable(0, DataType::unsigned8, 2), variable(1, DataType::unsigned32, 0x185),
                      variable(2, DataType::unsigned8, 255)}),
      object(0x1A00,
             {variable(0, DataType::unsigned8, mapped), variable(1, DataType::unsigned32, kStatus),
              variable(2, DataType::unsigned32, kPosition)}),
      object(0x2000, {variable(0, DataType::unsigned16, 0)}),
      object(0x2001, {variable(0, DataType::integer32, 0)})};
  return out;
}

class PdoKnowledgeTest : public testing::Test {
 protected:
  bool see(Seen seen, od::Address address, std::uint32_t value) {
    const bool is_octet = address.sub == 0 || address == od::Address{0x1800, 2};
    const std::size_t size = is_octet ? 1 : 4;
    std::array<std::byte, 4> bytes{};
    store_le(std::span(bytes), std::uint64_t{value});
    return known_.learn(address, std::span(bytes).first(size), seen);
  }
  bool write(od::Address address, std::uint32_t value) {
    return see(Seen::written, address, value);
  }
  bool read(od::Address address, std::uint32_t value) { return see(Seen::read, address, value); }

  // Enough frames for an unknown PDO.
  can::Frame hear_tpdo() {
    can::Frame frame = can::make_frame(0x185, {1, 2, 3, 4});
    for (unsigned i = 0; i < PdoKnowledge::kUnknownFrames; ++i) {
      frame.time += std::chrono::milliseconds(10);
      known_.hear(frame);
    }
    return frame;
  }

  static std::string text(const std::vector<pdo::Mapping>& mapping) {
    std::string out;
    for (const pdo::Mapping& entry : mapping) {
      out += (out.empty() ? "" : " ") + std::string(entry.raw() == kStatus ? "Status" : "Position");
    }
    return out;
  }
  // The mapping of TPDO 1; "raw" and "none".
  std::string tpdo() const {
    for (const KnownPdo& pdo : known_.pdos()) {
      if (pdo.kind == pdo::PdoKind::tpdo && pdo.parameters.number == 1) {
        return pdo.complete ? text(pdo.parameters.mapping) : "raw";
      }
    }
    return "none";
  }

  PdoKnowledge known_{device_file(), 5};
};

TEST_F(PdoKnowledgeTest, AResetEndsWhatWasWritten) {
  EXPECT_EQ(tpdo(), "Status");
  EXPECT_TRUE(write({0x1A00, 1}, kPosition));
  EXPECT_EQ(tpdo(), "Position");
  known_.reset();
  EXPECT_EQ(tpdo(), "Status");
  EXPECT_TRUE(write({0x1A00, 1}, kPosition)) << "it is learned again";
  EXPECT_EQ(tpdo(), "Position");
  known_.boot_up();
  EXPECT_EQ(tpdo(), "Status") << "a boot-up message without a command: it was switched on";
}

TEST_F(PdoKnowledgeTest, WhatIsStoredIsKept) {
  write({0x1A00, 1}, kPosition);
  write({0x1010, 3}, kSave);
  known_.boot_up();
  EXPECT_EQ(tpdo(), "Status") << "sub-index 3: parameters of the application";
  for (const std::uint8_t sub : {std::uint8_t{1}, std::uint8_t{2}}) {
    write({0x1A00, 1}, kPosition);
    write({0x1010, sub}, 0x6576'6172);
    known_.boot_up();
    EXPECT_EQ(tpdo(), "Status") << "another signature";
    write({0x1A00, 1}, kPosition);
    read({0x1010, sub}, kSave);
    known_.boot_up();
    EXPECT_EQ(tpdo(), "Status") << "it was not written";
    write({0x1A00, 1}, kPosition);
    write({0x1010, sub}, kSave);
    write({0x1A00, 1}, kStatus);
    known_.boot_up();
    EXPECT_EQ(tpdo(), "Position") << "the values of that moment are stored";
    write({0x1A00, 1}, kStatus);
    write({0x1010, sub}, kSave);
    known_.boot_up();
    EXPECT_EQ(tpdo(), "Status");
  }
}

TEST_F(PdoKnowledgeTest, RestoredDefaultsAreThoseOfTheFile) {
  write({0x1A00, 1}, kPosition);
  write({0x1010, 1}, kSave);
  write({0x1011, 1}, kLoad);
  EXPECT_EQ(tpdo(), "Position") << "until the reset";
  known_.boot_up();
  EXPECT_EQ(tpdo(), "Status");
}

TEST_F(PdoKnowledgeTest, WhatIsReadBetweenARestoreAndTheResetIsNotStored) {
  known_.boot_up();
  write({0x1A00, 1}, kPosition);
  write({0x1010, 1}, kSave);
  known_.boot_up();
  write({0x1011, 2}, kLoad);
  read({0x1A00, 1}, kPosition);
  read({0x1800, 2}, 254);
  EXPECT_EQ(tpdo(), "Position");
  known_.boot_up();
  EXPECT_EQ(tpdo(), "Status");
  write({0x1011, 2}, kLoad);
  write({0x1A00, 1}, kPosition);
  write({0x1010, 2}, kSave);
  known_.boot_up();
  read({0x1A00, 1}, kPosition);
  EXPECT_EQ(tpdo(), "Position") << "it was stored after the restore";
}

// The master may have written the value before anybody listened, or the device has stored it.
TEST_F(PdoKnowledgeTest, AValueThatWasReadBeforeTheBootUpIsNotKnownAfterIt) {
  EXPECT_TRUE(read({0x1A00, 1}, kPosition));
  EXPECT_EQ(tpdo(), "Position");
  known_.boot_up();
  EXPECT_EQ(tpdo(), "none");
  EXPECT_FALSE(known_.is_known(pdo::PdoKind::tpdo, 1));
  EXPECT_TRUE(known_.is_known(pdo::PdoKind::tpdo, 2));
  EXPECT_TRUE(known_.is_known(pdo::PdoKind::rpdo, 1));
  const can::Frame frame = hear_tpdo();
  EXPECT_EQ(tpdo(), "raw");
  EXPECT_EQ(known_.kind_of(frame), pdo::PdoKind::tpdo);
  read({0x1800, 1}, 0x185);
  read({0x1A00, 0}, 1);
  EXPECT_EQ(tpdo(), "raw");
  EXPECT_TRUE(read({0x1A00, 1}, kPosition)) << "the same value is known again";
  EXPECT_EQ(tpdo(), "Position");
  known_.boot_up();
  EXPECT_EQ(tpdo(), "Position") << "it was read after the boot-up: it is the stored value";
  write({0x1A00, 1}, kStatus);
  read({0x1A00, 1}, kStatus);
  known_.boot_up();
  EXPECT_EQ(tpdo(), "Position") << "read back after it was written";
}

TEST_F(PdoKnowledgeTest, WhatADeviceStoresByItselfIsNotKnown) {
  known_ = PdoKnowledge(device_file(3), 5);
  write({0x1A00, 1}, kPosition);
  EXPECT_EQ(tpdo(), "Position");
  known_.boot_up();
  EXPECT_EQ(tpdo(), "none") << "it may have stored the value, or not";
  write({0x1A00, 1}, kPosition);
  write({0x1010, 1}, kSave);
  known_.boot_up();
  EXPECT_EQ(tpdo(), "Position");
}

TEST_F(PdoKnowledgeTest, ADeviceMayShowThatItStoresByItself) {
  read({0x1010, 2}, 3);
  write({0x1A00, 1}, kPosition);
  known_.boot_up();
  EXPECT_EQ(tpdo(), "none");
}

TEST_F(PdoKnowledgeTest, WhatTheManufacturersSubIndicesStoreIsNotKnown) {
  write({0x1A00, 1}, kPosition);
  write({0x1010, 4}, kSave);
  known_.boot_up();
  EXPECT_EQ(tpdo(), "none");
  write({0x1A00, 1}, kPosition);
  write({0x1010, 1}, kSave);
  write({0x1011, 4}, kLoad);
  known_.boot_up();
  EXPECT_EQ(tpdo(), "none");
}

// A device stores the parameters of a PDO together: communication and mapping.
class StoredRecordTest : public PdoKnowledgeTest {
 protected:
  StoredRecordTest() { known_ = PdoKnowledge(device_file(1, 2), 5); }

  // The remapping procedure (CiA 301, 7.5.2.38), with the values of the device file.
  void configure() {
    write({0x1800, 1}, 0x8000'0185);
    write({0x1A00, 0}, 0);
    write({0x1A00, 1}, kStatus);
    write({0x1A00, 2}, kPosition);
    write({0x1A00, 0}, 2);
    write({0x1800, 1}, 0x185);
  }
};

// Stored: Position, Status. The manager compares, and stops at the first difference.
TEST_F(StoredRecordTest, OneStoredValueLeavesThoseThatWereNotReadUnknown) {
  known_.boot_up();
  read({0x1A00, 0}, 2);
  EXPECT_EQ(tpdo(), "Status Position");
  EXPECT_TRUE(read({0x1A00, 1}, kPosition));
  EXPECT_EQ(tpdo(), "none") << "before the reset, too";
  configure();
  EXPECT_EQ(tpdo(), "Status Position");
  known_.boot_up();
  EXPECT_EQ(tpdo(), "none");
  EXPECT_FALSE(known_.is_known(pdo::PdoKind::tpdo, 1));
  EXPECT_TRUE(known_.is_known(pdo::PdoKind::rpdo, 1));
  hear_tpdo();
  EXPECT_EQ(tpdo(), "raw");
  read({0x1A00, 2}, kStatus);
  EXPECT_EQ(tpdo(), "raw") << "its COB-ID may be another one";
  EXPECT_TRUE(read({0x1800, 1}, 0x185));
  EXPECT_EQ(tpdo(), "Position Status");
  configure();
  known_.boot_up();
  EXPECT_EQ(tpdo(), "Position Status") << "all were read: these are stored";
}

TEST_F(StoredRecordTest, ValuesThatWereWrittenBeforeTheReadAreKnownUntilTheReset) {
  known_.boot_up();
  configure();
  read({0x1800, 2}, 254);
  EXPECT_EQ(tpdo(), "Status Position");
  known_.boot_up();
  EXPECT_EQ(tpdo(), "none");
}

TEST_F(StoredRecordTest, AnotherCobIdLeavesTheMappingUnknown) {
  known_.boot_up();
  read({0x1800, 1}, 0x285);
  EXPECT_EQ(tpdo(), "none");
  read({0x1A00, 0}, 2);
  read({0x1A00, 1}, kStatus);
  EXPECT_EQ(tpdo(), "none");
  EXPECT_TRUE(read({0x1A00, 2}, kPosition)) << "it is as the file says, which is known now";
  EXPECT_EQ(tpdo(), "Status Position");
}

TEST_F(StoredRecordTest, EntriesThatAreNotMappedNeedNotBeKnown) {
  known_.boot_up();
  read({0x1800, 1}, 0x185);
  read({0x1A00, 0}, 1);
  EXPECT_EQ(tpdo(), "none");
  read({0x1A00, 1}, kPosition);
  EXPECT_EQ(tpdo(), "Position");
}

TEST_F(StoredRecordTest, TheNumberOfCommunicationParametersIsNotStored) {
  known_.boot_up();
  read({0x1800, 0}, 5);
  EXPECT_EQ(tpdo(), "Status Position");
}

TEST_F(StoredRecordTest, TheRtrBitOfACobIdIsNoSignOfOtherParameters) {
  known_.boot_up();
  read({0x1800, 1}, 0x4000'0185);
  EXPECT_EQ(tpdo(), "Status Position");
}

// Whether its boot-up message was received or not: the bit cannot be changed by a write.
TEST_F(StoredRecordTest, ACobIdWithAnotherRtrBitIsStillTheStoredOneAfterTheBootUp) {
  read({0x1800, 1}, 0x4000'0185);
  known_.boot_up();
  EXPECT_EQ(tpdo(), "Status Position");
  read({0x1800, 1}, 0x4000'0185);
  write({0x1011, 4}, kLoad);
  known_.boot_up();
  EXPECT_EQ(tpdo(), "Status Position");
}

// The manager assumes that COB-ID, too.
TEST_F(StoredRecordTest, ACobIdThatTheFileLacksIsThatOfThePredefinedConnectionSet) {
  od::DeviceDescription without = device_file(1, 2);
  without.node_id = 5;
  without.objects[1].variables[1].value.assign(4, std::byte{0});
  known_ = PdoKnowledge(without, 5);
  known_.boot_up();
  read({0x1800, 1}, 0x4000'0185);
  EXPECT_EQ(tpdo(), "Status Position");
  read({0x1800, 1}, 0x285);
  EXPECT_EQ(tpdo(), "none");
}

// It is stored, or a master has written it. Until the reset the others count as those of the file.
TEST_F(StoredRecordTest, AValueThatWasReadBeforeTheBootUpLeavesTheOthersUnknownAfterIt) {
  read({0x1A00, 1}, kPosition);
  EXPECT_EQ(tpdo(), "Position Position");
  known_.boot_up();
  read({0x1A00, 1}, kPosition);
  EXPECT_EQ(tpdo(), "none");
}

TEST_F(StoredRecordTest, AChangeOfTheStoredValuesThatWasNotSeenEndsAllOfThem) {
  known_.boot_up();
  read({0x1800, 1}, 0x185);
  read({0x1A00, 0}, 2);
  read({0x1A00, 1}, kPosition);
  read({0x1A00, 2}, kStatus);
  known_.boot_up();
  EXPECT_EQ(tpdo(), "Position Status");
  read({0x1A00, 1}, kStatus);
  EXPECT_EQ(tpdo(), "none");
}

TEST_F(StoredRecordTest, SaveAndLoadMakeTheRecordKnown) {
  known_.boot_up();
  read({0x1A00, 1}, kPosition);
  write({0x1010, 1}, kSave);
  known_.boot_up();
  EXPECT_EQ(tpdo(), "none") << "values that are not known were saved";
  configure();
  write({0x1010, 1}, kSave);
  known_.boot_up();
  EXPECT_EQ(tpdo(), "Status Position");
  read({0x1A00, 1}, kPosition);
  EXPECT_EQ(tpdo(), "none");
  write({0x1011, 1}, kLoad);
  EXPECT_EQ(tpdo(), "none") << "until the reset";
  known_.boot_up();
  EXPECT_EQ(tpdo(), "Status Position");
}

}  // namespace
}  // namespace linegate::observer
