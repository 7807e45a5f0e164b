// SPDX-License-Identifier: Apache-2.0
// The path of a frame allocates no memory: operator new counts.
#include <algorithm>

#include <gtest/gtest.h>

#include "tests/bench/allocations.h"
#include "tests/stack/pdo/device_fixture.h"
#include "tests/stack/pdo/linked_fixture.h"

namespace linegate::pdo {
namespace {

using namespace test;

TEST(Allocations, NoneFromFrameToSnapshotAndFromValueToFrame) {
  const od::DeviceDescription device = plain_device();
  std::vector<RemoteNode> nodes;
  for (std::uint8_t id = 1; id <= 40; ++id) {
    RemoteNode node;
    node.id = id;
    node.device = &device;
    node.deadline = std::chrono::milliseconds(5);
    const std::uint8_t type = id % 2 == 0 ? 1 : 255;
    node.pdos.tpdos = {remote_pdo(1, 0x180U + id, {0x20020008, 0x20030010, 0x20000001}, type)};
    node.pdos.rpdos = {remote_pdo(1, 0x200U + id, {0x20020008, 0x20030010}, type)};
    node.pdos.rpdos[0].event_timer = std::chrono::milliseconds(8);
    nodes.push_back(node);
  }
  Manager manager(nodes);
  for (LinkedPdo& pdo : manager.plan.rpdos) {
    pdo.queue = pdo.node % 4 == 3 ? 4 : 0;
  }
  manager.engine->link(manager.plan);
  ASSERT_TRUE(manager.engine->configure().empty());
  image::Snapshot outputs;
  (void)manager.snapshot();
  manager.image->snapshot(image::Direction::outputs, outputs, at(0), false, 0);
  EventLog& events = manager.events;
  std::vector<Event> drained(64);
  const std::uint64_t before = bench::allocations();
  std::uint64_t sent = 0;
  std::uint64_t queued = 0;
  for (int ms = 1; ms <= 500; ++ms) {
    const auto value = static_cast<std::uint8_t>(ms);
    for (std::uint32_t id = 1; id <= 40; ++id) {
      if ((ms + static_cast<int>(id)) % 7 != 0) {
        manager.receive(frame(0x180 + id, {value, 0, value, 1}, at(ms)));
      }
    }
    manager.receive(frame(0x181, {value}, at(ms)));
    for (std::uint32_t entry = 0; entry < manager.plan.outputs.entries.size(); ++entry) {
      manager.image->write_entry(image::Direction::outputs, entry, value);
    }
    manager.engine->outputs_written(0, 8 * manager.plan.outputs.byte_size, false, at(ms));
    manager.engine->sync(0, at(ms));
    manager.engine->advance(at(ms));
    can::Frame out;
    while (manager.engine->next_frame(out, at(ms), sent + 1)) {
      ++sent;
    }
    manager.engine->acknowledged(sent - std::min<std::uint64_t>(sent, 2));
    manager.engine->lost(sent, sent);
    while (events.take(drained) != 0) {
    }
    for (Reception reception; ms % 10 == 0 && manager.engine->pop_reception(reception);) {
      ++queued;
    }
    manager.image->set_node_valid(static_cast<std::uint8_t>(1 + ms % 40), false);
    (void)manager.snapshot(ms % 3 == 0);
    manager.image->snapshot(image::Direction::outputs, outputs, at(ms), ms % 5 == 0, 0);
  }
  EXPECT_EQ(bench::allocations(), before);
  EXPECT_GT(sent, 1000U);
  EXPECT_GT(queued, 1000U);
  EXPECT_GT(manager.engine->counters().receptions_lost, 0U);
}

TEST(Allocations, NoneFromAWrittenValueToItsFrame) {
  od::DeviceDescription description = plain_device();
  for (std::uint16_t n = 1; n <= 64; ++n) {
    add_tpdo(description, {.number = n,
                           .cob_id = 0x180U + n,
                           .type = static_cast<std::uint8_t>(n % 4 == 0 ? 0 : 255),
                           .mapping = {0x20030010, 0x20020008}});
  }
  Device device(description);
  device.engine->set_listener(nullptr);  // the listener records its calls, which allocates
  device.engine->set_auto_notify(true);
  device.operational();
  can::Frame out;
  while (device.engine->next_frame(out, at(0))) {
  }
  const std::uint64_t before = bench::allocations();
  std::uint64_t sent = 0;
  for (int ms = 1; ms <= 500; ++ms) {
    device.dictionary.set({0x2003, 0}, ms);
    const std::byte raw{static_cast<unsigned char>(ms)};
    EXPECT_EQ(device.dictionary.write({0x2002, 0}, {&raw, 1}), AbortCode::none);
    device.engine->sync(0, at(ms));
    device.engine->advance(at(ms));
    while (device.engine->next_frame(out, at(ms))) {
      ++sent;
    }
  }
  EXPECT_EQ(bench::allocations(), before);
  EXPECT_EQ(sent, 64U * 500U);
}

}  // namespace
}  // namespace linegate::pdo
