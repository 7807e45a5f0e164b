// SPDX-License-Identifier: Apache-2.0
#include "stack/emcy/consumer_object.h"

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/od/objects.h"

namespace linegate::emcy {

ConsumerObject::ConsumerObject(const od::Dictionary& dictionary, Consumer& consumer)
    : dictionary_(dictionary), consumer_(consumer) {
}

void ConsumerObject::configure() {
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    consumer_.listen(node, cob_id(node));
  }
}

AbortCode ConsumerObject::check_write(od::Address address, std::span<const std::byte> value) {
  if (address.sub == 0) {
    return AbortCode::none;
  }
  return can::check_cob_id(cob_id(address.sub),
                           can::CobId{static_cast<std::uint32_t>(load_le(value))});
}

void ConsumerObject::written(od::Address address) {
  consumer_.listen(address.sub, cob_id(address.sub));
}

can::CobId ConsumerObject::cob_id(std::uint8_t node) const {
  const auto raw = dictionary_.number({od::objects::kEmcyConsumer, node});
  return can::CobId{static_cast<std::uint32_t>(raw.value_or(can::CobId::kInvalidBit))};
}

}  // namespace linegate::emcy
