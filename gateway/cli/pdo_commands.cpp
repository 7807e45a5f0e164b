// SPDX-License-Identifier: Apache-2.0
// Commands to send or request PDOs.
#include "bridges/console/pdo_commands.h"

#include <memory>
#include <string>
#include <vector>

#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"

namespace linegate::gateway {
namespace {

struct TriggerArguments {
  std::string line, number;
  bool by_offset = false;
};

struct MpdoArguments {
  std::string node;
  std::vector<std::string> words;  // the object, data type and value
};

}  // namespace

void add_trigger(CommandLine& line) {
  const auto arguments = std::make_shared<TriggerArguments>();
  CLI::App* trigger =
      line.app().add_subcommand("trigger", "send a PDO whose values did not change");
  trigger->add_option("line", arguments->line, "LINE:NODE, or LINE")->required();
  trigger
      ->add_option("number", arguments->number, "number of the node's RPDO, or of the line's TPDO")
      ->required();
  trigger->add_flag("--offset", arguments->by_offset,
                    "send all PDOs that contain this byte of the outputs");
  line.on(trigger, {.layouts = true, .commands = true}, [arguments](console::Context& c) {
    return console::pdo_trigger(c, arguments->line, arguments->number, arguments->by_offset);
  });
}

void add_pdo(CommandLine& line) {
  CLI::App* pdo =
      line.app().add_subcommand("pdo", "request a PDO with a remote frame, or send an MPDO");
  pdo->require_subcommand(1);
  const auto number = std::make_shared<std::string>();
  CLI::App* request = pdo->add_subcommand("request", "request a TPDO of a node, and wait for it");
  request->add_option("pdo", *number, "LINE:NODE:tpdoN, or LINE:own:rpdoN")->required();
  line.on(request, {.commands = true},
          [number](console::Context& c) { return console::pdo_request(c, *number); });
  const auto arguments = std::make_shared<MpdoArguments>();
  CLI::App* mpdo = pdo->add_subcommand(
      "mpdo", "write an object of one node or of all nodes by MPDO; unconfirmed");
  mpdo->add_option("node", arguments->node, "LINE:NODE, or LINE:all")->required();
  mpdo->add_option("object", arguments->words, "the object, data type and value: 6200:01 u8 5")
      ->required()
      ->expected(3, 4);
  line.on(mpdo, {.commands = true}, [arguments](console::Context& c) {
    return console::mpdo_write(c, arguments->node, arguments->words);
  });
}

}  // namespace linegate::gateway
