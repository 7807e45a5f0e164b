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

namespace linegate::gateway {
namespace {

struct SecurityArguments {
  std::string folder;
  std::string role = "viewer";
  security::Issue issue;
  std::vector<std::string> lines;
  std::string certificate;
};

// Reports a failure on standard error; with --json, with_problems_as_json() makes it an object.
int finish(const std::string& error) {
  if (error.empty())
    return kExitOk;
  std::cerr << "error: " << error << '\n';
  return kExitFailed;
}

int issue_identity(SecurityArguments& arguments) {
  security::Issue& issue = arguments.issue;
  issue.holder.role = *security::parse_role(arguments.role);  // checked by the option
  if (!arguments.lines.empty()) {
    if (issue.holder.role == security::Role::gateway || issue.holder.role == security::Role::viewer)
      return finish("--line limits requests: a " + arguments.role + " sends none");
    issue.holder.lines = arguments.lines;
  }
  issue.keep_lines = arguments.lines.empty();
  return finish(security::issue(arguments.folder, issue));
}

int revoke_identity(const SecurityArguments& arguments) {
  if (!arguments.certificate.empty())
    return finish(security::revoke_certificate(arguments.folder, arguments.certificate));
  if (arguments.issue.holder.name.empty())
    return finish("name an identity, or a file with --certificate");
  return finish(security::revoke(arguments.folder, arguments.issue.holder.name));
}

int print_check(const std::string& folder) {
  const auto found = security::check_identity(folder, std::time(nullptr));
  for (const Diagnostic& diagnostic : found)
    std::cerr << to_string(diagnostic) << '\n';
  if (has_errors(found))
    return kExitFailed;
  const auto identity = security::identity_of(folder);
  std::cout << "identity " << identity->name << ", role " << security::name(identity->role) << '\n';
  return kExitOk;
}

}  // namespace

void add_security(CommandLine& line) {
  const auto arguments = std::make_shared<SecurityArguments>();
  CLI::App* all = line.app().add_subcommand(
      "security", "certificates and permissions of a plant with DDS-Security");
  all->require_subcommand(1);
  const auto command = [&](const char* name, const char* text, std::function<int()> action) {
    CLI::App* out = all->add_subcommand(name, text);
    out->add_option("folder", arguments->folder)->required();
    line.on(out, [&line, action = std::move(action)] {
      return with_problems_as_json(line.common().json, action);
    });
    return out;
  };
  command("init", "make an authority in a new folder",
          [arguments] { return finish(security::init(arguments->folder)); });
  CLI::App* issue = command("issue", "make an identity: FOLDER/NAME, to copy to its host",
                            [arguments] { return issue_identity(*arguments); });
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
                             [arguments] { return revoke_identity(*arguments); });
  CLI::Option* name = revoke->add_option("name", arguments->issue.holder.name);
  revoke
      ->add_option("--certificate", arguments->certificate,
                   "identity.crt of the identity, instead of its name")
      ->excludes(name);
  command("check", "what makes an identity unusable",
          [arguments] { return print_check(arguments->folder); });
}

}  // namespace linegate::gateway
