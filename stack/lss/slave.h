// SPDX-License-Identifier: Apache-2.0
// The LSS slave of one device (CiA 305): the device receives its node-ID and bit rate over the bus.
//
// A device has three node-IDs: the persistent one is stored, the pending one was configured, the
// active one is in use. Reset node makes the persistent one pending, reset communication makes the
// pending one active. A device without a node-ID (FFh) boots as soon as it leaves configuration
// with a valid one. The state of the slave is independent of the NMT state.
#pragma once

#include <cstdint>

#include "stack/base/time.h"
#include "stack/can/transmit_queue.h"
#include "stack/lss/message.h"

namespace linegate::lss {

// The settings that a device stores.
struct Settings {
  std::uint8_t node_id = kNoNodeId;        // 1..127 or kNoNodeId
  std::uint8_t bit_timing = kNoBitTiming;  // index of table 0; kNoBitTiming = not configured

  friend bool operator==(const Settings&, const Settings&) = default;
};

enum class StoreResult : std::uint8_t { stored, unsupported, failed, later };

// The device of the slave. The defaults support neither storing nor bit timings.
class SlaveHost {
 public:
  virtual ~SlaveHost() = default;
  // Stores the settings. If it returns `later`, call Slave::stored() when done.
  virtual StoreResult store(const Settings& settings);  // returns unsupported
  // Whether the device supports the bit rate at that index of table 0.
  virtual bool has_bit_timing(std::uint8_t index) const;  // returns false
  // Switches the bit rate: the first delay of `activate bit timing` has passed.
  virtual void use_bit_timing(std::uint8_t index, Instant now);
};

struct SlaveFaults {
  bool answers_in_configuration = false;  // answers to fastscan in configuration state too
  bool boots_at_reset = false;            // activates its first node-ID only at the next NMT reset
  bool takes_no_node_id = false;          // does not answer to `configure node-ID`

  friend bool operator==(const SlaveFaults&, const SlaveFaults&) = default;
};

enum class SlaveState : std::uint8_t { waiting, configuration };

class Slave {
 public:
  // host may be nullptr; it must outlive the slave.
  Slave(const Address& address, SlaveHost* host) : address_(address), host_(host) {}

  // For a simulated device: imitates faults of other manufacturers' slaves.
  void set_faults(const SlaveFaults& faults) { faults_ = faults; }

  // Starts the device with its stored settings.
  void power_on(const Settings& kept);
  // NMT reset node, or reset communication. Returns the node-ID that is active from now on.
  std::uint8_t reset(bool whole_node);

  // Processes a frame on 7E5h and queues the answers in `out`. Returns false if it is malformed:
  // not 8 bytes, or a field out of range. Unknown commands are ignored.
  bool receive(const can::Frame& frame, can::TransmitQueue& out);
  // Completes a store() that returned StoreResult::later.
  void stored(bool good, can::TransmitQueue& out);
  void advance(Instant now);
  Instant next_wake() const { return wake_; }

  // Returns true once after the slave left configuration with a new node-ID: the owner performs
  // reset communication.
  bool pop_reset();
  // A switch of the bit rate is under way: no service of the device may send.
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
  std::uint8_t selected_ = 0;    // number of matching parts so far
  std::uint8_t identified_ = 0;  // number of matching parts so far, of the six of identify
  std::uint8_t position_ = 0;    // the part that fastscan has reached
  bool reset_wanted_ = false;
  bool storing_ = false;
  SlaveFaults faults_;
  Settings to_store_;
  Phase phase_ = Phase::none;
  Duration delay_{};
  // Kept over resets, because all devices of the network switch together.
  std::uint8_t activated_ = kNoBitTiming;
  Instant wake_ = kNever;
  std::uint64_t malformed_ = 0;
};

}  // namespace linegate::lss
