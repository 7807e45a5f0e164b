// SPDX-License-Identifier: Apache-2.0
#include "stack/srdo/receiver.h"

#include <cstddef>

#include "stack/base/assert.h"

namespace linegate::srdo {
namespace {

bool is_inverse(const can::Frame& normal, const can::Frame& inverted) {
  for (std::size_t i = 0; i < normal.length; ++i) {
    if ((normal.data[i] ^ inverted.data[i]) != std::byte{0xFF}) {
      return false;
    }
  }
  return true;
}

}  // namespace

Receiver::Receiver(std::uint8_t length, Duration validation, Duration cycle)
    : validation_(validation), cycle_(cycle), length_(length) {
  LINEGATE_ASSERT(length >= 1 && length <= can::kMaxClassicData, "an SRDO has 1 to 8 bytes");
  LINEGATE_ASSERT(validation > Duration::zero() && cycle > Duration::zero(),
                  "both times are monitored");
}

bool Receiver::receive(const can::Frame& frame, bool inverted) {
  if (frame.remote()) {
    return false;
  }
  if (next_wake() < frame.time) {
    advance(frame.time - Duration(1));
  }
  if (frame.length != length_ || frame.fd()) {
    expected_ = inverted ? Expected::normal : Expected::either;
    fail(Fault::length);
    return false;
  }
  return inverted ? receive_inverted(frame) : receive_normal(frame);
}

bool Receiver::receive_normal(const can::Frame& frame) {
  if (expected_ == Expected::inverted) {
    fail(Fault::order);
  }
  first_ = frame;
  expected_ = Expected::inverted;
  return false;
}

bool Receiver::receive_inverted(const can::Frame& frame) {
  const Expected expected = expected_;
  expected_ = Expected::normal;
  if (expected != Expected::inverted) {
    if (expected == Expected::normal) {
      fail(Fault::order);
    }
    return false;
  }
  if (!is_inverse(first_, frame)) {
    fail(Fault::inverse);
    return false;
  }
  if (!signature_matches_) {
    return false;
  }
  normal_ = first_;
  normal_.time = frame.time;
  fault_ = Fault::none;
  return true;
}

// A late call finds both times ended: the fault is the one that was first.
void Receiver::advance(Instant now) {
  const Instant cycle_end = end_of_cycle();
  if (cycle_end <= now && cycle_end < end_of_validation()) {
    fail(Fault::cycle_time);
  }
  if (end_of_validation() <= now) {
    expected_ = Expected::either;
    fail(Fault::validation_time);
  }
  if (cycle_end <= now) {
    fail(Fault::cycle_time);
  }
}

void Receiver::forget() {
  expected_ = Expected::either;
  fault_ = signature_matches_ ? Fault::not_received : Fault::signature;
}

Instant Receiver::next_wake() const {
  return earlier(end_of_validation(), end_of_cycle());
}

Instant Receiver::end_of_validation() const {
  return expected_ == Expected::inverted ? first_.time + validation_ : kNever;
}

Instant Receiver::end_of_cycle() const {
  return fault_ == Fault::none ? normal_.time + cycle_ : kNever;
}

void Receiver::set_signature(bool matches) {
  signature_matches_ = matches;
  if (!matches) {
    fault_ = Fault::signature;
  } else if (fault_ == Fault::signature) {
    fault_ = Fault::not_received;
  }
}

void Receiver::fail(Fault fault) {
  if (fault_ == Fault::none || fault_ == Fault::not_received) {
    fault_ = fault;
  }
}

}  // namespace linegate::srdo
