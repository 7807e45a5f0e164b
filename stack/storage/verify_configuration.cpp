// SPDX-License-Identifier: Apache-2.0
#include "stack/storage/verify_configuration.h"

#include "stack/od/objects.h"
#include "stack/storage/parameters.h"

namespace linegate::storage {
namespace {

// FNV-1a with 64 bits.
constexpr std::uint64_t kStart = 0xCBF2'9CE4'8422'2325;

void mix(std::uint64_t& hash, std::uint64_t byte) {
  hash = (hash ^ byte) * 0x100'0000'01B3;
}

void mix_in(std::uint64_t& hash, od::Address address, std::span<const std::byte> value) {
  mix(hash, address.index & 0xFFU);
  mix(hash, address.index >> 8U);
  mix(hash, address.sub);
  mix(hash, value.size());
  for (const std::byte byte : value) {
    mix(hash, std::to_integer<std::uint64_t>(byte));
  }
}

}  // namespace

void VerifyConfiguration::values_reset(bool whole_node) {
  const Fingerprint now = fingerprint();
  configured_.communication = now.communication;
  if (whole_node) {
    configured_.others = now.others;
  }
}

void VerifyConfiguration::refresh() {
  const bool set = dictionary_.number({od::objects::kVerifyConfiguration, 1}).value_or(0) != 0 ||
                   dictionary_.number({od::objects::kVerifyConfiguration, 2}).value_or(0) != 0;
  if (set && configured_ != fingerprint()) {
    constexpr std::byte kZero[4]{};
    dictionary_.restore({od::objects::kVerifyConfiguration, 1}, kZero);
    dictionary_.restore({od::objects::kVerifyConfiguration, 2}, kZero);
  }
}

AbortCode VerifyConfiguration::before_read(od::Address /*address*/,
                                           const od::Variable& /*variable*/) {
  refresh();
  return AbortCode::none;
}

void VerifyConfiguration::written(od::Address /*address*/) {
  configured_ = fingerprint();
}

VerifyConfiguration::Fingerprint VerifyConfiguration::fingerprint() const {
  Fingerprint out{kStart, kStart};
  for (const od::Address address : dictionary_.stored(0x0001, 0xFFFF)) {
    if (address.index != od::objects::kVerifyConfiguration) {
      mix_in(covers(kCommunication, address.index) ? out.communication : out.others, address,
             dictionary_.find(address)->bytes());
    }
  }
  return out;
}

}  // namespace linegate::storage
