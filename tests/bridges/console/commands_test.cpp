// SPDX-License-Identifier: Apache-2.0
// The commands against a simulated gateway.
#include "bridges/console/commands.h"

#include <set>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridges/console/boot.h"
#include "bridges/console/configuration.h"
#include "bridges/console/connections.h"
#include "bridges/console/events.h"
#include "bridges/console/filter.h"
#include "bridges/console/history.h"
#include "bridges/console/monitor.h"
#include "bridges/console/pdo_commands.h"
#include "bridges/console/scan.h"
#include "bridges/console/sleep.h"
#include "stack/base/abort_code.h"
#include "stack/scan/scanned_node.h"

#include "tests/bridges/console/command_test.h"

namespace linegate::console {
namespace {

using test::as;

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

const LineId kPress{"plant", "press"};

class FakeGateway : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    listener.on_unreadable(unreadable);
    if (!silent) {
      LineView view{.interface_uri = "virtual:press", .access = "all"};
      view.state.network_id = 3;
      view.state.node_id = 127;
      view.state.role = role;
      view.properties = {{"routes-1", "3 press 0, 10..19 press:6 10"},
                         {"routes-2", "12 hall:7 1, 12 press:8 5, nonsense"},
                         {"routing-open", "1"},
                         {"routing-opened", std::to_string(opened)},
                         {"routing-timed-out", "4"}};
      opened += opens;
      view.state.counters.events = events;
      listener.on_line(kPress, view);
      listener.on_node(kPress, {.name = "ram", .state = {.node = 5, .configured = true}});
      if (written_route) {
        view.state.network_id = 4;
        view.properties = {{"routes-1", "3 press 0, 10..19 press:6 10, 77 press:9 1"},
                           {"routing-open", "0"}};
        listener.on_line({"plant", "saw"}, view);
      }
      if (twin) {
        listener.on_line({"other", "press"}, view);
      }
      if (std::exchange(connects, false)) {
        listener.on_event(
            kPress, {.number = 9, .kind = EventKind::routing_opened, .text = "connection opened"});
        listener.on_event(
            kPress, {.number = 10, .kind = EventKind::routing_ended, .text = "connection ended"});
      }
      if (std::exchange(refuses, false)) {
        listener.on_event(kPress,
                          {.number = 7, .kind = EventKind::routing_refused, .text = "SDO refused"});
        listener.on_event(kPress, {.number = 8, .kind = EventKind::boot_up, .text = "boot-up"});
      }
      image::Layout layout{.direction = image::Direction::outputs, .id = 77, .byte_size = 2};
      layout.entries.push_back({.bit_length = 16,
                                .type = od::DataType::integer16,
                                .node = 5,
                                .index = 0x6040,
                                .name = "drive5.Controlword"});
      listener.on_layout(kPress, layout);
      if (missing_node != 0) {
        listener.on_node(kPress, {.name = "drive",
                                  .state = {.node = missing_node,
                                            .configured = true,
                                            .presence = line::Presence::missing}});
      }
      if (operational_node != 0) {
        listener.on_node(kPress, {.name = "drive",
                                  .state = {.node = operational_node,
                                            .configured = true,
                                            .state = nmt::State::operational,
                                            .presence = line::Presence::present}});
      }
    }
  }
  Answer call(const LineId& id, const line::Command& command, Duration timeout,
              std::uint64_t layout_id, Listener& /*listener*/) override {
    EXPECT_TRUE(id == kPress || written_route);
    const auto* const read = std::get_if<line::LocalRead>(&command.request);
    if (read != nullptr && std::holds_alternative<line::ObjectRange>(read->what)) {
      Answer list;
      list.reply.data = device_file;
      list.reply.error = device_file.empty() ? line::to_error(line::Refusal::bad_request) : Error{};
      return list;
    }
    asked = id;
    patience = timeout;
    last = command;
    last_layout = layout_id;
    return answer;
  }

  Answer call_gateway(const LineId& /*id*/, const request::GatewayRequest& request,
                      Duration /*timeout*/, Listener& /*listener*/) override {
    of_gateway = request;
    return answer;
  }

  bool silent = false;
  line::Role role = line::Role::manager;
  std::uint64_t opened = 5;
  std::uint64_t opens = 0;  // connections opened in each poll
  bool refuses = false;
  bool connects = false;
  std::uint64_t events = 0;    // number of events so far
  bool written_route = false;  // another line has a route
  std::uint8_t missing_node = 0;
  std::uint8_t operational_node = 0;
  bool twin = false;                            // another gateway has a line of that name
  std::uint64_t unreadable = 0;                 // unreadable samples in each poll
  std::vector<line::ListedObject> device_file;  // of each node
  Answer answer;
  line::Command last;
  request::GatewayRequest of_gateway;
  Duration patience{};
  LineId asked;
  std::uint64_t last_layout = 0;
};

using Commands = test::CommandTest<FakeGateway>;

TEST_F(Commands, SdoReadPrintsTheValueByType) {
  gateway_.answer.reply.data = test::raw({0x34, 0x12});
  EXPECT_EQ(sdo_read(context_, "press:5", "6041", "0", ""), kDone);
  EXPECT_EQ(out_.str(), "34 12  (4660)\n");
  EXPECT_EQ(line::kind(gateway_.last), line::CommandKind::sdo_read);
  EXPECT_EQ(line::node_of(gateway_.last), 5);
  EXPECT_EQ(as<line::SdoRead>(gateway_.last).address.index, 0x6041);
  out_.str("");
  EXPECT_EQ(sdo_read(context_, "3:5", "0x6041", "0", "i16"), kDone) << "by network-ID";
  EXPECT_EQ(out_.str(), "4660\n");
}

