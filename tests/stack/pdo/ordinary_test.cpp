// SPDX-License-Identifier: Apache-2.0
// The fast path and the slow path of a frame have the same result: two managers receive the same
// frames, and one of them has a listener for every frame, which forces the slow path.
#include <gtest/gtest.h>

#include "tests/stack/pdo/linked_fixture.h"

namespace linegate::pdo {
namespace {

using namespace test;

constexpr std::uint32_t kPdos = 24;
constexpr std::uint16_t kShared = 3;  // the PDO whose identifier another service also receives

std::uint32_t id_of(std::uint32_t pdo) {
  return 0x181U + pdo;
}

// PDO 1 of nodes 1, 2, ...: with all kinds of lengths, positions and types; some with a deadline.
std::vector<RemoteNode> nodes(const od::DeviceDescription& device) {
  const std::vector<std::vector<std::uint32_t>> mappings = {
      {0x20030010, 0x20020008, 0x20000001},              // ends within a byte
      {0x20060040},                                      // 8 bytes
      {0x20000001, 0x20030010},                          // not aligned to bytes
      {0x20020008, 0x20050020, 0x20030010, 0x20020008},  // 8 bytes in 4 values
      {0x20000001}};
  std::vector<RemoteNode> out;
  for (std::uint32_t pdo = 0; pdo < kPdos; ++pdo) {
    RemoteNode node;
    node.id = static_cast<std::uint8_t>(pdo + 1);
    node.device = &device;
    if (pdo % 4 == 0) {
      node.deadline = std::chrono::milliseconds(15);
    }
    node.pdos.tpdos = {
        remote_pdo(1, id_of(pdo), mappings[pdo % mappings.size()], pdo % 3 == 0 ? 1 : 255)};
    out.push_back(node);
  }
  return out;
}

struct SharedManager : Manager {
  explicit SharedManager(const od::DeviceDescription& device) : Manager(nodes(device)) {
    dispatch.add(id_of(kShared), false, can::Service::rpdo, kShared + 1);
  }
};

// Mostly valid, sometimes too long, too short, remote, or with an unknown identifier.
can::Frame any_frame(Random& random, Instant time) {
  const std::uint32_t pdo = random() % (kPdos + 1);
  constexpr std::uint8_t kLengths[] = {4, 8, 3, 8, 1};
  can::Frame out;
  out.id = id_of(pdo);
  out.time = time;
  out.length = kLengths[pdo % std::size(kLengths)];
  random.fill(out.data);
  switch (random() % 16) {
    case 0:
      out.length = static_cast<std::uint8_t>(random() % 9);
      break;
    case 1:
      out.flags = can::Frame::kRemote;
      break;
    case 2:
      out.flags = can::Frame::kExtended;
      break;
    default:
      break;
  }
  return out;
}

bool same(const Event& a, const Event& b) {
  return a.time == b.time && a.node == b.node && a.data == b.data;
}

void expect_same(Manager& a, Manager& b) {
  const image::Snapshot& of_a = a.snapshot();
  const image::Snapshot& of_b = b.snapshot();
  ASSERT_EQ(of_a.bytes, of_b.bytes);
  ASSERT_EQ(of_a.changed, of_b.changed);
  ASSERT_EQ(of_a.valid, of_b.valid);
  ASSERT_EQ(of_a.marks.size(), of_b.marks.size());
  for (std::size_t i = 0; i < of_a.marks.size(); ++i) {
    ASSERT_EQ(of_a.marks[i].local_pdo, of_b.marks[i].local_pdo);
    ASSERT_EQ(of_a.marks[i].count, of_b.marks[i].count);
    ASSERT_EQ(of_a.marks[i].time, of_b.marks[i].time);
  }
  std::vector<Event> events_a(4096);
  std::vector<Event> events_b(4096);
  events_a.resize(a.events.take(events_a));
  events_b.resize(b.events.take(events_b));
  ASSERT_EQ(events_a.size(), events_b.size());
  for (std::size_t i = 0; i < events_a.size(); ++i) {
    ASSERT_TRUE(same(events_a[i], events_b[i])) << i;
  }
  const EngineCounters& count_a = a.engine->counters();
  const EngineCounters& count_b = b.engine->counters();
  ASSERT_EQ(count_a.received, count_b.received);
  ASSERT_EQ(count_a.too_short, count_b.too_short);
  ASSERT_EQ(count_a.too_long, count_b.too_long);
  ASSERT_EQ(a.traffic.frames, b.traffic.frames);
  ASSERT_EQ(a.traffic.extended, b.traffic.extended);
  ASSERT_EQ(a.traffic.bytes, b.traffic.bytes);
}

TEST(OrdinaryFrames, HaveTheEffectOfAnyFrame) {
  const od::DeviceDescription device = plain_device();
  SharedManager short_way(device);
  SharedManager long_way(device);
  Listener listener;
  long_way.engine->set_listener(&listener);
  Random random(11);
  std::int64_t ms = 0;
  std::uint64_t all = 0;
  for (int round = 0; round < 2000; ++round) {
    std::vector<can::Frame> batch;
    for (std::uint32_t i = random() % 40; i > 0; --i) {
      batch.push_back(any_frame(random, at(++ms)));
    }
    ms += random() % 8 == 0 ? 40 : 0;
    const bool sync = random() % 2 == 0;
    const auto gone = static_cast<std::uint8_t>(random() % (2 * kPdos) + 1);
    for (Manager* manager : {&short_way, &long_way}) {
      manager->receive(batch);
      if (sync) {
        manager->engine->sync(0, at(ms));
      }
      manager->engine->advance(at(ms));
      if (gone <= kPdos) {
        manager->image->set_node_valid(gone, false);
      }
    }
    all += batch.size();
    expect_same(short_way, long_way);
    if (HasFatalFailure()) {
      FAIL() << "round " << round;
    }
  }
  EXPECT_EQ(long_way.by_short_way, 0U);
  EXPECT_GT(short_way.by_short_way, all / 3) << "too few frames on the fast path";
}

TEST(OrdinaryFrames, EndAtTheFirstFrameThatIsNot) {
  const od::DeviceDescription device = plain_device();
  SharedManager manager(device);
  const can::Frame good = frame(id_of(1), {1, 2, 3, 4, 5, 6, 7, 8}, at(1));
  manager.receive(std::span(&good, 1));  // the first frame after invalidity takes the slow path
  can::Frame remote = good;
  remote.flags = can::Frame::kRemote;
  can::Frame extended = good;
  extended.flags = can::Frame::kExtended;
  const can::Frame others[] = {remote, extended, frame(id_of(1), {1, 2, 3}, at(2)),
                               frame(id_of(kShared), {1}, at(2)), frame(0x7FF, {}, at(2))};
  for (const can::Frame& other : others) {
    const can::Frame batch[] = {good, good, other, good};
    can::Traffic traffic;
    EXPECT_EQ(manager.engine->receive_ordinary(batch, traffic), 2U);
    EXPECT_EQ(traffic.frames, 2U);
    EXPECT_EQ(traffic.bytes, 16U);
  }
}

}  // namespace
}  // namespace linegate::pdo
