// SPDX-License-Identifier: Apache-2.0
// Why Fast DDS would refuse an identity. The library itself reports no reason to an operator.
#pragma once

#include <ctime>
#include <optional>
#include <string>
#include <vector>

#include "gateway/security/documents.h"
#include "stack/base/diagnostic.h"

namespace linegate::security {

struct Identity {
  std::string name;
  Role role = Role::viewer;
};
// The identity in a folder (files.h) by the subject of its certificate; nothing if the certificate
// cannot be read or names no role.
std::optional<Identity> identity_of(const std::string& folder);

// Checks the files of an identity (files.h) at the time `now`. Reports every finding at once:
// errors prevent the participant, or every other participant refuses it; a warning names a
// certificate that expires within 30 days.
std::vector<Diagnostic> check_identity(const std::string& folder, std::time_t now);

// The named topics of a gateway (bridges/named), "plant/press/ram/inputs".
struct NamedTopics {
  std::vector<std::string> published;
  std::vector<std::string> received;
  // Topics of other gateways that it follows, "linegate/v1/LineState": not named ones.
  std::vector<std::string> followed{};
};

// The same for the identity of a gateway with that name; empty if `folder` is empty. It is an error
// if the permissions have no rule for one of the topics: identities had none at first.
std::vector<Diagnostic> check_gateway(const std::string& folder, const std::string& gateway,
                                      std::time_t now, const NamedTopics& topics = {});
// Only the errors about the topics, for a gateway that runs; empty without topics.
std::vector<Diagnostic> check_named_topics(const std::string& folder, const NamedTopics& topics);

// The same for the identity with which a gateway sends requests to lines of other gateways,
// "GATEWAY/LINE" each; empty if `folder` is empty. It is an error if its role sends none, its
// permissions do not name one of the lines, or another authority issued it than the identity in
// `of_gateway`, whose participants it would not see.
std::vector<Diagnostic> check_requests(const std::string& folder, const std::string& of_gateway,
                                       const std::vector<std::string>& lines, std::time_t now);
// Only the errors about the lines, for a gateway that runs.
std::vector<Diagnostic> check_request_lines(const std::string& folder,
                                            const std::vector<std::string>& lines);

}  // namespace linegate::security
