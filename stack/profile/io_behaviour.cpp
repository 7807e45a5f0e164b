// SPDX-License-Identifier: Apache-2.0
#include "stack/profile/io_behaviour.h"

#include <algorithm>
#include <cstdlib>

#include "stack/od/objects.h"

namespace linegate::profile {
namespace {

namespace cia401 = od::objects::cia401;

// Bits of 6421h.
constexpr std::uint64_t kAboveUpper = 1;
constexpr std::uint64_t kBelowLower = 2;
constexpr std::uint64_t kChanged = 4;
constexpr std::uint64_t kDecreased = 8;
constexpr std::uint64_t kIncreased = 16;

std::int64_t integer16(std::uint64_t value) {
  return static_cast<std::int16_t>(static_cast<std::uint16_t>(value));
}

// factor and offset are 32-bit values, so the product cannot overflow.
std::uint64_t scaled(std::uint64_t value, std::int64_t factor, std::int64_t offset) {
  const std::int64_t out =
      std::clamp<std::int64_t>(integer16(value) * factor + offset, INT16_MIN, INT16_MAX);
  return static_cast<std::uint16_t>(out);
}

}  // namespace

bool IoBehaviour::is_reported(od::Address input, std::uint64_t before, std::uint64_t now) {
  switch (input.index) {
    case cia401::kDigitalInputs:
      return digital_triggers(input.sub, before, now);
    case cia401::kAnalogueInputs:
      return analogue_triggers(input.sub, now);
    default:
      return true;
  }
}

bool IoBehaviour::digital_triggers(std::uint8_t sub, std::uint64_t before,
                                   std::uint64_t now) const {
  if (dictionary_.number({cia401::kDigitalInterrupts, 0}).value_or(1) == 0) {
    return false;
  }
  const auto any = dictionary_.number({cia401::kInterruptAnyChange, sub});
  const auto rising = dictionary_.number({cia401::kInterruptLowToHigh, sub});
  const auto falling = dictionary_.number({cia401::kInterruptHighToLow, sub});
  if (!any && !rising && !falling) {
    return true;
  }
  return ((before ^ now) & any.value_or(0)) != 0 || (~before & now & rising.value_or(0)) != 0 ||
         (before & ~now & falling.value_or(0)) != 0;
}

bool IoBehaviour::analogue_triggers(std::uint8_t sub, std::uint64_t now) {
  if (dictionary_.number({cia401::kAnalogueInterrupts, 0}).value_or(1) == 0) {
    return false;
  }
  const std::int64_t value = integer16(now);
  const std::uint64_t trigger =
      dictionary_.number({cia401::kAnalogueTrigger, sub}).value_or(kChanged);
  const auto last = reported_.find(sub);
  if (!beyond_limits(sub, trigger, value) ||
      (last != reported_.end() && !differs(sub, trigger, value - last->second))) {
    return false;
  }
  reported_[sub] = static_cast<std::int16_t>(value);
  return true;
}

// Both directions: as many bits as the object has.
std::int64_t IoBehaviour::integer(std::uint16_t index, std::uint8_t sub,
                                  std::int64_t otherwise) const {
  const auto value = dictionary_.number({index, sub});
  return value ? static_cast<std::int32_t>(static_cast<std::uint32_t>(*value)) : otherwise;
}

bool IoBehaviour::beyond_limits(std::uint8_t sub, std::uint64_t trigger, std::int64_t value) const {
  if ((trigger & (kAboveUpper | kBelowLower)) == 0) {
    return true;
  }
  return ((trigger & kAboveUpper) != 0 &&
          value > integer(cia401::kAnalogueUpperLimit, sub, INT32_MAX)) ||
         ((trigger & kBelowLower) != 0 &&
          value < integer(cia401::kAnalogueLowerLimit, sub, INT32_MIN));
}

bool IoBehaviour::differs(std::uint8_t sub, std::uint64_t trigger, std::int64_t by) const {
  const auto more_than = [&](std::uint64_t bit, std::uint16_t delta, std::int64_t difference) {
    return (trigger & bit) != 0 && difference > 0 &&
           difference > static_cast<std::int64_t>(dictionary_.number({delta, sub}).value_or(0));
  };
  if ((trigger & (kChanged | kDecreased | kIncreased)) == 0) {
    return true;
  }
  return more_than(kChanged, cia401::kAnalogueDelta, std::abs(by)) ||
         more_than(kDecreased, cia401::kAnalogueNegativeDelta, -by) ||
         more_than(kIncreased, cia401::kAnaloguePositiveDelta, by);
}

std::uint64_t IoBehaviour::input_value(od::Address input, std::uint64_t terminal) const {
  if (input.index == cia401::kDigitalInputs) {
    return terminal ^ dictionary_.number({cia401::kDigitalInputPolarity, input.sub}).value_or(0);
  }
  if (input.index == cia401::kAnalogueInputs) {
    return scaled(terminal, integer(cia401::kAnalogueInputScaling, input.sub, 1),
                  integer(cia401::kAnalogueInputOffset, input.sub, 0));
  }
  return terminal;
}

std::uint64_t IoBehaviour::terminal_value(od::Address output, std::uint64_t value,
                                          std::uint64_t before) const {
  if (output.index == cia401::kDigitalOutputs) {
    const std::uint64_t changes =
        dictionary_.number({cia401::kDigitalOutputFilter, output.sub}).value_or(0xFF);
    value ^= dictionary_.number({cia401::kDigitalOutputPolarity, output.sub}).value_or(0);
    return (value & changes) | (before & ~changes);
  }
  if (output.index == cia401::kAnalogueOutputs) {
    return scaled(value, integer(cia401::kAnalogueOutputScaling, output.sub, 1),
                  integer(cia401::kAnalogueOutputOffset, output.sub, 0));
  }
  return value;
}

std::uint16_t IoBehaviour::converted_by(std::uint16_t index) {
  switch (index) {
    case cia401::kDigitalInputPolarity:
      return cia401::kDigitalInputs;
    case cia401::kDigitalOutputPolarity:
    case cia401::kDigitalOutputFilter:
      return cia401::kDigitalOutputs;
    case cia401::kAnalogueInputOffset:
    case cia401::kAnalogueInputScaling:
      return cia401::kAnalogueInputs;
    case cia401::kAnalogueOutputOffset:
    case cia401::kAnalogueOutputScaling:
      return cia401::kAnalogueOutputs;
    default:
      return 0;
  }
}

void IoBehaviour::apply_error_values() {
  const std::uint8_t digitals = dictionary_.highest_sub(cia401::kDigitalOutputs).value_or(0);
  for (unsigned i = 1; i <= digitals; ++i) {
    const auto sub = static_cast<std::uint8_t>(i);
    const auto mode = dictionary_.number({cia401::kDigitalErrorMode, sub});
    const auto wanted = dictionary_.number({cia401::kDigitalErrorValue, sub});
    const auto value = dictionary_.number({cia401::kDigitalOutputs, sub});
    if (mode && wanted && value) {
      dictionary_.set({cia401::kDigitalOutputs, sub},
                      (*value & ~*mode & 0xFFU) | (*wanted & *mode));
    }
  }
  const std::uint8_t analogues = dictionary_.highest_sub(cia401::kAnalogueOutputs).value_or(0);
  for (unsigned i = 1; i <= analogues; ++i) {
    const auto sub = static_cast<std::uint8_t>(i);
    const auto wanted = dictionary_.number({cia401::kAnalogueErrorValue, sub});
    if (wanted && dictionary_.number({cia401::kAnalogueErrorMode, sub}).value_or(0) == 1) {
      dictionary_.set({cia401::kAnalogueOutputs, sub}, static_cast<std::uint16_t>(*wanted));
    }
  }
}

}  // namespace linegate::profile
