// SPDX-License-Identifier: Apache-2.0
#include "stack/sync/service.h"

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/od/objects.h"

namespace linegate::sync {

Service::Service(const od::Dictionary& dictionary, can::Dispatch& dispatch,
                 can::TransmitQueue& transmit, EventLog& events)
    : dictionary_(dictionary), producer_(transmit), consumer_(dispatch, events) {
}

void Service::configure() {
  parameters_ = read_parameters(dictionary_);
  producer_.configure(parameters_);
  consumer_.configure(parameters_);
}

void Service::set_active(bool active) {
  producer_.set_active(active);
  consumer_.set_active(active);
}

std::optional<std::uint8_t> Service::advance(Instant now) {
  consumer_.advance(now);
  return producer_.advance(now);
}

AbortCode Service::check_write(od::Address address, std::span<const std::byte> value) {
  const bool produce = address.index == od::objects::kSyncCobId &&
                       value.size() == sizeof(std::uint32_t) &&
                       (load_le<std::uint32_t>(value.data()) & can::CobId::kProducerBit) != 0;
  if (produce && !dictionary_.has_object(od::objects::kSyncPeriod)) {
    return AbortCode::invalid_value;
  }
  return sync::check_write(parameters_, address, value);
}

// The window affects PDOs only: SYNC continues unchanged.
void Service::written(od::Address address) {
  if (address.index == od::objects::kSyncWindow) {
    parameters_ = read_parameters(dictionary_);
    return;
  }
  configure();
}

}  // namespace linegate::sync