TEST_F(Commands, AnEmcyIsSentByTheLineOrByADeviceOfIt) {
  EXPECT_EQ(emcy(context_, "press", "2310", "80", "1 2"), kDone) << err_.str();
  EXPECT_EQ(out_.str(), "sent\n");
  EXPECT_EQ(line::kind(gateway_.last), line::CommandKind::emcy_send);
  EXPECT_EQ(as<line::EmcySend>(gateway_.last).code, 0x2310);
  EXPECT_EQ(as<line::EmcySend>(gateway_.last).error_register, 0x80);
  EXPECT_EQ(line::node_of(gateway_.last), 0);
  EXPECT_EQ(emcy(context_, "press:ram", "2310", "0", ""), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("LINE alone, unless its role is device"));
  gateway_.role = line::Role::device;
  EXPECT_EQ(emcy(context_, "press:ram", "2310", "0", ""), kDone);
  EXPECT_EQ(line::node_of(gateway_.last), 5);
}

TEST_F(Commands, WaitForADeviceThatStoresItsParameters) {
  EXPECT_EQ(sdo_write(context_, "press:5", "1010", "1", "u32", "0x65766173"), kDone);
  EXPECT_EQ(gateway_.last.timeout, std::chrono::seconds(16));
  context_.timeout = std::chrono::seconds(60);
  EXPECT_EQ(sdo_write(context_, "press:5", "1011", "1", "u32", "0x64616F6C"), kDone);
  EXPECT_EQ(gateway_.last.timeout, std::chrono::seconds(60));
}

TEST_F(Commands, SdoReadTakesWhatAScanReadOnlyWhenAsked) {
  EXPECT_EQ(sdo_read(context_, "press:5", "1018", "1", ""), kDone);
  EXPECT_FALSE(as<line::SdoRead>(gateway_.last).from_scan);
  EXPECT_EQ(sdo_read(context_, "press:5", "1018", "1", "", "", true), kDone);
  EXPECT_TRUE(as<line::SdoRead>(gateway_.last).from_scan);
}

TEST_F(Commands, AScanWritesOnlyWhenAsked) {
  ScanResult result;
  gateway_.answer.reply.data = std::vector{scan::ScannedNode{.id = 5}};
  EXPECT_EQ(scan(context_, {.what = "press:5"}, result), kDone) << err_.str();
  EXPECT_EQ(line::kind(gateway_.last), line::CommandKind::scan);
  EXPECT_EQ(line::node_of(gateway_.last), 5);
  EXPECT_EQ(scan(context_, {.what = "press", .apply = true}, result), kDone);
  EXPECT_EQ(line::kind(gateway_.last), line::CommandKind::scan_apply);
  EXPECT_TRUE(as<line::ScanApply>(gateway_.last).set_up);
  EXPECT_EQ(scan(context_, {.what = "press", .restore_defaults = true}, result), kDone);
  EXPECT_EQ(line::kind(gateway_.last), line::CommandKind::scan_apply);
  EXPECT_TRUE(as<line::ScanApply>(gateway_.last).restore);
}

TEST_F(Commands, AScanOfOneNodeThatIsNotThereIsAFailure) {
  ScanResult result;
  gateway_.answer.reply.data = std::vector<scan::ScannedNode>{};
  EXPECT_EQ(scan(context_, {.what = "press"}, result), kDone) << "a line may have no nodes";
  EXPECT_EQ(err_.str(), "");
  EXPECT_EQ(scan(context_, {.what = "press:5"}, result), kFailed);
  EXPECT_EQ(err_.str(), "node 5 of press did not answer\n");
  context_.json = true;
  out_.str("");
  EXPECT_EQ(scan(context_, {.what = "press:5"}, result), kFailed);
  EXPECT_THAT(out_.str(), HasSubstr(R"("nodes":[])")) << "the output is JSON nevertheless";
}

TEST_F(Commands, LookForTheirLineOnceHoweverShortTheWait) {
  context_.wait = std::chrono::milliseconds(0);
  EXPECT_EQ(sdo_read(context_, "press:5", "6041", "0", ""), kDone) << err_.str();
}

TEST_F(Commands, AnAbortIsToldInWordsAndByTheExitCode) {
  gateway_.answer.reply.error = to_error(AbortCode::no_object);
  gateway_.answer.text = "SDO abort 06020000h: object does not exist in the object dictionary";
  EXPECT_EQ(sdo_read(context_, "press:5", "2FFF", "0", ""), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("object does not exist"));
  context_.json = true;
  EXPECT_EQ(sdo_read(context_, "press:5", "2FFF", "0", ""), kFailed);
  EXPECT_THAT(out_.str(), HasSubstr(R"("ok":false,"domain":"sdo","code":100794368)"));
}

TEST_F(Commands, SdoWriteEncodesTheValue) {
  EXPECT_EQ(sdo_write(context_, "press:5", "6040", "0", "u16", "0x0F"), kDone);
  EXPECT_EQ(as<line::SdoWrite>(gateway_.last).data,
            (std::vector<std::byte>{std::byte{0x0F}, std::byte{0}}));
  EXPECT_EQ(sdo_write(context_, "press:5", "6040", "0", "u8", "300"), kUsage);
  EXPECT_EQ(sdo_write(context_, "press:5", "6040", "0", "word", "3"), kUsage);
  EXPECT_EQ(sdo_write(context_, "press:200", "6040", "0", "u8", "3"), kUsage);
  EXPECT_EQ(sdo_write(context_, "press:5", "16040", "0", "u8", "3"), kUsage);
}

