// SPDX-License-Identifier: Apache-2.0
// I6: a random plant of several lines runs twice, once with and once without a reload that
// restarts, removes, adds, changes or renames one line. The frames and events of the other lines,
// and their times, are the same. The gateway determines which lines a reload affects, see
// tests/gateway/config/random_reload_test.cpp.
#include <algorithm>
#include <array>
#include <cstdio>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/plant/environment.h"
#include "tests/plant/event_words.h"
#include "tests/plant/scenario_run.h"

namespace linegate::plant {
namespace {

// The effect of a reload on a line.
enum class Reload : unsigned { restarted, paused, removed, added, changed, renamed };
constexpr unsigned kReloads = 6;

// Two lines with PDO forwarding and SDO routing between them, and a third line. reloaded: the line
// that is reloaded, by default in a random way.
class TwinGenerator {
 public:
  explicit TwinGenerator(unsigned long seed) : random_(seed), way_(Reload{below(kReloads)}) {}
  TwinGenerator(unsigned long seed, std::string reloaded, Reload way)
      : random_(seed), reloads_(std::move(reloaded)), way_(way) {}

  std::pair<std::string, std::string> twins() {
    networks();
    unsigned time = 0;
    if (way_ == Reload::added) {
      say("on " + reloads_ + "\nat 0s", "on " + reloads_ + "\nat 0s stop");
    }
    const unsigned actions = 8 + below(20);
    const unsigned before = 2 + below(5);
    time = 1000 + below(3000);
    for (unsigned i = 0; i < actions; ++i) {
      time += 1 + below(400);
      if (!is_reloaded_ && i >= before) {
        time = reload(time);
        is_reloaded_ = true;
      } else {
        action(i, time);
      }
    }
    say("at " + std::to_string(time + 3000) + "ms");
    return {plain_.str(), reloaded_.str()};
  }

 private:
  unsigned below(unsigned limit) { return static_cast<unsigned>(random_() % limit); }
  // A renamed line has its new name after the reload.
  void say(const std::string& text) {
    const std::string on = "on " + reloads_ + '\n';
    const bool is_renamed = is_reloaded_ && way_ == Reload::renamed && text.starts_with(on);
    say(text, is_renamed ? "on renamed\n" + text.substr(on.size()) : text);
  }
  void say(const std::string& plain, const std::string& reloaded) {
    plain_ << plain << '\n';
    reloaded_ << reloaded << '\n';
  }

  void networks() {
    constexpr std::array<const char*, 2> kRates{"250000", "1000000"};
    const auto sync = [this] {
      return below(2) == 0 ? std::string() : " sync " + std::to_string(5 + below(60)) + "ms";
    };
    const auto heartbeat = [this] {
      return " heartbeat " + std::to_string(50 + below(200)) + "ms\n";
    };
    for (unsigned i = 0; i < kLines.size(); ++i) {
      const std::string network = std::to_string(i + 1);
      std::string text = std::string("line ") + kLines[i] + " bitrate " + kRates[below(2)] +
                         sync() + " network " + network + " interface " + network + '\n';
      if (i == 0) {
        text += "route 2 2 over 2\n";
      }
      if (i == 1) {
        text += "admit 1 1 all\n";
      }
      text += "device 5 digital-io" + heartbeat() + "device 6 drive" + heartbeat() +
              "device 7 encoder" + heartbeat();
      say(text);
    }
    say("forward first 5.6000:1 to second 5.6200:1\nforward second 6.6064:0 to first 6.607A:0");
  }

  // Returns the time after the reload.
  unsigned reload(unsigned time) {
    const std::string at = "on " + reloads_ + "\nat " + std::to_string(time) + "ms ";
    const unsigned pause = way_ == Reload::restarted ? 10 : 10 + below(900);
    const std::string restart = "restart after " + std::to_string(pause) + "ms";
    switch (way_) {
      case Reload::removed:
        say(at, at + "stop");
        break;
      case Reload::changed:
        say(at, at + restart + change());
        break;
      case Reload::renamed:
        say(at, at + restart + " as renamed");
        break;
      default:
        say(at, at + restart);
        break;
    }
    return time + pause;
  }

  // At least one change of the line itself. No forwarding rule uses node 7.
  std::string change() {
    const unsigned what = 1 + below(7);
    std::string out;
    if ((what & 1U) != 0) {
      out += " sync " + std::to_string(65 + below(60)) + "ms";
    }
    if ((what & 2U) != 0) {
      out += " heartbeat " + std::to_string(50 + below(300)) + "ms";
    }
    if ((what & 4U) != 0) {
      out += " without 7";
    }
    return out;
  }

