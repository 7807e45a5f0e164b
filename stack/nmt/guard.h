// SPDX-License-Identifier: Apache-2.0
// Node guarding as the NMT master of one node sees it (CiA 301, 7.2.8.3.2.1): a remote frame on
// 700h + node-ID every guard time; the node answers with one byte.
//   bit 7      toggle bit: 0 in the first answer after a boot-up, then the other of the last answer
//   bits 0..6  NMT state
#pragma once

#include <cstdint>
#include <optional>

#include "stack/base/time.h"
#include "stack/can/frame.h"

namespace linegate::nmt {

inline constexpr std::byte kToggleBit{0x80};

// The remote frame that asks the node.
can::Frame guard_request(std::uint8_t node);

struct Guard {
  Duration time{};        // between two requests; 0 = the node is not guarded
  Instant next = kNever;  // the next request
  // What the next answer must show; nothing = whatever comes first after the guarding began.
  std::optional<std::byte> toggle;

  bool by_others = false;  // its master asks it; nobody here does

  bool asks() const { return time > Duration::zero(); }
  bool active() const { return asks() || by_others; }
  // Takes the toggle bit away. False if it is not the expected one: an answer that counts for
  // nothing. Boot-up messages are no answers: they make 0 the expected one.
  bool take_toggle(can::Frame& answer);
};

}  // namespace linegate::nmt
