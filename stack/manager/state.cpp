// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/state.h"

#include "stack/manager/boot_event.h"
#include "stack/manager/program_run.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"

namespace linegate::manager {
namespace {

std::string hex(std::uint32_t number, int digits) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string out;
  for (int digit = digits - 1; digit >= 0; --digit) {
    out += kDigits[number >> (4 * digit) & 0xFU];
  }
  return out;
}

std::string object_text(od::Address object) {
  return od::to_text(object);
}

// The meaning of the letter if its object could not even be read.
std::string_view unread(char letter, const BootFinding& finding) {
  switch (letter) {
    case 'B':
      return finding.abort == AbortCode::timeout ? describe_boot(letter) : "1000h cannot be read";
    case 'D':
      return "vendor-ID cannot be read";
    case 'J':  // of a PDO of the image: its parameters are read, and written if they differ
      if (od::objects::is_pdo_record(finding.object.index)) {
        return "PDO could not be compared with the image, or configured";
      }
      return is_assumed_object(finding.object.index)
                 ? "SRDO could not be compared with the image, or configured"
                 : describe_boot(letter);
    case 'G':
      return "software version cannot be read";
    case 'M':
      return "product code cannot be read";
    case 'N':
      return "revision number cannot be read";
    case 'O':
      return "serial number cannot be read";
    default:
      return describe_boot(letter);
  }
}

// Whether the manager keeps trying to boot such a node, see boot_slave.h.
std::string again(char letter, const BootFinding& finding) {
  if (letter != 'B' && is_refusal(finding)) {
    const bool repeated = finding.expected != 0;
    return repeated ? ", " + std::to_string(finding.expected) + " times in a row" : "";
  }
  return "; requested again every second";
}

}  // namespace

std::string_view name(ManagerState state) {
  switch (state) {
    case ManagerState::inactive:
      return "inactive";
    case ManagerState::resetting:
      return "resetting";
    case ManagerState::booting:
      return "booting";
    case ManagerState::missing_mandatory:
      return "missing-mandatory";
    case ManagerState::running:
      return "running";
    case ManagerState::stopped:
      return "stopped";
    case ManagerState::halted:
      return "halted";
  }
  return "unknown";
}

std::string_view name(Presence presence) {
  switch (presence) {
    case Presence::unknown:
      return "unknown";
    case Presence::present:
      return "present";
    case Presence::missing:
      return "missing";
  }
  return "unknown";
}

std::string_view name(StateCause cause) {
  switch (cause) {
    case StateCause::unknown:
      return "unknown";
    case StateCause::command:
      return "command";
    case StateCause::itself:
      return "itself";
  }
  return "unknown";
}

std::string_view describe_boot(char letter) {
  switch (letter) {
    case kBooted:
      return "booted";
    case kBootUnfinished:
      return "not finished";
    case 'A':
      return "node is not listed";
    case 'B':
      return "no answer to the SDO upload of 1000h";
    case 'C':
      return "device type differs from the expected one";
    case 'D':
      return "vendor-ID differs from the expected one";
    case 'E':
      return "no heartbeat while the node was to be kept alive";
    case 'F':
      return "no answer to node guarding while the node was to be kept alive";
    case 'G':
      return "no expected software version is configured";
    case 'H':
      return "software version differs and an update is not allowed";
    case 'I':
      return "software update failed";
    case 'J':
      return "configuration failed";
    case kNoErrorControl:
      return "no heartbeat after the node was configured";
    case 'L':
      return "node was already operational";
    case 'M':
      return "product code differs from the expected one";
    case 'N':
      return "revision number differs from the expected one";
    case 'O':
      return "serial number differs from the expected one";
    case kRestarts:
      return "restarts while it is configured";
    case kNotStarted:
      return "booted, but not operational after NMT start";
    default:
      return "unknown boot status";
  }
}

std::string describe_boot(char letter, const BootFinding& finding) {
  std::string out(finding.kind == BootFinding::Kind::abort ? unread(letter, finding)
                                                           : describe_boot(letter));
  switch (finding.kind) {
    case BootFinding::Kind::none:
      break;
    case BootFinding::Kind::last:
      if (letter == 'I') {
        out += ": the device restarted while " + object_text(finding.object) + " was written";
        break;
      }
      out += ", last object " + (finding.object.sub == 0 ? hex(finding.object.index, 4) + 'h'
                                                         : object_text(finding.object));
      break;
    case BootFinding::Kind::abort:
      out += ": " + object_text(finding.object) + " ended with " +
             hex(static_cast<std::uint32_t>(finding.abort), 8) + "h, " +
             std::string(describe(finding.abort)) + again(letter, finding);
      break;
    case BootFinding::Kind::value:
      out += ": " + object_text(finding.object) + " is " + hex(finding.found, 8) + "h, not " +
             hex(finding.expected, 8) + 'h';
      if (finding.object.index == od::objects::kFlashStatus) {
        out += ", " + std::string(describe_flash_status(finding.found));
      }
      break;
  }
  return out;
}

}  // namespace linegate::manager
