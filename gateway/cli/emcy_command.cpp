// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string>

#include "bridges/console/emcy_history.h"
#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"

namespace linegate::gateway {
namespace {

struct EmcyArguments {
  std::string line, code, error_register = "0", bytes;
};

}  // namespace

void add_emcy(CommandLine& line) {
  const auto arguments = std::make_shared<EmcyArguments>();
  CLI::App* emcy = line.app().add_subcommand(
      "emcy", "print the last EMCYs of each node; with a code: send an EMCY of the own node");
  emcy->add_option("line", arguments->line,
                   "LINE, or LINE:NODE for one node; a device of a line in the role "
                   "device sends as LINE:NODE")
      ->required();
  emcy->add_option("code", arguments->code, "emergency error code to send, hexadecimal");
  emcy->add_option("register", arguments->error_register, "error register, hexadecimal");
  emcy->add_option("bytes", arguments->bytes, "up to 5 manufacturer bytes, hexadecimal");
  line.on(emcy, {.commands = true}, [arguments](console::Context& c) {
    if (arguments->code.empty()) {
      return console::emcy_history(c, arguments->line);
    }
    return console::emcy(c, arguments->line, arguments->code, arguments->error_register,
                         arguments->bytes);
  });
}

}  // namespace linegate::gateway
