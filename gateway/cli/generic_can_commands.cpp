// SPDX-License-Identifier: Apache-2.0
// Commands for CAN frames that belong to no CANopen service.
#include <cstdint>
#include <memory>
#include <string>

#include "bridges/console/generic_can.h"
#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/runtime/signals.h"

namespace linegate::gateway {
namespace {

struct SendArguments {
  std::string line, frame;
};

struct ListenArguments {
  std::string line, filter;
  std::uint64_t count = 0;
};

}  // namespace

void add_send(CommandLine& line) {
  const auto arguments = std::make_shared<SendArguments>();
  CLI::App* send =
      line.app().add_subcommand("send", "send a CAN frame that belongs to no CANopen service");
  send->add_option("line", arguments->line)->required();
  send->add_option("frame", arguments->frame,
                   "ID#DATA in the format of cansend: 123#1122, 00000123#R8")
      ->required();
  line.on(send, {.commands = true}, [arguments](console::Context& c) {
    return console::send(c, arguments->line, arguments->frame);
  });
}

void add_listen(CommandLine& line) {
  const auto arguments = std::make_shared<ListenArguments>();
  CLI::App* listen = line.app().add_subcommand(
      "listen", "print received frames that belong to no CANopen service, live");
  listen->add_option("line", arguments->line)->required();
  listen->add_option("filter", arguments->filter, "ID or ID/MASK, hexadecimal: 123, 100/700");
  listen->add_option("-n,--count", arguments->count, "end after N frames")->check(count_from_one());
  line.on_live(listen, {.events = true, .commands = true}, [arguments](console::Context& c) {
    return console::listen(c, arguments->line, arguments->filter, arguments->count,
                           stop_signal_caught);
  });
}

}  // namespace linegate::gateway