TEST_F(Commands, AnObjectIsWrittenByPdoOrSdoAndSaysWhich) {
  gateway_.answer.reply.data = line::WrittenByPdo{3, line::PdoWait::none};
  EXPECT_EQ(object_write(context_, "press:5", "6040", "0", "u16", "0x0F", false), kDone);
  EXPECT_EQ(out_.str(), "by PDO 3, sent\n");
  EXPECT_EQ(line::kind(gateway_.last), line::CommandKind::object_write);
  EXPECT_EQ(line::node_of(gateway_.last), 5);
  EXPECT_FALSE(as<line::ObjectWrite>(gateway_.last).keep_pdo);
  EXPECT_EQ(as<line::ObjectWrite>(gateway_.last).data,
            (std::vector<std::byte>{std::byte{0x0F}, std::byte{0}}));
  out_.str("");
  gateway_.answer.reply.data = line::WrittenByPdo{3, line::PdoWait::values};
  EXPECT_EQ(object_write(context_, "press:5", "6040", "0", "u16", "1", true), kHeldBack);
  EXPECT_EQ(out_.str(), "by PDO 3, which waits for: values that were never written\n");
  EXPECT_TRUE(as<line::ObjectWrite>(gateway_.last).keep_pdo);
  out_.str("");
  gateway_.answer.reply.data = line::WrittenBySdo{};
  EXPECT_EQ(object_write(context_, "press:5", "6083", "0", "u32", "1", false), kDone);
  EXPECT_EQ(out_.str(), "by SDO\n");
  EXPECT_EQ(object_write(context_, "press:5", "6083", "0", "u8", "300", false), kUsage);
  out_.str("");
  gateway_.answer.reply.data = test::raw({1, 3, 0, 9});  // a reason that is not defined
  EXPECT_EQ(object_write(context_, "press:5", "6083", "0", "u32", "1", false), kHeldBack);
  EXPECT_THAT(out_.str(), testing::HasSubstr("unknown reason"));
  gateway_.answer.reply.data = {};
  EXPECT_EQ(object_write(context_, "press:own", "2000", "0", "u8", "3", false), kDone);
  EXPECT_EQ(line::node_of(gateway_.last), 127);
}

TEST_F(Commands, AReadSaysThatTheImageWillDo) {
  gateway_.answer.reply.data = test::raw({7});
  EXPECT_EQ(image_read(context_, "press:5", "6041", "0", "u8"), kDone);
  EXPECT_EQ(out_.str(), "7\n");
  EXPECT_TRUE(as<line::SdoRead>(gateway_.last).from_image);
}

TEST_F(Commands, APdoIsTriggeredInThreeWays) {
  gateway_.answer.reply.data = line::TriggeredPdos{3, 4};
  EXPECT_EQ(pdo_trigger(context_, "press:5", "1", false), kDone);
  EXPECT_EQ(out_.str(), "PDO 3, 4, sent\n");
  EXPECT_EQ(line::node_of(gateway_.last), 5);
  EXPECT_EQ(as<line::PdoTrigger>(gateway_.last).number, 1);
  EXPECT_EQ(pdo_trigger(context_, "press", "3", false), kDone);
  EXPECT_EQ(line::node_of(gateway_.last), 0);
  EXPECT_EQ(as<line::PdoTrigger>(gateway_.last).number, 3);
  EXPECT_EQ(pdo_trigger(context_, "press", "10", true), kDone);
  EXPECT_EQ(as<line::PdoTrigger>(gateway_.last).number, 0);
  EXPECT_EQ(as<line::PdoTrigger>(gateway_.last).output_byte, 10U);
  EXPECT_EQ(pdo_trigger(context_, "press:5", "10", true), kUsage);
  EXPECT_EQ(pdo_trigger(context_, "press", "0", false), kUsage);
  EXPECT_EQ(pdo_trigger(context_, "press:own", "1", false), kUsage);
}

TEST_F(Commands, APdoIsRequested) {
  EXPECT_EQ(pdo_request(context_, "press:5:tpdo3"), kDone) << err_.str();
  EXPECT_EQ(line::kind(gateway_.last), line::CommandKind::pdo_request);
  EXPECT_EQ(line::node_of(gateway_.last), 5);
  EXPECT_EQ(as<line::PdoRequest>(gateway_.last).number, 3);
  EXPECT_EQ(pdo_request(context_, "press:own:rpdo7"), kDone) << err_.str();
  EXPECT_EQ(line::node_of(gateway_.last), 0);
  EXPECT_EQ(as<line::PdoRequest>(gateway_.last).number, 7);
  for (const char* wrong : {"press", "press:5", "press:5:rpdo3", "press:5:tpdo0", "press:own:tpdo1",
                            "press:all:tpdo1", "press:5:tpdo513"}) {
    EXPECT_EQ(pdo_request(context_, wrong), kUsage) << wrong;
  }
  gateway_.answer.reply.error = line::to_error(line::Refusal::bad_request);
  EXPECT_EQ(pdo_request(context_, "press:5:tpdo3"), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("does not allow RTR"));
}

