// SPDX-License-Identifier: Apache-2.0
// The state of a manager and of its network in one byte, with the numbers of the IXXAT CANopen
// Manager manual (chapters 7.1.1 and 8). It is derived from the manager's state and controls
// nothing.
//
//   00h init                 the own node cannot communicate
//   40h reset                master, the network is not initialised
//   41h..43h slave           own node Stopped, Pre-operational, Operational
//   61h 62h                  NMT reset is sent, then the wait for nodes (60h ends at once)
//   64h boot-conf            nodes are checked, configured, started (the manual also uses 63h)
//   65h boot-auto            the line is scanned (66h ends at once: the layout is published)
//   70h missing mandatory    all boot processes ended, a mandatory node is missing, boot time runs
//   8xh Axh Cxh Exh          scanned, run, stop, pre-operational; x: bit 0 an optional or
//                            unexpected node is not as expected, bit 1 a mandatory one, bit 2 a
//                            node is Operational, bit 3 the own node is
//   90h fatal error
#pragma once

#include <cstdint>
#include <string_view>

#include "stack/manager/state.h"
#include "stack/nmt/state.h"

namespace linegate::diagnosis {

inline constexpr std::uint8_t kInit = 0x00;
inline constexpr std::uint8_t kReset = 0x40;
inline constexpr std::uint8_t kSlaveStopped = 0x41;
inline constexpr std::uint8_t kSlavePreOperational = 0x42;
inline constexpr std::uint8_t kSlaveOperational = 0x43;
inline constexpr std::uint8_t kNetworkReset = 0x61;
inline constexpr std::uint8_t kNetworkWait = 0x62;
inline constexpr std::uint8_t kBootConfiguration = 0x64;
inline constexpr std::uint8_t kBootAuto = 0x65;
inline constexpr std::uint8_t kMissingMandatory = 0x70;
inline constexpr std::uint8_t kClear = 0x80;
inline constexpr std::uint8_t kFatal = 0x90;
inline constexpr std::uint8_t kRun = 0xA0;
inline constexpr std::uint8_t kStop = 0xC0;
inline constexpr std::uint8_t kPreOperational = 0xE0;
// Bits of the low nibble of kClear, kRun, kStop and kPreOperational.
inline constexpr std::uint8_t kOptionalWrong = 0x01;
inline constexpr std::uint8_t kMandatoryWrong = 0x02;
inline constexpr std::uint8_t kSomeOperational = 0x04;
inline constexpr std::uint8_t kOwnOperational = 0x08;

// "boot-conf", "run", ...; the low nibble is ignored where it holds bits. "unknown" for other
// values.
std::string_view name_of_network_state(std::uint8_t value);

// The inputs of the network state.
struct NetworkFacts {
  bool running = false;  // the line was started and not stopped
  bool manages = false;
  nmt::State own = nmt::State::initialising;
  manager::ManagerState manager = manager::ManagerState::inactive;
  bool starts_nodes = false;    // 1F80h bit 3 = 0
  bool boot_time_over = false;  // 1F89h
  bool scanning = false;        // of all nodes, not of one node
  bool booting = false;         // the first boot of an assigned node has not ended
  bool optional_wrong = false;
  bool mandatory_wrong = false;
  bool some_operational = false;
};

// The part of the state that does not follow from the present facts.
class NetworkState {
 public:
  // An initialisation of the network begins.
  void begin();
  // An NMT command to all nodes.
  void commanded(nmt::Command command, const NetworkFacts& facts);
  // Fatal error until the next begin().
  void fail() { fatal_ = true; }
  bool fatal() const { return fatal_; }

  // Advances the phase of the initialisation. Call it whenever time or facts changed.
  void update(const NetworkFacts& facts);

  std::uint8_t value(const NetworkFacts& facts) const;

 private:
  enum class Phase : std::uint8_t { reset, wait, boot, missing, done };

  std::uint8_t of_master(const NetworkFacts& facts) const;

  Phase phase_ = Phase::reset;
  std::uint8_t main_ = kClear;
  bool fatal_ = false;
};

}  // namespace linegate::diagnosis
