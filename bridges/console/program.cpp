// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/program.h"

#include <algorithm>
#include <ostream>
#include <utility>

#include <nlohmann/json.hpp>

#include "bridges/console/event_progress.h"
#include "bridges/console/lookup.h"
#include "bridges/console/object_text.h"
#include "bridges/console/one_line.h"
#include "bridges/console/table.h"
#include "stack/manager/program_run.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"

namespace linegate::console {
namespace {

// 16 MB in segments take 39 hours at 50 kbit/s with a client_share of 15 %.
constexpr Duration kLongestProgramming = std::chrono::hours(48);

// The object and value with which the device reported why the program could not be loaded. An abort
// 0606 0000h of the device has the error of a value that reports a failure, but no value: 1F50h is
// never read, and 1F57h reports a failure by bits that are not 0.
std::string finding_text(const line::Reply& reply) {
  const auto* const fault = std::get_if<line::ProgramFault>(&reply.data);
  if (fault == nullptr) {
    return {};
  }
  const auto [object, value] = *fault;
  std::string out = od::to_text(object);
  const bool is_program = object.index == od::objects::kProgramData;
  if (is_program && reply.error == to_error(AbortCode::device_state) &&
      value == line::kProgramRestarted) {
    return out + ", the device restarted while the program was written";
  }
  if (reply.error != to_error(AbortCode::hardware) || is_program) {
    return out;
  }
  if (value == 0) {
    return object.index == od::objects::kFlashStatus ? out : out + " is 0, or was refused";
  }
  out += " is " + format_hex(value, 8) + "h";
  if (object.index == od::objects::kFlashStatus) {
    out += ", " + std::string(manager::describe_flash_status(value));
  }
  return out;
}

std::string program_json(const LineId& id, std::uint8_t node, const Client::Answer& answer) {
  nlohmann::ordered_json out{
      {"gateway", id.gateway}, {"line", id.line}, {"node", node}, {"ok", answer.reply.ok()}};
  if (!answer.reply.ok()) {
    out["code"] = answer.reply.error.code;
    out["text"] = answer.text;
    out["finding"] = finding_text(answer.reply);
  }
  return one_line(out);
}

}  // namespace

int load_program(Context& context, const std::string& node, std::uint8_t number,
                 std::vector<std::byte> program) {
  auto ref = parse_node(node);
  if (!ref || ref->own || ref->all) {
    context.err << "'" << node << "' is not LINE:NODE, with a node-ID 1..127 or a name\n";
    return kUsage;
  }
  if (program.empty()) {
    context.err << "the program has no bytes\n";
    return kUsage;
  }
  Model model;
  const Line* const line = find_line(context, model, ref->line);
  if (line == nullptr || !resolve_node(context, model, *line, *ref)) {
    return kFailed;
  }
  const LineId id = line->id;
  const std::size_t size = program.size();
  const line::Command command{
      .timeout = std::max(context.timeout, kLongestProgramming),
      .request = line::ProgramDownload{
          .node = ref->node, .number = number, .program = std::move(program)}};
  EventProgress progress(model, id, context.err, {EventKind::command_progress});
  const Client::Answer answer = context.client.call(id, command, command.timeout, 0, progress);
  if (context.json) {
    context.out << program_json(id, ref->node, answer) << '\n';
  } else if (answer.reply.ok()) {
    context.out << size << " bytes loaded, the program runs\n";
  } else {
    const std::string finding = finding_text(answer.reply);
    context.err << printable(answer.text) << (finding.empty() ? "" : ": " + finding) << '\n';
  }
  return answer.reply.ok() ? kDone : kFailed;
}

}  // namespace linegate::console
