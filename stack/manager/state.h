// SPDX-License-Identifier: Apache-2.0
// The published state of the manager and of each node, as plain values.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "stack/base/abort_code.h"
#include "stack/base/time.h"
#include "stack/nmt/state.h"
#include "stack/od/description.h"

namespace linegate::manager {

// The numbers are part of the DDS contract: append new values at the end only.
enum class ManagerState : std::uint8_t {
  inactive,           // no manager in this role, or not started
  resetting,          // NMT reset was sent
  booting,            // nodes are being checked, configured and started
  missing_mandatory,  // a mandatory node did not boot
  running,            // every listed node that answered has been booted
  stopped,            // stopped by command
  // The start-up does not continue: a mandatory node is a wrong device, could not be configured, or
  // did not boot within 1F89h; or all nodes were stopped because a node was lost (1F80h bit 6)
  halted,
};
std::string_view name(ManagerState state);

enum class Presence : std::uint8_t {
  unknown,  // nothing received yet
  present,
  missing,  // did not answer, or its heartbeat was lost
};
std::string_view name(Presence presence);

// Why a node entered its present NMT state. The numbers are part of the DDS contract: append new
// values at the end only.
enum class StateCause : std::uint8_t {
  unknown,  // it was switched on, or no earlier state is known
  command,  // an NMT command requested it
  itself,   // no command requested it
};
std::string_view name(StateCause cause);

inline constexpr char kBooted = '\0';
inline constexpr char kBootUnfinished = '-';
inline constexpr char kConfigurationFailed = 'J';
// Configured, but its error control does not start.
inline constexpr char kNoErrorControl = 'K';
inline constexpr char kWasOperational = 'L';
// Letters that CiA 302-2 does not have. OWN.
inline constexpr char kNotStarted = 'S';  // booted, but not Operational after NMT start
inline constexpr char kRestarts = 'R';    // it boots repeatedly while it is configured

// A node that restarts while it is configured has lost what was written before, and refuses the
// next write. Its boot-up message has a lower priority than its SDO response: a controller with
// several transmit buffers sends it later, and later than the waiting frames of other nodes.
inline constexpr Duration kBootUpDelay = std::chrono::milliseconds(100);

// The boot process was successful, or the node was already running.
constexpr bool is_booted(char letter) {
  return letter == kBooted || letter == kWasOperational || letter == kNotStarted;
}

// The cause of a failed boot slave process, in addition to the letter.
struct BootFinding {
  enum class Kind : std::uint8_t {
    none,   // only the letter
    abort,  // the transfer of `object` ended with `abort`
    value,  // `object` is `found`, which is not `expected`
    last,   // `object` was written last
  };
  Kind kind = Kind::none;
  od::Address object{};
  AbortCode abort = AbortCode::none;
  std::uint32_t expected = 0;
  std::uint32_t found = 0;

  friend bool operator==(const BootFinding&, const BootFinding&) = default;
};

// The result of a boot process of a node.
struct BootOutcome {
  std::uint8_t node = 0;
  char letter = kBooted;  // as NodeState::boot
  BootFinding finding{};  // the cause, if there is a letter

  friend bool operator==(const BootOutcome&, const BootOutcome&) = default;
};

struct NodeState {
  std::uint8_t node = 0;
  bool configured = false;                 // listed in the configuration
  nmt::State state = nmt::State::unknown;  // as received; without error control, as commanded
  Presence presence = Presence::unknown;
  bool heartbeat_monitored = false;
  // Error status of the last boot slave process (CiA 302-2): kBooted, kBootUnfinished, or a letter
  // A..O, R, S, see describe_boot().
  char boot = kBootUnfinished;
  BootFinding finding;            // the cause, if boot is a letter
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
  std::uint32_t spontaneous_changes = 0;  // left Operational, or booted, without a command
  Instant last_heard{};                   // last frame of its error control, or EMCY
};

// The boot status in words, for example "no answer to the SDO upload of 1000h" for 'B'; "booted"
// for kBooted.
std::string_view describe_boot(char letter);
// Includes the finding: "vendor-ID differs from the expected one: 1018:01 is 00000005h, not
// 00000007h"; only the meaning of the letter for BootFinding::Kind::none.
std::string describe_boot(char letter, const BootFinding& finding);

}  // namespace linegate::manager
