// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/found_nodes.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "gateway/config/sections.h"
#include "gateway/config/whole_file.h"
#include "stack/eds/reader.h"
#include "stack/od/objects.h"
#include "stack/scan/conflicts.h"
#include "stack/scan/describe.h"

namespace linegate::config {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr od::Address kInputsSent{od::objects::cia401::kAnalogueInterrupts, 0};

struct Sheet {
  std::string name;
  std::string text;
};

std::vector<Sheet> sheets_in(const std::string& folder, std::string& error) {
  std::vector<Sheet> out;
  if (folder.empty()) {
    return out;
  }
  std::error_code failed;
  for (fs::directory_iterator at(folder, failed), end; !failed && at != end; at.increment(failed)) {
    std::string extension = at->path().extension().string();
    std::ranges::transform(extension, extension.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    std::error_code ignored;
    if (extension == ".eds" && at->is_regular_file(ignored)) {
      auto text = whole_file(at->path());
      if (!text) {
        error = fmt::format("{}: cannot be read", at->path().string());
        return out;
      }
      out.push_back({at->path().filename().string(), *std::move(text)});
    }
  }
  if (failed) {
    error = fmt::format("{}: {}", folder, failed.message());
  }
  std::ranges::sort(out, {}, &Sheet::name);
  return out;
}

FoundNode describe_node(const scan::ScannedNode& node, const std::vector<Sheet>& sheets,
                        std::vector<std::string>& notes) {
  FoundNode out;
  for (const Sheet& sheet : sheets) {
    auto loaded = eds::load(sheet.text, sheet.name, node.id);
    if (loaded.value && scan::matches(*loaded.value, node)) {
      notes.push_back(fmt::format("node {}: names and types of {}", node.id, sheet.name));
      out.config.device = scan::merge(*std::move(loaded.value), node);
      out.sheet = sheet.name;
      return out;
    }
  }
  if (!sheets.empty()) {
    notes.push_back(
        fmt::format("node {}: no EDS of its identity, types are known by length alone", node.id));
  }
  out.config.device = scan::describe(node);
  return out;
}

// What the device calls itself, as a name. A name ends in the node-ID: it is unique, no other
// device changes it, and it is never a number.
std::string name_of(const line::NodeConfig& node) {
  const std::string id = std::to_string(node.id);
  std::string out;
  for (const char character : node.device.product_name) {
    const bool fits = is_name({character});
    if (fits || (!out.empty() && out.back() != '-')) {
      out += fits ? character : '-';
    }
  }
  out.resize(std::min(out.size(), kMostOfName - id.size() - 1));
  while (!out.empty() && out.back() == '-') {
    out.pop_back();
  }
  return out.empty() ? "node" + id : out + '-' + id;
}

void receive_error_control(const scan::ScannedNode& node, line::NodeConfig& config) {
  const auto heartbeat = node.number({od::objects::kProducerHeartbeatTime, 0}).value_or(0);
  const auto guard = node.number({od::objects::kGuardTime, 0}).value_or(0);
  const auto factor = node.number({od::objects::kLifeTimeFactor, 0}).value_or(0);
  if (heartbeat != 0) {
    config.heartbeat = milliseconds(heartbeat);
  } else if (guard != 0 && factor != 0) {
    config.guard_time = milliseconds(guard);
    config.life_time_factor = static_cast<std::uint8_t>(factor);
  }
}

}  // namespace

FoundNodes found_nodes(std::span<const scan::ScannedNode> nodes, const std::string& eds_folder,
                       std::size_t longest_pdo) {
  FoundNodes out;
  const std::vector<Sheet> sheets = sheets_in(eds_folder, out.error);
  const std::vector<scan::LeftOut> pdos = scan::left_out(nodes);
  for (const scan::ScannedNode& node : nodes) {
    if (node.end != AbortCode::none) {
      out.notes.push_back(fmt::format("node {} is left out: it was not read to the end", node.id));
      continue;
    }
    FoundNode found = describe_node(node, sheets, out.notes);
    found.config.id = node.id;
    found.config.name = name_of(found.config);
    for (const std::string& note :
         scan::leave_out(found.config.device, node.id, pdos, longest_pdo)) {
      out.notes.push_back(fmt::format("node {}: {}", node.id, note));
    }
    receive_error_control(node, found.config);
    if (node.number(kInputsSent) == 1U) {
      found.config.objects.push_back({kInputsSent, {std::byte{1}}});
    }
    out.nodes.push_back(std::move(found));
  }
  return out;
}

}  // namespace linegate::config
