// SPDX-License-Identifier: Apache-2.0
// The LSS slave of one of the line's own devices, and the storage of its node-ID. Private to
// stack/line.
#pragma once

#include <cstdint>

#include "stack/can/transmit_queue.h"
#include "stack/lss/slave.h"
#include "stack/storage/medium.h"

namespace linegate::line {

class DeviceLss final : public lss::SlaveHost {
 public:
  // bit_rate: of the line in bit/s, the only one that the device accepts; 0 = accepts none.
  DeviceLss(const lss::Address& address, std::uint32_t bit_rate);

  // Stores node-ID and bit timing, 1 byte each (see lss::Settings); must outlive this object.
  // Without a medium `store` is not supported. Unreadable data counts as nothing stored.
  void set_medium(storage::Medium* medium) { medium_ = medium; }
  void medium_done(bool good);
  void power_on();

  lss::Slave& slave() { return slave_; }
  const lss::Slave& slave() const { return slave_; }
  can::TransmitQueue& answers() { return answers_; }
  const can::TransmitQueue& answers() const { return answers_; }
  bool has_node_id() const { return slave_.active_node_id() != lss::kNoNodeId; }

  // lss::SlaveHost. The bit rate of the interface is not changed.
  lss::StoreResult store(const lss::Settings& settings) override;
  bool has_bit_timing(std::uint8_t index) const override;

 private:
  lss::Slave slave_;
  can::TransmitQueue answers_;
  std::uint32_t bit_rate_;
  storage::Medium* medium_ = nullptr;
};

}  // namespace linegate::line
