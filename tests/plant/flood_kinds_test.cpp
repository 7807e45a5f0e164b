// SPDX-License-Identifier: Apache-2.0
// Invariant: as in request_flood_test.cpp, for each kind of request: 5,000 a second of it cost no
// heartbeat and no SYNC, another client is answered within twice its unloaded time, and all frames
// that the flood causes, of whatever service, stay within the share of the client.
//
// A kind of CommandKind without a row fails.
#include <algorithm>
#include <cstdint>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include "tests/plant/request_flood.h"
#include "tests/plant/sdo_channel.h"

namespace linegate::plant {
namespace {

using line::CommandKind;

constexpr std::uint8_t kVictim = 5;
constexpr std::uint8_t kManager = 127;
constexpr std::uint32_t kOutputs = 12;  // entries of the image: four of each drive
constexpr std::uint16_t kOwnNetwork = 1;
constexpr std::uint32_t kMpdo = 0x57E;
constexpr od::Address kOwnValue{0x2100, 1};    // of the own dictionary, sent by MPDO
constexpr od::Address kSdoValue{0x6081, 0};    // of a drive: no PDO carries it
constexpr od::Address kPdoValue{0x607A, 0};    // of a drive: RPDO 2 carries it
constexpr od::Address kEventValue{0x6040, 0};  // of a drive: RPDO 1 carries it
constexpr od::Address kRequestNmt{0x1F82, kVictim};
constexpr od::Address kConfigure{0x1F25, kVictim};
constexpr od::Address kScanNode{0x5F41, 0x0A};
constexpr od::Address kTrigger{0x5F41, 0x0C};

class FloodOfKinds;

struct Kind {
  CommandKind kind;
  const char* detail;  // of several rows for one kind
  // Sends one request, or a few that belong together.
  void (*send)(FloodOfKinds& flood);
  // Requests are carried out. Otherwise the line refuses all of them.
  bool works = true;
  std::uint8_t resets = 0;  // this node; 0 = none
};

class FloodOfKinds : public RequestFlood, public testing::WithParamInterface<Kind> {
 public:
  void send(line::Request request) { (void)this->request(kHostile, std::move(request)); }
  void send_local(od::Address address, std::vector<std::byte> data) {
    send(line::LocalWrite{.address = address, .data = std::move(data)});
  }
  // 1, 2, 3, ..., so that each request has another value.
  std::uint32_t turn() { return ++turns_; }
  // The number of the newest connection that was opened; 0 = none.
  std::uint32_t newest_connection() {
    for (auto tag = queued_.rbegin(); tag != queued_.rend(); ++tag) {
      const auto reply = seat().replies.find(*tag);
      if (reply == seat().replies.end() || !reply->second.ok()) {
        continue;
      }
      const auto* const made = std::get_if<line::SdoConnections>(&reply->second.data);
      if (made != nullptr && made->size() == 1) {
        return made->front().number;
      }
    }
    return 0;
  }

 protected:
  void configure() override {
    config().network_id = kOwnNetwork;
    config().routing = {.interface = 1,
                        .interfaces = {{.number = 1, .network = kOwnNetwork, .node = kManager}}};
    for (std::uint32_t entry = 0; entry < kOutputs; ++entry) {
      config().defaults.push_back({.entry = entry});
    }
    config().connection_pool = {0x680, 0x683};
    config().sleep = {.request = 0x690, .objection = 0x691};
    line::OwnObject own{.index = kOwnValue.index};
    own.variable.sub = kOwnValue.sub;
    own.variable.type = od::DataType::unsigned32;
    own.variable.access = od::Access::rw;
    own.variable.mappable = true;
    own.variable.value = number(0);
    config().own_objects = {std::move(own)};
    pdo::Parameters mpdo;
    mpdo.number = 100;
    mpdo.cob_id = {kMpdo | can::CobId::kNoRtrBit};
    mpdo.mpdo = pdo::MpdoMode::destination;
    mpdo.mapping = {{kOwnValue, 32}};
    config().forwarding.tpdos = {std::move(mpdo)};
    permit_rtr(config().nodes.front());
  }
  void prepare(sim::Device& device) override {
    for (std::uint16_t i = 0; i < 2; ++i) {
      add_channel(device.dictionary(), static_cast<std::uint16_t>(0x1280 + i));
      add_channel(device.dictionary(), static_cast<std::uint16_t>(0x1201 + i));
    }
    device.node().sdo_clients().configure();
  }

