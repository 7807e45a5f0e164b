// SPDX-License-Identifier: Apache-2.0
// The LSS slave of a device of the line's own, and where its node-ID is kept. Private to
// stack/line.
#pragma once

#include <cstdint>

#include "stack/can/transmit_queue.h"
#include "stack/lss/slave.h"
#include "stack/storage/medium.h"

namespace linegate::line {

class DeviceLss final : public lss::SlaveHost {
 public:
  // bit_rate: that of the line in bit/s, the only one the device can have; 0 = none may be set.
  DeviceLss(const lss::Address& address, std::uint32_t bit_rate);

  // Keeps node-ID and bit timing, 1 byte each (see lss::Settings); must outlive it. Without one
  // `store` is not supported. What cannot be read counts as nothing kept.
  void set_medium(storage::Medium* medium) { medium_ = medium; }
  void medium_done(bool good);
  void power_on();

  lss::Slave& slave() { return slave_; }
  const lss::Slave& slave() const { return slave_; }
  can::TransmitQueue& answers() { return answers_; }
  const can::TransmitQueue& answers() const { return answers_; }
  bool has_node_id() const { return slave_.active_node_id() != lss::kNoNodeId; }

  // lss::SlaveHost. The bit rate itself is set where the interface is.
  lss::StoreResult store(const lss::Settings& settings) override;
  bool has_bit_timing(std::uint8_t index) const override;

 private:
  lss::Slave slave_;
  can::TransmitQueue answers_;
  std::uint32_t bit_rate_;
  storage::Medium* medium_ = nullptr;
};

}  // namespace linegate::line
