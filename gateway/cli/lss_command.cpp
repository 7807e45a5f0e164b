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
    {"scan", "find all devices without a node-ID, by LSS fastscan", nullptr, nullptr, false, false},
    {"assign", "configure the node-ID of each device without one, as plant.yaml specifies", nullptr,
     nullptr, false, false},
    {"identify", "report whether a device has no node-ID", nullptr, nullptr, false, false},
    {"inquire", "print the LSS address and the node-ID of a device", nullptr, nullptr, true, false},
    {"set-node-id", "configure the node-ID of a device", "node-id", "1..127, or none", true, true},
    {"bit-timing", "configure the bit rate of a device, for activate or the next power-on", "kbit",
     "10, 20, 50, 125, 250, 500, 800 or 1000 kbit/s", true, true},
    {"activate", "switch all devices to their configured bit rate", "delay",
     "switch delay in ms: no frames for this time before and after the switch", false, false},
    {"store", "store the configured node-ID and bit rate in a device", nullptr, nullptr, true,
     false},
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
    command->add_flag("--only", request->only, "the line has only one device")->excludes(address);
  }
  if (one.may_store) {
    command->add_flag("--store", request->store, "store it in the device");
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
