// SPDX-License-Identifier: Apache-2.0
// The typed commands of linegate.h: each sends what the one of commands.h sends, and its result is
// the same.
#include <array>
#include <functional>
#include <limits>
#include <tuple>

#include <gtest/gtest.h>

#include "bridges/client/c_api.h"
#include "bridges/client/commands.h"
#include "bridges/dds/raw_request.h"
#include "bridges/dds/reply_codec.h"

#include "fake_link.h"

extern "C" int use_commands_in_c(linegate_client* client);  // c_use.c

namespace linegate::client {
namespace {

using namespace std::chrono_literals;

constexpr int kTime = 1000;
const Bytes kSeven{std::byte{7}};

struct CommandsInC : testing::Test {
  std::shared_ptr<FakeWorld> world = std::make_shared<FakeWorld>();
  Client same = fake_client(world);  // before the one in C: both receive what the world has then
  Line line_of_same = same.line("press");
  Commands press{line_of_same};
  linegate_client* client = adopt(fake_client(world));
  int line = linegate_line(client, "press");

  void SetUp() override {
    world->whole_line(1);
    same.poll(0ms);
    world->whole_line(1);
    ASSERT_EQ(linegate_poll(client, 0), LINEGATE_OK);
    ASSERT_EQ(linegate_line_status(client, line), LINEGATE_STATUS_READY);
    ASSERT_TRUE(line_of_same.ready());
  }
  void TearDown() override { linegate_close(client); }

