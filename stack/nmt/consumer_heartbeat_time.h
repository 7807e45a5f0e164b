// SPDX-License-Identifier: Apache-2.0
// Object 1016h, consumer heartbeat time (CiA 301, 7.5.2.19): configures a HeartbeatConsumer.
//   bits 0..15   time in ms, 0 = entry not used
//   bits 16..23  node-ID, 0 or above 127 = entry not used
//
// Unused entries show the nodes that another consumer of the same device (the manager's) monitors.
// Writing such an entry, or one with the same node-ID, has the same effect as if the entry were
// unused.
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <span>

#include "stack/nmt/heartbeat_consumer.h"
#include "stack/od/dictionary.h"

namespace linegate::nmt {

// Hook of 1016h. Writes take effect at once; monitoring of nodes whose time is unchanged continues.
class ConsumerHeartbeatTime final : public od::Hook {
 public:
  // Both must outlive this object. The owner sets the hook.
  ConsumerHeartbeatTime(const od::Dictionary& dictionary, HeartbeatConsumer& consumer);

  // From now on shows the nodes that `other` monitors; nullptr: none. `other` must outlive this
  // object.
  void show(const HeartbeatConsumer* other) { other_ = other; }
  // Clears the shown entries, so that they are not stored (1010h). Call it soon after each access.
  void hide(od::Dictionary& dictionary);
  bool shows() const { return shows_; }
  // Reads all entries. restart: restart the monitoring of all nodes, as after a reset.
  void configure(bool restart);

  AbortCode before_read(od::Address address, const od::Variable& variable) override;
  // Returns parameter_incompatible (0604 0043h) if another used entry has the same node-ID.
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  void written(od::Address address) override;

 private:
  // The value of the entry, 0 if it is unused or shows a node of another consumer.
  std::uint64_t own_entry(unsigned sub) const;
  std::uint32_t shown_in(unsigned sub) const;

  const od::Dictionary& dictionary_;
  HeartbeatConsumer& consumer_;
  const HeartbeatConsumer* other_ = nullptr;
  bool shows_ = false;
  std::bitset<256> shown_;  // by sub-index: entries whose value is from other_
};

}  // namespace linegate::nmt
