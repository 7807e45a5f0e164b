// SPDX-License-Identifier: Apache-2.0
#include "stack/profile/io_behaviour.h"

#include <algorithm>
#include <cstdlib>

namespace linegate::profile {
namespace {

constexpr std::uint16_t kDigitalInputs = 0x6000;
constexpr std::uint16_t kInputPolarity = 0x6002;
constexpr std::uint16_t kDigitalInterrupts = 0x6005;
constexpr std::uint16_t kAnyChange = 0x6006;
constexpr std::uint16_t kLowToHigh = 0x6007;
constexpr std::uint16_t kHighToLow = 0x6008;
constexpr std::uint16_t kDigitalOutputs = 0x6200;
constexpr std::uint16_t kOutputPolarity = 0x6202;
constexpr std::uint16_t kDigitalErrorMode = 0x6206;
constexpr std::uint16_t kDigitalErrorValue = 0x6207;
constexpr std::uint16_t kOutputFilter = 0x6208;
constexpr std::uint16_t kAnalogueInputs = 0x6401;
constexpr std::uint16_t kAnalogueOutputs = 0x6411;
constexpr std::uint16_t kAnalogueTrigger = 0x6421;
constexpr std::uint16_t kAnalogueInterrupts = 0x6423;
constexpr std::uint16_t kUpperLimit = 0x6424;
constexpr std::uint16_t kLowerLimit = 0x6425;
constexpr std::uint16_t kAnalogueDelta = 0x6426;
constexpr std::uint16_t kNegativeDelta = 0x6427;
constexpr std::uint16_t kPositiveDelta = 0x6428;
constexpr std::uint16_t kInputOffset = 0x6431;
constexpr std::uint16_t kInputScaling = 0x6432;
constexpr std::uint16_t kAnalogueErrorMode = 0x6443;
constexpr std::uint16_t kAnalogueErrorValue = 0x6444;
constexpr std::uint16_t kOutputOffset = 0x6446;
constexpr std::uint16_t kOutputScaling = 0x6447;

// 6421h.
constexpr std::uint64_t kAboveUpper = 1;
constexpr std::uint64_t kBelowLower = 2;
constexpr std::uint64_t kChanged = 4;
constexpr std::uint64_t kDecreased = 8;
constexpr std::uint64_t kIncreased = 16;

std::int64_t integer16(std::uint64_t value) {
  return static_cast<std::int16_t>(static_cast<std::uint16_t>(value));
}

// Of 32 bits each: the product has room.
std::uint64_t scaled(std::uint64_t value, std::int64_t factor, std::int64_t offset) {
  const std::int64_t out =
      std::clamp<std::int64_t>(integer16(value) * factor + offset, INT16_MIN, INT16_MAX);
  return static_cast<std::uint16_t>(out);
}

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
  const std::int64_t value = integer16(now);
  const std::uint64_t trigger = dictionary_.number({kAnalogueTrigger, sub}).value_or(kChanged);
  const auto told = told_.find(sub);
  if (!beyond_limits(sub, trigger, value) ||
      (told != told_.end() && !differs(sub, trigger, value - told->second))) {
    return false;
  }
  told_[sub] = static_cast<std::int16_t>(value);
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
  return ((trigger & kAboveUpper) != 0 && value > integer(kUpperLimit, sub, INT32_MAX)) ||
         ((trigger & kBelowLower) != 0 && value < integer(kLowerLimit, sub, INT32_MIN));
}

bool IoBehaviour::differs(std::uint8_t sub, std::uint64_t trigger, std::int64_t by) const {
  const auto more_than = [&](std::uint64_t bit, std::uint16_t delta, std::int64_t difference) {
    return (trigger & bit) != 0 && difference > 0 &&
           difference > static_cast<std::int64_t>(dictionary_.number({delta, sub}).value_or(0));
  };
  if ((trigger & (kChanged | kDecreased | kIncreased)) == 0) {
    return true;
  }
  return more_than(kChanged, kAnalogueDelta, std::abs(by)) ||
         more_than(kDecreased, kNegativeDelta, -by) || more_than(kIncreased, kPositiveDelta, by);
}

std::uint64_t IoBehaviour::input_value(od::Address input, std::uint64_t terminal) const {
  if (input.index == kDigitalInputs) {
    return terminal ^ dictionary_.number({kInputPolarity, input.sub}).value_or(0);
  }
  if (input.index == kAnalogueInputs) {
    return scaled(terminal, integer(kInputScaling, input.sub, 1),
                  integer(kInputOffset, input.sub, 0));
  }
  return terminal;
}

std::uint64_t IoBehaviour::terminal_value(od::Address output, std::uint64_t value,
                                          std::uint64_t before) const {
  if (output.index == kDigitalOutputs) {
    const std::uint64_t changes = dictionary_.number({kOutputFilter, output.sub}).value_or(0xFF);
    value ^= dictionary_.number({kOutputPolarity, output.sub}).value_or(0);
    return (value & changes) | (before & ~changes);
  }
  if (output.index == kAnalogueOutputs) {
    return scaled(value, integer(kOutputScaling, output.sub, 1),
                  integer(kOutputOffset, output.sub, 0));
  }
  return value;
}

std::uint16_t IoBehaviour::converted_by(std::uint16_t index) {
  switch (index) {
    case kInputPolarity:
      return kDigitalInputs;
    case kOutputPolarity:
    case kOutputFilter:
      return kDigitalOutputs;
    case kInputOffset:
    case kInputScaling:
      return kAnalogueInputs;
    case kOutputOffset:
    case kOutputScaling:
      return kAnalogueOutputs;
    default:
      return 0;
  }
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
