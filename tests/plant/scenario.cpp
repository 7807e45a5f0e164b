// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/scenario.h"

#include <algorithm>
#include <string>
#include <utility>

#include "tests/assertion_note.h"
#include "tests/plant/event_words.h"
#include "tests/plant/oracles.h"
#include "tests/plant/scenario_run.h"

namespace linegate::plant {

LineSeat& Scenario::seat() {
  if (current_ == nullptr) {
    throw BadStatement("there is no line yet");
  }
  return *current_;
}

void Scenario::statement(Words words) {
  if (words.done()) {
    return;
  }
  const std::string verb = words.take();
  if (verb == "line") {
    describe_line(words);
  } else if (verb == "device") {
    describe_device(words);
  } else if (verb == "route") {
    describe_route(words);
  } else if (verb == "admit") {
    describe_access(words);
  } else if (verb == "forward") {
    describe_forward(words);
  } else if (verb == "on") {
    build();
    current_ = world_.find(words.take());
    (void)seat();
    event_cursor_ = 0;
    observed_cursor_ = 0;
    ours_cursor_ = 0;
    frame_cursor_ = 0;
  } else if (verb == "at") {
    build();
    world_.run(kStart + words.duration());
    event_cursor_ = seat().events.size();
    observed_cursor_ = seat().observed.size();
    ours_cursor_ = seat().ours_events.size();
    frame_cursor_ = seat().frames.size();
    act(words);
    world_.settle();
  } else if (verb == "expect") {
    build();
    expect(words);
  } else {
    throw BadStatement("unknown statement '" + verb + "'");
  }
  if (!words.done()) {
    throw BadStatement("'" + words.peek() + "' is left over");
  }
  if (built_) {
    check_always_all();
  }
}

void Scenario::check_always_all() {
  for (const auto& line : world_.lines()) {
    if (std::string text = check_always(*line, world_.now()); !text.empty()) {
      throw BadStatement("oracle: " + text);
    }
  }
}

bool Scenario::waits_for_replies() {
  return std::ranges::any_of(world_.lines(), [this](const auto& line) {
    return line->replies.size() != commands_[line.get()];
  });
}

// Runs until pending actions have ended, then checks that nothing is left. Commands to a device
// that answers slowly wait for each other: several transfers of a string take longer than a rest.
void Scenario::finish() {
  constexpr auto kRest = std::chrono::seconds(5);
  constexpr int kMostRests = 12;
  build();
  for (const auto& line : world_.lines()) {
    line->set_disturbance({});
  }
  for (int rest = 0; rest == 0 || (rest < kMostRests && waits_for_replies()); ++rest) {
    world_.run(world_.now() + kRest);
    if (!world_.failure().empty()) {
      return;
    }
  }
  check_always_all();
  for (const auto& line : world_.lines()) {
    if (std::string text = check_settled(*line, commands_[line.get()], world_.now());
        !text.empty()) {
      throw BadStatement("oracle: " + text);
    }
  }
}

namespace {

std::string last_events(World& world) {
  constexpr std::size_t kShown = 20;
  std::string out;
  for (const auto& seat : world.lines()) {
    const std::size_t count = seat->events.size();
    for (std::size_t i = count > kShown ? count - kShown : 0; i < count; ++i) {
      const Event& event = seat->events[i];
      const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(event.time - kStart);
      out += seat->line->config().name + ' ' + std::to_string(ms.count()) + "ms " +
             std::string(name(event.kind())) + " node=" + std::to_string(event.node) +
             members_text(event.data) + '\n';
    }
  }
  return out;
}

}  // namespace

Outcome run_scenario(std::string_view title, std::string_view text, unsigned long seed) {
  const AssertionNote note(std::string(title) + ", seed " + std::to_string(seed));
  Scenario scenario(seed);
  Outcome outcome;
  unsigned line = 0;
  try {
    while (!text.empty() && scenario.world().failure().empty()) {
      ++line;
      const std::size_t end = text.find('\n');
      const std::string_view statement = text.substr(0, end);
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
      scenario.statement(Words(statement));
    }
    scenario.finish();
    outcome.failure = scenario.world().failure();
  } catch (const BadStatement& problem) {
    outcome.failure = problem.what();
  }
  if (!outcome.failure.empty()) {
    outcome.failure = std::string(title) + ':' + std::to_string(line) + ": " + outcome.failure;
    outcome.history = last_events(scenario.world());
  }
  for (const auto& seat : scenario.world().lines()) {
    outcome.frames += seat->bus.frames();
    outcome.outputs += seat->outputs->compared();
    outcome.own_outputs += seat->own_outputs->compared();
    outcome.own_writes += seat->own_outputs->writes_sent();
  }
  outcome.steps = scenario.world().steps();
  outcome.expectations = scenario.expectations();
  return outcome;
}

}  // namespace linegate::plant
