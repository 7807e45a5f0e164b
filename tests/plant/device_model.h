// SPDX-License-Identifier: Apache-2.0
// The expected behaviour of single devices, derived in a simple way from the frames they receive:
// the oracle for life guarding and for MPDOs.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bridges/sim/device.h"
#include "stack/base/event.h"
#include "stack/can/frame.h"

namespace linegate::plant {

// The identifier on which a device with MPDOs receives its object 2F01h in destination address
// mode.
inline constexpr std::uint32_t kMpdoToAll = 0x57F;
// The 29-bit identifier on which it sends 2F01h in source address mode, + node-ID. With an 11-bit
// identifier an observer would take three such frames for an unknown PDO.
inline constexpr std::uint32_t kMpdoOfNode = 0x1'0480;

class DeviceModel {
 public:
  // mpdo: the device has MPDOs; mpdo_of: the node whose 2F01h is received in 2F02h, 0 = none.
  DeviceModel(bool mpdo, std::uint8_t mpdo_of) : mpdo_(mpdo), mpdo_of_(mpdo_of) {}

  // Call it before the device receives the frame.
  void before_receive(sim::Device& device, const can::Frame& frame);
  // Call it after the device was advanced. Takes the events of the device.
  void after_advance(sim::Device& device, Instant now);
  void power_off();

  // A description of the first difference between device and model, or nothing.
  std::string compare(sim::Device& device) const;

 private:
  void follow_nmt(std::uint8_t node, const can::Frame& frame);
  void follow_guarding(sim::Device& device, const can::Frame& frame);
  void follow_mpdo(sim::Device& device, const can::Frame& frame);

  bool mpdo_;
  std::uint8_t mpdo_of_;
  std::uint32_t value_ = 0;                  // expected value of 2F01h
  std::uint32_t followed_ = 0;               // expected value of 2F02h
  Instant guarded_until_ = kNever;           // deadline of the next guarding request
  std::vector<Instant> guarding_lost_;       // expected times of the event
  std::vector<Instant> guarding_lost_told_;  // reported times of the event
};

}  // namespace linegate::plant
