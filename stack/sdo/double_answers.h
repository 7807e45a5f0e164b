// SPDX-License-Identifier: Apache-2.0
// Detects two devices with the same node-ID by double answers of their default SDO servers.
//
// Both devices answer every request, at the same time or one of them later, when the client has
// already continued. What also occurs with one device is no evidence: a frame that a controller
// occasionally repeats, an answer that arrives after its request timed out and was repeated,
// answers to another client.
#pragma once

#include <array>
#include <cstdint>

#include "stack/base/time.h"
#include "stack/od/description.h"

namespace linegate::sdo {

class DoubleAnswers {
 public:
  // A second answer counts up to this time after the first one.
  static constexpr Duration kLate = std::chrono::milliseconds(500);
  // No report within this time after a disturbance.
  static constexpr Duration kUndisturbed = std::chrono::seconds(10);
  // Older answers do not count: one of the devices may have been removed.
  static constexpr Duration kRow = std::chrono::seconds(10);
  // Least interval between two reports.
  static constexpr Duration kQuiet = std::chrono::minutes(1);

  enum class Found : std::uint8_t {
    nothing,
    second_answer,  // to a request that was already answered
    two_devices,    // detected, and not reported yet
  };

  // Examines a response that begins or ends a transfer. word: its 8 bytes; asked: a request is
  // waiting for it.
  Found response(std::uint64_t word, bool asked, Instant now);
  // Call it when a transfer failed, or took so long that its request may have been repeated, or
  // another client was observed.
  void disturb(Instant now) { disturbed_ = now; }
  // Call it when an unanswered request was cancelled: its answer may arrive beside the next one.
  void cancel(od::Address address, Instant now);
  // Call it when a ChannelUser has the channel, whose requests are not examined.
  void forget();

 private:
  static constexpr std::size_t kAnswers = 8;
  // Number of successive requests, within kRow, that must be answered twice.
  static constexpr unsigned kInARow = 6;

  struct Answer {
    std::uint64_t word = 0;
    Instant time = kNever;  // kNever: unused
    bool twice = false;
  };

  bool in_a_row(Instant now) const;

  std::array<Answer, kAnswers> answers_{};  // the newest last
  od::Address cancelled_;
  Instant cancelled_at_ = kNever;
  Instant disturbed_ = kNever;
  Instant reported_ = kNever;
};

}  // namespace linegate::sdo
