// SPDX-License-Identifier: Apache-2.0
// The event indication of the IXXAT manual (7.1.3), 5F00h:1: the events since the last
// initialisation of the network, as bits. And the communication state (7.1.2), the high byte of
// 5F00h:2.
#pragma once

#include <cstdint>

#include "stack/base/event.h"
#include "stack/can/bus_state.h"

namespace linegate::diagnosis {

// FATE: bus-off, or frames were lost.
inline constexpr std::uint16_t kCommunicationFailed = 1U << 0U;
// NIDE: another device uses the own node-ID.
inline constexpr std::uint16_t kOwnNodeIdTaken = 1U << 1U;
// MSE: error control event of a mandatory node.
inline constexpr std::uint16_t kMandatoryLost = 1U << 2U;
// MNCE: wrong identity or configuration of a mandatory node.
inline constexpr std::uint16_t kMandatoryWrongNode = 1U << 3U;
// OIE: wrong identity of an optional node.
inline constexpr std::uint16_t kOptionalWrongNode = 1U << 4U;
// PIE: a PDO of the own node cannot be used.
inline constexpr std::uint16_t kOwnPdoUnusable = 1U << 5U;
// ACE: a node was lost or appeared during a scan.
inline constexpr std::uint16_t kScanDisturbed = 1U << 6U;
// NMTE: a bit of 5F01h to 5F07h changed.
inline constexpr std::uint16_t kListChanged = 1U << 7U;
// PDOLEN_ERR: a PDO was too short.
inline constexpr std::uint16_t kPdoTooShort = 1U << 9U;
// CONFIG_ERR: the configuration of a node failed.
inline constexpr std::uint16_t kConfigurationFailed = 1U << 10U;
// API_ROVR: a command found a queue full.
inline constexpr std::uint16_t kQueueFull = 1U << 11U;
// RSCN and RSCM: 1F82h requested a state of all nodes, of one node.
inline constexpr std::uint16_t kNetworkRequested = 1U << 14U;
inline constexpr std::uint16_t kNodeRequested = 1U << 15U;

// Events that end in the state fatal error: those with which a plant cannot run, and those that are
// fatal in the manual. Bit 8 of the manual (ASE) never occurs: a slave assignment that cannot be
// carried out is refused when it is written.
inline constexpr std::uint16_t kFatalEvents = kOwnNodeIdTaken | kMandatoryWrongNode;
inline constexpr std::uint16_t kStrictlyFatalEvents = kFatalEvents | kCommunicationFailed |
                                                      kOwnPdoUnusable | kScanDisturbed |
                                                      kPdoTooShort | kConfigurationFailed;

// The state of the line at the time of an event.
struct EventContext {
  std::uint8_t own_node = 0;
  bool mandatory = false;  // the node of the event
  bool scanning = false;
};

// The bits that an event of a line in the role manager sets.
std::uint16_t global_events(const Event& event, const EventContext& context);

// Bits of the communication state. The other bits are never set: there is one queue in each
// direction, and frames that do not fit into the queue of the interface wait.
inline constexpr std::uint8_t kControllerOverrun = 1U << 1U;  // frames were lost
inline constexpr std::uint8_t kBusOff = 1U << 2U;             // present state
inline constexpr std::uint8_t kErrorState = 1U << 3U;         // warning or passive, present state
// Left since the last initialisation of the network
inline constexpr std::uint8_t kErrorStateLeft = 1U << 4U;
inline constexpr std::uint8_t kReceiveOverrun = 1U << 6U;  // a queue of the gateway overflowed

class CommunicationState {
 public:
  void begin() {
    kept_ = 0;
    errors_ = false;
  }
  void note(const Event& event);
  std::uint8_t value() const { return static_cast<std::uint8_t>(kept_ | now_); }
  can::BusState bus() const { return bus_; }
  // An error frame was seen.
  bool errors() const { return errors_; }

 private:
  void note(const event::BusState& change);

  can::BusState bus_ = can::BusState::unknown;
  bool errors_ = false;
  std::uint8_t now_ = 0;
  std::uint8_t kept_ = 0;
};

}  // namespace linegate::diagnosis
