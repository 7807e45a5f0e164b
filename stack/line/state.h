// SPDX-License-Identifier: Apache-2.0
// The state of a line as a plain value; for the states of its nodes see stack/manager.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "stack/base/time.h"
#include "stack/can/bus_state.h"
#include "stack/manager/state.h"
#include "stack/nmt/sleep_protocol.h"
#include "stack/nmt/state.h"
#include "stack/node/indicators.h"
#include "stack/routing/config.h"

namespace linegate::line {

enum class Role : std::uint8_t {
  manager,   // NMT master of the line (CiA 302)
  observer,  // never transmits; another master owns the bus
  device,    // an ordinary CANopen device below another manager
};
std::string_view name(Role role);

using manager::describe_boot;
using manager::ManagerState;
using manager::name;
using manager::NodeState;
using manager::Presence;
using manager::StateCause;

// Counters since the line was made. They never decrease.
struct Counters {
  std::uint64_t frames_received = 0;
  std::uint64_t frames_sent = 0;    // handed to the bus
  std::uint64_t frames_unused = 0;  // received, used by no service
  // Received for a service but malformed; also PDOs of a wrong length
  std::uint64_t frames_malformed = 0;
  std::uint64_t frames_lost = 0;  // lost before they reached the line
  std::uint64_t bus_errors = 0;   // error frames
  std::uint64_t rpdos = 0;
  std::uint64_t tpdos = 0;
  std::uint64_t tpdos_coalesced = 0;  // a newer value replaced one that had not been sent yet
  std::uint64_t syncs = 0;
  std::uint64_t emcys = 0;
  std::uint64_t heartbeats_lost = 0;
  std::uint64_t sdo_transfers = 0;  // as client, successful
  std::uint64_t sdo_aborts = 0;     // as client, ended by an abort or time-out
  std::uint64_t commands = 0;
  std::uint64_t commands_refused = 0;
  std::uint64_t output_writes = 0;
  std::uint64_t output_writes_refused = 0;
  std::uint64_t events = 0;
  std::uint64_t events_lost = 0;
  std::uint64_t fd_frames_received = 0;  // CAN FD frames among frames_received, see BusLoad
  std::uint64_t fd_frames_sent = 0;
  std::uint64_t usdo_transfers = 0;   // as client, successful
  std::uint64_t usdo_aborts = 0;      // as client, ended by an abort or time-out
  std::uint64_t receptions_lost = 0;  // of queued PDOs, see Line::pop_reception()
};

// The state of one of the line's own devices (role device with LineConfig::devices).
struct OwnDevice {
  std::uint8_t node_id = 0;  // on the bus; 0: not assigned by LSS yet
  node::Indicators indicators;

  friend bool operator==(const OwnDevice&, const OwnDevice&) = default;
};

// Of the SRDOs that the nodes transmit.
struct SrdoCounters {
  std::uint16_t received = 0;  // SRDOs
  std::uint16_t valid = 0;     // of them
  std::uint64_t pairs = 0;     // valid ones
  std::uint64_t faults = 0;    // changes from valid to unsafe

  friend bool operator==(const SrdoCounters&, const SrdoCounters&) = default;
};

struct LineState {
  Role role = Role::manager;
  std::uint8_t node_id = 0;  // own node-ID, 0 = none
  std::uint16_t network_id = 0;
  nmt::State own_state = nmt::State::initialising;
  node::Indicators indicators;  // RUN and ERROR of the own node (CiA 303-3)
  ManagerState manager = ManagerState::inactive;
  // The state of the network, numbered as in diagnosis/network_state.h; 0 in the role observer and
  // with several own devices.
  std::uint8_t network = 0;
  can::BusState bus = can::BusState::unknown;
  std::uint8_t transmit_errors = 0;
  std::uint8_t receive_errors = 0;
  // Of the bit rate, over the last second; 0 if the bit rate is unknown
  std::uint16_t load_permille = 0;
  std::uint8_t nodes_configured = 0;
  std::uint8_t nodes_operational = 0;
  // The own node as a flying master (CiA 302-2)
  nmt::FlyingMasterState flying_master = nmt::FlyingMasterState::none;
  std::uint8_t active_master = 0;    // node-ID of the active master, 0 = not known, or none
  std::uint8_t master_priority = 0;  // own, 0..2; 0 is the highest
  Counters counters;
  routing::Counters routing;
  SrdoCounters srdos;
  std::optional<nmt::SleepPhase> sleep;  // nothing if it is not configured
};

}  // namespace linegate::line
