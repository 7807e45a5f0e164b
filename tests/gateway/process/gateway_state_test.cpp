// SPDX-License-Identifier: Apache-2.0
// Samples that belong to no line: the state of the gateway, and its own events.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "bridges/dds/client.h"
#include "gateway/journal/journal_reader.h"
#include "gateway/process/gateway.h"
#include "gateway/publish/gateway_news.h"

#include "tests/dds/own_domain.h"
#include "tests/gateway/plans.h"
#include "tests/paths.h"

namespace linegate::gateway {
namespace {

using namespace std::chrono_literals;

// A plant with this number of lines.
std::string plant_of(unsigned lines) {
  std::string text =
      "schema: 1\ngateway: {name: state}\ndds: {domain: " + std::to_string(test::own_domain()) +
      ", process: " + place_of_dds().process + ", profile: " + paths::kLoopbackProfiles +
      "}\nlines:\n";
  for (unsigned i = 1; i <= lines; ++i) {
    text += "  - {name: line" + std::to_string(i) + ", interface: \"virtual:state" +
            std::to_string(i) + "\"}\n";
  }
  return text;
}

struct OwnListener : dds::ClientListener {
  void on_gateway(const dds::Source& source, const dds::GatewayInfo& value) override {
    name = source.gateway;
    info = value;
  }
  void on_event(const dds::Source& source, const dds::ReceivedEvent& event, std::string_view text,
                const std::vector<dds::Property>&) override {
    if (source.line.empty()) {
      events.push_back(event);
      texts.emplace_back(text);
    }
  }

  std::string name;
  dds::GatewayInfo info;
  std::vector<dds::ReceivedEvent> events;
  std::vector<std::string> texts;
};

class GatewayStateTest : public testing::Test {
 protected:
  void SetUp() override {
    auto made = Gateway::make(make_plant(plant_of(1)), 1);
    ASSERT_TRUE(made.ok());
    gateway = std::move(*made.value);
    gateway->start();
    dds::ClientOptions options;
    options.domain = test::own_domain();
    options.profile_file = paths::kLoopbackProfiles;
    auto client_made = dds::Client::make(options);
    ASSERT_TRUE(client_made.ok());
    client = std::move(*client_made.value);
  }
  ::testing::AssertionResult comes(const std::function<bool()>& condition) {
    const auto end = std::chrono::steady_clock::now() + 60s;
    while (!condition()) {
      if (std::chrono::steady_clock::now() > end) {
        return testing::AssertionFailure() << "not within 60 s";
      }
      client->poll(20ms, received);
    }
    return testing::AssertionSuccess();
  }
  std::uint64_t counter(std::string_view wanted) const {
    for (const dds::NamedCounter& one : received.info.counters) {
      if (one.name == wanted) {
        return one.value;
      }
    }
    ADD_FAILURE() << "no counter " << wanted;
    return 0;
  }

