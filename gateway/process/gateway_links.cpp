// SPDX-License-Identifier: Apache-2.0
// Connections between the lines of a gateway: outputs that follow inputs, and routes.
#include <algorithm>
#include <map>
#include <utility>

#include "gateway/process/gateway.h"
#include "gateway/runtime/clock.h"

namespace linegate::gateway {

void Gateway::link_lines(const config::Plant& plant, const std::vector<NewLine>& lines,
                         const std::vector<std::unique_ptr<LineHost>>& stay) {
  const auto new_line = [&](const std::string& name) {
    const auto made = std::find_if(lines.begin(), lines.end(),
                                   [&](const NewLine& line) { return line.host->name() == name; });
    return made == lines.end() ? nullptr : made->host.get();
  };
  const auto find = [&](const std::string& name) {
    LineHost* const made = new_line(name);
    const auto there = std::find_if(stay.begin(), stay.end(), [&](const auto& host) {
      return host != nullptr && host->name() == name;
    });
    return made != nullptr || there == stay.end() ? made : there->get();
  };
  std::map<std::pair<std::string, std::string>, std::vector<config::Binding>> pairs;
  for (const config::Binding& binding : plant.bindings) {
    pairs[{binding.from, binding.to}].push_back(binding);
  }
  for (auto& [ends, bindings] : pairs) {
    const LineHost* const source = find(ends.first);
    const LineHost* const target = find(ends.second);
    const bool is_new = new_line(ends.first) != nullptr || new_line(ends.second) != nullptr;
    if (is_new && source != nullptr && target != nullptr) {
      links_.push_back(std::make_unique<BoundLink>(std::move(bindings)));
      const bool together = source->executor == target->executor;
      links_.back()->taker = together ? nullptr : &target->executor->values_wakeup();
      // For a new line: see make_runner()
      links_.back()->runner = together ? target->runner : nullptr;
    }
  }
}

void Gateway::bind_ends(const std::vector<const BoundLink*>& known,
                        const std::vector<LineHost*>& started) {
  for (const auto& link : links_) {
    if (std::find(known.begin(), known.end(), link.get()) != known.end()) {
      continue;
    }
    for (const auto& host : hosts_) {
      const config::Binding& first = link->bindings.front();
      if (std::find(started.begin(), started.end(), host.get()) != started.end()) {
        continue;
      }
      LineRunner* const runner = host->runner;
      if (first.from == host->name()) {
        host->executor->visit([&] { runner->bind(BoundSource(*link)); });
      }
      if (first.to == host->name()) {
        host->executor->visit([&] { runner->bind(BoundTarget(*link)); });
      }
    }
  }
}

void Gateway::unbind_ends(const std::vector<std::string>& go, bool stopped) {
  const auto goes = [&](const std::string& name) {
    return std::find(go.begin(), go.end(), name) != go.end();
  };
  for (const auto& link : links_) {
    const config::Binding& first = link->bindings.front();
    const std::string& stays = stopped ? first.to : first.from;
    const std::string& other = stopped ? first.from : first.to;
    if (goes(other) && !goes(stays)) {
      const LineHost& kept = host(stays);
      kept.executor->visit([&] { kept.runner->unbind(*link, monotonic_now()); });
    }
  }
}

void Gateway::set_routes(const std::vector<std::string>& names, const config::Plant& wanted) {
  for (const std::string& name : names) {
    LineHost& kept = host(name);
    const auto plan =
        std::find_if(wanted.lines.begin(), wanted.lines.end(),
                     [&](const config::LinePlan& line) { return line.config.name == name; });
    const routing::Config& routing = plan->config.routing;
    kept.plan.config.routing.interfaces = routing.interfaces;
    kept.plan.config.routing.routes = routing.routes;
    kept.plan.config.routing.emcy_networks = routing.emcy_networks;
    kept.plan.remote_emcys = plan->remote_emcys;
    kept.executor->visit([&] { kept.runner->set_routes(routing, monotonic_now()); });
  }
}

void Gateway::join_routes(const std::vector<LineHost*>& started) {
  for (std::size_t i = 0; i < hosts_.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      LineHost& one = *hosts_[i];
      LineHost& other = *hosts_[k];
      const bool joined = std::find(started.begin(), started.end(), &one) == started.end() &&
                          std::find(started.begin(), started.end(), &other) == started.end();
      if (!joined && one.interface() != 0 && other.interface() != 0) {
        add_route_link(one, other);
        add_route_link(other, one);
      }
    }
  }
}

void Gateway::add_route_link(LineHost& from, LineHost& to) {
  RouteLink& link =
      *route_links_.emplace_back(std::make_unique<RouteLink>(from.interface(), to.interface()));
  link.taker = from.executor == to.executor ? nullptr : &to.executor->wakeup();
  from.executor->visit([&] { from.runner->routes()->add_out(link); });
  to.executor->visit([&] { to.runner->routes()->add_in(link); });
}

void Gateway::leave_routes(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    const std::uint8_t gone = host(name).interface();
    if (gone == 0) {
      continue;
    }
    for (const auto& other : hosts_) {
      const bool goes = std::find(names.begin(), names.end(), other->name()) != names.end();
      if (!goes && other->interface() != 0) {
        other->executor->visit([&] { other->runner->leave(gone, monotonic_now()); });
      }
    }
    std::erase_if(route_links_,
                  [&](const auto& link) { return link->from == gone || link->to == gone; });
  }
}

}  // namespace linegate::gateway
