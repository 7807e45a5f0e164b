// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/answer.h"

#include <algorithm>
#include <chrono>
#include <ostream>

#include "bridges/console/json_text.h"
#include "bridges/console/table.h"

namespace linegate::console {

namespace {

// Added to the gateway's own time limit: transport of the answer, on a busy machine.
constexpr Duration kAnswerTime = std::chrono::seconds(2);

// The reply comes within line::kSendTime, whatever the time-out of the command.
bool is_unconfirmed(line::CommandKind kind) {
  using enum line::CommandKind;
  return kind == output_write || kind == nmt || kind == can_send || kind == emcy_send ||
         kind == pdo_trigger || kind == mpdo_write;
}

}  // namespace

// The gateway gets the same time limit, so that its answer reports what happened until then.
Client::Answer ask_line(Context& context, Model& model, const Line& line,
                        const line::Command& command, std::uint64_t layout_id) {
  line::Command limited = command;
  Duration patience = context.timeout;
  if (is_unconfirmed(line::kind(command))) {
    limited.timeout = std::min(context.timeout, line::kSendTime);
  }
  if (limited.timeout > Duration::zero()) {
    patience = std::max(patience, limited.timeout + kAnswerTime);
  }
  return context.client.call(line.id, limited, patience, layout_id, model);
}

Client::Answer ask_gateway(Context& context, Model& model, const Line& line,
                           const request::GatewayRequest& request) {
  return context.client.call_gateway(line.id, request, context.timeout, model);
}

int print_answer(Context& context, const Client::Answer& answer, const std::string& value) {
  if (context.json) {
    context.out << answer_json(answer, value) << '\n';
  } else if (!answer.reply.ok()) {
    context.err << printable(answer.text) << '\n';
  } else if (!value.empty()) {
    context.out << value << '\n';
  }
  if (answer.reply.error == line::to_error(line::Refusal::no_acknowledge) ||
      answer.reply.error == line::to_error(line::Refusal::awaits_turn)) {
    return kHeldBack;
  }
  return answer.reply.ok() ? kDone : kFailed;
}

}  // namespace linegate::console