TEST_F(Commands, ANetworkSleeps) {
  EXPECT_EQ(sleep(context_, "press", "sleep"), kDone) << err_.str();
  EXPECT_EQ(out_.str(), "all nodes prepare to sleep\n");
  EXPECT_EQ(as<line::SleepRequest>(gateway_.last).action, line::SleepAction::sleep);
  EXPECT_GT(gateway_.patience, std::chrono::minutes(20)) << "check_time may be 10 min";
  EXPECT_EQ(sleep(context_, "press", "wake"), kDone);
  EXPECT_EQ(as<line::SleepRequest>(gateway_.last).action, line::SleepAction::wake);
  EXPECT_EQ(sleep(context_, "press", "dream"), kUsage);
  gateway_.answer.reply.data = std::vector{std::byte{5}, std::byte{9}};
  out_.str("");
  EXPECT_EQ(sleep(context_, "press", "check"), kFailed);
  EXPECT_EQ(out_.str(), "objection of node 5, 9\n");
  gateway_.answer.reply.error = line::to_error(line::Refusal::wrong_role);
  EXPECT_EQ(sleep(context_, "press", "now"), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("only the NMT master"));
}

TEST_F(Commands, AValueGoesByMpdo) {
  gateway_.answer.reply.data = line::SentByMpdo{100};
  EXPECT_EQ(mpdo_write(context_, "press:ram", {"6200:01", "u16", "513"}), kDone) << err_.str();
  EXPECT_EQ(out_.str(), "by TPDO 100, sent\n");
  EXPECT_EQ(line::kind(gateway_.last), line::CommandKind::mpdo_write);
  EXPECT_EQ(line::node_of(gateway_.last), 5);
  EXPECT_EQ(as<line::MpdoWrite>(gateway_.last).address.index, 0x6200);
  EXPECT_EQ(as<line::MpdoWrite>(gateway_.last).data, (std::vector{std::byte{1}, std::byte{2}}));
  EXPECT_EQ(mpdo_write(context_, "press:all", {"6200:01", "u8", "1"}), kDone);
  EXPECT_EQ(line::node_of(gateway_.last), 0);
  EXPECT_EQ(mpdo_write(context_, "press:5", {"6200:01", "u64", "1"}), kUsage);
  EXPECT_EQ(mpdo_write(context_, "press:own", {"6200:01", "u8", "1"}), kUsage);
}

TEST_F(Commands, SdoConnections) {
  const line::SdoConnections one{{.number = 3,
                                  .client = 5,
                                  .server = 8,
                                  .client_record = 0x1280,
                                  .server_record = 0x1201,
                                  .request = 0x681,
                                  .response = 0x680,
                                  .state = manager::ConnectionState::stale,
                                  .abort = AbortCode::timeout}};
  gateway_.answer.reply.data = one;
  EXPECT_EQ(connections(context_, "press", {"open", "ram", "8"}), kDone) << err_.str();
  EXPECT_EQ(as<line::ConnectionOpen>(gateway_.last).node, 5);
  EXPECT_EQ(as<line::ConnectionOpen>(gateway_.last).server, 8);
  EXPECT_THAT(out_.str(), HasSubstr("1280"));
  EXPECT_THAT(out_.str(), HasSubstr("681"));
  EXPECT_THAT(out_.str(), HasSubstr("stale: "));
  out_.str("");
  context_.json = true;
  EXPECT_EQ(connections(context_, "press", {}), kDone);
  EXPECT_EQ(line::kind(gateway_.last), line::CommandKind::connection_list);
  EXPECT_EQ(out_.str(),
            R"({"gateway":"plant","line":"press","connections":[{"number":3,"client":5,"server":8,)"
            R"("client_record":4736,"server_record":4609,"request":1665,"response":1664,)"
            R"("state":"stale","abort":"05040000"}]})"
            "\n");
  context_.json = false;
  gateway_.answer.reply.data = {};
  EXPECT_EQ(connections(context_, "press", {"close", "3"}), kDone);
  EXPECT_EQ(as<line::ConnectionClose>(gateway_.last).number, 3U);
  for (const std::vector<std::string>& wrong : {std::vector<std::string>{"open"},
                                                {"open", "5"},
                                                {"open", "5", "all"},
                                                {"open", "own", "5"},
                                                {"close"},
                                                {"close", "x"},
                                                {"list"}}) {
    EXPECT_EQ(connections(context_, "press", wrong), kUsage) << wrong[0];
  }
  gateway_.answer.reply.error = line::to_error(line::Refusal::wrong_state);
  EXPECT_EQ(connections(context_, "press", {"open", "5", "8"}), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("plant.yaml: sdo_connections"));
}

TEST_F(Commands, AnotherNetworkIsReachedOverTheCheapestLineThatIsKnown) {
  EXPECT_EQ(sdo_read(context_, "12:5", "1018", "1", ""), kDone) << err_.str();
  EXPECT_EQ(line::kind(gateway_.last), line::CommandKind::network_read);
  EXPECT_EQ(as<line::NetworkRead>(gateway_.last).network, 12);
  EXPECT_EQ(line::node_of(gateway_.last), 5);
  EXPECT_FALSE(as<line::NetworkRead>(gateway_.last).as_device);
  EXPECT_EQ(sdo_write(context_, "19:6", "6040", "0", "u8", "1"), kDone);
  EXPECT_EQ(line::kind(gateway_.last), line::CommandKind::network_write);
  EXPECT_EQ(as<line::NetworkWrite>(gateway_.last).network, 19);
  EXPECT_EQ(sdo_read(context_, "20:5", "1018", "1", ""), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("no line '20'"));
}

