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
  std::string plant, line, ros2;
};

}  // namespace

void add_idl(CommandLine& line) {
  const auto arguments = std::make_shared<IdlArguments>();
  CLI::App* idl = line.app().add_subcommand(
      "idl", "print IDL with a type for each device of a plant.yaml, for fastddsgen and idlc");
  idl->add_option("plant", arguments->plant)->required();
  idl->add_option("line", arguments->line, "only LINE, LINE:DEVICE or LINE:GROUP");
  idl->add_option("--ros2", arguments->ros2,
                  "write a message package for ROS 2 into that folder instead")
      ->option_text("FOLDER");
  line.on(idl, [&line, arguments] {
    return with_problems_as_json(line.common().json, [&] {
      return arguments->ros2.empty()
                 ? print_idl(arguments->plant, arguments->line)
                 : write_ros2_package(arguments->plant, arguments->line, arguments->ros2);
    });
  });
}

}  // namespace linegate::gateway
