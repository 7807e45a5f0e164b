#include "stack/nmt/consumer_heartbeat_time.h"

#include <array>

#include "stack/base/byte_order.h"

namespace linegate::nmt {
namespace {

struct Entry {
  std::uint8_t node = 0;
  Duration time{};

  bool used() const {
    return node >= can::kMinNodeId && node <= can::kMaxNodeId && time > Duration::zero();
  }
};

Entry entry_of(std::uint64_t raw) {
  return {static_cast<std::uint8_t>(raw >> 16U), std::chrono::milliseconds(raw & 0xFFFFU)};
}

}  // namespace

ConsumerHeartbeatTime::ConsumerHeartbeatTime(const od::Dictionary& dictionary,
                                             HeartbeatConsumer& consumer)
    : dictionary_(dictionary), consumer_(consumer) {
}

void ConsumerHeartbeatTime::configure(bool restart) {
  std::array<Duration, can::kMaxNodeId + 1> times{};
  const unsigned highest = dictionary_.highest_sub(kConsumerHeartbeatTime).value_or(0);
  for (unsigned sub = 1; sub <= highest; ++sub) {
    const auto raw = dictionary_.number({kConsumerHeartbeatTime, static_cast<std::uint8_t>(sub)});
    const Entry entry = entry_of(raw.value_or(0));
    if (entry.used()) {
      times[entry.node] = entry.time;
    }
  }
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    const bool changed = consumer_.time(node) != times[node];
    if (times[node] == Duration::zero()) {
      consumer_.ignore(node);
    } else if (changed || restart) {
      consumer_.monitor(node, times[node]);
    }
  }
}

AbortCode ConsumerHeartbeatTime::check_write(od::Address address,
                                             std::span<const std::byte> value) {
  const Entry wanted = entry_of(load_le(value));
  if (address.sub == 0 || !wanted.used()) {
    return AbortCode::none;
  }
  const unsigned highest = dictionary_.highest_sub(kConsumerHeartbeatTime).value_or(0);
  for (unsigned sub = 1; sub <= highest; ++sub) {
    const auto raw = dictionary_.number({kConsumerHeartbeatTime, static_cast<std::uint8_t>(sub)});
    const Entry other = entry_of(raw.value_or(0));
    if (sub != address.sub && other.used() && other.node == wanted.node) {
      return AbortCode::parameter_incompatible;
    }
  }
  return AbortCode::none;
}

void ConsumerHeartbeatTime::written(od::Address /*address*/) {
  configure(false);
}

}  // namespace linegate::nmt
