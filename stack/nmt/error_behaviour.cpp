// SPDX-License-Identifier: Apache-2.0
#include "stack/nmt/error_behaviour.h"

#include "stack/base/byte_order.h"
#include "stack/od/objects.h"

namespace linegate::nmt {
namespace {

enum class Behaviour : std::uint8_t { pre_operational, no_change, stopped };

}  // namespace

std::optional<Command> ErrorBehaviour::reaction(std::uint8_t error_class, State state) const {
  const auto behaviour = static_cast<Behaviour>(
      dictionary_.number({od::objects::kErrorBehaviour, error_class}).value_or(0));
  switch (behaviour) {
    case Behaviour::no_change:
      return std::nullopt;
    case Behaviour::stopped:
      return state == State::stopped ? std::nullopt : std::optional(Command::stop);
    case Behaviour::pre_operational:
      break;
  }
  return state == State::operational ? std::optional(Command::enter_pre_operational) : std::nullopt;
}

AbortCode ErrorBehaviour::check_write(od::Address address, std::span<const std::byte> value) {
  const bool known = load_le(value) <= static_cast<std::uint8_t>(Behaviour::stopped);
  return address.sub == 0 || known ? AbortCode::none : AbortCode::invalid_value;
}

}  // namespace linegate::nmt
