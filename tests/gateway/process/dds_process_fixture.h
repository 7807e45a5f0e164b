// SPDX-License-Identifier: Apache-2.0
// A gateway in the process of the test with its DDS endpoints in another one, which may end and
// hang, and a subscriber that checks the order of all samples.
#pragma once

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "gateway/edge/processor_times.h"

#include "tests/gateway/process/gateway_fixture.h"
#include "tests/paths.h"

namespace linegate::gateway {

// Its process ID; 0: there is none.
inline pid_t dds_process() {
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    std::ifstream file(entry.path() / "stat");
    std::string text;
    std::getline(file, text);
    const std::size_t name_end = text.rfind(')');
    if (name_end == std::string::npos || text.find("(linegated-dds)") == std::string::npos) {
      continue;
    }
    std::istringstream rest(text.substr(name_end + 2));
    char state = 0;
    pid_t parent = 0;
    rest >> state >> parent;
    if (parent == getpid() && state != 'Z') {
      return static_cast<pid_t>(std::stol(text));
    }
  }
  return 0;
}

// Checks the order of all that arrives. After the end of a DDS process samples may arrive again.
class StrictListener final : public GatewayListener {
 public:
  void on_image(const dds::Source& source, const image::Snapshot& snapshot) override {
    auto& last = sequences[source.line + "/" + std::string(image::name(snapshot.direction))];
    lost_images += last != 0 && snapshot.sequence > last + 1 ? 1 : 0;
    last = std::max(last, snapshot.sequence);
    ++image_samples;
    GatewayListener::on_image(source, snapshot);
  }
  void on_event(const dds::Source& source, const dds::ReceivedEvent& event, std::string_view text,
                const std::vector<dds::Property>& properties) override {
    const auto& known = events[source.line];
    if (const auto it = known.find(event.number); it != known.end()) {
      changed_events += it->second.kind != event.kind || it->second.time != event.time ? 1 : 0;
    }
    incarnations.insert(source.incarnation);
    GatewayListener::on_event(source, event, text, properties);
  }

  // Number of events that are missing between the first and the last one.
  std::uint64_t missing_events(const std::string& line) const {
    const auto it = events.find(line);
    if (it == events.end() || it->second.empty()) {
      return 0;
    }
    return it->second.rbegin()->first - it->second.begin()->first + 1 - it->second.size();
  }

  std::map<std::string, std::uint64_t> sequences;
  std::set<std::uint64_t> incarnations;
  int lost_images = 0;
  int image_samples = 0;
  int changed_events = 0;
};

class DdsProcessTest : public GatewayTest {
 protected:
  // Of both lines. An image has KEEP_LAST 1: those that are written before a reader has matched the
  // new writer replace each other, so each death may leave one gap in the numbers of each.
  static constexpr int kImages = 4;
  static constexpr Duration kBack =
      std::chrono::seconds(10);  // generous: the machine of a test may be busy
  // What the gateway promises, see replace_by().
  static constexpr Duration kFound = std::chrono::seconds(2);
  // A client that saw the ended process accepts no answers of the next one for up to 2 s of it
  // (dds::LinePublishers::kSilence).
  static constexpr Duration kAnswered = std::chrono::seconds(4);

  void SetUp() override {
    GatewayTest::SetUp();
    ASSERT_NE(dds_process(), 0);
    dds::ClientOptions options;
    options.domain = test::own_domain();
    options.profile_file = paths::kLoopbackProfiles;
    options.outputs = true;
    auto made = dds::Client::make(options);
    ASSERT_TRUE(made.ok());
    client_ = std::move(*made.value);
    ASSERT_TRUE(meanwhile([&] { return client_->command_peers() > 0 && images() > 0; }));
  }

  int images() const { return strict_.image_samples; }
  bool meanwhile(const std::function<bool()>& condition, Duration most = kPatience) {
    const Instant give_up = monotonic_now() + most;
    while (!condition()) {
      if (monotonic_now() > give_up) {
        return false;
      }
      client_->poll(std::chrono::milliseconds(5), strict_);
      gateway_->report_edge();  // as the service does
    }
    return true;
  }
  void pass(Duration time) {
    meanwhile([] { return false; }, time);
  }
  dds::CommandResult read(std::uint8_t node = 5) {
    return client_->call(at("open"), sdo_read(node, 0x1000, 0), std::chrono::seconds(30), strict_);
  }
  // Waits for another process than that one, and for its samples.
  bool back_after(pid_t gone) {
    return meanwhile([&] { return dds_process() != 0 && dds_process() != gone; }, kBack) && [&] {
      const int before = images();
      return meanwhile([&] { return images() > before + 2; }, kBack);
    }();
  }

