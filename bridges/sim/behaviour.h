// SPDX-License-Identifier: Apache-2.0
// The behaviour of a simulated device beyond CiA 301: its device profile.
//
// The device calls it with the time; it writes values to the dictionary and requests TPDOs. Values
// depend on seed, time and received data alone.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

#include "stack/node/node.h"
#include "stack/od/dictionary.h"

namespace linegate::sim {

// A value that a device sets often. Where it is, and which TPDO sends it, is looked up when PDOs
// have changed.
class FrequentValue {
 public:
  explicit FrequentValue(od::Address address) : address_(address) {}

 private:
  friend class Behaviour;

  od::Address address_;
  std::optional<pdo::TpdoValue> handle_;
  std::optional<std::uint64_t> revision_;  // of the PDOs, when it was looked up
};

class Behaviour : public node::Application, public od::Hook {
 public:
  // Registers hooks and sets the initial values. The node must outlive the behaviour.
  void attach(node::Node& node, std::uint64_t seed);

  // Updates the values to `now` after a reception or when a step is due.
  void run(Instant now);
  // When to call run() if nothing is received; kNever if never.
  virtual Instant next_step() const { return kNever; }
  // Returns a value once after each NMT reset of the node: true for reset node, false for reset
  // communication.
  std::optional<bool> pop_reset() { return std::exchange(reset_, std::nullopt); }
  // Sets the time of the next call into the node.
  void set_time(Instant now) { now_ = now; }

  // node::Application, od::Hook
  void rpdo_received(std::uint16_t number, Instant now) override;
  void written(od::Address address) override;
  void reset(bool whole_node, Instant now) override;

 protected:
  // Registers hooks for objects whose SDO write takes effect at once.
  virtual void set_hooks() {}
  // Called after power-on and reset node: the dictionary has the values of the EDS.
  virtual void power_on() {}
  // Called after an RPDO or SDO write, which may have changed the outputs of the device.
  virtual void react() {}
  // Called when next_step() is due.
  virtual void step() {}

  node::Node& node() { return *node_; }
  Instant now() const { return now_; }
  std::uint64_t seed() const { return seed_; }
  void hook(std::uint16_t index);

  std::uint64_t unsigned_value(od::Address address);
  std::int64_t signed_value(od::Address address);  // sign-extended from the variable's size
  bool has_sub(od::Address address);

  // Writes the value. If it changed, requests the event-driven TPDOs that map it.
  template <class T>
  requires std::is_integral_v<T>
  void set(od::Address address, T value) {
    if (unsigned_value(address) != (static_cast<std::uint64_t>(value) & mask(address))) {
      quiet_set(address, value);
      node_->pdos().value_changed(address, now_);
    }
  }
  template <class T>
  requires std::is_integral_v<T>
  void set(FrequentValue& to, T value) {
    pdo::Engine& pdos = node_->pdos();
    if (to.revision_ != pdos.revision()) {
      to.revision_ = pdos.revision();
      to.handle_ = pdos.value(to.address_);
    }
    if (!to.handle_ || !pdos.set(*to.handle_, static_cast<std::uint64_t>(value))) {
      set(to.address_, value);
    }
  }
  // Writes the value without requesting a TPDO.
  template <class T>
  requires std::is_integral_v<T>
  void quiet_set(od::Address address, T value) {
    writing_ = true;
    node_->dictionary().set(address, value);
    writing_ = false;
  }

 private:
  std::uint64_t mask(od::Address address);

  node::Node* node_ = nullptr;
  std::uint64_t seed_ = 0;
  Instant now_{};
  bool touched_ = false;
  std::optional<bool> reset_;
  bool writing_ = false;  // the device itself writes, not an SDO
};

std::unique_ptr<Behaviour> make_digital_io();
std::unique_ptr<Behaviour> make_analog_io();
std::unique_ptr<Behaviour> make_encoder();
std::unique_ptr<Behaviour> make_drive();
std::unique_ptr<Behaviour> make_fd_io();

}  // namespace linegate::sim
