// SPDX-License-Identifier: Apache-2.0
#include "stack/observer/learned_parameters.h"

#include <algorithm>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/od/objects.h"

namespace linegate::observer {
namespace {

// Values that are written to 1010h and 1011h (CiA 301, 7.5.2.13 and 7.5.2.14).
constexpr std::uint32_t kSave = 0x6576'6173;
constexpr std::uint32_t kLoad = 0x6461'6F6C;
constexpr std::uint8_t kAllParameters = 1;
constexpr std::uint8_t kCommunicationParameters = 2;
constexpr std::uint8_t kFirstOfManufacturer = 4;
constexpr std::uint32_t kStoresItself = 2;  // in the value that is read; bits 2 to 31 are reserved
constexpr std::uint32_t kStorage = 3;

std::uint32_t number_in(std::span<const std::byte> value) {
  return value.size() == sizeof(std::uint32_t) ? load_le<std::uint32_t>(value.data()) : 0;
}

// Bit 30 of the COB-ID of a PDO is that of the device, whatever its file says.
bool is_same(od::Address address, std::span<const std::byte> a, std::span<const std::byte> b) {
  const bool is_cob_id = od::objects::is_pdo_communication(address.index) && address.sub == 1 &&
                         a.size() == sizeof(std::uint32_t) && b.size() == a.size();
  return is_cob_id ? ((number_in(a) ^ number_in(b)) & ~can::CobId::kNoRtrBit) == 0
                   : std::ranges::equal(a, b);
}

bool is_of_communication(std::uint8_t sub) {
  return sub == kAllParameters || sub == kCommunicationParameters;
}

}  // namespace

LearnedParameters::LearnedParameters(const od::DeviceDescription& device) {
  for (const std::uint8_t sub : {kAllParameters, kCommunicationParameters}) {
    const od::Address address{od::objects::kStoreParameters, sub};
    if (const od::VariableDescription* const found = device.find(address)) {
      follow_storage(address, found->value, Seen::read);
    }
  }
}

void LearnedParameters::follow_storage(od::Address address, std::span<const std::byte> value,
                                       Seen seen) {
  const std::uint32_t number = number_in(value);
  if (address.index == od::objects::kStoreParameters && seen == Seen::read) {
    const bool itself = (number & kStoresItself) != 0 && (number & ~kStorage) == 0;
    stores_itself_ = stores_itself_ || (itself && is_of_communication(address.sub));
  } else if (address.index == od::objects::kStoreParameters && number == kSave) {
    store(address.sub);
  } else if (address.index == od::objects::kRestoreDefaults && seen == Seen::written &&
             number == kLoad) {
    restore(address.sub);
  }
}

LearnedParameters::Parameter& LearnedParameters::parameter(od::Address address,
                                                           std::span<const std::byte> from_file) {
  auto found = parameters_.find(address);
  if (found == parameters_.end()) {
    const Value file(from_file.begin(), from_file.end());
    found = parameters_.emplace(address, Parameter{file, file, file}).first;
  }
  return found->second;
}

bool LearnedParameters::learn(od::Address address, std::span<const std::byte> value,
                              std::span<const std::byte> from_file, Seen seen) {
  Parameter& parameter = this->parameter(address, from_file);
  note_stored(parameter, address, value, seen);
  const bool same = std::ranges::equal(parameter.present, value);
  parameter.present.assign(value.begin(), value.end());
  return std::exchange(parameter.unknown, false) || !same;
}

void LearnedParameters::note_stored(Parameter& parameter, od::Address address,
                                    std::span<const std::byte> value, Seen seen) const {
  if (seen == Seen::written) {
    parameter.written = true;
    if (stores_itself_) {
      parameter.stored.reset();
    }
  } else if (restored_) {
    return;
  } else if (!parameter.written && booted_) {
    parameter.stored.emplace(value.begin(), value.end());
    parameter.confirmed = true;
  } else if (!parameter.written && parameter.stored) {
    if (is_same(address, *parameter.stored, value)) {
      parameter.stored->assign(value.begin(), value.end());
    } else {
      parameter.stored.reset();
    }
  }
}

bool LearnedParameters::refutes_stored(od::Address address, std::span<const std::byte> value,
                                       std::span<const std::byte> from_file, Seen seen) const {
  if (seen != Seen::read || restored_) {
    return false;
  }
  const auto found = parameters_.find(address);
  if (found == parameters_.end()) {
    return !from_file.empty() && !is_same(address, value, from_file);
  }
  const Parameter& parameter = found->second;
  return !parameter.written && parameter.stored && !parameter.stored->empty() &&
         !is_same(address, value, *parameter.stored);
}

void LearnedParameters::doubt(od::Address address, std::span<const std::byte> from_file) {
  Parameter& parameter = this->parameter(address, from_file);
  if (parameter.confirmed) {
    return;
  }
  parameter.stored.reset();
  parameter.unknown = parameter.unknown || (booted_ && !parameter.written);
}

// 1010h. Sub-index 3: parameters of the application, to which these do not belong.
void LearnedParameters::store(std::uint8_t sub) {
  restored_ = restored_ && !is_of_communication(sub);
  for (auto& [address, parameter] : parameters_) {
    if (is_of_communication(sub)) {
      parameter.stored = parameter.unknown ? std::nullopt : std::optional(parameter.present);
      parameter.confirmed = parameter.confirmed || parameter.written;
    } else if (sub >= kFirstOfManufacturer && parameter.stored &&
               !is_same(address, *parameter.stored, parameter.present)) {
      parameter.stored.reset();
    }
  }
}

// 1011h. The present values remain until the reset.
void LearnedParameters::restore(std::uint8_t sub) {
  restored_ = restored_ || is_of_communication(sub);
  for (auto& [address, parameter] : parameters_) {
    if (is_of_communication(sub)) {
      parameter.stored = parameter.file;
    } else if (sub >= kFirstOfManufacturer && parameter.stored &&
               !is_same(address, *parameter.stored, parameter.file)) {
      parameter.stored.reset();
    }
  }
}

void LearnedParameters::reset() {
  restored_ = false;
  for (auto& [address, parameter] : parameters_) {
    parameter.written = false;
    parameter.confirmed = false;
    parameter.unknown = !parameter.stored;
    if (parameter.stored) {
      parameter.present = *parameter.stored;
    }
  }
}

void LearnedParameters::boot_up() {
  booted_ = true;
  reset();
}

bool LearnedParameters::is_known(std::uint16_t index, std::uint8_t last) const {
  return std::none_of(parameters_.lower_bound({index, 0}), parameters_.upper_bound({index, last}),
                      [](const auto& entry) { return entry.second.unknown; });
}

}  // namespace linegate::observer
