// SPDX-License-Identifier: Apache-2.0
// `routing:`, `routes:` and a line's `enter:`: routes to other networks, and access from them.
#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "gateway/config/sections.h"
#include "gateway/config/source.h"

namespace linegate::config {
namespace {

constexpr std::uint16_t kHighestNetwork = 0xFFFF;
constexpr std::uint16_t kHighestEmcyNetwork = 32;  // number of bits in an element of 1F2Fh
constexpr std::uint16_t kUsualCost = 10;
constexpr Duration kLongestWait = std::chrono::minutes(10);
constexpr Duration kShortestRequest = std::chrono::milliseconds(500);
// Ways over other gateways have the interfaces that no network-ID of a line is, from this one down.
constexpr unsigned kHighestInterface = 255;
constexpr std::size_t kMostWays = 128;

using Range = std::pair<std::uint16_t, std::uint16_t>;

// "3", "10..19".
std::optional<Range> parse_networks(const std::string& text) {
  const std::size_t dots = text.find("..");
  const auto first = parse_unsigned(text.substr(0, dots));
  const auto last = dots == std::string::npos ? first : parse_unsigned(text.substr(dots + 2));
  if (!first || !last || *first == 0 || *last < *first || *last > kHighestNetwork) {
    return std::nullopt;
  }
  return Range{static_cast<std::uint16_t>(*first), static_cast<std::uint16_t>(*last)};
}

// A list of scalars, or one scalar.
std::vector<YAML::Node> one_or_more(Findings& findings, const YAML::Node& node,
                                    std::string_view what) {
  if (node.IsDefined() && node.IsScalar()) {
    return {node};
  }
  return elements(findings, node, what);
}

void read_services(Section& rule, EnterSection& out) {
  const YAML::Node node = rule.find("services");
  if (!node.IsDefined()) {
    out.sdo = true;
    return;
  }
  enum class Service : std::uint8_t { none, sdo, emcy, pdo };
  for (const YAML::Node& element : one_or_more(rule.findings(), node, "services")) {
    Service service = Service::none;
    rule.choose<Service>(element, service,
                         {{"sdo", Service::sdo}, {"emcy", Service::emcy}, {"pdo", Service::pdo}});
    out.sdo = out.sdo || service == Service::sdo;
    out.emcy = out.emcy || service == Service::emcy;
    out.pdo = out.pdo || service == Service::pdo;
  }
}

void read_networks(Findings& findings, const YAML::Node& node, std::string_view what,
                   std::vector<WrittenNetworks>& out) {
  for (const YAML::Node& element : one_or_more(findings, node, what)) {
    if (!element.IsScalar() || element.Scalar().empty()) {
      findings.error(place_of(element),
                     "expected a network-ID, a range such as 10..19, the name of a line, or all");
      continue;
    }
    out.push_back({element.Scalar(), place_of(element)});
  }
}

EnterSection read_rule(Findings& findings, const YAML::Node& node) {
  EnterSection out;
  if (!node.IsMap()) {
    out.sdo = true;
    read_networks(findings, node, "enter", out.from);
    return out;
  }
  Section rule(findings, node, "a rule of enter");
  read_networks(findings, rule.require("from"), "from", out.from);
  read_services(rule, out);
  const YAML::Node access = rule.find("access");
  rule.choose<bool>(access, out.write, {{"read", false}, {"all", true}});
  if (access.IsDefined() && !out.sdo) {
    findings.error(place_of(access), "access is about sdo, which is not among the services");
  }
  rule.done();
  return out;
}

// "hall-b/press", with `enter` and `timeout`, which no other route has.
void read_way(Section& section, const YAML::Node& via, const std::string& text, RouteSection& out) {
  Findings& findings = section.findings();
  const std::size_t slash = text.find('/');
  routing::GatewayWay way{.to = {text.substr(0, slash), text.substr(slash + 1)}};
  if (check_name(findings, way.to.gateway, place_of(via), "name of a gateway")) {
    check_name(findings, way.to.line, place_of(via), "name of a line");
  }
  const YAML::Node enter = section.find("enter");
  if (const auto line = enter.IsDefined() ? section.text(enter) : std::nullopt) {
    check_name(findings, *line, place_of(enter), "name of a line");
    way.enter = *line;
  }
  section.read("timeout", way.timeout, kShortestRequest, kLongestWait);
  section.read("emcy", out.emcy);
  out.way = std::move(way);
}

void refuse_keys_of_ways(Section& section) {
  for (const char* const key : {"enter", "timeout", "emcy"}) {
    if (const YAML::Node node = section.find(key); node.IsDefined()) {
      section.findings().error(
          place_of(node),
          std::string(key) + " is for a route over another gateway, via: GATEWAY/LINE");
    }
  }
}

// "hall:5", "hall", "hall-b/press".
void read_via(Section& section, const YAML::Node& node, RouteSection& out) {
  const auto text = section.text(node);
  if (text && text->find('/') != std::string::npos) {
    read_way(section, node, *text, out);
    return;
  }
  refuse_keys_of_ways(section);
  if (!text) {
    return;
  }
  const std::size_t colon = text->find(':');
  out.line = text->substr(0, colon);
  if (colon == std::string::npos) {
    return;
  }
  const auto gateway = parse_unsigned(text->substr(colon + 1));
  if (!gateway || *gateway < 1 || *gateway > 127) {
    section.findings().error(place_of(node),
                             "expected LINE:NODE with the node-ID 1..127 of the "
                             "next gateway, got \"" +
                                 *text + "\"");
    return;
  }
  out.gateway = static_cast<std::uint8_t>(*gateway);
}

class RoutingResolver {
 public:
  RoutingResolver(Findings& findings, const RoutingSection& section, const Plant& plant,
                  std::vector<LineSection>& lines)
      : findings_(findings), section_(section), plant_(plant), lines_(lines) {}

