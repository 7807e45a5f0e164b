// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string_view>

#include "bridges/console/lss.h"
#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"

namespace linegate::gateway {
namespace {

struct LssSubcommand {
  const char* name;
  const char* text;
  const char* value;  // first argument; nullptr = none
  const char* value_text;
  bool one_device;
  bool may_store;
};

constexpr LssSubcommand kLssSubcommands[] = {
    {"scan", "find every device without a node-ID, by fastscan", nullptr, nullptr, false, false},
    {"assign", "give all devices without a node-ID that of their node in the configuration",
     nullptr, nullptr, false, false},
    {"identify", "whether there is a device without a node-ID", nullptr, nullptr, false, false},
    {"inquire", "the LSS address and the node-ID of a device", nullptr, nullptr, true, false},
    {"set-node-id", "give a device a node-ID", "node-id", "1..127, or none", true, true},
    {"bit-timing", "give a device a bit rate, for activate or the next power-on", "kbit",
     "10, 20, 50, 125, 250, 500, 800 or 1000 kbit/s", true, true},
    {"activate", "all devices that were given a bit rate use it now", "delay",
     "ms of silence before the switch, and after it", false, false},
    {"store", "a device keeps what it was given", nullptr, nullptr, true, false},
};

void add_one(CommandLine& line, CLI::App* lss, const LssSubcommand& one,
             const std::shared_ptr<console::LssRequest>& request) {
  CLI::App* command = lss->add_subcommand(one.name, one.text);
  if (one.value != nullptr) {
    command->add_option(one.value, request->value, one.value_text)->required();
  }
  if (one.one_device) {
    CLI::Option* address = command->add_option(
        "address", request->address, "VENDOR:PRODUCT:REVISION:SERIAL, hexadecimal (1018h)");
    command->add_flag("--only", request->only, "there is but one device on the line")
        ->excludes(address);
  }
  if (one.may_store) {
    command->add_flag("--store", request->store, "it keeps that while it is off");
  }
  if (std::string_view(one.name) == "set-node-id") {
    command->add_flag("--force", request->force, "even if another device uses the node-ID");
  }
  command->preparse_callback([request, name = one.name](std::size_t) { request->what = name; });
  line.on(command, {.events = true, .commands = true},
          [request](console::Context& c) { return console::lss(c, *request); });
}

}  // namespace

void add_lss(CommandLine& line) {
  const auto request = std::make_shared<console::LssRequest>();
  CLI::App* lss = line.app().add_subcommand("lss", "node-IDs and bit rates over the bus (CiA 305)");
  lss->add_option("line", request->line)->required();
  lss->require_subcommand(1);
  for (const LssSubcommand& one : kLssSubcommands) {
    add_one(line, lss, one, request);
  }
}

}  // namespace linegate::gateway
