// SPDX-License-Identifier: Apache-2.0
// The data of a line, and the samples that the publisher creates from them, without a network.
#include "gateway/publish/publisher.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridges/dds/values.h"
#include "gateway/journal/journal_reader.h"

#include "tests/gateway/journal/journal_fixture.h"
#include "tests/gateway/log_keeper.h"
#include "tests/gateway/publish/fake_edge.h"

namespace linegate::gateway {
namespace {

using testing::ElementsAre;
using testing::IsSupersetOf;
using testing::StartsWith;

class PublisherTest : public testing::Test {
 protected:
  PublisherTest() {
    config::LinePlan plan;
    plan.config.name = "press";
    hosts.push_back(std::make_unique<LineHost>(plan, image::Layout{}, image::Layout{}));
    publisher = std::make_unique<Publisher>(edge, hosts);
  }

  LinePort& port() { return hosts[0]->port; }
  // A line with the value history of an entry, which has a value.
  static std::unique_ptr<LineHost> hall(std::uint8_t value) {
    image::Layout inputs{.id = 1, .byte_size = 1};
    inputs.entries = {
        {.bit_length = 8, .type = od::DataType::unsigned8, .node = 5, .name = "inlet.Level"}};
    config::LinePlan plan;
    plan.config.name = "hall";
    plan.history.entries = {{image::Direction::inputs, 5, "inlet.Level"}};
    auto host = std::make_unique<LineHost>(plan, inputs,
                                           image::Layout{.direction = image::Direction::outputs});
    image::Snapshot& snapshot = host->port.image(image::Direction::inputs).draft().value;
    snapshot.layout_id = 1;
    snapshot.bytes = {std::byte{value}};
    snapshot.changed = {1};
    snapshot.valid = {1};
    host->port.image(image::Direction::inputs).publish();
    return host;
  }
  // stop() returns only after all available data are published.
  std::vector<std::string> published() {
    publisher->start();
    publisher->stop();
    return edge.samples();
  }

