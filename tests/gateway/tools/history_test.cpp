// SPDX-License-Identifier: Apache-2.0
// The output of `linegate history` for a journal, and its messages.
#include "gateway/tools/history.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>

#include <gtest/gtest.h>

#include "gateway/journal/journal.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/tools/value_history.h"

namespace linegate::gateway {
namespace {

constexpr Instant kNow{std::chrono::seconds(1'795'000'000)};

class HistoryTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name =
        (std::filesystem::temp_directory_path() / "linegate-history-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    options_.file = folder_ + "/journal.db";
    options_.utc = true;
    Journal journal({.file = options_.file});
    ASSERT_EQ(journal.open(), 0);
    for (std::uint64_t first = 1; first <= 2500; first += 250) {
      std::vector<JournalEntry> some;
      for (std::uint64_t number = first; number < first + 250; ++number) {
        some.push_back({.stream = 0xAB,
                        .incarnation = 0xCD,
                        .line = number % 2 == 0 ? "press" : "oven",
                        .number = number,
                        .time = kNow - std::chrono::seconds(2500 - number),
                        .clock = ClockQuality::synchronised,
                        .kind = EventKind::heartbeat_lost,
                        .severity = number == 2499 ? EventSeverity::error : EventSeverity::info,
                        .node = static_cast<std::uint8_t>(number % 5),
                        .code = 1,
                        .value = 2,
                        .data = {std::byte{0xAB}},
                        .text = "lost\x1B[31m"});
      }
      some.back().line = first == 2251 ? "" : some.back().line;
      ASSERT_EQ(journal.store({.entries = some, .stream = 0xAB}, kNow), 0);
    }
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // The output; the exit code must be that one.
  std::string run(int code = kExitOk) {
    std::ostringstream out;
    err_.str({});
    EXPECT_EQ(history(options_, kNow, out, err_), code) << err_.str();
    return out.str();
  }
  std::size_t lines() {
    const std::string out = run();
    return static_cast<std::size_t>(std::count(out.begin(), out.end(), '\n'));
  }

  std::string folder_;
  HistoryOptions options_;
  std::ostringstream err_;
};

TEST_F(HistoryTest, PrintsAllEventsInPages) {
  EXPECT_EQ(lines(), 2500U);
}

TEST_F(HistoryTest, PrintsTheNewestWithoutControlCharacters) {
  options_.count = 2;
  const std::string out = run();
  EXPECT_EQ(out.find('\x1B'), std::string::npos);
  EXPECT_NE(out.find("Z oven #2499 heartbeat-lost: lost"), std::string::npos) << out;
  EXPECT_NE(out.find("Z gateway #2500 heartbeat-lost: lost"), std::string::npos) << out;
  EXPECT_LT(out.find("#2499"), out.find("#2500"));
}

TEST_F(HistoryTest, EachOptionSelects) {
  options_.line = "press";
  EXPECT_EQ(lines(), 1249U);
  options_.node = "oven:3";
  EXPECT_EQ(lines(), 250U) << "the line of --node counts";
  options_ = {.file = options_.file, .kind = "boot-up"};
  EXPECT_EQ(lines(), 0U);
  options_ = {.file = options_.file, .severity = "error"};
  EXPECT_EQ(lines(), 1U);
  options_ = {.file = options_.file, .text = "LOST"};
  EXPECT_EQ(lines(), 2500U);
  options_ = {.file = options_.file, .since = "10s"};
  EXPECT_EQ(lines(), 11U);
  options_ = {.file = options_.file, .since = "10s", .until = "5s"};
  EXPECT_EQ(lines(), 5U);
}

// Each wait stores an event of each line.
TEST_F(HistoryTest, FollowsWithEachEventOnce) {
  options_.line = "press";
  options_.count = 1;
  Journal journal({.file = options_.file});
  ASSERT_EQ(journal.open(), 0);
  std::uint64_t number = 3000;
  std::ostringstream out;
  const auto store = [&] {
    std::vector<JournalEntry> some;
    for (const char* line : {"press", "oven"}) {
      some.push_back({.stream = 0xAB, .line = line, .number = number, .text = "later"});
    }
    EXPECT_EQ(journal.store({.entries = some, .stream = 0xAB}, kNow), 0);
    return ++number <= 3003;
  };
  EXPECT_EQ(history(options_, kNow, out, err_, store), kExitOk);
  std::istringstream lines(out.str());
  std::vector<std::string> numbers;
  for (std::string line; std::getline(lines, line);) {
    numbers.push_back(line.substr(line.find('#'), line.find(' ', line.find('#')) - line.find('#')));
  }
  EXPECT_EQ(numbers, (std::vector<std::string>{"#2498", "#3000", "#3001", "#3002"}));
}

// The gateway replaces a damaged file: the reader prints the last entries of the previous one, then
// those of the new one.
TEST_F(HistoryTest, FollowsAFileThatReplacesADamagedOne) {
  options_.line = "press";
  options_.count = 1;
  auto journal = std::make_unique<Journal>(config::Journal{.file = options_.file});
  ASSERT_EQ(journal->open(), 0);
  const auto store = [&](std::uint64_t number) {
    const std::vector<JournalEntry> one{{.stream = 0xAB, .line = "press", .number = number}};
    EXPECT_EQ(journal->store({.entries = one, .stream = 0xAB}, kNow), 0);
  };
  int calls = 0;
  const auto replace = [&] {
    switch (++calls) {
      case 1:
        store(3000);
        journal = nullptr;
        std::filesystem::rename(options_.file, options_.file + ".unusable");
        std::filesystem::rename(options_.file + "-wal", options_.file + ".unusable-wal");
        std::filesystem::remove(options_.file + "-shm");
        std::ofstream(options_.file, std::ios::trunc);  // no journal yet
        return true;
      case 2:
        journal = std::make_unique<Journal>(config::Journal{.file = options_.file});
        EXPECT_EQ(journal->open(), 0);
        store(3001);
        return true;
      case 3:
        store(3002);
        return true;
      default:
        return calls < 5;
    }
  };
  std::ostringstream out;
  EXPECT_EQ(history(options_, kNow, out, err_, replace), kExitOk) << err_.str();
  std::size_t at = 0;
  for (const char* number : {"#2498", "#3000", "#3001", "#3002"}) {
    at = out.str().find(number, at);
    ASSERT_NE(at, std::string::npos) << number << '\n' << out.str();
  }
  EXPECT_EQ(std::ranges::count(out.str(), '\n'), 4);
}

TEST_F(HistoryTest, PrintsAnObjectForEachEvent) {
  options_.json = true;
  options_.severity = "error";
  const std::string out = run();
  EXPECT_NE(out.find(R"("clock":"synchronised","stream":"00000000000000ab",)"
                     R"("incarnation":"00000000000000cd","line":"oven","number":2499,)"
                     R"("kind":"heartbeat-lost","severity":"error","node":4,"code":1,"value":2,)"
                     R"("data":"AB","text":"lost\u001b[31m")"),
            std::string::npos)
      << out;
}

TEST_F(HistoryTest, ReportsWrongOptionsAndFiles) {
  options_.severity = "bad";
  run(kExitUsage);
  EXPECT_EQ(err_.str(), "severities are info, warning and error\n");
  for (const char* node : {"x", "128", "press:", ":5", "press:5x", "-1"}) {
    options_ = {.file = options_.file, .node = node};
    run(kExitUsage);
    EXPECT_NE(err_.str().find("is no node: LINE:5"), std::string::npos) << node;
  }
  options_ = {.file = options_.file, .node = "press:inlet"};
  run(kExitUsage);
  EXPECT_EQ(err_.str(), "a file has no names of nodes: --node LINE:5 with the node-ID\n");
  options_ = {.file = options_.file, .kind = "nonsense"};
  run(kExitUsage);
  options_ = {.file = options_.file, .until = "soon"};
  run(kExitUsage);
  EXPECT_NE(err_.str().find("'soon' is no time"), std::string::npos);
  options_ = {.file = folder_ + "/missing.db"};
  run(kExitFailed);
  EXPECT_NE(err_.str().find("missing.db: the journal cannot be read: "), std::string::npos);
}

class ValueHistoryTest : public HistoryTest {
 protected:
  void SetUp() override {
    HistoryTest::SetUp();
    const auto entry = std::make_shared<const ValueEntry>(
        ValueEntry{"press", image::Direction::inputs, 5, "inlet.Temperature"});
    std::vector<StoredValue> values;
    for (std::uint64_t i = 0; i < 2; ++i) {
      values.push_back({entry, kNow + std::chrono::seconds(i), ClockQuality::synchronised,
                        od::DataType::integer16, 16,
                        i == 0 ? std::optional<std::uint64_t>(0xFF85) : std::nullopt, scaling_});
    }
    Journal journal({.file = options_.file});
    ASSERT_EQ(journal.open(), 0);
    ASSERT_EQ(journal.store({.values = values, .stream = 0xAB}, kNow), 0);
  }
  std::shared_ptr<const od::Scaling> scaling_;
  std::string values(const console::HistoryRequest& request, int code, bool json = false) {
    std::ostringstream out;
    err_.str({});
    const console::HistoryOutput output{
        .out = out, .err = err_, .json = json, .csv = request.csv, .utc = true};
    EXPECT_EQ(value_history(options_.file, request, kNow, output), code) << err_.str();
    return out.str();
  }
};

TEST_F(ValueHistoryTest, PrintsTheValuesOfAFile) {
  EXPECT_EQ(values({.values = true, .entries = {"inlet.*"}}, kExitOk),
            "2026-11-18T11:06:40.000Z press inlet.Temperature: -123\n"
            "2026-11-18T11:06:41.000Z press inlet.Temperature: not valid\n");
  EXPECT_EQ(values({.values = true, .csv = true}, kExitOk),
            "time,gateway,line,direction,entry,value,unit\n"
            "2026-11-18T11:06:40.000Z,,press,inputs,inlet.Temperature,-123,\n"
            "2026-11-18T11:06:41.000Z,,press,inputs,inlet.Temperature,,\n");
  EXPECT_EQ(values({.count = 1, .values = true}, kExitOk, true),
            "{\"time\":\"2026-11-18T11:06:41.000Z\",\"clock\":\"synchronised\",\"line\":\"press\","
            "\"direction\":\"inputs\",\"node\":5,\"entry\":\"inlet.Temperature\","
            "\"type\":\"INTEGER16\",\"valid\":false,\"value\":null}\n");
}

class ScaledHistoryTest : public ValueHistoryTest {
 protected:
  ScaledHistoryTest() {
    scaling_ = std::make_shared<const od::Scaling>(od::Scaling{"\xC2\xB0\x43", 0.1, 30});
  }
};

TEST_F(ScaledHistoryTest, PrintsValuesInTheirUnit) {
  EXPECT_EQ(values({.values = true}, kExitOk),
            "2026-11-18T11:06:40.000Z press inlet.Temperature: 17.7 \xC2\xB0\x43\n"
            "2026-11-18T11:06:41.000Z press inlet.Temperature: not valid\n");
  EXPECT_EQ(values({.values = true, .csv = true}, kExitOk),
            "time,gateway,line,direction,entry,value,unit\n"
            "2026-11-18T11:06:40.000Z,,press,inputs,inlet.Temperature,17.7,\xC2\xB0\x43\n"
            "2026-11-18T11:06:41.000Z,,press,inputs,inlet.Temperature,,\xC2\xB0\x43\n");
  const std::string json = values({.until = "2026-11-18T11:06:41Z", .values = true}, kExitOk, true);
  EXPECT_NE(json.find("\"valid\":true,\"value\":17.7,\"unit\":\"\xC2\xB0\x43\",\"raw\":-123}"),
            std::string::npos)
      << json;
}

TEST_F(ValueHistoryTest, ReportsWrongOptionsEntriesAndFiles) {
  EXPECT_EQ(values({.values = true, .entries = {"inlet.Cold"}}, kExitFailed), "");
  EXPECT_EQ(err_.str(),
            "no values of \"inlet.Cold\" are stored: `history:` of a line names the entries\n");
  values({.since = "whenever", .values = true}, kExitUsage);
  options_.file += ".missing";
  values({.values = true}, kExitFailed);
  EXPECT_NE(err_.str().find(".missing: the journal cannot be read: "), std::string::npos);
}

}  // namespace
}  // namespace linegate::gateway
