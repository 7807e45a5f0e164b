// SPDX-License-Identifier: Apache-2.0
// `linegate history` over DDS: pages, several gateways, the newest events, later ones, errors.
#include "bridges/console/history.h"

#include <algorithm>
#include <bit>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "bridges/console/history_values.h"

#include "tests/bridges/console/command_test.h"
#include "tests/bridges/console/plant.h"

namespace linegate::console {
namespace {

using request::JournalPage;
using request::JournalRead;
using request::JournalRecord;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Gateways with journals whose pages have two events.
class Journals : public Client {
 public:
  void poll(Duration /*timeout*/, Listener& listener) override {
    for (const auto& [gateway, journal] : journals) {
      listener.on_gateway(gateway, {});
      listener.on_line({gateway, "press"}, test::line_view(3));
      listener.on_node({gateway, "press"},
                       {.name = "node3", .state = {.node = 3, .configured = true}});
    }
  }
  Answer call(const LineId& /*id*/, const line::Command& /*command*/, Duration /*timeout*/,
              std::uint64_t /*layout_id*/, Listener& /*listener*/) override {
    return {};
  }
  Answer call_gateway(const LineId& id, const request::GatewayRequest& request,
                      Duration /*timeout*/, Listener& /*listener*/) override {
    last = std::get<JournalRead>(request);
    addressed.push_back(id);
    if (busy > 0) {
      --busy;
      return {.reply = {.error = line::to_error(line::Refusal::busy)}, .text = "busy"};
    }
    if (refusal != line::Refusal::none && id.gateway == refusing) {
      const std::string sentence = "it has\nnone";
      const auto* text = reinterpret_cast<const std::byte*>(sentence.data());
      return {.reply = {.error = line::to_error(refusal),
                        .data = std::vector(text, text + sentence.size())}};
    }
    if (last.cursor.position != 0 && last.cursor.check != file) {
      return {.reply = {.error = line::to_error(line::Refusal::wrong_incarnation)}};
    }
    return {.reply = {.data = encode(last.values ? values_of(values[id.gateway])
                                                 : page(of_line(journals.at(id.gateway))))}};
  }

  void add(const std::string& gateway, std::uint64_t number, int seconds) {
    journals[gateway].push_back({.line = number % 2 == 0 ? "" : "press",
                                 .number = number,
                                 .time = Instant(std::chrono::seconds(seconds)),
                                 .kind = EventKind::emcy,
                                 .text = "words"});
  }

  void add_value(const std::string& gateway, const std::string& entry, int seconds,
                 std::optional<std::uint64_t> value) {
    journals[gateway];
    values[gateway].push_back({.series = {.line = "press",
                                          .direction = 0,
                                          .node = 5,
                                          .type = 3,  // INTEGER16
                                          .bits = 16,
                                          .name = entry},
                               .time = Instant(std::chrono::seconds(seconds)),
                               .clock = 2,
                               .value = value});
  }

  std::map<std::string, std::vector<request::JournalValue>> values;
  std::map<std::string, std::vector<JournalRecord>> journals;
  bool selects_line = false;  // as a journal does; else the line of a request is ignored
  std::string refusing;
  line::Refusal refusal = line::Refusal::none;
  int busy = 0;
  std::uint64_t file = 1;
  JournalRead last;
  std::vector<LineId> addressed;