  std::unique_ptr<Gateway> gateway;
  std::unique_ptr<dds::Client> client;
  OwnListener received;
};

TEST_F(GatewayStateTest, NamesVersionLinesAndCounters) {
  ASSERT_TRUE(comes([&] { return received.info.participants == 1; }));
  EXPECT_EQ(received.name, "state");
  EXPECT_TRUE(versions().starts_with("linegate " + received.info.version + ",")) << versions();
  ASSERT_EQ(received.info.lines.size(), 1U);
  EXPECT_EQ(received.info.lines[0].name, "line1");
  EXPECT_EQ(received.info.lines[0].interface_uri, "virtual:state1");
  EXPECT_EQ(received.info.participants_most, dds::kMostParticipants);
  EXPECT_EQ(received.info.reloads, 0U);
  EXPECT_GE(received.info.configured, received.info.started);
  EXPECT_EQ(counter("discovery-discovered"), 1U);
  EXPECT_GT(counter("samples-published"), 0U);
  EXPECT_EQ(counter("samples-failed"), 0U);
  EXPECT_EQ(counter("guard-dropped-statistics"), 0U);
  EXPECT_TRUE(comes([&] { return counter("guard-received") > 0; }));
}

TEST_F(GatewayStateTest, ReportsReloadsAsEventsOfItsOwn) {
  ASSERT_TRUE(comes([&] { return received.events.size() == 1 && !received.name.empty(); }));
  EXPECT_EQ(received.events[0].data, EventData(event::GatewayStarted{.lines = 1}));
  const std::uint64_t before = received.info.configuration;
  gateway->set_reload_sender(SignalSender{.process = 123, .user = 1000});
  EXPECT_TRUE(gateway->reload(make_plant(plant_of(2))).done);
  ASSERT_TRUE(comes([&] { return received.events.size() == 2 && received.info.reloads == 1; }));
  EXPECT_EQ(received.events[1].data, EventData(event::GatewayReloaded{.changed = 1, .lines = 2}));
  EXPECT_NE(received.texts[1].find("line2"), std::string::npos) << received.texts[1];
  EXPECT_TRUE(received.texts[1].starts_with("reloaded (by process 123 of user 1000): "));
  EXPECT_EQ(received.info.lines.size(), 2U);
  EXPECT_NE(received.info.configuration, before);

  config::Plant other = make_plant(plant_of(1));
  other.gateway = "renamed";
  EXPECT_FALSE(gateway->reload(other).done);
  ASSERT_TRUE(
      comes([&] { return received.events.size() == 3 && received.info.reloads_refused == 1; }));
  EXPECT_EQ(received.events[2].data, EventData(event::GatewayReloadRefused{.errors = 1}));
  EXPECT_NE(received.texts[2].find("the name of the gateway"), std::string::npos);
  EXPECT_TRUE(received.texts[2].starts_with("not reloaded (by process 123 of user 1000), "));

  gateway->set_reload_sender({});
  gateway->refuse_reload({{Severity::error, "plant.yaml", 3, 5, "there is no file"}});
  ASSERT_TRUE(comes([&] { return received.events.size() == 4; }));
  EXPECT_TRUE(received.texts[3].starts_with("not reloaded, everything runs as before"));
  EXPECT_NE(received.texts[3].find("plant.yaml:3:5: error: there is no file"), std::string::npos)
      << received.texts[3];
  for (std::size_t i = 0; i < received.events.size(); ++i) {
    EXPECT_EQ(received.events[i].number, i + 1);
  }
  EXPECT_TRUE(comes([&] { return received.info.events == 4; }));
}

// A gateway, and the next one with the same journal.
// Waits until the journal has the start of line1 by that incarnation.
bool a_line_started(const std::string& file, std::uint64_t incarnation) {
  const auto is_it = [&](const JournalEntry& entry) {
    return entry.kind == EventKind::line_started && entry.incarnation == incarnation;
  };
  for (const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
       std::chrono::steady_clock::now() < end;) {
    JournalReader reader;
    JournalPage page;
    if (reader.open(file) == 0 && reader.read({.line = "line1"}, page) == 0 &&
        std::ranges::any_of(page.entries, is_it)) {
      return true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

TEST(GatewayJournal, EventNumbersContinueAfterARestart) {
  std::string folder = (std::filesystem::temp_directory_path() / "linegate-gw-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  config::Plant plant = make_plant(plant_of(1));
  plant.journal = config::Journal{.file = folder + "/journal.db"};
  for (std::uint64_t run = 0; run < 2; ++run) {
    auto made = Gateway::make(plant, 77 + run);
    ASSERT_TRUE(made.ok());
    (*made.value)->start();
    (*made.value)->report_journal();
    ASSERT_TRUE(a_line_started(plant.journal->file, 77 + run));
    (*made.value)->stop();
  }
  JournalReader reader;
  JournalPage page;
  ASSERT_EQ(reader.open(plant.journal->file), 0);
  ASSERT_EQ(reader.read({.line = ""}, page), 0);
  ASSERT_EQ(page.entries.size(), 3U);
  EXPECT_EQ(page.entries[0].kind, EventKind::gateway_started);
  EXPECT_EQ(page.entries[1].kind, EventKind::journal_state);
  EXPECT_NE(page.entries[1].text.find("begins a new stream"), std::string::npos);
  EXPECT_EQ(page.entries[2].kind, EventKind::gateway_started);
  for (std::uint64_t i = 0; i < 3; ++i) {
    EXPECT_EQ(page.entries[i].number, i + 1);
    EXPECT_EQ(page.entries[i].stream, 77U);
  }
  std::uint64_t number = 0;
  ASSERT_EQ(reader.read({.line = "line1"}, page), 0);
  EXPECT_EQ(std::ranges::count(page.entries, EventKind::line_started, &JournalEntry::kind), 2);
  for (const JournalEntry& one : page.entries) {
    EXPECT_EQ(one.number, ++number);
  }
  std::filesystem::remove_all(folder);
}

TEST(ConfigurationHash, ChangesWithEachPartOfTheConfiguration) {
  const config::PlantIdentity one = identity_of(make_plant(plant_of(1)));
  const config::PlantIdentity two = identity_of(make_plant(plant_of(2)));
  EXPECT_EQ(configuration_hash(one), configuration_hash(identity_of(make_plant(plant_of(1)))));
  EXPECT_NE(configuration_hash(one), configuration_hash(two));
  config::PlantIdentity other = one;
  other.lines[0].source += " ";
  EXPECT_NE(configuration_hash(one), configuration_hash(other));
  other = one;
  ++other.dds_domain;
  EXPECT_NE(configuration_hash(one), configuration_hash(other));
}

}  // namespace
}  // namespace linegate::gateway
