// SPDX-License-Identifier: Apache-2.0
// What a simulated device does beyond CiA 301: its profile.
//
// The device calls it with the time; it writes values to the dictionary and tells the PDO engine.
// Values are functions of seed, time and what was received; nothing else.
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

class Behaviour : public node::Application, public od::Hook {
 public:
  // The node must outlive the behaviour's use. Sets hooks and first values.
  void attach(node::Node& node, std::uint64_t seed);

  // Brings values up to now where something was received or the time has come.
  void run(Instant now);
  // When run() wants to be called next though nothing was received; kNever if never.
  virtual Instant next_step() const { return kNever; }
  // Once after each NMT reset of the node: whether it was of the whole node.
  std::optional<bool> take_reset() { return std::exchange(reset_, std::nullopt); }
  // The time of what the node is about to be given.
  void set_time(Instant now) { now_ = now; }

  // node::Application, od::Hook
  void rpdo_received(std::uint16_t number, Instant now) override;
  void written(od::Address address) override;
  void reset(bool whole_node, Instant now) override;

 protected:
  // Hooks for objects whose writing over SDO matters at once.
  virtual void set_hooks() {}
  // After power-on and reset node: the values in the dictionary are those of the EDS.
  virtual void power_on() {}
  // An RPDO or an SDO may have changed what the device is to do.
  virtual void react() {}
  // next_step() has come.
  virtual void step() {}

  node::Node& node() { return *node_; }
  Instant now() const { return now_; }
  std::uint64_t seed() const { return seed_; }
  void hook(std::uint16_t index);

  std::uint64_t unsigned_value(od::Address address);
  std::int64_t signed_value(od::Address address);  // sign-extended from the variable's size
  bool has_sub(od::Address address);

  // Writes the value; if it is a new one, event-driven TPDOs that map it are requested.
  template <class T>
  requires std::is_integral_v<T>
  void set(od::Address address, T value) {
    if (unsigned_value(address) != (static_cast<std::uint64_t>(value) & mask(address))) {
      quiet_set(address, value);
      node_->pdos().value_changed(address, now_);
    }
  }
  // Writes the value and tells nobody.
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
  bool writing_ = false;  // by the device itself: not to be taken for an SDO
};

std::unique_ptr<Behaviour> make_digital_io();
std::unique_ptr<Behaviour> make_analog_io();
std::unique_ptr<Behaviour> make_encoder();
std::unique_ptr<Behaviour> make_drive();

}  // namespace linegate::sim
