// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/reply_codec.h"

#include <set>
#include <string>

#include <gtest/gtest.h>

#include "stack/line/command.h"

namespace linegate::dds {
namespace {

using line::ReplyData;
using manager::BootFinding;
using manager::BootOutcome;
using manager::NodeReport;
using scan::ScannedNode;
using Bytes = std::vector<std::byte>;

Bytes octets(std::initializer_list<unsigned> values) {
  Bytes out;
  for (const unsigned value : values)
    out.push_back(static_cast<std::byte>(value));
  return out;
}

std::optional<ReplyData> decode(const request::Request& request, const Bytes& bytes) {
  return decode_reply(request, Error{}, bytes);
}

BootFinding aborted() {
  return {.kind = BootFinding::Kind::abort,
          .object = {0x1017, 0},
          .abort = AbortCode::no_object,
          .expected = 0,
          .found = 0};
}

BootFinding differs() {
  return {.kind = BootFinding::Kind::value,
          .object = {0x1018, 2},
          .abort = AbortCode::none,
          .expected = 7,
          .found = 0x1234'5678};
}

manager::Connection stale_connection() {
  return {.number = 3,
          .client = 5,
          .server = 8,
          .client_record = 0x1280,
          .server_record = 0x1201,
          .request = 0x681,
          .response = 0x680,
          .state = manager::ConnectionState::stale,
          .abort = AbortCode::timeout};
}

// The data of each kind of reply, as in idl/COMMANDS.md.
TEST(ReplyCodec, BytesAreAsDocumented) {
  const line::ListedObject listed{.address = {0x2100, 1},
                                  .type = od::DataType::unsigned16,
                                  .access = od::Access::rww,
                                  .mappable = true,
                                  .application = true,
                                  .name = "Rec",
                                  .value = octets({5, 0})};
  const std::pair<ReplyData, Bytes> known[] = {
      {{}, {}},
      {octets({1, 2}), octets({1, 2})},
      {std::vector{listed}, octets({0x00, 0x21, 1, 6, 0, 4, 5, 3, 'R', 'e', 'c', 2, 5, 0})},
      {line::WrittenBySdo{}, octets({0})},
      {line::WrittenByPdo{3, line::PdoWait::none}, octets({1, 3, 0, 0})},
      {line::WrittenByPdo{3, line::PdoWait::values, {1, 0x100}},
       octets({1, 3, 0, 2, 1, 0, 0, 0, 0, 1, 0, 0})},
      {line::SentByMpdo{0x102}, octets({2, 1})},
      {line::TriggeredPdos{3, 4}, octets({3, 0, 4, 0})},
      {line::ProgramFault{{0x1F57, 1}, 4}, octets({0x57, 0x1F, 1, 4, 0, 0, 0})},
      {std::vector{ScannedNode{
           .id = 5, .end = AbortCode::timeout, .values = {{{0x1A00, 1}, octets({0x10, 0})}}}},
       octets({5, 0, 0, 4, 5, 13, 0, 0, 0, 1, 0, 0, 0, 0x00, 0x1A, 1, 2, 0, 0, 0, 0x10, 0})},
      {std::vector{NodeReport{
           .node = 7,
           .boot = 'J',
           .end = AbortCode::no_object,
           .differences = {{.object = {0x1017, 0}, .expected = octets({100, 0}), .found = {}}}}},
       octets({7, 'J', 0, 0, 2, 6, 1, 0,   0, 0, 0x17, 0x10, 0, 0,
               0, 0,   0, 2, 0, 0, 0, 100, 0, 0, 0,    0,    0})},
      {line::SdoConnections{stale_connection()},
       octets({3, 0, 0, 0, 5, 8, 0x80, 0x12, 1, 0x12, 0x81, 6, 0x80, 6, 3, 0, 0, 4, 5})},
  };
  for (const auto& [data, bytes] : known)
    EXPECT_EQ(encode_reply(data), bytes) << data.index();
}

TEST(ReplyCodec, EachResultComesBackAsItWent) {
  const request::Request list = line::LocalRead{.what = line::ObjectRange{}};
  const std::pair<request::Request, ReplyData> known[] = {
      {line::SdoRead{}, octets({1, 2})},
      {line::SdoWrite{}, ReplyData{}},
      {line::LocalRead{.what = od::Address{0x1000, 0}}, octets({1})},
      {list, std::vector{line::ListedObject{.address = {0x2100, 1}, .name = "Rec"}}},
      {list, std::vector<line::ListedObject>{}},
      {line::SingleOutput{}, ReplyData{}},
      {line::SingleOutput{}, line::WrittenByPdo{3, line::PdoWait::turn}},
      {line::ObjectWrite{}, line::WrittenBySdo{}},
      {line::ObjectWrite{}, line::WrittenByPdo{3, line::PdoWait::values, {1, 2}}},
      {line::PdoTrigger{}, line::TriggeredPdos{3, 4}},
      {line::MpdoWrite{}, line::SentByMpdo{100}},
      {line::ConnectionOpen{}, line::SdoConnections{stale_connection()}},
      {line::ConnectionClose{}, ReplyData{}},
      {line::ConnectionList{}, line::SdoConnections{}},
      {line::Scan{}, std::vector<ScannedNode>{}},
      {line::Boot{}, std::vector{BootOutcome{.node = 5, .letter = 'M', .finding = differs()}}},
      {line::Configure{}, std::vector{NodeReport{.node = 5}}},
      {line::LssRequest{}, octets({0, 0, 0})},
      {request::Versions{}, octets({'v', '1'})},
  };
  const ReplyData fault = line::ProgramFault{{0x1F57, 1}, 4};
  std::set<std::size_t> tested{fault.index()};
  for (const auto& [request, data] : known) {
    const auto back = decode(request, encode_reply(data));
    ASSERT_TRUE(back) << request::command_name(request::kind(request));
    EXPECT_TRUE(*back == data) << request::command_name(request::kind(request));
    tested.insert(data.index());
  }
  const auto back =
      decode_reply(line::ProgramDownload{}, to_error(AbortCode::hardware), encode_reply(fault));
  EXPECT_TRUE(back && *back == fault);
  EXPECT_EQ(tested.size(), std::variant_size_v<ReplyData>) << "each type of result";
}

TEST(ReplyCodec, TheTextOfARefusalComesBack) {
  const ReplyData text = octets({'n', 'o'});
  const Error refused = line::to_error(line::Refusal::bad_request);
  const auto back = decode_reply(request::BusFault{}, refused, encode_reply(text));
  EXPECT_TRUE(back && *back == text);
}

TEST(ReplyCodec, ALongNameIsCutAndALongValueLeftOut) {
  const request::Request list = line::LocalRead{.what = line::ObjectRange{}};
  const std::vector objects{line::ListedObject{
      .address = {0x2100, 0}, .name = std::string(300, 'n'), .value = Bytes(256)}};
  const auto back = decode(list, encode_reply(objects));
  ASSERT_TRUE(back);
  const auto& listed = std::get<std::vector<line::ListedObject>>(*back);
  ASSERT_EQ(listed.size(), 1U);
  EXPECT_EQ(listed[0].name, std::string(252, 'n') + "...");
  EXPECT_TRUE(listed[0].value.empty());
}

TEST(ReplyCodec, WhatIsNoAnswerToTheRequestIsNotRead) {
  const request::Request list = line::LocalRead{.what = line::ObjectRange{}};
  Bytes cut = encode_reply(std::vector{line::ListedObject{.name = "Rec", .value = octets({5})}});
  cut.pop_back();
  EXPECT_FALSE(decode(list, cut));
  EXPECT_FALSE(decode(list, octets({0, 0x21, 1})));
  EXPECT_FALSE(decode(line::ObjectWrite{}, octets({0, 1})));
  EXPECT_FALSE(decode(line::ObjectWrite{}, octets({2})));
  EXPECT_FALSE(decode(line::ObjectWrite{}, octets({1, 3, 0})));
  EXPECT_FALSE(decode(line::ObjectWrite{}, octets({1, 3, 0, line::kPdoWaits})));
  EXPECT_FALSE(decode(line::PdoTrigger{}, octets({1, 0, 2})));
  EXPECT_FALSE(decode(line::MpdoWrite{}, {}));
  Bytes connection = encode_reply(line::SdoConnections{stale_connection()});
  EXPECT_TRUE(decode(line::ConnectionList{}, connection));
  connection[14] = std::byte{4};
  EXPECT_FALSE(decode(line::ConnectionList{}, connection)) << "no such state";
  connection[14] = std::byte{1};
  connection[5] = std::byte{0};
  EXPECT_FALSE(decode(line::ConnectionList{}, connection)) << "no server";
  connection.pop_back();
  EXPECT_FALSE(decode(line::ConnectionList{}, connection));
}

// --- results of nodes ---------------------------------------------------------------------------

template <class Result>
std::optional<std::vector<Result>> results_of(const request::Request& request,
                                              std::span<const std::byte> bytes) {
  const auto data = decode_reply(request, Error{}, bytes);
  return data ? std::optional(std::get<std::vector<Result>>(*data)) : std::nullopt;
}
std::optional<std::vector<BootOutcome>> outcomes_of(std::span<const std::byte> bytes) {
  return results_of<BootOutcome>(line::Boot{}, bytes);
}
std::optional<std::vector<NodeReport>> reports_of(std::span<const std::byte> bytes) {
  return results_of<NodeReport>(line::Configure{}, bytes);
}
std::optional<std::vector<ScannedNode>> nodes_of(std::span<const std::byte> bytes) {
  return results_of<ScannedNode>(line::Scan{}, bytes);
}

TEST(BootReport, IsEighteenBytesANode) {
  const std::vector<BootOutcome> outcomes = {{.node = 5, .letter = 'M', .finding = differs()}};
  EXPECT_EQ(encode_reply(outcomes),
            octets({5, 'M', 0x18, 0x10, 2, 2, 0, 0, 0, 0, 7, 0, 0, 0, 0x78, 0x56, 0x34, 0x12}));
}

TEST(BootReport, IsReadAsItWasWritten) {
  const std::vector<BootOutcome> outcomes = {{.node = 1, .letter = manager::kBooted, .finding = {}},
                                             {.node = 2, .letter = 'J', .finding = aborted()},
                                             {.node = 127, .letter = 'M', .finding = differs()}};
  const auto read = outcomes_of(encode_reply(outcomes));
  ASSERT_TRUE(read);
  EXPECT_EQ(*read, outcomes);
  EXPECT_TRUE(outcomes_of({})->empty());
}

TEST(BootReport, OfHalfANodeIsRefused) {
  const std::vector<BootOutcome> outcomes = {{.node = 1, .letter = 'B', .finding = aborted()}};
  Bytes bytes = encode_reply(outcomes);
  bytes.pop_back();
  EXPECT_FALSE(outcomes_of(bytes));
}

TEST(ConfigurationReport, IsReadAsItWasWritten) {
  const std::vector<NodeReport> nodes = {
      {.node = 5},
      {.node = 7,
       .boot = 'J',
       .end = AbortCode::value_too_high,
       .differences = {
           {.object = {0x2001, 3},
            .expected = octets({2, 0, 0, 0}),
            .abort = AbortCode::value_too_high},
           {.object = {0x1017, 0}, .expected = octets({100, 0}), .found = octets({0, 0})}}}};
  const Bytes bytes = encode_reply(nodes);
  EXPECT_EQ(bytes.size(), 10U + 10U + 19U + 19U);
  const auto read = reports_of(bytes);
  ASSERT_TRUE(read);
  EXPECT_EQ(*read, nodes);
  EXPECT_TRUE(read->at(0).good());
  EXPECT_FALSE(read->at(1).good());
  for (std::size_t size = 1; size < bytes.size(); ++size) {
    const auto cut = reports_of(std::span(bytes).first(size));
    EXPECT_TRUE(!cut || cut->size() == 1) << size;
  }
  Bytes count = bytes;
  count[9] = std::byte{0xFF};
  EXPECT_FALSE(reports_of(count));
  Bytes node = bytes;
  node[0] = std::byte{0};
  EXPECT_FALSE(reports_of(node));
}

TEST(ScanReport, IsReadAsItWasWritten) {
  const ScannedNode first{.id = 3,
                          .values = {{{0x1000, 0}, octets({1, 0, 0, 0})},
                                     {{0x1A00, 1}, octets({0x10, 0, 0x41, 0x60})}}};
  const ScannedNode second{.id = 127, .end = AbortCode::timeout, .values = {}};
  const std::vector<ScannedNode> nodes{first, second};
  const Bytes bytes = encode_reply(nodes);
  EXPECT_EQ(bytes[0], std::byte{3});
  const auto read = nodes_of(bytes);
  ASSERT_TRUE(read);
  EXPECT_EQ(*read, nodes);
  EXPECT_EQ((*read)[0].number({0x1A00, 1}), 0x6041'0010U);
}

TEST(ScanReport, IsRefusedWhereItIsCutOrANodeIdIsNone) {
  const std::vector<ScannedNode> nodes{{.id = 3, .values = {{{0x1000, 0}, octets({1, 0, 0, 0})}}}};
  Bytes bytes = encode_reply(nodes);
  for (std::size_t size = 1; size < bytes.size(); ++size)
    EXPECT_FALSE(nodes_of(std::span(bytes).first(size))) << size;
  bytes[0] = std::byte{128};
  EXPECT_FALSE(nodes_of(bytes));
}

}  // namespace
}  // namespace linegate::dds