  LogKeeper log;
  FakeEdge edge;
  std::vector<std::unique_ptr<LineHost>> hosts;
  std::unique_ptr<Publisher> publisher;
};

TEST_F(PublisherTest, RepliesComeAfterTheEventsBeforeThemAndStatesAfterBoth) {
  port().replies.push(line::Reply{.tag = 7});
  Event event;
  event.number = 3;
  port().events.push(event);
  port().nodes.push(NodeStatus{.state = {.node = 5}});
  port().status.draft().value = LineStatus{};
  port().status.publish();
  EXPECT_THAT(published(),
              ElementsAre("layout press", "layout press", "event press 3", "reply 7",
                          StartsWith("state press outputs-access=read receive-queue-peak=0"),
                          "node press 5 "));
}

TEST_F(PublisherTest, AnEventNamesTheNodeIdThatLssGave) {
  Event own{.number = 1, .node = 5, .data = event::OwnState{.node_id = 9}};
  port().events.push(own);
  Event time{.number = 2, .node = 5, .data = event::TimeReceived{}};
  port().events.push(time);
  published();
  EXPECT_EQ(edge.event_text(), "node 5 (node-ID 9): TIME received");
}

// The client learns from OutputState that it was refused, and the line knows its number alone.
TEST_F(PublisherTest, ARefusalOfTheGatewayNamesItsClientInOutputState) {
  const std::uint32_t client = publisher->clients().number({.id = {1}}, "hmi");
  port().outputs_status.draft().value.groups = {
      {.group = 3, .refusal = line::OutputRefusal::not_permitted, .refused_number = client},
      {.group = 4, .refusal = line::OutputRefusal::not_permitted, .refused_number = client + 1},
      {.group = 5,
       .refusal = line::OutputRefusal::not_armed,
       .refused_client = "other",
       .refused_number = client}};
  port().outputs_status.publish();
  EXPECT_THAT(published(), IsSupersetOf({std::string("outputs press 3 refused=hmi"),
                                         std::string("outputs press 4"),
                                         std::string("outputs press 5 refused=other")}));
}

TEST_F(PublisherTest, LayoutsArePublishedOnceAndRefusalsFirst) {
  EXPECT_THAT(published(), ElementsAre("layout press", "layout press"));
  publisher->refusals().push(line::Reply{.tag = 9});
  Event event;
  event.number = 1;
  port().events.push(event);
  EXPECT_THAT(published(), ElementsAre("layout press", "layout press", "reply 9", "event press 1"));
}

TEST_F(PublisherTest, NamedTopicsFollowTheirLayoutAndTheImage) {
  image::Layout inputs{.id = 1, .byte_size = 1, .entries = {}};
  inputs.entries = {
      {.bit_length = 8, .type = od::DataType::unsigned8, .node = 5, .name = "inlet.Level"}};
  config::LinePlan plan;
  plan.config.name = "hall";
  plan.named.published = true;
  hosts[0] = std::make_unique<LineHost>(plan, inputs,
                                        image::Layout{.direction = image::Direction::outputs});
  publisher = std::make_unique<Publisher>(edge, hosts);
  image::Snapshot& snapshot = port().image(image::Direction::inputs).draft().value;
  snapshot.layout_id = 1;
  snapshot.bytes = {std::byte{1}};
  snapshot.changed = {1};
  snapshot.valid = {1};
  port().image(image::Direction::inputs).publish();
  EXPECT_THAT(published(),
              ElementsAre("layout hall", "types plant/hall/inlet/inputs", "layout hall", "types",
                          "image hall 1", "plant/hall/inlet/inputs 1 of image 1"));
}

TEST_F(PublisherTest, ANamedTopicThatGetsAReaderGetsASampleWithoutAnotherImage) {
  hosts[0] = hall(1);
  hosts[0]->plan.history = {};
  hosts[0]->plan.named.published = true;
  publisher.reset();  // the edge has one watcher of readers
  publisher = std::make_unique<Publisher>(edge, hosts);
  edge.set_readers(false);
  EXPECT_THAT(published(), Not(testing::Contains(StartsWith("plant/"))));
  edge.set_readers(true);
  publisher->start();
  while (edge.samples().back() != "plant/hall/inlet/inputs 1 of image 1") {
    std::this_thread::yield();
  }
  publisher->stop();
  EXPECT_EQ(edge.samples().back(), "plant/hall/inlet/inputs 1 of image 1");
}

// A manager that routes and forwards, with output groups, more routes than have room, known
// settings of its controller, and another gateway of the same name.
TEST_F(PublisherTest, LineStateHasRoomForEveryPropertyOfALine) {
  config::LinePlan plan;
  plan.config.name = "press";
  plan.config.routing.interface = 1;
  plan.config.groups = {{.number = 1, .entries = {0}}};
  plan.config.canopen_fd = true;
  plan.config.data_bit_rate = 5'000'000;
  hosts[0] = std::make_unique<LineHost>(plan, image::Layout{}, image::Layout{});
  publisher = std::make_unique<Publisher>(edge, hosts);
  edge.set_namesakes(1);
  std::vector<routing::Route>& routes = port().routes.draft().value;
  for (std::uint16_t network = 1; network <= 1000; ++network) {
    routes.push_back({.first = network, .last = network, .interface = 1, .gateway = 127});
  }
  port().routes.publish();
  LineStatus& status = port().status.draft().value;
  status.controller.listen_only = false;
  status.controller.restart_ms = 100;
  status.controller.hardware_stamps = true;
  status.sync_period = std::chrono::milliseconds(1);
  status.state.routing.values = 1;
  port().status.publish();
  published();

  std::set<std::string> names;
  for (const Property& property : edge.line_properties()) {
    EXPECT_TRUE(names.insert(property.name).second) << property.name;
  }
  EXPECT_THAT(names, IsSupersetOf({"namesakes", "indicators", "ixxat_state", "output-groups",
                                   "sync-period-us", "usdo-abort", "data-bit-rate", "listen-only",
                                   "restart-ms", "time-stamps", "routing-values", "routing-stalls",
                                   "routes-6", "routes-left-out"}));
  EXPECT_LE(names.size(), dds::kMaxProperties);
}

TEST_F(PublisherTest, SamplesThatTheEdgeDidNotTakeAreReported) {
  edge.fail(4);
  published();
  const std::vector<std::string> lines = log.lines();
  EXPECT_EQ(std::ranges::count(lines, "warning DDS did not take 4 samples"), 1);
}

// Publishes events of a line and of the gateway twice, as two runs of the gateway do.
TEST_F(PublisherTest, EventsAreStoredAndTheirNumbersContinue) {
  std::string folder = (std::filesystem::temp_directory_path() / "linegate-pub-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const config::Journal plan{.file = folder + "/journal.db"};
  for (std::uint64_t run = 0; run < 2; ++run) {
    JournalThread journal({.plan = plan, .incarnation = 7 + run});
    Publisher with(edge, hosts, &journal);
    journal.start();
    for (std::uint64_t number = 1; number <= 2; ++number) {
      Event event{.number = number, .node = 5, .data = event::SyncLost{}};
      port().events.push(event);
    }
    GatewayNews news;
    news.event.data = event::GatewayStarted{.lines = 1};
    news.text = "gateway started";
    with.report(std::move(news));
    with.start();
    with.stop();
    journal.stop();
  }
  JournalReader reader;
  JournalPage page;
  ASSERT_EQ(reader.open(plan.file), 0);
  ASSERT_EQ(reader.read({.line = "press"}, page), 0);
  ASSERT_EQ(page.entries.size(), 4U);
  for (std::uint64_t i = 0; i < 4; ++i) {
    EXPECT_EQ(page.entries[i].number, i + 1);
    EXPECT_EQ(page.entries[i].stream, 7U);
    EXPECT_EQ(page.entries[i].incarnation, i < 2 ? 7U : 8U);
  }
  const JournalEntry& last = page.entries[3];
  EXPECT_EQ(last.kind, EventKind::sync_lost);
  EXPECT_EQ(last.severity, EventSeverity::error);
  EXPECT_EQ(last.node, 5U);
  EXPECT_EQ(last.code, static_cast<std::uint32_t>(EventKind::sync_lost));
  EXPECT_EQ(last.value, 2U);
  EXPECT_EQ(last.data, std::vector{std::byte{3}});
  EXPECT_THAT(last.text, testing::HasSubstr("SYNC"));
  ASSERT_EQ(reader.read({.line = ""}, page), 0);
  ASSERT_EQ(page.entries.size(), 2U);
  EXPECT_EQ(page.entries[1].number, 2U);
  EXPECT_EQ(page.entries[1].text, "gateway started");
  EXPECT_THAT(edge.samples(),
              testing::IsSupersetOf({"event press 1", "event press 4", "event  2"}));
  std::filesystem::remove_all(folder);
}

// Also while the edge accepts no image, which is published later. The values of a line end when a
// reload removes it.
TEST_F(PublisherTest, ValuesAreStoredWithoutAnEdgeAndEndWithTheirLine) {
  std::string folder = (std::filesystem::temp_directory_path() / "linegate-pub-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const config::Journal journal_plan{.file = folder + "/journal.db"};
  hosts.push_back(hall(42));
  hosts.back()->plan.named.published = true;
  publisher.reset();  // the edge has one watcher of readers
  {
    JournalThread journal(
        {.plan = journal_plan, .incarnation = 7, .period = std::chrono::milliseconds(2)});
    Publisher with(edge, hosts, &journal);
    journal.start();
    edge.accept_images(false);
    with.start();
    JournalReader reader;
    ValuePage page;
    ASSERT_EQ(reader.open(journal_plan.file), 0);
    while (page.values.empty()) {
      ASSERT_EQ(reader.read(ValueQuery{}, page), 0);
      std::this_thread::yield();
    }
    EXPECT_THAT(edge.samples(), testing::Not(testing::Contains("image hall 1")));
    EXPECT_THAT(edge.samples(), Not(testing::Contains(StartsWith("plant/")))) << "comes with it";
    with.stop();
    EXPECT_THAT(edge.samples(), testing::Contains("image hall 1").Times(1));
    EXPECT_THAT(edge.samples(), testing::Contains(StartsWith("plant/")).Times(1));
    with.set_lines(std::span(hosts).first(1));
    journal.stop();
  }
  JournalReader reader;
  ValuePage page;
  ASSERT_EQ(reader.open(journal_plan.file), 0);
  ASSERT_EQ(reader.read({.line = "hall", .name = "inlet.*"}, page), 0);
  ASSERT_EQ(page.values.size(), 2U);
  EXPECT_EQ(page.values[0].value, 42U);
  EXPECT_EQ(page.values[0].entry->node, 5U);
  EXPECT_EQ(page.values[1].value, std::nullopt);
  EXPECT_EQ(page.values[1].type, od::DataType::unsigned8);
  EXPECT_EQ(page.values[1].clock, page.values[0].clock) << "ended by the line, not by the journal";
  std::filesystem::remove_all(folder);
}

// A reload restarts a line while the disk fails: the end of its values finds no room at first.
TEST_F(PublisherTest, ValuesOfALineEndBeforeThoseOfTheNextLineOfItsName) {
  std::string folder = (std::filesystem::temp_directory_path() / "linegate-pub-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const config::Journal journal_plan{.file = folder + "/journal.db"};
  constexpr std::size_t kQueued = 8;
  {
    JournalThread journal({.plan = journal_plan,
                           .incarnation = 7,
                           .period = std::chrono::milliseconds(2),
                           .retry_period = std::chrono::milliseconds(2),
                           .queued_values = kQueued});
    hosts.push_back(hall(42));
    Publisher with(edge, hosts, &journal);
    journal.start();
    with.start();
    with.stop();
    const auto await = [&](event::JournalCondition condition) {
      for (auto news = journal.pop_news(); !news || news->condition != condition;) {
        std::this_thread::yield();
        news = journal.pop_news();
      }
    };
    await(event::JournalCondition::renewed);
    JournalReader reader;
    ValuePage page;
    ASSERT_EQ(reader.open(journal_plan.file), 0);
    while (page.values.empty()) {
      ASSERT_EQ(reader.read(ValueQuery{}, page), 0);
      std::this_thread::yield();
    }
    const auto filler = std::make_shared<const ValueEntry>(ValueEntry{.name = "filler"});
    {
      const FileSizeLimit full(8192);
      for (std::size_t queued = 0; queued < Journal::kMostValues + kQueued;) {
        queued += journal.record(StoredValue{.entry = filler, .value = queued}) ? 1U : 0U;
        std::this_thread::yield();
      }
      hosts[1] = hall(43);
      with.set_lines(hosts);
      await(event::JournalCondition::failing);
    }
    await(event::JournalCondition::working);
    with.start();
    with.stop();
    journal.stop();
  }
  JournalReader reader;
  ValuePage page;
  ASSERT_EQ(reader.open(journal_plan.file), 0);
  ASSERT_EQ(reader.read({.line = "hall"}, page), 0);
  std::vector<std::optional<std::uint64_t>> values;
  std::ranges::transform(page.values, std::back_inserter(values), &StoredValue::value);
  EXPECT_THAT(values, ElementsAre(42U, std::nullopt, 43U, std::nullopt));
  std::filesystem::remove_all(folder);
}

// Such as a request for a line that does not exist.
TEST_F(PublisherTest, NoticesOfTheReceiverAreEventsOfTheGateway) {
  Publisher with(edge, hosts, nullptr);
  GatewayNotice notice{.event = {.data = event::CommandRefused{.client = 1}}, .text = "refused"};
  with.notices().push(notice);
  GatewayNews news;
  news.event.data = event::GatewayStarted{.lines = 1};
  news.text = "gateway started";
  with.report(std::move(news));
  with.start();
  with.stop();
  EXPECT_THAT(edge.samples(), testing::IsSupersetOf({"event  1", "event  2"}));
}

// The journal cannot reserve numbers, so the first event of the line begins another stream.
TEST_F(PublisherTest, ANewStreamIsPublishedBeforeItsFirstEvent) {
  JournalThread journal({.plan = {.file = "/missing/journal.db"}, .incarnation = 7});
  Publisher with(edge, hosts, &journal);
  journal.start();
  GatewayNews news;
  news.event.data = event::GatewayStarted{.lines = 1};
  with.report(std::move(news));
  port().events.push(Event{.number = 1, .data = event::SyncLost{}});
  with.start();
  with.stop();
  EXPECT_NE(journal.stream(), 7U);
  EXPECT_EQ(edge.stream_before_event(), journal.stream());
}

// A subscriber could not place an event without a stream.
TEST_F(PublisherTest, WithoutAJournalTheStreamIsPublishedBeforeTheFirstEvent) {
  GatewayNews news;
  news.event.data = event::GatewayStarted{.lines = 1};
  news.info.event_stream = 7;
  publisher->report(news);
  publisher->start();
  publisher->stop();
  EXPECT_EQ(edge.stream_before_event(), 7U);
  EXPECT_THAT(edge.samples(), testing::Contains("event  1"));
}

// Requests of clients: the journal has the name and the host, because the number of a client holds
// for one incarnation.
TEST_F(PublisherTest, EventsOfClientsAreStoredWithNameAndHost) {
  std::string folder = (std::filesystem::temp_directory_path() / "linegate-pub-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const config::Journal plan{.file = folder + "/journal.db"};
  {
    JournalThread journal({.plan = plan, .incarnation = 7});
    Publisher with(edge, hosts, &journal);
    journal.start();
    const std::uint32_t hmi = with.clients().number({.id = {1}, .host = "panel3"}, "hmi");
    const std::uint32_t tool = with.clients().number({.id = {2}, .host = "laptop"}, "tool");
    std::uint64_t number = 0;
    for (const EventData& data : std::initializer_list<EventData>{
             event::CommandAccepted{.command = line::CommandKind::nmt, .client = hmi},
             event::OutputOwner{.group = 2, .client = tool, .before = hmi},
             event::ClientLimited{.client = tool, .delayed = 3, .refused = 4, .replaced = 5}}) {
      Event event{.number = ++number, .node = number == 1 ? std::uint8_t{5} : std::uint8_t{0}};
      event.data = data;
      port().events.push(event);
    }
    with.start();
    with.stop();
    journal.stop();
  }
  JournalReader reader;
  JournalPage page;
  ASSERT_EQ(reader.open(plan.file), 0);
  ASSERT_EQ(reader.read({.line = "press", .text = " at "}, page), 0);
  ASSERT_EQ(page.entries.size(), 3U);
  EXPECT_EQ(page.entries[0].kind, EventKind::command_accepted);
  EXPECT_EQ(page.entries[0].severity, EventSeverity::info);
  EXPECT_EQ(page.entries[0].node, 5U);
  EXPECT_THAT(page.entries[0].text, testing::HasSubstr("hmi at panel3"));
  EXPECT_EQ(page.entries[1].kind, EventKind::output_owner);
  EXPECT_EQ(page.entries[1].severity, EventSeverity::warning);
  EXPECT_THAT(page.entries[1].text, testing::HasSubstr("hmi at panel3"));
  EXPECT_THAT(page.entries[1].text, testing::HasSubstr("tool at laptop"));
  EXPECT_EQ(page.entries[2].kind, EventKind::client_limited);
  EXPECT_EQ(page.entries[2].severity, EventSeverity::warning);
  EXPECT_THAT(page.entries[2].text, testing::HasSubstr("tool at laptop"));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace linegate::gateway
