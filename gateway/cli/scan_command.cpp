// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <memory>
#include <ostream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "bridges/console/scan.h"
#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/publish/foreign_text.h"
#include "gateway/tools/scan_files.h"

namespace linegate::gateway {
namespace {

struct ScanArguments {
  console::ScanRequest request;
  std::string folder;  // for plant.yaml and DCF files; empty = no files are written
  std::string eds;     // folder of EDS files for names and exact types; empty = none
};

std::string property(const console::LineView& line, std::string_view name) {
  const auto known =
      std::ranges::find(line.properties, name, [](const auto& each) { return each.first; });
  return known == line.properties.end() ? "" : known->second;
}

// bit/s of the data phase; 0 if it is not known. Checked, because any participant can publish the
// value.
std::uint32_t data_bit_rate_of(const console::LineView& line) {
  constexpr std::uint32_t kFastest = 8'000'000;  // limit of `data_bit_rate` in a plant.yaml
  const std::string text = property(line, "data-bit-rate");
  std::uint32_t rate = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), rate);
  const bool whole = read.ec == std::errc() && read.ptr == text.data() + text.size();
  return whole && rate >= line.bit_rate && rate <= kFastest ? rate : 0;
}

// Checked likewise.
Duration sync_period_of(const console::LineView& line) {
  constexpr std::int64_t kLongest = 60'000'000;  // limit of `sync` in a plant.yaml
  const std::string text = property(line, "sync-period-us");
  std::int64_t us = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), us);
  const bool whole = read.ec == std::errc() && read.ptr == text.data() + text.size();
  return whole && us > 0 && us <= kLongest ? std::chrono::microseconds(us) : Duration::zero();
}

// Prints the result of a scan of a line, and writes it to files if a folder is given. Returns the
// exit code.
int scan_and_write(console::Context& context, const ScanArguments& target, unsigned domain) {
  console::ScanRequest request = target.request;
  console::ScanResult result;
  const bool applies = request.apply || request.restore_defaults;
  request.compare = !target.folder.empty() && !applies;
  const int code = console::scan(context, request, result);
  if (code != console::kDone || target.folder.empty()) {
    return code;
  }
  using usdo::AbortForm;
  const line::LineState& state = result.line.state;
  const std::string abort_form = property(result.line, "usdo-abort");
  const ScanFiles files = write_scan(
      {.gateway = result.id.gateway,
       .name = result.id.line,
       .interface_uri = result.line.interface_uri,
       .bit_rate = result.line.bit_rate,
       .network_id = result.line.state.network_id,
       .node_id = result.line.state.node_id,
       .access = result.line.access,
       .outputs_access = property(result.line, "outputs-access"),
       .sync_period = sync_period_of(result.line),
       .dds_domain = domain,
       .canopen_fd = !abort_form.empty(),
       .data_bit_rate = data_bit_rate_of(result.line),
       .usdo_abort = abort_form == usdo::name(AbortForm::four_bytes) ? AbortForm::four_bytes
                                                                     : AbortForm::one_byte,
       .flying_master = state.flying_master != nmt::FlyingMasterState::none
                            ? std::optional(state.master_priority)
                            : std::nullopt,
       .nodes = std::move(result.nodes),
       .layouts = std::move(result.layouts)},
      target.folder, target.eds);
  if (applies && !target.eds.empty()) {
    context.err << "the running line has the layout_id that its own device files give, and another "
                   "one if the files of "
                << printable(target.eds) << " give other types once the written plant.yaml runs\n";
  }
  for (const std::string& note : files.notes) {
    context.err << printable(note) << '\n';
  }
  for (const std::string& path : files.written) {
    context.err << "written: " << path << '\n';
  }
  if (!files.ok) {
    context.err << "error: " << printable(files.error) << '\n';
  }
  return files.ok ? console::kDone : console::kFailed;
}

}  // namespace

void add_scan(CommandLine& line) {
  const auto arguments = std::make_shared<ScanArguments>();
  CLI::App* scan =
      line.app().add_subcommand("scan", "read the identity and the PDOs of the devices on a line");
  scan->add_option("line", arguments->request.what, "LINE, or LINE:NODE for one node")->required();
  scan->add_flag("--apply", arguments->request.apply,
                 "configure missing heartbeats, and run the line with the devices found");
  scan->add_flag(
      "--restore-defaults", arguments->request.restore_defaults,
      "restore the defaults of the devices first, and run the line with the devices found");
  scan->add_option("--write", arguments->folder, "folder for a plant.yaml and DCF files");
  scan->add_option("--eds", arguments->eds, "folder of EDS files, for names and exact types")
      ->check(CLI::ExistingDirectory);
  line.on(scan, [&line, arguments] {
    const bool compares = !arguments->folder.empty();
    return line.with_client(
        {.layouts = compares, .events = true, .commands = true},
        [&](console::Context& c) { return scan_and_write(c, *arguments, line.common().domain); });
  });
}

}  // namespace linegate::gateway
