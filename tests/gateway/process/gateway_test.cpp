// SPDX-License-Identifier: Apache-2.0
// The whole gateway in one process: simulated devices on one side, a DDS client on the other.
#include "gateway/process/gateway.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/gateway/log_keeper.h"
#include "tests/gateway/plans.h"
#include "tests/gateway/process/gateway_fixture.h"
#include "tests/paths.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;

TEST_F(GatewayTest, PublishesEveryReceptionOfALineThatDemandsIt) {
  const std::vector<dds::PdoReception>& got = seen_.receptions["open"];
  ASSERT_TRUE(until([&] { return got.size() >= 20; }));
  for (std::size_t i = 1; i < got.size(); ++i) {
    EXPECT_EQ(got[i].number, got[i - 1].number + 1);
    EXPECT_GT(got[i].time, got[i - 1].time);
    EXPECT_EQ(got[i].node, 5);
    EXPECT_FALSE(got[i].values.empty());
  }
  // The line received exactly the newest PDO and those before it.
  EXPECT_TRUE(until([&] { return seen_.lines["open"].counters.rpdos >= got.back().number; }));
  EXPECT_TRUE(seen_.receptions["closed"].empty());
}

TEST_F(GatewayTest, ADeviceIsAskedForAPdoAndAValueGoesByMpdo) {
  const auto request = [](std::uint16_t number) {
    return line::Command{.request = line::PdoRequest{.node = 5, .number = number}};
  };
  const dds::CommandResult came = call(at("open"), request(1));
  EXPECT_TRUE(came.reply.ok()) << came.text;
  EXPECT_EQ(call(at("open"), request(99)).reply.error,
            line::to_error(line::Refusal::unknown_entry));
  EXPECT_EQ(call(at("open"), request(2)).reply.error, line::to_error(line::Refusal::bad_request))
      << "its COB-ID does not permit RTR";
  EXPECT_EQ(call(at("closed"), request(2)).reply.error,
            line::to_error(line::Refusal::not_permitted));
  const line::Command value{
      .request = line::MpdoWrite{.node = 5, .address = {0x6200, 1}, .data = {std::byte{5}}}};
  const dds::CommandResult sent = call(at("open"), value);
  EXPECT_TRUE(sent.reply.ok()) << sent.text;
  EXPECT_EQ(sent.reply.data, line::ReplyData{line::SentByMpdo{100}});
}

TEST_F(GatewayTest, PublishesLinesNodesImagesAndEvents) {
  EXPECT_EQ(seen_.incarnation, kIncarnation);
  for (const char* name : {"outputs-access", "receive-queue-peak", "transmit-queue",
                           "transmit-stalls", "event-queue"}) {
    EXPECT_TRUE(seen_.line_properties.contains(name)) << name;
  }
  EXPECT_TRUE(until([&] {
    return seen_.lines["open"].manager == line::ManagerState::running &&
           seen_.images.count("open/inputs") != 0 && seen_.pdos.count("open") != 0;
  }));
  EXPECT_TRUE(until([&] { return seen_.line_properties["indicators"] == "run on, error off"; }));
  EXPECT_EQ(seen_.infos["open"].interface_uri, "simulated:");
  EXPECT_EQ(seen_.infos["open"].access, dds::Access::all);
  EXPECT_EQ(seen_.infos["closed"].access, dds::Access::read);
  EXPECT_TRUE(until([&] { return seen_.happened("open", EventKind::boot_result); }));
  EXPECT_EQ(seen_.gaps, 0);
  const auto& layout = seen_.layouts["open/inputs"];
  const auto& image = seen_.images["open/inputs"];
  EXPECT_EQ(image.layout_id, layout.id);
  EXPECT_EQ(image.bytes.size(), layout.byte_size);
  // The values of the device change, and the images have consecutive numbers.
  const auto first = image.sequence;
  EXPECT_TRUE(until([&] { return seen_.images["open/inputs"].sequence > first + 2; }));
}

