// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/configuration.h"

#include <algorithm>
#include <ostream>

#include "bridges/console/answer.h"
#include "bridges/console/event_progress.h"
#include "bridges/console/lookup.h"
#include "bridges/console/object_text.h"
#include "bridges/console/refusal_text.h"
#include "bridges/console/table.h"
#include "stack/manager/boot_event.h"
#include "stack/manager/configuration_objects.h"
#include "stack/manager/plan.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"

namespace linegate::console {
namespace {

// 126 nodes of 1000 objects each at 50 kbit/s take more than an hour with a client_share of 15 %.
constexpr Duration kLongestConfiguring = std::chrono::hours(4);

bool write_own(Context& context, Model& model, const Line& line,
               const manager::ObjectWrite& write) {
  const line::LocalWrite request{.address = write.address, .data = write.data};
  const Client::Answer answer = ask_line(context, model, line, {.request = request});
  if (!answer.reply.ok()) {
    context.err << od::to_text(write.address) << ": " << printable(answer.text);
    if (answer.reply.error.domain == Domain::sdo) {
      context.err << " (" << format_hex(answer.reply.error.code, 8) << ')';
    }
    context.err << '\n';
  }
  return answer.reply.ok();
}

// The last reported boot result of each node after the first `events` events of the line. These
// events precede the answer.
BootFindings findings_since(const Model& model, const LineId& id, std::uint64_t events) {
  BootFindings out;
  for (const KnownEvent& known : model.events()) {
    const EventView& event = known.view;
    const auto* const result = event.get<event::BootResult>();
    if (known.id == id && result != nullptr && event.number > events) {
      out[event.node] = manager::finding_of(*result);
    }
  }
  return out;
}

// The manager writes the concise DCF of a node when it boots the node.
std::string import_text(std::uint8_t node, std::size_t count) {
  const std::string objects = std::to_string(count) + (count == 1 ? " object" : " objects");
  return node == 0 ? objects + " written"
                   : objects + " for node " + std::to_string(node) +
                         ", written to it when it boots the next time";
}

}  // namespace

int configure(Context& context, ConfigAction action, const std::string& what) {
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
  const line::Command command{
      .timeout = std::max(context.timeout, kLongestConfiguring),
      .request = line::Configure{.node = target->node, .apply = action == ConfigAction::apply}};
  const std::uint64_t events = line->view->state.counters.events;
  EventProgress progress(model, id, context.err, {EventKind::command_progress});
  const Client::Answer answer = context.client.call(id, command, command.timeout, 0, progress);
  if (!answer.reply.ok()) {
    const int code = print_answer(context, answer);
    if (answer.reply.error == line::to_error(line::Refusal::bad_request)) {
      report_no_such_node(context, model, *line, target->node);
    }
    return code;
  }
  const auto* const nodes = std::get_if<std::vector<manager::NodeReport>>(&answer.reply.data);
  if (nodes == nullptr) {
    context.err << "the gateway's answer cannot be read\n";
    return kFailed;
  }
  const BootFindings findings = findings_since(model, id, events);
  if (context.json) {
    context.out << configuration_json(id, action, *nodes, findings) << '\n';
  } else {
    for (const std::string& text : text_of(configuration_table(id, action, *nodes, findings))) {
      context.out << text << '\n';
    }
  }
  return std::ranges::all_of(*nodes, &manager::NodeReport::good) ? kDone : kFailed;
}

int import_configuration(Context& context, const std::string& what,
                         std::span<const std::byte> concise_dcf) {
  auto target = line_or_node(context, what);
  auto writes = manager::read_concise_dcf(concise_dcf);
  if (!writes.ok()) {
    context.err << "this is no concise DCF: its " << concise_dcf.size()
                << " bytes do not match its count and sizes\n";
  }
  if (!target || !writes.ok()) {
    return kUsage;
  }
  const std::size_t count = writes->size();
  return on_line(context, target->line, [&](Model& model, const Line& line) {
    if (!resolve_node(context, model, line, *target)) {
      return kFailed;
    }
    if (target->node != 0) {
      *writes = {
          {{od::objects::kConciseDcf, target->node}, {concise_dcf.begin(), concise_dcf.end()}}};
    }
    const auto taken = [&](const manager::ObjectWrite& write) {
      return write_own(context, model, line, write);
    };
    if (!std::ranges::all_of(*writes, taken)) {
      return kFailed;
    }
    context.out << (context.json ? "{\"written\":" + std::to_string(count) + "}"
                                 : import_text(target->node, count))
                << '\n';
    return kDone;
  });
}

}  // namespace linegate::console
