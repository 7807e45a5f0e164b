// SPDX-License-Identifier: Apache-2.0
// A line beside a foreign master evaluates the SDO transfers of other nodes.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <vector>

#include "stack/base/byte_order.h"

#include "tests/stack/line/observer_fixture.h"

namespace linegate::line {
namespace {

using testing::ElementsAre;

// The response of the device to an expedited download.
class OverheardSdoTest : public ObserverTest {
 protected:
  void write(od::Address place, std::uint32_t value, unsigned bytes) {
    const auto b = [](std::uint32_t v, unsigned at) { return static_cast<std::uint8_t>(v >> at); };
    hear(0x605,
         {static_cast<std::uint8_t>(0x23U | (4U - bytes) << 2U), b(place.index, 0),
          b(place.index, 8), place.sub, b(value, 0), b(value, 8), b(value, 16), b(value, 24)});
    hear(0x585, {0x60, b(place.index, 0), b(place.index, 8), place.sub, 0, 0, 0, 0});
  }

  // Position first, then Status, with another COB-ID.
  void remap_tpdo() {
    write({0x1800, 1}, 0x8000'0185, 4);
    write({0x1A00, 0}, 0, 1);
    write({0x1A00, 1}, 0x2001'0020, 4);
    write({0x1A00, 2}, 0x2000'0010, 4);
    write({0x1A00, 0}, 2, 1);
    write({0x1800, 1}, 0x0000'0285, 4);
  }

  static LineConfig remapped() {
    LineConfig config = config_with_axis();
    const auto set = [&](od::Address place, std::uint64_t value) {
      for (od::ObjectDescription& object : config.nodes[0].device.objects) {
        for (od::VariableDescription& variable : object.variables) {
          if (od::Address{object.index, variable.sub} == place) {
            store_le(std::span(variable.value), value);
          }
        }
      }
    };
    set({0x1A00, 1}, 0x2001'0020);
    set({0x1A00, 2}, 0x2000'0010);
    set({0x1800, 1}, 0x0000'0285);
    return config;
  }

  static std::uint64_t managed_inputs(const LineConfig& config) {
    return (*Line::make(config).value)->layout(Direction::inputs).id;
  }
};

TEST_F(OverheardSdoTest, TransfersAndAbortsAreTold) {
  observe(config_with_axis());
  events();
  write({0x1017, 0}, 250, 2);
  const std::vector<Event> told = of(EventKind::sdo_transfer);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].node, 5);
  const auto& transfer = std::get<event::SdoTransfer>(told[0].data);
  EXPECT_TRUE(transfer.download) << "a download";
  EXPECT_EQ(transfer.size, 2U);
  EXPECT_EQ(transfer.index, 0x1017U);
  EXPECT_EQ(load_le<std::uint16_t>(transfer.data.data()), 250U);
  hear(0x605, {0x40, 0x18, 0x10, 0x01, 0, 0, 0, 0});
  hear(0x585, {0x80, 0x18, 0x10, 0x01, 0x11, 0x00, 0x09, 0x06});
  const std::vector<Event> aborted = of(EventKind::sdo_abort);
  ASSERT_EQ(aborted.size(), 1U);
  EXPECT_EQ(std::get<event::SdoAbort>(aborted[0].data).abort, AbortCode::no_sub_index);
}

// The transfers of a PLC that polls must not displace other events in the history for late
// subscribers.
TEST_F(OverheardSdoTest, ATransferThatIsRepeatedIsToldOnceASecond) {
  observe(config_with_axis());
  events();
  std::vector<Event> told;
  for (int i = 0; i < 250; ++i) {
    write({0x1017, 0}, static_cast<std::uint32_t>(i), 2);
    hear(0x605, {0x40, 0x18, 0x10, 0x01, 0, 0, 0, 0});
    hear(0x585, {0x80, 0x18, 0x10, 0x01, 0x11, 0x00, 0x09, 0x06});
    pass(milliseconds(10));
    std::ranges::copy(events(), std::back_inserter(told));
  }
  ASSERT_EQ(std::ranges::count(told, EventKind::sdo_transfer, &Event::kind), 3) << "once a second";
  ASSERT_EQ(std::ranges::count(told, EventKind::sdo_abort, &Event::kind), 3);
  const auto last =
      std::ranges::find(told.rbegin(), told.rend(), EventKind::sdo_transfer, &Event::kind);
  const auto& transfer = std::get<event::SdoTransfer>(last->data);
  EXPECT_TRUE(transfer.download) << "a download";
  EXPECT_EQ(transfer.suppressed, 99U) << "99 others were suppressed";
  EXPECT_EQ(load_le<std::uint16_t>(transfer.data.data()), 199U) << "the newest value";
}

TEST_F(OverheardSdoTest, ObjectsThatAreWrittenOnceAreToldOneByOne) {
  observe(config_with_axis());
  events();
  for (std::uint8_t sub = 1; sub <= 60; ++sub) {
    write({0x2100, sub}, sub, 4);
  }
  EXPECT_EQ(of(EventKind::sdo_transfer).size(), 60U);
}

TEST_F(OverheardSdoTest, ChannelsThatAMasterConfiguresAreFollowedFromThenOn) {
  observe(config_with_axis());
  const auto transfers_on = [&](std::uint32_t request, std::uint32_t response) {
    pass(seconds(1));  // transfers of the same object are reported once a second
    events();
    hear(request, {0x40, 0x18, 0x10, 0x04, 0, 0, 0, 0});
    hear(response, {0x43, 0x18, 0x10, 0x04, 0x4D, 0, 0, 0});
    return of(EventKind::sdo_transfer);
  };
  EXPECT_TRUE(transfers_on(0x6E5, 0x5E5).empty());
  write({0x1201, 1}, 0x6E5, 4);
  EXPECT_TRUE(transfers_on(0x6E5, 0x5E5).empty()) << "only one COB-ID was written";
  write({0x1201, 2}, 0x5E5, 4);
  const std::vector<Event> told = transfers_on(0x6E5, 0x5E5);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(told[0].node, 5);
  EXPECT_EQ(std::get<event::SdoTransfer>(told[0].data).index, 0x1018U);
  EXPECT_EQ(line_->node_state(5).serial, 77U) << "evaluated like the default SDO";
  EXPECT_EQ(transfers_on(0x605, 0x585).size(), 1U);
  hear(0x5E5, {1, 2, 3});
  EXPECT_EQ(of(EventKind::malformed_frame).size(), 1U);
  write({0x1202, 1}, 0x2000'0000 | 0x1234567, 4);
  write({0x1202, 2}, 0x6E6, 4);
  EXPECT_EQ(transfers_on(0x6E5, 0x5E5).size(), 1U) << "several SDO servers are followed";
  write({0x1201, 1}, 0x8000'06E5, 4);
  EXPECT_TRUE(transfers_on(0x6E5, 0x5E5).empty()) << "the SDO server is invalid";
}

TEST_F(OverheardSdoTest, ChannelsOfTheDeviceFileAreFollowedFromTheBegin) {
  LineConfig config = config_with_axis();
  const auto cob_id = [](std::uint8_t sub, std::uint32_t value) {
    od::VariableDescription out{.sub = sub, .type = od::DataType::unsigned32};
    out.value.resize(4);
    store_le(std::span(out.value), std::uint64_t{value});
    return out;
  };
  od::ObjectDescription server{.index = 0x1202};
  server.variables = {cob_id(1, 0x6E5), cob_id(2, 0x5E5)};
  auto& objects = config.nodes[0].device.objects;
  objects.insert(std::ranges::find_if(objects, [](const auto& o) { return o.index > 0x1202; }),
                 server);
  observe(config);
  const auto mapped_over = [&](std::uint32_t request, std::uint32_t response) {
    hear(request, {0x2B, 0x17, 0x10, 0x00, 0xFA, 0, 0, 0});
    hear(response, {0x60, 0x17, 0x10, 0x00, 0, 0, 0, 0});
    return of(EventKind::sdo_transfer).size();
  };
  EXPECT_EQ(mapped_over(0x6E5, 0x5E5), 1U);
  config.nodes[0].objects = {{{0x1202, 2}, {std::byte{0xE7}, std::byte{5}, {}, {}}}};
  observe(config);
  EXPECT_EQ(mapped_over(0x6E5, 0x5E5), 0U) << "the configuration has another COB-ID";
  EXPECT_EQ(mapped_over(0x6E5, 0x5E7), 1U);
}

TEST_F(OverheardSdoTest, AChannelThatIsTheDefaultOneIsFollowedOnce) {
  observe(config_with_axis());
  write({0x1201, 1}, 0x605, 4);
  write({0x1201, 2}, 0x585, 4);
  events();
  write({0x1017, 0}, 250, 2);
  EXPECT_EQ(of(EventKind::sdo_transfer).size(), 1U);
}

TEST_F(OverheardSdoTest, WhatIsReadOfTheIdentityIsShown) {
  observe(config_with_axis());
  hear(0x605, {0x40, 0x18, 0x10, 0x04, 0, 0, 0, 0});
  hear(0x585, {0x43, 0x18, 0x10, 0x04, 0x4D, 0, 0, 0});
  EXPECT_EQ(line_->node_state(5).serial, 77U);
}

TEST_F(OverheardSdoTest, ANewMappingMakesTheLayoutOfTheManagerThatWroteIt) {
  observe(config_with_axis());
  const std::uint64_t before = line_->layout(Direction::inputs).id;
  const std::uint64_t outputs = line_->layout(Direction::outputs).id;
  hear(0x205, {1, 2, 3, 4, 5});
  remap_tpdo();
  EXPECT_EQ(line_->layout(Direction::inputs).id, before) << "the node is still being configured";
  EXPECT_EQ(line_->layout_revision(), 0U);
  events();
  hear(0x000, {0x01, 0x05});
  EXPECT_EQ(line_->layout(Direction::inputs).id, managed_inputs(remapped()));
  EXPECT_NE(line_->layout(Direction::inputs).id, before);
  EXPECT_EQ(line_->layout(Direction::outputs).id, outputs);
  EXPECT_EQ(line_->layout_revision(), 1U);
  hear(0x285, {1, 2, 3, 4, 0x11, 0x22});
  const image::Snapshot inputs = snapshot(Direction::inputs);
  EXPECT_THAT(numbers(inputs), ElementsAre(1, 2, 3, 4, 0x11, 0x22));
  EXPECT_TRUE(inputs.is_valid(0));
  EXPECT_THAT(numbers(snapshot(Direction::outputs)), ElementsAre(1, 2, 3, 4, 5));
  expect_silence();
}

TEST_F(OverheardSdoTest, TheChangeIsToldOnce) {
  observe(config_with_axis());
  remap_tpdo();
  events();
  pass(seconds(2));
  std::vector<Event> all = events();
  std::erase_if(all, [](const Event& e) {
    return e.kind() != EventKind::pdo_mapping && e.kind() != EventKind::layout_changed;
  });
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].node, 5);
  EXPECT_EQ(all[0].data, EventData(event::PdoMapping{
                             .number = 1, .kind = pdo::PdoKind::tpdo, .complete = true}));
  EXPECT_EQ(all[1].data,
            EventData(event::LayoutChanged{.inputs = line_->layout(Direction::inputs).id,
                                           .outputs = line_->layout(Direction::outputs).id}));
  remap_tpdo();  // as the master does after each boot
  pass(seconds(2));
  EXPECT_TRUE(of(EventKind::layout_changed).empty());
}

// A PDO is invalid while it is being configured.
TEST_F(OverheardSdoTest, AStartOfAnotherNodeTakesNoHalfOfAConfiguration) {
  observe(config_with_axis());
  const std::uint64_t before = line_->layout(Direction::inputs).id;
  write({0x1800, 1}, 0x8000'0185, 4);
  hear(0x000, {0x01, 0x06});
  EXPECT_EQ(line_->layout(Direction::inputs).id, before);
  write({0x1800, 1}, 0x0000'0185, 4);
  hear(0x000, {0x01, 0x00});
  EXPECT_EQ(line_->layout(Direction::inputs).id, before);
  EXPECT_EQ(line_->layout_revision(), 0U);
  write({0x1800, 1}, 0x8000'0185, 4);
  hear(0x000, {0x01, 0x06});
  pass(seconds(2));
  EXPECT_NE(line_->layout(Direction::inputs).id, before) << "the PDO remains invalid";
  EXPECT_EQ(line_->layout_revision(), 1U);
}

// The first frame of the PDO shows that it is valid, although the NMT start of the node was not
// received.
TEST_F(OverheardSdoTest, AFrameOfAPdoThatIsWrittenEndsItsConfiguration) {
  observe(config_with_axis());
  remap_tpdo();
  hear(0x000, {0x01, 0x06});
  hear(0x285, {1, 2, 3, 4, 0x11, 0x22});
  EXPECT_EQ(line_->layout(Direction::inputs).id, managed_inputs(remapped()));
  EXPECT_THAT(numbers(snapshot(Direction::inputs)), ElementsAre(1, 2, 3, 4, 0x11, 0x22));
}

TEST_F(OverheardSdoTest, ARefusedWriteChangesNothing) {
  observe(config_with_axis());
  hear(0x605, {0x23, 0x00, 0x18, 0x01, 0x85, 0x01, 0x00, 0x80});
  hear(0x585, {0x80, 0x00, 0x18, 0x01, 0x00, 0x00, 0x00, 0x08});
  pass(seconds(2));
  EXPECT_EQ(line_->layout_revision(), 0U);
}

TEST_F(OverheardSdoTest, APdoThatIsSwitchedOffLeavesTheImage) {
  observe(config_with_axis());
  write({0x1800, 1}, 0x8000'0185, 4);
  pass(seconds(2));
  EXPECT_TRUE(line_->layout(Direction::inputs).entries.empty());
  const std::vector<Event> told = of(EventKind::pdo_mapping);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_FALSE(std::get<event::PdoMapping>(told[0].data).complete);
  image::Snapshot kept;
  line_->snapshot(Direction::inputs, kept, now_, false);
  write({0x1800, 1}, 0x0000'0185, 4);
  hear(0x185, {1, 2, 3, 4, 5, 6});
  EXPECT_EQ(line_->layout(Direction::inputs).id, managed_inputs(config_with_axis()))
      << "after the first frame of the PDO";
  EXPECT_TRUE(snapshot(Direction::inputs).is_valid(0));
}

TEST_F(OverheardSdoTest, SnapshotsOfALayoutThatComesBackAreNotTakenForNewOnes) {
  observe(config_with_axis());
  image::Snapshot kept;
  for (std::uint8_t i = 1; i < 20; ++i) {
    hear(0x185, {i, 0, 0, 0, 0, 0});
    line_->snapshot(Direction::inputs, kept, now_, false);
  }
  write({0x1800, 1}, 0x8000'0185, 4);
  pass(seconds(2));
  write({0x1800, 1}, 0x0000'0185, 4);
  hear(0x185, {99, 0, 0, 0, 0, 0});
  EXPECT_TRUE(line_->image_changed(Direction::inputs));
  line_->snapshot(Direction::inputs, kept, now_, false);
  EXPECT_EQ(kept.bytes, snapshot(Direction::inputs).bytes);
  EXPECT_EQ(kept.bytes[0], std::byte{99});
}

TEST_F(OverheardSdoTest, AMappingThatNobodyUnderstandsIsPublishedAsItIs) {
  observe(config_with_axis());
  write({0x1800, 1}, 0x8000'0185, 4);
  write({0x1A00, 0}, 0, 1);
  write({0x1A00, 1}, 0x5FFF'0120, 4);  // an object that its file does not have
  write({0x1A00, 0}, 1, 1);
  write({0x1800, 1}, 0x0000'0185, 4);
  hear(0x000, {0x01, 0x05});
  EXPECT_TRUE(line_->layout(Direction::inputs).entries.empty()) << "the length is unknown";
  hear(0x185, {1, 2, 3, 4, 5});
  const image::Layout& layout = line_->layout(Direction::inputs);
  ASSERT_EQ(layout.entries.size(), 1U);
  EXPECT_EQ(layout.entries[0].name, "axis.COB-ID 185h");
  EXPECT_EQ(layout.entries[0].bit_length, 40);
  EXPECT_EQ(layout.entries[0].node, 5);
  EXPECT_EQ(layout.entries[0].remote_pdo, 1);
  EXPECT_EQ(layout.entries[0].index, 0);
  const image::Snapshot inputs = snapshot(Direction::inputs);
  EXPECT_TRUE(inputs.is_valid(0));
  EXPECT_EQ(inputs.bytes[0], std::byte{1});
  EXPECT_EQ(inputs.bytes[4], std::byte{5});
  EXPECT_EQ(line_->state().counters.rpdos, 1U);
}

TEST_F(OverheardSdoTest, APdoThatWasConfiguredBeforeAnybodyListenedIsPublishedAsItIs) {
  observe(config_with_axis());
  for (int i = 0; i < 2; ++i) {
    hear(0x385, {1, 2});
    hear(0x485, {1, 2});
    hear(0x485, {1, 2});  // a repetition by the controller
    hear(0x306, {1, 2});  // of a node that is not configured
    pass(milliseconds(10));
  }
  hear(0x306, {1, 2});
  EXPECT_EQ(line_->layout_revision(), 0U);
  hear(0x385, {7, 8});
  const image::Layout& layout = line_->layout(Direction::inputs);
  ASSERT_EQ(layout.entries.size(), 3U);
  EXPECT_EQ(layout.entries[2].name, "axis.COB-ID 385h");
  EXPECT_EQ(layout.entries[2].remote_pdo, 3);
  EXPECT_TRUE(snapshot(Direction::inputs).is_valid(2));
  EXPECT_FALSE(snapshot(Direction::inputs).is_valid(0));
  const std::vector<Event> told = of(EventKind::pdo_mapping);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_EQ(std::get<event::PdoMapping>(told[0].data).number, 3U);
  EXPECT_FALSE(std::get<event::PdoMapping>(told[0].data).complete);
}

TEST_F(OverheardSdoTest, APdoThatComesFasterThanRepetitionsIsPublishedToo) {
  observe(config_with_axis());
  for (int i = 0; i < 7 && line_->layout_revision() == 0; ++i) {
    hear(0x385, {1, 2});
    pass(std::chrono::microseconds(400));
  }
  EXPECT_EQ(line_->layout(Direction::inputs).entries.size(), 3U);
}

// CiA 301, 7.3.2.2.1: a reset restores the stored parameters. The master writes its own ones again.
TEST_F(OverheardSdoTest, AResetEndsAMappingAndTheSameConfigurationBringsItBack) {
  observe(config_with_axis());
  remap_tpdo();
  hear(0x000, {0x01, 0x05});
  const std::uint64_t remapped_layout = line_->layout(Direction::inputs).id;
  hear(0x285, {1, 2, 3, 4, 0x11, 0x22});
  ASSERT_TRUE(snapshot(Direction::inputs).is_valid(0));
  for (const std::uint8_t command : {std::uint8_t{0x81}, std::uint8_t{0x82}}) {
    hear(0x000, {command, 0x05});
    hear(0x285, {9, 9, 9, 9, 9, 9});  // queued before the reset, or not
    EXPECT_FALSE(snapshot(Direction::inputs).is_valid(0));
    hear(0x705, {0x00});
    hear(0x285, {9, 9, 9, 9, 9, 9});
    EXPECT_FALSE(snapshot(Direction::inputs).is_valid(0));
    EXPECT_EQ(line_->layout(Direction::inputs).id, remapped_layout);
    remap_tpdo();
    pass(seconds(5));
    hear(0x705, {0x7F});
    hear(0x000, {0x01, 0x05});
    hear(0x285, {1, 2, 3, 4, 0x11, 0x22});
    EXPECT_TRUE(snapshot(Direction::inputs).is_valid(0));
    EXPECT_THAT(numbers(snapshot(Direction::inputs)), ElementsAre(1, 2, 3, 4, 0x11, 0x22));
    EXPECT_EQ(line_->layout_revision(), 1U) << "no other layout was published meanwhile";
  }
}

TEST_F(OverheardSdoTest, ADeviceThatIsNotConfiguredAgainHasTheMappingOfItsFile) {
  observe(config_with_axis());
  remap_tpdo();
  hear(0x000, {0x01, 0x05});
  hear(0x705, {0x00});
  hear(0x185, {0x11, 0x22, 1, 2, 3, 4});
  EXPECT_EQ(line_->layout(Direction::inputs).id, managed_inputs(config_with_axis()))
      << "after the first frame of the PDO";
  EXPECT_TRUE(snapshot(Direction::inputs).is_valid(0));
  EXPECT_EQ(line_->layout_revision(), 2U);
  remap_tpdo();
  hear(0x000, {0x01, 0x05});
  hear(0x705, {0x00});
  hear(0x000, {0x01, 0x00});
  EXPECT_EQ(line_->layout(Direction::inputs).id, managed_inputs(config_with_axis()))
      << "after its NMT start";
}

TEST_F(OverheardSdoTest, AStoredMappingIsValidAfterAReset) {
  observe(config_with_axis());
  remap_tpdo();
  write({0x1010, 1}, 0x6576'6173, 4);
  hear(0x000, {0x01, 0x05});
  hear(0x000, {0x82, 0x00});
  hear(0x705, {0x00});
  hear(0x285, {1, 2, 3, 4, 0x11, 0x22});
  EXPECT_THAT(numbers(snapshot(Direction::inputs)), ElementsAre(1, 2, 3, 4, 0x11, 0x22));
  EXPECT_TRUE(snapshot(Direction::inputs).is_valid(0));
  EXPECT_EQ(line_->layout_revision(), 1U);
}

// A PLC may send its RPDOs always, to nodes that it configures, too.
TEST_F(OverheardSdoTest, OutputsToANodeThatIsConfiguredAgainAreNotShownWithTheOldMapping) {
  observe(config_with_axis());
  const auto map_mode_alone = [&] {
    write({0x1600, 0}, 0, 1);
    write({0x1600, 1}, 0x2003'0008, 4);
    write({0x1600, 0}, 1, 1);
  };
  map_mode_alone();
  hear(0x000, {0x01, 0x05});
  hear(0x705, {0x05});
  hear(0x205, {7});
  EXPECT_THAT(numbers(snapshot(Direction::outputs)), ElementsAre(7));
  EXPECT_TRUE(snapshot(Direction::outputs).is_valid(0));
  const std::uint64_t revision = line_->layout_revision();
  hear(0x705, {0x00});
  hear(0x205, {8});
  EXPECT_FALSE(snapshot(Direction::outputs).is_valid(0));
  EXPECT_EQ(line_->layout_revision(), revision);
  map_mode_alone();
  hear(0x205, {9});
  EXPECT_EQ(line_->layout_revision(), revision);
  hear(0x000, {0x01, 0x05});
  hear(0x705, {0x05});
  hear(0x205, {10});
  EXPECT_THAT(numbers(snapshot(Direction::outputs)), ElementsAre(10));
  EXPECT_TRUE(snapshot(Direction::outputs).is_valid(0));
  EXPECT_EQ(line_->layout_revision(), revision);
  hear(0x705, {0x00});
  hear(0x705, {0x05});
  hear(0x205, {1, 2, 3, 4, 5});
  EXPECT_THAT(numbers(snapshot(Direction::outputs)), ElementsAre(1, 2, 3, 4, 5))
      << "it was started without a configuration";
  EXPECT_TRUE(snapshot(Direction::outputs).is_valid(0));
}

TEST_F(OverheardSdoTest, AResetOfOneNodeLeavesOthersAlone) {
  LineConfig config = config_with_axis();
  config.nodes.push_back(config.nodes[0]);
  config.nodes[1].id = 6;
  config.nodes[1].name = "other";
  config.nodes[1].device = *eds::load(kDeviceFile, "axis.eds", 6).value;
  observe(config);
  remap_tpdo();
  hear(0x000, {0x01, 0x00});
  hear(0x285, {1, 2, 3, 4, 0x11, 0x22});
  hear(0x186, {1, 2, 3, 4, 5, 6});
  hear(0x705, {0x00});
  const image::Snapshot inputs = snapshot(Direction::inputs);
  ASSERT_EQ(line_->layout(Direction::inputs).entries.size(), 4U);
  EXPECT_FALSE(inputs.is_valid(0));
  EXPECT_FALSE(inputs.is_valid(1));
  EXPECT_TRUE(inputs.is_valid(2));
  EXPECT_TRUE(inputs.is_valid(3));
  hear(0x000, {0x81, 0x06});
  hear(0x285, {1, 2, 3, 4, 0x11, 0x22});
  EXPECT_FALSE(snapshot(Direction::inputs).is_valid(0)) << "node 5 is still not configured";
}

TEST_F(OverheardSdoTest, TheIdentifierOfEmcysMayMove) {
  observe(config_with_axis());
  write({0x1014, 0}, 0x0000'00F5, 4);
  hear(0x0F5, {0x10, 0x81, 0x11, 1, 2, 3, 4, 5});
  EXPECT_EQ(line_->node_state(5).last_emcy, 0x8110);
}

// With the boot-up message the node has its stored COB-ID again.
TEST_F(OverheardSdoTest, TheIdentifierOfEmcysIsTheStoredOneAfterAReset) {
  observe(config_with_axis());
  write({0x1014, 0}, 0x0000'00F5, 4);
  hear(0x705, {0x00});
  hear(0x0F5, {0x10, 0x81, 0x11, 1, 2, 3, 4, 5});
  EXPECT_EQ(line_->node_state(5).emcy_count, 0U);
  hear(0x085, {0x10, 0x81, 0x11, 1, 2, 3, 4, 5});
  EXPECT_EQ(line_->node_state(5).emcy_count, 1U);
  write({0x1014, 0}, 0x0000'00F5, 4);
  write({0x1010, 1}, 0x6576'6173, 4);
  hear(0x705, {0x00});
  hear(0x0F5, {0x10, 0x81, 0x11, 1, 2, 3, 4, 5});
  EXPECT_EQ(line_->node_state(5).emcy_count, 2U);
  hear(0x605, {0x40, 0x14, 0x10, 0, 0, 0, 0, 0});
  hear(0x585, {0x43, 0x14, 0x10, 0, 0xF6, 0, 0, 0});
  hear(0x705, {0x00});
  hear(0x0F6, {0x10, 0x81, 0x11, 1, 2, 3, 4, 5});
  EXPECT_EQ(line_->node_state(5).emcy_count, 3U) << "read after the boot-up: it is stored";
}

TEST_F(OverheardSdoTest, ChannelsThatAMasterConfiguresEndWithAReset) {
  observe(config_with_axis());
  const auto transfers_on_it = [this] {
    pass(seconds(1));  // transfers of the same object are reported once a second
    events();
    hear(0x6E5, {0x40, 0x18, 0x10, 0x04, 0, 0, 0, 0});
    hear(0x5E5, {0x43, 0x18, 0x10, 0x04, 0x4D, 0, 0, 0});
    return of(EventKind::sdo_transfer).size();
  };
  write({0x1201, 1}, 0x6E5, 4);
  write({0x1201, 2}, 0x5E5, 4);
  EXPECT_EQ(transfers_on_it(), 1U);
  hear(0x705, {0x00});
  EXPECT_EQ(transfers_on_it(), 0U);
  write({0x1201, 1}, 0x6E5, 4);
  write({0x1201, 2}, 0x5E5, 4);
  write({0x1010, 2}, 0x6576'6173, 4);
  hear(0x705, {0x00});
  EXPECT_EQ(transfers_on_it(), 1U);
}

}  // namespace
}  // namespace linegate::line