TEST_F(Commands, ALineCanBeTheWayToAnother) {
  EXPECT_EQ(sdo_read(context_, "12:5", "1018", "1", "", "press"), kDone) << err_.str();
  EXPECT_EQ(line::kind(gateway_.last), line::CommandKind::network_read);
  EXPECT_EQ(as<line::NetworkRead>(gateway_.last).network, 12);
  EXPECT_TRUE(as<line::NetworkRead>(gateway_.last).as_device) << "as a device there would";
  EXPECT_EQ(sdo_write(context_, "press:5", "6040", "0", "u8", "1", "press"), kDone);
  EXPECT_TRUE(as<line::NetworkWrite>(gateway_.last).as_device);
  EXPECT_EQ(line::kind(gateway_.last), line::CommandKind::network_write);
  EXPECT_EQ(as<line::NetworkWrite>(gateway_.last).network, 3) << "that of press";
  EXPECT_EQ(sdo_read(context_, "press:own", "1018", "1", "", "press"), kFailed);
  EXPECT_EQ(sdo_read(context_, "hall:5", "1018", "1", "", "press"), kFailed);
}

TEST_F(Commands, FaultSendsThemAllAtOnceAndPrintsThoseThereAre) {
  const auto sent = [&] { return std::get<request::BusFault>(gateway_.of_gateway).change; };
  gateway_.answer.reply.data = test::raw({'o', 'f', 'f'});
  EXPECT_EQ(fault(context_, "press", {}), kDone);
  EXPECT_EQ(sent(), "");
  EXPECT_EQ(out_.str(), "off\n");
  EXPECT_EQ(fault(context_, "press", {"lost=1%", "stuck=off"}), kDone);
  EXPECT_EQ(sent(), "lost=1%&stuck=off");
  EXPECT_EQ(fault(context_, "nosuch", {}), kFailed);
}

TEST_F(Commands, FaultSaysWhatIsWrong) {
  gateway_.answer.reply.error = line::to_error(line::Refusal::bad_request);
  gateway_.answer.reply.data = test::raw({'n', 'o'});
  gateway_.answer.text = "a field is out of range";
  EXPECT_EQ(fault(context_, "press", {"lost=2"}), kUsage);
  EXPECT_EQ(err_.str(), "no\na field is out of range\n");
  gateway_.answer.reply.error = line::to_error(line::Refusal::wrong_interface);
  EXPECT_EQ(fault(context_, "press", {"lost=2"}), kFailed);
}

TEST_F(Commands, BusRestartSaysThatAnInterfaceHasNoBusState) {
  gateway_.answer.reply.error = Error{Domain::can, EOPNOTSUPP};
  gateway_.answer.text = "Operation not supported";
  EXPECT_EQ(bus_restart(context_, "press"), kFailed);
  EXPECT_THAT(err_.str(), testing::EndsWith(" of line press has no bus state that could be "
                                            "restarted\n"));
}

TEST_F(Commands, RoutesAsTextAndAsJson) {
  EXPECT_EQ(routes(context_), kDone);
  EXPECT_THAT(out_.str(), HasSubstr("NETWORKS"));
  EXPECT_THAT(out_.str(), HasSubstr("10..19"));
  EXPECT_THAT(out_.str(), HasSubstr("TIMED OUT"));
  EXPECT_THAT(out_.str(), Not(HasSubstr("nonsense")));
  out_.str("");
  context_.json = true;
  EXPECT_EQ(routes(context_), kDone);
  EXPECT_THAT(out_.str(), HasSubstr(R"({"gateway":"plant","first":10,"last":19,"line":"press",)"
                                    R"("node":6,"cost":10})"));
  EXPECT_THAT(out_.str(), HasSubstr(R"("network_id":3,"open":1,"opened":5,"timed_out":4})"));
}

TEST_F(Commands, ARouteOfOneLineIsShownAsThatAndUsedByIt) {
  gateway_.written_route = true;
  context_.json = true;
  EXPECT_EQ(routes(context_), kDone);
  EXPECT_THAT(out_.str(), HasSubstr(R"("line":"press","node":6,"cost":10})"));
  EXPECT_THAT(out_.str(), HasSubstr(R"("first":77,"last":77,"line":"press","node":9,"cost":1,)"
                                    R"("known_to":["saw"]})"));
  EXPECT_EQ(sdo_read(context_, "77:5", "1018", "1", ""), kDone) << err_.str();
  EXPECT_EQ(gateway_.asked.line, "saw") << "press has no such route";
  EXPECT_EQ(sdo_read(context_, "19:5", "1018", "1", ""), kDone) << err_.str();
  EXPECT_EQ(gateway_.asked.line, "press");
}

TEST_F(Commands, ATraceTellsWhatMovedAndWhatWasRefused) {
  gateway_.opens = 2;
  gateway_.refuses = true;
  EXPECT_EQ(trace(context_, 3, [] { return false; }), kDone);
  EXPECT_THAT(out_.str(), HasSubstr("press (network 3): 2 opened; open 1\n"));
  EXPECT_THAT(out_.str(), HasSubstr("SDO refused\n"));
  EXPECT_THAT(out_.str(), Not(HasSubstr("boot-up")));
  out_.str("");
  context_.json = true;
  EXPECT_EQ(trace(context_, 1, [] { return false; }), kDone);
  EXPECT_THAT(out_.str(), HasSubstr(R"("line":"press","network_id":3,"opened":2,"finished":0)"));
  gateway_.silent = true;
  EXPECT_EQ(trace(context_, 1, [] { return false; }), kFailed);
}