  // The members of the last request.
  auto sent() const {
    const dds::RawRequest raw = dds::to_raw(world->requests.back().second);
    return std::tuple(raw.kind, raw.node, raw.index, raw.sub, raw.nmt, raw.code, raw.error_register,
                      raw.entry, raw.data);
  }
  void expect_same(const char* what, int in_c, const Call& call) {
    ASSERT_GT(in_c, 0) << what;
    EXPECT_EQ(call.outcome(), Outcome::pending) << what;
    ASSERT_EQ(world->sent % 2, 0U) << what;
    const auto of_same = sent();
    world->requests.pop_back();
    EXPECT_EQ(sent(), of_same) << what;
  }
  int answered(int call, const Bytes& bytes, linegate::Error error = {}) {
    EXPECT_GT(call, 0);
    world->reply(world->sent, error, bytes);
    EXPECT_EQ(linegate_poll(client, 0), LINEGATE_OK);
    return call;
  }
  int answered(int call, const line::ReplyData& reply, linegate::Error error = {}) {
    return answered(call, dds::encode_reply(reply), error);
  }
  template <class T>
  static T empty() {
    T out{};
    out.size = sizeof(T);
    return out;
  }
};

TEST_F(CommandsInC, ObjectsAreThoseOfCpp) {
  const char byte = 7;
  expect_same("write_object",
              linegate_write_object(client, line, 5, 0x6200, 1, &byte, 1, LINEGATE_KEEP_PDO, kTime),
              press.write_object(5, 0x6200, 1, kSeven, false, true));
  expect_same("by SDO",
              linegate_write_object(client, line, 5, 0x6200, 1, &byte, 1, LINEGATE_BY_SDO, kTime),
              press.write_object(5, 0x6200, 1, kSeven, true));
  const linegate_setting output{
      .name = "ram.Out", .type = LINEGATE_UNSIGNED, .unsigned_integer = 9};
  expect_same("write_output", linegate_write_output(client, line, &output, kTime),
              press.write_output("ram.Out", std::uint64_t{9}));
  expect_same("read_network", linegate_read_network(client, line, 300, 9, 0x1018, 4, kTime),
              press.read_network(300, 9, 0x1018, 4));
  expect_same("write_network",
              linegate_write_network(client, line, 300, 9, 0x1017, 0, &byte, 1, kTime),
              press.write_network(300, 9, 0x1017, 0, kSeven));
  expect_same("read_own", linegate_read_own(client, line, 0x1018, 4, 3, kTime),
              press.read_own(0x1018, 4, 3));
  expect_same("write_own", linegate_write_own(client, line, 0x1017, 0, &byte, 1, 3, 1, kTime),
              press.write_own(0x1017, 0, kSeven, 3, true));
  expect_same("list_objects", linegate_list_objects(client, line, 0x1000, 0x1FFF, 3, kTime),
              press.list_objects(0x1000, 0x1FFF, 3));
  linegate_object object = empty<linegate_object>();
  object.index = 0x2000;
  object.sub = 1;
  object.type = 5;
  object.access = 2;
  object.mappable = 1;
  object.stored = 1;
  object.name = "Speed";
  object.value = &byte;
  object.length = 1;
  const ListedObject made{.index = 0x2000,
                          .sub = 1,
                          .type = 5,
                          .access = 2,
                          .mappable = true,
                          .stored = true,
                          .name = "Speed",
                          .value = kSeven};
  expect_same("create_object", linegate_create_object(client, line, &object, -1, kTime),
              press.create_object(made));
  expect_same("in the image", linegate_create_object(client, line, &object, 12, kTime),
              press.create_object(made, 12));
  expect_same("remove_object", linegate_remove_object(client, line, 0x2000, kTime),
              press.remove_object(0x2000));
}

TEST_F(CommandsInC, NodesAreThoseOfCpp) {
  expect_same("scan", linegate_scan(client, line, 4, kTime), press.scan(4));
  expect_same("apply_scan", linegate_apply_scan(client, line, 0, 1, 0, kTime),
              press.apply_scan(0, true, false));
  expect_same("restore", linegate_apply_scan(client, line, 0, 0, 1, kTime),
              press.apply_scan(0, false, true));
  expect_same("boot", linegate_boot(client, line, 4, kTime), press.boot(4));
  expect_same("compare", linegate_compare(client, line, 4, kTime), press.compare(4));
  expect_same("configure", linegate_configure(client, line, 4, kTime), press.configure(4));
  expect_same("program", linegate_program(client, line, 4, 2, "\7", 1, kTime),
              press.program(4, 2, kSeven));
  expect_same("open_connection", linegate_open_connection(client, line, 1, 2, kTime),
              press.open_connection(1, 2));
  expect_same("close_connection", linegate_close_connection(client, line, 70'000, kTime),
              press.close_connection(70'000));
  expect_same("connections", linegate_connections(client, line, kTime), press.connections());
  expect_same("check_sleep", linegate_check_sleep(client, line, kTime), press.check_sleep());
  expect_same("sleep", linegate_sleep(client, line, kTime), press.sleep());
  expect_same("sleep_unchecked", linegate_sleep_unchecked(client, line, kTime),
              press.sleep_unchecked());
  expect_same("wake_up", linegate_wake_up(client, line, kTime), press.wake_up());
  expect_same("object_to_sleep", linegate_object_to_sleep(client, line, 1, kTime),
              press.object_to_sleep(true));
  expect_same("consent", linegate_object_to_sleep(client, line, 0, kTime),
              press.object_to_sleep(false));
}

TEST_F(CommandsInC, LssIsThatOfCpp) {
  const linegate_lss_address address{.vendor = 1, .product = 2, .revision = 3, .serial = 4};
  const LssAddress of_same{1, 2, 3, 4};
  expect_same("switch_global", linegate_lss_switch_global(client, line, 1, kTime),
              press.lss_switch_global(true));
  expect_same("switch_selective", linegate_lss_switch_selective(client, line, &address, kTime),
              press.lss_switch_selective(of_same));
  expect_same("set_node_id", linegate_lss_set_node_id(client, line, 9, 1, kTime),
              press.lss_set_node_id(9, true));
  expect_same("set_bit_timing", linegate_lss_set_bit_timing(client, line, 0, 4, kTime),
              press.lss_set_bit_timing(0, 4));
  expect_same("activate", linegate_lss_activate_bit_timing(client, line, 0x1234, kTime),
              press.lss_activate_bit_timing(0x1234ms));
  expect_same("store", linegate_lss_store(client, line, kTime), press.lss_store());
  expect_same("inquire_address", linegate_lss_inquire_address(client, line, kTime),
              press.lss_inquire_address());
  expect_same("inquire_node_id", linegate_lss_inquire_node_id(client, line, kTime),
              press.lss_inquire_node_id());
  expect_same("identify", linegate_lss_identify(client, line, &address, 5, 6, kTime),
              press.lss_identify(of_same, 5, 6));
  expect_same("unconfigured", linegate_lss_identify_unconfigured(client, line, kTime),
              press.lss_identify_unconfigured());
  expect_same("fastscan", linegate_lss_fastscan(client, line, 3, &address, kTime),
              press.lss_fastscan(3, of_same));
  expect_same("any", linegate_lss_fastscan(client, line, 0, nullptr, kTime), press.lss_fastscan());
  expect_same("assign", linegate_lss_assign_node_ids(client, line, kTime),
              press.lss_assign_node_ids());
}

TEST_F(CommandsInC, PdosFramesAndTheGatewayAreThoseOfCpp) {
  const char byte = 7;
  const std::array<std::uint8_t, 5> manufacturer{1, 2, 3, 4, 5};
  expect_same("trigger_pdo", linegate_trigger_pdo(client, line, 3, 4, kTime),
              press.trigger_pdo(3, 4));
  expect_same("trigger_pdos_of", linegate_trigger_pdos_of(client, line, "ram.Out", kTime),
              press.trigger_pdos_of("ram.Out"));
  expect_same("request_pdo", linegate_request_pdo(client, line, 4, 2, kTime),
              press.request_pdo(4, 2));
  expect_same("write_mpdo", linegate_write_mpdo(client, line, 4, 0x6200, 1, &byte, 1, 8, kTime),
              press.write_mpdo(4, 0x6200, 1, kSeven, 8));
  expect_same(
      "send_emcy", linegate_send_emcy(client, line, 0x5000, 1, manufacturer.data(), 3, kTime),
      press.send_emcy(0x5000, 1,
                      {std::byte{1}, std::byte{2}, std::byte{3}, std::byte{4}, std::byte{5}}, 3));
  expect_same("without", linegate_send_emcy(client, line, 0x5000, 1, nullptr, 0, kTime),
              press.send_emcy(0x5000, 1));
  expect_same("send_frame", linegate_send_frame(client, line, 0x123, &byte, 1, 0, kTime),
              press.send_frame(0x123, kSeven));
  expect_same(
      "of CAN FD",
      linegate_send_frame(client, line, 0x123'4567, &byte, 1,
                          LINEGATE_EXTENDED | LINEGATE_FD | LINEGATE_BIT_RATE_SWITCH, kTime),
      press.send_frame(0x123'4567, kSeven, true, true, true));
  expect_same("send_remote_frame", linegate_send_remote_frame(client, line, 0x123, 4, 1, kTime),
              press.send_remote_frame(0x123, 4, true));
  expect_same("listen", linegate_listen(client, line, 60, 0x123, 0x7FF, 0, kTime),
              press.listen(60s, 0x123, 0x7FF, false));
  expect_same("to all", linegate_listen(client, line, 60, 0, 0, -1, kTime), press.listen(60s));
  expect_same("trace_routing", linegate_trace_routing(client, line, 60, kTime),
              press.trace_routing(60s));
  expect_same("versions", linegate_versions(client, line, kTime), press.versions());
  expect_same("restart_bus", linegate_restart_bus(client, line, kTime), press.restart_bus());
  expect_same("set_bus_faults", linegate_set_bus_faults(client, line, "lost=1%", kTime),
              press.set_bus_faults("lost=1%"));
  auto query = empty<linegate_journal_query>();
  expect_same("read_journal", linegate_read_journal(client, line, &query, kTime),
              press.read_journal({}));
  query.flags = LINEGATE_JOURNAL_NODE | LINEGATE_JOURNAL_KIND | LINEGATE_JOURNAL_SINCE |
                LINEGATE_JOURNAL_UNTIL | LINEGATE_JOURNAL_NEWEST_FIRST;
  query.line = "press";
  query.text = "lost";
  query.node = 5;
  query.kind = 3;
  query.severity = 1;
  query.since = 7;
  query.until = 9;
  query.most = 3;
  query.cursor_position = 11;
  query.cursor_check = 12;
  expect_same("of events", linegate_read_journal(client, line, &query, kTime),
              press.read_journal({.line = "press",
                                  .node = 5,
                                  .kind = 3,
                                  .severity = 1,
                                  .text = "lost",
                                  .since = 7,
                                  .until = 9,
                                  .cursor = {11, 12},
                                  .newest_first = true,
                                  .most = 3}));
  query = empty<linegate_journal_query>();
  query.flags = LINEGATE_JOURNAL_VALUES;
  expect_same("of values", linegate_read_journal(client, line, &query, kTime),
              press.read_journal({.values = true}));
}

// Numbers: parameters_test.cpp.
TEST_F(CommandsInC, APointerOrFlagThatIsNotValidIsAnError) {
  const char byte = 0;
  const linegate_setting unnamed{.name = nullptr, .type = LINEGATE_INTEGER};
  auto object = empty<linegate_object>();
  auto query = empty<linegate_journal_query>();
  query.flags = 1;
  object.size = sizeof object - 1;
  for (const int result : {
           linegate_write_object(client, line, 1, 0, 0, &byte, 1, 4, kTime),
           linegate_write_object(client, line, 1, 0, 0, nullptr, 1, 0, kTime),
           linegate_write_output(client, line, nullptr, kTime),
           linegate_write_output(client, line, &unnamed, kTime),
           linegate_create_object(client, line, &object, -1, kTime),
           linegate_create_object(client, line, nullptr, -1, kTime),
           linegate_program(client, line, 1, 1, &byte, std::numeric_limits<std::size_t>::max(),
                            kTime),
           linegate_lss_switch_selective(client, line, nullptr, kTime),
           linegate_lss_fastscan(client, line, 1, nullptr, kTime),
           linegate_trigger_pdos_of(client, line, nullptr, kTime),
           linegate_send_frame(client, line, 1, &byte, 1, 8, kTime),
           linegate_set_bus_faults(client, line, nullptr, kTime),
           linegate_read_journal(client, line, nullptr, kTime),
           linegate_read_journal(client, line, &query, kTime),
           linegate_boot(client, line + 1, 0, kTime),
           linegate_boot(nullptr, line, 0, kTime),
       })
    EXPECT_EQ(result, LINEGATE_ERROR_ARGUMENT);
  EXPECT_EQ(world->sent, 0U);
  linegate_result result{};
  const int refused = linegate_boot(client, line, 200, kTime);
  EXPECT_EQ(linegate_call_result(client, refused, &result), LINEGATE_OK);
  EXPECT_EQ(result.outcome, LINEGATE_REFUSED);
  EXPECT_EQ(world->sent, 0U);
}

TEST_F(CommandsInC, CommandsAreTriedAsOftenAsTheLineSays) {
  EXPECT_EQ(linegate_set_attempts(client, line, 3), LINEGATE_OK);
  const int call = linegate_restart_bus(client, line, kTime);
  answered(call, Bytes(), line::to_error(line::Refusal::busy));
  answered(call, Bytes(), line::to_error(line::Refusal::busy));
  EXPECT_EQ(world->sent, 3U);
  answered(call, Bytes());
  EXPECT_EQ(linegate_call_wait(client, call), 0);
}

TEST_F(CommandsInC, WhatHasNoRoomIsNotSent) {
  while (linegate_line(client, "press") > 0) {
  }
  EXPECT_EQ(linegate_boot(client, line, 0, kTime), LINEGATE_ERROR_FULL);
  EXPECT_EQ(world->sent, 0U);
}

TEST_F(CommandsInC, ResultsOfObjectsAreThoseOfTheReply) {
  auto delivery = empty<linegate_delivery>();
  const int written =
      answered(linegate_write_object(client, line, 1, 0x6200, 1, "\7", 1, 0, kTime),
               line::WrittenByPdo{.pdo = 3, .wait = line::PdoWait::values, .missing = {4, 5}});
  ASSERT_EQ(linegate_call_delivery(client, written, &delivery), LINEGATE_OK);
  EXPECT_EQ(delivery.way, 2);
  EXPECT_EQ(delivery.pdo, 3U);
  EXPECT_EQ(delivery.wait, 2);
  ASSERT_EQ(delivery.missing_count, 2U);
  EXPECT_EQ(delivery.missing[1], 5U);
  const int listed = answered(linegate_list_objects(client, line, 0, 0xFFFF, 0, kTime),
                              std::vector{line::ListedObject{.address = {0x1008, 1},
                                                             .type = od::DataType::visible_string,
                                                             .access = od::Access::rw,
                                                             .mappable = true,
                                                             .stored = true,
                                                             .application = true,
                                                             .name = "Name",
                                                             .value = kSeven}});
  auto object = empty<linegate_object>();
  ASSERT_EQ(linegate_call_object(client, listed, 0, &object), LINEGATE_OK);
  EXPECT_EQ(object.size, sizeof object);
  EXPECT_EQ(object.index, 0x1008U);
  EXPECT_EQ(object.sub, 1U);
  EXPECT_EQ(object.type, 9U);
  EXPECT_EQ(object.access, 2U);
  EXPECT_TRUE(object.mappable != 0 && object.stored != 0 && object.application != 0);
  EXPECT_STREQ(object.name, "Name");
  ASSERT_EQ(object.length, 1U);
  EXPECT_EQ(*static_cast<const std::uint8_t*>(object.value), 7U);
  EXPECT_EQ(linegate_call_object(client, listed, 1, &object), LINEGATE_ERROR_NAME);
  const int scanned = answered(
      linegate_scan(client, line, 0, kTime),
      std::vector{scan::ScannedNode{
          .id = 5, .end = AbortCode{6}, .values = {{.address = {0x1018, 1}, .data = kSeven}}}});
  auto node = empty<linegate_scanned_node>();
  ASSERT_EQ(linegate_call_scanned(client, scanned, 0, &node), LINEGATE_OK);
  EXPECT_EQ(node.node, 5U);
  EXPECT_EQ(node.abort, 6U);
  EXPECT_EQ(node.values, 1U);
  auto value = empty<linegate_object_value>();
  ASSERT_EQ(linegate_call_scanned_value(client, scanned, 0, 0, &value), LINEGATE_OK);
  EXPECT_EQ(value.index, 0x1018U);
  EXPECT_EQ(value.length, 1U);
  EXPECT_EQ(linegate_call_scanned_value(client, scanned, 0, 1, &value), LINEGATE_ERROR_NAME);
  EXPECT_EQ(linegate_call_scanned_value(client, scanned, 1, 0, &value), LINEGATE_ERROR_NAME);
}

TEST_F(CommandsInC, ResultsOfNodesAreThoseOfTheReply) {
  const int booted = answered(
      linegate_boot(client, line, 0, kTime),
      std::vector<manager::BootOutcome>{{.node = 5,
                                         .letter = 'D',
                                         .finding = {.kind = manager::BootFinding::Kind::value,
                                                     .object = {0x1018, 1},
                                                     .expected = 7,
                                                     .found = 6}}});
  auto boot = empty<linegate_boot_result>();
  ASSERT_EQ(linegate_call_boot(client, booted, 0, &boot), LINEGATE_OK);
  EXPECT_EQ(boot.node, 5U);
  EXPECT_EQ(boot.letter, 'D');
  EXPECT_EQ(boot.reason, 2U);
  EXPECT_EQ(boot.ok, 0U);
  EXPECT_EQ(boot.index, 0x1018U);
  EXPECT_EQ(boot.sub, 1U);
  EXPECT_EQ(boot.expected, 7U);
  EXPECT_EQ(boot.found, 6U);
  EXPECT_NE(std::string(boot.text).find("1018"), std::string::npos);
  const int compared = answered(
      linegate_compare(client, line, 5, kTime),
      std::vector<manager::NodeReport>{
          {.node = 5, .differences = {{.object = {0x6200, 1}, .expected = kSeven, .found = {}}}}});
  auto configuration = empty<linegate_configuration>();
  ASSERT_EQ(linegate_call_configuration(client, compared, 0, &configuration), LINEGATE_OK);
  EXPECT_EQ(configuration.ok, 0U);
  EXPECT_EQ(configuration.differences, 1U);
  auto difference = empty<linegate_difference>();
  ASSERT_EQ(linegate_call_difference(client, compared, 0, 0, &difference), LINEGATE_OK);
  EXPECT_EQ(difference.index, 0x6200U);
  EXPECT_EQ(difference.expected_length, 1U);
  EXPECT_EQ(difference.found_length, 0U);
  EXPECT_EQ(linegate_call_difference(client, compared, 0, 1, &difference), LINEGATE_ERROR_NAME);
  EXPECT_EQ(linegate_call_difference(client, compared, 1, 0, &difference), LINEGATE_ERROR_NAME);
  const int failed =
      answered(linegate_program(client, line, 5, 1, "\7", 1, kTime),
               line::ProgramFault{.object = {0x1F57, 1}, .value = 3}, {Domain::sdo, 0x0800'0022});
  auto fault = empty<linegate_program_fault>();
  ASSERT_EQ(linegate_call_program_fault(client, failed, &fault), LINEGATE_OK);
  EXPECT_EQ(fault.index, 0x1F57U);
  EXPECT_EQ(fault.sub, 1U);
  EXPECT_EQ(fault.value, 3U);
  const int loaded = answered(linegate_program(client, line, 5, 1, "\7", 1, kTime), Bytes());
  EXPECT_EQ(linegate_call_program_fault(client, loaded, &fault), LINEGATE_ERROR_FAILED);
}

TEST_F(CommandsInC, ResultsOfLssAreThoseOfTheReply) {
  Bytes address(3);
  lss::put({1, 2, 3, 4}, address);
  auto result = empty<linegate_lss_result>();
  ASSERT_EQ(
      linegate_call_lss(
          client, answered(linegate_lss_inquire_address(client, line, kTime), address), &result),
      LINEGATE_OK);
  EXPECT_EQ(result.outcome, 0U);
  EXPECT_EQ(result.address.vendor, 1U);
  EXPECT_EQ(result.address.serial, 4U);
  Bytes assigned{std::byte{0}, std::byte{0}, std::byte{0}, std::byte{4},
                 std::byte{0}, std::byte{2}, std::byte{3}};
  lss::put({5, 6, 7, 8}, assigned);
  const int round = answered(linegate_lss_assign_node_ids(client, line, kTime), assigned);
  ASSERT_EQ(linegate_call_lss(client, round, &result), LINEGATE_OK);
  EXPECT_EQ(result.assignments, 1U);
  auto assignment = empty<linegate_lss_assignment>();
  ASSERT_EQ(linegate_call_assignment(client, round, 0, &assignment), LINEGATE_OK);
  EXPECT_EQ(assignment.verdict, 4U);
  EXPECT_EQ(assignment.error, 2U);
  EXPECT_EQ(assignment.specific_error, 3U);
  EXPECT_EQ(assignment.address.product, 6U);
  EXPECT_EQ(linegate_call_assignment(client, round, 1, &assignment), LINEGATE_ERROR_NAME);
}

TEST_F(CommandsInC, ResultsOfListsAreThoseOfTheReply) {
  const int triggered =
      answered(linegate_trigger_pdo(client, line, 1, 0, kTime), line::TriggeredPdos{1, 600});
  EXPECT_EQ(linegate_call_pdo(client, triggered, 1), 600);
  EXPECT_EQ(linegate_call_pdo(client, triggered, 2), LINEGATE_ERROR_NAME);
  const int by_mpdo = answered(linegate_write_mpdo(client, line, 1, 0x6200, 1, "\7", 1, 0, kTime),
                               line::SentByMpdo{4});
  EXPECT_EQ(linegate_call_pdo(client, by_mpdo, 0), 4);
  const int checked =
      answered(linegate_check_sleep(client, line, kTime), Bytes{std::byte{3}, std::byte{9}});
  EXPECT_EQ(linegate_call_objection(client, checked, 1), 9);
  EXPECT_EQ(linegate_call_objection(client, checked, 2), LINEGATE_ERROR_NAME);
  const int listed = answered(linegate_connections(client, line, kTime),
                              line::SdoConnections{{.number = 2,
                                                    .client = 1,
                                                    .server = 3,
                                                    .client_record = 0x1280,
                                                    .server_record = 0x1201,
                                                    .request = 0x601,
                                                    .response = 0x581,
                                                    .state = manager::ConnectionState::stale,
                                                    .abort = AbortCode{0x0504'0000}}});
  auto connection = empty<linegate_connection>();
  ASSERT_EQ(linegate_call_connection(client, listed, 0, &connection), LINEGATE_OK);
  EXPECT_EQ(connection.number, 2U);
  EXPECT_EQ(connection.client, 1U);
  EXPECT_EQ(connection.server, 3U);
  EXPECT_EQ(connection.client_object, 0x1280U);
  EXPECT_EQ(connection.server_object, 0x1201U);
  EXPECT_EQ(connection.request_id, 0x601U);
  EXPECT_EQ(connection.response_id, 0x581U);
  EXPECT_EQ(connection.state, 3U);
  EXPECT_EQ(connection.abort, 0x0504'0000U);
}

TEST_F(CommandsInC, APageOfTheJournalIsRead) {
  auto query = empty<linegate_journal_query>();
  request::JournalPage page;
  page.more = true;
  page.cursor = {11, 12};
  page.records.push_back({.stream = 3, .line = "press", .number = 4, .node = 5, .text = "lost"});
  const int events =
      answered(linegate_read_journal(client, line, &query, kTime), request::encode(page));
  auto read = empty<linegate_journal_page>();
  ASSERT_EQ(linegate_call_page(client, events, &read), LINEGATE_OK);
  EXPECT_EQ(read.events, 1U);
  EXPECT_EQ(read.more, 1);
  EXPECT_EQ(read.cursor_check, 12U);
  linegate_event event{};
  EXPECT_EQ(linegate_call_event(client, events, 0, &event), LINEGATE_ERROR_ARGUMENT) << "no size";
  event = empty<linegate_event>();
  ASSERT_EQ(linegate_call_event(client, events, 0, &event), LINEGATE_OK);
  EXPECT_EQ(event.size, sizeof event);
  EXPECT_STREQ(event.line, "press");
  EXPECT_STREQ(event.text, "lost");
  EXPECT_EQ(event.number, 4U);
  EXPECT_EQ(linegate_call_event(client, events, 1, &event), LINEGATE_ERROR_NAME);
  EXPECT_EQ(linegate_call_event(client, events, 0, nullptr), LINEGATE_ERROR_ARGUMENT);
  page = {};
  page.values.push_back({.series = {.line = "press",
                                    .direction = 1,
                                    .node = 5,
                                    .type = 6,
                                    .bits = 16,
                                    .name = "ram.Out",
                                    .unit = "bar",
                                    .scale = 0.5},
                         .value = 9});
  const int values =
      answered(linegate_read_journal(client, line, &query, kTime), request::encode(page));
  auto value = empty<linegate_history_value>();
  ASSERT_EQ(linegate_call_history_value(client, values, 0, &value), LINEGATE_OK);
  EXPECT_STREQ(value.name, "ram.Out");
  EXPECT_STREQ(value.unit, "bar");
  EXPECT_EQ(value.valid, 1U);
  EXPECT_EQ(value.value, 9U);
  EXPECT_EQ(value.scale, 0.5);
  EXPECT_EQ(value.output, 1U);
}

TEST_F(CommandsInC, AResultBelongsToItsCommandAndExistsUntilTheCallIsFreed) {
  auto boot = empty<linegate_boot_result>();
  auto object = empty<linegate_object>();
  const int call = linegate_list_objects(client, line, 0, 0xFFFF, 0, kTime);
  EXPECT_EQ(linegate_call_object(client, call, 0, &object), LINEGATE_ERROR_FAILED) << "pending";
  answered(call, std::vector{line::ListedObject{.address = {0x1008, 0}, .name = "Name"}});
  EXPECT_EQ(linegate_call_boot(client, call, 0, &boot), LINEGATE_ERROR_ARGUMENT);
  EXPECT_EQ(linegate_call_object(client, call, 0, nullptr), LINEGATE_ERROR_ARGUMENT);
  object.size = sizeof object - 1;
  EXPECT_EQ(linegate_call_object(client, call, 0, &object), LINEGATE_ERROR_ARGUMENT);
  object.size = sizeof object;
  ASSERT_EQ(linegate_call_object(client, call, 0, &object), LINEGATE_OK);
  auto again = empty<linegate_object>();
  ASSERT_EQ(linegate_call_object(client, call, 0, &again), LINEGATE_OK);
  EXPECT_EQ(again.name, object.name);
  EXPECT_STREQ(object.name, "Name");
  EXPECT_EQ(linegate_free(client, call), LINEGATE_OK);
  EXPECT_EQ(linegate_call_object(client, call, 0, &object), LINEGATE_ERROR_ARGUMENT);
  const int failed = answered(linegate_boot(client, line, 0, kTime), Bytes(),
                              line::to_error(line::Refusal::not_permitted));
  EXPECT_EQ(linegate_call_boot(client, failed, 0, &boot), LINEGATE_ERROR_FAILED);
  const int damaged = answered(linegate_boot(client, line, 0, kTime), Bytes(5));
  EXPECT_EQ(linegate_call_boot(client, damaged, 0, &boot), LINEGATE_ERROR_MALFORMED);
}

TEST_F(CommandsInC, AResultThatCannotBeReadIsNoEmptyOne) {
  const auto unreadable = [&](int call) { return answered(call, Bytes(5, std::byte{9})); };
  auto delivery = empty<linegate_delivery>();
  auto page = empty<linegate_journal_page>();
  auto query = empty<linegate_journal_query>();
  auto lss = empty<linegate_lss_result>();
  auto connection = empty<linegate_connection>();
  const int written =
      unreadable(linegate_write_object(client, line, 5, 0x6200, 1, "x", 1, 0, kTime));
  EXPECT_EQ(linegate_call_delivery(client, written, &delivery), LINEGATE_ERROR_MALFORMED);
  const int read = unreadable(linegate_read_journal(client, line, &query, kTime));
  EXPECT_EQ(linegate_call_page(client, read, &page), LINEGATE_ERROR_MALFORMED);
  const int listed = unreadable(linegate_connections(client, line, kTime));
  EXPECT_EQ(linegate_call_connection(client, listed, 0, &connection), LINEGATE_ERROR_MALFORMED);
  const int configured = unreadable(linegate_configure(client, line, 0, kTime));
  auto configuration = empty<linegate_configuration>();
  EXPECT_EQ(linegate_call_configuration(client, configured, 0, &configuration),
            LINEGATE_ERROR_MALFORMED);
  const int stored = answered(linegate_lss_store(client, line, kTime), Bytes(2));
  EXPECT_EQ(linegate_call_lss(client, stored, &lss), LINEGATE_ERROR_MALFORMED);
  EXPECT_STRNE(linegate_error_text(LINEGATE_ERROR_MALFORMED), "unknown error");
}

// A program of the first version, and one of a later version, with a library of this one.
TEST_F(CommandsInC, AStructHasTheMembersThatBothVersionsKnow) {
  const int call = answered(linegate_connections(client, line, kTime),
                            line::SdoConnections{{.number = 7, .client = 5, .server = 8}});
  struct Later {
    linegate_connection known;
    std::uint64_t more;
  } later{.known = {.size = sizeof(Later)}, .more = 77};
  ASSERT_EQ(linegate_call_connection(client, call, 0, &later.known), LINEGATE_OK);
  EXPECT_EQ(later.known.size, sizeof(linegate_connection));
  EXPECT_EQ(later.known.number, 7U);
  EXPECT_EQ(later.more, 77U);
  linegate_connection first{.size = offsetof(linegate_connection, abort) + sizeof(std::uint32_t)};
  EXPECT_EQ(linegate_call_connection(client, call, 0, &first), LINEGATE_OK);
  EXPECT_EQ(first.server, 8U);
  first.size = offsetof(linegate_connection, abort);
  EXPECT_EQ(linegate_call_connection(client, call, 0, &first), LINEGATE_ERROR_ARGUMENT);
}

TEST_F(CommandsInC, AnEventHasTheMembersThatBothVersionsKnow) {
  auto query = empty<linegate_journal_query>();
  request::JournalPage page;
  page.records.push_back({.stream = 3, .line = "press", .number = 4, .text = "lost"});
  const int call =
      answered(linegate_read_journal(client, line, &query, kTime), request::encode(page));
  struct Later {
    linegate_event known;
    std::uint64_t more;
  } later{.known = {}, .more = 77};
  later.known.size = sizeof later;
  ASSERT_EQ(linegate_call_event(client, call, 0, &later.known), LINEGATE_OK);
  EXPECT_EQ(later.known.size, sizeof(linegate_event));
  EXPECT_EQ(later.known.number, 4U);
  EXPECT_EQ(later.more, 77U);
  linegate_event first{};
  first.size = offsetof(linegate_event, journal_lost) + sizeof(int);
  ASSERT_EQ(linegate_call_event(client, call, 0, &first), LINEGATE_OK);
  EXPECT_STREQ(first.text, "lost");
  first.size = offsetof(linegate_event, journal_lost);
  EXPECT_EQ(linegate_call_event(client, call, 0, &first), LINEGATE_ERROR_ARGUMENT);
}

TEST_F(CommandsInC, AProgramInCReadsAResult) {
  world->reply(1, {}, dds::encode_reply(std::vector<manager::BootOutcome>{{.node = 3}}));
  EXPECT_EQ(use_commands_in_c(client), 0);
}

}  // namespace
}  // namespace linegate::client
