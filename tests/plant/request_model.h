// SPDX-License-Identifier: Apache-2.0
// The frames that a device may send only on request: its TPDOs of transmission type 252 (sampled at
// SYNC) and 253, of a simulated device and of an own device.
//
// The invariant, after each step of a world:
//   1. Such a TPDO is submitted only if the device has received a remote frame with its COB-ID
//      since the previous frame of the TPDO.
//   2. It is submitted in the same step, if the device was Operational and its controller has room;
//      else when there is room, as long as the device is Operational.
//   3. It carries the newest values: for type 253 the values when the newest remote frame was
//      received, for type 252 the values at the newest SYNC that was received in Operational
//      (before the first SYNC as for type 253). Values that the device itself changes at that
//      instant may be those before or after the change.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "stack/can/frame.h"
#include "stack/od/description.h"
#include "stack/pdo/parameters.h"

namespace linegate::plant {

class RequestModel {
 public:
  // The present state of the device.
  struct Producer {
    bool is_operational = false;
    // Whether the PDO is as in the device file
    std::function<bool(const pdo::Parameters&)> is_configured;
    std::function<std::uint64_t(od::Address)> value;
  };

  // Considers the TPDOs that have such a type in the device file.
  explicit RequestModel(const od::DeviceDescription& file);
  bool any() const { return !pdos_.empty(); }

  // Call it before the device receives the frame.
  void before_receive(const Producer& producer, const can::Frame& frame);
  // Call it after the device received the frame.
  void after_receive(const Producer& producer, const can::Frame& frame);
  // Call it when the device submits the frame to the bus. Returns a description of the violated
  // rule, or nothing.
  std::string submitted(const Producer& producer, const can::Frame& frame);
  // Call it after the device submitted its frames. has_room: whether its controller has room.
  std::string after_turn(const Producer& producer, bool has_room);

  // Number of PDOs that were submitted on request.
  std::uint64_t answered() const { return answered_; }

 private:
  struct Sample {
    std::uint64_t before = 0;
    std::uint64_t after = 0;
  };
  struct Pdo {
    pdo::Parameters file;
    bool requested = false;
    Sample at_request;
    std::optional<Sample> at_sync;
    std::optional<Sample> at_doubtful;  // at a SYNC of wrong length, which may count or not
  };

  static void forget(Pdo& pdo);
  static const Sample& newest(const Pdo& pdo);
  static bool is_newest(const Pdo& pdo, std::uint64_t value);
  std::string name(const Pdo& pdo) const;

  std::uint8_t node_;
  std::vector<Pdo> pdos_;
  std::uint64_t answered_ = 0;
};

}  // namespace linegate::plant