TEST_F(Commands, ATraceAsksForConnectionsAndShowsThem) {
  gateway_.connects = true;
  EXPECT_EQ(trace(context_, 2, [] { return false; }), kDone);
  EXPECT_EQ(line::kind(gateway_.last), line::CommandKind::routing_trace);
  EXPECT_EQ(as<line::RoutingTrace>(gateway_.last).duration, std::chrono::seconds(30));
  EXPECT_THAT(out_.str(), HasSubstr("connection opened\n"));
  EXPECT_THAT(out_.str(), HasSubstr("connection ended\n"));
  EXPECT_THAT(err_.str(), Not(HasSubstr("does not tell")));
}

TEST_F(Commands, ATraceShowsNothingThatHappenedBefore) {
  gateway_.events = 7;
  gateway_.refuses = true;
  gateway_.opens = 1;
  EXPECT_EQ(trace(context_, 2, [] { return false; }), kDone);
  EXPECT_THAT(out_.str(), Not(HasSubstr("SDO refused")));
}

TEST_F(Commands, ATraceGoesOnWithCountersWhereItMayNotAsk) {
  gateway_.answer.reply.error = line::to_error(line::Refusal::not_permitted);
  gateway_.answer.text = "not permitted";
  gateway_.opens = 1;
  EXPECT_EQ(trace(context_, 2, [] { return false; }), kDone);
  EXPECT_THAT(out_.str(), HasSubstr("1 opened"));
  EXPECT_EQ(err_.str(), "press does not report single connections: not permitted\n");
}

TEST_F(Commands, TheOwnNodeIsReadLocally) {
  EXPECT_EQ(sdo_read(context_, "press:own", "1000", "0", ""), kDone);
  EXPECT_EQ(line::kind(gateway_.last), line::CommandKind::local_read);
}

TEST_F(Commands, OutputsAreNamedInThreeWays) {
  for (const std::string entry : {"drive5.Controlword", "5.6040:0", "0"}) {
    EXPECT_EQ(write(context_, "press", entry, "-2"), kDone) << err_.str();
    EXPECT_EQ(as<line::SingleOutput>(gateway_.last).entry, 0U);
    EXPECT_EQ(as<line::SingleOutput>(gateway_.last).data,
              (std::vector<std::byte>{std::byte{0xFE}, std::byte{0xFF}}));
    EXPECT_EQ(gateway_.last_layout, 77U);
  }
  EXPECT_EQ(write(context_, "press", "drive6.Controlword", "1"), kUsage);
  EXPECT_THAT(err_.str(), HasSubstr("there are:\n  drive5.Controlword"));
  EXPECT_EQ(write(context_, "press", "0", "70000"), kUsage);
}

TEST_F(Commands, ANodeHasItsNameWhereverItHasItsNumber) {
  EXPECT_EQ(sdo_read(context_, "press:ram", "1000", "0", ""), kDone) << err_.str();
  EXPECT_EQ(line::node_of(gateway_.last), 5);
  EXPECT_EQ(sdo_write(context_, "plant/press:ram", "1017:00", "", "u16", "5"), kDone);
  EXPECT_EQ(line::node_of(gateway_.last), 5);
  EXPECT_EQ(image_read(context_, "press:ram", "1000", "0", ""), kDone);
  EXPECT_EQ(line::node_of(gateway_.last), 5);
  EXPECT_EQ(object_write(context_, "press:ram", "6040", "0", "u16", "1", false), kDone);
  EXPECT_EQ(line::node_of(gateway_.last), 5);
  EXPECT_EQ(pdo_trigger(context_, "press:ram", "1", false), kDone);
  EXPECT_EQ(line::node_of(gateway_.last), 5);
  EXPECT_EQ(nmt(context_, "start", "press:ram"), kDone);
  EXPECT_EQ(line::node_of(gateway_.last), 5);
  EXPECT_EQ(sdo_read(context_, "press:ram", "1000", "0", "", "press"), kDone) << err_.str();
  EXPECT_EQ(line::node_of(gateway_.last), 5);
  ScanResult result;
  EXPECT_EQ(scan(context_, {.what = "press:ram"}, result), kFailed);
  EXPECT_EQ(line::node_of(gateway_.last), 5);
  err_.str("");
  EXPECT_EQ(nmt(context_, "start", "press:ran"), kFailed);
  EXPECT_EQ(err_.str(), "no node 'ran' on press; there are: ram (5)\n");
  EXPECT_EQ(sdo_read(context_, "press:5a", "1000", "0", ""), kUsage);
  EXPECT_EQ(sdo_read(context_, "ram", "1000", "0", ""), kUsage) << "a name needs a line";
}

TEST_F(Commands, AnOutputThatWaitsSaysForWhat) {
  gateway_.answer.reply.data = line::WrittenByPdo{3, line::PdoWait::values, {0}};
  EXPECT_EQ(write(context_, "press", "0", "1"), kHeldBack);
  EXPECT_EQ(out_.str(),
            "by PDO 3, which waits for: values that were never written: drive5.Controlword\n");
  out_.str("");
  context_.json = true;
  EXPECT_EQ(write(context_, "press", "0", "1"), kHeldBack);
  EXPECT_THAT(out_.str(), HasSubstr("never written: drive5.Controlword"));
}

