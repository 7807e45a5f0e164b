// SPDX-License-Identifier: Apache-2.0
// The file of QoS profiles: what makes it unusable or dangerous, and interfaces that do not exist.
#include <algorithm>

#include "gateway/doctor/checks.h"
#include "gateway/doctor/facts.h"

namespace linegate::doctor {
namespace {

bool is_of_this_host(const Observations& seen, const std::string& name) {
  return name.starts_with("127.") ||
         std::ranges::any_of(seen.interfaces, [&](const Interface& interface) {
           return interface.name == name || std::ranges::count(interface.addresses, name) != 0;
         });
}

bool is_ipv4(const std::string& text) {
  return text.find_first_not_of("0123456789.") == std::string::npos;
}

}  // namespace

void check_profile(const Observations& seen, Findings& found) {
  Finding profile{
      .cause = "profile",
      .seen = {},
      .means = "programs with this file of QoS profiles have no or a dangerous connection",
      .advice =
          "correct the lines that are named; deploy/dds/linegate-profiles.xml is the original"};
  for (const Diagnostic& diagnostic : seen.profile_findings)
    profile.seen.push_back(to_string(diagnostic));
  if (!profile.seen.empty())
    found.push_back(std::move(profile));
  const bool any = std::ranges::any_of(seen.network.white_list, [&](const std::string& it) {
    return !is_ipv4(it) || is_of_this_host(seen, it);
  });
  if (seen.network.white_list.empty() || any)
    return;
  Finding list{.cause = "no-listed-interface",
               .seen = {},
               .means = "DDS uses none of the interfaces of this host, so it sees no other program",
               .advice = "list an address of this host in interfaceWhiteList of " + seen.profile +
                         ", or leave the list out"};
  for (const std::string& name : seen.network.white_list)
    list.seen.push_back("interfaceWhiteList of " + seen.profile + " has " + safe(name) +
                        ", which is no address of this host");
  found.push_back(std::move(list));
}

}  // namespace linegate::doctor