  void run() {
    if (section_.routes.empty() &&
        std::all_of(lines_.begin(), lines_.end(), [](const LineSection& line) {
          return line.enter.empty() && line.emcy_to.empty() && line.gateways.empty();
        })) {
      return;
    }
    number_lines();
    number_ways();
    make_routes();
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      apply_routing(i);
    }
    check_emcys();
  }

 private:
  static bool routes(const LineSection& line) {
    return line.plan.config.role == line::Role::manager;
  }

  // The network-ID, which does not change when other lines are added or removed.
  static std::uint8_t interface_of(const LineSection& line) {
    return static_cast<std::uint8_t>(line.plan.config.network_id);
  }

  void number_lines() {
    for (const LineSection& line : lines_) {
      const line::LineConfig& config = line.plan.config;
      if (routes(line)) {
        interfaces_.push_back({interface_of(line), config.network_id, config.node_id, config.name});
      }
    }
  }

  // In an order that does not depend on that of the routes. Routes with the same way share it.
  void number_ways() {
    std::map<std::tuple<routing::GatewayLine, std::string, Duration>, const RouteSection*> ways;
    for (const RouteSection& route : section_.routes) {
      if (route.way && check_way(route)) {
        ways.try_emplace({route.way->to, route.way->enter, route.way->timeout}, &route);
      }
    }
    unsigned number = kHighestInterface;
    for (const auto& [way, route] : ways) {
      if (kHighestInterface - number == kMostWays) {
        findings_.error(route->via_place, "more than 128 ways over other gateways");
        return;
      }
      interfaces_.push_back({.number = static_cast<std::uint8_t>(number--),
                             .name = route->way->to.gateway + '/' + route->way->to.line,
                             .way = std::make_shared<const routing::GatewayWay>(*route->way)});
    }
  }

