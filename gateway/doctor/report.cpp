// SPDX-License-Identifier: Apache-2.0
#include "gateway/doctor/report.h"

#include <chrono>
#include <ostream>

#include <nlohmann/json.hpp>

#include "gateway/doctor/facts.h"

namespace linegate::doctor {
namespace {

std::string interface_text(const Interface& it) {
  std::string out = it.name;
  for (const std::string& address : it.addresses)
    out += " " + address;
  if (!it.up)
    return out + " down";
  if (!it.running)
    return out + " without carrier";
  if (!it.multicast)
    return out + " without multicast";
  if (!it.multicast_tested)
    return out;
  return out + (it.multicast_received ? " with multicast" : " where multicast is blocked");
}

const char* answer_text(PortAnswer answer) {
  switch (answer) {
    case PortAnswer::silent:
      return "silent";
    case PortAnswer::answered:
      return "answers";
    case PortAnswer::refused:
      return "refused";
    case PortAnswer::unreachable:
      break;
  }
  return "unreachable";
}

void print_observations(std::ostream& out, const Observations& seen) {
  for (const Interface& it : seen.interfaces) {
    if (!it.addresses.empty())
      out << "  interface " << safe(interface_text(it)) << '\n';
  }
  for (const Heard& heard : seen.heard) {
    if (!heard.left && !gateway_name(heard.announcement.name).empty())
      out << "  domain " << heard.domain << ": " << heard_text(heard)
          << (heard.announcement.secured ? ", with DDS-Security" : "") << '\n';
  }
  for (const ProbedHost& host : seen.probes) {
    for (const ProbedPort& port : host.ports)
      out << "  UDP port " << port.port << " of " << safe(host.name) << ": "
          << answer_text(port.answer) << '\n';
  }
  for (const ReceivedGateway& gateway : seen.received)
    out << "  gateway '" << safe(gateway.name) << "' is received, with " << gateway.lines
        << (gateway.lines == 1 ? " line\n" : " lines\n");
}

}  // namespace

void print_report(std::ostream& out, const Observations& seen, const Findings& found) {
  out << "DDS domain " << seen.domain << ", "
      << (seen.secured() ? "identity " + safe(seen.identity) : "without security") << ", profile "
      << safe(seen.profile) << ", observed for " << seconds_text(seen.watched) << ":\n";
  print_observations(out, seen);
  if (found.empty()) {
    out << "no fault was found\n";
    return;
  }
  std::size_t number = 0;
  for (const Finding& it : found) {
    out << '\n' << ++number << ". " << it.cause << '\n';
    for (const std::string& seen_one : it.seen)
      out << "   seen:  " << seen_one << '\n';
    out << "   means: " << it.means << '\n' << "   do:    " << it.advice << '\n';
  }
}

std::string report_json(const Observations& seen, const Findings& found) {
  using Json = nlohmann::ordered_json;
  const auto array = [] { return Json::array(); };
  Json out = {{"domain", seen.domain},    {"profile", seen.profile}, {"security", seen.identity},
              {"fault", !found.empty()},  {"findings", array()},     {"interfaces", array()},
              {"announcements", array()}, {"ports", array()},        {"gateways", array()}};
  for (const Finding& it : found)
    out["findings"].push_back(
        {{"cause", it.cause}, {"seen", it.seen}, {"means", it.means}, {"advice", it.advice}});
  for (const Interface& it : seen.interfaces)
    out["interfaces"].push_back({{"name", it.name},
                                 {"addresses", it.addresses},
                                 {"up", it.up && it.running},
                                 {"multicast", it.multicast},
                                 {"multicast_received", it.multicast_received}});
  for (const Heard& it : seen.heard)
    out["announcements"].push_back({{"name", it.announcement.name},
                                    {"domain", it.domain},
                                    {"from", it.from},
                                    {"host", it.announcement.host},
                                    {"count", it.count},
                                    {"secured", it.announcement.secured},
                                    {"left", it.left}});
  for (const ProbedHost& host : seen.probes) {
    for (const ProbedPort& port : host.ports)
      out["ports"].push_back({{"host", host.name},
                              {"address", host.address},
                              {"port", port.port},
                              {"answer", answer_text(port.answer)},
                              {"error", port.error}});
  }
  for (const ReceivedGateway& it : seen.received)
    out["gateways"].push_back(
        {{"gateway", it.name},
         {"lines", it.lines},
         {"clock_difference_s", std::chrono::duration<double>(it.clock_difference).count()},
         {"participants", it.participants},
         {"participants_most", it.participants_most}});
  return out.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace linegate::doctor
