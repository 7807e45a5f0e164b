// SPDX-License-Identifier: Apache-2.0
#include "bridges/sim/behaviour.h"

#include <utility>

#include "stack/base/assert.h"

namespace linegate::sim {

void Behaviour::attach(node::Node& node, std::uint64_t seed) {
  node_ = &node;
  seed_ = seed;
  set_hooks();
  power_on();
}

void Behaviour::run(Instant now) {
  now_ = now;
  if (std::exchange(touched_, false)) {
    react();
  }
  if (next_step() <= now) {
    step();
  }
}

void Behaviour::rpdo_received(std::uint16_t /*number*/, Instant /*now*/) {
  touched_ = true;
}

void Behaviour::written(od::Address /*address*/) {
  touched_ = touched_ || !writing_;
}

void Behaviour::reset(bool whole_node, Instant now) {
  now_ = now;
  reset_ = whole_node || reset_.value_or(false);
  if (whole_node) {
    power_on();
    touched_ = false;
  }
}

void Behaviour::hook(std::uint16_t index) {
  LINEGATE_ASSERT(node_->dictionary().set_hook(index, this).ok(), "the profile has the object");
}

std::uint64_t Behaviour::unsigned_value(od::Address address) {
  return node_->dictionary().number(address).value_or(0);
}

std::int64_t Behaviour::signed_value(od::Address address) {
  const auto variable = node_->dictionary().find(address);
  if (!variable || variable->size == 0 || variable->size > 8) {
    return 0;
  }
  const unsigned shift = 64 - 8 * variable->size;
  return static_cast<std::int64_t>(unsigned_value(address) << shift) >> shift;
}

bool Behaviour::has_sub(od::Address address) {
  return node_->dictionary().find(address).has_value();
}

std::uint64_t Behaviour::mask(od::Address address) {
  const auto variable = node_->dictionary().find(address);
  const unsigned bits = variable ? 8 * variable->size : 0;
  return bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
}

}  // namespace linegate::sim
