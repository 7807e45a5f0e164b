// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/scan_command.h"

#include <algorithm>
#include <charconv>
#include <ostream>
#include <string_view>
#include <system_error>
#include <utility>

#include "gateway/publish/foreign_text.h"
#include "gateway/tools/scan_files.h"

namespace linegate::gateway {
namespace {

std::string property(const console::LineView& line, std::string_view name) {
  const auto known =
      std::ranges::find(line.properties, name, [](const auto& each) { return each.first; });
  return known == line.properties.end() ? "" : known->second;
}

// Any participant can publish it.
Duration sync_period_of(const console::LineView& line) {
  constexpr std::int64_t kLongest = 60'000'000;  // of `sync` in a plant.yaml
  const std::string text = property(line, "sync-period-us");
  std::int64_t us = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), us);
  const bool whole = read.ec == std::errc() && read.ptr == text.data() + text.size();
  return whole && us > 0 && us <= kLongest ? std::chrono::microseconds(us) : Duration::zero();
}

}  // namespace

int scan_and_write(console::Context& context, console::ScanRequest request,
                   const ScanTarget& target) {
  console::ScanResult result;
  const bool applies = request.apply || request.restore_defaults;
  request.compare = !target.folder.empty() && !applies;
  const int code = console::scan(context, request, result);
  if (code != console::kDone || target.folder.empty()) {
    return code;
  }
  const ScanFiles files = write_scan({.gateway = result.id.gateway,
                                      .name = result.id.line,
                                      .interface_uri = result.line.interface_uri,
                                      .bit_rate = result.line.bit_rate,
                                      .network_id = result.line.state.network_id,
                                      .node_id = result.line.state.node_id,
                                      .access = result.line.access,
                                      .outputs_access = property(result.line, "outputs-access"),
                                      .sync_period = sync_period_of(result.line),
                                      .dds_domain = target.domain,
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

}  // namespace linegate::gateway
