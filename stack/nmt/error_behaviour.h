// SPDX-License-Identifier: Apache-2.0
// Object 1029h, error behaviour (CiA 301, 7.5.2.32): the NMT state after an error.
//   sub 1      U8  communication error: bus-off, loss of a heartbeat, life guarding
//   sub 2..254 U8  errors of the device, as numbered by its profile
// 0 = Pre-operational if Operational, 1 = no change, 2 = Stopped; a missing sub-index counts as 0.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "stack/nmt/state.h"
#include "stack/od/dictionary.h"

namespace linegate::nmt {

inline constexpr std::uint8_t kCommunicationError = 1;

class ErrorBehaviour final : public od::Hook {
 public:
  // dictionary must outlive this object. The owner sets the hook.
  explicit ErrorBehaviour(const od::Dictionary& dictionary) : dictionary_(dictionary) {}

  // The command that the node has to apply to itself when an error of that class (sub-index of
  // 1029h) occurs in `state`; nothing if its state does not change.
  std::optional<Command> reaction(std::uint8_t error_class, State state) const;

  // Returns invalid_value for values above 2, which are reserved or manufacturer-specific.
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;

 private:
  const od::Dictionary& dictionary_;
};

}  // namespace linegate::nmt
