// SPDX-License-Identifier: Apache-2.0
// linegate gateways: what concerns a gateway and none of its lines.
#include <algorithm>
#include <iomanip>
#include <ostream>
#include <sstream>
#include <string>

#include <nlohmann/json.hpp>

#include "bridges/console/commands.h"
#include "bridges/console/lookup.h"
#include "bridges/console/one_line.h"
#include "bridges/console/table.h"
#include "bridges/console/tables.h"

namespace linegate::console {
namespace {

std::string configuration_text(std::uint64_t value) {
  std::ostringstream out;
  out << std::hex << std::setw(16) << std::setfill('0') << value;
  return out.str();
}

nlohmann::ordered_json gateway_json(const std::string& name, const GatewayView& view) {
  nlohmann::ordered_json out = {{"gateway", name},
                                {"version", view.version},
                                {"time", date_text(view.time)},
                                {"started", date_text(view.started)},
                                {"configuration", configuration_text(view.configuration)},
                                {"configured", date_text(view.configured)},
                                {"reloads", view.reloads},
                                {"reloads_refused", view.reloads_refused},
                                {"events", view.events},
                                {"event_stream", configuration_text(view.event_stream)},
                                {"participants", view.participants},
                                {"participants_most", view.participants_most},
                                {"lines", nlohmann::ordered_json::array()},
                                {"counters", nlohmann::ordered_json::object()}};
  for (const auto& [line, interface] : view.lines) {
    out["lines"].push_back({{"name", line}, {"interface", interface}});
  }
  for (const auto& [counter, value] : view.counters) {
    out["counters"][counter] = value;
  }
  return out;
}

void print_gateway(std::ostream& out, const std::string& name, const GatewayView& view,
                   Stamp stamp) {
  out << printable(name) << "  version " << printable(view.version) << ", started "
      << stamp(view.started) << '\n';
  out << "  configuration " << configuration_text(view.configuration) << " since "
      << stamp(view.configured) << ", " << view.reloads << " reloads, " << view.reloads_refused
      << " refused\n";
  out << "  DDS participants " << view.participants << " of " << view.participants_most
      << " at most\n";
  for (const auto& [line, interface] : view.lines) {
    out << "  line " << printable(line) << " on " << printable(interface) << '\n';
  }
  for (const auto& [counter, value] : view.counters) {
    if (value != 0) {
      out << "  " << printable(counter) << ' ' << value << '\n';
    }
  }
}

}  // namespace

// Each gateway publishes its state once a second.
int gateways(Context& context) {
  Model model;
  const auto is_missing = [&](const std::string& name) { return !model.gateways().contains(name); };
  (void)wait_until_settled(context, model, [&] {
    return !model.gateways().empty() &&
           std::ranges::none_of(context.client.discovery().gateways, is_missing);
  });
  if (model.gateways().empty()) {
    context.err << no_gateway_text(context) << '\n';
    return kFailed;
  }
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const auto& [name, view] : model.gateways()) {
    if (context.json) {
      all.push_back(gateway_json(name, view));
    } else {
      print_gateway(context.out, name, view, stamp_of(context));
    }
  }
  if (context.json) {
    context.out << one_line(nlohmann::ordered_json({{"gateways", all}})) << '\n';
  }
  int code = kDone;
  for (const std::string& name : context.client.discovery().gateways) {
    if (is_missing(name)) {
      context.err << "incomplete: the state of gateway " << printable(name) << '\n';
      code = kIncomplete;
    }
  }
  return code;
}

}  // namespace linegate::console