TEST_F(GatewayTest, CarriesOutCommandsAsFarAsTheLineAllows) {
  const auto read = call(at("open"), sdo_read(5, 0x1000, 0));
  EXPECT_TRUE(read.reply.ok()) << read.text;
  EXPECT_EQ(read.reply.bytes().size(), 4U);

  const auto wrong = call(at("open"), sdo_read(5, 0x5FFF, 0));
  EXPECT_EQ(wrong.reply.error, (Error{Domain::sdo, 0x06020000}));
  EXPECT_FALSE(wrong.text.empty());

  EXPECT_TRUE(call(at("closed"), sdo_read(6, 0x1000, 0)).reply.ok());
  line::Command nmt{.request = line::NmtRequest{.node = 6, .command = nmt::Command::stop}};
  EXPECT_EQ(call(at("closed"), nmt).reply.error, line::to_error(line::Refusal::not_permitted));
  EXPECT_TRUE(until([&] { return seen_.happened("closed", EventKind::command_refused); }));

  const auto answered = call_gateway(at("closed"), request::Versions{});
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(answered.reply.bytes().data()),
                        answered.reply.bytes().size()),
            gateway::versions());

  EXPECT_EQ(call(at("open", kIncarnation + 1), sdo_read(5, 0x1000, 0)).reply.error,
            line::to_error(line::Refusal::wrong_incarnation));
}

TEST_F(GatewayTest, SwitchesTheFaultsOfASimulatedBus) {
  const auto said = [&](const std::string& change) {
    const line::Reply reply = call_gateway(at("open"), request::BusFault{change}).reply;
    EXPECT_TRUE(reply.ok()) << reply.error.code;
    return std::string(reinterpret_cast<const char*>(reply.bytes().data()), reply.bytes().size());
  };
  EXPECT_EQ(said("stuck=5@always"), "stuck=5@always");
  EXPECT_TRUE(until([&] {
    return seen_.happened("open", EventKind::heartbeat_lost) &&
           seen_.nodes["open/io"].presence != line::Presence::present;
  }));
  EXPECT_EQ(said("off"), "off");
  EXPECT_TRUE(until([&] {
    return seen_.nodes["open/io"].presence == line::Presence::present && operational("open/io");
  }));
  EXPECT_EQ(said("bus_off=now&restart=1ms"), "restart=0.001s");
  EXPECT_TRUE(until([&] { return seen_.happened("open", EventKind::bus_state); }));
  EXPECT_EQ(call_gateway(at("closed"), request::BusFault{}).reply.error,
            line::to_error(line::Refusal::not_permitted));
}

TEST_F(GatewayTest, WritesOutputsThroughToTheDevice) {
  const auto& outputs = seen_.layouts["open/outputs"];
  line::OutputWrite write;
  write.group = 3;
  write.layout_id = outputs.id;
  for (std::uint32_t i = 0; i < outputs.entries.size(); ++i) {
    line::OutputValue value;
    value.entry = i;
    value.length = 1;
    value.data[0] = static_cast<std::byte>(0xA0 + i);
    write.values.push_back(value);
  }
  EXPECT_TRUE(client_->write_outputs(at("open"), write));
  EXPECT_TRUE(until([&] {
    const auto result = call(at("open"), sdo_read(5, 0x6200, 2));
    return result.reply.ok() && result.reply.bytes().size() == 1 &&
           result.reply.bytes()[0] == std::byte{0xA1};
  }));
  // The output state: applied, and transmitted to a node that is started.
  const auto& answer = seen_.output_states["open"];
  EXPECT_TRUE(until([&] { return answer.applied == 1 && answer.waiting == 0; }));
  EXPECT_EQ(answer.group, 3);
  EXPECT_EQ(answer.owner, client_->name());

  write.layout_id = outputs.id + 1;
  EXPECT_TRUE(client_->write_outputs(at("open"), write));
  EXPECT_TRUE(until([&] { return seen_.happened("open", EventKind::output_refused); }));
  EXPECT_TRUE(until([&] { return answer.refused == 1; }));
  EXPECT_EQ(answer.refusal, line::OutputRefusal::stale_layout);
  EXPECT_EQ(answer.refused_client, client_->name());
  EXPECT_EQ(answer.applied, 1U);

  line::OutputWrite forbidden;
  forbidden.layout_id = seen_.layouts["closed/outputs"].id;
  EXPECT_TRUE(client_->write_outputs(at("closed"), forbidden));
  EXPECT_TRUE(until([&] { return seen_.happened("closed", EventKind::output_refused); }));
  EXPECT_TRUE(until(
      [&] { return seen_.output_states["closed"].refusal == line::OutputRefusal::not_permitted; }));
}

