// SPDX-License-Identifier: Apache-2.0
#include "stack/storage/storage.h"

#include <algorithm>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/od/objects.h"
#include "stack/storage/parameters.h"

namespace linegate::storage {
namespace {

constexpr std::uint32_t kOnCommand = 1;

}  // namespace

Storage::Storage(od::Dictionary& dictionary, std::uint8_t node_id)
    : dictionary_(dictionary), node_id_(node_id), configuration_(dictionary) {
}

Damage Storage::load() {
  stored_.clear();
  if (medium_ == nullptr) {
    return Damage::none;
  }
  std::vector<std::byte> image;
  if (!medium_->read(image)) {
    return Damage::unreadable;
  }
  std::vector<StoredValue> values;
  const Damage damage = decode(image, owner(), values);
  if (damage != Damage::none) {
    return damage;
  }
  if (!usable(values)) {
    return Damage::unusable;
  }
  stored_ = std::move(values);
  return Damage::none;
}

bool Storage::apply(bool whole_node) {
  for (const StoredValue& value : stored_) {
    if (whole_node || covers(kCommunication, value.address.index)) {
      dictionary_.restore(value.address, value.data);
    }
  }
  configuration_.values_reset(whole_node);
  return !stored_.empty();
}

Owner Storage::owner() const {
  Owner out{.node_id = node_id_};
  for (std::uint8_t i = 0; i < out.identity.size(); ++i) {
    const auto number =
        dictionary_.number({od::objects::kIdentity, static_cast<std::uint8_t>(i + 1)});
    out.identity[i] = static_cast<std::uint32_t>(number.value_or(0));
  }
  return out;
}

bool Storage::usable(std::span<const StoredValue> values) const {
  return std::ranges::all_of(values, [this](const StoredValue& value) {
    const auto variable = dictionary_.find(value.address);
    const std::size_t size = value.data.size();
    return variable && variable->store &&
           (od::byte_size(variable->type) != 0 ? size == variable->size
                                               : size <= variable->capacity);
  });
}

AbortCode Storage::before_read(od::Address address, const od::Variable& variable) {
  if (address.sub != 0 && variable.size == sizeof kOnCommand) {
    store_le(variable.data, medium_ != nullptr && is_group(address.sub) ? kOnCommand : 0U);
  }
  return AbortCode::none;
}

AbortCode Storage::check_write(od::Address address, std::span<const std::byte> value) {
  const std::uint32_t signature = address.index == od::objects::kStoreParameters ? kSave : kLoad;
  if (medium_ == nullptr || !is_group(address.sub) || value.size() != sizeof signature ||
      load_le(value) != signature) {
    return AbortCode::cannot_transfer;
  }
  if (pending_) {
    return AbortCode::device_state;
  }
  return medium_->slow() ? od::kLater : AbortCode::none;
}

// Not in written(): the medium may fail, and then the write is refused. A slow medium has already
// finished its work.
AbortCode Storage::execute_write(od::Address address, std::span<const std::byte> /*value*/) {
  if (medium_ == nullptr) {
    return AbortCode::cannot_transfer;
  }
  if (medium_->slow()) {
    return AbortCode::none;
  }
  std::vector<StoredValue> values = wanted(address);
  if (!medium_->keep(encode(owner(), values))) {
    return AbortCode::hardware;
  }
  stored_ = std::move(values);
  ++kept_;
  return AbortCode::none;
}

void Storage::put_off(od::Address address, od::Ticket ticket) {
  LINEGATE_ASSERT(medium_ != nullptr && !pending_, "check_write() found the medium free");
  std::vector<StoredValue> values = wanted(address);
  if (!medium_->keep(encode(owner(), values))) {
    (void)dictionary_.complete(ticket, AbortCode::hardware);
    return;
  }
  pending_ = Pending{std::move(values), ticket};
}

// The medium continues its work; only the answer is no longer needed.
void Storage::cancelled(od::Ticket ticket) {
  if (pending_ && pending_->ticket == ticket) {
    pending_->ticket = 0;
  }
}

void Storage::done(bool good) {
  if (!pending_) {
    return;
  }
  const od::Ticket ticket = pending_->ticket;
  if (good) {
    stored_ = std::move(pending_->values);
    ++kept_;
  }
  pending_.reset();
  if (ticket != 0) {
    (void)dictionary_.complete(ticket, good ? AbortCode::none : AbortCode::hardware);
  }
}

std::vector<StoredValue> Storage::wanted(od::Address address) {
  std::vector<StoredValue> values = stored_without(address.sub);
  if (address.index == od::objects::kRestoreDefaults) {
    return values;
  }
  configuration_.refresh();
  for (const od::Address parameter : dictionary_.stored(0x0001, 0xFFFF)) {
    if (covers(address.sub, parameter.index)) {
      const od::Variable variable = *dictionary_.find(parameter);
      values.push_back({parameter, {variable.data, variable.data + variable.size}});
      if (adjust_) {
        adjust_(values.back());
      }
    }
  }
  std::ranges::sort(values, {}, &StoredValue::address);
  return values;
}

std::vector<StoredValue> Storage::stored_without(std::uint8_t group) const {
  std::vector<StoredValue> out;
  std::ranges::copy_if(stored_, std::back_inserter(out), [group](const StoredValue& value) {
    return !covers(group, value.address.index);
  });
  return out;
}

}  // namespace linegate::storage
