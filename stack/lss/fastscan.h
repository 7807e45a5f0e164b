// SPDX-License-Identifier: Apache-2.0
// Finds the LSS address of one unconfigured device by fastscan (CiA 305), question by question and
// bit by bit. No part of the address need be known.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "stack/lss/message.h"

namespace linegate::lss {

// Known parts of the address are verified without a search.
using Known = std::array<std::optional<std::uint32_t>, kParts>;

// A question without an answer means "bit is 1", and a lost frame looks the same. The result is
// therefore verified, part by part; if that fails, the search restarts, and repeats each question
// once more than before.
class Fastscan {
 public:
  enum class State : std::uint8_t {
    running,
    found,  // the device is in configuration state now
    // The last verification was not answered: the device may be in configuration state or not.
    unsure,
    nobody,  // there is no unconfigured device, or none matches the known parts
    failed,  // the verification failed several times
  };

  // repeats: initial number of repetitions of each question.
  explicit Fastscan(const Known& known = {}, unsigned repeats = 0);

  // Precondition: running.
  Message question() const;
  // Whether any device answered the question within the time-out.
  void answered(bool yes);

  State state() const { return state_; }
  // The address that was found; if unsure, the one that was not confirmed.
  const Address& address() const { return address_; }
  // The part of the address that the question concerns, kVendor..kSerial.
  std::uint8_t part() const { return part_; }
  // Current number of repetitions of each question.
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
  unsigned asked_ = 0;     // number of times the question was sent without an answer
  unsigned repeats_ = 0;   // of each bit question
  unsigned failures_ = 0;  // failed verifications
};

}  // namespace linegate::lss
