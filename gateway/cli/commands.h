// SPDX-License-Identifier: Apache-2.0
// All commands of linegate, in the order of `linegate --help`.
#pragma once

namespace linegate::gateway {

class CommandLine;

// add_NAME(CommandLine&) adds a command with its options and its action. It is defined in
// NAME_command.cpp, or together with others in a ..._commands.cpp.
#define LINEGATE_COMMANDS(COMMAND) \
  COMMAND(monitor)                 \
  COMMAND(gateways)                \
  COMMAND(lines)                   \
  COMMAND(routes)                  \
  COMMAND(trace)                   \
  COMMAND(nodes)                   \
  COMMAND(image)                   \
  COMMAND(events)                  \
  COMMAND(names)                   \
  COMMAND(write)                   \
  COMMAND(sdo)                     \
  COMMAND(nmt)                     \
  COMMAND(sleep)                   \
  COMMAND(emcy)                    \
  COMMAND(bus_restart)             \
  COMMAND(scan)                    \
  COMMAND(lss)                     \
  COMMAND(boot)                    \
  COMMAND(accept)                  \
  COMMAND(fault)                   \
  COMMAND(versions)                \
  COMMAND(config)                  \
  COMMAND(program)                 \
  COMMAND(trigger)                 \
  COMMAND(pdo)                     \
  COMMAND(connections)             \
  COMMAND(send)                    \
  COMMAND(listen)                  \
  COMMAND(od)                      \
  COMMAND(check)                   \
  COMMAND(eds)                     \
  COMMAND(dcf)                     \
  COMMAND(idl)                     \
  COMMAND(simulate)                \
  COMMAND(record)                  \
  COMMAND(replay)                  \
  COMMAND(decode)                  \
  COMMAND(history)                 \
  COMMAND(doctor)                  \
  COMMAND(security)

#define LINEGATE_DECLARE_COMMAND(name) void add_##name(CommandLine& line);
LINEGATE_COMMANDS(LINEGATE_DECLARE_COMMAND)
#undef LINEGATE_DECLARE_COMMAND

}  // namespace linegate::gateway
