// SPDX-License-Identifier: Apache-2.0
#include "stack/lss/fastscan.h"

#include "stack/base/assert.h"

namespace linegate::lss {
namespace {

constexpr std::uint8_t kHighestScanBit = 31;
constexpr unsigned kFirstRepeats = 2;   // of the first question: is any device unconfigured?
constexpr unsigned kVerifyRepeats = 1;  // a device that advanced at the first does not answer again
constexpr unsigned kMostFailures = 8;
constexpr unsigned kMostFailuresOfKnown = 2;  // usually the unconfigured device is another one

std::uint8_t part_after(std::uint8_t part) {
  return static_cast<std::uint8_t>((part + 1U) % kParts);
}

}  // namespace

Fastscan::Fastscan(const Known& known, unsigned repeats) : known_(known), repeats_(repeats) {
}

Message Fastscan::question() const {
  LINEGATE_ASSERT(state_ == State::running, "the search runs");
  Message out{.command = Command::fastscan};
  switch (step_) {
    case Step::begin:
      out.rest = {kScanBegins, 0, 0};
      break;
    case Step::bit:
      out.number = address_[part_];
      out.rest = {bit_, part_, part_};
      break;
    case Step::verify:
      out.number = address_[part_];
      out.rest = {0, part_, part_after(part_)};
      break;
  }
  return out;
}

void Fastscan::answered(bool yes) {
  LINEGATE_ASSERT(state_ == State::running, "the search runs");
  const unsigned repeats = step_ == Step::begin    ? kFirstRepeats
                           : step_ == Step::verify ? kVerifyRepeats
                                                   : repeats_;
  if (!yes && asked_ < repeats) {
    ++asked_;
    return;
  }
  asked_ = 0;
  switch (step_) {
    case Step::begin:
      if (!yes) {
        state_ = State::nobody;
        return;
      }
      part_ = 0;
      address_ = {};
      begin_part();
      return;
    case Step::bit:
      if (!yes) {
        address_[part_] |= std::uint32_t{1} << bit_;
      }
      if (bit_ == 0) {
        step_ = Step::verify;
      } else {
        --bit_;
      }
      return;
    case Step::verify:
      if (yes) {
        part_verified();
      } else {
        verification_failed();
      }
      return;
  }
}

void Fastscan::begin_part() {
  bit_ = kHighestScanBit;
  step_ = known_[part_] ? Step::verify : Step::bit;
  address_[part_] = known_[part_].value_or(0);
}

void Fastscan::part_verified() {
  if (part_ == kSerial) {
    state_ = State::found;
    return;
  }
  ++part_;
  begin_part();
}

void Fastscan::verification_failed() {
  if (part_ == kSerial && !known_[kSerial]) {
    state_ = State::unsure;
    return;
  }
  ++failures_;
  if (failures_ >= (known_[part_] ? kMostFailuresOfKnown : kMostFailures)) {
    state_ = known_[part_] ? State::nobody : State::failed;
    return;
  }
  restart();
}

void Fastscan::restart() {
  ++repeats_;
  step_ = Step::begin;
}

}  // namespace linegate::lss
