// SPDX-License-Identifier: Apache-2.0
// Names and descriptions of the line's enumerations.
#include <string_view>

#include "stack/line/command.h"
#include "stack/line/output_write.h"
#include "stack/line/state.h"

namespace linegate::line {
namespace {

constexpr std::string_view kNotPermitted =
    "not permitted by the access of the line (`access:` in plant.yaml)";
constexpr std::string_view kNoRight =
    "not permitted by the client's certificate: its role, or it is revoked";

}  // namespace

std::string_view name(Role role) {
  switch (role) {
    case Role::manager:
      return "manager";
    case Role::observer:
      return "observer";
    case Role::device:
      return "device";
  }
  return "unknown";
}

std::string_view name(CommandKind kind) {
  switch (kind) {
    case CommandKind::sdo_read:
      return "sdo-read";
    case CommandKind::sdo_write:
      return "sdo-write";
    case CommandKind::local_read:
      return "local-read";
    case CommandKind::local_write:
      return "local-write";
    case CommandKind::output_write:
      return "output-write";
    case CommandKind::emcy_send:
      return "emcy-send";
    case CommandKind::nmt:
      return "nmt";
    case CommandKind::network_read:
      return "network-read";
    case CommandKind::network_write:
      return "network-write";
    case CommandKind::routing_trace:
      return "routing-trace";
    case CommandKind::scan:
      return "scan";
    case CommandKind::boot:
      return "boot";
    case CommandKind::configure:
      return "configure";
    case CommandKind::program:
      return "program";
    case CommandKind::lss:
      return "lss";
    case CommandKind::object_write:
      return "object-write";
    case CommandKind::pdo_trigger:
      return "pdo-trigger";
    case CommandKind::can_send:
      return "can-send";
    case CommandKind::can_listen:
      return "can-listen";
    case CommandKind::object_create:
      return "object-create";
    case CommandKind::scan_apply:
      return "scan-apply";
    case CommandKind::pdo_request:
      return "pdo-request";
    case CommandKind::mpdo_write:
      return "mpdo-write";
    case CommandKind::connection_open:
      return "connection-open";
    case CommandKind::connection_close:
      return "connection-close";
    case CommandKind::connection_list:
      return "connection-list";
    case CommandKind::sleep:
      return "sleep";
  }
  return "unknown";
}

std::string_view describe(Refusal refusal) {
  switch (refusal) {
    case Refusal::none:
      return "done";
    case Refusal::busy:
      return "a queue is full, try again";
    case Refusal::not_permitted:
      return kNotPermitted;
    case Refusal::bad_request:
      return "a field is out of range or the fields do not go together";
    case Refusal::unknown_line:
      return "no such line";
    case Refusal::unknown_entry:
      return "no such output entry";
    case Refusal::wrong_incarnation:
      return "addressed to another start of the gateway";
    case Refusal::wrong_role:
      return "not possible in the line's role";
    case Refusal::wrong_state:
      return "not possible in the present state";
    case Refusal::inhibited:
      return "the inhibit time is running";
    case Refusal::timed_out:
      return "the command's time-out passed";
    case Refusal::line_down:
      return "the line's interface is not usable";
    case Refusal::stale_layout:
      return "made for another image layout";
    case Refusal::cancelled:
      return "the line was stopped or restarted meanwhile";
    case Refusal::wrong_interface:
      return "not possible with the line's interface";
    case Refusal::identifier_in_use:
      return "a service of the line uses this CAN identifier";
    case Refusal::bound_entry:
      return "the output follows an input of another line (forward:), nothing else writes it";
    case Refusal::no_acknowledge:
      return "not sent, waits for the bus: no acknowledge; check the cable, the bit rate and that "
             "another station is switched on";
    case Refusal::awaits_turn:
      return "not sent yet, waits for its turn (inhibit time, SYNC or remote request); it is sent "
             "then";
    case Refusal::no_right:
      return kNoRight;
    case Refusal::image_pdo:
      return "the object is that of a PDO in the process image, which would not follow: change it "
             "in the configuration of the node (pdos:)";
  }
  return "unknown refusal";
}

std::string_view describe(OutputRefusal refusal) {
  switch (refusal) {
    case OutputRefusal::none:
      return "applied";
    case OutputRefusal::not_permitted:
      return kNotPermitted;
    case OutputRefusal::stale_layout:
      return "made for another image layout";
    case OutputRefusal::unknown_group:
      return "no such output group";
    case OutputRefusal::unknown_entry:
      return "no such output entry, or not in this group";
    case OutputRefusal::bad_length:
      return "length differs from the entry's";
    case OutputRefusal::not_armed:
      return "the watchdog has fired: a new arming number is needed";
    case OutputRefusal::bad_reaction:
      return "more than one NMT reaction, or an unknown one";
    case OutputRefusal::wrong_role:
      return "not possible in the line's role";
    case OutputRefusal::bound_entry:
      return "an output follows an input of another line (forward:), nothing else writes it";
    case OutputRefusal::busy:
      return "too many other clients have unfinished requests";
    case OutputRefusal::no_right:
      return kNoRight;
    case OutputRefusal::written_by_name:
      return "the group is written by name (written_by: named), OutputWrite has no effect on it";
    case OutputRefusal::bad_value:
      return "a value does not fit into its output";
    case OutputRefusal::source_missing:
      return "the line of the other gateway has no such input";
    case OutputRefusal::source_type:
      return "the input of the other gateway has another data type, length or scaling";
    case OutputRefusal::source_disputed:
      return "several gateways of that name publish the line: give each another name";
    case OutputRefusal::source_silent:
      return "the line of the other gateway is not, or not completely, received";
    case OutputRefusal::source_invalid:
      return "the input of the other gateway is not valid";
  }
  return "unknown refusal";
}

}  // namespace linegate::line
