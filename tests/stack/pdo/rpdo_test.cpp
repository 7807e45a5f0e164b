// SPDX-License-Identifier: Apache-2.0
// RPDOs of a device: which values are applied, and when.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/stack/pdo/device_fixture.h"

namespace linegate::pdo {
namespace {

using namespace test;
using testing::ElementsAre;
using testing::IsEmpty;

struct Made {
  static od::DeviceDescription with(const std::vector<Pdo>& pdos) {
    od::DeviceDescription out = plain_device();
    for (const Pdo& pdo : pdos) {
      add_rpdo(out, pdo);
    }
    return out;
  }
};

TEST(Rpdo, EveryLengthAndBooleansLandInTheirObjects) {
  Device device(
      Made::with({{.cob_id = 0x201,
                   .mapping = {0x20000001, 0x20010001, 0x00010001, 0x00010001, 0x00010001,
                               0x00010001, 0x00010001, 0x00010001, 0x20040018, 0x20050020}}}));
  ASSERT_THAT(device.diagnostics, IsEmpty());
  device.operational();
  device.receive(frame(0x201, {0x02, 1, 2, 3, 4, 5, 6, 7}, at(1)));
  EXPECT_EQ(device.read(0x2000), 0U);
  EXPECT_EQ(device.read(0x2001), 1U);
  EXPECT_EQ(device.read(0x2004), 0x030201U);
  EXPECT_EQ(device.read(0x2005), 0x07060504U);
  EXPECT_EQ(device.engine->counters().received, 1U);
  EXPECT_THAT(device.listener.received, ElementsAre(1));
}

TEST(Rpdo, OnlyInOperational) {
  Device device(Made::with({{.cob_id = 0x201, .mapping = {0x20030010}}}));
  device.receive(frame(0x201, {1, 0}, at(1)));
  EXPECT_EQ(device.read(0x2003), 0U);
  device.operational();
  device.receive(frame(0x201, {2, 0}, at(1)));
  EXPECT_EQ(device.read(0x2003), 2U);
  device.engine->set_operational(false, at(2));
  device.receive(frame(0x201, {3, 0}, at(3)));
  EXPECT_EQ(device.read(0x2003), 2U);
  EXPECT_EQ(device.engine->counters().received, 1U);
}

TEST(Rpdo, TheNewestThatCameEarlyIsTakenInOperational) {
  Device device(Made::with({{.cob_id = 0x201, .mapping = {0x20030010}},
                            {.number = 2, .cob_id = 0x301, .type = 1, .mapping = {0x20020008}}}));
  device.engine->keep_early(true);
  device.receive(frame(0x201, {1, 0}, at(1)));
  device.receive(frame(0x201, {2, 0}, at(2)));
  device.receive(frame(0x201, {9}, at(2)));
  device.receive(frame(0x201, {9, 9, 9}, at(2)));
  device.receive(frame(0x301, {7}, at(3)));
  device.engine->sync(0, at(3));
  EXPECT_EQ(device.read(0x2003), 0U);
  EXPECT_EQ(device.engine->counters().received, 0U);
  EXPECT_THAT(device.emitted(), IsEmpty()) << "early frames cause no length error";
  device.operational(at(4));
  EXPECT_EQ(device.read(0x2003), 2U);
  EXPECT_EQ(device.read(0x2002), 0U) << "not before SYNC";
  device.engine->sync(0, at(5));
  EXPECT_EQ(device.read(0x2002), 7U);
  EXPECT_EQ(device.engine->counters().received, 3U);
  EXPECT_THAT(device.listener.received, ElementsAre(1, 2));
  device.engine->set_operational(false, at(6));
  device.receive(frame(0x201, {3, 0}, at(7)));
  device.engine->keep_early(false);
  device.receive(frame(0x201, {4, 0}, at(8)));
  device.operational(at(9));
  EXPECT_EQ(device.read(0x2003), 2U) << "discarded without keep_early";
}

TEST(Rpdo, TheDeadlineOfWhatCameEarlyBeginsWithOperational) {
  Device device(Made::with({{.cob_id = 0x201, .event_timer = 10, .mapping = {0x20030010}}}));
  device.engine->keep_early(true);
  device.receive(frame(0x201, {1, 0}, at(1)));
  device.operational(at(100));
  device.engine->advance(at(109));
  EXPECT_THAT(device.emitted(), IsEmpty());
  device.receive(frame(0x201, {2, 0}, at(109)));
  device.engine->advance(at(110));
  EXPECT_THAT(device.emitted(), IsEmpty());
  device.engine->advance(at(119));
  EXPECT_EQ(device.emitted().size(), 1U);
}

TEST(Rpdo, RemoteFramesAreIgnored) {
  Device device(Made::with({{.cob_id = 0x201, .mapping = {0x20030010}}}));
  device.operational();
  can::Frame remote = frame(0x201, {9, 9}, at(1));
  remote.flags = can::Frame::kRemote;
  device.receive(remote);
  EXPECT_EQ(device.read(0x2003), 0U);
  EXPECT_THAT(device.emitted(), IsEmpty());
}

TEST(Rpdo, ATooShortFrameIsNotProcessed) {
  Device device(Made::with({{.cob_id = 0x201, .mapping = {0x20030010}}}));
  device.operational();
  device.receive(frame(0x201, {9}, at(1)));
  EXPECT_EQ(device.read(0x2003), 0U);
  EXPECT_EQ(device.engine->counters().too_short, 1U);
  EXPECT_THAT(device.listener.wrong_lengths, ElementsAre(RecordingListener::WrongLength{1, 2, 1}));
  const std::vector<Event> events = device.emitted();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].data, EventData(event::PdoLength{.number = 1, .mapped = 2, .received = 1}));
  EXPECT_EQ(events[0].time, at(1));
}