  // The first end of a process, as its event reports it.
  event::DdsProcessEnded reported_end() {
    meanwhile([&] { return strict_.happened("", EventKind::dds_process_ended); });
    for (const auto& [number, event] : strict_.events[""]) {
      if (const auto* const end = event.get<event::DdsProcessEnded>()) {
        return *end;
      }
    }
    return {.ends = 0};
  }
  // Replaces the present process by that fault (dds_faults.cpp), and measures. The times are those
  // in which the processes had what they needed: without the time in which their threads waited for
  // a processor, of which an overloaded machine has too few.
  struct Replacement {
    Duration found{};  // from the fault to the end of the process
    Duration back{};   // from then to an answer and a sample of the next process
  };
  std::optional<Replacement> replace_by(int signal) {
    const pid_t first = dds_process();
    const ProcessorTimes::Sample before = ProcessorTimes().read();
    const Instant begin = monotonic_now();
    kill(first, signal);
    if (!meanwhile([&] { return dds_process() != first; })) {
      return std::nullopt;
    }
    const Instant ended = monotonic_now();
    const ProcessorTimes::Sample then = ProcessorTimes().read();
    // Samples of the first process may be under way yet: an answer and a sample behind it are not.
    const bool answers = read().reply.ok();
    const int samples = images();
    if (!answers || !meanwhile([&] { return images() > samples; }, kBack)) {
      return std::nullopt;
    }
    const Instant back = monotonic_now();
    const ProcessorTimes next("/proc/" + std::to_string(dds_process()) + "/task");
    const ProcessorTimes::Sample sample = ProcessorTimes().read();
    return Replacement{.found = ended - begin - waited(before, then),
                       .back = back - ended - waited(then, sample) - waited({}, next.read())};
  }
  // Of all threads, those that have started in between included.
  static Duration waited(const ProcessorTimes::Sample& before,
                         const ProcessorTimes::Sample& after) {
    Duration out{};
    for (const auto& [number, times] : after) {
      const auto known = before.find(number);
      out += times.waiting - (known == before.end() ? Duration{} : known->second.waiting);
    }
    return out;
  }
  // The fault of the process, at the request of that signal, must replace it for that reason, and
  // must not affect the lines. is_found: within kFound, which memory that is used up is not.
  void expect_replacement(int signal, event::ProcessEnd cause, bool is_found = true) {
    ASSERT_TRUE(meanwhile([&] { return strict_.lines.contains("open"); }));
    const auto before = strict_.lines["open"].counters.heartbeats_lost;
    const std::optional<Replacement> times = replace_by(signal);
    ASSERT_TRUE(times);
    std::cout << "found after " << times->found / std::chrono::milliseconds(1)
              << " ms, an answer after " << times->back / std::chrono::milliseconds(1)
              << " ms more\n";
    EXPECT_TRUE(!is_found || times->found <= kFound);
    EXPECT_LE(times->back, kAnswered);
    EXPECT_EQ(reported_end().cause, cause);
    EXPECT_EQ(reported_end().ends, 1U);
    EXPECT_EQ(reported_end().pause_ms, 0U);
    EXPECT_TRUE(read().reply.ok());
    EXPECT_LE(strict_.lost_images, kImages);
    EXPECT_EQ(strict_.missing_events("open"), 0U);
    EXPECT_EQ(strict_.missing_events(""), 0U);
    EXPECT_EQ(strict_.incarnations, std::set<std::uint64_t>{kIncarnation});
    pass(std::chrono::milliseconds(1'500));  // the state of the line is published once a second
    EXPECT_EQ(strict_.lines["open"].counters.heartbeats_lost, before);
  }

  StrictListener strict_;
};

// With a library in the DDS process that causes faults of Fast DDS.
class DdsFaultsTest : public DdsProcessTest {
 protected:
  // A busy machine needs more than kBack to fill the memory that is permitted otherwise.
  std::string text() const override { return plant_text(", memory: 150MB"); }
  void SetUp() override {
    setenv("LD_PRELOAD", paths::kDdsFaults, 1);
    DdsProcessTest::SetUp();
  }
  void TearDown() override { unsetenv("LD_PRELOAD"); }
};

}  // namespace linegate::gateway
