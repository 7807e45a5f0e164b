// SPDX-License-Identifier: Apache-2.0
#include "stack/pdo/link.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stack/image/network_variables.h"

#include "tests/stack/pdo/devices.h"

namespace linegate::pdo {
namespace {

using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;

od::DeviceDescription drive() {
  od::DeviceDescription device;
  device.file = "drive.eds";
  device.objects = {value(0x1000, DataType::unsigned32, Access::ro, 0x0002'0192),
                    value(0x2000, DataType::unsigned8),
                    value(0x2001, DataType::boolean),
                    value(0x2002, DataType::integer24),
                    value(0x2003, DataType::integer64),
                    value(0x6041, DataType::unsigned16, Access::ro),
                    value(0x6064, DataType::integer32, Access::ro)};
  device.objects[5].name = "Statusword";
  od::ObjectDescription identity;
  identity.index = 0x1018;
  identity.type = od::ObjectType::record;
  identity.variables = {variable(0, DataType::unsigned8, Access::constant, 4),
                        variable(2, DataType::unsigned32, Access::ro, 4711)};
  device.objects.insert(device.objects.begin() + 1, identity);
  return device;
}

Parameters pdo(std::uint16_t number, std::uint32_t cob_id, std::vector<std::uint32_t> mapping,
               std::uint8_t type = 255) {
  Parameters out;
  out.number = number;
  out.cob_id = {cob_id};
  out.type = type;
  for (const std::uint32_t raw : mapping) {
    out.mapping.push_back(Mapping::from_raw(raw));
  }
  return out;
}

struct LinkTest : testing::Test {
  RemoteNode node(std::uint8_t id, std::vector<Parameters> tpdos,
                  std::vector<Parameters> rpdos = {}) {
    RemoteNode out;
    out.id = id;
    out.name = "drive" + std::to_string(id);
    out.device = &device;
    out.pdos = {std::move(tpdos), std::move(rpdos)};
    return out;
  }
  LinkPlan plan(const std::vector<RemoteNode>& nodes) {
    const Loaded<LinkPlan> loaded = plan_links(nodes);
    EXPECT_TRUE(loaded.ok());
    return loaded.value.value_or(LinkPlan{});
  }
  static std::vector<std::uint32_t> offsets(const image::Layout& layout) {
    std::vector<std::uint32_t> out;
    for (const image::Entry& entry : layout.entries) {
      out.push_back(entry.bit_offset);
    }
    return out;
  }

  od::DeviceDescription device = drive();

  // Each has 512 TPDOs, with 29-bit identifiers.
  std::vector<RemoteNode> full_nodes(std::uint8_t count,
                                     const std::vector<std::uint32_t>& mapping) {
    std::vector<RemoteNode> nodes;
    for (std::uint8_t id = 1; id <= count; ++id) {
      std::vector<Parameters> tpdos;
      for (std::uint16_t n = 1; n <= 512; ++n) {
        tpdos.push_back(pdo(n, 0x2000'0000U + id * 512U + n, mapping));
      }
      nodes.push_back(node(id, std::move(tpdos)));
    }
    return nodes;
  }
};

TEST_F(LinkTest, AnEntrySaysEverythingAboutItsObject) {
  const LinkPlan out = plan({node(5, {pdo(2, 0x285, {0x60410010})})});
  ASSERT_EQ(out.inputs.entries.size(), 1U);
  const image::Entry& entry = out.inputs.entries[0];
  EXPECT_EQ(entry.bit_offset, 0U);
  EXPECT_EQ(entry.bit_length, 16);
  EXPECT_EQ(entry.type, DataType::unsigned16);
  EXPECT_EQ(entry.node, 5);
  EXPECT_EQ(entry.index, 0x6041);
  EXPECT_EQ(entry.sub, 0);
  EXPECT_EQ(entry.remote_pdo, 2);
  EXPECT_EQ(entry.local_pdo, 1);
  EXPECT_EQ(entry.variable_index, 0xA580);
  EXPECT_EQ(entry.variable_sub, 1);
  EXPECT_EQ(entry.profile, 402);
  EXPECT_EQ(entry.product_code, 4711U);
  EXPECT_EQ(entry.name, "drive5.Statusword");
  EXPECT_EQ(out.inputs.byte_size, 2U);
  EXPECT_EQ(out.inputs.id, image::layout_id(out.inputs));
  EXPECT_EQ(out.inputs.direction, image::Direction::inputs);
  EXPECT_EQ(out.outputs.direction, image::Direction::outputs);
}

TEST_F(LinkTest, NumbersFollowNodeAndRemoteNumberWhateverTheOrderOfTheNodes) {
  const RemoteNode a = node(3, {pdo(1, 0x183, {0x60410010}), pdo(4, 0x483, {0x60410010})});
  const RemoteNode b = node(9, {pdo(1, 0x189, {0x60640020})});
  const LinkPlan one = plan({a, b});
  const LinkPlan other = plan({b, a});
  EXPECT_EQ(one.inputs.id, other.inputs.id);
  ASSERT_EQ(other.rpdos.size(), 3U);
  EXPECT_EQ(other.rpdos[0].node, 3);
  EXPECT_EQ(other.rpdos[1].remote_pdo, 4);
  EXPECT_EQ(other.rpdos[1].parameters.number, 2);
  EXPECT_EQ(other.rpdos[2].node, 9);
}

TEST_F(LinkTest, ValuesLieAtAMultipleOfTheirSize) {
  // U8, U16, I32: 0, 2, 4; then U8 at 8, I24 at 9 (9 = 3 * 3); I64 begins its PDO at 16.
  const LinkPlan out =
      plan({node(1, {pdo(1, 0x181, {0x20000008, 0x60410010, 0x60640020}),
                     pdo(2, 0x281, {0x20000008, 0x20020018}), pdo(3, 0x381, {0x20030040})})});
  EXPECT_THAT(offsets(out.inputs), ElementsAre(0, 16, 32, 64, 72, 128));
  EXPECT_EQ(out.inputs.byte_size, 24U);
  EXPECT_EQ(out.inputs.entries[4].variable_index, 0xA5C0);
  EXPECT_EQ(out.inputs.entries[4].variable_sub, 4);
}

TEST_F(LinkTest, APdoThatIsAlignedInTheFrameStaysInOnePiece) {
  const LinkPlan out = plan({node(
      1, {pdo(1, 0x181, {0x20000008}), pdo(2, 0x281, {0x60410010, 0x60410010, 0x60640020})})});
  EXPECT_THAT(offsets(out.inputs), ElementsAre(0, 32, 48, 64));
}

TEST_F(LinkTest, BitsArePackedFromANewByteOn) {
  const LinkPlan out =
      plan({node(1, {pdo(1, 0x181, {0x20010001, 0x20010001, 0x20000008, 0x20010001}),
                     pdo(2, 0x281, {0x20010001})})});
  EXPECT_THAT(offsets(out.inputs), ElementsAre(0, 1, 8, 16, 24));
  EXPECT_EQ(out.inputs.entries[3].variable_index, 0xA500);
  EXPECT_EQ(out.inputs.entries[3].variable_sub, 17);
  EXPECT_EQ(out.inputs.byte_size, 4U);
}

// A device with CANopenNode sends a BOOLEAN in a whole byte.
TEST_F(LinkTest, ABooleanInAByteIsItsLowestBit) {
  const LinkPlan out = plan({node(1, {pdo(1, 0x181, {0x20010008, 0x20010008, 0x20000008})})});
  EXPECT_THAT(offsets(out.inputs), ElementsAre(0, 1, 8));
  EXPECT_EQ(out.inputs.entries[0].bit_length, 1U);
  const LinkedPdo& rpdo = out.rpdos[0];
  ASSERT_EQ(rpdo.targets.size(), 3U);
  EXPECT_EQ(rpdo.targets[1].frame_bit, 8U);
  EXPECT_EQ(rpdo.targets[1].image_bit, 1U);
  EXPECT_EQ(rpdo.targets[1].bits, 1);
  EXPECT_EQ(rpdo.targets[2].frame_bit, 16U);
  EXPECT_EQ(rpdo.mapped_bits, 24);
  std::uint32_t shown = 0;
  for (const Mapping& mapping : rpdo.parameters.mapping) {
    shown += mapping.bits;
  }
  EXPECT_EQ(shown, 24U) << "the record of the manager has the length of the PDO";
}

TEST_F(LinkTest, NamesDiffer) {
  for (od::ObjectDescription& object : device.objects) {
    object.name = object.index == 0x6041 ? "Statusword" : "Value";
  }
  const LinkPlan out = plan({node(1, {pdo(1, 0x181, {0x20000008, 0x20020018, 0x60410010}),
                                      pdo(2, 0x281, {0x20000008, 0x20000008})}),
                             node(2, {pdo(1, 0x182, {0x20000008})})});
  std::vector<std::string> names;
  for (const image::Entry& entry : out.inputs.entries) {
    names.push_back(entry.name);
  }
  EXPECT_THAT(names, ElementsAre("drive1.Value 2000:00", "drive1.Value 2002:00",
                                 "drive1.Statusword", "drive1.Value 2000:00 in PDO 2",
                                 "drive1.Value 2000:00 in PDO 2 #2", "drive2.Value 2000:00"));
}

TEST_F(LinkTest, DummiesAreFillersOfTheFrame) {
  const LinkPlan out = plan({node(1, {pdo(1, 0x181, {0x00050008, 0x60410010})})});
  ASSERT_EQ(out.inputs.entries.size(), 1U);
  ASSERT_EQ(out.rpdos[0].targets.size(), 1U);
  EXPECT_EQ(out.rpdos[0].targets[0].frame_bit, 8U);
  EXPECT_EQ(out.rpdos[0].targets[0].image_bit, 0U);
  EXPECT_EQ(out.rpdos[0].mapped_bits, 24);
  ASSERT_EQ(out.rpdos[0].parameters.mapping.size(), 2U);
  EXPECT_EQ(out.rpdos[0].parameters.mapping[0].raw(), 0x00050008U);
  EXPECT_EQ(out.rpdos[0].parameters.mapping[1].raw(), 0xA5800110U);
}

TEST_F(LinkTest, TransmissionTypesAreThoseOfTheDevice) {
  std::vector<RemoteNode> nodes = {
      node(1,
           {pdo(1, 0x181, {0x60410010}, 0), pdo(2, 0x281, {0x60410010}, 240),
            pdo(3, 0x381, {0x60410010}, 253), pdo(4, 0x481, {0x60410010}, 254)},
           {pdo(1, 0x201, {0x20000008}, 5), pdo(2, 0x301, {0x20000008}, 255)})};
  nodes[0].deadline = std::chrono::milliseconds(300);
  nodes[0].pdos.rpdos[1].event_timer = std::chrono::milliseconds(101);
  const LinkPlan out = plan(nodes);
  EXPECT_EQ(out.rpdos[0].parameters.type, 0);
  EXPECT_EQ(out.rpdos[1].parameters.type, 240);
  EXPECT_EQ(out.rpdos[2].parameters.type, 255);
  EXPECT_EQ(out.rpdos[3].parameters.type, 255);
  EXPECT_EQ(out.rpdos[0].parameters.event_timer, std::chrono::milliseconds(300));
  EXPECT_EQ(out.tpdos[0].parameters.type, 5);
  EXPECT_EQ(out.tpdos[1].parameters.type, 255);
  EXPECT_EQ(out.tpdos[1].parameters.event_timer, std::chrono::milliseconds(50));
  EXPECT_EQ(out.tpdos[0].parameters.cob_id.raw, 0x40000201U);
}

TEST_F(LinkTest, TwoSendersOfOneCobIdAreAnError) {
  const Loaded<LinkPlan> out = plan_links(
      std::vector{node(1, {pdo(1, 0x181, {0x60410010})}), node(2, {pdo(3, 0x181, {0x60410010})})});
  EXPECT_FALSE(out.ok());
  ASSERT_EQ(out.diagnostics.size(), 1U);
  EXPECT_EQ(out.diagnostics[0].text, "TPDO 3 of drive2 has the COB-ID of TPDO 1 of drive1");
}

TEST_F(LinkTest, DevicesLinkedToEachOtherAreNoOutputs) {
  const Loaded<LinkPlan> out = plan_links(std::vector{node(1, {}, {pdo(1, 0x182, {0x20000008})}),
                                                      node(2, {pdo(1, 0x182, {0x20000008})})});
  ASSERT_TRUE(out.ok());
  EXPECT_TRUE(out.value->tpdos.empty());
  ASSERT_EQ(out.diagnostics.size(), 1U);
  EXPECT_EQ(out.diagnostics[0].severity, Severity::note);
}

TEST_F(LinkTest, ReceiversOfOneCobIdGetOneTpdo) {
  const Loaded<LinkPlan> out = plan_links(std::vector{node(1, {}, {pdo(1, 0x201, {0x20000008})}),
                                                      node(2, {}, {pdo(1, 0x201, {0x20000008})})});
  ASSERT_TRUE(out.ok());
  EXPECT_EQ(out.value->tpdos.size(), 1U);
  ASSERT_EQ(out.diagnostics.size(), 1U);
  EXPECT_EQ(out.diagnostics[0].severity, Severity::warning);
}

// 4 nodes x 512 TPDOs x 64 bytes (CAN FD) are 131,072 bytes.
TEST_F(LinkTest, AnAreaHasALimit) {
  const auto nodes = full_nodes(5, std::vector<std::uint32_t>(8, 0x20030040));
  const Loaded<LinkPlan> full = plan_links(std::span(nodes).first(4));
  ASSERT_TRUE(full.ok());
  EXPECT_EQ(full.value->inputs.byte_size, image::kMaxAreaBytes);
  const Loaded<LinkPlan> out = plan_links(nodes);
  EXPECT_FALSE(out.ok());
  EXPECT_THAT(out.diagnostics.back().text, HasSubstr("163840 bytes, more than 131072"));
}

// A sample of an image has no room for the times of more PDOs.
TEST_F(LinkTest, TheNumberOfPdosHasALimit) {
  const auto nodes = full_nodes(9, {0x20000008});
  ASSERT_TRUE(plan_links(std::span(nodes).first(8)).ok());
  const Loaded<LinkPlan> out = plan_links(nodes);
  EXPECT_FALSE(out.ok());
  EXPECT_EQ(out.diagnostics.back().text, "the inputs need 4608 PDOs, more than 4096");
}

TEST_F(LinkTest, TheNumberOfEntriesHasALimit) {
  const auto nodes = full_nodes(3, std::vector<std::uint32_t>(64, 0x20010001));
  ASSERT_TRUE(plan_links(std::span(nodes).first(2)).ok());
  const Loaded<LinkPlan> out = plan_links(nodes);
  EXPECT_FALSE(out.ok());
  EXPECT_EQ(out.diagnostics.back().text, "the inputs need 98304 entries, more than 65536");
}

TEST_F(LinkTest, BeyondTheNetworkVariablesThereIsOnlyTheImage) {
  std::vector<Parameters> tpdos;
  for (std::uint16_t n = 1; n <= 512; ++n) {
    tpdos.push_back(pdo(n, 0x2000'0000U + n, std::vector<std::uint32_t>(8, 0x20000008)));
  }
  std::vector<RemoteNode> nodes;
  for (std::uint8_t id = 1; id <= 5; ++id) {
    nodes.push_back(node(id, tpdos));
    for (Parameters& tpdo : nodes.back().pdos.tpdos) {
      tpdo.cob_id.raw += id * 1000U;
    }
  }
  const LinkPlan out = plan(nodes);
  const auto limit = 64U * 254U;
  EXPECT_NE(out.inputs.entries[limit - 1].variable_sub, 0);
  EXPECT_EQ(out.inputs.entries[limit].variable_sub, 0);
  EXPECT_EQ(out.rpdos[2050].parameters.mapping[0].raw(), 0x00050008U) << "shown as a filler";
  EXPECT_EQ(out.rpdos.back().parameters.number, 5 * 512);
}

TEST_F(LinkTest, TheManagersRecordsShowTheLinks) {
  const LinkPlan out =
      plan({node(1, {pdo(1, 0x181, {0x60410010, 0x20010001}, 3)}, {pdo(1, 0x201, {0x20000008})})});
  image::ProcessImage image(out.inputs, out.outputs);
  od::Dictionary dictionary;
  ASSERT_TRUE(add_linked_objects(dictionary, image, out).ok());
  EXPECT_EQ(dictionary.number({0x1400, 1}), 0x181U);
  EXPECT_EQ(dictionary.number({0x1400, 2}), 3U);
  EXPECT_EQ(dictionary.number({0x1600, 0}), 2U);
  EXPECT_EQ(dictionary.number({0x1600, 1}), 0xA5800110U);
  EXPECT_EQ(dictionary.number({0x1600, 2}), 0xA5001101U);
  EXPECT_EQ(dictionary.number({0x1800, 1}), 0x40000201U);
  EXPECT_EQ(dictionary.number({0x1A00, 1}), 0xA0400108U);
  EXPECT_TRUE(dictionary.has_object(0xA480));
  const std::array<std::byte, 4> invalid = {std::byte{0}, std::byte{0}, std::byte{0},
                                            std::byte{0x80}};
  EXPECT_EQ(dictionary.write({0x1400, 1}, invalid), AbortCode::read_only);
  EXPECT_EQ(dictionary.write({0x1600, 0}, std::array{std::byte{0}}), AbortCode::read_only);
}

}  // namespace
}  // namespace linegate::pdo
