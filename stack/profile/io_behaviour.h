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
  //   6401h  if 6423h is TRUE, and it differs by more than 6426h from the one told last
  // Objects that are not there forbid nothing; other inputs are always told.
  bool tells(od::Address input, std::uint64_t before, std::uint64_t now);

  // The device is stopped or its communication failed: outputs take the values of 6207h where
  // 6206h, of 6444h where 6443h says so. What is no output of the profile stays as it is.
  void take_error_values();

 private:
  bool digital_tells(std::uint8_t sub, std::uint64_t before, std::uint64_t now) const;
  bool analogue_tells(std::uint8_t sub, std::uint64_t now);

  od::Dictionary& dictionary_;
  std::map<std::uint8_t, std::int16_t> told_;  // of 6401h
};

}  // namespace linegate::profile
