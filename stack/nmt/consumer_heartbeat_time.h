// SPDX-License-Identifier: Apache-2.0
// Object 1016h, consumer heartbeat time (CiA 301, 7.5.2.19): feeds a HeartbeatConsumer.
//   bits 0..15   time in ms, 0 = entry not used
//   bits 16..23  node-ID, 0 or above 127 = entry not used
//
// Nodes that another consumer of the same device monitors, a manager's, are shown in entries that
// are not used; writing such an entry, or one of the same node-ID, is as if it were not used.
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <span>

#include "stack/nmt/heartbeat_consumer.h"
#include "stack/od/dictionary.h"

namespace linegate::nmt {

// Hook of 1016h. Writes take effect at once; nodes whose time does not change are monitored on.
class ConsumerHeartbeatTime final : public od::Hook {
 public:
  // Both must outlive it. The owner sets the hook.
  ConsumerHeartbeatTime(const od::Dictionary& dictionary, HeartbeatConsumer& consumer);

  // Shows the heartbeats that `other` monitors from now on; it must outlive it. nullptr: none.
  void show(const HeartbeatConsumer* other) { other_ = other; }
  // The entries that were shown are empty again, so that nothing stores them. Call it soon after
  // each access.
  void hide(od::Dictionary& dictionary);
  bool shows() const { return shows_; }
  // Reads all entries. With restart, every monitoring starts over, as after a reset.
  void configure(bool restart);

  AbortCode before_read(od::Address address, const od::Variable& variable) override;
  // parameter_incompatible (0604 0043h) if another entry in use has the same node-ID.
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  void written(od::Address address) override;

 private:
  // Of the entry, 0 if it is not used or shows what another consumer monitors.
  std::uint64_t own_entry(unsigned sub) const;
  std::uint32_t shown_in(unsigned sub) const;

  const od::Dictionary& dictionary_;
  HeartbeatConsumer& consumer_;
  const HeartbeatConsumer* other_ = nullptr;
  bool shows_ = false;
  std::bitset<256> shown_;  // entries by sub-index whose value is that of other_
};

}  // namespace linegate::nmt
