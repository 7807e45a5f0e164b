// SPDX-License-Identifier: Apache-2.0
#include "stack/emcy/error_history.h"

#include <algorithm>

#include "stack/base/byte_order.h"
#include "stack/od/objects.h"

namespace linegate::emcy {

ErrorHistory::ErrorHistory(od::Dictionary& dictionary) : dictionary_(dictionary) {
}

void ErrorHistory::add(const Message& message) {
  const std::uint8_t depth = dictionary_.highest_sub(od::objects::kErrorHistory).value_or(0);
  if (depth == 0) {
    return;
  }
  const std::uint8_t filled = std::min<std::uint8_t>(depth, static_cast<std::uint8_t>(count() + 1));
  for (std::uint8_t sub = filled; sub > 1; --sub) {
    const od::Address newer{od::objects::kErrorHistory, static_cast<std::uint8_t>(sub - 1)};
    dictionary_.set({od::objects::kErrorHistory, sub}, dictionary_.number(newer).value_or(0));
  }
  const std::uint32_t additional = load_le<std::uint16_t>(message.info.data());
  dictionary_.set({od::objects::kErrorHistory, 1}, additional << 16U | message.code);
  dictionary_.set({od::objects::kErrorHistory, 0}, filled);
}

void ErrorHistory::clear() {
  dictionary_.set({od::objects::kErrorHistory, 0}, 0);
}

std::uint8_t ErrorHistory::count() const {
  return static_cast<std::uint8_t>(dictionary_.number({od::objects::kErrorHistory, 0}).value_or(0));
}

AbortCode ErrorHistory::before_read(od::Address address, const od::Variable& /*variable*/) {
  return address.sub > count() ? AbortCode::no_data : AbortCode::none;
}

AbortCode ErrorHistory::check_write(od::Address address, std::span<const std::byte> value) {
  return address.sub == 0 && load_le(value) != 0 ? AbortCode::invalid_value : AbortCode::none;
}

void ErrorHistory::written(od::Address address) {
  if (address.sub == 0 && count() == 0) {
    wipe_entries();
  }
}

void ErrorHistory::wipe_entries() {
  const unsigned depth = dictionary_.highest_sub(od::objects::kErrorHistory).value_or(0);
  for (unsigned sub = 1; sub <= depth; ++sub) {
    dictionary_.set({od::objects::kErrorHistory, static_cast<std::uint8_t>(sub)}, 0);
  }
}

}  // namespace linegate::emcy
