// SPDX-License-Identifier: Apache-2.0
// What single devices ought to do, worked out naively from the frames they were given: the oracle
// for life guarding and for MPDOs.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bridges/sim/device.h"
#include "stack/base/event.h"
#include "stack/can/frame.h"

namespace linegate::plant {

// Object 2F01h of a device with MPDOs comes in destination address mode on this identifier.
inline constexpr std::uint32_t kMpdoToAll = 0x57F;
// And goes out in source address mode on this one of 29 bits + node-ID: an observer takes three
// frames on an identifier of 11 bits for a PDO that it does not know yet.
inline constexpr std::uint32_t kMpdoOfNode = 0x1'0480;

class DeviceModel {
 public:
  // mpdo: it has them; mpdo_of: whose 2F01h its 2F02h follows, 0 = nobody's.
  DeviceModel(bool mpdo, std::uint8_t mpdo_of) : mpdo_(mpdo), mpdo_of_(mpdo_of) {}

  // The device is about to be given this frame.
  void before_receive(sim::Device& device, const can::Frame& frame);
  // It has done what was due. Takes what it told.
  void after_advance(sim::Device& device, Instant now);
  void power_off();

  // A sentence about the first difference between device and model, or nothing.
  std::string compare(sim::Device& device) const;

 private:
  void follow_nmt(std::uint8_t node, const can::Frame& frame);
  void follow_guarding(sim::Device& device, const can::Frame& frame);
  void follow_mpdo(sim::Device& device, const can::Frame& frame);

  bool mpdo_;
  std::uint8_t mpdo_of_;
  std::uint32_t value_ = 0;                  // of 2F01h
  std::uint32_t followed_ = 0;               // of 2F02h
  Instant guarded_until_ = kNever;           // by then the next guard request
  std::vector<Instant> guarding_lost_;       // when it ought to be
  std::vector<Instant> guarding_lost_told_;  // when the device said so
};

}  // namespace linegate::plant
