// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/routes.h"

#include <algorithm>
#include <array>
#include <map>
#include <sstream>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include "bridges/console/lookup.h"
#include "bridges/console/one_line.h"
#include "bridges/console/tables.h"

namespace linegate::console {
namespace {

constexpr std::string_view kRoutes = "routes-";
constexpr std::string_view kRouting = "routing-";
constexpr std::array<std::string_view, 9> kCounts{
    "open",    "opened",        "finished", "aborted",   "timed-out",
    "refused", "not-permitted", "channels", "forwarded",
};

std::string value_of(const LineView& view, std::string_view name) {
  const auto found = std::ranges::find_if(
      view.properties, [&](const auto& property) { return property.first == name; });
  return found == view.properties.end() ? std::string() : found->second;
}

std::optional<std::uint16_t> network(const std::string& text) {
  const auto number = parse_number(text, 0xFFFF, false);
  return number ? std::optional(static_cast<std::uint16_t>(*number)) : std::nullopt;
}

// "10..19 hall:5 10".
std::optional<KnownRoute> parse_route(const std::string& text) {
  std::istringstream in(text);
  std::string networks;
  std::string via;
  std::string cost;
  in >> networks >> via >> cost;
  const std::size_t dots = networks.find("..");
  const auto first = network(networks.substr(0, dots));
  const auto last = dots == std::string::npos ? first : network(networks.substr(dots + 2));
  const std::size_t colon = via.find(':');
  const auto next = colon == std::string::npos ? std::optional<std::uint64_t>(0)
                                               : parse_number(via.substr(colon + 1), 127, false);
  const auto price = network(cost);
  if (!first || !last || !next || !price || via.empty()) {
    return std::nullopt;
  }
  return KnownRoute{.first = *first,
                    .last = *last,
                    .line = via.substr(0, colon),
                    .next = static_cast<std::uint8_t>(*next),
                    .cost = *price};
}

std::string networks_text(const KnownRoute& route) {
  const std::string first = std::to_string(route.first);
  return route.first == route.last ? first : first + ".." + std::to_string(route.last);
}

bool same_way(const KnownRoute& a, const KnownRoute& b) {
  return a.gateway == b.gateway && a.first == b.first && a.last == b.last && a.line == b.line &&
         a.next == b.next && a.cost == b.cost;
}

std::string known_to_text(const KnownRoute& route) {
  if (route.known_to_all) {
    return "all";
  }
  std::string out;
  for (const std::string& line : route.known_to) {
    out += (out.empty() ? "" : ", ") + printable(line);
  }
  return out;
}

Cell count_cell(const LineView& view, std::string_view name) {
  const auto number = routing_count(view, name);
  return number ? Cell{std::to_string(*number), static_cast<double>(*number)} : Cell{"-", {}};
}

bool routes(const Line& line) {
  return line.view && !value_of(*line.view, "routing-open").empty();
}

}  // namespace

std::optional<std::uint64_t> routing_count(const LineView& view, std::string_view name) {
  return parse_number(value_of(view, std::string(kRouting) + std::string(name)), ~std::uint64_t{0},
                      false);
}

std::vector<KnownRoute> routes_of(const LineId& id, const LineView& view) {
  std::vector<KnownRoute> out;
  for (const auto& [name, value] : view.properties) {
    if (!name.starts_with(kRoutes)) {
      continue;
    }
    std::istringstream in(value);
    for (std::string one; std::getline(in, one, ',');) {
      if (auto route = parse_route(one)) {
        route->gateway = id.gateway;
        route->known_to = {id.line};
        out.push_back(*std::move(route));
      }
    }
  }
  return out;
}

std::vector<KnownRoute> routes_of(const Model& model) {
  std::vector<KnownRoute> out;
  std::map<std::string, std::size_t> routing_lines;  // by gateway
  for (const auto& [id, line] : model.lines()) {
    if (line.gone || !line.view) {
      continue;
    }
    routing_lines[id.gateway] += routes(line) ? 1U : 0U;
    for (KnownRoute& route : routes_of(id, *line.view)) {
      const auto known = std::ranges::find_if(
          out, [&](const KnownRoute& other) { return same_way(route, other); });
      if (known == out.end()) {
        out.push_back(std::move(route));
      } else {
        known->known_to.push_back(id.line);
      }
    }
  }
  for (KnownRoute& route : out) {
    route.known_to_all = route.known_to.size() >= routing_lines[route.gateway];
  }
  return out;
}

std::vector<const Line*> find_ways(const Model& model, std::uint16_t wanted,
                                   const std::string& gateway) {
  struct Way {
    const Line* line = nullptr;
    std::uint32_t cost = ~std::uint32_t{0};
  };
  std::map<std::string, Way> best;
  for (const KnownRoute& route : routes_of(model)) {
    const bool meant = gateway.empty() || route.gateway == gateway;
    if (!meant || wanted < route.first || wanted > route.last ||
        route.cost >= best[route.gateway].cost) {
      continue;
    }
    const bool over_itself = std::ranges::find(route.known_to, route.line) != route.known_to.end();
    const auto line =
        model.lines().find({route.gateway, over_itself ? route.line : route.known_to.front()});
    if (line != model.lines().end() && line->second.view) {
      best[route.gateway] = {&line->second, route.cost};
    }
  }
  std::vector<const Line*> out;
  for (const auto& [name, way] : best) {
    if (way.line != nullptr) {
      out.push_back(way.line);
    }
  }
  return out;
}

Table routes_table(const Model& model) {
  Table out{
      {{"NETWORKS"}, {"LINE"}, {"NEXT", true}, {"COST", true}, {"FROM"}, {"GATEWAY"}}, {}, {}};
  for (const KnownRoute& route : routes_of(model)) {
    const LineId id{route.gateway, route.line};
    out.rows.push_back({{id},
                        {{networks_text(route), route.first},
                         {printable(route.line), {}},
                         {route.next == 0 ? "-" : std::to_string(route.next), route.next},
                         {std::to_string(route.cost), route.cost},
                         {known_to_text(route), {}},
                         {printable(route.gateway), {}}}});
  }
  return out;
}

Table routing_table(const Model& model) {
  Table out{{{"LINE"},
             {"NETWORK", true},
             {"OPEN", true},
             {"OPENED", true},
             {"FINISHED", true},
             {"ABORTED", true},
             {"TIMED OUT", true},
             {"REFUSED", true},
             {"NOT PERMITTED", true},
             {"CHANNELS", true},
             {"FORWARDED", true},
             {"GATEWAY"}},
            {},
            {}};
  for (const auto& [id, line] : model.lines()) {
    if (!routes(line)) {
      continue;
    }
    const std::uint16_t own = line.view->state.network_id;
    Row row{{id}, {{printable(id.line), {}}, {std::to_string(own), own}}, style_of(model, line)};
    for (const std::string_view name : kCounts) {
      row.cells.push_back(count_cell(*line.view, name));
    }
    row.cells.push_back({printable(id.gateway), {}});
    out.rows.push_back(std::move(row));
  }
  return out;
}

std::string routes_json(const Model& model) {
  nlohmann::ordered_json routes_list = nlohmann::ordered_json::array();
  for (const KnownRoute& route : routes_of(model)) {
    routes_list.push_back({{"gateway", route.gateway},
                           {"first", route.first},
                           {"last", route.last},
                           {"line", route.line},
                           {"node", route.next},
                           {"cost", route.cost}});
    if (!route.known_to_all) {
      routes_list.back()["known_to"] = route.known_to;
    }
  }
  nlohmann::ordered_json lines_list = nlohmann::ordered_json::array();
  for (const auto& [id, line] : model.lines()) {
    if (!routes(line)) {
      continue;
    }
    nlohmann::ordered_json one{
        {"gateway", id.gateway}, {"line", id.line}, {"network_id", line.view->state.network_id}};
    for (const auto& [name, value] : line.view->properties) {
      const auto number = parse_number(value, ~std::uint64_t{0}, false);
      if (name.starts_with(kRouting) && number) {
        std::string key = name.substr(kRouting.size());
        std::ranges::replace(key, '-', '_');
        one[key] = *number;
      }
    }
    lines_list.push_back(std::move(one));
  }
  return one_line(nlohmann::ordered_json{{"routes", routes_list}, {"lines", lines_list}});
}

}  // namespace linegate::console
