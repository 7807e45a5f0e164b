// SPDX-License-Identifier: Apache-2.0
// Which role sends which request to a line with which access: each cell of the table in
// deploy/SECURITY.md, with a gateway that runs and a client of each role.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "bridges/dds/client.h"
#include "bridges/dds/security.h"
#include "bridges/request/request.h"
#include "gateway/process/gateway.h"
#include "gateway/security/authority.h"
#include "gateway/security/files.h"

#include "tests/dds/own_domain.h"
#include "tests/gateway/plans.h"
#include "tests/gateway/process/gateway_listener.h"
#include "tests/gateway/security/rights_table.h"
#include "tests/paths.h"

namespace linegate::gateway {
namespace {

namespace folders = std::filesystem;
using Clock = std::chrono::steady_clock;
using security::Role;
using security::Table;

// Fast DDS 2.9.1 does not authenticate every participant that joins late: a new one is made.
constexpr int kAttempts = 8;
constexpr std::chrono::seconds kOneAttempt{8};
constexpr std::chrono::seconds kPatience{40};
constexpr int kRounds = 20;
constexpr std::chrono::milliseconds kPoll{5};

// A line cannot be called "all".
const std::string kUnlimited = "unlimited";
// The columns of each role, and the access of the line with that name. The last one names the
// access of each certificate, which is that of another column.
const std::map<std::string, std::string> kLines{
    {"off", "off"},
    {"read", "read"},
    {"commands", "{commands: all, outputs: read}"},
    {kUnlimited, "all"},
    {"named", "{commands: off, outputs: off, clients: {operator/olga: read, engineer/erin: all}}"},
};

std::string column_of(const std::string& role, const std::string& line) {
  return role + ", " + (line == kUnlimited ? "all" : line);
}

// One of each kind, with members that satisfy the bounds of the contract: others are refused before
// the check.
std::vector<request::Request> requests() {
  const std::vector<std::byte> value{std::byte{100}, std::byte{0}};
  const od::Address address{0x1017, 0};
  return {
      line::SdoRead{.node = 8, .address = address},
      line::SdoWrite{.node = 8, .address = address, .data = value},
      line::LocalRead{.what = address},
      line::LocalWrite{.address = address, .data = value},
      line::SingleOutput{.entry = 0, .data = {std::byte{1}}},
      line::EmcySend{.code = 0x2310, .error_register = 4},
      line::NmtRequest{.node = 8, .command = nmt::Command::start},
      request::Versions{},
      line::NetworkRead{.network = 12, .node = 8, .address = address},
      line::NetworkWrite{.network = 12, .node = 8, .address = address, .data = value},
      request::BusRestart{},
      line::RoutingTrace{.duration = std::chrono::seconds(1)},
      line::Scan{.node = 8},
      request::BusFault{"lost=1%"},
      line::Boot{.node = 8},
      line::Configure{.node = 8, .apply = true},
      line::ProgramDownload{.node = 8, .number = 1, .program = value},
      line::LssRequest{.procedure = lss::Procedure::configure_node_id, .arguments = {std::byte{9}}},
      line::ObjectWrite{.node = 8, .address = address, .data = value},
      line::PdoTrigger{.node = 8, .number = 1},
      line::CanSend{can::make_frame(0x150, {1, 2, 3})},
      line::CanListen{.identifier = 0x150, .duration = std::chrono::seconds(1)},
      line::ObjectCreate{.what = line::ObjectRemoval{0x2200}},
      line::ScanApply{.node = 8},
      line::PdoRequest{.node = 8, .number = 1},
      line::MpdoWrite{.node = 8, .address = {0x6200, 1}, .data = {std::byte{1}}, .tpdo = 100},
      request::JournalRead{},
      line::ConnectionOpen{.node = 8, .server = 9},
      line::ConnectionClose{.number = 1},
      line::ConnectionList{},
      line::SleepRequest{},
  };
}

struct Replies : GatewayListener {
  void on_reply(const dds::Target& target, const dds::CommandResult& result) override {
    by_id[result.id] = result.reply.error;
    GatewayListener::on_reply(target, result);
  }
  std::map<std::uint64_t, Error> by_id;
};

class CommandRights : public testing::Test {
 protected:
  void SetUp() override {
    EXPECT_EQ(security::init(authority.string()), "");
    for (const auto& [name, role] :
         {std::pair("plant", Role::gateway), std::pair("olga", Role::operator_),
          std::pair("erin", Role::engineer), std::pair("victor", Role::viewer)})
      EXPECT_EQ(security::issue(authority.string(), {{name, role}, 60}), "");
    auto made = Gateway::make(make_plant(plant()), 1);
    ASSERT_TRUE(made.ok());
    gateway_ = std::move(*made.value);
    gateway_->start();
  }
  ~CommandRights() override {
    client_.reset();
    gateway_.reset();
    folders::remove_all(authority);
  }

  std::string plant() const {
    std::string out =
        "schema: 1\ngateway: {name: plant}\ndds: {domain: " + std::to_string(test::own_domain()) +
        ", process: " + place_of_dds().process +
        ", profile: " + std::string(paths::kLoopbackProfiles) +
        ", security: " + (authority / "plant").string() + "}\nlines:\n";
    for (const auto& [name, access] : kLines) {
      out += "  - name: " + name + "\n    interface: \"simulated:\"\n    sdo_timeout: 500ms\n" +
             "    access: " + access +
             "\n    nodes: [{id: 8, name: io, eds: bridges/sim/eds/digital-io.eds, heartbeat: "
             "100ms}]\n"
             "    simulate: [{node: 8, profile: digital-io}]\n";
    }
    return out;
  }

