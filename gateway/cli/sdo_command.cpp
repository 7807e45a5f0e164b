// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string>
#include <vector>

#include "bridges/console/lookup.h"
#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"

namespace linegate::gateway {
namespace {

struct SdoArguments {
  std::string node, via;
  std::vector<std::string> words;  // an object, followed by further arguments
  bool from_image = false;
  bool cached = false;
  bool by_pdo = false;
  bool keep = false;
};

std::string sdo_usage(const std::string& form) {
  return "usage: linegate " + form + "; index and sub-index are hexadecimal";
}

int read_object(const CommandLine& line, const SdoArguments& arguments) {
  const auto words = console::split_object(arguments.words, 0, 1);
  if (!words) {
    return line.usage_error(sdo_usage("sdo read LINE:NODE INDEX:SUB [TYPE]"));
  }
  const std::string type = words->rest.empty() ? "" : words->rest[0];
  return line.with_client({.layouts = true, .commands = true}, [&](console::Context& c) {
    if (arguments.from_image) {
      return console::image_read(c, arguments.node, words->index, words->sub, type);
    }
    return console::sdo_read(c, arguments.node, words->index, words->sub, type, arguments.via,
                             arguments.cached);
  });
}

int write_object(const CommandLine& line, const SdoArguments& arguments) {
  if (const std::string why = console::why_ambiguous(arguments.words); !why.empty()) {
    return line.usage_error(why);
  }
  const auto words = console::split_object(arguments.words, 1, 2);
  if (!words) {
    return line.usage_error(sdo_usage("sdo write LINE:NODE INDEX:SUB [TYPE] VALUE"));
  }
  const std::string type = words->rest.size() == 2 ? words->rest[0] : "";
  const Topics topics{.layouts = arguments.by_pdo, .commands = true};
  return line.with_client(topics, [&](console::Context& c) {
    if (arguments.by_pdo) {
      return console::object_write(c, arguments.node, words->index, words->sub, type,
                                   words->rest.back(), arguments.keep);
    }
    return console::sdo_write(c, arguments.node, words->index, words->sub, type, words->rest.back(),
                              arguments.via);
  });
}

void add_object(CLI::App* command, SdoArguments& arguments, const char* words) {
  command->add_option("node", arguments.node, "LINE:NODE, or LINE:all for each node")->required();
  command->add_option("object", arguments.words, words)->required()->expected(1, 4);
  command->add_option(
      "--via", arguments.via,
      "send as a device on this line; the rules enter: of the line of the node apply");
}

void add_sdo_read(CommandLine& line, CLI::App* sdo) {
  const auto arguments = std::make_shared<SdoArguments>();
  CLI::App* read = sdo->add_subcommand("read", "print an object's value");
  add_object(read, *arguments,
             "the object, as 1018:01 or 1018 1, or all of 1018; then the data type if it is not "
             "that of the device file: 1018:01 u32");
  read->add_flag("--from-image", arguments->from_image,
                 "accept the value of the process image, if it is valid")
      ->excludes("--via");
  read->add_flag("--cached", arguments->cached, "accept values that a scan read");
  line.on(read, [&line, arguments] { return read_object(line, *arguments); });
}

void add_sdo_write(CommandLine& line, CLI::App* sdo) {
  const auto arguments = std::make_shared<SdoArguments>();
  CLI::App* write = sdo->add_subcommand("write", "write a value to an object");
  add_object(write, *arguments,
             "the object and its value, the data type before it if it is not that of the device "
             "file: 1017:00 500, or 1017 0 u16 500");
  write
      ->add_flag("--by-pdo", arguments->by_pdo,
                 "write by PDO if a PDO contains the object; prints the used service")
      ->excludes("--via");
  write
      ->add_flag("--keep", arguments->keep,
                 "do not send the PDO until linegate trigger requests it")
      ->needs("--by-pdo");
  line.on(write, [&line, arguments] { return write_object(line, *arguments); });
}

}  // namespace

void add_sdo(CommandLine& line) {
  CLI::App* sdo = line.app().add_subcommand("sdo", "read or write an object of a device");
  sdo->require_subcommand(1);
  add_sdo_read(line, sdo);
  add_sdo_write(line, sdo);
}

}  // namespace linegate::gateway
