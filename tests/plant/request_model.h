// SPDX-License-Identifier: Apache-2.0
// What a device may send on request alone: its TPDOs of transmission type 252 (sampled at SYNC) and
// 253, of a simulated device and of one of ours.
//
// The invariant, after each step of a world:
//   1. Such a TPDO is submitted only after the device received a remote frame with its COB-ID,
//   since
//      the frame of the TPDO before.
//   2. It is submitted in the same step, if the device was Operational and its controller has
//      room; else when there is room, as long as the device is Operational.
//   3. It carries the newest values: of type 253 those of the time when the newest remote frame was
//      received, of type 252 those of the newest SYNC that was received in Operational (before the
//      first one as of type 253). Values that the device itself moves at that instant may be those
//      before or after.
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
  // The device as it is now.
  struct Producer {
    bool is_operational = false;
    std::function<bool(const pdo::Parameters&)> is_configured;  // as the device file says
    std::function<std::uint64_t(od::Address)> value;
  };

  // Of the TPDOs that the device file describes as such.
  explicit RequestModel(const od::DeviceDescription& file);
  bool any() const { return !pdos_.empty(); }

  // The device is about to receive it.
  void before_receive(const Producer& producer, const can::Frame& frame);
  // It received it.
  void after_receive(const Producer& producer, const can::Frame& frame);
  // It submits it to the bus. A sentence about what does not hold, or nothing.
  std::string submitted(const Producer& producer, const can::Frame& frame);
  // It submitted what it has. has_room: of its controller.
  std::string after_turn(const Producer& producer, bool has_room);

  // PDOs that were submitted on request.
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
    std::optional<Sample> at_doubtful;  // a SYNC of wrong length, which may count or not
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