// The log is kept from before the start to after the end of all threads that may write to it.
class LoggedGatewayTest : public GatewayTest {
 protected:
  void TearDown() override { gateway_.reset(); }

  LogKeeper log_;
};

TEST_F(LoggedGatewayTest, TellsOfOutputsForALineThatDoesNotExist) {
  line::OutputWrite write;
  write.group = 3;
  ASSERT_TRUE(client_->write_outputs(at("no\nbody"), write));
  EXPECT_TRUE(until([&] {
    return std::ranges::any_of(log_.lines(), [](const std::string& line) {
      return line.find("line 'no.body' does not exist: outputs of group 3 of ") !=
             std::string::npos;
    });
  }));
}

TEST_F(LoggedGatewayTest, TellsOfAnotherGatewayOfItsName) {
  const auto other = dds::GatewayBridge::make(
      {.gateway = "test", .domain = test::own_domain(), .profile_file = paths::kLoopbackProfiles});
  EXPECT_TRUE(until([&] { return seen_.line_properties["namesakes"] == "1"; }));
  const std::string told = "warning another gateway is of the same name as this one";
  EXPECT_TRUE(until([&] {
    return std::ranges::any_of(log_.lines(), [&](const auto& l) { return l.starts_with(told); });
  }));
}

class RoutingGatewayTest : public GatewayTest {
 protected:
  std::string text() const override {
    std::string out = plant_text();
    return out.insert(out.find("    access: read\n"), "    enter: open\n");
  }
};

TEST_F(RoutingGatewayTest, AnSdoCrossesTwoLinesIfBothPermitIt) {
  line::Command crossing{.request =
                             line::NetworkRead{.network = 2, .node = 6, .address = {0x1000, 0}}};
  const auto crossed = call(at("open"), crossing);
  EXPECT_TRUE(crossed.reply.ok()) << crossed.text;
  EXPECT_EQ(crossed.reply.bytes(), call(at("closed"), sdo_read(6, 0x1000, 0)).reply.bytes());
  crossing.request =
      line::NetworkWrite{.network = 2, .node = 6, .address = {0x1000, 0}, .data = {std::byte{1}}};
  EXPECT_EQ(call(at("open"), crossing).reply.error, line::to_error(line::Refusal::not_permitted));
  EXPECT_TRUE(until([&] { return seen_.line_properties.contains("routing-opened"); }));
  EXPECT_EQ(seen_.line_properties["routes-1"], "1 open 0, 2 closed 0");
}

TEST_F(RoutingGatewayTest, TellsOfConnectionsWhileSomebodyTraces) {
  line::Command trace{.request = line::RoutingTrace{.duration = std::chrono::seconds(30)}};
  EXPECT_TRUE(call(at("open"), trace).reply.ok());
  line::Command crossing{.request =
                             line::NetworkRead{.network = 2, .node = 6, .address = {0x1000, 0}}};
  EXPECT_TRUE(call(at("open"), crossing).reply.ok());
  EXPECT_TRUE(until([&] { return seen_.happened("open", EventKind::routing_ended); }));
  EXPECT_TRUE(seen_.happened("open", EventKind::routing_opened));
  EXPECT_TRUE(std::ranges::any_of(seen_.texts, [](const std::string& text) {
    return text.find(
               "from this gateway to node 6 of network 2 over closed ended, upload of "
               "1000:00, 4 bytes: done") != std::string::npos;
  }));
}

