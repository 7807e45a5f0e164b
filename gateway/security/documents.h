// SPDX-License-Identifier: Apache-2.0
// The texts of the governance and permissions documents (DDS-Security 1.1 9.4.1).
//
// Requests (OutputWrite, CommandRequest, and the named topics of groups of outputs,
// plant/LINE/GROUP/outputs/set) have the partition GATEWAY/LINE/RIGHT/NAME, where RIGHT is the role
// of the writer's certificate and NAME its name: each participant of the domain enforces that a
// certificate writes in its own partitions only. The replies (CommandReply) to an identity have the
// partition GATEWAY//RIGHT/NAME: a certificate may read those of its own name only, and a gateway
// may write those that begin with its own name only. Everything else is in the default partition.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace linegate::security {

// The role of a certificate.
enum class Role : std::uint8_t {
  gateway,    // publishes everything that a gateway publishes, receives outputs and commands
  viewer,     // reads what gateways publish
  operator_,  // also writes outputs, and sends commands that read or change the process state
  engineer,   // also sends commands that change configuration, firmware and node-IDs
};
std::string_view name(Role role);
std::optional<Role> parse_role(std::string_view text);

struct Holder {
  std::string name;  // of role gateway: that of the gateway in plant.yaml
  Role role = Role::viewer;
  // Operators and engineers: "GATEWAY/LINE" each, the lines to which they send requests; "*" for
  // all names, "GATEWAY/" for requests to the gateway itself.
  std::vector<std::string> lines{"*/*"};
};

// The partition with a wildcard in which the gateway of that name reads requests.
std::string requests_of_gateway(std::string_view gateway);

// Everything is encrypted, only participants with a certificate join.
std::string governance();

// subject: as subject_of(). The times are UTC, "2026-01-31T00:00:00".
std::string permissions(const Holder& holder, const std::string& subject,
                        const std::string& not_before, const std::string& not_after);

}  // namespace linegate::security