TEST_F(Commands, AnOutputOfANodeThatIsNotOperationalIsRefusedWithItsState) {
  gateway_.answer.reply.error = line::to_error(line::Refusal::wrong_state);
  gateway_.answer.text = "not possible in the present state";
  EXPECT_EQ(write(context_, "press", "0", "1"), kFailed);
  EXPECT_EQ(err_.str(), "not possible in the present state: node 5 (ram) is not operational\n");
  err_.str("");
  gateway_.missing_node = 5;
  EXPECT_EQ(object_write(context_, "press:5", "6040", "0", "u16", "1", false), kFailed);
  EXPECT_EQ(err_.str(),
            "not possible in the present state: node 5 (drive) is missing, not "
            "operational\n");
}

TEST_F(Commands, AnOutputWhoseWatchdogHasFiredIsNotRefusedWithAStateOfItsNode) {
  gateway_.answer.reply = {.error = line::to_error(line::Refusal::wrong_state),
                           .data = std::vector{std::byte{0}, std::byte{0}}};
  gateway_.answer.text = "not possible in the present state: the watchdog of output group 0";
  EXPECT_EQ(write(context_, "press", "0", "1"), kFailed);
  EXPECT_EQ(err_.str(), "not possible in the present state: the watchdog of output group 0\n");
  err_.str("");
  EXPECT_EQ(object_write(context_, "press:5", "6040", "0", "u16", "1", false), kFailed);
  EXPECT_EQ(err_.str(), "not possible in the present state: the watchdog of output group 0\n");
}

TEST_F(Commands, ARefusedNodeThatIsOperationalMeanwhileIsNotCalledBoth) {
  gateway_.answer.reply.error = line::to_error(line::Refusal::wrong_state);
  gateway_.answer.text = "not possible in the present state";
  gateway_.operational_node = 5;
  EXPECT_EQ(object_write(context_, "press:5", "6040", "0", "u16", "1", false), kFailed);
  EXPECT_EQ(err_.str(),
            "not possible in the present state: node 5 (drive) was not operational; now it is: "
            "repeat the command\n");
}

TEST_F(Commands, AFrameThatTheBusDoesNotAcknowledgeIsNotSent) {
  gateway_.answer.reply.data = line::WrittenByPdo{3, line::PdoWait::bus};
  EXPECT_EQ(write(context_, "press", "0", "1"), kHeldBack);
  EXPECT_EQ(out_.str(), "by PDO 3, which waits for: the bus: no acknowledge\n");
  gateway_.answer.reply = {.error = line::to_error(line::Refusal::no_acknowledge)};
  gateway_.answer.text = line::describe(line::Refusal::no_acknowledge);
  EXPECT_EQ(nmt(context_, "start", "press:5"), kHeldBack);
  EXPECT_THAT(err_.str(), HasSubstr("waits for the bus: no acknowledge"));
  gateway_.answer.reply = {.error = line::to_error(line::Refusal::awaits_turn)};
  gateway_.answer.text = line::describe(line::Refusal::awaits_turn);
  EXPECT_EQ(pdo_trigger(context_, "press", "3", false), kHeldBack);
  EXPECT_THAT(err_.str(), HasSubstr("waits for its turn (inhibit time"));
  gateway_.answer.reply = {.error = line::to_error(line::Refusal::no_acknowledge)};
  gateway_.answer.text = line::describe(line::Refusal::no_acknowledge);
  out_.str("");
  context_.json = true;
  EXPECT_EQ(nmt(context_, "start", "press:5"), kHeldBack);
  EXPECT_THAT(out_.str(), HasSubstr("waits for the bus: no acknowledge"));
}

TEST_F(Commands, WaitForTheAnswerLongerThanTheGatewayForTheBus) {
  context_.timeout = std::chrono::milliseconds(500);
  EXPECT_EQ(nmt(context_, "start", "press:5"), kDone);
  EXPECT_EQ(gateway_.last.timeout, std::chrono::milliseconds(500));
  EXPECT_GE(gateway_.patience, std::chrono::milliseconds(1500));
}

TEST_F(Commands, NmtToOneToAllAndToTheOwnNode) {
  EXPECT_EQ(nmt(context_, "reset-node", "press:5"), kDone);
  EXPECT_EQ(as<line::NmtRequest>(gateway_.last).command, nmt::Command::reset_node);
  EXPECT_EQ(out_.str(), "sent\n");
  EXPECT_EQ(nmt(context_, "start", "press:all"), kDone);
  EXPECT_EQ(line::node_of(gateway_.last), 0);
  EXPECT_EQ(nmt(context_, "start", "press:own"), kDone);
  EXPECT_EQ(line::node_of(gateway_.last), 127);
  EXPECT_EQ(nmt(context_, "begin", "press:all"), kUsage);
  EXPECT_EQ(nmt(context_, "start", "press:0"), kUsage);
}

TEST_F(Commands, AnUnknownLineIsNamedWithThoseThatThereAre) {
  EXPECT_EQ(sdo_read(context_, "hall:5", "1000", "0", ""), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("no line 'hall'; lines found: press (gateway plant)"));
}

TEST_F(Commands, ALineOfTwoGatewaysIsNamedWithItsGateway) {
  gateway_.written_route = true;
  gateway_.twin = true;
  EXPECT_EQ(sdo_read(context_, "press:5", "1000", "0", ""), kFailed);
  EXPECT_EQ(err_.str(), "the name matches more than one line: other/press or plant/press\n")
      << "the third line does not match";
  EXPECT_EQ(sdo_read(context_, "plant/press:5", "1000", "0", ""), kDone);
}

