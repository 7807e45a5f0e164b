// SPDX-License-Identifier: Apache-2.0
// Whether two devices answer at one default SDO server, by answers that come twice to one request.
//
// Two devices of one node-ID answer every request, in the same moment or one of them later, when
// the client has gone on. What happens with one device as well is no sign: a frame that a
// controller repeats now and then, an answer that comes after its request timed out and was
// repeated, answers to another client.
#pragma once

#include <array>
#include <cstdint>

#include "stack/base/time.h"
#include "stack/od/description.h"

namespace linegate::sdo {

class DoubleAnswers {
 public:
  // So long after the first answer the second one counts.
  static constexpr Duration kLate = std::chrono::milliseconds(500);
  // Nothing is reported for so long after a disturbance.
  static constexpr Duration kUndisturbed = std::chrono::seconds(10);
  // Older answers do not count: one of the devices may have gone since.
  static constexpr Duration kRow = std::chrono::seconds(10);
  // It is reported again after this time.
  static constexpr Duration kQuiet = std::chrono::minutes(1);

  enum class Found : std::uint8_t {
    nothing,
    second_answer,  // to a request that was answered
    two_devices,    // it shows, and is not reported yet
  };

  // A response that begins or ends a transfer, 8 bytes as a number; asked: a request waits for it.
  Found response(std::uint64_t word, bool asked, Instant now);
  // A transfer failed, or took so long that its request may have been repeated, or another client
  // was heard.
  void disturb(Instant now) { disturbed_ = now; }
  // A request that was not answered yet was cancelled: its answer may come beside that to the next.
  void cancel(od::Address address, Instant now);
  // Another user has the channel: its requests are not looked at.
  void forget();

 private:
  static constexpr std::size_t kAnswers = 8;
  // So many requests, one after the other and within kRow, were answered twice.
  static constexpr unsigned kInARow = 6;

  struct Answer {
    std::uint64_t word = 0;
    Instant time = kNever;  // kNever: there is none
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
