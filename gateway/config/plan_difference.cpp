// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/plan_difference.h"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

#include "gateway/config/value.h"

namespace linegate::config {
namespace {

template <class Lines>
auto find(const Lines& lines, std::string_view name) {
  return std::find_if(lines.begin(), lines.end(),
                      [&](const auto& line) { return line.name == name; });
}

void refuse(PlanDifference& out, const std::string& file, std::string_view what,
            std::string_view from, std::string_view to) {
  if (from != to) {
    out.refusals.push_back({Severity::error, file, 0, 0,
                            fmt::format("{} changes from \"{}\" to \"{}\", which needs a new start "
                                        "of the gateway",
                                        what, from, to)});
  }
}

std::string text_of(const std::optional<Journal>& journal) {
  return journal ? fmt::format("{}, {} bytes, {} bytes of values, {}", journal->file,
                               journal->max_size, journal->values_size,
                               journal->max_age == Duration::zero() ? std::string("any age")
                                                                    : format_age(journal->max_age))
                 : std::string("none");
}

std::string names(const std::vector<std::string>& lines) {
  return lines.empty() ? "none" : fmt::format("{}", fmt::join(lines, ", "));
}

}  // namespace

PlantIdentity identity_of(const Plant& plant, std::uint32_t profile_participants) {
  PlantIdentity out{plant.gateway,
                    plant.dds_domain,
                    plant.dds_profile,
                    plant.dds_participants != 0 ? plant.dds_participants : profile_participants,
                    profile_participants,
                    plant.dds_interfaces,
                    plant.dds_peers,
                    plant.dds_servers,
                    plant.dds_multicast,
                    plant.dds_guard,
                    plant.dds_partitions,
                    plant.journal,
                    plant.dds_own_process,
                    plant.dds_memory,
                    plant.dds_security,
                    plant.dds_routes_security,
                    {}};
  for (const auto& line : plant.lines) {
    out.lines.push_back({line.config.name, line.source, line.routes});
  }
  return out;
}

PlanDifference difference(const PlantIdentity& running, const Plant& wanted) {
  PlanDifference out;
  const PlantIdentity next = identity_of(wanted, running.dds_profile_participants);
  refuse(out, wanted.file, "the name of the gateway", running.gateway, next.gateway);
  refuse(out, wanted.file, "the DDS domain", std::to_string(running.dds_domain),
         std::to_string(next.dds_domain));
  refuse(out, wanted.file, "the DDS profile", running.dds_profile, next.dds_profile);
  refuse(out, wanted.file, "the number of DDS participants",
         std::to_string(running.dds_participants), std::to_string(next.dds_participants));
  refuse(out, wanted.file, "the interfaces of DDS", names(running.dds_interfaces),
         names(next.dds_interfaces));
  refuse(out, wanted.file, "the peers of DDS", names(running.dds_peers), names(next.dds_peers));
  refuse(out, wanted.file, "the discovery servers of DDS", names(running.dds_servers),
         names(next.dds_servers));
  refuse(out, wanted.file, "the fan-out of images", running.dds_multicast ? "multicast" : "unicast",
         next.dds_multicast ? "multicast" : "unicast");
  refuse(out, wanted.file, "the DDS guard", running.dds_guard ? "on" : "off",
         next.dds_guard ? "on" : "off");
  refuse(out, wanted.file, "the use of partitions", running.dds_partitions ? "on" : "off",
         next.dds_partitions ? "on" : "off");
  refuse(out, wanted.file, "the journal", text_of(running.journal), text_of(next.journal));
  refuse(out, wanted.file, "the process of DDS", running.dds_own_process ? "own" : "same",
         next.dds_own_process ? "own" : "same");
  refuse(out, wanted.file, "the memory of the DDS process", format_size(running.dds_memory),
         format_size(next.dds_memory));
  refuse(out, wanted.file, "the folder of DDS-Security", running.dds_security, next.dds_security);
  refuse(out, wanted.file, "the identity of the routes", running.dds_routes_security,
         next.dds_routes_security);
  for (const auto& line : next.lines) {
    const auto before = find(running.lines, line.name);
    auto& list = before == running.lines.end()   ? out.started
                 : before->source == line.source ? out.unchanged
                                                 : out.changed;
    list.push_back(line.name);
    if (&list == &out.unchanged && before->routes != line.routes) {
      out.rerouted.push_back(line.name);
    }
  }
  for (const auto& line : running.lines) {
    if (find(next.lines, line.name) == next.lines.end()) {
      out.stopped.push_back(line.name);
    }
  }
  return out;
}

std::string describe(const PlanDifference& difference) {
  return fmt::format(
      "lines changed: {}; started: {}; stopped: {}; unchanged: {}{}", names(difference.changed),
      names(difference.started), names(difference.stopped), difference.unchanged.size(),
      difference.rerouted.empty() ? ""
                                  : fmt::format("; other routes: {}", names(difference.rerouted)));
}

}  // namespace linegate::config
