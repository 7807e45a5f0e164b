// SPDX-License-Identifier: Apache-2.0
#include "stack/sync/parameters.h"

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/od/objects.h"

namespace linegate::sync {
namespace {

constexpr std::uint32_t kIdentifierBits = 0x3FFF'FFFF;  // with the frame format
constexpr std::uint8_t kHighestOverflow = 240;

AbortCode check_cob_id(const Parameters& present, can::CobId wanted) {
  const bool same_id = (present.cob_id.raw & kIdentifierBits) == (wanted.raw & kIdentifierBits);
  if (present.is_producer() && !same_id) {
    return AbortCode::invalid_value;
  }
  return can::has_allowed_id(wanted) ? AbortCode::none : AbortCode::invalid_value;
}

AbortCode check_overflow(const Parameters& present, std::uint64_t wanted) {
  if (wanted == present.overflow) {
    return AbortCode::none;
  }
  if (present.period != Duration::zero()) {
    return AbortCode::device_state;
  }
  return wanted == 1 || wanted > kHighestOverflow ? AbortCode::invalid_value : AbortCode::none;
}

}  // namespace

Parameters read_parameters(const od::Dictionary& dictionary) {
  Parameters out;
  out.exists = dictionary.has_object(od::objects::kSyncCobId);
  out.cob_id.raw =
      static_cast<std::uint32_t>(dictionary.number({od::objects::kSyncCobId, 0}).value_or(0));
  out.period =
      std::chrono::microseconds(dictionary.number({od::objects::kSyncPeriod, 0}).value_or(0));
  out.window =
      std::chrono::microseconds(dictionary.number({od::objects::kSyncWindow, 0}).value_or(0));
  out.overflow = static_cast<std::uint8_t>(
      dictionary.number({od::objects::kSyncCounterOverflow, 0}).value_or(0));
  return out;
}

AbortCode check_write(const Parameters& present, od::Address address,
                      std::span<const std::byte> value) {
  const std::uint64_t wanted = load_le(value);
  switch (address.index) {
    case od::objects::kSyncCobId:
      return check_cob_id(present, can::CobId{static_cast<std::uint32_t>(wanted)});
    case od::objects::kSyncCounterOverflow:
      return check_overflow(present, wanted);
    default:
      return AbortCode::none;
  }
}

}  // namespace linegate::sync
