#include "bridges/console/scan.h"

#include <algorithm>
#include <ostream>
#include <span>

#include "bridges/console/lookup.h"
#include "bridges/console/model.h"
#include "stack/base/abort_code.h"
#include "stack/base/byte_order.h"
#include "stack/scan/report.h"

namespace linegate::console {
namespace {

// 127 nodes of 1024 PDO records each at 125 kbit/s take minutes.
constexpr Duration kLongest = std::chrono::minutes(15);

// Hands all on, and tells of the nodes of one line that have been read.
class Progress final : public Listener {
 public:
  Progress(Model& model, const LineId& id, std::ostream& err)
      : model_(model), id_(id), err_(err), since_(utc_now()) {}

  void on_line(const LineId& id, const LineView& line) override { model_.on_line(id, line); }
  void on_line_gone(const LineId& id) override { model_.on_line_gone(id); }
  void on_node(const LineId& id, const NodeView& node) override { model_.on_node(id, node); }
  void on_layout(const LineId& id, const image::Layout& layout) override {
    model_.on_layout(id, layout);
  }
  void on_image(const LineId& id, const image::Snapshot& image) override {
    model_.on_image(id, image);
  }
  void on_event(const LineId& id, const EventView& event) override {
    model_.on_event(id, event);
    if (id == id_ && tells(event.event) && event.event.time >= since_) {
      err_ << printable(event.text) << std::endl;
    }
  }
  void on_unreadable(std::uint64_t samples) override { model_.on_unreadable(samples); }
  void on_left_out(std::uint64_t samples) override { model_.on_left_out(samples); }

 private:
  // A node that was read, or one whose defaults could not be restored.
  static bool tells(const Event& event) {
    constexpr std::uint64_t kRestore = 0x1011;
    return event.kind == EventKind::node_scanned ||
           (event.kind == EventKind::sdo_abort && event.length >= 2 &&
            load_le(std::span<const std::byte>(event.data).first(2)) == kRestore);
  }

  Model& model_;
  const LineId& id_;
  std::ostream& err_;
  Instant since_;
};

struct Target {
  std::string line;
  std::uint8_t node = 0;
};

std::optional<Target> target_of(Context& context, const std::string& what) {
  if (what.find(':') == std::string::npos) {
    return Target{what, 0};
  }
  const auto ref = parse_node(what);
  if (!ref || ref->own) {
    context.err << "'" << what << "' is not LINE or LINE:NODE, with a node-ID 1..127\n";
    return std::nullopt;
  }
  return Target{ref->line, ref->all ? std::uint8_t{0} : ref->node};
}

line::Command command_of(const Context& context, const ScanRequest& request, std::uint8_t node) {
  const bool applies = request.apply || request.restore_defaults;
  line::Command command{.kind = applies ? line::CommandKind::scan_apply : line::CommandKind::scan};
  command.node = node;
  command.code = static_cast<std::uint16_t>((request.apply ? line::kScanSetUp : 0U) |
                                            (request.restore_defaults ? line::kScanRestore : 0U));
  command.timeout = std::max(context.timeout, kLongest);
  return command;
}

}  // namespace

int scan(Context& context, const ScanRequest& request, ScanResult& result) {
  const auto target = target_of(context, request.what);
  if (!target) {
    return kUsage;
  }
  Model model;
  const Line* const line = find_line(context, model, target->line);
  if (line == nullptr) {
    return kFailed;
  }
  result.id = line->id;
  result.line = *line->view;
  const line::Command command = command_of(context, request, target->node);
  Progress progress(model, result.id, context.err);
  const Client::Answer answer =
      context.client.call(result.id, command, command.timeout, 0, progress);
  if (!answer.reply.ok()) {
    context.err << answer.text << '\n';
    return kFailed;
  }
  auto nodes = scan::read_report(answer.reply.data);
  if (!nodes.ok()) {
    context.err << "the gateway's answer cannot be read\n";
    return kFailed;
  }
  result.nodes = *std::move(nodes);
  if (context.json) {
    context.out << scan_json(result) << '\n';
    return kDone;
  }
  for (const std::string& text : text_of(scan_table(result))) {
    context.out << text << '\n';
  }
  return kDone;
}

}  // namespace linegate::console
