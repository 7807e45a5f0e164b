// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/discovery.h"

#include <algorithm>
#include <map>
#include <set>
#include <sstream>
#include <string_view>

#include "bridges/console/commands.h"
#include "bridges/console/lookup.h"
#include "bridges/console/table.h"

namespace linegate::console {
namespace {

constexpr Duration kUnchanged = std::chrono::milliseconds(300);

struct ReceivedGateway {
  std::size_t lines = 0;
  std::size_t announced = 0;  // in the newest LineState
  Instant newest{};
};

std::string_view property(const LineView& view, std::string_view name) {
  const auto found = std::ranges::find_if(
      view.properties, [&](const auto& property) { return property.first == name; });
  return found == view.properties.end() ? std::string_view() : std::string_view(found->second);
}

void note(ReceivedGateway& gateway, const LineView& view) {
  ++gateway.lines;
  const auto lines = parse_number(std::string(property(view, "lines")), Model::kMaxLines, false);
  if (lines && view.time >= gateway.newest) {
    gateway.newest = view.time;
    gateway.announced = *lines;
  }
}

// Adds the names of "b,c,+2" to `names` and returns the number behind the plus.
std::size_t note_others(std::string_view text, std::set<std::string>& names) {
  std::size_t more = 0;
  std::istringstream in{std::string(text)};
  for (std::string one; std::getline(in, one, ',');) {
    if (!one.starts_with('+')) {
      names.insert(one);
    } else if (const auto number = parse_number(one.substr(1), Model::kMaxLines, false)) {
      more = *number;
    }
  }
  return more;
}

}  // namespace

std::vector<std::string> missing_lines(const Model& model,
                                       const std::vector<std::string>& gateways) {
  std::map<std::string, ReceivedGateway> received;
  std::set<std::string> wanted(gateways.begin(), gateways.end());
  // Lower bound of the number of gateways, from a list that did not fit its property
  std::size_t least = 0;
  for (const auto& [id, line] : model.lines()) {
    if (line.gone || !line.view) {
      continue;
    }
    note(received[id.gateway], *line.view);
    std::set<std::string> named{id.gateway};
    const std::size_t more = note_others(property(*line.view, "other-gateways"), named);
    least = std::max(least, more == 0 ? 0 : named.size() + more);
    wanted.merge(named);
  }
  std::vector<std::string> out;
  for (const std::string& name : wanted) {
    const auto found = received.find(name);
    if (found == received.end()) {
      out.push_back("gateway " + printable(name));
    } else if (found->second.lines < found->second.announced) {
      out.push_back(std::to_string(found->second.announced - found->second.lines) + " of " +
                    std::to_string(found->second.announced) + " lines of gateway " +
                    printable(name));
    }
  }
  if (wanted.size() < least) {
    out.push_back(std::to_string(least - wanted.size()) + " more gateways");
  }
  return out;
}

bool is_settled(const Context& context, const Model& model) {
  const Discovery discovery = context.client.discovery();
  return discovery.unchanged >= kUnchanged &&
         std::ranges::any_of(model.lines(),
                             [](const auto& line) { return line.second.view.has_value(); }) &&
         missing_lines(model, discovery.gateways).empty();
}

bool has_all_lines(const Context& context, const Model& model, const std::string& gateway) {
  ReceivedGateway received;
  for (const auto& [id, line] : model.lines()) {
    if (id.gateway == gateway && !line.gone && line.view) {
      note(received, *line.view);
    }
  }
  return received.announced > 0 && received.lines >= received.announced &&
         context.client.discovery().unchanged >= kUnchanged;
}

std::string unsettled_text(const Context& context, const Model& model) {
  const Discovery discovery = context.client.discovery();
  std::string out;
  for (const std::string& one : missing_lines(model, discovery.gateways)) {
    out += (out.empty() ? "nothing was received of " : ", ") + one;
  }
  if (out.empty() && discovery.unchanged < kUnchanged) {
    out = "gateways are coming and going";
  }
  return out;
}

}  // namespace linegate::console
