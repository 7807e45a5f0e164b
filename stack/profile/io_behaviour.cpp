#include "stack/profile/io_behaviour.h"

#include <cstdlib>

namespace linegate::profile {
namespace {

constexpr std::uint16_t kDigitalInputs = 0x6000;
constexpr std::uint16_t kDigitalInterrupts = 0x6005;
constexpr std::uint16_t kAnyChange = 0x6006;
constexpr std::uint16_t kLowToHigh = 0x6007;
constexpr std::uint16_t kHighToLow = 0x6008;
constexpr std::uint16_t kDigitalOutputs = 0x6200;
constexpr std::uint16_t kDigitalErrorMode = 0x6206;
constexpr std::uint16_t kDigitalErrorValue = 0x6207;
constexpr std::uint16_t kAnalogueInputs = 0x6401;
constexpr std::uint16_t kAnalogueOutputs = 0x6411;
constexpr std::uint16_t kAnalogueInterrupts = 0x6423;
constexpr std::uint16_t kAnalogueDelta = 0x6426;
constexpr std::uint16_t kAnalogueErrorMode = 0x6443;
constexpr std::uint16_t kAnalogueErrorValue = 0x6444;

}  // namespace

bool IoBehaviour::tells(od::Address input, std::uint64_t before, std::uint64_t now) {
  switch (input.index) {
    case kDigitalInputs:
      return digital_tells(input.sub, before, now);
    case kAnalogueInputs:
      return analogue_tells(input.sub, now);
    default:
      return true;
  }
}

bool IoBehaviour::digital_tells(std::uint8_t sub, std::uint64_t before, std::uint64_t now) const {
  if (dictionary_.number({kDigitalInterrupts, 0}).value_or(1) == 0) {
    return false;
  }
  const auto any = dictionary_.number({kAnyChange, sub});
  const auto rising = dictionary_.number({kLowToHigh, sub});
  const auto falling = dictionary_.number({kHighToLow, sub});
  if (!any && !rising && !falling) {
    return true;
  }
  return ((before ^ now) & any.value_or(0)) != 0 || (~before & now & rising.value_or(0)) != 0 ||
         (before & ~now & falling.value_or(0)) != 0;
}

bool IoBehaviour::analogue_tells(std::uint8_t sub, std::uint64_t now) {
  if (dictionary_.number({kAnalogueInterrupts, 0}).value_or(1) == 0) {
    return false;
  }
  const auto value = static_cast<std::int16_t>(static_cast<std::uint16_t>(now));
  const auto delta =
      static_cast<std::int64_t>(dictionary_.number({kAnalogueDelta, sub}).value_or(0));
  const auto [last, first] = told_.try_emplace(sub, value);
  if (!first && std::abs(std::int64_t{value} - last->second) <= delta && delta != 0) {
    return false;
  }
  last->second = value;
  return true;
}

void IoBehaviour::take_error_values() {
  const std::uint8_t digitals = dictionary_.highest_sub(kDigitalOutputs).value_or(0);
  for (unsigned i = 1; i <= digitals; ++i) {
    const auto sub = static_cast<std::uint8_t>(i);
    const auto mode = dictionary_.number({kDigitalErrorMode, sub});
    const auto wanted = dictionary_.number({kDigitalErrorValue, sub});
    const auto value = dictionary_.number({kDigitalOutputs, sub});
    if (mode && wanted && value) {
      dictionary_.set({kDigitalOutputs, sub}, (*value & ~*mode & 0xFFU) | (*wanted & *mode));
    }
  }
  const std::uint8_t analogues = dictionary_.highest_sub(kAnalogueOutputs).value_or(0);
  for (unsigned i = 1; i <= analogues; ++i) {
    const auto sub = static_cast<std::uint8_t>(i);
    const auto wanted = dictionary_.number({kAnalogueErrorValue, sub});
    if (wanted && dictionary_.number({kAnalogueErrorMode, sub}).value_or(0) == 1) {
      dictionary_.set({kAnalogueOutputs, sub}, static_cast<std::uint16_t>(*wanted));
    }
  }
}

}  // namespace linegate::profile
