// SPDX-License-Identifier: Apache-2.0
// The certificate authority of a plant, and the identities of its participants.
#include <ctime>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/cli/problems_as_json.h"
#include "gateway/runtime/exit_code.h"
#include "gateway/security/authority.h"
#include "gateway/security/identity_check.h"
#include "gateway/tools/json_text.h"

namespace linegate::gateway {
namespace {

struct SecurityArguments {
  std::string folder;
  std::string role = "viewer";
  security::Issue issue;
  std::vector<std::string> lines;
  std::string certificate;
};

// Prints the result as JSON, if there is one. Reports a failure on standard error; with --json,
// with_problems_as_json() makes it an object.
int finish(const std::string& error, const Json& result = {}) {
  if (error.empty()) {
    if (!result.is_null())
      std::cout << json_text(result) << std::endl;
    return kExitOk;
  }
  std::cerr << "error: " << error << '\n';
  return kExitFailed;
}

// With --json the result, else nothing.
Json done(bool json, Json members) {
  if (!json)
    return {};
  Json out{{"ok", true}};
  out.update(members);
  return out;
}

int init_authority(const SecurityArguments& arguments, bool json) {
  return finish(security::init(arguments.folder), done(json, {{"folder", arguments.folder}}));
}

int issue_identity(SecurityArguments& arguments, bool json) {
  security::Issue& issue = arguments.issue;
  issue.holder.role = *security::parse_role(arguments.role);  // checked by the option
  if (!arguments.lines.empty()) {
    if (issue.holder.role == security::Role::gateway || issue.holder.role == security::Role::viewer)
      return finish("--line limits requests: a " + arguments.role + " sends none");
    issue.holder.lines = arguments.lines;
  }
  issue.keep_lines = arguments.lines.empty();
  return finish(security::issue(arguments.folder, issue),
                done(json, {{"folder", arguments.folder + "/" + issue.holder.name},
                            {"identity", issue.holder.name},
                            {"role", arguments.role}}));
}

int revoke_identity(const SecurityArguments& arguments, bool json) {
  if (!arguments.certificate.empty())
    return finish(security::revoke_certificate(arguments.folder, arguments.certificate),
                  done(json, {{"certificate", arguments.certificate}}));
  const std::string& name = arguments.issue.holder.name;
  if (name.empty())
    return finish("name an identity, or a file with --certificate");
  return finish(security::revoke(arguments.folder, name), done(json, {{"identity", name}}));
}

int print_check(const std::string& folder, bool json) {
  const auto found = security::check_identity(folder, std::time(nullptr));
  Json warnings = Json::array();
  for (const Diagnostic& diagnostic : found) {
    std::cerr << to_string(diagnostic) << '\n';
    warnings.push_back(to_string(diagnostic));
  }
  if (has_errors(found))
    return kExitFailed;
  const auto identity = security::identity_of(folder);
  const std::string role(security::name(identity->role));
  if (json)
    return finish(
        "", done(true, {{"identity", identity->name}, {"role", role}, {"warnings", warnings}}));
  std::cout << "identity " << identity->name << ", role " << role << '\n';
  return kExitOk;
}

}  // namespace

void add_security(CommandLine& line) {
  const auto arguments = std::make_shared<SecurityArguments>();
  CLI::App* all = line.app().add_subcommand(
      "security", "certificates and permissions of a plant with DDS-Security");
  all->require_subcommand(1);
  const auto command = [&](const char* name, const char* text,
                           std::function<int(bool json)> action) {
    CLI::App* out = all->add_subcommand(name, text);
    out->add_option("folder", arguments->folder)->required();
    line.on(out, [&line, action = std::move(action)] {
      const bool json = line.common().json;
      return with_problems_as_json(json, [&action, json] { return action(json); });
    });
    return out;
  };
  command("init", "make an authority in a new folder",
          [arguments](bool json) { return init_authority(*arguments, json); });
  CLI::App* issue = command("issue", "make an identity: FOLDER/NAME, to copy to its host",
                            [arguments](bool json) { return issue_identity(*arguments, json); });
  issue->add_option("name", arguments->issue.holder.name, "of a gateway: its name in plant.yaml")
      ->required();
  issue->add_option("--role", arguments->role, "gateway, viewer, operator or engineer")
      ->required()
      ->check(CLI::IsMember({"gateway", "viewer", "operator", "engineer"}));
  issue
      ->add_option(
          "--line", arguments->lines,
          "GATEWAY/LINE that an operator or engineer may command; default: */*, all, or with "
          "--renew the lines of before")
      ->allow_extra_args(false);
  issue->add_option("--days", arguments->issue.days, "validity")->capture_default_str();
  issue->add_flag("--renew", arguments->issue.renew,
                  "replace an identity; its old certificate remains valid until it expires");
  CLI::App* revoke = command("revoke", "withdraw an identity, and update revoked.crl everywhere",
                             [arguments](bool json) { return revoke_identity(*arguments, json); });
  CLI::Option* name = revoke->add_option("name", arguments->issue.holder.name);
  revoke
      ->add_option("--certificate", arguments->certificate,
                   "identity.crt of the identity, instead of its name")
      ->excludes(name);
  command("check", "what makes an identity unusable",
          [arguments](bool json) { return print_check(arguments->folder, json); });
}

}  // namespace linegate::gateway
