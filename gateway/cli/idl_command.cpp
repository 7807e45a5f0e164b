// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string>

#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/cli/problems_as_json.h"
#include "gateway/tools/idl.h"

namespace linegate::gateway {
namespace {

struct IdlArguments {
  std::string plant, line;
};

}  // namespace

void add_idl(CommandLine& line) {
  const auto arguments = std::make_shared<IdlArguments>();
  CLI::App* idl = line.app().add_subcommand(
      "idl", "print IDL with a type for each device of a plant.yaml, for fastddsgen and idlc");
  idl->add_option("plant", arguments->plant)->required();
  idl->add_option("line", arguments->line, "only LINE, LINE:DEVICE or LINE:GROUP");
  line.on(idl, [&line, arguments] {
    return with_problems_as_json(line.common().json,
                                 [&] { return print_idl(arguments->plant, arguments->line); });
  });
}

}  // namespace linegate::gateway
