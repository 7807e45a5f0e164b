// SPDX-License-Identifier: Apache-2.0
#include "stack/nmt/consumer_heartbeat_time.h"

#include <algorithm>
#include <array>

#include "stack/base/byte_order.h"
#include "stack/od/objects.h"

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

std::uint64_t ConsumerHeartbeatTime::own_entry(unsigned sub) const {
  const od::Address address{od::objects::kConsumerHeartbeatTime, static_cast<std::uint8_t>(sub)};
  return shown_[sub] ? 0 : dictionary_.number(address).value_or(0);
}

// The value of an unused entry: unused entries show the nodes that the other consumer monitors,
// ascending by node-ID.
std::uint32_t ConsumerHeartbeatTime::shown_in(unsigned sub) const {
  const unsigned highest = dictionary_.highest_sub(od::objects::kConsumerHeartbeatTime).value_or(0);
  std::bitset<can::kMaxNodeId + 1> own;
  unsigned place = 0;  // position of the entry among the unused ones
  for (unsigned each = 1; each <= highest; ++each) {
    const Entry entry = entry_of(own_entry(each));
    if (entry.used()) {
      own.set(entry.node);
    } else if (each < sub) {
      ++place;
    }
  }
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    const bool shown = other_->monitored(node) && !other_->guarded(node) && !own[node];
    if (shown && place-- == 0) {
      const auto ms =
          std::chrono::duration_cast<std::chrono::milliseconds>(other_->time(node)).count();
      return std::uint32_t{node} << 16U |
             static_cast<std::uint32_t>(std::min<std::int64_t>(ms, 0xFFFF));
    }
  }
  return 0;
}

AbortCode ConsumerHeartbeatTime::before_read(od::Address address, const od::Variable& variable) {
  if (other_ == nullptr || address.sub == 0 || entry_of(own_entry(address.sub)).used()) {
    return AbortCode::none;
  }
  const std::uint32_t value = shown_in(address.sub);
  shown_[address.sub] = value != 0;
  shows_ = shows_ || value != 0;
  store_le(variable.data, value);
  return AbortCode::none;
}

void ConsumerHeartbeatTime::hide(od::Dictionary& dictionary) {
  constexpr std::array<std::byte, 4> kEmpty{};
  for (unsigned sub = 1; sub < shown_.size(); ++sub) {
    if (shown_[sub]) {
      dictionary.restore({od::objects::kConsumerHeartbeatTime, static_cast<std::uint8_t>(sub)},
                         kEmpty);
    }
  }
  shown_.reset();
  shows_ = false;
}

void ConsumerHeartbeatTime::configure(bool restart) {
  if (restart) {
    shown_.reset();
  }
  std::array<Duration, can::kMaxNodeId + 1> times{};
  const unsigned highest = dictionary_.highest_sub(od::objects::kConsumerHeartbeatTime).value_or(0);
  for (unsigned sub = 1; sub <= highest; ++sub) {
    const Entry entry = entry_of(own_entry(sub));
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
  const unsigned highest = dictionary_.highest_sub(od::objects::kConsumerHeartbeatTime).value_or(0);
  for (unsigned sub = 1; sub <= highest; ++sub) {
    const Entry other = entry_of(own_entry(sub));
    if (sub != address.sub && other.used() && other.node == wanted.node) {
      return AbortCode::parameter_incompatible;
    }
  }
  return AbortCode::none;
}

void ConsumerHeartbeatTime::written(od::Address address) {
  shown_[address.sub] = false;
  configure(false);
}

}  // namespace linegate::nmt
