// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/request_codec.h"

#include <gtest/gtest.h>

#include "stack/image/layout.h"

namespace linegate::dds {
namespace {

using Bytes = std::vector<std::byte>;

Bytes bytes(std::initializer_list<unsigned> values) {
  Bytes out;
  for (const unsigned value : values)
    out.push_back(static_cast<std::byte>(value));
  return out;
}

struct Sample {
  v1::CommandRequest members;
  Bytes data;
};

Sample encode(const request::Request& request) {
  Sample out;
  write_members(request, out.members);
  out.data = encode_data(request);
  return out;
}

// What is wrong with it; empty if nothing is.
std::string decode(const Sample& sample, request::Request& out) {
  const char* why = read_members(sample.members, out);
  if (why == nullptr)
    why = decode_data(sample.data, out);
  return why == nullptr ? "" : why;
}
std::string fault_of(const Sample& sample) {
  request::Request request;
  return decode(sample, request);
}

// With a value in each member.
std::vector<request::Request> one_of_each_kind() {
  const Bytes value = bytes({1, 2, 3, 4});
  const od::Address address{0x6200, 2};
  line::OwnObject object{.index = 0x2200, .in_image = true, .offset = 6};
  object.variable.sub = 1;
  object.variable.name = "Up";
  object.variable.type = od::DataType::integer16;
  object.variable.access = od::Access::rww;
  object.variable.mappable = true;
  object.variable.value = bytes({0xFE, 0xFF});
  object.variable.high_limit = bytes({9, 0});
  return {
      line::SdoRead{.node = 5, .address = address, .from_image = true, .from_scan = true},
      line::SdoWrite{.node = 5, .address = address, .data = value},
      line::LocalRead{.node = 5, .what = address},
      line::LocalWrite{.node = 5, .address = address, .as_owner = true, .data = value},
      line::SingleOutput{.entry = 70'000, .data = value},
      line::EmcySend{.node = 5,
                     .code = 0x2310,
                     .error_register = 4,
                     .manufacturer = {std::byte{1}, std::byte{2}}},
      line::NmtRequest{.node = 5, .command = nmt::Command::reset_node},
      request::Versions{},
      line::NetworkRead{.network = 12, .node = 5, .address = address, .as_device = true, .hops = 3},
      line::NetworkWrite{.network = 12, .node = 5, .address = address, .data = value, .hops = 255},
      request::BusRestart{},
      line::RoutingTrace{.duration = std::chrono::seconds(30)},
      line::Scan{.node = 5},
      request::BusFault{"lost=1%"},
      line::Boot{.node = 5},
      line::Configure{.node = 5, .apply = true},
      line::ProgramDownload{.node = 5, .number = 2, .program = value},
      line::LssRequest{.procedure = lss::Procedure::configure_node_id, .arguments = bytes({9})},
      line::ObjectWrite{
          .node = 5, .address = address, .data = value, .force_sdo = true, .keep_pdo = true},
      line::PdoTrigger{.node = 5, .number = 3},
      line::CanSend{can::make_frame(0x150, {1, 2, 3})},
      line::CanListen{.identifier = 0x100,
                      .mask = 0x700,
                      .extended = false,
                      .duration = std::chrono::seconds(5)},
      line::ObjectCreate{.what = object},
      line::ScanApply{.node = 5, .set_up = true, .restore = true},
      line::PdoRequest{.node = 5, .number = 3},
      line::MpdoWrite{.node = 5, .address = address, .data = value, .tpdo = 100},
      request::JournalRead{.line = "press",
                           .node = 5,
                           .kind = EventKind::emcy,
                           .least = EventSeverity::warning,
                           .text = "lost",
                           .since = Instant(std::chrono::seconds(1)),
                           .until = Instant(std::chrono::seconds(2)),
                           .after = request::EventPosition{3, 4},
                           .cursor = {5, 6},
                           .most = 7},
      line::ConnectionOpen{.node = 5, .server = 8},
      line::ConnectionClose{.number = 70'000},
      line::ConnectionList{},
      line::SleepRequest{line::SleepAction::consent},
  };
}

// And those whose members have another meaning then.
std::vector<request::Request> requests() {
  std::vector<request::Request> out = one_of_each_kind();
  can::Frame fast = can::make_frame(0x150, {1, 2});
  fast.flags = can::Frame::kExtended | can::Frame::kFd | can::Frame::kBitRateSwitch;
  can::Frame remote = can::make_frame(0x150);
  remote.flags = can::Frame::kRemote;
  remote.length = 8;
  out.insert(out.end(),
             {line::LocalRead{.what = line::ObjectRange{0x2000, 0x20FF}},
              line::PdoTrigger{.output_byte = 10}, line::CanSend{fast}, line::CanSend{remote},
              line::CanListen{.identifier = 0x1234'5678, .extended = true},
              line::CanListen{.mask = 0}, line::ObjectCreate{.what = line::ObjectRemoval{0x2200}}});
  return out;
}

TEST(RequestCodec, EachKindComesBackAsItWent) {
  ASSERT_EQ(one_of_each_kind().size(), request::kCommandKinds);
  for (const request::Request& request : requests()) {
    const Sample sample = encode(request);
    request::Request back;
    EXPECT_EQ(decode(sample, back), "") << request::command_name(request::kind(request));
    EXPECT_EQ(request::kind(back), request::kind(request));
    const Sample again = encode(back);
    EXPECT_TRUE(again.members == sample.members) << request::command_name(request::kind(request));
    EXPECT_EQ(again.data, sample.data) << request::command_name(request::kind(request));
  }
}

TEST(RequestCodec, EachKindHasAnAlternativeAtItsPlace) {
  const std::vector<request::Request> each = one_of_each_kind();
  for (std::size_t i = 0; i < each.size(); ++i)
    EXPECT_EQ(static_cast<std::size_t>(request::kind(each[i])), i);
}

TEST(RequestCodec, ATriggerOfNothingDoesNotBecomeOneOfTheFirstByte) {
  request::Request request;
  EXPECT_EQ(decode(encode(line::PdoTrigger{}), request), "");
  const auto& trigger = std::get<line::PdoTrigger>(std::get<line::Request>(request));
  ASSERT_TRUE(trigger.output_byte);
  EXPECT_GE(*trigger.output_byte, image::kMaxAreaBytes) << "no output is there";
}

TEST(RequestCodec, ADataTypeThatCiaDoesNotDefineIsRefused) {
  Sample sample = encode(one_of_each_kind()[v1::COMMAND_OBJECT_CREATE]);
  for (const unsigned type : {0x00U, 0x0EU, 0x17U, 0x1CU, 0xFFU}) {
    sample.data[0] = static_cast<std::byte>(type);
    EXPECT_EQ(fault_of(sample), "data has a data type that CiA 301 does not define") << type;
  }
}

// idl/COMMANDS.md, byte for byte.
TEST(RequestCodec, DataAreAsDocumented) {
  EXPECT_EQ(encode(one_of_each_kind()[v1::COMMAND_OBJECT_CREATE]).data,
            bytes({3, 0, 4, 5, 2, 'U', 'p', 2, 0xFE, 0xFF, 0, 2, 9, 0}));
  EXPECT_EQ(encode(one_of_each_kind()[v1::COMMAND_CAN_LISTEN]).data,
            bytes({0x00, 0x07, 0x00, 0x80}));
  EXPECT_EQ(encode(line::CanListen{.identifier = 0x150, .extended = false}).data, Bytes{});
  EXPECT_EQ(encode(line::CanListen{.mask = 0}).data, bytes({0, 0, 0, 0}));
  const Sample frame = encode(requests()[request::kCommandKinds + 2]);
  EXPECT_EQ(frame.members.entry(), 0x8000'0150U);
  EXPECT_EQ(frame.members.sub(), 5);
  const Sample remote = encode(requests()[request::kCommandKinds + 3]);
  EXPECT_EQ(remote.members.entry(), 0x4000'0150U);
  EXPECT_EQ(remote.members.code(), 8);
  EXPECT_EQ(remote.data, Bytes{});
}

TEST(RequestCodec, AListWithoutItsEndIsOfAllObjects) {
  Sample sample = encode(line::LocalRead{.what = line::ObjectRange{0x2000, 0xFFFF}});
  for (const std::uint32_t entry : {0U, 0x1'0000U}) {
    sample.members.entry(entry);
    request::Request request;
    EXPECT_EQ(decode(sample, request), "");
    const auto& of_line = std::get<line::Request>(request);
    const auto& range = std::get<line::ObjectRange>(std::get<line::LocalRead>(of_line).what);
    EXPECT_EQ(range.last, 0xFFFF);
  }
}

TEST(RequestCodec, WhatHasNoMeaningIsRefused) {
  const auto spoilt = [](unsigned kind, auto spoil) {
    Sample sample = encode(one_of_each_kind()[kind]);
    spoil(sample);
    return fault_of(sample);
  };
  const auto with_code = [&](unsigned kind, std::uint16_t code) {
    return spoilt(kind, [code](Sample& sample) { sample.members.code(code); });
  };
  const auto with_data = [&](unsigned kind, const Bytes& data) {
    return spoilt(kind, [&data](Sample& sample) { sample.data = data; });
  };
  EXPECT_EQ(with_code(v1::COMMAND_SDO_READ, 4), "code has other bits than 0 and 1");
  EXPECT_EQ(with_code(v1::COMMAND_LOCAL_READ, 1), "code is not 0 or 2");
  EXPECT_EQ(with_code(v1::COMMAND_LOCAL_READ, 3), "code is not 0 or 2");
  EXPECT_NE(with_code(v1::COMMAND_OBJECT_WRITE, 4), "");
  EXPECT_NE(with_code(v1::COMMAND_LOCAL_WRITE, 2), "");
  EXPECT_NE(with_code(v1::COMMAND_CONFIGURE, 2), "");
  EXPECT_NE(with_code(v1::COMMAND_SCAN_APPLY, 4), "");
  EXPECT_NE(with_code(v1::COMMAND_OBJECT_CREATE, 2), "");
  EXPECT_NE(with_code(v1::COMMAND_LSS, lss::kProcedures), "");
  EXPECT_NE(with_code(v1::COMMAND_CAN_SEND, 3), "") << "a length, but no remote frame";
  EXPECT_NE(with_data(v1::COMMAND_CAN_LISTEN, bytes({1, 2})), "");
  EXPECT_NE(with_data(v1::COMMAND_CAN_SEND, Bytes(65)), "");
  EXPECT_NE(with_data(v1::COMMAND_SCAN, bytes({1})), "");
  EXPECT_NE(with_data(v1::COMMAND_BUS_FAULT, Bytes(257)), "");
  EXPECT_NE(spoilt(v1::COMMAND_CAN_SEND, [](Sample& s) { s.members.sub(1); }), "");
  EXPECT_NE(spoilt(v1::COMMAND_CAN_SEND, [](Sample& s) { s.members.entry(0x4000'0150); }), "")
      << "a remote frame has no data";
  EXPECT_NE(spoilt(v1::COMMAND_CAN_LISTEN, [](Sample& s) { s.members.entry(0x2000'0150); }), "")
      << "a bit without meaning";
  EXPECT_NE(spoilt(v1::COMMAND_OBJECT_CREATE, [](Sample& s) { s.data.pop_back(); }), "");
  EXPECT_NE(spoilt(v1::COMMAND_OBJECT_CREATE, [](Sample& s) { s.data[2] = std::byte{6}; }), "")
      << "no access";
  EXPECT_NE(spoilt(v1::COMMAND_OBJECT_CREATE, [](Sample& s) { s.data[3] = std::byte{8}; }), "")
      << "no flag";
}

}  // namespace
}  // namespace linegate::dds
