// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/boot.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <ostream>

#include <nlohmann/json.hpp>

#include "bridges/console/answer.h"
#include "bridges/console/event_progress.h"
#include "bridges/console/lookup.h"
#include "bridges/console/model.h"
#include "bridges/console/one_line.h"
#include "bridges/console/refusal_text.h"
#include "stack/od/description.h"

namespace linegate::console {
namespace {

// An absent node occupies its boot time-out, which may be an hour.
constexpr Duration kLongestBoot = std::chrono::minutes(65);

std::string letter_text(char letter) {
  return letter == manager::kBooted ? "" : std::string(1, letter);
}

std::string hex_text(std::uint32_t number) {
  std::array<char, 12> text{};
  std::snprintf(text.data(), text.size(), "%08X", number);
  return text.data();
}

nlohmann::ordered_json outcome_json(const manager::BootOutcome& outcome) {
  using Kind = manager::BootFinding::Kind;
  const manager::BootFinding& finding = outcome.finding;
  nlohmann::ordered_json out{{"node", outcome.node},
                             {"booted", manager::is_booted(outcome.letter)},
                             {"letter", letter_text(outcome.letter)},
                             {"text", manager::describe_boot(outcome.letter, finding)}};
  if (finding.kind != Kind::none) {
    out["object"] = od::to_text(finding.object);
  }
  if (finding.kind == Kind::abort) {
    out["abort"] = hex_text(static_cast<std::uint32_t>(finding.abort));
  }
  if (finding.kind == Kind::value) {
    out["expected"] = finding.expected;
    out["found"] = finding.found;
  }
  return out;
}

bool all_booted(const std::vector<manager::BootOutcome>& outcomes) {
  return std::ranges::all_of(
      outcomes, [](const auto& outcome) { return manager::is_booted(outcome.letter); });
}

}  // namespace

int boot(Context& context, const std::string& what) {
  auto target = line_or_node(context, what);
  if (!target) {
    return kUsage;
  }
  Model model;
  const Line* const line = find_line(context, model, target->line);
  if (line == nullptr || !resolve_node(context, model, *line, *target)) {
    return kFailed;
  }
  const LineId id = line->id;
  const line::Command command{.timeout = std::max(context.timeout, kLongestBoot),
                              .request = line::Boot{.node = target->node}};
  EventProgress progress(model, id, context.err,
                         {EventKind::boot_result, EventKind::configuration_error});
  const Client::Answer answer = context.client.call(id, command, command.timeout, 0, progress);
  if (!answer.reply.ok()) {
    const int code = print_answer(context, answer);
    if (answer.reply.error == line::to_error(line::Refusal::bad_request)) {
      report_no_such_node(context, model, *line, target->node);
    }
    return code;
  }
  const auto* const outcomes = std::get_if<std::vector<manager::BootOutcome>>(&answer.reply.data);
  if (outcomes == nullptr) {
    context.err << "the gateway's answer cannot be read\n";
    return kFailed;
  }
  if (context.json) {
    context.out << boot_json(id, *outcomes) << '\n';
  } else {
    for (const std::string& text : text_of(boot_table(id, *outcomes))) {
      context.out << text << '\n';
    }
  }
  if (all_booted(*outcomes)) {
    return kDone;
  }
  report_no_such_node(context, model, *line, target->node);
  return kFailed;
}

Table boot_table(const LineId& id, const std::vector<manager::BootOutcome>& outcomes) {
  Table out{{{"NODE", true}, {"BOOT"}, {"WHAT"}}, {}, {}};
  for (const manager::BootOutcome& outcome : outcomes) {
    const std::string letter = letter_text(outcome.letter);
    out.rows.push_back(
        {{id, outcome.node},
         {{std::to_string(outcome.node), outcome.node},
          {letter.empty() ? "ok" : printable(letter), {}},
          {printable(manager::describe_boot(outcome.letter, outcome.finding)), {}}}});
  }
  if (outcomes.empty()) {
    out.notes.push_back({"the network list of the line is empty", Style::warning});
  }
  return out;
}

std::string boot_json(const LineId& id, const std::vector<manager::BootOutcome>& outcomes) {
  nlohmann::ordered_json nodes = nlohmann::ordered_json::array();
  for (const manager::BootOutcome& outcome : outcomes) {
    nodes.push_back(outcome_json(outcome));
  }
  return one_line(
      nlohmann::ordered_json{{"gateway", id.gateway}, {"line", id.line}, {"nodes", nodes}});
}

}  // namespace linegate::console
