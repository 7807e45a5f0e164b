// SPDX-License-Identifier: Apache-2.0
// The event indication of the IXXAT manual (7.1.3), 5F00h:1: what has happened since the network
// was initialised last, as bits. And the communication state (7.1.2), the high byte of 5F00h:2.
#pragma once

#include <cstdint>

#include "stack/base/event.h"
#include "stack/can/bus_state.h"

namespace linegate::diagnosis {

// FATE: bus-off, or frames were lost.
inline constexpr std::uint16_t kCommunicationFailed = 1U << 0U;
// NIDE: another device has the own node-ID.
inline constexpr std::uint16_t kOwnNodeIdTaken = 1U << 1U;
// MSE: error control event of a mandatory node.
inline constexpr std::uint16_t kMandatoryLost = 1U << 2U;
// MNCE: identity or configuration of a mandatory node.
inline constexpr std::uint16_t kMandatoryWrongNode = 1U << 3U;
// OIE: identity of an optional node.
inline constexpr std::uint16_t kOptionalWrongNode = 1U << 4U;
// PIE: a PDO of the own node cannot be used.
inline constexpr std::uint16_t kOwnPdoUnusable = 1U << 5U;
// ACE: a node was lost or came while the line was scanned.
inline constexpr std::uint16_t kScanDisturbed = 1U << 6U;
// NMTE: any bit of 5F01h to 5F07h.
inline constexpr std::uint16_t kListChanged = 1U << 7U;
// PDOLEN_ERR.
inline constexpr std::uint16_t kPdoTooShort = 1U << 9U;
// CONFIG_ERR: of any node.
inline constexpr std::uint16_t kConfigurationFailed = 1U << 10U;
// API_ROVR: a command found a queue full.
inline constexpr std::uint16_t kQueueFull = 1U << 11U;
// RSCN and RSCM: the state of all nodes, of one, was ordered by 1F82h.
inline constexpr std::uint16_t kNetworkRequested = 1U << 14U;
inline constexpr std::uint16_t kNodeRequested = 1U << 15U;

// Those that end in the state fatal error: what a plant cannot be run with, and what is fatal to
// the manual's manager besides. Its bit 8 (ASE) never comes: a slave assignment that cannot be
// carried out is refused when it is written.
inline constexpr std::uint16_t kFatalEvents = kOwnNodeIdTaken | kMandatoryWrongNode;
inline constexpr std::uint16_t kStrictlyFatalEvents = kFatalEvents | kCommunicationFailed |
                                                      kOwnPdoUnusable | kScanDisturbed |
                                                      kPdoTooShort | kConfigurationFailed;

// What has to be known of the line when an event comes.
struct EventContext {
  std::uint8_t own_node = 0;
  bool mandatory = false;  // the node of the event
  bool scanning = false;
};

// The bits that an event of a line in the role manager sets.
std::uint16_t global_events(const Event& event, const EventContext& context);

// Bits of the communication state. Its others never come: there is one queue each way, and what
// does not fit into that of the interface waits.
inline constexpr std::uint8_t kControllerOverrun = 1U << 1U;  // frames were lost
inline constexpr std::uint8_t kBusOff = 1U << 2U;             // now
inline constexpr std::uint8_t kErrorState = 1U << 3U;         // warning or passive, now
inline constexpr std::uint8_t kErrorStateLeft = 1U << 4U;     // since the network was initialised
inline constexpr std::uint8_t kReceiveOverrun = 1U << 6U;     // a queue of the gateway

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
  can::BusState bus_ = can::BusState::unknown;
  bool errors_ = false;
  std::uint8_t now_ = 0;
  std::uint8_t kept_ = 0;
};

}  // namespace linegate::diagnosis
