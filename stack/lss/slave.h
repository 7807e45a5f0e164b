// SPDX-License-Identifier: Apache-2.0
// The LSS slave of one device (CiA 305): what gives a device its node-ID and bit rate over the bus.
//
// A device has three node-IDs: the persistent one it keeps while it is off, the pending one that
// was configured, and the active one it uses. Reset node makes the persistent one pending, reset
// communication makes the pending one active. A device without one (FFh) boots as soon as it leaves
// configuration with a valid one. The state of the slave has nothing to do with that of NMT.
#pragma once

#include <cstdint>

#include "stack/base/time.h"
#include "stack/can/transmit_queue.h"
#include "stack/lss/message.h"

namespace linegate::lss {

// What a device keeps.
struct Settings {
  std::uint8_t node_id = kNoNodeId;        // 1..127 or kNoNodeId
  std::uint8_t bit_timing = kNoBitTiming;  // index of table 0; kNoBitTiming = never configured

  friend bool operator==(const Settings&, const Settings&) = default;
};

enum class StoreResult : std::uint8_t { stored, unsupported, failed, later };

// What the slave asks of its device.
class SlaveHost {
 public:
  virtual ~SlaveHost() = default;
  // Keeps them. `later`: Slave::stored() will be told.
  virtual StoreResult store(const Settings& settings);  // unsupported
  // Whether it can have that bit rate, an index of table 0.
  virtual bool has_bit_timing(std::uint8_t index) const;  // no
  // From now on it has it: the first delay of `activate bit timing` is over.
  virtual void use_bit_timing(std::uint8_t index, Instant now);
};

struct SlaveFaults {
  bool answers_in_configuration = false;  // fastscan, in that state too
  bool boots_at_reset = false;            // with its first node-ID: not before the next NMT reset
  bool takes_no_node_id = false;          // it does not answer `configure node-ID`

  friend bool operator==(const SlaveFaults&, const SlaveFaults&) = default;
};

enum class SlaveState : std::uint8_t { waiting, configuration };

class Slave {
 public:
  // host may be nullptr; it must outlive the slave.
  Slave(const Address& address, SlaveHost* host) : address_(address), host_(host) {}

  // Of a simulated device, what slaves of other makes do.
  void set_faults(const SlaveFaults& faults) { faults_ = faults; }

  // The device starts with what it keeps.
  void power_on(const Settings& kept);
  // NMT reset node, or reset communication; gives the node-ID the device has from now on.
  std::uint8_t reset(bool whole_node);

  // A frame on 7E5h; answers go into `out`, as those of an SDO server do. False if it is malformed:
  // no 8 bytes, or a field that is out of range. Unknown commands are ignored.
  bool receive(const can::Frame& frame, can::TransmitQueue& out);
  // Ends what StoreResult::later began.
  void stored(bool good, can::TransmitQueue& out);
  void advance(Instant now);
  Instant next_wake() const { return wake_; }

  // True once after it left configuration with a node-ID it did not have: reset communication is
  // to follow by itself.
  bool take_reset();
  // It changes its bit rate: nothing may be sent, by no service of the device.
  bool silent() const { return phase_ != Phase::none; }

  SlaveState state() const { return state_; }
  const Address& address() const { return address_; }
  const Settings& persistent() const { return persistent_; }
  const Settings& pending() const { return pending_; }
  std::uint8_t active_node_id() const { return active_; }
  std::uint64_t malformed() const { return malformed_; }

 private:
  enum class Phase : std::uint8_t { none, before_switch, after_switch };

  bool serve(const Message& request, Instant now, can::TransmitQueue& out);
  bool serve_configuration(const Message& request, Instant now, can::TransmitQueue& out);
  bool switch_global(std::uint8_t mode);
  void select(const Message& request, can::TransmitQueue& out);
  void identify(const Message& request, can::TransmitQueue& out);
  bool fastscan(const Message& request, can::TransmitQueue& out);
  void configure_node_id(std::uint8_t node_id, can::TransmitQueue& out);
  void configure_bit_timing(const Message& request, can::TransmitQueue& out);
  void activate(std::uint16_t delay_ms, Instant now);
  void store(can::TransmitQueue& out);
  bool unconfigured() const { return active_ == kNoNodeId && pending_.node_id == kNoNodeId; }

  Address address_;
  SlaveHost* host_;
  Settings persistent_;
  Settings pending_;
  std::uint8_t active_ = kNoNodeId;
  SlaveState state_ = SlaveState::waiting;
  std::uint8_t selected_ = 0;    // parts of the address that were right, in their order
  std::uint8_t identified_ = 0;  // the same of the six of identify
  std::uint8_t position_ = 0;    // of fastscan
  bool reset_wanted_ = false;
  bool storing_ = false;
  SlaveFaults faults_;
  Settings to_store_;
  Phase phase_ = Phase::none;
  Duration delay_{};
  std::uint8_t activated_ = kNoBitTiming;  // what all devices switch to, whoever is reset
  Instant wake_ = kNever;
  std::uint64_t malformed_ = 0;
};

}  // namespace linegate::lss
