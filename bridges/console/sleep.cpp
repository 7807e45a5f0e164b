// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/sleep.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <ostream>
#include <string_view>
#include <utility>

#include "bridges/console/answer.h"
#include "bridges/console/lookup.h"

namespace linegate::console {
namespace {

constexpr std::pair<std::string_view, line::SleepAction> kSleepActionNames[] = {
    {"check", line::SleepAction::check},   {"sleep", line::SleepAction::sleep},
    {"now", line::SleepAction::prepare},   {"wake", line::SleepAction::wake},
    {"object", line::SleepAction::object}, {"consent", line::SleepAction::consent},
};

// Of a check: check_time of a line is at most 10 min, and begins when the bus acknowledged the
// message, for which it waits as long.
constexpr Duration kLongestCheck = std::chrono::minutes(21);

Client::Answer ask_sleep(Context& context, Model& model, const Line& line,
                         line::SleepAction action) {
  line::Command command{.request = line::SleepRequest{action}};
  if (action != line::SleepAction::check && action != line::SleepAction::sleep) {
    return ask_line(context, model, line, command);
  }
  command.timeout = std::max(context.timeout, kLongestCheck);
  return context.client.call(line.id, command, command.timeout, 0, model);
}

// "5, 9"
std::string objecting_nodes(const std::vector<std::byte>& nodes) {
  std::string out;
  for (const std::byte node : nodes) {
    out += (out.empty() ? "" : ", ") + std::to_string(std::to_integer<unsigned>(node));
  }
  return out;
}

std::string sleep_refusal(line::Refusal refusal) {
  switch (refusal) {
    case line::Refusal::wrong_state:
      return "the line has no key sleep in plant.yaml, or is in another phase";
    case line::Refusal::wrong_role:
      return "only the NMT master checks whether nodes object, and lets them sleep";
    case line::Refusal::busy:
      return "another check is under way";
    case line::Refusal::no_acknowledge:
      return "no node has received the message";
    case line::Refusal::cancelled:
      return "the check was ended, or the gateway stops";
    default:
      return {};
  }
}

std::string done_text(line::SleepAction action) {
  switch (action) {
    case line::SleepAction::check:
      return "no node objects";
    case line::SleepAction::sleep:
    case line::SleepAction::prepare:
      return "all nodes prepare to sleep";
    case line::SleepAction::wake:
      return "woken";
    case line::SleepAction::object:
      return "the own node objects to sleep";
    case line::SleepAction::consent:
      break;
  }
  return "the own node does not object to sleep";
}

}  // namespace

int sleep(Context& context, const std::string& line, const std::string& action) {
  const auto found =
      std::ranges::find(kSleepActionNames, action, [](const auto& one) { return one.first; });
  if (found == std::end(kSleepActionNames)) {
    context.err << "usage: unknown action '" << action
                << "': check, sleep, now, wake, object, consent\n";
    return kUsage;
  }
  return on_line(context, line, [&](Model& model, const Line& target) {
    Client::Answer answer = ask_sleep(context, model, target, found->second);
    const std::vector<std::byte>& nodes = answer.reply.bytes();
    if (answer.reply.error.domain == Domain::command) {
      const std::string why = sleep_refusal(static_cast<line::Refusal>(answer.reply.error.code));
      answer.text += why.empty() ? "" : ": " + why;
    }
    const bool objected = answer.reply.ok() && !nodes.empty();
    const int code = print_answer(
        context, answer,
        objected ? "objection of node " + objecting_nodes(nodes) : done_text(found->second));
    return code == kDone && objected ? kFailed : code;
  });
}

}  // namespace linegate::console