 private:
  std::uint32_t turns_ = 0;
};

std::vector<std::byte> byte_of(std::uint8_t value) {
  return {std::byte{value}};
}

const Kind kKinds[] = {
    {CommandKind::sdo_read, "",
     [](auto& flood) {
       flood.send(line::SdoRead{.node = kVictim, .address = {0x1018, 1}});
     }},
    {CommandKind::sdo_read, "_segmented",
     [](auto& flood) {
       flood.send(line::SdoRead{.node = kVictim, .address = {0x1008, 0}});
     }},
    {CommandKind::sdo_write, "",
     [](auto& flood) {
       flood.send(
           line::SdoWrite{.node = kVictim, .address = kSdoValue, .data = number(flood.turn())});
     }},
    {CommandKind::sdo_write, "_own_nmt",
     [](auto& flood) {
       flood.send(line::SdoWrite{.node = kManager, .address = kRequestNmt, .data = byte_of(5)});
     }},
    {CommandKind::sdo_write, "_own_scan",
     [](auto& flood) {
       flood.send(line::SdoWrite{.node = kManager, .address = kScanNode, .data = byte_of(kVictim)});
     }},
    {CommandKind::local_read, "",
     [](auto& flood) {
       flood.send(line::LocalRead{.what = od::Address{0x1000, 0}});
     }},
    {CommandKind::local_write, "",
     [](auto& flood) { flood.send_local(kOwnValue, number(flood.turn())); }},
    {CommandKind::local_write, "_nmt",
     [](auto& flood) { flood.send_local(kRequestNmt, byte_of(5)); }},
    {CommandKind::local_write, "_configure",
     [](auto& flood) { flood.send_local(kConfigure, number(0x666E'6F63)); }, true, kVictim},
    {CommandKind::local_write, "_scan",
     [](auto& flood) { flood.send_local(kScanNode, byte_of(kVictim)); }},
    {CommandKind::local_write, "_trigger",
     [](auto& flood) { flood.send_local(kTrigger, number(kVictim << 8U | 1U, 2)); }},
    {CommandKind::output_write, "",
     [](auto& flood) {
       flood.send(line::SingleOutput{.entry = 0, .data = number(flood.turn() % 2, 2)});
     }},
    {CommandKind::emcy_send, "", [](auto& flood) { flood.send(line::EmcySend{.code = 0x1000}); }},
    {CommandKind::nmt, "",
     [](auto& flood) {
       flood.send(line::NmtRequest{.node = kVictim, .command = nmt::Command::start});
     }},
    {CommandKind::nmt, "_reset",
     [](auto& flood) {
       flood.send(line::NmtRequest{.node = kVictim, .command = nmt::Command::reset_communication});
     },
     true, kVictim},
    {CommandKind::network_read, "",
     [](auto& flood) {
       flood.send(
           line::NetworkRead{.network = kOwnNetwork, .node = kVictim, .address = {0x1018, 1}});
     }},
    {CommandKind::network_write, "",
     [](auto& flood) {
       flood.send(line::NetworkWrite{.network = kOwnNetwork,
                                     .node = kVictim,
                                     .address = kSdoValue,
                                     .data = number(flood.turn())});
     }},
    {CommandKind::routing_trace, "",
     [](auto& flood) { flood.send(line::RoutingTrace{.duration = 1s}); }},
    {CommandKind::scan, "", [](auto& flood) { flood.send(line::Scan{.node = kVictim}); }},
    {CommandKind::boot, "", [](auto& flood) { flood.send(line::Boot{.node = kVictim}); }, true,
     kVictim},
    {CommandKind::configure, "_compare",
     [](auto& flood) { flood.send(line::Configure{.node = kVictim}); }},
    {CommandKind::configure, "",
     [](auto& flood) { flood.send(line::Configure{.node = kVictim, .apply = true}); }, true,
     kVictim},
    {CommandKind::program, "", [](auto& flood) { flood.send(long_program()); }, true, 7},
    {CommandKind::lss, "",
     [](auto& flood) {
       flood.send(
           line::LssRequest{.procedure = lss::Procedure::switch_global, .arguments = byte_of(0)});
     }},
    {CommandKind::lss, "_fastscan",
     [](auto& flood) { flood.send(line::LssRequest{.procedure = lss::Procedure::fastscan}); }},
    {CommandKind::object_write, "",
     [](auto& flood) {
       flood.send(line::ObjectWrite{
           .node = kVictim, .address = kEventValue, .data = number(flood.turn() % 2, 2)});
     }},
    {CommandKind::object_write, "_of_a_sync_pdo",
     [](auto& flood) {
       flood.send(
           line::ObjectWrite{.node = kVictim, .address = kPdoValue, .data = number(flood.turn())});
     }},
    {CommandKind::object_write, "_by_sdo",
     [](auto& flood) {
       flood.send(
           line::ObjectWrite{.node = kVictim, .address = kSdoValue, .data = number(flood.turn())});
     }},
    {CommandKind::pdo_trigger, "",
     [](auto& flood) { flood.send(line::PdoTrigger{.node = kVictim, .number = 1}); }},
    {CommandKind::can_send, "",
     [](auto& flood) { flood.send(line::CanSend{.frame = urgent_frame()}); }},
    {CommandKind::can_listen, "", [](auto& flood) { flood.send(line::CanListen{.duration = 1s}); }},
    {CommandKind::object_create, "",
     [](auto& flood) {
       if (flood.turn() % 2 == 0) {
         flood.send(line::ObjectCreate{line::ObjectRemoval{0x2200}});
         return;
       }
       line::OwnObject object{.index = 0x2200};
       object.variable.type = od::DataType::unsigned32;
       object.variable.access = od::Access::rw;
       object.variable.value = number(0);
       flood.send(line::ObjectCreate{std::move(object)});
     }},
    // The nodes of the line are configured. FloodOfScans has a line that has none.
    {CommandKind::scan_apply, "", [](auto& flood) { flood.send(line::ScanApply{.node = kVictim}); },
     false},
    {CommandKind::pdo_request, "",
     [](auto& flood) { flood.send(line::PdoRequest{.node = kVictim, .number = 1}); }},
    {CommandKind::mpdo_write, "",
     [](auto& flood) {
       flood.send(
           line::MpdoWrite{.node = kVictim, .address = kSdoValue, .data = number(flood.turn())});
     }},
    {CommandKind::connection_open, "",
     [](auto& flood) { flood.send(line::ConnectionOpen{.node = kVictim, .server = 7}); }},
    {CommandKind::connection_close, "",
     [](auto& flood) {
       const std::uint32_t newest = flood.newest_connection();
       if (newest == 0) {
         flood.send(line::ConnectionOpen{.node = kVictim, .server = 7});
       } else {
         flood.send(line::ConnectionClose{.number = newest});
       }
     }},
    {CommandKind::connection_list, "", [](auto& flood) { flood.send(line::ConnectionList{}); }},
    {CommandKind::sleep, "_check",
     [](auto& flood) { flood.send(line::SleepRequest{line::SleepAction::check}); }},
    // The line does not sleep.
    {CommandKind::sleep, "_wake",
     [](auto& flood) { flood.send(line::SleepRequest{line::SleepAction::wake}); }, false},
    {CommandKind::sleep, "_object",
     [](auto& flood) {
       flood.send(line::SleepRequest{flood.turn() % 2 == 0 ? line::SleepAction::consent
                                                           : line::SleepAction::object});
     }},
};

TEST(FloodKinds, EachKindOfRequestHasARow) {
  for (const CommandKind kind : line::kRequestKinds) {
    EXPECT_NE(std::ranges::find(kKinds, kind, &Kind::kind), std::end(kKinds))
        << "a flood of " << name(kind) << " is not tested";
  }
}

TEST_P(FloodOfKinds, CostsNoHeartbeatNoSyncAndNoAnswer) {
  constexpr Duration kTime = 4s;
  const Kind& kind = GetParam();
  const Duration unloaded = longest_answer(10s, [] {});
  const std::int64_t quiet = bits_on_the_bus() / 10;  // a second
  begin_here();
  const Duration loaded = longest_answer(kTime, [&] { kind.send(*this); });
  EXPECT_LE(loaded, 2 * unloaded) << loaded.count() << " ns, unloaded " << unloaded.count();
  expect_services_in_time(kind.resets);
  const std::int64_t caused = bits_on_the_bus() - quiet * (kTime / 1s);
  EXPECT_LE(caused, kClientRate * (kTime / 1s) + kMostAhead + quiet / 20);
  // A long procedure may not have ended: then its frames are counted.
  const bool works = carried_out() != 0 || caused > kClientRate;
  EXPECT_EQ(works, kind.works) << carried_out() << " of " << queued_.size();
  std::cout << name(kind.kind) << kind.detail << ": " << queued_.size() << " accepted, "
            << carried_out() << " carried out, " << busy_ << " refused as busy, " << caused
            << " bits, other client " << loaded / 1us << " us, unloaded " << unloaded / 1us
            << " us\n";
}

INSTANTIATE_TEST_SUITE_P(Table, FloodOfKinds, testing::ValuesIn(kKinds), [](const auto& each) {
  std::string out = std::string(name(each.param.kind)) + each.param.detail;
  std::ranges::replace(out, '-', '_');
  return out;
});

// --- a line without information about its devices ------------------------------------------------

class FloodOfScans : public RequestFlood {
 protected:
  void configure() override { config().nodes.clear(); }
};

TEST_F(FloodOfScans, OfAnUnknownPlantCostNoSyncAndNoAnswer) {
  const Duration unloaded = longest_answer(2s, [] {});
  begin_here();
  const Duration loaded = longest_answer(
      4s, [&] { (void)request(kHostile, line::ScanApply{.node = kVictim, .set_up = true}); });
  EXPECT_LE(loaded, 2 * unloaded) << loaded.count() << " ns, unloaded " << unloaded.count();
  EXPECT_LE(longest_gap(0x080), kSync + 5ms);
  EXPECT_LE(burst_at(kClientRate, {kVictim}), kMostAhead);
  EXPECT_GT(frames_of_flood_, 100U) << "the flood reaches the bus";
}

// --- another network -----------------------------------------------------------------------------

// A base, because the budget outlives the line.
struct WithHallBudget {
  line::RequestBudget hall_budget_{{.bit_rates = {.nominal = kBitRate}}};
};

// Requests on the line "press" for a node of the line "hall".
class FloodOfARoute : protected WithHallBudget, public RequestFlood {
 protected:
  static constexpr std::uint16_t kHall = 2;
  static constexpr std::uint8_t kFarNode = 9;

  void configure() override {
    const std::vector<routing::Interface> both{{.number = 1, .network = 1, .node = 127},
                                               {.number = 2, .network = kHall, .node = 127}};
    config().routing = {.interface = 1,
                        .interfaces = both,
                        .routes = {{.first = kHall, .last = kHall, .interface = 2}}};
    line::LineConfig hall;
    hall.name = "hall";
    hall.network_id = kHall;
    hall.bit_rate = kBitRate;
    hall.heartbeat = 500ms;
    hall.sync_period = kSync;
    hall.routing = {.interface = 2, .interfaces = both};
    hall.nodes = {node_of(kFarNode, "drive")};
    auto made = line::Line::make(std::move(hall));
    ASSERT_TRUE(made.ok());
    hall_ = &world().add_line(*std::move(made.value), bus());
    hall_->line->set_pace(hall_budget_);
    const sim::DeviceOptions options{.profile = "drive", .node_id = kFarNode};
    world().add_device(*hall_, *std::move(sim::Device::make(options).value));
  }
  // 5,000 a second, for 4 s.
  void flood(const line::Request& request) {
    const Duration unloaded = longest_answer(2s, [] {});
    begin_here();
    const std::size_t first = hall_->frames.size();
    const Duration loaded = longest_answer(4s, [&] {
      hall_budget_.advance(world().now());
      (void)this->request(kHostile, request);
    });
    EXPECT_LE(loaded, 2 * unloaded) << loaded.count() << " ns, unloaded " << unloaded.count();
    expect_services_in_time();
    EXPECT_LE(longest_gap(*hall_, first, 0x080), kSync + 5ms);
    EXPECT_LE(longest_gap(*hall_, first, can::kErrorControlBase + kFarNode), kHeartbeat + 10ms);
    EXPECT_GT(carried_out(), 0U);
  }

  LineSeat* hall_ = nullptr;
};

TEST_F(FloodOfARoute, OfReadsCostsNoHeartbeatAndNoSyncOfEitherLine) {
  flood(line::NetworkRead{.network = kHall, .node = kFarNode, .address = {0x1008, 0}});
}

TEST_F(FloodOfARoute, OfWritesCostsNoHeartbeatAndNoSyncOfEitherLine) {
  flood(line::NetworkWrite{
      .network = kHall, .node = kFarNode, .address = kSdoValue, .data = number(1)});
}

}  // namespace
}  // namespace linegate::plant
