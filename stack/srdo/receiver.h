// SPDX-License-Identifier: Apache-2.0
// The reception of one SRDO (EN 50325-5): two frames, the second with the inverted data of the
// first. Frames and time go in, the complete pair or the reason why the SRDO is unsafe come out.
// Nothing here is certified for functional safety: it displays an SRDO, and no safety function may
// use the result.
#pragma once

#include <cstdint>
#include <string_view>

#include "stack/base/time.h"
#include "stack/can/frame.h"

namespace linegate::srdo {

// Why an SRDO is unsafe. Append only: part of the DDS contract.
enum class Fault : std::uint8_t {
  none,             // the last pair is valid
  not_received,     // no pair yet
  length,           // a frame with another length than the mapping
  inverse,          // the second frame does not have the inverted data
  order,            // an inverted frame without a normal one before it, or two normal ones
  validation_time,  // no inverted frame within the SRVT after the normal one
  cycle_time,       // no pair within the SCT after the one before
  signature,        // 13FFh of the device differs from that of the known parameters
};

constexpr std::string_view name(Fault fault) {
  switch (fault) {
    case Fault::none:
      return "valid";
    case Fault::not_received:
      return "not received";
    case Fault::length:
      return "wrong length";
    case Fault::inverse:
      return "not inverted";
    case Fault::order:
      return "wrong order";
    case Fault::validation_time:
      return "SRVT exceeded";
    case Fault::cycle_time:
      return "SCT exceeded";
    case Fault::signature:
      return "other signature";
  }
  return "";
}

class Receiver {
 public:
  // length: of both frames in bytes, 1..8. validation: SRVT, from the normal frame to the inverted
  // one. cycle: SCT, from one complete pair to the next. Both are longer than 0. A frame exactly at
  // the end of a time is in time.
  Receiver(std::uint8_t length, Duration validation, Duration cycle);

  // A data frame of COB-ID 1 (normal) or COB-ID 2 (inverted). Deadlines before frame.time count
  // first, so a late call misses none. Returns true if the frame completes a valid pair: the SRDO
  // is valid, and normal() has its data.
  bool receive(const can::Frame& frame, bool inverted);
  void advance(Instant now);
  // The data that were received are those of another state of the node: the SRDO is not received,
  // and a normal frame from before belongs to no pair.
  void forget();
  // Whether the signature of the device is that of the parameters: otherwise its frames mean
  // something else, and no pair is valid.
  void set_signature(bool matches);
  // kNever: no time runs.
  Instant next_wake() const;

  // none: the SRDO is valid. Otherwise the first fault since it was valid. One valid pair ends any
  // fault.
  Fault fault() const { return fault_; }
  // The normal frame of the last valid pair; its time is that of the inverted frame. Precondition:
  // receive() returned true.
  const can::Frame& normal() const { return normal_; }

 private:
  enum class Expected : std::uint8_t {
    normal,
    inverted,
    either,  // the inverted frame is late, or was not used: it ends nothing when it arrives
  };

  bool receive_normal(const can::Frame& frame);
  bool receive_inverted(const can::Frame& frame);
  void fail(Fault fault);
  Instant end_of_validation() const;
  Instant end_of_cycle() const;

  Duration validation_;
  Duration cycle_;
  std::uint8_t length_;
  Expected expected_ = Expected::either;  // the first frame may be the second of a pair
  bool signature_matches_ = true;
  Fault fault_ = Fault::not_received;
  can::Frame first_{};
  can::Frame normal_{};
};

}  // namespace linegate::srdo
