// SPDX-License-Identifier: Apache-2.0
// What the manager of a line knows about itself and about each node, as plain values.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "stack/base/abort_code.h"
#include "stack/base/time.h"
#include "stack/nmt/state.h"
#include "stack/od/description.h"

namespace linegate::manager {

// Grows at the end only: the numbers are those of the DDS contract.
enum class ManagerState : std::uint8_t {
  inactive,           // no manager in this role, or not started
  resetting,          // NMT reset was sent
  booting,            // nodes are being checked, configured and started
  missing_mandatory,  // a mandatory node did not boot
  running,            // every listed node that answered has been booted
  stopped,            // stopped by command
  halted,  // the start-up of the network does not go on: a mandatory node is another one than
           // expected, could not be configured, or did not boot within 1F89h; or all nodes were
           // stopped because of an error of one (1F80h bit 6)
};
std::string_view name(ManagerState state);

enum class Presence : std::uint8_t {
  unknown,  // nothing heard yet
  present,
  missing,  // did not answer, or its heartbeat was lost
};
std::string_view name(Presence presence);

// Why a node came into the NMT state that it shows. Grows at the end only: the numbers are those of
// the DDS contract.
enum class StateCause : std::uint8_t {
  unknown,  // it was switched on, or nothing was heard of it before
  command,  // an NMT command asked for it
  itself,   // no command did
};
std::string_view name(StateCause cause);

inline constexpr char kBooted = '\0';
inline constexpr char kBootUnfinished = '-';
inline constexpr char kWasOperational = 'L';
// Letters that CiA 302-2 does not have. OWN.
inline constexpr char kNotStarted = 'S';  // booted, but not Operational after NMT start
inline constexpr char kRestarts = 'R';    // it boots again and again while it is configured

// The boot process came to its good end: nothing was wrong, or the node was running already.
constexpr bool is_booted(char letter) {
  return letter == kBooted || letter == kWasOperational || letter == kNotStarted;
}

// What a boot slave process found wrong, besides the letter.
struct BootFinding {
  enum class Kind : std::uint8_t {
    none,   // nothing but the letter
    abort,  // the transfer of `object` ended with `abort`
    value,  // `object` is `found`, which is not `expected`
    last,   // `object` was the last that was written
  };
  Kind kind = Kind::none;
  od::Address object{};
  AbortCode abort = AbortCode::none;
  std::uint32_t expected = 0;
  std::uint32_t found = 0;

  friend bool operator==(const BootFinding&, const BootFinding&) = default;
};

struct NodeState {
  std::uint8_t node = 0;
  bool configured = false;                 // listed in the configuration
  nmt::State state = nmt::State::unknown;  // as heard; without error control, as commanded
  Presence presence = Presence::unknown;
  bool heartbeat_monitored = false;
  // Error status of the last boot slave process (CiA 302-2): kBooted, kBootUnfinished, or a letter
  // A..O, R, S, see describe_boot().
  char boot = kBootUnfinished;
  BootFinding finding;            // why, with a letter
  std::uint32_t device_type = 0;  // 1000h as read, 0 = not read
  std::uint32_t vendor = 0;       // 1018h:1..4 as read
  std::uint32_t product = 0;
  std::uint32_t revision = 0;
  std::uint32_t serial = 0;
  std::uint8_t error_register = 0;  // of the last EMCY
  std::uint16_t last_emcy = 0;      // code of the last EMCY
  std::uint32_t emcy_count = 0;
  std::uint32_t heartbeats_lost = 0;
  StateCause cause = StateCause::unknown;
  std::uint32_t spontaneous_changes = 0;  // Operational left, or booted, without a command
  Instant last_heard{};                   // any frame of its error control or EMCY
};

// The boot status in words, e.g. "no answer to the SDO upload of 1000h" for 'B'; "booted" for
// kBooted.
std::string_view describe_boot(char letter);
// With what was found: "vendor-ID differs from the expected one: 1018:01 is 00000005h, not
// 00000007h"; the letter's words alone for BootFinding::Kind::none.
std::string describe_boot(char letter, const BootFinding& finding);

}  // namespace linegate::manager
