// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/scan.h"

#include <algorithm>
#include <ostream>
#include <span>

#include "bridges/console/answer.h"
#include "bridges/console/event_progress.h"
#include "bridges/console/lookup.h"
#include "bridges/console/model.h"
#include "stack/base/abort_code.h"
#include "stack/od/objects.h"
#include "stack/scan/scanned_node.h"

namespace linegate::console {
namespace {

// 127 nodes of 1024 PDO records each at 125 kbit/s take more than an hour with a client_share of 15
// %.
constexpr Duration kLongest = std::chrono::hours(4);

// A node that was read, or one whose defaults could not be restored.
std::string progress_words(const EventView& view) {
  const auto* const abort = view.get<event::SdoAbort>();
  const bool is_progress = view.get<event::NodeScanned>() != nullptr ||
                           (abort != nullptr && abort->index == od::objects::kRestoreDefaults);
  return is_progress ? view.text : std::string();
}

line::Command command_of(const Context& context, const ScanRequest& request, std::uint8_t node) {
  const bool applies = request.apply || request.restore_defaults;
  line::Command command{.timeout = std::max(context.timeout, kLongest),
                        .request = line::Scan{.node = node}};
  if (applies) {
    command.request =
        line::ScanApply{.node = node, .set_up = request.apply, .restore = request.restore_defaults};
  }
  return command;
}

void keep_layouts(Context& context, Model& model, const Line& line, ScanResult& result) {
  (void)wait_until(context, model, [&] { return line.areas[0].layout && line.areas[1].layout; });
  result.layouts = {line.areas[0].layout, line.areas[1].layout};
}

// Whether the requested node was found; true for a scan of a whole line.
bool was_found(const ScanResult& result, std::uint8_t node) {
  return node == 0 ||
         std::ranges::find(result.nodes, node, &scan::ScannedNode::id) != result.nodes.end();
}

}  // namespace

int scan(Context& context, const ScanRequest& request, ScanResult& result) {
  auto target = line_or_node(context, request.what);
  if (!target) {
    return kUsage;
  }
  Model model;
  const Line* const line = find_line(context, model, target->line);
  if (line == nullptr || !resolve_node(context, model, *line, *target)) {
    return kFailed;
  }
  result.id = line->id;
  result.line = *line->view;
  if (request.compare && !request.apply && !request.restore_defaults) {
    keep_layouts(context, model, *line, result);
  }
  const line::Command command = command_of(context, request, target->node);
  EventProgress progress(model, result.id, context.err, progress_words);
  const Client::Answer answer =
      context.client.call(result.id, command, command.timeout, 0, progress);
  if (!answer.reply.ok()) {
    return print_answer(context, answer);
  }
  const auto* const nodes = std::get_if<std::vector<scan::ScannedNode>>(&answer.reply.data);
  if (nodes == nullptr) {
    context.err << "the gateway's answer cannot be read\n";
    return kFailed;
  }
  result.nodes = *nodes;
  if (context.json) {
    context.out << scan_json(result) << '\n';
  } else {
    for (const std::string& text : text_of(scan_table(result))) {
      context.out << text << '\n';
    }
  }
  if (!was_found(result, target->node)) {
    context.err << "node " << unsigned{target->node} << " of " << printable(result.id.line)
                << " did not answer\n";
    return kFailed;
  }
  return kDone;
}

}  // namespace linegate::console