  bool check_way(const RouteSection& route) {
    const std::size_t before = findings_.errors();
    const routing::GatewayLine& to = route.way->to;
    if (to.gateway == plant_.gateway) {
      findings_.error(route.via_place, "\"" + to.gateway +
                                           "\" is this gateway: name its line alone, via: \"" +
                                           to.line + "\", or \"" + to.line + ":NODE\"");
    }
    if (interfaces_.empty() || std::ranges::none_of(lines_, routes)) {
      findings_.error(route.via_place,
                      "no line of this gateway is a manager: nothing would use the route");
    }
    if (!plant_.dds_security.empty() && plant_.dds_routes_security.empty()) {
      findings_.error(route.via_place,
                      "a route over another gateway needs an identity of role operator or engineer "
                      "for its requests, because that of the gateway sends none: dds: "
                      "{routes_security: FOLDER}");
    }
    return findings_.errors() == before;
  }

  const routing::Interface* find_interface(const routing::GatewayWay& way) const {
    const auto found = std::ranges::find_if(interfaces_, [&](const routing::Interface& each) {
      return each.way != nullptr && *each.way == way;
    });
    return found == interfaces_.end() ? nullptr : &*found;
  }

  // The line's own network comes first, at no cost.
  void make_routes() {
    for (const routing::Interface& line : interfaces_) {
      if (line.way == nullptr) {
        routes_.push_back({line.network, line.network, line.number, 0, 0});
      }
    }
    const std::size_t own = routes_.size();
    std::vector<const RouteSection*> written;
    for (const RouteSection& section : section_.routes) {
      if (const auto route = resolve(section)) {
        routes_.push_back(*route);
        written.push_back(&section);
      }
    }
    for (const routing::RouteFinding& found : routing::check(routes_, interfaces_)) {
      if (found.entry < own) {
        continue;  // two lines with one network_id, already reported
      }
      const RouteSection* const other = found.other >= own ? written[found.other - own] : nullptr;
      report(found.fault, *written[found.entry - own], other);
    }
    if (routes_.size() > routing::kMaxRoutes) {
      findings_.error(section_.routes.back().place,
                      "more than 254 routes, including those to the lines' own networks");
    }
  }

  void report(routing::RouteFault fault, const RouteSection& route, const RouteSection* other) {
    const std::string network = "network " + route.to.text;
    const std::string line = "line \"" + route.line + "\"";
    if (route.way && fault == routing::RouteFault::loop) {
      findings_.error(route.to.place,
                      network +
                          " is, or includes, that of a line of this gateway: the route would "
                          "lead to another network of that number");
      return;
    }
    switch (fault) {
      case routing::RouteFault::not_attached:
        findings_.error(route.via_place, network + " is not that of " + line +
                                             ": name the next gateway, " + route.line + ":NODE");
        return;
      case routing::RouteFault::loop:
        findings_.error(route.via_place,
                        "a loop: " + (route.to.text == own_network(route.line)
                                          ? network + " is that of " + line
                                          : "node " + std::to_string(route.gateway) +
                                                " is this gateway itself on " + line));
        return;
      case routing::RouteFault::overlap:
        findings_.error(
            route.to.place,
            "another route of cost " + std::to_string(route.cost) + " leads to the same network" +
                (other == nullptr ? "" : ", that in line " + std::to_string(other->place.line)));
        return;
      default:
        findings_.error(route.place,
                        "the route leads nowhere: " + std::string(routing::describe(fault)));
    }
  }

  std::string own_network(const std::string& name) const {
    for (const LineSection& line : lines_) {
      if (line.plan.config.name == name) {
        return std::to_string(line.plan.config.network_id);
      }
    }
    return {};
  }

