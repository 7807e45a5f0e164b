// SPDX-License-Identifier: Apache-2.0
// RUN and ERROR of CiA 303-3.
#include "stack/node/indicators.h"

#include <algorithm>
#include <string>

#include "tests/stack/node/node_fixture.h"

namespace linegate::node {
namespace {

// The visible signal: one character every 50 ms. A week is a multiple of every period.
std::string seen(Pattern pattern, Indicator indicator, int characters) {
  std::string out;
  for (int i = 0; i < characters; ++i) {
    const Instant now = Instant{std::chrono::hours(7 * 24)} + i * 50ms;
    out += is_lit(pattern, indicator, now) ? '#' : '.';
  }
  return out;
}

TEST(Indicator, PatternsAndTheirTimes) {
  const std::string flash = "####....";
  const std::string last = "####" + std::string(20, '.');
  const auto run = [](Pattern pattern, int characters) {
    return seen(pattern, Indicator::run, characters);
  };
  EXPECT_EQ(run(Pattern::off, 30), std::string(30, '.'));
  EXPECT_EQ(run(Pattern::on, 30), std::string(30, '#'));
  EXPECT_EQ(run(Pattern::flickering, 8), "#.#.#.#.");
  EXPECT_EQ(run(Pattern::blinking, 16), flash + flash);
  EXPECT_EQ(run(Pattern::single_flash, 24), last);
  EXPECT_EQ(run(Pattern::double_flash, 32), flash + last);
  EXPECT_EQ(run(Pattern::triple_flash, 40), flash + flash + last);
  EXPECT_EQ(run(Pattern::quadruple_flash, 96),
            flash + flash + flash + last + flash + flash + flash + last);
}

TEST(Indicator, RunAndErrorAlternate) {
  for (const Pattern pattern : {Pattern::flickering, Pattern::blinking}) {
    const std::string run = seen(pattern, Indicator::run, 40);
    std::string error = seen(pattern, Indicator::error, 40);
    for (char& c : error) {
      c = c == '#' ? '.' : '#';
    }
    EXPECT_EQ(run, error) << name(pattern);
  }
}

TEST(Indicator, NextChangeIsWhenItChanges) {
  for (int i = 0; i <= static_cast<int>(Pattern::quadruple_flash); ++i) {
    const auto pattern = static_cast<Pattern>(i);
    Instant now{};
    for (int change = 0; change < 20; ++change) {
      const Instant next = next_change(pattern, now);
      if (next == kNever) {
        EXPECT_LE(pattern, Pattern::on);
        break;
      }
      EXPECT_EQ(is_lit(pattern, Indicator::run, next - 1ns), is_lit(pattern, Indicator::run, now));
      EXPECT_NE(is_lit(pattern, Indicator::run, next), is_lit(pattern, Indicator::run, now))
          << name(pattern) << " at change " << change;
      now = next;
    }
  }
}

TEST(Indicator, RunShowsTheNmtState) {
  using enum nmt::State;
  const std::pair<nmt::State, Pattern> table[] = {{initialising, Pattern::off},
                                                  {stopped, Pattern::single_flash},
                                                  {pre_operational, Pattern::blinking},
                                                  {operational, Pattern::on}};
  for (const auto& [state, pattern] : table) {
    EXPECT_EQ(indicate({.state = state}).run, pattern);
  }
}

// Each row also includes all conditions of the rows below it.
TEST(Indicator, TheWorstErrorIsShown) {
  Condition all{.state = nmt::State::operational};
  EXPECT_EQ(indicate(all).error, Pattern::off);
  all.invalid_configuration = true;
  EXPECT_EQ(indicate(all).error, Pattern::blinking);
  all.bus = can::BusState::error_warning;
  EXPECT_EQ(indicate(all).error, Pattern::single_flash);
  all.bus = can::BusState::error_passive;
  EXPECT_EQ(indicate(all).error, Pattern::single_flash);
  all.error_control_event = true;
  EXPECT_EQ(indicate(all).error, Pattern::double_flash);
  all.sync_error = true;
  EXPECT_EQ(indicate(all).error, Pattern::triple_flash);
  all.event_timer_error = true;
  EXPECT_EQ(indicate(all).error, Pattern::quadruple_flash);
  all.bus = can::BusState::bus_off;
  EXPECT_EQ(indicate(all).error, Pattern::on);
  EXPECT_EQ(indicate(all).run, Pattern::on);
}

TEST_F(NodeTest, TheEventOfALostSyncNamesIt) {
  boot();
  sdo_write({0x1006, 0}, 4, 10'000);
  nmt(0x01);
  hear(110ms, 0x080, {});
  testing::pop_events(events);
  advance(200ms);
  const auto all = testing::pop_events(events);
  const auto lost = std::ranges::find(all, EventKind::sync_lost, &Event::kind);
  ASSERT_NE(lost, all.end());
  EXPECT_EQ(lost->node, kNodeId);
}

TEST_F(NodeTest, ItsIndicatorsShowWhatItIsThrough) {
  EXPECT_EQ(node->indicators(), (Indicators{Pattern::off, Pattern::off}));
  boot();
  EXPECT_EQ(node->indicators(), (Indicators{Pattern::blinking, Pattern::off}));
  sdo_write({0x1029, 1}, 1, 1);
  sdo_write({0x1016, 1}, 4, 0x0007'0064);
  sdo_write({0x1006, 0}, 4, 10'000);
  nmt(0x01);
  hear(0ms, 0x707, {0x05});
  advance(100ms);
  EXPECT_EQ(node->indicators(), (Indicators{Pattern::on, Pattern::double_flash}));
  hear(110ms, 0x080, {});
  advance(125ms);
  EXPECT_EQ(node->indicators().error, Pattern::triple_flash);
  EXPECT_EQ(sdo_write({0x1400, 5}, 2, 50, 126ms), 0U);
  hear(130ms, 0x205, {0x01, 0x00});
  advance(180ms);
  EXPECT_EQ(node->indicators().error, Pattern::quadruple_flash);
  hear(190ms, 0x205, {0x01, 0x00});
  EXPECT_EQ(node->indicators().error, Pattern::triple_flash);
  hear(191ms, 0x080, {});
  EXPECT_EQ(node->indicators().error, Pattern::double_flash);
  hear(192ms, 0x707, {0x05});
  EXPECT_EQ(node->indicators().error, Pattern::off);
  node->bus_event({.state = can::BusState::error_warning, .time = at(193ms)});
  EXPECT_EQ(node->indicators().error, Pattern::single_flash);
  node->bus_event({.state = can::BusState::bus_off, .time = at(194ms)});
  EXPECT_EQ(node->indicators().error, Pattern::on);
  node->bus_event({.state = can::BusState::error_active, .time = at(195ms)});
  EXPECT_EQ(node->indicators().error, Pattern::off);
  nmt(0x02);
  EXPECT_EQ(node->indicators().run, Pattern::single_flash);
}

TEST_F(NodeTest, ItsIndicatorsShowAnUnusablePdo) {
  od::Dictionary dictionary = example_dictionary();
  ASSERT_TRUE(dictionary.set(od::Address{0x1A01, 1}, std::uint32_t{0x2001'0208}));
  node =
      std::make_unique<Node>(std::move(dictionary), Options{.node_id = kNodeId}, events, nullptr);
  boot();
  EXPECT_EQ(node->indicators().error, Pattern::blinking);
  nmt(0x81);
  EXPECT_EQ(node->indicators().error, Pattern::off) << "the reset restores the mapping";
}

}  // namespace
}  // namespace linegate::node