TEST(Rpdo, OfATooLongFrameTheFirstBytesAreUsed) {
  Device device(Made::with({{.cob_id = 0x201, .mapping = {0x20030010}}}));
  device.operational();
  device.receive(frame(0x201, {1, 2, 3}, at(1)));
  EXPECT_EQ(device.read(0x2003), 0x0201U);
  EXPECT_EQ(device.engine->counters().too_long, 1U);
  EXPECT_EQ(device.engine->counters().received, 1U);
  EXPECT_THAT(device.listener.wrong_lengths, ElementsAre(RecordingListener::WrongLength{1, 2, 3}));
}

TEST(Rpdo, AWrongLengthIsToldOnceUntilARightOne) {
  Device device(Made::with({{.cob_id = 0x201, .mapping = {0x20030010}}}));
  device.operational();
  for (int i = 0; i < 3; ++i) {
    device.receive(frame(0x201, {9}, at(1)));
    device.receive(frame(0x201, {9, 9, 9}, at(1)));
  }
  EXPECT_EQ(device.emitted().size(), 1U);
  EXPECT_EQ(device.engine->counters().too_short, 3U);
  device.receive(frame(0x201, {9, 9}, at(2)));
  device.receive(frame(0x201, {9}, at(3)));
  EXPECT_EQ(device.emitted().size(), 1U);
}

TEST(Rpdo, SynchronousDataIsTakenOverAtTheNextSync) {
  Device device(Made::with({{.cob_id = 0x201, .type = 0, .mapping = {0x20030010}},
                            {.number = 2, .cob_id = 0x301, .type = 240, .mapping = {0x20020008}}}));
  device.operational();
  device.receive(frame(0x201, {1, 0}, at(1)));
  device.receive(frame(0x201, {2, 0}, at(2)));
  device.receive(frame(0x301, {7}, at(2)));
  EXPECT_EQ(device.read(0x2003), 0U);
  EXPECT_EQ(device.read(0x2002), 0U);
  EXPECT_THAT(device.listener.received, IsEmpty());
  device.engine->sync(0, at(3));
  EXPECT_EQ(device.read(0x2003), 2U) << "the newest";
  EXPECT_EQ(device.read(0x2002), 7U);
  EXPECT_EQ(device.engine->counters().received, 3U);
  EXPECT_THAT(device.listener.received, ElementsAre(1, 2));
  device.engine->sync(0, at(4));
  EXPECT_THAT(device.listener.received, ElementsAre(1, 2)) << "no further reception";
}

TEST(Rpdo, WhatWaitsForSyncIsForgottenOutsideOfOperational) {
  Device device(Made::with({{.cob_id = 0x201, .type = 1, .mapping = {0x20030010}}}));
  device.operational();
  device.receive(frame(0x201, {1, 0}, at(1)));
  device.engine->set_operational(false, at(2));
  device.engine->set_operational(true, at(3));
  device.engine->sync(0, at(4));
  EXPECT_EQ(device.read(0x2003), 0U);
}

TEST(Rpdo, OneObjectInSeveralRpdosAndSeveralRpdosOnOneIdentifier) {
  Device device(Made::with({{.cob_id = 0x201, .mapping = {0x20030010}},
                            {.number = 2, .cob_id = 0x301, .mapping = {0x20030010}},
                            {.number = 3, .cob_id = 0x301, .mapping = {0x20020008, 0x00050008}}}));
  device.operational();
  device.receive(frame(0x201, {1, 0}, at(1)));
  EXPECT_EQ(device.read(0x2003), 1U);
  device.receive(frame(0x301, {2, 0}, at(1)));
  EXPECT_EQ(device.read(0x2003), 2U);
  EXPECT_EQ(device.read(0x2002), 2U);
}