  std::optional<routing::Route> resolve(const RouteSection& section) {
    const auto networks = parse_networks(section.to.text);
    if (!networks) {
      findings_.error(section.to.place,
                      "expected a network-ID 1..65535 or a range such as 10..19, "
                      "got \"" +
                          section.to.text + "\"");
    }
    if (section.way) {
      const routing::Interface* const way = find_interface(*section.way);
      return networks && way != nullptr
                 ? std::optional(routing::Route{networks->first, networks->second, way->number, 0,
                                                section.cost})
                 : std::nullopt;
    }
    const auto line = find_line(section.line, section.via_place);
    if (!networks || !line) {
      return std::nullopt;
    }
    if (!routes(lines_[*line])) {
      findings_.error(section.via_place,
                      "line \"" + section.line + "\" is no manager: nothing is routed over it");
      return std::nullopt;
    }
    if (section.gateway != 0 && lines_[*line].plan.config.canopen_fd) {
      findings_.error(section.via_place,
                      "line \"" + section.line +
                          "\" is one of CANopen FD, which has no network indication: no next "
                          "gateway is reached over it");
      return std::nullopt;
    }
    return routing::Route{networks->first, networks->second, interface_of(lines_[*line]),
                          section.gateway, section.cost};
  }

  std::optional<std::size_t> find_line(const std::string& name, Place place) {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      names.push_back(lines_[i].plan.config.name);
      if (names.back() == name) {
        return i;
      }
    }
    const std::string guess = nearest(name, names);
    findings_.error(place, "there is no line \"" + name + "\"" +
                               (guess.empty() ? "" : "; did you mean \"" + guess + "\"?"));
    return std::nullopt;
  }

  void apply_routing(std::size_t i) {
    LineSection& line = lines_[i];
    if (!routes(line)) {
      if (!line.enter.empty()) {
        findings_.error(line.enter_place,
                        "only a manager's line can be entered from other networks");
      }
      if (!line.emcy_to.empty()) {
        findings_.error(line.emcy_place, "only a manager's line forwards EMCYs to other networks");
      }
      if (!line.gateways.empty()) {
        findings_.error(line.gateways_place, "only a manager's line has gateways");
      }
      return;
    }
    routing::Config& config = line.plan.config.routing;
    config = section_.common;
    config.interface = interface_of(line);
    config.interfaces = interfaces_;
    config.routes = routes_;
    for (const EnterSection& rule : line.enter) {
      for (const WrittenNetworks& from : rule.from) {
        if (const auto networks = from_networks(from)) {
          config.access.push_back({networks->first, networks->second, rule.sdo,
                                   rule.sdo && rule.write, rule.emcy, rule.pdo});
        }
      }
    }
    config.process_reads = line.plan.commands != Access::off;
    config.process_writes = line.plan.commands == Access::all;
    config.gateways = line.gateways;
    config.emcy_networks.fill(emcy_networks(line));
    line.plan.remote_emcys = remote_emcys(config);
    line.plan.source += own_text(config);
    line.plan.routes = routes_text(line.plan);
  }

  // Those that the line permits (`enter`).
  std::vector<RemoteEmcys> remote_emcys(const routing::Config& config) const {
    std::vector<RemoteEmcys> out;
    for (const RouteSection& section : section_.routes) {
      const auto networks = parse_networks(section.to.text);
      const routing::Interface* const way =
          section.emcy && section.way ? find_interface(*section.way) : nullptr;
      const bool is_permitted =
          networks && std::ranges::any_of(config.access, [&](const routing::AccessRule& rule) {
            return rule.emcy && rule.first <= networks->second && networks->first <= rule.last;
          });
      if (way != nullptr && is_permitted) {
        out.push_back({section.way->to, networks->first, networks->second, way->number});
      }
    }
    return out;
  }

  // EMCYs that no line sends are a mistake.
  void check_emcys() {
    for (const RouteSection& section : section_.routes) {
      const bool is_used = std::ranges::any_of(lines_, [&](const LineSection& line) {
        return std::ranges::any_of(line.plan.remote_emcys, [&](const RemoteEmcys& each) {
          const auto networks = parse_networks(section.to.text);
          return networks && section.way && each.from == section.way->to &&
                 each.first == networks->first;
        });
      });
      if (section.emcy && !is_used) {
        findings_.error(section.place, "no line accepts EMCYs of network " + section.to.text +
                                           ": a line that shall send them needs enter: [{from: " +
                                           section.to.text + ", services: [emcy]}]");
      }
    }
  }

