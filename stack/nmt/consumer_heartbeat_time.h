// Object 1016h, consumer heartbeat time (CiA 301, 7.5.2.19): feeds a HeartbeatConsumer.
//   bits 0..15   time in ms, 0 = entry not used
//   bits 16..23  node-ID, 0 or above 127 = entry not used
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "stack/nmt/heartbeat_consumer.h"
#include "stack/od/dictionary.h"

namespace linegate::nmt {

inline constexpr std::uint16_t kConsumerHeartbeatTime = 0x1016;

// Hook of 1016h. Writes take effect at once; nodes whose time does not change are monitored on.
class ConsumerHeartbeatTime final : public od::Hook {
 public:
  // Both must outlive it. The owner sets the hook.
  ConsumerHeartbeatTime(const od::Dictionary& dictionary, HeartbeatConsumer& consumer);

  // Reads all entries. With restart, every monitoring starts over, as after a reset.
  void configure(bool restart);

  // parameter_incompatible (0604 0043h) if another entry in use has the same node-ID.
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  void written(od::Address address) override;

 private:
  const od::Dictionary& dictionary_;
  HeartbeatConsumer& consumer_;
};

}  // namespace linegate::nmt
