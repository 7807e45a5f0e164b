// SPDX-License-Identifier: Apache-2.0
// The search for one unconfigured device by fastscan (CiA 305), question by question: whose address
// it is that somebody has, bit by bit. No address need be known.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "stack/lss/message.h"

namespace linegate::lss {

// Parts of the address that are known beforehand are asked for at once.
using Known = std::array<std::optional<std::uint32_t>, kParts>;

// A question nobody answers means "bit is 1", and so does a lost frame. What was found is therefore
// verified, part by part; if that fails the search begins again, and asks each question once more
// than before.
class Fastscan {
 public:
  enum class State : std::uint8_t {
    running,
    found,   // the device is in configuration now
    unsure,  // the last verification was not answered: it may be in configuration, or not be
    nobody,  // there is no unconfigured device, or none with the known parts
    failed,  // what was found could not be verified, several times
  };

  // repeats: of each question to begin with.
  explicit Fastscan(const Known& known = {}, unsigned repeats = 0);

  // Precondition: running.
  Message question() const;
  // Whether anybody answered it within the time-out.
  void answered(bool yes);

  State state() const { return state_; }
  // What was found; when unsure what it would be.
  const Address& address() const { return address_; }
  // Which part of the address the question is about, kVendor..kSerial.
  std::uint8_t part() const { return part_; }
  // Of each question now.
  unsigned repeats() const { return repeats_; }

 private:
  enum class Step : std::uint8_t { begin, bit, verify };

  void restart();
  void begin_part();
  void part_verified();
  void verification_failed();

  Known known_;
  Step step_ = Step::begin;
  State state_ = State::running;
  Address address_{};
  std::uint8_t part_ = 0;
  std::uint8_t bit_ = 0;
  unsigned asked_ = 0;     // times, this question, without an answer
  unsigned repeats_ = 0;   // of each bit
  unsigned failures_ = 0;  // to verify
};

}  // namespace linegate::lss