  // Bits of 1F2Fh. `all` and ranges exclude the line's own network.
  std::uint32_t emcy_networks(const LineSection& line) {
    std::uint32_t bits = 0;
    const routing::Table table(routes_);
    for (const WrittenNetworks& to : line.emcy_to) {
      const bool all = to.text == "all";
      const auto networks = all ? Range{1, kHighestEmcyNetwork} : from_networks(to);
      if (!networks) {
        continue;
      }
      if (networks->second > kHighestEmcyNetwork) {
        findings_.error(to.place, "EMCYs are forwarded to the networks 1..32 (object 1F2Fh)");
        continue;
      }
      for (std::uint32_t n = networks->first; n <= networks->second; ++n) {
        const auto network = static_cast<std::uint16_t>(n);
        const routing::Route* const route = table.find(network, 0);
        const bool is_beyond =
            route != nullptr && routing::find_way(interfaces_, route->interface) != nullptr;
        const bool reached = route != nullptr && !is_beyond;
        if (!reached && !all) {
          findings_.error(to.place, is_beyond ? "network " + std::to_string(n) +
                                                    " is reached over another gateway, to which "
                                                    "EMCYs are not forwarded"
                                              : "no route leads to network " + std::to_string(n));
        }
        bits |= reached && network != line.plan.config.network_id ? 1U << (n - 1) : 0U;
      }
    }
    return bits;
  }

  std::optional<Range> from_networks(const WrittenNetworks& from) {
    if (from.text == "all") {
      return Range{1, kHighestNetwork};
    }
    if (const auto networks = parse_networks(from.text)) {
      return networks;
    }
    if (from.text.find_first_not_of("0123456789.") == std::string::npos) {
      findings_.error(from.place,
                      "expected a network-ID 1..65535 or a range such as 10..19, got "
                      "\"" +
                          from.text + "\"");
      return std::nullopt;
    }
    const auto line = find_line(from.text, from.place);
    if (!line) {
      return std::nullopt;
    }
    const std::uint16_t network = lines_[*line].plan.config.network_id;
    return Range{network, network};
  }

  // For LinePlan::source. Times and other options come from `routing:` as written.
  std::string own_text(const routing::Config& config) const {
    std::string out = "routing " + std::to_string(config.interface) + section_.source;
    for (const routing::AccessRule& rule : config.access) {
      out += '|' + std::to_string(rule.first) + '-' + std::to_string(rule.last);
    }
    for (const std::uint8_t gateway : config.gateways) {
      out += ',' + std::to_string(gateway);
    }
    return out;
  }

  // For LinePlan::routes.
  static std::string routes_text(const LinePlan& plan) {
    const routing::Config& config = plan.config.routing;
    std::set<std::string> parts;
    for (const RemoteEmcys& emcys : plan.remote_emcys) {
      parts.insert("emcy " + emcys.from.gateway + '/' + emcys.from.line + ' ' +
                   std::to_string(emcys.first) + ' ' + std::to_string(emcys.last));
    }
    for (const routing::Interface& line : config.interfaces) {
      parts.insert(std::to_string(line.number) + ':' + std::to_string(line.network) + ':' +
                   std::to_string(line.node) + ':' + line.name +
                   (line.way == nullptr
                        ? ""
                        : ':' + line.way->enter + ':' + std::to_string(line.way->timeout.count())));
    }
    for (const routing::Route& route : config.routes) {
      parts.insert(std::to_string(routing::encode(route)));
    }
    std::string out = std::to_string(config.emcy_networks[1]);
    for (const std::string& part : parts) {
      out += ',' + part;
    }
    return out;
  }

  Findings& findings_;
  const RoutingSection& section_;
  const Plant& plant_;
  std::vector<LineSection>& lines_;
  std::vector<routing::Interface> interfaces_;
  std::vector<routing::Route> routes_;
};

