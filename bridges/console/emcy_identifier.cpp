// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/emcy_identifier.h"

#include <span>

#include "stack/base/byte_order.h"
#include "stack/line/build.h"
#include "stack/od/objects.h"

namespace linegate::console {
namespace {

constexpr od::Address kEmcyCobIdObject{od::objects::kEmcyCobId, 0};

}  // namespace

bool stores_by_itself(const od::DeviceDescription& device) {
  constexpr std::uint64_t kByItself = 2;
  for (const std::uint8_t sub : {std::uint8_t{1}, std::uint8_t{2}}) {
    const auto* const storage = device.find({od::objects::kStoreParameters, sub});
    if (storage != nullptr && storage->value.size() == sizeof(std::uint32_t) &&
        (load_le(std::span(storage->value)) & kByItself) != 0) {
      return true;
    }
  }
  return false;
}

EmcyIdentifier::EmcyIdentifier(const line::NodeConfig* device) {
  if (device != nullptr) {
    learned_ = observer::LearnedParameters(device->device);
    stores_by_itself_ = stores_by_itself(device->device);
    configured_.resize(sizeof(std::uint32_t));
    store_le(std::span(configured_), std::uint64_t{line::emcy_cob_id(*device).raw});
  }
}

void EmcyIdentifier::follow(const observer::Transfer& transfer) {
  using Seen = observer::LearnedParameters::Seen;
  const Seen seen = transfer.download ? Seen::written : Seen::read;
  learned_.follow_storage(transfer.address, transfer.kept(), seen);
  if (transfer.address.index == od::objects::kStoreParameters && transfer.download) {
    stored_doubted_ = doubted_;
  }
  if (transfer.address == kEmcyCobIdObject && transfer.size == sizeof(std::uint32_t)) {
    (void)learned_.learn(transfer.address, transfer.kept(), configured_, seen);
    doubted_ = false;
    stored_doubted_ = stored_doubted_ && !stores_by_itself_;
  }
}

void EmcyIdentifier::doubt() {
  doubted_ = true;
  stored_doubted_ = stored_doubted_ || stores_by_itself_;
}

void EmcyIdentifier::reset() {
  learned_.reset();
  doubted_ = stored_doubted_;
}

void EmcyIdentifier::boot_up() {
  learned_.boot_up();
  doubted_ = stored_doubted_;
}

std::optional<can::CobId> EmcyIdentifier::cob_id() const {
  if (doubted_ || !learned_.is_known(od::objects::kEmcyCobId, 0)) {
    return std::nullopt;
  }
  std::vector<std::byte> value = configured_;
  learned_.for_each([&value](od::Address address, const auto& present) {
    if (address == kEmcyCobIdObject) {
      value = present;
    }
  });
  if (value.size() != sizeof(std::uint32_t)) {
    return std::nullopt;
  }
  return can::CobId{load_le<std::uint32_t>(value.data())};
}

}  // namespace linegate::console