TEST(Rpdo, ExtendedIdentifiers) {
  Device device(Made::with({{.cob_id = 0x2000'0201, .mapping = {0x20030010}}}));
  device.operational();
  device.receive(frame(0x201, {1, 0}, at(1)));
  EXPECT_EQ(device.read(0x2003), 0U);
  can::Frame extended = frame(0x201, {1, 0}, at(1));
  extended.flags = can::Frame::kExtended;
  device.receive(extended);
  EXPECT_EQ(device.read(0x2003), 1U);
}

TEST(Rpdo, DeadlineBeginsWithTheFirstFrame) {
  Device device(Made::with({{.cob_id = 0x201, .event_timer = 10, .mapping = {0x20030010}}}));
  device.operational();
  EXPECT_EQ(device.engine->next_wake(), kNever);
  device.receive(frame(0x201, {1, 0}, at(100)));
  EXPECT_EQ(device.engine->next_wake(), at(110));
  device.receive(frame(0x201, {1, 0}, at(105)));
  device.engine->advance(at(110));
  EXPECT_THAT(device.listener.deadlines, IsEmpty()) << "a newer frame came";
  EXPECT_EQ(device.engine->next_wake(), at(115));
  device.engine->advance(at(115));
  EXPECT_THAT(device.listener.deadlines, ElementsAre(1));
  std::vector<Event> events = device.emitted();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].data,
            EventData(event::PdoTimeout{.number = 1, .deadline = std::chrono::milliseconds(10)}));
  EXPECT_EQ(device.engine->next_wake(), kNever) << "reported once";
  device.receive(frame(0x201, {1, 0}, at(200)));
  events = device.emitted();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].kind(), EventKind::pdo_recovered);
  EXPECT_EQ(events[0].time, at(200));
  EXPECT_EQ(device.engine->next_wake(), at(210));
}

TEST(Rpdo, DeadlineOfASynchronousRpdoCountsReception) {
  Device device(
      Made::with({{.cob_id = 0x201, .type = 1, .event_timer = 10, .mapping = {0x20030010}}}));
  device.operational();
  device.receive(frame(0x201, {1, 0}, at(100)));
  device.engine->sync(0, at(101));
  device.receive(frame(0x201, {1, 0}, at(108)));
  device.engine->advance(at(110));
  EXPECT_THAT(device.listener.deadlines, IsEmpty());
  device.engine->advance(at(118));
  EXPECT_THAT(device.listener.deadlines, ElementsAre(1));
  device.engine->sync(0, at(119));
  EXPECT_EQ(device.emitted().size(), 1U) << "the commit of an old frame is no recovery";
  device.receive(frame(0x201, {1, 0}, at(120)));
  ASSERT_EQ(device.emitted().size(), 1U);
}

TEST(Rpdo, NoDeadlineOutsideOfOperational) {
  Device device(Made::with({{.cob_id = 0x201, .event_timer = 10, .mapping = {0x20030010}}}));
  device.operational();
  device.receive(frame(0x201, {1, 0}, at(100)));
  device.engine->set_operational(false, at(101));
  device.engine->advance(at(200));
  EXPECT_THAT(device.listener.deadlines, IsEmpty());
}

TEST(Rpdo, CanFdFramesAreLongerThanTheirMapping) {
  od::DeviceDescription description =
      Made::with({{.cob_id = 0x201, .mapping = {0x20060040, 0x20030010}},
                  {.number = 2, .cob_id = 0x301, .type = 1, .mapping = {0x20060040, 0x20030010}}});
  Device device(description);
  EXPECT_EQ(device.diagnostics.size(), 2U) << "10 bytes do not fit into a classical frame";
  device.engine->set_max_length(64);
  EXPECT_THAT(device.engine->configure(), IsEmpty());
  device.operational();
  can::Frame fd;
  fd.id = 0x201;
  fd.flags = can::Frame::kFd;
  fd.length = 12;
  for (std::size_t i = 0; i < 12; ++i) {
    fd.data[i] = static_cast<std::byte>(i + 1);
  }
  device.receive(fd);
  EXPECT_EQ(device.read(0x2006), 0x0807060504030201U);
  EXPECT_EQ(device.read(0x2003), 0x0A09U);
  EXPECT_THAT(device.emitted(), IsEmpty()) << "12 is the length for 10 bytes";
  fd.id = 0x301;
  fd.data[9] = std::byte{0x77};
  device.receive(fd);
  EXPECT_EQ(device.read(0x2003), 0x0A09U);
  device.engine->sync(0, at(1));
  EXPECT_EQ(device.read(0x2003), 0x7709U);
}

// 8210h and 8220h are about the counted bytes: padding belongs to neither.
TEST(Rpdo, CanFdFramesOfAnotherLengthThanThatOfTheMapping) {
  od::DeviceDescription description =
      Made::with({{.cob_id = 0x201, .mapping = {0x20060040, 0x20030010}}});
  Device device(description);
  device.engine->set_max_length(64);
  EXPECT_THAT(device.engine->configure(), IsEmpty());
  device.operational();
  can::Frame fd;
  fd.id = 0x201;
  fd.flags = can::Frame::kFd;
  fd.data.fill(std::byte{1});
  fd.length = 8;
  device.receive(fd);
  EXPECT_EQ(device.engine->counters().too_short, 1U);
  EXPECT_EQ(device.read(0x2006), 0U);
  fd.length = 16;
  device.receive(fd);
  EXPECT_EQ(device.engine->counters().too_long, 1U);
  EXPECT_EQ(device.read(0x2003), 0x0101U) << "the first bytes are used";
  fd.length = 12;
  device.receive(fd);
  EXPECT_EQ(device.engine->counters().received, 2U);
  EXPECT_EQ(device.engine->counters().too_long, 1U);
}

}  // namespace
}  // namespace linegate::pdo