void read_definitions(Section& section, routing::Config& config) {
  // One choice each so far; other vendors' definitions can be added.
  section.read_choice<routing::Definition>("network_indication", config.network_indication,
                                           {{"own", routing::Definition::own}});
  section.read_choice<routing::Definition>("routing_table", config.routing_table,
                                           {{"own", routing::Definition::own}});
  section.read_choice<routing::Definition>("forwarded_emcy", config.forwarded_emcy,
                                           {{"own", routing::Definition::own}});
}

}  // namespace

std::vector<EnterSection> read_enter(Findings& findings, const YAML::Node& node) {
  std::vector<EnterSection> out;
  if (node.IsDefined() && !node.IsSequence()) {
    out.push_back(read_rule(findings, node));
    return out;
  }
  for (const YAML::Node& element : elements(findings, node, "enter")) {
    out.push_back(read_rule(findings, element));
  }
  return out;
}

void read_emcy_routing(Section& section, LineSection& line) {
  const YAML::Node to = section.find("emcy_to");
  line.emcy_place = place_of(to);
  if (to.IsDefined()) {
    read_networks(section.findings(), to, "emcy_to", line.emcy_to);
  }
  const YAML::Node gateways = section.find("gateways");
  line.gateways_place = place_of(gateways);
  for (const YAML::Node& element : gateways.IsDefined()
                                       ? one_or_more(section.findings(), gateways, "gateways")
                                       : std::vector<YAML::Node>{}) {
    const auto node = element.IsScalar() ? parse_unsigned(element.Scalar()) : std::nullopt;
    if (!node || *node < 1 || *node > 127) {
      section.findings().error(place_of(element), "expected a node-ID 1..127");
      continue;
    }
    line.gateways.push_back(static_cast<std::uint8_t>(*node));
  }
}

RoutingSection read_routing(Findings& findings, const YAML::Node& routing,
                            const YAML::Node& routes) {
  RoutingSection out;
  if (routing.IsDefined()) {
    const std::size_t before = findings.errors();
    Section section(findings, routing, "routing");
    read_definitions(section, out.common);
    section.read_choice<routing::ChannelRule>("channels", out.common.channels,
                                              {{"client_1", routing::ChannelRule::client_1},
                                               {"per_node", routing::ChannelRule::per_node}});
    section.read_number("hop_limit", out.common.hop_limit, 1, routing::kMaxHops);
    section.read("arm_timeout", out.common.arm_timeout, std::chrono::milliseconds(1), kLongestWait);
    section.read("frame_timeout", out.common.frame_timeout, std::chrono::milliseconds(1),
                 kLongestWait);
    section.read("gateway_timeout", out.common.gateway_timeout, std::chrono::milliseconds(1),
                 kLongestWait);
    section.read("channel_wait", out.common.channel_wait, std::chrono::milliseconds(1),
                 kLongestWait);
    section.read_number("additional_servers", out.common.additional_servers, 0, 127);
    section.done();
    out.source = findings.errors() == before ? canonical(routing) : std::string();
  }
  for (const YAML::Node& element : elements(findings, routes, "routes")) {
    RouteSection route{.cost = kUsualCost};
    const std::size_t before = findings.errors();
    Section section(findings, element, "a route");
    route.place = section.place();
    const YAML::Node to = section.require("to");
    route.to.place = place_of(to);
    const auto networks = section.text(to);
    const YAML::Node via = section.require("via");
    route.via_place = place_of(via);
    read_via(section, via, route);
    section.read_number("cost", route.cost, 1, 0xFFFF);
    section.done();
    if (networks && findings.errors() == before) {
      route.to.text = *networks;
      out.routes.push_back(std::move(route));
    }
  }
  return out;
}

void resolve_routing(Findings& findings, const RoutingSection& routing, const Plant& plant,
                     std::vector<LineSection>& lines) {
  RoutingResolver(findings, routing, plant, lines).run();
}

}  // namespace linegate::config
