// SPDX-License-Identifier: Apache-2.0
// Requests for PDOs: remote frames in both directions, groups of writes.
#include <algorithm>
#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/stack/pdo/device_fixture.h"

namespace linegate::pdo {
namespace {

using namespace test;
using testing::ElementsAre;
using testing::IsEmpty;

struct Requested : Device {
  Requested(const std::vector<Pdo>& rpdos, const std::vector<Pdo>& tpdos)
      : Device(description(rpdos, tpdos)) {
    EXPECT_THAT(diagnostics, IsEmpty());
    operational();
    (void)sent(at(0));
  }
  static od::DeviceDescription description(const std::vector<Pdo>& rpdos,
                                           const std::vector<Pdo>& tpdos) {
    od::DeviceDescription out = plain_device();
    for (const Pdo& pdo : rpdos) {
      add_rpdo(out, pdo);
    }
    for (const Pdo& pdo : tpdos) {
      add_tpdo(out, pdo);
    }
    return out;
  }
  void set(std::uint16_t index, std::uint64_t value, Instant now) {
    EXPECT_TRUE(dictionary.set({index, 0}, value));
    engine->value_changed({index, 0}, now);
  }
};

can::Frame remote(std::uint32_t id) {
  can::Frame out;
  out.id = id;
  out.flags = can::Frame::kRemote;
  return out;
}

// The bus requests a frame from an engine that is not quiet.
TEST(Quiet, IsAnEngineOfWhichNothingIsRequested) {
  Requested device({{.cob_id = 0x201, .mapping = {0x20030010}}},
                   {{.cob_id = 0x181, .inhibit = 100, .mapping = {0x20050020}}});
  EXPECT_TRUE(device.engine->quiet());
  device.set(0x2005, 1, at(0));
  EXPECT_FALSE(device.engine->quiet());  // although the inhibit time delays it
  EXPECT_THAT(device.sent(at(5)), IsEmpty());
  EXPECT_FALSE(device.engine->quiet());
  EXPECT_TRUE(device.engine->request_rpdo(1));
  EXPECT_TRUE(device.engine->request_rpdo(1));
  EXPECT_THAT(device.sent_ids(at(5)), ElementsAre(0x201));
  EXPECT_THAT(device.sent_ids(at(10)), ElementsAre(0x181));
  EXPECT_TRUE(device.engine->quiet());
}

TEST(Quiet, IsAnEngineThatLeftOperationalOrWasConfiguredAnew) {
  Requested device({{.cob_id = 0x201, .mapping = {0x20030010}}},
                   {{.cob_id = 0x181, .mapping = {0x20050020}}});
  device.set(0x2005, 1, at(0));
  EXPECT_TRUE(device.engine->request_rpdo(1));
  device.engine->set_operational(false, at(1));
  EXPECT_TRUE(device.engine->quiet());
  device.engine->set_operational(true, at(2));  // requests every event-driven TPDO
  EXPECT_FALSE(device.engine->quiet());
  EXPECT_TRUE(device.engine->request_rpdo(1));
  (void)device.engine->configure();
  EXPECT_THAT(device.sent_ids(at(3)), ElementsAre(0x181));
  EXPECT_TRUE(device.engine->quiet());
}

// Each of the 256 transmission types in the device file: when such a TPDO is sent.
TEST(TransmissionType, OfATpdoSaysWhatSendsIt) {
  for (unsigned type = 0; type <= 255; ++type) {
    const bool reserved = type > 240 && type < 252;
    const bool event_driven = type >= 254;
    const bool cyclic = type >= 1 && type <= 240;
    od::DeviceDescription description = plain_device();
    add_tpdo(description,
             {.cob_id = 0x181, .type = static_cast<std::uint8_t>(type), .mapping = {0x20030010}});
    Device device(description);
    EXPECT_EQ(device.diagnostics.size(), reserved ? 1U : 0U) << type;
    device.operational();
    EXPECT_EQ(device.sent(at(0)).size(), event_driven ? 1U : 0U) << type;
    unsigned at_sync = 0;
    for (int i = 0; i < 240; ++i) {
      device.engine->sync(0, at(1));
      at_sync += static_cast<unsigned>(device.sent(at(1)).size());
    }
    EXPECT_EQ(at_sync, cyclic ? 240 / type : type == 0 ? 1 : 0) << type;
    ASSERT_TRUE(device.dictionary.set({0x2003, 0}, 0x55));
    device.engine->value_changed({0x2003, 0}, at(2));
    EXPECT_EQ(device.sent(at(2)).size(), event_driven ? 1U : 0U) << type;
    device.receive(remote(0x181));
    EXPECT_EQ(device.sent(at(3)).size(), reserved ? 0U : 1U) << type;
  }
}

// CiA 301 7.5.2.37: 252 buffers the values of each SYNC. Without a SYNC nothing is buffered.
TEST(RemoteFrame, IsAnsweredWithTheNewestValueUntilTheFirstSync) {
  Requested device({}, {{.cob_id = 0x181, .type = kRtrOnSync, .mapping = {0x20030010}}});
  const auto answer = [&](std::uint8_t value, int time) {
    device.set(0x2003, value, at(time));
    device.receive(remote(0x181));
    const std::vector<can::Frame> frames = device.sent(at(time));
    return frames.size() == 1 ? std::to_integer<int>(frames[0].data[0]) : -1;
  };
  EXPECT_EQ(answer(1, 1), 1);
  EXPECT_EQ(answer(2, 2), 2);
  device.engine->sync(0, at(3));
  EXPECT_EQ(answer(3, 4), 2) << "the value at the last SYNC";
  device.engine->sync(0, at(5));
  EXPECT_EQ(answer(4, 6), 3);
}

// A frame never has older values than those of the last SYNC, however long the bus is busy.
TEST(TransmissionType, ThatIsSynchronousSamplesAnewWhatStillWaitsAtTheNextSync) {
  for (const std::uint8_t type : std::array<std::uint8_t, 3>{0, 1, 3}) {
    Requested device({}, {{.cob_id = 0x181, .type = type, .mapping = {0x20030010}}});
    device.set(0x2003, 1, at(1));
    for (int i = 0; i < std::max<int>(type, 1); ++i) {
      device.engine->sync(0, at(2));
    }
    device.set(0x2003, 2, at(3));
    device.engine->sync(0, at(4));
    const std::vector<can::Frame> frames = device.sent(at(5));
    ASSERT_EQ(frames.size(), 1U) << int{type};
    EXPECT_EQ(frames[0].data[0], std::byte{2}) << int{type};
  }
}

// An own SYNC that was not sent immediately: its PDOs are sampled when it is sent.
TEST(TransmissionType, ThatIsSynchronousSamplesAnewWhenItsSyncIsHandedOut) {
  for (const std::uint8_t type : std::array<std::uint8_t, 4>{0, 1, 3, 252}) {
    Requested device({}, {{.cob_id = 0x181, .type = type, .mapping = {0x20030010}}});
    device.set(0x2003, 1, at(1));
    for (int i = 0; i < std::max<int>(type == 252 ? 1 : type, 1); ++i) {
      device.engine->sync(0, at(2));
    }
    device.set(0x2003, 2, at(3));
    device.engine->sync_handed_out(at(4));
    device.set(0x2003, 3, at(5));
    if (type == 252) {
      device.receive(remote(0x181));
    }
    const std::vector<can::Frame> frames = device.sent(at(5));
    ASSERT_EQ(frames.size(), 1U) << int{type};
    EXPECT_EQ(frames[0].data[0], std::byte{2}) << int{type};
  }
}

TEST(TransmissionType, ThatIsSynchronousSendsWhatCameUpWhileItsSyncWaited) {
  Requested device({}, {{.cob_id = 0x181, .type = 0, .mapping = {0x20030010}},
                        {.number = 2, .cob_id = 0x281, .type = 2, .mapping = {0x20030010}}});
  device.engine->sync(0, at(1));
  device.set(0x2003, 2, at(2));
  device.engine->sync_handed_out(at(3));
  EXPECT_THAT(device.sent_ids(at(3)), ElementsAre(0x181))
      << "the other TPDO waits for another SYNC";
  device.engine->sync(0, at(4));
  EXPECT_THAT(device.sent_ids(at(4)), ElementsAre(0x281));
}

TEST(TransmissionType, OfAnRpdoSaysWhenItIsTakenOver) {
  for (unsigned type = 0; type <= 255; ++type) {
    const bool reserved = type > 240 && type < 254;
    od::DeviceDescription description = plain_device();
    add_rpdo(description,
             {.cob_id = 0x201, .type = static_cast<std::uint8_t>(type), .mapping = {0x20030010}});
    Device device(description);
    EXPECT_EQ(device.diagnostics.size(), reserved ? 1U : 0U) << type;
    device.operational();
    device.receive(frame(0x201, {7, 0}, at(1)));
    EXPECT_EQ(device.read(0x2003), type >= 254 ? 7U : 0U) << type;
    device.engine->sync(0, at(2));
    EXPECT_EQ(device.read(0x2003), reserved ? 0U : 7U) << type;
  }
}

TEST(TransmissionType, OnRequestIsNotForCanFd) {
  od::DeviceDescription description = plain_device();
  add_tpdo(description, {.cob_id = 0x181, .mapping = {0x20030010}});
  Device device(description);
  device.engine->set_max_length(64);
  EXPECT_EQ(device.write(0x1800, 2, 252), AbortCode::invalid_value);
  EXPECT_EQ(device.write(0x1800, 2, 253), AbortCode::invalid_value);
  EXPECT_EQ(device.write(0x1800, 2, 254), AbortCode::none);
}

TEST(InhibitTime, IsForEventDrivenTpdosAlone) {
  Requested device(
      {}, {{.cob_id = 0x181, .type = 1, .inhibit = 1000, .mapping = {0x20030010}},
           {.number = 2, .cob_id = 0x281, .type = 253, .inhibit = 1000, .mapping = {0x20030010}}});
  for (int i = 1; i < 4; ++i) {
    device.engine->sync(0, at(i));
    device.receive(remote(0x281));
    EXPECT_THAT(device.sent_ids(at(i)), ElementsAre(0x181, 0x281));
  }
}

TEST(RemoteFrame, AsksForAnRpdoOnce) {
  Requested device({{.cob_id = 0x201, .mapping = {0x20030010, 0x20020008}}}, {});
  EXPECT_FALSE(device.engine->wants_to_send(at(1)));
  EXPECT_TRUE(device.engine->request_rpdo(1));
  EXPECT_TRUE(device.engine->request_rpdo(1));
  EXPECT_TRUE(device.engine->wants_to_send(at(1)));
  const std::vector<can::Frame> sent = device.sent(at(1));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_TRUE(sent[0].remote());
  EXPECT_EQ(sent[0].id, 0x201U);
  EXPECT_EQ(sent[0].length, 3) << "the length of the PDO";
  EXPECT_EQ(device.engine->counters().asked, 1U);
  EXPECT_TRUE(device.engine->request_rpdo(1));
  EXPECT_THAT(device.sent_ids(at(2)), ElementsAre(0x201));
}

TEST(RemoteFrame, IsNotSentWhereItIsNotAllowed) {
  Requested device({{.cob_id = 0x4000'0201, .mapping = {0x20030010}},
                    {.number = 2, .cob_id = 0x8000'0301, .mapping = {0x20030010}},
                    {.number = 3, .cob_id = 0x401, .mapping = {0x20030010}}},
                   {});
  EXPECT_FALSE(device.engine->request_rpdo(0));
  EXPECT_FALSE(device.engine->request_rpdo(1)) << "bit 30: no RTR";
  EXPECT_FALSE(device.engine->request_rpdo(2)) << "bit 31: not valid";
  EXPECT_FALSE(device.engine->request_rpdo(4));
  EXPECT_TRUE(device.engine->request_rpdo(3));
  device.engine->set_operational(false, at(1));
  EXPECT_FALSE(device.engine->request_rpdo(3));
  EXPECT_THAT(device.sent_ids(at(1)), IsEmpty());
}

TEST(RemoteFrame, GoesInTheOrderOfTheBus) {
  Requested device({{.cob_id = 0x381, .mapping = {0x20030010}},
                    {.number = 2, .cob_id = 0x191, .mapping = {0x20030010}},
                    {.number = 3, .cob_id = 0x2000'0181, .mapping = {0x20030010}}},
                   {{.cob_id = 0x281, .mapping = {0x20030010}}});
  device.set(0x2003, 1, at(1));
  for (std::uint16_t number = 1; number <= 3; ++number) {
    EXPECT_TRUE(device.engine->request_rpdo(number));
  }
  std::vector<can::Frame> sent;
  for (can::Frame next, peeked; device.engine->peek(peeked, at(1)); sent.push_back(next)) {
    ASSERT_TRUE(device.engine->next_frame(next, at(1)));
    EXPECT_EQ(peeked.id, next.id);
    EXPECT_EQ(peeked.flags, next.flags);
  }
  ASSERT_EQ(sent.size(), 4U);
  for (std::size_t i = 1; i < sent.size(); ++i) {
    EXPECT_TRUE(can::wins_arbitration(sent[i - 1], sent[i])) << i;
  }
  EXPECT_THAT(device.sent(at(1)), IsEmpty());
}

// A PDO that waits for its inhibit time is returned when that time has passed.
TEST(Peek, GivesWhatIsSentNext) {
  Requested device({}, {{.cob_id = 0x181, .inhibit = 100, .mapping = {0x20050020}}});
  can::Frame peeked;
  EXPECT_FALSE(device.engine->peek(peeked, at(0)));
  device.set(0x2005, 1, at(0));
  EXPECT_FALSE(device.engine->peek(peeked, at(9)));
  EXPECT_TRUE(device.engine->peek(peeked, at(10)));
  EXPECT_EQ(peeked.id, 0x181U);
  EXPECT_TRUE(device.engine->peek(peeked, at(10))) << "peek() removes nothing";
  EXPECT_THAT(device.sent_ids(at(10)), ElementsAre(0x181));
  EXPECT_FALSE(device.engine->peek(peeked, at(30)));
}

TEST(RemoteFrame, IsForgottenWithItsPdo) {
  Requested device({{.cob_id = 0x201, .mapping = {0x20030010}}}, {});
  EXPECT_TRUE(device.engine->request_rpdo(1));
  EXPECT_EQ(device.write(0x1400, 1, 0x8000'0201), AbortCode::none);
  EXPECT_FALSE(device.engine->wants_to_send(at(1)));
  EXPECT_THAT(device.sent_ids(at(1)), IsEmpty());
}

TEST(Hold, AGroupOfWritesIsSentOnce) {
  Requested device({}, {{.cob_id = 0x181, .mapping = {0x20030010, 0x20020008}},
                        {.number = 2, .cob_id = 0x281, .mapping = {0x20050020}},
                        {.number = 3, .cob_id = 0x381, .mapping = {0x20010001}}});
  device.engine->hold();
  device.set(0x2003, 1, at(1));
  device.set(0x2002, 2, at(1));
  EXPECT_TRUE(device.engine->trigger(2, at(1)));
  EXPECT_THAT(device.sent_ids(at(1)), IsEmpty());
  EXPECT_FALSE(device.engine->wants_to_send(at(1)));
  device.engine->release(at(2));
  const std::vector<can::Frame> sent = device.sent(at(2));
  ASSERT_EQ(sent.size(), 2U);
  EXPECT_THAT(data_of(sent[0]), ElementsAre(1, 0, 2));
  EXPECT_EQ(sent[1].id, 0x281U) << "requested, although unchanged";
  EXPECT_EQ(device.engine->counters().coalesced, 0U);
  device.engine->release(at(3));
  EXPECT_THAT(device.sent_ids(at(3)), IsEmpty());
}

TEST(Hold, AValueThatIsAsItWasIsNotSent) {
  Requested device({}, {{.cob_id = 0x181, .mapping = {0x20030010}}});
  device.engine->hold();
  device.set(0x2003, 1, at(1));
  device.set(0x2003, 0, at(1));
  device.engine->release(at(1));
  EXPECT_THAT(device.sent_ids(at(1)), IsEmpty());
}

TEST(Hold, SyncAndRemoteFramesGoOn) {
  Requested device({}, {{.cob_id = 0x181, .type = 1, .mapping = {0x20030010}},
                        {.number = 2, .cob_id = 0x281, .mapping = {0x20030010}}});
  device.engine->hold();
  device.engine->sync(0, at(1));
  EXPECT_THAT(device.sent_ids(at(1)), ElementsAre(0x181));
  device.receive(remote(0x281));
  EXPECT_THAT(device.sent_ids(at(1)), ElementsAre(0x281));
}

TEST(Hold, EndsWithThePdoAndWithOperational) {
  Requested device({}, {{.cob_id = 0x181, .mapping = {0x20030010}}});
  device.engine->hold();
  device.set(0x2003, 1, at(1));
  EXPECT_EQ(device.write(0x1800, 1, 0x8000'0181), AbortCode::none);
  device.engine->release(at(1));
  EXPECT_THAT(device.sent_ids(at(1)), IsEmpty());
  EXPECT_EQ(device.write(0x1800, 1, 0x181), AbortCode::none);
  (void)device.sent(at(1));
  device.engine->hold();
  device.set(0x2003, 2, at(2));
  device.engine->set_operational(false, at(2));
  device.engine->release(at(3));
  EXPECT_THAT(device.sent_ids(at(3)), IsEmpty());
}

// The maximum: 64 entries of one bit, in both directions.
TEST(Mapping, OfSixtyFourBits) {
  od::DeviceDescription description;
  std::vector<std::uint32_t> in;
  std::vector<std::uint32_t> out;
  for (std::uint32_t i = 0; i < 64; ++i) {
    description.objects.push_back(value(static_cast<std::uint16_t>(0x2000 + i), DataType::boolean));
    in.push_back((0x2000U + i) << 16U | 1U);
    out.push_back((0x2000U + 63U - i) << 16U | 1U);
  }
  add_rpdo(description, {.cob_id = 0x201, .mapping = in});
  add_tpdo(description, {.cob_id = 0x181, .mapping = out});
  Device device(description);
  ASSERT_THAT(device.diagnostics, IsEmpty());
  device.operational();
  (void)device.sent(at(0));
  device.receive(frame(0x201, {0x01, 0x02, 0x04, 0x08, 0x10, 0x20, 0x40, 0x80}, at(1)));
  for (std::uint16_t i = 0; i < 64; ++i) {
    EXPECT_EQ(device.read(static_cast<std::uint16_t>(0x2000 + i)), i % 9 == 0 ? 1U : 0U) << i;
  }
  EXPECT_TRUE(device.engine->trigger(1, at(2)));
  const std::vector<can::Frame> sent = device.sent(at(2));
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_THAT(data_of(sent[0]), ElementsAre(0x01, 0x02, 0x04, 0x08, 0x10, 0x20, 0x40, 0x80));
}

// 1400h to 15FFh, 1800h to 19FFh: each with its own identifier and object.
TEST(Engine, FiveHundredAndTwelvePdosEachWay) {
  od::DeviceDescription description;
  for (std::uint16_t n = 1; n <= 512; ++n) {
    const auto in = static_cast<std::uint16_t>(0x2000 + n);
    const auto out = static_cast<std::uint16_t>(0x3000 + n);
    description.objects.push_back(value(in, DataType::unsigned16));
    description.objects.push_back(value(out, DataType::unsigned16, Access::rw, n));
    add_rpdo(description,
             {.number = n, .cob_id = 0x2001'0000U + n, .mapping = {in * 0x10000U + 0x10}});
    add_tpdo(
        description,
        {.number = n, .cob_id = 0x2002'0000U + n, .type = 1, .mapping = {out * 0x10000U + 0x10}});
  }
  Device device(description);
  ASSERT_THAT(device.diagnostics, IsEmpty());
  device.operational();
  for (std::uint16_t n = 1; n <= 512; ++n) {
    can::Frame in = frame(0x1'0000U + n,
                          {static_cast<std::uint8_t>(n), static_cast<std::uint8_t>(n >> 8)}, at(1));
    in.flags = can::Frame::kExtended;
    device.receive(in);
    EXPECT_EQ(device.read(static_cast<std::uint16_t>(0x2000 + n)), n);
  }
  device.engine->sync(0, at(2));
  const std::vector<can::Frame> sent = device.sent(at(2));
  ASSERT_EQ(sent.size(), 512U);
  for (std::size_t i = 0; i < sent.size(); ++i) {
    EXPECT_EQ(sent[i].id, 0x2'0001U + i);
    EXPECT_TRUE(sent[i].extended());
    EXPECT_EQ(load_le<std::uint16_t>(sent[i].data.data()), i + 1);
  }
}

// The default limit of esd's stack; this stack has no limit.
TEST(Engine, OneObjectInEightPdosEachWay) {
  std::vector<Pdo> rpdos;
  std::vector<Pdo> tpdos;
  std::vector<std::uint32_t> ids;
  for (std::uint16_t n = 1; n <= 8; ++n) {
    rpdos.push_back({.number = n, .cob_id = 0x200U + n, .mapping = {0x20030010}});
    tpdos.push_back({.number = n, .cob_id = 0x180U + n, .mapping = {0x20030010}});
    ids.push_back(0x180U + n);
  }
  Requested device(rpdos, tpdos);
  for (std::uint8_t n = 1; n <= 8; ++n) {
    device.receive(frame(0x200U + n, {n, n}, at(1)));
    EXPECT_EQ(device.read(0x2003), 0x0101U * n);
  }
  device.engine->value_changed({0x2003, 0}, at(2));
  EXPECT_THAT(device.sent_ids(at(2)), testing::ElementsAreArray(ids));
}

}  // namespace
}  // namespace linegate::pdo
