// SPDX-License-Identifier: Apache-2.0
// SDO routing to and from a line of CANopen FD: its devices have USDO, whose frames are those of
// stack/usdo/README.md.
#include <array>
#include <cstdio>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/stack/routing/routed_lines.h"

namespace linegate::routing::test {
namespace {

constexpr std::uint8_t kOwn = 126;

// Line 2 is one of CANopen FD; node 5 is a device on it.
class UsdoRouting : public SdoRouting {
 protected:
  UsdoRouting() { config_of(2).canopen_fd = true; }

  // A frame of node 5 to the own node of line 2, in the present session.
  void device(std::initializer_list<std::uint8_t> after_session,
              const std::vector<std::uint8_t>& more = {}) {
    std::vector<std::uint8_t> data{kOwn};
    data.insert(data.end(), after_session);
    data.insert(data.begin() + 2, session_);
    data.insert(data.end(), more.begin(), more.end());
    hear_fd(2, 0x585, data);
  }
  // The only frame that line 2 sends, from its command on, without session and padding.
  std::string request(std::size_t bytes) {
    const Frames frames = sent(2);
    EXPECT_EQ(frames.size(), 1U);
    if (frames.size() != 1 || frames[0].size() < 4 + 2 * bytes ||
        frames[0].substr(0, 6) != "67E 05") {
      ADD_FAILURE() << (frames.empty() ? "nothing" : frames[0]);
      return {};
    }
    session_ = static_cast<std::uint8_t>(std::stoul(frames[0].substr(8, 2), nullptr, 16));
    return frames[0].substr(6, 2) + frames[0].substr(10, 2 * (bytes - 3));
  }
  void open_and_read() {
    open();
    client({0x40, 0, 0x20, 1, 0, 0, 0, 0});
    ASSERT_EQ(request(6), "11010020");
  }
  void open_and_write() {
    open();
    client({0x2B, 0, 0x20, 1, 0x34, 0x12, 0, 0});
    ASSERT_EQ(request(10), "0101002006023412");
  }
  std::string abort_of(AbortCode code) {
    char text[32];
    const auto number = static_cast<unsigned>(code);
    std::snprintf(text, sizeof text, "5FF 80002001%02X%02X%02X%02X", number & 0xFFU,
                  number >> 8U & 0xFFU, number >> 16U & 0xFFU, number >> 24U);
    return text;
  }

  // The objects of events routing-unanswered.
  std::vector<od::Address> unanswered(unsigned number) {
    constexpr auto kKind = EventKind::routing_unanswered;
    std::vector<od::Address> out;
    for (const Event& event : events(number, kKind, kKind)) {
      const auto& data = std::get<event::RoutingUnanswered>(event.data);
      out.push_back({data.index, data.sub});
    }
    return out;
  }

