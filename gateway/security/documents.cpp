// SPDX-License-Identifier: Apache-2.0
#include "gateway/security/documents.h"

#include <algorithm>
#include <array>

namespace linegate::security {
namespace {

constexpr std::array<std::string_view, 4> kRoleNames{"gateway", "viewer", "operator", "engineer"};
// DDSI-RTPS 9.6.1.1: greater domain numbers have no ports
constexpr std::string_view kDomains =
    "<domains><id_range><min>0</min><max>232</max></id_range></domains>\n";
// Fast DDS 2.9.1 compares the expressions of topics with fnmatch(3) without flags for paths: a `*`
// also matches slashes. Of named topics (bridges/named), those that a gateway publishes end with
// "/inputs" or "/outputs", and those that clients write with "/outputs/set".
constexpr std::array<std::string_view, 11> kPublished{
    "linegate/v1/GatewayState", "linegate/v1/LineState",    "linegate/v1/NodeState",
    "linegate/v1/OutputState",  "linegate/v1/ImageLayout",  "linegate/v1/ProcessImage",
    "linegate/v1/PdoUpdate",    "linegate/v1/PdoReception", "linegate/v1/Event",
    "plant/*/inputs",           "plant/*/outputs"};
constexpr std::array<std::string_view, 1> kReplies{"linegate/v1/CommandReply"};

// The topics of requests to these lines: "GATEWAY/LINE" each, as Holder::lines.
std::vector<std::string> requests_to(const std::vector<std::string>& lines) {
  std::vector<std::string> out{"linegate/v1/OutputWrite", "linegate/v1/CommandRequest"};
  for (const std::string& line : lines) {
    const std::string name = line.substr(line.rfind('/') + 1);
    if (!name.empty())
      out.push_back("plant/" + name + "/*/outputs/set");
  }
  return out;
}

template <class Names>
std::string elements(std::string_view element, const Names& names) {
  std::string out;
  for (const std::string_view name : names) {
    out +=
        "<" + std::string(element) + ">" + std::string(name) + "</" + std::string(element) + ">\n";
  }
  return out;
}

// One rule with all partitions: of several rules that name a topic, Fast DDS 2.9.1 uses the first.
// Without partitions: the default partition alone.
template <class Topics>
std::string rule(std::string_view action, const Topics& topics,
                 const std::vector<std::string>& partitions = {}) {
  std::string out =
      "<" + std::string(action) + "><topics>\n" + elements("topic", topics) + "</topics>\n";
  if (!partitions.empty())
    out += "<partitions>\n" + elements("partition", partitions) + "</partitions>\n";
  return out + "</" + std::string(action) + ">\n";
}

// The rules of a role: the only place that defines them.
std::string rules(const Holder& holder) {
  switch (holder.role) {
    case Role::gateway:
      return rule("publish", kPublished) +
             rule("publish", kReplies, {requests_of_gateway(holder.name)}) +
             rule("subscribe", requests_to({"*/*"}), {requests_of_gateway(holder.name)}) +
             rule("subscribe", kPublished);  // `forward:` from other gateways
    case Role::viewer:
      break;
    case Role::operator_:
    case Role::engineer: {
      std::vector<std::string> partitions;
      for (const std::string& line : holder.lines)
        partitions.push_back(line + "/" + std::string(name(holder.role)) + "/" + holder.name);
      return rule("publish", requests_to(holder.lines), partitions) +
             rule("subscribe", kPublished) +
             rule("subscribe", kReplies,
                  {"*/*/" + std::string(name(holder.role)) + "/" + holder.name});
    }
  }
  return rule("subscribe", kPublished);
}

}  // namespace

std::string_view name(Role role) {
  return kRoleNames.at(static_cast<std::size_t>(role));
}

std::optional<Role> parse_role(std::string_view text) {
  const auto found = std::find(kRoleNames.begin(), kRoleNames.end(), text);
  if (found == kRoleNames.end())
    return std::nullopt;
  return static_cast<Role>(found - kRoleNames.begin());
}

std::string requests_of_gateway(std::string_view gateway) {
  return std::string(gateway) + "/*";
}

std::string governance() {
  return R"(<?xml version="1.0" encoding="UTF-8"?>
<dds><domain_access_rules><domain_rule>
)" + std::string(kDomains) +
         R"(<allow_unauthenticated_participants>false</allow_unauthenticated_participants>
<enable_join_access_control>true</enable_join_access_control>
<discovery_protection_kind>ENCRYPT</discovery_protection_kind>
<liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
<rtps_protection_kind>ENCRYPT</rtps_protection_kind>
<topic_access_rules><topic_rule>
<topic_expression>*</topic_expression>
<enable_discovery_protection>true</enable_discovery_protection>
<enable_liveliness_protection>true</enable_liveliness_protection>
<enable_read_access_control>true</enable_read_access_control>
<enable_write_access_control>true</enable_write_access_control>
<metadata_protection_kind>ENCRYPT</metadata_protection_kind>
<data_protection_kind>ENCRYPT</data_protection_kind>
</topic_rule></topic_access_rules>
</domain_rule></domain_access_rules></dds>
)";
}

std::string permissions(const Holder& holder, const std::string& subject,
                        const std::string& not_before, const std::string& not_after) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<dds><permissions><grant name=\"" +
         std::string(name(holder.role)) + "\">\n<subject_name>" + subject +
         "</subject_name>\n<validity><not_before>" + not_before + "</not_before><not_after>" +
         not_after + "</not_after></validity>\n<allow_rule>\n" + std::string(kDomains) +
         rules(holder) + "</allow_rule>\n<default>DENY</default>\n</grant></permissions></dds>\n";
}

}  // namespace linegate::security
