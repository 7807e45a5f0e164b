// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "bridges/console/hold.h"
#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/runtime/signals.h"

namespace linegate::gateway {
namespace {

struct WriteArguments {
  std::string line, entry, value;
  double hold = 0;  // seconds
  bool until_end = false;
  bool raw = false;
  std::optional<std::uint16_t> group;
};

int hold_output(console::Context& context, const WriteArguments& arguments) {
  catch_stop_signals();
  return console::hold(context,
                       {.line = arguments.line,
                        .entry = arguments.entry,
                        .value = arguments.value,
                        .group = arguments.group,
                        .raw = arguments.raw,
                        .time = seconds(arguments.hold)},
                       stop_signal_caught);
}

int write_output(const CommandLine& line, const WriteArguments& arguments) {
  if (arguments.until_end || arguments.hold > 0) {
    return line.with_client({.images = true, .events = true, .outputs = true},
                            [&](console::Context& c) { return hold_output(c, arguments); });
  }
  return line.with_client({.images = true, .commands = true}, [&](console::Context& c) {
    return console::write(c, arguments.line, arguments.entry, arguments.value, arguments.raw);
  });
}

}  // namespace

void add_write(CommandLine& line) {
  const auto arguments = std::make_shared<WriteArguments>();
  CLI::App* write = line.app().add_subcommand("write", "write the value of one output");
  write->add_option("line", arguments->line)->required();
  write
      ->add_option("entry", arguments->entry,
                   "name, NODE.INDEX:SUB with the name or the node-ID, or number")
      ->required();
  write->add_option("value", arguments->value, "in the unit of the output, within its limits")
      ->required();
  write->add_flag("--raw", arguments->raw,
                  "the value is the one in the PDO: without scaling, beyond the limits");
  auto* const hold =
      write->add_option("--hold", arguments->hold,
                        "hold the value for this time, e.g. 30s; then its group becomes 0");
  hold->transform(CLI::AsNumberWithUnit(units_of_seconds()))->check(seconds_above_zero());
  write
      ->add_flag("--while", arguments->until_end, "hold the value until this command ends (Ctrl-C)")
      ->excludes(hold);
  write
      ->add_option("--group", arguments->group,
                   "the group of outputs that --hold and --while write, if not that of the entry")
      ->check(CLI::Range(0, 0xFFFF));
  line.on(write, [&line, arguments] { return write_output(line, *arguments); });
}

}  // namespace linegate::gateway