  std::uint8_t session_ = 0;
};

TEST_F(UsdoRouting, AnExpeditedReadIsOneUpload) {
  start();
  open_and_read();
  EXPECT_EQ(counters(2).channels, 1U);
  device({0x31, 1, 0x00, 0x20, 7, 4, 0x91, 1, 2, 3});
  EXPECT_EQ(sent(1), Frames{"5FF 4300200191010203"});
  EXPECT_EQ(counters(1).finished, 1U);
  expect_nothing_left();
}

TEST_F(UsdoRouting, AnExpeditedWriteIsOneDownload) {
  start();
  open_and_write();
  EXPECT_EQ(sent(1), Frames{}) << "the device has not answered yet";
  device({0x21, 1, 0x00, 0x20});
  EXPECT_EQ(sent(1), Frames{"5FF 6000200100000000"});
  EXPECT_EQ(counters(1).finished, 1U);
  expect_nothing_left();
}

TEST_F(UsdoRouting, AReadOfMoreThanFourBytesHasSegments) {
  start();
  open_and_read();
  device({0x31, 1, 0x00, 0x20, 9, 10}, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10});
  EXPECT_EQ(sent(1), Frames{"5FF 410020010A000000"});
  client({0x60, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 0001020304050607"});
  client({0x70, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 1908090A00000000"});
  EXPECT_EQ(sent(2), Frames{}) << "the value was read once";
  expect_nothing_left();
}

TEST_F(UsdoRouting, AWriteOfMoreThanFourBytesIsSentWhenItIsComplete) {
  start();
  open();
  client({0x21, 0, 0x20, 1, 9, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 6000200100000000"});
  client({0x00, 1, 2, 3, 4, 5, 6, 7});
  EXPECT_EQ(sent(1), Frames{"5FF 2000000000000000"});
  EXPECT_EQ(sent(2), Frames{});
  client({0x1B, 8, 9, 0, 0, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{});
  EXPECT_EQ(request(17), "010100200F09010203040506070809");
  device({0x21, 1, 0x00, 0x20});
  EXPECT_EQ(sent(1), Frames{"5FF 3000000000000000"});
  expect_nothing_left();
}

TEST_F(UsdoRouting, LongValuesAreSegmentedOnBothSides) {
  start();
  open_and_read();
  device({0x32, 1, 0x00, 0x20, 0x0F, 0, 61, 0, 0, 0});
  EXPECT_EQ(request(4), "1300");
  device({0x33, 0}, std::vector<std::uint8_t>(60, 0xAA));
  EXPECT_EQ(request(4), "1301");
  EXPECT_EQ(sent(1), Frames{});
  device({0x34, 1, 0xBB});
  EXPECT_EQ(sent(1), Frames{"5FF 410020013D000000"});
  std::string value;
  for (std::uint8_t segment = 0; segment < 9; ++segment) {
    client({static_cast<std::uint8_t>(segment % 2 == 0 ? 0x60 : 0x70), 0, 0, 0, 0, 0, 0, 0});
    const Frames frames = sent(1);
    ASSERT_EQ(frames.size(), 1U);
    value += frames[0].substr(6, segment == 8 ? 10 : 14);
  }
  EXPECT_EQ(value.substr(118, 4), "AABB");
  expect_nothing_left();
}

// An expedited download need not state how many of its four bytes are used (CiA 301 7.2.4.3.3).
TEST_F(UsdoRouting, AWriteWithoutASizeHasThatOfTheObject) {
  line::NodeConfig node{.id = 5, .name = "io"};
  const std::pair<std::uint16_t, od::DataType> objects[] = {{0x2000, od::DataType::unsigned8},
                                                            {0x2001, od::DataType::integer16},
                                                            {0x2002, od::DataType::unsigned24},
                                                            {0x2003, od::DataType::unsigned64}};
  for (const auto& [index, type] : objects) {
    od::ObjectDescription object;
    object.index = index;
    object.variables = {od::number_variable(1, "Value", type, od::Access::rw)};
    node.device.objects.push_back(std::move(object));
  }
  node.boot = false;
  config_of(2).nodes.push_back(std::move(node));
  start();
  const std::pair<std::uint8_t, std::string> rows[] = {{0, "050111"},
                                                       {1, "06021122"},
                                                       {2, "0F03112233"},
                                                       {3, "070411223344"},   // it is longer
                                                       {4, "070411223344"}};  // it is unknown
  for (const auto& [low, content] : rows) {
    open();
    client({0x22, low, 0x20, 1, 0x11, 0x22, 0x33, 0x44});
    EXPECT_EQ(request(5 + content.size() / 2 + 1), "01010" + std::to_string(low) + "20" + content);
    device({0x21, 1, low, 0x20});
    EXPECT_EQ(sent(1), Frames{"5FF 600" + std::to_string(low) + "200100000000"});
  }
  expect_nothing_left();
}

TEST_F(UsdoRouting, AReadOfMoreThanALineCarriesIsRefusedAtOnce) {
  start();
  open_and_read();
  device({0x32, 1, 0x00, 0x20, 0x0F, 0, 1, 0, 2, 0});  // 128 KiB and one byte
  EXPECT_EQ(request(7), "7F01002060");
  EXPECT_EQ(sent(1), Frames{abort_of(AbortCode::out_of_memory)});
  expect_nothing_left();
}

TEST_F(UsdoRouting, ABlockDownloadBecomesOneDownload) {
  start();
  open();
  client({0xC2, 0, 0x20, 1, 3, 0, 0, 0});  // without CRC
  const Frames initiated = sent(1);
  ASSERT_EQ(initiated.size(), 1U);
  EXPECT_EQ(initiated[0].substr(0, 5), "5FF A");
  client({0x81, 7, 8, 9, 0, 0, 0, 0});
  EXPECT_EQ(sent(1).size(), 1U);
  EXPECT_EQ(sent(2), Frames{});
  client({0xD1, 0, 0, 0, 0, 0, 0, 0});  // four bytes of the segment are not used
  EXPECT_EQ(request(11), "010100200F03070809");
  EXPECT_EQ(sent(1), Frames{});
  device({0x21, 1, 0x00, 0x20});
  EXPECT_EQ(sent(1), Frames{"5FF A100000000000000"});
  expect_nothing_left();
}

struct AbortRow {
  std::uint8_t usdo;
  AbortCode sdo;
};

class UsdoAbortRow : public UsdoRouting, public testing::WithParamInterface<AbortRow> {};

TEST_P(UsdoAbortRow, OfTheDeviceReachesTheClientInTheCodesOfSdo) {
  start();
  open_and_write();
  device({0x7F, 1, 0x00, 0x20, GetParam().usdo});
  EXPECT_EQ(sent(1), Frames{abort_of(GetParam().sdo)});
  EXPECT_EQ(counters(1).aborted, 1U);
  EXPECT_EQ(sent(2), Frames{});
  expect_nothing_left();
}

constexpr AbortRow kAborts[] = {
    {0x13, AbortCode::command_specifier}, {0x15, AbortCode::length_mismatch},
    {0x21, AbortCode::sdo_connection},    {0x31, AbortCode::write_only},
    {0x32, AbortCode::read_only},         {0x33, AbortCode::no_object},
    {0x34, AbortCode::no_sub_index},      {0x36, AbortCode::length_mismatch},
    {0x37, AbortCode::length_too_high},   {0x38, AbortCode::length_too_low},
    {0x60, AbortCode::cannot_transfer},   {0x62, AbortCode::device_state},
    {0x70, AbortCode::general},
};
INSTANTIATE_TEST_SUITE_P(Codes, UsdoAbortRow, testing::ValuesIn(kAborts));

TEST_F(UsdoRouting, AnAbortOfFourBytesIsThatOfTheClient) {
  start();
  open_and_read();
  device({0x80, 1, 0x00, 0x20, 0x31, 0x00, 0x09, 0x06});
  EXPECT_EQ(sent(1), Frames{abort_of(AbortCode::value_too_high)});
  expect_nothing_left();
}

TEST_F(UsdoRouting, ADeviceThatDoesNotAnswerIsATimeOut) {
  start();
  open_and_write();
  pass(config_of(2).sdo_timeout - milliseconds(1));
  EXPECT_EQ(sent(1), Frames{});
  pass(milliseconds(2));
  EXPECT_EQ(sent(1), Frames{abort_of(AbortCode::timeout)});
  pass(seconds(5));
  EXPECT_EQ(sent(1), Frames{});
  for (const std::string& frame : sent(2)) {
    EXPECT_NE(frame.substr(6, 2), "01") << "the value was sent once";
  }
  expect_nothing_left();
}

TEST_F(UsdoRouting, ADeviceThatOthersUseForTooLongIsBusy) {
  of_line(2).channel_wait = milliseconds(100);
  start();
  open();
  line(2).execute({.tag = 1, .request = line::SdoRead{.node = 5, .address = {0x1000, 0}}}, now_);
  EXPECT_EQ(request(6), "11000010");
  client({0x2B, 0, 0x20, 1, 0x34, 0x12, 0, 0});
  pass(milliseconds(99));
  EXPECT_EQ(sent(1), Frames{});
  pass(milliseconds(2));
  EXPECT_EQ(sent(1), Frames{abort_of(AbortCode::sdo_connection)});
  device({0x31, 0, 0x00, 0x10, 7, 4, 0x91, 1, 2, 3});
  pass(milliseconds(10));
  EXPECT_EQ(sent(2), Frames{}) << "the write was withdrawn";
  expect_nothing_left();
}

TEST_F(UsdoRouting, ATransferWaitsForThatOfAnother) {
  start();
  open();
  line(2).execute({.tag = 1, .request = line::SdoRead{.node = 5, .address = {0x1000, 0}}}, now_);
  EXPECT_EQ(request(6), "11000010");
  client({0x40, 0, 0x20, 1, 0, 0, 0, 0});
  EXPECT_EQ(sent(2), Frames{});
  device({0x31, 0, 0x00, 0x10, 7, 4, 0x91, 1, 2, 3});
  pass(milliseconds(1));
  EXPECT_EQ(request(6), "11010020");
  device({0x31, 1, 0x00, 0x20, 5, 1, 0x77});
  EXPECT_EQ(sent(1), Frames{"5FF 4F00200177000000"});
  expect_nothing_left();
}

TEST_F(UsdoRouting, AnAbortOfTheClientEndsTheTransfer) {
  start();
  open_and_read();
  client({0x80, 0, 0x20, 1, 0, 0, 0x04, 0x05});
  EXPECT_EQ(request(7).substr(0, 8), "7F010020");
  device({0x31, 1, 0x00, 0x20, 7, 4, 0x91, 1, 2, 3});
  pass(seconds(5));
  EXPECT_EQ(sent(1), Frames{});
  expect_nothing_left();
}

// CAN doubles a frame after an error in the last bit of its end.
TEST_F(UsdoRouting, ADoubledRequestIsCarriedOutOnce) {
  start();
  open_and_write();
  client({0x2B, 0, 0x20, 1, 0x34, 0x12, 0, 0});
  EXPECT_EQ(sent(2), Frames{});
  device({0x21, 1, 0x00, 0x20});
  EXPECT_EQ(sent(1), Frames{"5FF 6000200100000000"});
  expect_nothing_left();
}

TEST_F(UsdoRouting, AWriteThatTheClientGivesUpIsReported) {
  start();
  open_and_read();
  client({0x80, 0, 0x20, 1, 0, 0, 0x04, 0x05});
  EXPECT_EQ(unanswered(2), std::vector<od::Address>{}) << "a read leaves nothing unknown";
  (void)sent(2);
  open_and_write();
  client({0x80, 0, 0x20, 1, 0, 0, 0x04, 0x05});
  EXPECT_EQ(unanswered(2), (std::vector<od::Address>{{0x2000, 1}}));
  (void)sent(2);
  expect_nothing_left();
}

TEST_F(UsdoRouting, AClientThatStopsSendingIsATimeOut) {
  start();
  open();
  client({0x21, 0, 0x20, 1, 9, 0, 0, 0});
  (void)sent(1);
  pass(seconds(5));
  EXPECT_EQ(sent(2), Frames{}) << "an incomplete value is not written";
  EXPECT_EQ(counters(1).timed_out + counters(1).aborted, 1U);
  expect_nothing_left();
}

TEST_F(UsdoRouting, WhatTheAccessRulesForbidIsNotSent) {
  of_line(2).access[0].sdo_write = false;
  start();
  open();
  client({0x2B, 0, 0x20, 1, 0x34, 0x12, 0, 0});
  EXPECT_EQ(sent(1), Frames{abort_of(AbortCode::read_only)});
  EXPECT_EQ(sent(2), Frames{});
  EXPECT_EQ(counters(2).not_permitted, 1U);
  EXPECT_TRUE(refused_with(2, AbortCode::read_only));
  expect_nothing_left();
}

TEST_F(UsdoRouting, ALineThatIsClosedRefusesTheIndication) {
  of_line(2).access.clear();
  start();
  client({0xE0, 2, 0, 5, 1, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 8000000021000008"});
  EXPECT_TRUE(refused_with(2, AbortCode::local_control));
  expect_nothing_left();
}

TEST_F(UsdoRouting, ALineThatCannotSendIsRefusedWithDeviceState) {
  start();
  line(2).bus_event({.kind = can::BusEvent::Kind::state, .state = can::BusState::bus_off});
  client({0xE0, 2, 0, 5, 1, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 8000000022000008"});
}

TEST_F(UsdoRouting, NoNextGatewayIsReachedByUsdo) {
  with_next_gateway();  // of line 1 alone, as a write to its 1F2Ch may make it
  start();
  client({0xE0, 3, 0, 5, 1, 0, 0, 0});
  EXPECT_EQ(sent(1), Frames{"5FF 8000000030000906"});
  EXPECT_EQ(sent(2), Frames{});
  of_line(2).routes.push_back({.first = 3, .last = 4, .interface = 2, .gateway = 9, .cost = 10});
  EXPECT_FALSE(line::Line::make(config_of(2)).ok());
}

TEST_F(UsdoRouting, TheGatewayItselfIsReachedAsAnyNodeIs) {
  start();
  for (const std::uint8_t node : std::initializer_list<std::uint8_t>{0, kOwn}) {
    client({0xE0, 2, 0, node, 1, 0, 0, 0});
    client({0x40, 0x20, 0x5F, 2, 0, 0, 0, 0});  // the network-ID of line 2
    const Frames frames = sent(1);
    ASSERT_EQ(frames.size(), 2U);
    EXPECT_EQ(frames[1], "5FF 4B205F0202000000");
  }
  EXPECT_EQ(sent(2), Frames{});
  expect_nothing_left();
}

TEST_F(UsdoRouting, AStopOfTheLineStatesWhetherTheValueMayBeWritten) {
  start();
  open_and_read();
  line(2).stop(now_);
  carry();
  EXPECT_EQ(sent(1), Frames{abort_of(AbortCode::device_state)});
  (void)sent(2);
  line(2).start(now_);
  pass(milliseconds(10));
  (void)sent(2);
  open();
  client({0x23, 0, 0x20, 1, 1, 2, 3, 4});
  (void)sent(2);
  line(2).stop(now_);
  carry();
  EXPECT_EQ(sent(1), Frames{abort_of(AbortCode::timeout)});
  expect_nothing_left();
}

// --- commands -----------------------------------------------------------------------------------

TEST_F(UsdoRouting, ACommandOnAClassicalLineReachesTheDevice) {
  start();
  line(1).execute(
      {.tag = 7,
       .request =
           line::NetworkWrite{
               .network = 2, .node = 5, .address = {0x2000, 1}, .data = std::vector<std::byte>(8)}},
      now_);
  carry();
  EXPECT_EQ(request(16), "010100201B080000000000000000");
  line::Reply reply;
  EXPECT_FALSE(line(1).pop_reply(reply));
  device({0x21, 1, 0x00, 0x20});
  pass(milliseconds(1));
  ASSERT_TRUE(line(1).pop_reply(reply));
  EXPECT_EQ(reply.tag, 7U);
  EXPECT_EQ(reply.error, Error{});
  expect_nothing_left();
}

TEST_F(UsdoRouting, ACommandOnALineOfCanopenFdReachesAClassicalDevice) {
  start();
  line(2).execute(
      {.tag = 7, .request = line::NetworkRead{.network = 1, .node = 9, .address = {0x1000, 0}}},
      now_);
  carry();
  EXPECT_EQ(sent(1), Frames{"609 4000100000000000"});
  hear(1, 0x589, {0x43, 0, 0x10, 0, 1, 2, 3, 4});
  pass(milliseconds(1));
  line::Reply reply;
  ASSERT_TRUE(line(2).pop_reply(reply));
  EXPECT_EQ(reply.error, Error{});
  EXPECT_EQ(reply.bytes(),
            (std::vector<std::byte>{std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}}));
  EXPECT_EQ(sent(2), Frames{});
  expect_nothing_left();
}

// A device that needs longer than the time-outs of the connection keeps it.
TEST_F(UsdoRouting, AnAnswerMayTakeLongerThanTheTimeOutsOfTheConnection) {
  of_line(1).frame_timeout = milliseconds(10);  // that of the other line is longer
  config_of(2).sdo_timeout = seconds(2);
  start();
  open_and_read();
  pass(seconds(1));
  EXPECT_EQ(sent(1), Frames{});
  device({0x31, 1, 0x00, 0x20, 5, 1, 0x77});
  pass(milliseconds(1));
  EXPECT_EQ(sent(1), Frames{"5FF 4F00200177000000"});
  expect_nothing_left();
}

}  // namespace
}  // namespace linegate::routing::test