TEST_F(Commands, SilenceIsAFailureWithAReason) {
  gateway_.silent = true;
  EXPECT_EQ(lines(context_), kFailed);
  EXPECT_EQ(events(context_, {.count = 1}, [] { return false; }), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("no gateway was found"));
}

TEST_F(Commands, SilenceIsReportedWithTheDomainAndTheIdentityThatWereUsed) {
  gateway_.silent = true;
  const auto texts = [&] {
    std::set<std::string> out;
    const auto ran = [&](int code) {
      EXPECT_EQ(code, kFailed);
      out.insert(err_.str());
      err_.str("");
    };
    const auto never = [] { return false; };
    Model model;
    Filter filter;
    ran(gateways(context_));
    ran(lines(context_));
    ran(nodes(context_, "press"));
    ran(routes(context_));
    ran(trace(context_, 1, never));
    ran(sdo_read(context_, "press:5", "1000", "0", ""));
    ran(events(context_, {.count = 1}, never));
    ran(events(context_, {.line = "press", .count = 1}, never));
    ran(history(context_, {}, false, never));
    ran(history(context_, {.line = "press"}, false, never));
    ran(monitor_text(context_, {.once = true}, model, never));
    ran(monitor_text(context_, {}, model, never));
    ran(find_node(context_, model, "ram", filter));
    return out;
  };
  EXPECT_THAT(
      texts(),
      ElementsAre("no gateway was found (DDS domain 0, without security): check that "
                  "linegated runs, with this domain and without `security` in `dds:` of "
                  "its plant.yaml; `linegate doctor` with the same options finds the cause\n"));
  context_.dds = {.domain = 7, .security = "/id/panel3", .profile = "own\n.xml"};
  EXPECT_THAT(texts(),
              ElementsAre("no gateway was found (DDS domain 7, identity /id/panel3, profile "
                          "own?.xml): check that linegated runs, with this domain and an identity "
                          "of the same authority in `dds:` of its plant.yaml; `linegate doctor` "
                          "with the same options finds the cause\n"));
}

TEST_F(Commands, EventsAreThoseOfALineByNameOrNetworkId) {
  for (const char* line : {"press", "3", "plant/press", ""}) {
    gateway_.connects = true;
    out_.str("");
    EXPECT_EQ(events(context_, {.line = line, .count = 2}, [] { return false; }), kDone) << line;
    EXPECT_THAT(out_.str(), HasSubstr("connection ended")) << line;
  }
  EXPECT_EQ(events(context_, {.line = "hall", .count = 1}, [] { return false; }), kFailed)
      << "does not wait for a line that does not exist";
  EXPECT_THAT(err_.str(), HasSubstr("no line 'hall'"));
}

TEST_F(Commands, WhatIsRefusedIsSaidAsJsonWhereThatIsWanted) {
  context_.json = true;
  gateway_.answer = {.reply = {.error = line::to_error(line::Refusal::wrong_role), .data = {}},
                     .text = "not possible in the line's role"};
  ScanResult found;
  EXPECT_EQ(boot(context_, "press"), kFailed);
  EXPECT_EQ(configure(context_, ConfigAction::verify, "press"), kFailed);
  EXPECT_EQ(scan(context_, {.what = "press"}, found), kFailed);
  const std::string once = R"({"ok":false,"domain":"command","code":)" +
                           std::to_string(static_cast<unsigned>(line::Refusal::wrong_role)) +
                           R"(,"text":"not possible in the line's role"})"
                           "\n";
  EXPECT_EQ(out_.str(), once + once + once);
  EXPECT_EQ(err_.str(), "");
}

TEST_F(Commands, AnImportSaysWhenItReachesTheNode) {
  // 1017h = 300
  const auto one = test::raw({1, 0, 0, 0, 0x17, 0x10, 0, 2, 0, 0, 0, 0x2C, 1});
  EXPECT_EQ(import_configuration(context_, "press:5", one), kDone);
  EXPECT_EQ(out_.str(), "1 object for node 5, written to it when it boots the next time\n");
  EXPECT_EQ(as<line::LocalWrite>(gateway_.last).address, (od::Address{0x1F22, 5}));
  out_.str("");
  EXPECT_EQ(import_configuration(context_, "press", one), kDone);
  EXPECT_EQ(out_.str(), "1 object written\n");
  EXPECT_EQ(as<line::LocalWrite>(gateway_.last).address.index, 0x1017);
}

TEST_F(Commands, DamagedSamplesAreToldOnceAndNotAmongTheResults) {
  gateway_.unreadable = 2;
  EXPECT_EQ(lines(context_), kDone);
  EXPECT_EQ(err_.str(), "damaged samples were received and dropped\n");
  EXPECT_THAT(out_.str(), Not(HasSubstr("damaged")));
}

TEST_F(Commands, LinesAsTextAndAsJson) {
  EXPECT_EQ(lines(context_), kDone);
  EXPECT_THAT(out_.str(), HasSubstr("virtual:press"));
  out_.str("");
  context_.json = true;
  EXPECT_EQ(lines(context_), kDone);
  EXPECT_THAT(out_.str(), HasSubstr(R"("network_id":3)"));
}

}  // namespace
}  // namespace linegate::console