class ClosedRoutingGatewayTest : public RoutingGatewayTest {
 protected:
  std::string text() const override {
    std::string out = RoutingGatewayTest::text();
    return out.replace(out.find("access: read\n"), 13, "access: off\n");
  }
  line::Command own_write(std::uint8_t sub, std::uint64_t value, std::size_t size) const {
    line::LocalWrite write{.address = {0x1F2C, sub}};
    for (std::size_t i = 0; i < size; ++i) {
      write.data.push_back(static_cast<std::byte>(value >> (8 * i)));
    }
    return {.request = std::move(write)};
  }
};

TEST_F(ClosedRoutingGatewayTest, ARouteWrittenAtRunTimeIsShownAndOpensNoLine) {
  // Network 9 is reached over the line "closed", next gateway 6, cost 1.
  EXPECT_TRUE(call(at("open"), own_write(3, 0x0001'0602'0009'0009, 8)).reply.ok());
  EXPECT_TRUE(call(at("open"), own_write(0, 3, 1)).reply.ok());
  EXPECT_TRUE(until([&] { return seen_.routes["open"] == "1 open 0, 2 closed 0, 9 closed:6 1"; }));
  EXPECT_EQ(seen_.routes["closed"], "1 open 0, 2 closed 0");
  line::Command crossing{.request =
                             line::NetworkRead{.network = 9, .node = 5, .address = {0x1000, 0}}};
  EXPECT_EQ(call(at("open"), crossing).reply.error, to_error(AbortCode::local_control));
  EXPECT_TRUE(until([&] { return seen_.happened("closed", EventKind::routing_refused); }));
}

// Either of the two lines is replaced while the other one stays.
TEST_F(RoutingGatewayTest, AReloadJoinsWhatIsNewWithWhatStays) {
  line::Command crossing{.request =
                             line::NetworkRead{.network = 2, .node = 6, .address = {0x1000, 0}}};
  const std::pair<const char*, const char*> changes[] = {
      {"sdo_timeout: 500ms", "sdo_timeout: 600ms"}, {"name: drive", "name: motor"}};
  std::string plant = text();
  for (const auto& [was, is] : changes) {
    plant.replace(plant.find(was), std::string_view(was).size(), is);
    const auto result = gateway_->reload(make_plant(plant));
    EXPECT_TRUE(result.done);
    EXPECT_EQ(result.difference.changed.size(), 1U);
    EXPECT_EQ(result.difference.unchanged.size(), 1U);
    EXPECT_TRUE(until([&] { return call(at("open"), crossing).reply.ok(); })) << was;
  }
}

TEST_F(GatewayTest, WritesOneOutputForAPersonAndChecksTheLayout) {
  line::Command write{.request = line::SingleOutput{.entry = 0, .data = {std::byte{0x5A}}}};
  const std::uint64_t layout = seen_.layouts["open/outputs"].id;
  EXPECT_EQ(call(at("open"), write, layout + 1).reply.error,
            line::to_error(line::Refusal::stale_layout));
  const auto done = call(at("open"), write, layout);
  EXPECT_TRUE(done.reply.ok()) << done.text;
}

// The other line is not disturbed: it does not restart, loses nothing, and continues its numbers.
TEST_F(GatewayTest, ReloadsOnlyTheLinesThatChanged) {
  ASSERT_TRUE(until([&] { return seen_.lines["closed"].manager == line::ManagerState::running; }));
  const auto& image = seen_.images["open/inputs"];
  ASSERT_TRUE(until([&] { return image.sequence > 0; }));
  const auto closed_events = seen_.events["closed"].size();
  const auto closed_frames = seen_.lines["closed"].counters.frames_received;

  std::string text = plant_text();
  text.replace(text.find("{id: 6, name: drive"), 19, "{id: 6, name: motor");
  const std::string more = R"(  - name: more
    interface: "simulated:"
    nodes: [{id: 9, name: lamp, eds: bridges/sim/eds/digital-io.eds}]
    simulate: [{node: 9, profile: digital-io}]
)";
  const auto result = gateway_->reload(make_plant(text + more));
  EXPECT_TRUE(result.done);
  EXPECT_TRUE(result.diagnostics.empty());
  EXPECT_EQ(describe(result.difference),
            "lines changed: closed; started: more; stopped: none; unchanged: 1");
  EXPECT_TRUE(until([&] { return operational("closed/motor") && operational("more/lamp"); }));
  EXPECT_TRUE(until([&] {
    return seen_.happened("closed", EventKind::line_stopped) &&
           seen_.events["closed"].size() > closed_events + 5 &&
           seen_.lines["closed"].counters.frames_received > closed_frames &&
           seen_.layouts.size() == 6;
  }));
  EXPECT_TRUE(call(at("more"), sdo_read(9, 0x1000, 0)).reply.ok());
  EXPECT_TRUE(call(at("open"), sdo_read(5, 0x1000, 0)).reply.ok());
  const auto first = image.sequence;
  EXPECT_TRUE(until([&] { return image.sequence > first + 2; }));
  EXPECT_EQ(seen_.gaps, 0);
  EXPECT_FALSE(seen_.happened("open", EventKind::line_stopped));
  EXPECT_FALSE(seen_.happened("open", EventKind::heartbeat_lost));
  EXPECT_EQ(seen_.lines["open"].counters.frames_lost, 0U);
  EXPECT_EQ(seen_.incarnation, kIncarnation);

  // The reverse change: a line that is removed disappears for its subscribers.
  const auto back = gateway_->reload(make_plant(text));
  EXPECT_TRUE(back.done);
  EXPECT_EQ(back.difference.stopped, std::vector<std::string>{"more"});
  EXPECT_TRUE(until([&] {
    return seen_.happened("more", EventKind::line_stopped) &&
           std::ranges::count(seen_.lines_gone, "more") == 1;
  }));
  EXPECT_EQ(call(at("more"), sdo_read(9, 0x1000, 0)).reply.error,
            line::to_error(line::Refusal::unknown_line));
  EXPECT_EQ(seen_.images_back, 0);
}

// The line is replaced by one with the nodes that were found. Commands that arrive meanwhile wait
// for the new line.
TEST_F(GatewayTest, AScanBehindOneThatIsAppliedWaitsForTheLine) {
  ASSERT_TRUE(gateway_
                  ->reload(make_plant(plant_text() + R"(  - name: bare
    interface: "simulated:"
    access: all
    sdo_timeout: 500ms
    simulate: [{node: 9, profile: digital-io}]
)"))
                  .done);
  line::Command scan{.request = line::ScanApply{}};
  ASSERT_TRUE(until([&] { return call(at("bare"), scan).reply.ok(); }));
  scan = {.request = line::Scan{.node = 9}};
  ASSERT_NE(client_->send(at("bare"), scan, kPatience), 0U);
  const Instant taken = monotonic_now() + 300ms;  // the other thread checks once a second
  ASSERT_TRUE(until([&] { return monotonic_now() > taken; }));
  EXPECT_TRUE(seen_.replies.empty());
  ASSERT_TRUE(gateway_->apply_scans());
  ASSERT_TRUE(until([&] { return !seen_.replies.empty(); }));
  EXPECT_EQ(seen_.replies, std::vector{Error{}});
  EXPECT_EQ(seen_.lines["bare"].nodes_configured, 1U);
}

TEST_F(GatewayTest, AReloadThatIsRefusedChangesNothing) {
  std::string text = plant_text();
  text.replace(text.find("name: test"), 10, "name: else");
  text.replace(text.find("access: read"), 12, "access: all");
  const auto result = gateway_->reload(make_plant(text));
  EXPECT_FALSE(result.done);
  EXPECT_TRUE(has_errors(result.diagnostics));
  EXPECT_TRUE(call(at("closed"), sdo_read(6, 0x1000, 0)).reply.ok());
  EXPECT_FALSE(seen_.happened("closed", EventKind::line_stopped));
}

TEST_F(GatewayTest, PublishesTheLastEventsWhenItStops) {
  gateway_->stop();
  EXPECT_TRUE(until([&] {
    return seen_.happened("open", EventKind::line_stopped) &&
           seen_.happened("closed", EventKind::line_stopped);
  }));
  EXPECT_EQ(seen_.gaps, 0);
}

}  // namespace
}  // namespace linegate::gateway
