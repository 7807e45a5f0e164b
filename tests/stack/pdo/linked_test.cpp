// SPDX-License-Identifier: Apache-2.0
// The manager's PDOs and the process image: consistency, marks, validity, outputs held back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/stack/pdo/linked_fixture.h"

namespace linegate::pdo {
namespace {

using namespace test;
using image::Direction;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr auto kIn = Direction::inputs;
constexpr auto kOut = Direction::outputs;

struct LinkedTest : testing::Test {
  RemoteNode node(std::uint8_t id, std::vector<Parameters> tpdos,
                  std::vector<Parameters> rpdos = {}, Duration deadline = {}) {
    RemoteNode out;
    out.id = id;
    out.device = &device;
    out.pdos = {std::move(tpdos), std::move(rpdos)};
    out.deadline = deadline;
    return out;
  }

  od::DeviceDescription device = plain_device();
};

TEST_F(LinkedTest, AFrameIsInTheImageWithAllMarks) {
  Manager manager({node(5, {remote_pdo(2, 0x285, {0x20030010, 0x20020008, 0x20000001})})});
  EXPECT_FALSE(manager.snapshot().is_valid(0));
  manager.receive(frame(0x285, {0x34, 0x12, 0x00, 0x01}, at(7)));
  const image::Snapshot& snapshot = manager.snapshot();
  EXPECT_EQ(manager.image->read_entry(kIn, 0), 0x1234U);
  EXPECT_EQ(manager.image->read_entry(kIn, 1), 0U);
  EXPECT_EQ(manager.image->read_entry(kIn, 2), 1U);
  EXPECT_EQ(snapshot.changed[0], 0b101U);
  EXPECT_EQ(snapshot.valid[0], 0b111U) << "received, though not changed";
  ASSERT_EQ(snapshot.marks.size(), 1U);
  EXPECT_EQ(snapshot.marks[0].time, at(7));
  EXPECT_EQ(snapshot.marks[0].remote_pdo, 2);
  EXPECT_EQ(snapshot.marks[0].node, 5);
  EXPECT_EQ(snapshot.marks[0].entries, 3U);
}

TEST_F(LinkedTest, TheNetworkVariablesShowTheSameBytes) {
  Manager manager({node(5, {remote_pdo(1, 0x185, {0x20030010, 0x20000001})})});
  manager.receive(frame(0x185, {0x34, 0x12, 0x01}, at(7)));
  for (const image::Entry& entry : manager.plan.inputs.entries) {
    const auto value = manager.dictionary.read({entry.variable_index, entry.variable_sub});
    ASSERT_TRUE(value.ok());
    const auto number = static_cast<std::uint32_t>(&entry - manager.plan.inputs.entries.data());
    EXPECT_EQ(load_le(value.value()), manager.image->read_entry(kIn, number)) << entry.name;
  }
}

TEST_F(LinkedTest, AnInvalidNodeIsValidAgainWithItsNextFrame) {
  Manager manager({node(5, {remote_pdo(1, 0x185, {0x20030010})}),
                   node(6, {remote_pdo(1, 0x186, {0x20030010}, 1)})});
  manager.receive(frame(0x185, {1, 0}, at(1)));
  manager.receive(frame(0x186, {1, 0}, at(1)));
  EXPECT_EQ(manager.snapshot().valid[0], 0b01U) << "the synchronous one is not in the image yet";
  manager.engine->sync(0, at(2));
  EXPECT_EQ(manager.snapshot().valid[0], 0b11U);
  manager.image->set_node_valid(5, false);
  manager.image->set_node_valid(6, false);
  EXPECT_EQ(manager.snapshot().valid[0], 0U);
  EXPECT_EQ(manager.image->read_entry(kIn, 0), 1U) << "the value stays";
  manager.receive(frame(0x185, {1, 0}, at(3)));
  manager.receive(frame(0x186, {1, 0}, at(3)));
  EXPECT_EQ(manager.snapshot().valid[0], 0b01U);
  manager.engine->sync(0, at(4));
  EXPECT_EQ(manager.snapshot().valid[0], 0b11U);
}

TEST_F(LinkedTest, WhatCameEarlyIsForgottenWithItsNode) {
  Manager manager({node(5, {remote_pdo(1, 0x185, {0x20030010})}),
                   node(6, {remote_pdo(1, 0x186, {0x20030010})})});
  manager.engine->set_operational(false, at(1));
  manager.engine->keep_early(true);
  manager.receive(frame(0x185, {1, 0}, at(2)));
  manager.receive(frame(0x186, {2, 0}, at(2)));
  manager.engine->drop_waiting(5);
  manager.engine->set_operational(true, at(3));
  EXPECT_EQ(manager.snapshot().valid[0], 0b10U);
  EXPECT_EQ(manager.image->read_entry(kIn, 1), 2U);
  ASSERT_EQ(manager.inputs.marks.size(), 1U);
  EXPECT_EQ(manager.inputs.marks[0].time, at(2)) << "reception, not Operational";
}

TEST_F(LinkedTest, SynchronousRpdosAreCommittedWholeAtSync) {
  Manager manager({node(5, {remote_pdo(1, 0x185, {0x20030010, 0x20050020}, 1)})});
  manager.receive(frame(0x185, {1, 0, 1, 0, 0, 0}, at(1)));
  manager.receive(frame(0x185, {2, 0, 2, 0, 0, 0}, at(2)));
  EXPECT_THAT(manager.snapshot().marks, IsEmpty());
  EXPECT_EQ(manager.image->read_entry(kIn, 0), 0U);
  manager.engine->sync(0, at(3));
  const image::Snapshot& snapshot = manager.snapshot();
  EXPECT_EQ(manager.image->read_entry(kIn, 0), 2U);
  EXPECT_EQ(manager.image->read_entry(kIn, 1), 2U);
  ASSERT_EQ(snapshot.marks.size(), 1U);
  EXPECT_EQ(snapshot.marks[0].count, 2U) << "both were received";
  EXPECT_EQ(snapshot.marks[0].time, at(2)) << "reception, not SYNC";
  manager.engine->sync(0, at(4));
  EXPECT_THAT(manager.snapshot().marks, IsEmpty()) << "no mark without a reception";
}

// Every value of a PDO carries the same number: all values in a snapshot are equal.
TEST_F(LinkedTest, AllValuesOfAPdoAreOfTheSameFrame) {
  std::vector<RemoteNode> nodes;
  for (std::uint8_t id = 1; id <= 20; ++id) {
    nodes.push_back(
        node(id, {remote_pdo(1, 0x180U + id, {0x20020008, 0x20030010, 0x20020008, 0x20050020},
                             id % 2 == 0 ? 1 : 255)}));
  }
  Manager manager(nodes);
  Random random(3);
  for (int round = 0; round < 3000; ++round) {
    const auto number = static_cast<std::uint8_t>(random());
    manager.receive(
        frame(0x181U + random() % 20, {number, number, 0, number, number, 0, 0, 0}, at(round)));
    if (random() % 8 == 0) {
      manager.engine->sync(0, at(round));
    }
    if (random() % 4 == 0) {
      (void)manager.snapshot(random() % 2 == 0);
      for (std::uint32_t i = 0; i < manager.plan.inputs.entries.size(); i += 4) {
        for (std::uint32_t k = 1; k < 4; ++k) {
          const auto byte = [&](std::uint32_t entry) {
            return manager.inputs.bytes[manager.plan.inputs.entries[entry].bit_offset / 8];
          };
          ASSERT_EQ(byte(i), byte(i + k)) << "round " << round;
        }
      }
    }
  }
}

// Random mappings, received and compared bit by bit.
TEST_F(LinkedTest, RandomMappingsArriveBitByBit) {
  for (unsigned seed = 1; seed <= 100; ++seed) {
    Random random(seed);
    constexpr std::array<std::uint32_t, 7> kObjects = {
        0x20000001, 0x20010001, 0x20020008, 0x20030010, 0x20040018, 0x20050020, 0x00050008};
    std::vector<Parameters> tpdos;
    for (std::uint16_t n = 1; n <= 10; ++n) {
      std::vector<std::uint32_t> mapping;
      unsigned bits = 0;
      while (bits < 20 + random() % 40) {
        const std::uint32_t raw = kObjects[random() % kObjects.size()];
        if (bits + (raw & 0xFFU) > 64) {
          break;
        }
        bits += raw & 0xFFU;
        mapping.push_back(raw);
      }
      tpdos.push_back(remote_pdo(n, 0x200U + n, mapping, random() % 2 == 0 ? 1 : 255));
    }
    Manager manager({node(1, tpdos)});
    for (int round = 0; round < 20; ++round) {
      const std::size_t which = random() % tpdos.size();
      unsigned bits = 0;
      for (const Mapping& mapping : tpdos[which].mapping) {
        bits += mapping.bits;
      }
      std::array<std::byte, 8> data;
      random.fill(data);
      can::Frame received = can::make_frame(0x201U + static_cast<std::uint32_t>(which),
                                            std::span<const std::byte>(data).first((bits + 7) / 8));
      manager.receive(received);
      manager.engine->sync(0, at(round));
      const std::uint64_t word = load_le(std::span<const std::byte>(data));
      auto entry = manager.image->entries_of(kIn, static_cast<std::uint16_t>(which + 1)).first;
      unsigned at_bit = 0;
      for (const Mapping& mapping : tpdos[which].mapping) {
        if (mapping.address.index >= 0x2000) {
          const std::uint64_t expected = word >> at_bit & ((std::uint64_t{1} << mapping.bits) - 1);
          ASSERT_EQ(manager.image->read_entry(kIn, entry++), expected) << "seed " << seed;
        }
        at_bit += mapping.bits;
      }
    }
  }
}

TEST_F(LinkedTest, DeadlinesNameTheNode) {
  Manager manager({node(5, {remote_pdo(1, 0x185, {0x20030010}), remote_pdo(2, 0x285, {0x20030010})},
                        {}, std::chrono::milliseconds(50))});
  manager.receive(frame(0x285, {1, 0}, at(1)));
  manager.engine->advance(at(51));
  Event event;
  ASSERT_EQ(manager.events.take(std::span(&event, 1)), 1U);
  EXPECT_EQ(event.node, 5);
  EXPECT_EQ(std::get<event::PdoTimeout>(event.data).number, 2U);
  EXPECT_TRUE(manager.image->is_valid(kIn, 1)) << "the node is not known to be lost";
}

TEST_F(LinkedTest, OutputsAreHeldBackUntilAllWereWritten) {
  Manager manager({node(5, {}, {remote_pdo(1, 0x205, {0x20030010, 0x20020008})})});
  can::Frame sent;
  EXPECT_FALSE(manager.engine->next_frame(sent, at(0))) << "not sent at the start";
  manager.image->write_entry(kOut, 0, 0x0201);
  manager.engine->outputs_written(0, 16, false, at(1));
  EXPECT_TRUE(manager.engine->trigger(1, at(1)));
  EXPECT_FALSE(manager.engine->next_frame(sent, at(1)));
  manager.image->write_entry(kOut, 1, 0);
  manager.engine->outputs_written(16, 8, false, at(2));
  ASSERT_TRUE(manager.engine->next_frame(sent, at(2)));
  EXPECT_EQ(sent.id, 0x205U);
  EXPECT_THAT(data_of(sent), ElementsAre(1, 2, 0));
  image::Snapshot outputs;
  manager.image->snapshot(kOut, outputs, at(3), false, 0);
  ASSERT_EQ(outputs.marks.size(), 1U);
  EXPECT_EQ(outputs.marks[0].time, at(2));
  EXPECT_EQ(outputs.marks[0].node, 5);
  EXPECT_EQ(outputs.valid[0], 0b11U);
}

TEST_F(LinkedTest, OutputsAreSentOnChangeOrAlways) {
  Manager manager(
      {node(5, {},
            {remote_pdo(1, 0x205, {0x20030010}), remote_pdo(2, 0x305, {0x20000001, 0x20010001}),
             remote_pdo(3, 0x405, {0x20050020})})});
  for (std::uint32_t entry = 0; entry < 4; ++entry) {
    manager.image->write_entry(kOut, entry, 0);
  }
  const auto ids = [&](Instant now) {
    std::vector<std::uint32_t> out;
    can::Frame sent;
    while (manager.engine->next_frame(sent, now)) {
      out.push_back(sent.id);
    }
    return out;
  };
  manager.engine->outputs_written(0, 8 * manager.plan.outputs.byte_size, false, at(1));
  EXPECT_THAT(ids(at(1)), ElementsAre(0x205, 0x305, 0x405));
  manager.engine->outputs_written(0, 8 * manager.plan.outputs.byte_size, false, at(2));
  EXPECT_THAT(ids(at(2)), IsEmpty());
  const image::Entry& second_bit = manager.plan.outputs.entries[2];
  manager.engine->outputs_written(second_bit.bit_offset, 1, true, at(3));
  EXPECT_THAT(ids(at(3)), ElementsAre(0x305)) << "only the PDO that maps the entry";
  manager.image->write_entry(kOut, 3, 9);
  manager.engine->outputs_written(manager.plan.outputs.entries[3].bit_offset, 32, false, at(4));
  EXPECT_THAT(ids(at(4)), ElementsAre(0x405));
}

// The entries are written as a whole, then reported one by one: one sample.
TEST_F(LinkedTest, AWriteOfSeveralEntriesIsOneSample) {
  Manager manager({node(5, {}, {remote_pdo(1, 0x205, {0x20030010, 0x20020008})})});
  manager.image->write_entry(kOut, 0, 1);
  manager.image->write_entry(kOut, 1, 2);
  manager.engine->outputs_written(0, 16, false, at(1));
  manager.engine->outputs_written(16, 8, false, at(1));
  EXPECT_EQ(manager.engine->counters().coalesced, 0U);
  can::Frame sent;
  ASSERT_TRUE(manager.engine->next_frame(sent, at(1)));
  EXPECT_FALSE(manager.engine->next_frame(sent, at(1)));
}

TEST_F(LinkedTest, SynchronousOutputsAreSampledAtSync) {
  Manager manager({node(5, {}, {remote_pdo(1, 0x205, {0x20030010}, 1)})});
  manager.image->write_entry(kOut, 0, 7);
  manager.engine->outputs_written(0, 16, false, at(1));
  can::Frame sent;
  EXPECT_FALSE(manager.engine->next_frame(sent, at(1)));
  manager.engine->sync(0, at(2));
  ASSERT_TRUE(manager.engine->next_frame(sent, at(2)));
  EXPECT_THAT(data_of(sent), ElementsAre(7, 0));
}

TEST_F(LinkedTest, PdosBeyondTheRecordsWorkWithoutOne) {
  std::vector<Parameters> tpdos;
  for (std::uint16_t n = 1; n <= 512; ++n) {
    tpdos.push_back(remote_pdo(n, 0x2000'0000U + n, {0x20030010}));
  }
  Manager manager({node(1, tpdos), node(2, {remote_pdo(1, 0x2001'0000U, {0x20030010})})});
  EXPECT_TRUE(manager.dictionary.has_object(0x15FF));
  EXPECT_TRUE(manager.dictionary.has_object(0x17FF));
  EXPECT_FALSE(manager.dictionary.has_object(0x1800)) << "TPDO 513 does not exist";
  can::Frame extended = frame(0x1'0000U, {0x34, 0x12}, at(1));
  extended.flags = can::Frame::kExtended;
  manager.receive(extended);
  EXPECT_EQ(manager.plan.inputs.entries[512].local_pdo, 513);
  EXPECT_EQ(manager.image->read_entry(kIn, 512), 0x1234U);
  EXPECT_TRUE(manager.image->is_valid(kIn, 512));
}

// Reset communication restores the values of the records and configures the PDOs again: the links
// remain.
TEST_F(LinkedTest, ConfiguringAgainKeepsTheLinks) {
  Manager manager({node(5, {remote_pdo(1, 0x185, {0x20030010})})});
  manager.engine->set_operational(false, at(1));
  EXPECT_EQ(manager.dictionary.write({0x1400, 2}, std::array{std::byte{1}}), AbortCode::none);
  manager.dictionary.reset_values(0x1000, 0x1FFF);
  EXPECT_TRUE(manager.engine->configure().empty());
  manager.engine->set_operational(true, at(2));
  manager.receive(frame(0x185, {0x34, 0x12}, at(3)));
  EXPECT_EQ(manager.image->read_entry(kIn, 0), 0x1234U);
}

// A device with network variables maps them itself: the marks of the image are maintained
// nevertheless.
TEST_F(LinkedTest, AMappedNetworkVariableIsAPlaceInTheImage) {
  Manager manager({node(5, {remote_pdo(1, 0x185, {0x20030010, 0x20000001})})});
  od::DeviceDescription records;
  add_rpdo(records, {.number = 2, .cob_id = 0x211, .mapping = {0xA5800110, 0xA5001101}});
  for (const od::ObjectDescription& object : records.objects) {
    ASSERT_TRUE(manager.dictionary.add(object).ok());
  }
  ASSERT_TRUE(manager.engine->configure().empty());
  manager.receive(frame(0x211, {0x78, 0x56, 0x01}, at(1)));
  EXPECT_EQ(manager.image->read_entry(kIn, 0), 0x5678U);
  EXPECT_EQ(manager.image->read_entry(kIn, 1), 1U);
  EXPECT_EQ(manager.snapshot().changed[0], 0b11U);
}

}  // namespace
}  // namespace linegate::pdo