  void action(unsigned number, unsigned time) {
    const std::string node = std::to_string(5 + below(3));
    std::ostringstream out;
    out << "on " << kLines[below(2)] << "\nat " << time << "ms ";
    constexpr std::array<const char*, 4> kCommands{"start", "stop", "pre-operational",
                                                   "reset-node"};
    constexpr std::array<const char*, 4> kChanges{"dies", "returns", "blinks", "strays"};
    switch (below(6)) {
      case 0:
        out << "nmt " << kCommands[below(4)] << ' ' << node;
        break;
      case 1:
      case 2:
        out << "node " << node << ' ' << kChanges[below(4)];
        break;
      case 3:
        out << "sdo read r" << number << ' ' << node << " 1018:1";
        break;
      case 4:
        out << "write 0 arming " << number + 1 << " 5.6200:2 = " << 10 + below(90)
            << " 6.6040:0 = 0" << below(8) << "00";
        break;
      default:
        out.str("on first\nat " + std::to_string(time) + "ms sdo read n" + std::to_string(number) +
                ' ' + node + " 1018:2 network 2");
        break;
    }
    say(out.str());
  }

  static constexpr std::array<const char*, 3> kLines{"first", "second", "other"};

  std::mt19937_64 random_;
  std::string reloads_ = "other";
  Reload way_;
  bool is_reloaded_ = false;
  std::ostringstream plain_;
  std::ostringstream reloaded_;
};

// The frames and events of the first two lines, whatever their names are at that time.
std::vector<std::string> history_of(const std::string& text, unsigned long seed) {
  Scenario scenario(seed);
  std::istringstream in(text);
  for (std::string statement; std::getline(in, statement);) {
    scenario.statement(Words(statement));
  }
  EXPECT_EQ(scenario.world().failure(), "");
  std::vector<std::string> out;
  for (unsigned place = 0; place < 2; ++place) {
    const char* const name = place == 0 ? "first" : "second";
    const LineSeat& seat = *scenario.world().lines().at(place);
    for (const can::Frame& frame : seat.frames) {
      std::ostringstream text_of;
      text_of << name << ' ' << frame.time.time_since_epoch().count() << ' ' << std::hex
              << frame.id;
      for (unsigned i = 0; i < frame.length && !frame.remote(); ++i) {
        text_of << ' ' << std::to_integer<unsigned>(frame.data[i]);
      }
      out.push_back(text_of.str());
    }
    for (const Event& event : seat.events) {
      std::ostringstream text_of;
      text_of << name << ' ' << event.time.time_since_epoch().count() << ' '
              << linegate::name(event.kind()) << ' ' << unsigned{event.node}
              << members_text(event.data);
      out.push_back(text_of.str());
    }
  }
  return out;
}

// LINEGATE_PLANT_SEED and LINEGATE_PLANT_COUNT select other plants, as for the other random plants.
TEST(RandomTwins, AReloadOfAnotherLineIsSeenInNoFrameAndNoEvent) {
  constexpr unsigned long kFirstTwins = 20260301;
  constexpr unsigned long kTwins = 60;
  const auto [first, count] = seeds_of_run(kFirstTwins, kTwins);
  std::printf("random twins: %lu from seed %lu on\n", count, first);
  for (unsigned long seed = first; seed < first + count; ++seed) {
    const auto [plain, reloaded] = TwinGenerator(seed).twins();
    const std::vector<std::string> without = history_of(plain, seed);
    const std::vector<std::string> with = history_of(reloaded, seed);
    ASSERT_GT(without.size(), 100U);
    const auto [a, b] = std::mismatch(without.begin(), without.end(), with.begin(), with.end());
    ASSERT_TRUE(a == without.end() && b == with.end())
        << "seed " << seed << ": with the reload: " << (b == with.end() ? "nothing" : *b)
        << "; without it: " << (a == without.end() ? "nothing" : *a) << '\n'
        << reloaded;
  }
}

TEST(RandomTwins, AReloadOfALineIsSeenInItsOwnFramesAndEvents) {
  constexpr unsigned long kSeen = 20260301;
  for (unsigned way = 0; way < kReloads; ++way) {
    const auto [plain, reloaded] = TwinGenerator(kSeen, "first", Reload{way}).twins();
    EXPECT_NE(history_of(plain, kSeen), history_of(reloaded, kSeen)) << way;
  }
}

}  // namespace
}  // namespace linegate::plant