  // Makes clients until one receives each line and has sent a request to each.
  bool connect(const std::string& name, const std::string& role) {
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      client_.reset();
      seen_ = {};
      dds::ClientOptions options;
      options.domain = test::own_domain();
      options.profile_file = paths::kLoopbackProfiles;
      options.outputs = true;
      options.security = dds::security_with(security::files_in((authority / name).string()));
      options.security.right = role + "/" + name;
      auto made = dds::Client::make(options);
      if (!made.ok())
        return false;
      client_ = std::move(*made.value);
      if (until([&] { return seen_.lines.size() == kLines.size(); }, kOneAttempt))
        return true;
    }
    return false;
  }
  bool until(const std::function<bool()>& done, std::chrono::seconds limit = kPatience) {
    const auto end = Clock::now() + limit;
    while (!done()) {
      if (Clock::now() > end)
        return false;
      client_->poll(kPoll, seen_);
    }
    return true;
  }

  struct Cell {
    std::string row;
    std::string line;
    line::Request request;
  };

  // Sends each kind of request to each line. A cell is "yes" if the answer is any other than
  // Refusal::not_permitted or no_right.
  void observe(const std::string& role, Table& out) {
    std::vector<Cell> cells;
    for (const auto& [line, access] : kLines) {
      for (const request::Request& request : requests()) {
        const std::string row(request::command_name(request::kind(request)));
        if (const auto* const of_gateway = std::get_if<request::GatewayRequest>(&request)) {
          const auto result =
              client_->call_gateway({"plant", line, 0}, *of_gateway, kPatience, seen_);
          out[row][column_of(role, line)] = cell_of(result.reply.error);
        } else {
          cells.push_back({row, line, std::get<line::Request>(request)});
        }
      }
      cells.push_back({"configure, verify", line, line::Configure{.node = 8}});
    }
    // BUSY may precede the check: such a request is sent again.
    for (int round = 0; round < kRounds && !cells.empty(); ++round)
      cells = observe(cells, role, out);
    observe_outputs(role, out);
  }
  // Returns the requests that were answered with BUSY.
  std::vector<Cell> observe(const std::vector<Cell>& cells, const std::string& role, Table& out) {
    std::map<std::uint64_t, const Cell*> sent;
    for (const Cell& cell : cells)
      sent[client_->send({"plant", cell.line, 0}, {.request = cell.request}, kPatience)] = &cell;
    EXPECT_TRUE(until([&] {
      return std::ranges::all_of(
          sent, [&](const auto& request) { return seen_.by_id.contains(request.first); });
    }));
    std::vector<Cell> busy;
    for (const auto& [id, cell] : sent) {
      const bool answered = seen_.by_id.contains(id);
      std::string& text = out[cell->row][column_of(role, cell->line)];
      text = answered ? cell_of(seen_.by_id[id]) : "not answered";
      if (text == "busy")
        busy.push_back(*cell);
    }
    return busy;
  }
  static std::string cell_of(const Error& error) {
    if (error == line::to_error(line::Refusal::busy))
      return "busy";
    return error == line::to_error(line::Refusal::not_permitted) ||
                   error == line::to_error(line::Refusal::no_right)
               ? "no"
               : "yes";
  }

  // To a group that no line has: the line refuses it for this reason if the client is permitted.
  void observe_outputs(const std::string& role, Table& out) {
    for (const auto& [line, access] : kLines) {
      const std::string column = column_of(role, line);
      ++group_;
      const auto refusal = [&]() -> const event::OutputRefused* {
        for (const auto& [number, event] : seen_.events[line]) {
          const auto* const refused = event.get<event::OutputRefused>();
          if (refused != nullptr && refused->group == group_)
            return refused;
        }
        return nullptr;
      };
      EXPECT_TRUE(until([&] {
        client_->write_outputs({"plant", line, 0}, {.group = group_});
        return refusal() != nullptr;
      })) << column;
      if (refusal() == nullptr)
        continue;
      EXPECT_TRUE(refusal()->refusal == line::OutputRefusal::not_permitted ||
                  refusal()->refusal == line::OutputRefusal::unknown_group)
          << column;
      out["OutputWrite"][column] =
          refusal()->refusal == line::OutputRefusal::not_permitted ? "no" : "yes";
    }
  }

  const folders::path authority =
      folders::path(testing::TempDir()) / ("command-rights-" + std::to_string(::getpid()));
  std::unique_ptr<Gateway> gateway_;
  std::unique_ptr<dds::Client> client_;
  Replies seen_;
  std::uint16_t group_ = 100;
};

TEST(CommandRequests, HasEachKind) {
  std::set<std::uint8_t> kinds;
  for (const request::Request& request : requests())
    kinds.insert(static_cast<std::uint8_t>(request::kind(request)));
  EXPECT_EQ(kinds.size(), request::kCommandKinds);
}

TEST_F(CommandRights, AreThoseOfTheTable) {
  Table observed;
  for (const auto& [name, role] : {std::pair("olga", "operator"), std::pair("erin", "engineer")}) {
    ASSERT_TRUE(connect(name, role)) << role;
    ASSERT_NO_FATAL_FAILURE(observe(role, observed));
  }
  for (auto& [row, cells] : observed) {
    EXPECT_EQ(cells["operator, named"], cells["operator, read"]) << row;
    EXPECT_EQ(cells["engineer, named"], cells["engineer, all"]) << row;
    cells.erase("operator, named");
    cells.erase("engineer, named");
  }
  security::expect_same(security::table_below("### Requests, roles and access"), observed);
}

}  // namespace
}  // namespace linegate::gateway
