// SPDX-License-Identifier: Apache-2.0
// Each command of the contract with typed parameters: what is sent, and what is read of a reply.
#include "bridges/client/commands.h"

#include <set>

#include <gtest/gtest.h>

#include "bridges/dds/reply_codec.h"

#include "fake_link.h"

namespace linegate::client {
namespace {

using namespace std::chrono_literals;

struct TypedCommands : testing::Test {
  std::shared_ptr<FakeWorld> world = std::make_shared<FakeWorld>();
  Client client = fake_client(world);
  Line line = client.line("press");
  Commands press{line};

  void SetUp() override {
    world->whole_line(1);
    client.poll(0ms);
    ASSERT_TRUE(line.ready());
  }
  // The last request; a default one if it is of another type.
  template <class T>
  T sent() const {
    const auto* const of_line = std::get_if<line::Request>(&world->requests.back().second);
    const T* const request = of_line == nullptr ? nullptr : std::get_if<T>(of_line);
    EXPECT_NE(request, nullptr);
    return request == nullptr ? T{} : *request;
  }
  template <class T>
  auto answered(Answer<T> call, std::vector<std::byte> bytes, linegate::Error error = {}) {
    world->reply(world->sent, error, std::move(bytes));
    client.poll(0ms);
    EXPECT_TRUE(call.done());
    return call.result();
  }
  template <class T>
  auto answered(Answer<T> call, const line::ReplyData& reply, linegate::Error error = {}) {
    return answered(std::move(call), dds::encode_reply(reply), error);
  }
};

const std::vector<std::byte> kByte{std::byte{7}};

TEST_F(TypedCommands, ThereIsOneForEachKindOfTheContract) {
  line.sdo_read(1, 0x1000, 0);
  line.sdo_write(1, 0x1017, 0, std::uint16_t{1});
  line.nmt(1, 1);
  press.write_object(1, 0x6200, 1, kByte);
  press.write_output("ram.Out", std::uint64_t{3});
  press.read_network(2, 1, 0x1000, 0);
  press.write_network(2, 1, 0x1017, 0, kByte);
  press.read_own(0x1000, 0);
  press.write_own(0x1017, 0, kByte);
  press.create_object({.index = 0x2000, .type = 5, .access = 2, .name = "Speed", .value = kByte});
  press.scan();
  press.apply_scan();
  press.boot();
  press.compare(1);
  press.program(1, 1, kByte);
  press.lss_store();
  press.trigger_pdo(1);
  press.request_pdo(1, 1);
  press.write_mpdo(1, 0x6200, 1, kByte);
  press.send_emcy(0x1000, 1);
  press.send_frame(0x100, kByte);
  press.listen(1s);
  press.trace_routing(1s);
  press.open_connection(1, 2);
  press.close_connection(1);
  press.connections();
  press.sleep();
  press.versions();
  press.restart_bus();
  press.set_bus_faults("lost=1%");
  press.read_journal({});
  std::set<line::CommandKind> kinds;
  for (const auto& [target, request] : world->requests)
    kinds.insert(request::kind(request));
  EXPECT_EQ(kinds.size(), request::kCommandKinds);
}

TEST_F(TypedCommands, ParametersAreThoseOfTheRequest) {
  press.write_object(5, 0x6200, 1, kByte, true);
  EXPECT_EQ(sent<line::ObjectWrite>().node, 5U);
  EXPECT_EQ(sent<line::ObjectWrite>().address, (od::Address{0x6200, 1}));
  EXPECT_EQ(sent<line::ObjectWrite>().data, kByte);
  EXPECT_TRUE(sent<line::ObjectWrite>().force_sdo);
  EXPECT_FALSE(sent<line::ObjectWrite>().keep_pdo);
  press.read_network(300, 9, 0x1018, 4);
  EXPECT_EQ(sent<line::NetworkRead>().network, 300U);
  EXPECT_EQ(sent<line::NetworkRead>().address, (od::Address{0x1018, 4}));
  press.list_objects(0x1000, 0x1FFF, 3);
  EXPECT_EQ(std::get<line::ObjectRange>(sent<line::LocalRead>().what).last, 0x1FFFU);
  EXPECT_EQ(sent<line::LocalRead>().node, 3U);
  press.remove_object(0x2000);
  EXPECT_EQ(std::get<line::ObjectRemoval>(sent<line::ObjectCreate>().what).index, 0x2000U);
  press.apply_scan(0, true, false);
  EXPECT_TRUE(sent<line::ScanApply>().set_up);
  EXPECT_FALSE(sent<line::ScanApply>().restore);
  press.configure(4);
  EXPECT_TRUE(sent<line::Configure>().apply);
  press.compare(4);
  EXPECT_FALSE(sent<line::Configure>().apply);
  press.lss_set_node_id(9, true);
  EXPECT_EQ(sent<line::LssRequest>().arguments, (std::vector{std::byte{9}, std::byte{1}}));
  press.lss_activate_bit_timing(0x1234ms);
  EXPECT_EQ(sent<line::LssRequest>().arguments, (std::vector{std::byte{0x34}, std::byte{0x12}}));
  press.lss_identify({1, 2, 3, 4}, 5, 6);
  ASSERT_EQ(sent<line::LssRequest>().arguments.size(), 24U);
  EXPECT_EQ(sent<line::LssRequest>().arguments[12], std::byte{5});
  press.send_frame(0x1234567, kByte, true, true, true);
  EXPECT_TRUE(sent<line::CanSend>().frame.extended());
  EXPECT_TRUE(sent<line::CanSend>().frame.fd());
  press.listen(60s, 0x123, 0x7FF, false);
  EXPECT_EQ(sent<line::CanListen>().mask, 0x7FFU);
  EXPECT_EQ(sent<line::CanListen>().extended, std::optional(false));
  press.object_to_sleep(false);
  EXPECT_EQ(sent<line::SleepRequest>().action, line::SleepAction::consent);
}

TEST_F(TypedCommands, AParameterThatIsOutOfRangeIsRefusedAtOnce) {
  EXPECT_EQ(press.write_object(128, 0x6200, 1, kByte).outcome(), Outcome::refused);
  EXPECT_EQ(press.boot(200).outcome(), Outcome::refused);
  EXPECT_EQ(press.lss_activate_bit_timing(70s).outcome(), Outcome::refused);
  EXPECT_EQ(press.send_frame(0x100, std::vector<std::byte>(9)).outcome(), Outcome::refused);
  EXPECT_EQ(press.send_frame(0x4000'0123, {}).outcome(), Outcome::refused);  // not a remote frame
  EXPECT_EQ(press.send_remote_frame(0x8000'0123, 0).outcome(), Outcome::refused);
  EXPECT_EQ(press.listen(-1s).outcome(), Outcome::refused);
  EXPECT_EQ(press.listen(1s, 0x8000'0000).outcome(), Outcome::refused);
  EXPECT_EQ(press.trace_routing(0s).outcome(), Outcome::refused);
  const std::string longer(256, 'x');
  EXPECT_EQ(press.create_object({.index = 0x2000, .type = 5, .name = longer}).outcome(),
            Outcome::refused);
  EXPECT_EQ(press.read_journal({.text = longer}).outcome(), Outcome::refused);
  EXPECT_EQ(press.write_output("ram.None", std::uint64_t{1}).text(), describe(Error::no_name));
  EXPECT_EQ(press.write_output("ram.Out", std::uint64_t{256}).text(),
            describe(Error::out_of_range));
  EXPECT_EQ(Commands(client.line("absent")).write_output("ram.Out", true).text(),
            describe(Error::not_ready));
  EXPECT_EQ(Commands(Line()).boot().outcome(), Outcome::refused);
  EXPECT_EQ(world->sent, 0U);
}

TEST_F(TypedCommands, AnOutputIsWrittenByItsNameAndInItsUnit) {
  world->scaling = {.unit = "bar", .scale = 0.5, .offset = -1};
  for (const auto direction : {image::Direction::inputs, image::Direction::outputs}) {
    world->layout(direction, 1, 8);
    world->image(direction, 1, 5, 8);
  }
  client.poll(0ms);
  world->now += 1s;
  press.write_output("outputs:ram.Out", 2.0);
  EXPECT_EQ(sent<line::SingleOutput>().data, std::vector{std::byte{6}});
  press.write_output("ram.Out", std::uint64_t{9}, true);
  EXPECT_EQ(sent<line::SingleOutput>().data, std::vector{std::byte{9}});
}

TEST_F(TypedCommands, ResultsAreThoseOfTheReply) {
  const Delivery by_pdo =
      answered(press.write_object(1, 0x6200, 1, kByte),
               line::WrittenByPdo{.pdo = 3, .wait = line::PdoWait::values, .missing = {4, 5}});
  EXPECT_EQ(by_pdo.way, Delivery::Way::pdo);
  EXPECT_EQ(by_pdo.pdo, 3U);
  EXPECT_EQ(by_pdo.wait, Delivery::Wait::values);
  EXPECT_EQ(by_pdo.missing, (std::vector<std::uint32_t>{4, 5}));
  EXPECT_EQ(answered(press.write_object(1, 0x6200, 1, kByte), line::WrittenBySdo{}).way,
            Delivery::Way::sdo);
  const auto objects = answered(press.list_objects(),
                                std::vector{line::ListedObject{.address = {0x1008, 0},
                                                               .type = od::DataType::visible_string,
                                                               .name = "Name",
                                                               .value = kByte}});
  ASSERT_EQ(objects.size(), 1U);
  EXPECT_EQ(objects[0].name, "Name");
  EXPECT_EQ(objects[0].type, 9U);
  const auto nodes = answered(
      press.scan(),
      std::vector{scan::ScannedNode{.id = 5, .values = {{.address = {0x1018, 1}, .data = kByte}}}});
  ASSERT_EQ(nodes.size(), 1U);
  EXPECT_EQ(nodes[0].node, 5U);
  EXPECT_EQ(nodes[0].values.at(0).value, kByte);
  EXPECT_EQ(answered(press.trigger_pdo(1), line::TriggeredPdos{1, 2}),
            (std::vector<std::uint16_t>{1, 2}));
  EXPECT_EQ(answered(press.write_mpdo(1, 0x6200, 1, kByte), line::SentByMpdo{4}), 4U);
  EXPECT_EQ(answered(press.check_sleep(), std::vector{std::byte{3}, std::byte{9}}),
            (std::vector<std::uint8_t>{3, 9}));
  EXPECT_EQ(answered(press.versions(), std::vector{std::byte{'v'}, std::byte{'1'}}), "v1");
  const auto connections =
      answered(press.connections(), line::SdoConnections{{.number = 2,
                                                          .client = 1,
                                                          .server = 3,
                                                          .request = 0x601,
                                                          .state = manager::ConnectionState::stale,
                                                          .abort = AbortCode{0x0504'0000}}});
  ASSERT_EQ(connections.size(), 1U);
  EXPECT_EQ(connections[0].request_id, 0x601U);
  EXPECT_EQ(connections[0].state, SdoConnection::State::stale);
  EXPECT_EQ(connections[0].abort, 0x0504'0000U);
}

TEST_F(TypedCommands, ResultsOfNodesAreThoseOfTheReply) {
  const auto boots = answered(
      press.boot(),
      std::vector<manager::BootOutcome>{{.node = 3},
                                        {.node = 5,
                                         .letter = 'D',
                                         .finding = {.kind = manager::BootFinding::Kind::value,
                                                     .object = {0x1018, 1},
                                                     .expected = 7,
                                                     .found = 5}}});
  ASSERT_EQ(boots.size(), 2U);
  EXPECT_TRUE(boots[0].ok);
  EXPECT_EQ(boots[0].letter, 0);
  EXPECT_FALSE(boots[1].ok);
  EXPECT_EQ(boots[1].letter, 'D');
  EXPECT_EQ(boots[1].reason, BootResult::Reason::value);
  EXPECT_EQ(boots[1].found, 5U);
  EXPECT_NE(boots[1].text.find("1018"), std::string::npos) << boots[1].text;
  const auto reports = answered(
      press.compare(5),
      std::vector<manager::NodeReport>{
          {.node = 5, .differences = {{.object = {0x6200, 1}, .expected = kByte, .found = {}}}}});
  ASSERT_EQ(reports.size(), 1U);
  EXPECT_FALSE(reports[0].ok);
  EXPECT_EQ(reports[0].differences.at(0).index, 0x6200U);
  const ProgramFault fault =
      answered(press.program(5, 1, kByte), line::ProgramFault{.object = {0x1F57, 1}, .value = 3},
               {Domain::sdo, 0x0800'0022});
  EXPECT_EQ(fault.index, 0x1F57U);
  EXPECT_EQ(fault.value, 3U);
}

TEST_F(TypedCommands, ResultsOfLssAreThoseOfTheReply) {
  std::vector<std::byte> address{std::byte{0}, std::byte{0}, std::byte{0}};
  lss::put({1, 2, 3, 4}, address);
  EXPECT_EQ(answered(press.lss_inquire_address(), address).address, (LssAddress{1, 2, 3, 4}));
  EXPECT_EQ(answered(press.lss_fastscan(), address).address, (LssAddress{1, 2, 3, 4}));
  const LssResult silent =
      answered(press.lss_inquire_node_id(), std::vector{std::byte{1}, std::byte{0}, std::byte{0}});
  EXPECT_EQ(silent.outcome, LssResult::Outcome::no_response);
  EXPECT_FALSE(silent.ok());
  const LssResult node =
      answered(press.lss_inquire_node_id(),
               std::vector{std::byte{0}, std::byte{0}, std::byte{0}, std::byte{9}});
  EXPECT_EQ(node.node, 9U);
  std::vector<std::byte> assigned{std::byte{0}, std::byte{0}, std::byte{0}, std::byte{4},
                                  std::byte{0}, std::byte{2}, std::byte{3}};
  lss::put({5, 6, 7, 8}, assigned);
  const LssResult round = answered(press.lss_assign_node_ids(), assigned);
  ASSERT_EQ(round.assignments.size(), 1U);
  EXPECT_EQ(round.assignments[0].verdict, 4U);
  EXPECT_EQ(round.assignments[0].specific_error, 3U);
  EXPECT_EQ(round.assignments[0].address, (LssAddress{5, 6, 7, 8}));
}

TEST_F(TypedCommands, APageOfTheJournalIsRead) {
  const JournalQuery query{.line = "press", .node = 5, .since = 7, .newest_first = true, .most = 3};
  auto call = press.read_journal(query);
  const auto& gateway = std::get<request::GatewayRequest>(world->requests.back().second);
  const auto& wanted = std::get<request::JournalRead>(gateway);
  EXPECT_EQ(wanted.line, "press");
  EXPECT_EQ(wanted.since, Instant(linegate::Duration(7)));
  EXPECT_TRUE(wanted.newest_first);
  EXPECT_EQ(wanted.most, 3U);
  request::JournalPage page;
  page.more = true;
  page.cursor = {11, 12};
  page.records.push_back({.stream = 3, .line = "press", .number = 4, .node = 5, .text = "lost"});
  const JournalPage read = answered(std::move(call), request::encode(page));
  EXPECT_TRUE(read.more);
  EXPECT_EQ(read.cursor.check, 12U);
  ASSERT_EQ(read.events.size(), 1U);
  EXPECT_EQ(read.events[0].text, "lost");
  EXPECT_EQ(read.events[0].number, 4U);
}

// What another gateway, or a damaged one, answers.
TEST_F(TypedCommands, BytesThatDoNotMatchAreNoResult) {
  const std::vector<std::byte> odd(5, std::byte{0xFF});
  EXPECT_TRUE(answered(press.boot(), odd).empty());
  EXPECT_TRUE(answered(press.scan(), odd).empty());
  EXPECT_TRUE(answered(press.connections(), odd).empty());
  EXPECT_EQ(answered(press.write_object(1, 0x6200, 1, kByte), odd).way, Delivery::Way::none);
  EXPECT_TRUE(answered(press.read_journal({}), odd).events.empty());
  EXPECT_FALSE(answered(press.lss_store(), std::vector<std::byte>{}).ok());
  EXPECT_EQ(press.boot().result().size(), 0U) << "not answered yet";
  EXPECT_TRUE(Answer<std::vector<BootResult>>().result().empty());
}

}  // namespace
}  // namespace linegate::client
