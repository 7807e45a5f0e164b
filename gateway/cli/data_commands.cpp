// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/data_commands.h"

#include <CLI/CLI.hpp>

#include "bridges/console/generic_can.h"
#include "bridges/console/lookup.h"
#include "bridges/console/pdo_commands.h"

namespace linegate::gateway {

using console::Context;

void DataCommands::add(CLI::App& app, const On& on, const std::function<bool()>& stopped) {
  add_trigger(app, on);
  add_pdo(app, on);
  add_frames(app, on, stopped);
  add_dictionary(app, on);
}

void DataCommands::add_trigger(CLI::App& app, const On& on) {
  CLI::App* trigger = app.add_subcommand("trigger", "send a PDO although nothing changed");
  trigger->add_option("line", line_, "LINE:NODE, or LINE")->required();
  trigger->add_option("number", value_, "of the node's RPDO, or of the line's TPDO")->required();
  trigger->add_flag("--offset", by_offset_, "all that carry this byte of the outputs");
  on(trigger, Needs::layouts,
     [this](Context& c) { return console::pdo_trigger(c, line_, value_, by_offset_); });
}

void DataCommands::add_pdo(CLI::App& app, const On& on) {
  CLI::App* pdo = app.add_subcommand("pdo", "ask for a PDO with a remote frame, or send an MPDO");
  pdo->require_subcommand(1);
  CLI::App* request =
      pdo->add_subcommand("request", "a node is asked for its TPDO; ends when it came");
  request->add_option("pdo", value_, "LINE:NODE:tpdoN, or LINE:own:rpdoN")->required();
  on(request, Needs::nothing, [this](Context& c) { return console::pdo_request(c, value_); });
  CLI::App* mpdo = pdo->add_subcommand(
      "mpdo", "give an object of a node, or of all, a value by MPDO; not confirmed");
  mpdo->add_option("node", line_, "LINE:NODE, or LINE:all")->required();
  mpdo->add_option("object", words_, "the object, data type and value: 6200:01 u8 5")
      ->required()
      ->expected(3, 4);
  on(mpdo, Needs::nothing, [this](Context& c) { return console::mpdo_write(c, line_, words_); });
}

void DataCommands::add_frames(CLI::App& app, const On& on, const std::function<bool()>& stopped) {
  CLI::App* send =
      app.add_subcommand("send", "give a frame of no CANopen service to the bus of a line");
  send->add_option("line", line_)->required();
  send->add_option("frame", value_, "ID#DATA as cansend has it: 123#1122, 00000123#R8")->required();
  on(send, Needs::nothing, [this](Context& c) { return console::send(c, line_, value_); });

  CLI::App* listen =
      app.add_subcommand("listen", "frames that no CANopen service of a line wants, live");
  listen->add_option("line", line_)->required();
  listen->add_option("filter", value_, "ID or ID/MASK, hexadecimal: 123, 100/700");
  listen->add_option("-n,--count", count_, "end after so many");
  on(listen, Needs::events,
     [this, stopped](Context& c) { return console::listen(c, line_, value_, count_, stopped); });
}

void DataCommands::add_dictionary(CLI::App& app, const On& on) {
  CLI::App* od =
      app.add_subcommand("od", "the object dictionary of a line's own node: lists, reads, writes");
  od->add_option("line", line_, "LINE, or LINE:NODE with a device in the role device")->required();
  od->require_subcommand(1);
  const auto add = [this, od](const char* name, const char* help, const char* words) {
    CLI::App* command = od->add_subcommand(name, help);
    command->add_option("object", words_, words)->required()->expected(1, 4);
    return command;
  };
  // Index and sub-index, and so many words behind them.
  const auto split = [this](Context& c, std::size_t behind) {
    auto words = console::split_object(words_, behind, behind);
    if (!words) {
      c.err << "usage: an object as INDEX:SUB, hexadecimal, and " << behind << " words behind it\n";
    }
    return words;
  };
  CLI::App* list = od->add_subcommand("list", "all objects, or the variables of one");
  list->add_option("index", object_.index, "hexadecimal");
  on(list, Needs::nothing,
     [this](Context& c) { return console::od_list(c, line_, object_.index); });
  on(add("read", "print a value", "2100:01, or 2100 1"), Needs::nothing, [this, split](Context& c) {
    const auto words = split(c, 0);
    return words ? console::od_read(c, line_, words->index, words->sub) : console::kUsage;
  });
  CLI::App* write = add("write", "give a value, by the type that the object has", "2100:01 VALUE");
  write->add_flag("--own", own_,
                  "as the device itself (LINE:NODE of the role device), whatever the access");
  on(write, Needs::nothing, [this, split](Context& c) {
    const auto words = split(c, 1);
    return words ? console::od_write(c, line_, words->index, words->sub, words->rest[0], own_)
                 : console::kUsage;
  });
  CLI::App* create = add("create", "an object of an application, until the line is stopped",
                         "2200:01 TYPE NAME; types: u8, i16, r32, vs, ...");
  create->add_option("--access", object_.access, "ro, wo, rw, rwr, rww, const");
  create->add_option("--default", object_.value, "value after a reset of the node");
  create->add_option("--low", object_.low, "lowest value that may be written");
  create->add_option("--high", object_.high, "highest value that may be written");
  create->add_option("--offset", object_.offset, "over the image, from this byte on");
  create->add_flag("--map", object_.mappable, "PDOs may map it");
  on(create, Needs::nothing, [this, split](Context& c) {
    const auto words = split(c, 2);
    if (!words) {
      return console::kUsage;
    }
    object_.index = words->index;
    object_.sub = words->sub;
    object_.type = words->rest[0];
    object_.name = words->rest[1];
    return console::od_create(c, line_, object_);
  });
  CLI::App* remove =
      od->add_subcommand("remove", "an object that was created, with all its sub-indices");
  remove->add_option("index", object_.index, "hexadecimal")->required();
  on(remove, Needs::nothing,
     [this](Context& c) { return console::od_remove(c, line_, object_.index); });
}

}  // namespace linegate::gateway