 private:
  // All at once; a name is compared as it is.
  JournalPage values_of(std::vector<request::JournalValue> of) const {
    std::erase_if(
        of, [&](const auto& one) { return !last.text.empty() && one.series.name != last.text; });
    JournalPage out{.cursor = {of.size() + 1, file}, .newest = {of.size() + 1, file}};
    out.unknown_entry = of.empty();
    if (last.newest_first)
      std::ranges::reverse(of);
    if (last.most != 0 && of.size() > last.most)
      of.resize(last.most);
    if (last.cursor.position == 0)
      out.values = std::move(of);
    return out;
  }
  std::vector<JournalRecord> of_line(std::vector<JournalRecord> of) const {
    std::erase_if(of, [&](const auto& one) {
      return selects_line && one.line != last.line.value_or(one.line);
    });
    return of;
  }
  JournalPage page(const std::vector<JournalRecord>& journal) const {
    JournalPage out{.newest = {journal.size(), file}};
    const std::size_t most = last.most == 0 ? 2 : std::min<std::size_t>(2, last.most);
    std::size_t at = last.cursor.position;
    if (last.newest_first) {
      at = at == 0 ? journal.size() + 1 : at;
      for (; at > 1 && out.records.size() < most; --at)
        out.records.push_back(journal[at - 2]);
      out.more = at > 1;
    } else {
      for (; at < journal.size() && out.records.size() < most; ++at)
        out.records.push_back(journal[at]);
      out.more = at < journal.size();
    }
    out.cursor = {at, file};
    return out;
  }
};

class HistoryOverDds : public test::CommandTest<Journals> {
 protected:
  HistoryOverDds() {
    context_.utc = true;
    context_.wait = std::chrono::minutes(10);
  }
  // "gateway/press #3" without time and text.
  std::vector<std::string> events() {
    std::vector<std::string> out;
    std::istringstream in(out_.str());
    for (std::string line; std::getline(in, line);) {
      line = line.substr(line.find(' ') + 1);
      out.push_back(line.substr(0, line.find(" emcy")));
    }
    return out;
  }
  int run(const HistoryRequest& request = {}) {
    return history(context_, request, false, [] { return false; });
  }
};

TEST_F(HistoryOverDds, PrintsAllPagesOfAGateway) {
  for (int i = 1; i <= 5; ++i)
    gateway_.add("a", static_cast<std::uint64_t>(i), i);
  gateway_.busy = 2;
  EXPECT_EQ(run(), kDone) << err_.str();
  EXPECT_THAT(events(),
              ElementsAre("press #1", "gateway #2", "press #3", "gateway #4", "press #5"));
  EXPECT_THAT(out_.str(), HasSubstr("1970-01-01T00:00:01.000Z press #1 emcy: words\n"));
  EXPECT_EQ(gateway_.addressed.front(), (LineId{"a", ""}));
}

TEST_F(HistoryOverDds, OrdersSeveralGatewaysByTime) {
  for (const int second : {1, 4, 5})
    gateway_.add("a", static_cast<std::uint64_t>(second), second);
  for (const int second : {2, 3, 6})
    gateway_.add("b", static_cast<std::uint64_t>(second), second);
  EXPECT_EQ(run(), kDone) << err_.str();
  EXPECT_THAT(events(), ElementsAre("a/press #1", "b/gateway #2", "b/press #3", "a/gateway #4",
                                    "a/press #5", "b/gateway #6"));
  out_.str("");
  EXPECT_EQ(run({.count = 3}), kDone);
  EXPECT_THAT(events(), ElementsAre("a/gateway #4", "a/press #5", "b/gateway #6"));
  out_.str("");
  EXPECT_EQ(run({.line = "b/press"}), kDone);
  EXPECT_THAT(events(), ElementsAre("gateway #2", "press #3", "gateway #6"));
  EXPECT_EQ(gateway_.last.line, "press");
  EXPECT_EQ(gateway_.addressed.back(), (LineId{"b", "press"})) << "a partition it may write in";
}

TEST_F(HistoryOverDds, FollowsTheNewestAlsoInAFileThatReplacesAnother) {
  for (int i = 1; i <= 5; ++i)
    gateway_.add("a", static_cast<std::uint64_t>(i), i);
  const auto printed = [&](const char* event) {
    return out_.str().find(event) != std::string::npos;
  };
  const auto stopped = [&] {
    if (printed("#5") && gateway_.journals["a"].size() == 5) {
      for (const int later : {6, 7, 8})
        gateway_.add("a", static_cast<std::uint64_t>(later), later);
    } else if (printed("#8") && gateway_.file == 1) {
      gateway_.file = 2;
      gateway_.journals["a"].clear();
      gateway_.add("a", 9, 9);
    }
    return printed("#9");
  };
  EXPECT_EQ(history(context_, {.count = 1}, true, stopped), kDone) << err_.str();
  EXPECT_THAT(events(),
              ElementsAre("press #5", "gateway #6", "press #7", "gateway #8", "press #9"));
}

TEST_F(HistoryOverDds, FollowsTheNewestOnlyAlsoIfTheFirstRequestFails) {
  for (int i = 1; i <= 9; ++i)
    gateway_.add("a", static_cast<std::uint64_t>(i), i);
  gateway_.refusing = "a";
  gateway_.refusal = line::Refusal::wrong_state;
  int calls = 0;
  const auto stopped = [&] {
    if (err_.str().find("it has?none") != std::string::npos && ++calls == 3)
      gateway_.refusal = line::Refusal::none;
    if (out_.str().find("#9") != std::string::npos && gateway_.journals["a"].size() == 9)
      gateway_.add("a", 10, 10);
    return out_.str().find("#10") != std::string::npos || calls > 100;
  };
  EXPECT_EQ(history(context_, {.count = 3}, true, stopped), kFailed);
  EXPECT_THAT(events(), ElementsAre("press #7", "gateway #8", "press #9", "gateway #10"));
  EXPECT_EQ(err_.str(), "a: it has?none\n");
}

TEST_F(HistoryOverDds, AGatewayThatRefusesIsReportedAndTheOthersArePrinted) {
  gateway_.add("a", 1, 1);
  gateway_.add("b", 2, 2);
  gateway_.refusing = "a";
  gateway_.refusal = line::Refusal::wrong_state;
  EXPECT_EQ(run(), kFailed);
  EXPECT_THAT(events(), ElementsAre("b/gateway #2"));
  EXPECT_EQ(err_.str(), "a: it has?none\n");
}

TEST_F(HistoryOverDds, ANodeHasItsNameOnItsLine) {
  gateway_.add("a", 1, 1);
  gateway_.add("b", 2, 2);
  EXPECT_EQ(run({.node = "press:node3"}), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("a/press"));
  EXPECT_THAT(err_.str(), HasSubstr("b/press"));
  EXPECT_EQ(run({.node = "b/press:node3"}), kDone);
  EXPECT_THAT(events(), ElementsAre("gateway #2"));
  EXPECT_EQ(gateway_.last.line, "press");
  EXPECT_EQ(gateway_.last.node, 3);
  err_.str("");
  EXPECT_EQ(run({.node = "b/press:nobody"}), kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("no node 'nobody' on press; there are: node3 (3)"));
}

TEST_F(HistoryOverDds, PrintsValuesOfEntriesByTime) {
  gateway_.add_value("a", "inlet.Left", 1, 0xFF85);
  gateway_.add_value("a", "inlet.Right", 2, 7);
  gateway_.add_value("a", "inlet.Left", 3, std::nullopt);
  gateway_.add_value("a", "ram.Left", 4, 9);
  EXPECT_EQ(run({.values = true, .entries = {"inlet.Right", "inlet.Left"}}), kDone) << err_.str();
  EXPECT_EQ(out_.str(),
            "1970-01-01T00:00:01.000Z press inlet.Left: -123\n"
            "1970-01-01T00:00:02.000Z press inlet.Right: 7\n"
            "1970-01-01T00:00:03.000Z press inlet.Left: not valid\n");
  EXPECT_TRUE(gateway_.last.values);
  out_.str("");
  EXPECT_EQ(run({.node = "press:5", .count = 2, .values = true}), kDone);
  EXPECT_EQ(out_.str(),
            "1970-01-01T00:00:03.000Z press inlet.Left: not valid\n"
            "1970-01-01T00:00:04.000Z press ram.Left: 9\n");
  EXPECT_EQ(gateway_.last.node, 5);
  EXPECT_EQ(gateway_.last.text, "");
}

// The journal has them in the order of storage: a value may wait for the interval of its entry.
TEST_F(HistoryOverDds, PrintsValuesThatWereStoredLateByTime) {
  for (const int seconds : {1, 4, 2, 5, 3})
    gateway_.add_value("a", "ram.Left", seconds, static_cast<std::uint64_t>(seconds));
  EXPECT_EQ(run({.values = true}), kDone) << err_.str();
  const std::string all = out_.str();
  EXPECT_EQ(all,
            "1970-01-01T00:00:01.000Z press ram.Left: 1\n"
            "1970-01-01T00:00:02.000Z press ram.Left: 2\n"
            "1970-01-01T00:00:03.000Z press ram.Left: 3\n"
            "1970-01-01T00:00:04.000Z press ram.Left: 4\n"
            "1970-01-01T00:00:05.000Z press ram.Left: 5\n");
  out_.str("");
  EXPECT_EQ(run({.count = 2, .values = true}), kDone);
  EXPECT_EQ(out_.str(), all.substr(all.size() / 5 * 3));
}

TEST_F(HistoryOverDds, PrintsValuesAsCsvAndJson) {
  gateway_.add_value("a", "inlet.\"Hot, or not\"", 1, 0xFF85);
  gateway_.add_value("a", "inlet.\"Hot, or not\"", 2, std::nullopt);
  EXPECT_EQ(run({.values = true, .csv = true}), kDone) << err_.str();
  EXPECT_EQ(out_.str(),
            "time,gateway,line,direction,entry,value,unit\n"
            "1970-01-01T00:00:01.000Z,a,press,inputs,\"inlet.\"\"Hot, or not\"\"\",-123,\n"
            "1970-01-01T00:00:02.000Z,a,press,inputs,\"inlet.\"\"Hot, or not\"\"\",,\n");
  out_.str("");
  context_.json = true;
  EXPECT_EQ(run({.values = true}), kDone);
  EXPECT_THAT(
      out_.str(),
      HasSubstr(R"("gateway":"a","clock":"synchronised","line":"press","direction":"inputs",)"
                R"("node":5,"entry":"inlet.\"Hot, or not\"","type":"INTEGER16","valid":true,)"
                R"("value":-123})"));
  EXPECT_THAT(out_.str(), HasSubstr(R"("valid":false,"value":null})"));
}

TEST(HistoryValues, HaveAllDigitsOfTheirType) {
  request::JournalValue value{.series = {.line = "press",
                                         .type = static_cast<std::uint16_t>(od::DataType::real64),
                                         .bits = 64,
                                         .name = "meter.Energy"},
                              .value = std::bit_cast<std::uint64_t>(123456789012.5)};
  EXPECT_THAT(value_history_csv(value, "a"), HasSubstr(",meter.Energy,123456789012.5,"));
  EXPECT_THAT(value_history_json(value, "a"), HasSubstr(R"("value":123456789012.5)"));
  EXPECT_THAT(value_history_text(value, "a", true), HasSubstr("meter.Energy: 123456789012.5"));
  value.series.type = static_cast<std::uint16_t>(od::DataType::real32);
  value.series.bits = 32;
  value.value = std::bit_cast<std::uint32_t>(0.1F);
  EXPECT_THAT(value_history_csv(value, "a"), HasSubstr(",meter.Energy,0.1,"));
}

TEST_F(HistoryOverDds, AnEntryWithoutValuesIsReportedUnlessAnotherGatewayHasSome) {
  gateway_.add_value("a", "inlet.Left", 1, 1);
  gateway_.add_value("b", "ram.Left", 2, 2);
  EXPECT_EQ(run({.values = true, .entries = {"inlet.Left", "ram.Left"}}), kDone) << err_.str();
  EXPECT_THAT(out_.str(), HasSubstr("a/press inlet.Left: 1\n"));
  EXPECT_THAT(out_.str(), HasSubstr("b/press ram.Left: 2\n"));
  EXPECT_EQ(run({.values = true, .entries = {"inlet.Left", "ram.\nRight"}}), kFailed);
  EXPECT_EQ(err_.str(),
            "no values of \"ram.?Right\" are stored: `history:` of a line names the entries\n");
}

TEST_F(HistoryOverDds, ValuesHaveNoOptionsOfEvents) {
  gateway_.add_value("a", "inlet.Left", 1, 1);
  EXPECT_EQ(run({.kind = "emcy", .values = true}), kUsage);
  EXPECT_EQ(run({.severity = "error", .values = true}), kUsage);
  EXPECT_EQ(run({.text = "x", .values = true}), kUsage);
  EXPECT_EQ(run({.csv = true}), kUsage);
  EXPECT_EQ(run({.values = true, .entries = std::vector<std::string>(101, "x")}), kUsage);
  EXPECT_EQ(run({.values = true, .entries = {std::string(256, 'x')}}), kUsage);
  EXPECT_THAT(out_.str(), IsEmpty());
}

TEST_F(HistoryOverDds, ConditionsArePartOfTheRequestAndWrongOnesAreReported) {
  gateway_.add("a", 1, 1);
  context_.json = true;
  EXPECT_EQ(run({.node = "press:5",
                 .kind = "emcy",
                 .severity = "warning",
                 .text = "ab",
                 .since = "1970-01-01T00:00:01Z",
                 .until = "1970-01-01T00:00:02Z"}),
            kDone);
  EXPECT_EQ(gateway_.last.line, "press");
  EXPECT_EQ(gateway_.last.node, 5);
  EXPECT_EQ(gateway_.last.kind, EventKind::emcy);
  EXPECT_EQ(gateway_.last.least, EventSeverity::warning);
  EXPECT_EQ(gateway_.last.text, "ab");
  EXPECT_EQ(gateway_.last.since, Instant(std::chrono::seconds(1)));
  EXPECT_EQ(gateway_.last.until, Instant(std::chrono::seconds(2)));
  EXPECT_THAT(out_.str(), HasSubstr(R"("gateway":"a")"));
  EXPECT_EQ(run({.node = "press:128"}), kUsage);
  EXPECT_EQ(run({.node = "inlet"}), kUsage) << "of which line?";
  EXPECT_EQ(run({.kind = "none"}), kUsage);
  EXPECT_EQ(run({.severity = "none"}), kUsage);
  EXPECT_EQ(run({.since = "none"}), kUsage);
  EXPECT_EQ(run({.since = "1min", .until = "2min"}), kUsage);
  EXPECT_EQ(run({.text = std::string(256, 'x')}), kUsage);
  EXPECT_EQ(run({.line = "c/press"}), kFailed);
  EXPECT_EQ(err_.str().substr(err_.str().find("no gateway of")),
            "no gateway of line 'c/press'; gateways found: a\n");
}

TEST_F(HistoryOverDds, ALineThatDoesNotExistIsReported) {
  gateway_.selects_line = true;
  gateway_.add("a", 1, 1);
  gateway_.add("b", 1, 2);
  const std::string text =
      "; lines found: press (gateway a), press (gateway b); nothing stored matches\n";
  EXPECT_EQ(run({.line = "nosuch"}), kFailed);
  EXPECT_EQ(err_.str(), "no line 'nosuch'" + text);
  for (const HistoryRequest& request :
       {HistoryRequest{.line = "a/nosuch"}, HistoryRequest{.node = "a/nosuch:5"},
        HistoryRequest{.line = "a/nosuch", .count = 3}}) {
    err_.str("");
    EXPECT_EQ(run(request), kFailed);
    EXPECT_EQ(err_.str(), "no line 'a/nosuch'" + text);
  }
  EXPECT_EQ(
      history(context_, {.line = "nosuch"}, true, [calls = 0]() mutable { return ++calls > 100; }),
      kFailed)
      << "does not follow a line that does not exist";
  EXPECT_THAT(out_.str(), IsEmpty());
}

TEST_F(HistoryOverDds, EventsOfALineThatWasRemovedArePrinted) {
  gateway_.selects_line = true;
  gateway_.add("a", 1, 1);
  gateway_.journals["a"].front().line = "removed";
  EXPECT_EQ(run({.line = "removed"}), kDone) << err_.str();
  EXPECT_THAT(events(), ElementsAre("removed #1"));
}

TEST_F(HistoryOverDds, ALineWithoutEventsIsNoError) {
  gateway_.selects_line = true;
  gateway_.add("a", 2, 1);
  EXPECT_EQ(run({.line = "press"}), kDone);
  EXPECT_EQ(run({.line = "a/press"}), kDone);
  EXPECT_EQ(out_.str() + err_.str(), "");
}

TEST_F(HistoryOverDds, ALineIsFoundByItsNetworkId) {
  gateway_.selects_line = true;
  gateway_.add("a", 1, 1);
  EXPECT_EQ(run({.line = "3"}), kDone) << err_.str();
  EXPECT_EQ(gateway_.last.line, "press");
  EXPECT_EQ(run({.line = "a/3"}), kDone) << err_.str();
  EXPECT_EQ(run({.node = "3:5"}), kDone) << err_.str();
  EXPECT_EQ(gateway_.last.line, "press");
  EXPECT_THAT(events(), ElementsAre("press #1", "press #1", "press #1"));
}

}  // namespace
}  // namespace linegate::console
