#include "bridges/console/answer.h"

#include <ostream>

#include "bridges/console/json_text.h"

namespace linegate::console {

Client::Answer ask_line(Context& context, Model& model, const Line& line,
                        const line::Command& command, std::uint64_t layout_id) {
  return context.client.call(line.id, command, context.timeout, layout_id, model);
}

int print_answer(Context& context, const Client::Answer& answer, const std::string& value) {
  if (context.json) {
    context.out << answer_json(answer, value) << '\n';
  } else if (!answer.reply.ok()) {
    context.err << answer.text << '\n';
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
