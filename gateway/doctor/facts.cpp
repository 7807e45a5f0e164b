// SPDX-License-Identifier: Apache-2.0
#include "gateway/doctor/facts.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <set>

#include <fnmatch.h>

namespace linegate::doctor {

std::string gateway_name(std::string_view participant) {
  constexpr std::string_view kGateway = "linegate ";
  if (!participant.starts_with(kGateway))
    return {};
  const std::string_view name = participant.substr(kGateway.size());
  return name.find_first_of(" /,") == std::string_view::npos ? std::string(name) : std::string();
}

std::vector<const Heard*> gateways_in_domain(const Observations& seen) {
  std::vector<const Heard*> out;
  for (const Heard& heard : seen.heard) {
    if (heard.domain == seen.domain && !heard.left &&
        !gateway_name(heard.announcement.name).empty())
      out.push_back(&heard);
  }
  return out;
}

bool has_gateway(const Observations& seen) {
  return !gateways_in_domain(seen).empty() || !seen.received.empty() ||
         std::ranges::any_of(seen.participants, [](const dds::ObservedParticipant& it) {
           return !gateway_name(it.name).empty();
         });
}

bool has_only_local_gateways(const Observations& seen) {
  const auto is_local = [&](const Heard* gateway) {
    return gateway->from.starts_with("127.") ||
           std::ranges::any_of(seen.interfaces, [&](const Interface& it) {
             return std::ranges::count(it.addresses, gateway->from) != 0;
           });
  };
  const auto gateways = gateways_in_domain(seen);
  return !gateways.empty() && std::ranges::all_of(gateways, is_local);
}

bool is_received(const Observations& seen, std::string_view gateway) {
  return std::ranges::any_of(seen.received,
                             [&](const ReceivedGateway& it) { return it.name == gateway; });
}

dds::ObservedPrefix prefix_of(const dds::ObservedEndpoint& endpoint) {
  dds::ObservedPrefix out{};
  std::copy_n(endpoint.guid.begin(), out.size(), out.begin());
  return out;
}

bool has_endpoints(const Observations& seen, const dds::ObservedPrefix& prefix) {
  return std::ranges::any_of(seen.endpoints, [&](const dds::ObservedEndpoint& it) {
    return !it.own && prefix_of(it) == prefix;
  });
}

namespace {

const dds::ObservedParticipant* owner_of(const Observations& seen,
                                         const dds::ObservedEndpoint& endpoint) {
  const auto found =
      std::ranges::find(seen.participants, prefix_of(endpoint), &dds::ObservedParticipant::prefix);
  return found == seen.participants.end() ? nullptr : &*found;
}

}  // namespace

std::vector<bool> of_gateways(const Observations& seen) {
  std::set<dds::ObservedPrefix> gateways;
  for (const dds::ObservedParticipant& it : seen.participants) {
    if (!gateway_name(it.name).empty())
      gateways.insert(it.prefix);
  }
  std::vector<bool> out;
  for (const dds::ObservedEndpoint& it : seen.endpoints)
    out.push_back(!it.own && gateways.contains(prefix_of(it)));
  return out;
}

std::string owner_text(const Observations& seen, const dds::ObservedEndpoint& endpoint) {
  if (endpoint.own)
    return "this program";
  const dds::ObservedParticipant* const owner = owner_of(seen, endpoint);
  if (owner == nullptr)
    return "an unknown participant";
  const std::string gateway = gateway_name(owner->name);
  if (!gateway.empty())
    return "gateway '" + safe(gateway) + "'";
  return "program '" + safe(owner->name) + "'" +
         (owner->host.empty() ? "" : " on host " + safe(owner->host));
}

std::string seconds_text(Duration time) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f s", std::chrono::duration<double>(time).count());
  return text;
}

std::string heard_text(const Heard& heard) {
  return "gateway '" + safe(gateway_name(heard.announcement.name)) + "' from " + heard.from + " (" +
         std::to_string(heard.count) + (heard.count == 1 ? " announcement)" : " announcements)");
}

std::string safe(std::string_view text) {
  constexpr std::size_t kLongest = 256;
  std::string out(text.substr(0, kLongest));
  std::ranges::replace_if(
      out, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F || c == '\''; },
      '?');
  // Control characters of UTF-8: U+0080 to U+009F.
  for (std::size_t at = 0; at + 1 < out.size(); ++at) {
    const auto next = static_cast<unsigned char>(out[at + 1]);
    if (out[at] == '\xC2' && next >= 0x80 && next <= 0x9F)
      out[at] = out[at + 1] = '?';
  }
  return out;
}

bool partitions_fit(const std::vector<std::string>& one, const std::vector<std::string>& other) {
  const std::vector<std::string> standard{""};
  for (const std::string& a : one.empty() ? standard : one) {
    for (const std::string& b : other.empty() ? standard : other) {
      if (a == b || ::fnmatch(a.c_str(), b.c_str(), 0) == 0 ||
          ::fnmatch(b.c_str(), a.c_str(), 0) == 0)
        return true;
    }
  }
  return false;
}

std::string partitions_text(const std::vector<std::string>& names) {
  if (names.empty())
    return "the default partition";
  std::string out;
  for (const std::string& name : names) {
    out += out.empty() ? "" : ", ";
    out += name.empty() ? "the default partition" : "'" + safe(name) + "'";
  }
  return out;
}

}  // namespace linegate::doctor
