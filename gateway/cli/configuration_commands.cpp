// SPDX-License-Identifier: Apache-2.0
// Commands for configurations and programs of devices (CiA 302-3).
#include <cstdint>
#include <memory>
#include <optional>
#include <ostream>
#include <span>
#include <string>

#include "bridges/console/configuration.h"
#include "bridges/console/program.h"
#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/config/whole_file.h"

namespace linegate::gateway {
namespace {

struct ImportArguments {
  std::string line, file;
};

struct ProgramArguments {
  std::string node, file;
  unsigned number = 1;
};

// Nothing, after an error message, if the file cannot be read.
std::optional<std::string> content_of(console::Context& context, const std::string& path) {
  std::string why;
  auto content = config::whole_file(path, why);
  if (!content) {
    context.err << path << ' ' << why << '\n';
  }
  return content;
}

void add_config_action(CommandLine& line, CLI::App* config, console::ConfigAction action) {
  const auto name = std::make_shared<std::string>();
  config->add_option("line", *name, "LINE, or LINE:NODE for one node")->required();
  line.on(config, {.events = true, .commands = true},
          [name, action](console::Context& c) { return console::configure(c, action, *name); });
}

}  // namespace

void add_config(CommandLine& line) {
  CLI::App* config = line.app().add_subcommand("config", "configurations of devices (CiA 302-3)");
  config->require_subcommand(1);
  add_config_action(line,
                    config->add_subcommand("verify",
                                           "compare what devices have with their "
                                           "configuration; writes nothing"),
                    console::ConfigAction::verify);
  add_config_action(
      line,
      config->add_subcommand("apply",
                             "repeat the boot process of devices and write their configuration"),
      console::ConfigAction::apply);
  const auto arguments = std::make_shared<ImportArguments>();
  CLI::App* import = config->add_subcommand(
      "import", "write a concise DCF to the manager: the configuration of a node, or own objects");
  import->add_option("line", arguments->line, "LINE:NODE, or LINE for objects of the manager")
      ->required();
  import->add_option("file", arguments->file)->required()->check(CLI::ExistingFile);
  line.on(import, {.commands = true}, [arguments](console::Context& c) {
    const auto content = content_of(c, arguments->file);
    return content ? console::import_configuration(c, arguments->line,
                                                   std::as_bytes(std::span(*content)))
                   : console::kFailed;
  });
}

void add_program(CommandLine& line) {
  const auto arguments = std::make_shared<ProgramArguments>();
  CLI::App* program = line.app().add_subcommand(
      "program", "load a program into a device: stop, clear, load, start");
  program->add_option("node", arguments->node, "LINE:NODE")->required();
  program->add_option("file", arguments->file)->required()->check(CLI::ExistingFile);
  program
      ->add_option("--number", arguments->number,
                   "program number: sub-index of 1F50h, 1F51h and 1F57h")
      ->check(CLI::Range(1, 255));
  line.on(program, {.events = true, .commands = true}, [arguments](console::Context& c) {
    const auto content = content_of(c, arguments->file);
    if (!content) {
      return console::kFailed;
    }
    const auto bytes = std::as_bytes(std::span(*content));
    return console::load_program(c, arguments->node, static_cast<std::uint8_t>(arguments->number),
                                 {bytes.begin(), bytes.end()});
  });
}

}  // namespace linegate::gateway
