// SPDX-License-Identifier: Apache-2.0
// The behaviour of the objects of a generic I/O module (CiA 401), for the objects that the device
// has.
#pragma once

#include <cstdint>
#include <map>

#include "stack/od/dictionary.h"

namespace linegate::profile {

class IoBehaviour {
 public:
  explicit IoBehaviour(od::Dictionary& dictionary) : dictionary_(dictionary) {}

  // Whether a changed input requests the event-driven TPDOs that map it.
  //   6000h  if 6005h is TRUE, and a bit changed that 6006h (any change), 6007h (0 to 1) or 6008h
  //          (1 to 0) selects
  //   6401h  if 6423h is TRUE and the conditions that 6421h selects are true: bit 0 or 1: it is
  //          above 6424h, or below 6425h (either is enough); and bit 2, 3 or 4: compared with the
  //          last value that requested a TPDO it differs by more than 6426h, is less by more than
  //          6427h, is more by more than 6428h (a difference of 0 means any change; without 6421h
  //          bit 2)
  // Missing objects forbid nothing; other inputs always request their TPDOs.
  bool is_reported(od::Address input, std::uint64_t before, std::uint64_t now);

  // Converts between the values at the terminals, which the application uses, and the values of the
  // objects:
  //   6000h  the bits that 6002h selects are inverted
  //   6401h  times 6432h, plus 6431h
  //   6200h  only bits that 6208h selects change, and of these the bits of 6202h are inverted
  //   6411h  times 6447h, plus 6446h
  // within the limits of 16 bits. Missing objects change nothing; other inputs and outputs are not
  // converted.
  std::uint64_t input_value(od::Address input, std::uint64_t terminal) const;
  std::uint64_t terminal_value(od::Address output, std::uint64_t value, std::uint64_t before) const;
  // The object of inputs or outputs whose conversion uses this object; 0 = none.
  static std::uint16_t converted_by(std::uint16_t index);

  // The device was stopped or its communication failed: outputs take the values of 6207h if
  // selected by 6206h, of 6444h if selected by 6443h. Objects that are not outputs of the profile
  // are unchanged.
  void apply_error_values();

 private:
  bool digital_triggers(std::uint8_t sub, std::uint64_t before, std::uint64_t now) const;
  bool analogue_triggers(std::uint8_t sub, std::uint64_t now);
  std::int64_t integer(std::uint16_t index, std::uint8_t sub, std::int64_t otherwise) const;
  bool beyond_limits(std::uint8_t sub, std::uint64_t trigger, std::int64_t value) const;
  bool differs(std::uint8_t sub, std::uint64_t trigger, std::int64_t by) const;

  od::Dictionary& dictionary_;
  std::map<std::uint8_t, std::int16_t> reported_;  // last 6401h that requested a TPDO
};

}  // namespace linegate::profile
