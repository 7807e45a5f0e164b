// SPDX-License-Identifier: Apache-2.0
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bridges/console/dictionary.h"
#include "bridges/console/lookup.h"
#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"

namespace linegate::gateway {
namespace {

struct OdArguments {
  std::string line;
  std::vector<std::string> words;  // an object, followed by further arguments
  console::NewObject object;
  bool own = false;
};

using SharedOdArguments = std::shared_ptr<OdArguments>;

// Index and sub-index, followed by the given number of words. Returns nothing, after an error
// message, if the words do not match.
std::optional<console::ObjectWords> split_words(console::Context& context,
                                                const OdArguments& arguments, std::size_t behind) {
  auto words = console::split_object(arguments.words, behind, behind);
  if (!words) {
    context.err << "usage: an object as INDEX:SUB, hexadecimal, followed by " << behind
                << " arguments\n";
  }
  return words;
}

CLI::App* add_od_object(CLI::App* od, const SharedOdArguments& arguments, const char* name,
                        const char* help, const char* words) {
  CLI::App* command = od->add_subcommand(name, help);
  command->add_option("object", arguments->words, words)->required()->expected(1, 4);
  return command;
}

int create_object(console::Context& context, OdArguments& arguments) {
  const auto words = split_words(context, arguments, 2);
  if (!words) {
    return console::kUsage;
  }
  arguments.object.index = words->index;
  arguments.object.sub = words->sub;
  arguments.object.type = words->rest[0];
  arguments.object.name = words->rest[1];
  return console::od_create(context, arguments.line, arguments.object);
}

void add_od_read_and_write(CommandLine& line, CLI::App* od, const SharedOdArguments& arguments) {
  CLI::App* list = od->add_subcommand("list", "list all objects, or the sub-indices of one");
  list->add_option("index", arguments->object.index, "hexadecimal");
  line.on(list, {.commands = true}, [arguments](console::Context& c) {
    return console::od_list(c, arguments->line, arguments->object.index);
  });
  CLI::App* read = add_od_object(od, arguments, "read", "print a value", "2100:01, or 2100 1");
  line.on(read, {.commands = true}, [arguments](console::Context& c) {
    const auto words = split_words(c, *arguments, 0);
    return words ? console::od_read(c, arguments->line, words->index, words->sub) : console::kUsage;
  });
  CLI::App* write = add_od_object(od, arguments, "write",
                                  "write a value of the data type of the object", "2100:01 VALUE");
  write->add_flag("--own", arguments->own,
                  "write as the device itself (LINE:NODE of the role device), whatever the access");
  line.on(write, {.commands = true}, [arguments](console::Context& c) {
    const auto words = split_words(c, *arguments, 1);
    return words ? console::od_write(c, arguments->line, words->index, words->sub, words->rest[0],
                                     arguments->own)
                 : console::kUsage;
  });
}

void add_od_create_and_remove(CommandLine& line, CLI::App* od, const SharedOdArguments& arguments) {
  CLI::App* create =
      add_od_object(od, arguments, "create",
                    "create an object of an application; it exists until the line is stopped",
                    "2200:01 TYPE NAME; types: u8, i16, r32, vs, ...");
  console::NewObject& object = arguments->object;
  create->add_option("--access", object.access, "ro, wo, rw, rwr, rww, const");
  create->add_option("--default", object.value, "value after a reset of the node");
  create->add_option("--low", object.low, "lowest value that may be written");
  create->add_option("--high", object.high, "highest value that may be written");
  create->add_option("--offset", object.offset, "position in the process image, in bytes");
  create->add_flag("--map", object.mappable, "allow PDOs to map it");
  line.on(create, {.commands = true},
          [arguments](console::Context& c) { return create_object(c, *arguments); });
  CLI::App* remove =
      od->add_subcommand("remove", "remove a created object with all its sub-indices");
  remove->add_option("index", object.index, "hexadecimal")->required();
  line.on(remove, {.commands = true}, [arguments](console::Context& c) {
    return console::od_remove(c, arguments->line, arguments->object.index);
  });
}

}  // namespace

void add_od(CommandLine& line) {
  const auto arguments = std::make_shared<OdArguments>();
  CLI::App* od = line.app().add_subcommand(
      "od", "list, read and write the object dictionary of a line's own node");
  od->add_option("line", arguments->line, "LINE, or LINE:NODE with a device in the role device")
      ->required();
  od->require_subcommand(1);
  add_od_read_and_write(line, od, arguments);
  add_od_create_and_remove(line, od, arguments);
}

}  // namespace linegate::gateway
