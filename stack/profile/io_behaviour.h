// SPDX-License-Identifier: Apache-2.0
// What the objects of a generic I/O module (CiA 401) do, where the device has them.
#pragma once

#include <cstdint>
#include <map>

#include "stack/od/dictionary.h"

namespace linegate::profile {

class IoBehaviour {
 public:
  explicit IoBehaviour(od::Dictionary& dictionary) : dictionary_(dictionary) {}

  // An input has become another value: whether event-driven TPDOs that map it are to be sent.
  //   6000h  if 6005h is TRUE, and a bit changed that 6006h (any change), 6007h (0 to 1) or 6008h
  //          (1 to 0) names
  //   6401h  if 6423h is TRUE and what 6421h selects is true: bit 0 or 1: it is above 6424h, or
  //          below 6425h (either is enough); and bit 2, 3 or 4: from the one told last it differs
  //          by more than 6426h, is less by more than 6427h, is more by more than 6428h (a
  //          difference of 0 is any change; without 6421h bit 2)
  // Objects that are not there forbid nothing; other inputs are always told.
  bool tells(od::Address input, std::uint64_t before, std::uint64_t now);

  // Between what the application has, as at terminals, and the values of the objects:
  //   6000h  the bits that 6002h names are inverted
  //   6401h  times 6432h, plus 6431h
  //   6200h  only bits that 6208h names change, and of these those that 6202h names are inverted
  //   6411h  times 6447h, plus 6446h
  // within the limits of 16 bits. Objects that are not there change nothing, nor do other inputs
  // and outputs.
  std::uint64_t input_value(od::Address input, std::uint64_t terminal) const;
  std::uint64_t terminal_value(od::Address output, std::uint64_t value, std::uint64_t before) const;
  // The object of inputs or outputs whose conversion that object is a part of; 0 = of none.
  static std::uint16_t converted_by(std::uint16_t index);

  // The device is stopped or its communication failed: outputs take the values of 6207h where
  // 6206h, of 6444h where 6443h says so. What is no output of the profile stays as it is.
  void take_error_values();

 private:
  bool digital_tells(std::uint8_t sub, std::uint64_t before, std::uint64_t now) const;
  bool analogue_tells(std::uint8_t sub, std::uint64_t now);
  std::int64_t integer(std::uint16_t index, std::uint8_t sub, std::int64_t otherwise) const;
  bool beyond_limits(std::uint8_t sub, std::uint64_t trigger, std::int64_t value) const;
  bool differs(std::uint8_t sub, std::uint64_t trigger, std::int64_t by) const;

  od::Dictionary& dictionary_;
  std::map<std::uint8_t, std::int16_t> told_;  // of 6401h
};

}  // namespace linegate::profile
