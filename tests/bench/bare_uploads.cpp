// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/bare_uploads.h"

#include "stack/can/cob_id.h"

#include "tests/bench/measure.h"
#include "tests/bench/sdo_bus.h"
#include "tests/bench/transfer_device.h"

namespace linegate::bench {
namespace {

constexpr std::uint8_t kSegmentsOfBlock = 127;

can_frame request(std::uint32_t node, std::uint8_t command) {
  can_frame out{};
  out.can_id = can::kSdoRequestBase + node;
  out.len = 8;
  out.data[0] = command;
  return out;
}

}  // namespace

can_frame BareUploads::initiate(std::uint8_t node) {
  const bool blocks = uploads_in_blocks(node);
  can_frame out = request(node, blocks ? 0xA0 : 0x40);
  out.data[1] = static_cast<std::uint8_t>(kDomain.index & 0xFFU);
  out.data[2] = static_cast<std::uint8_t>(kDomain.index >> 8U);
  out.data[3] = kDomain.sub;
  out.data[4] = blocks ? kSegmentsOfBlock : std::uint8_t{0};
  return out;
}

bool BareUploads::proceed(const can_frame& frame, can_frame& out) {
  const std::uint32_t node = frame.can_id - can::kSdoResponseBase;
  require(node >= 1 && node <= kUploadNodes && frame.len == 8,
          "the frame is not an answer of a server");
  State& state = states_[node];
  const std::uint8_t command = frame.data[0];
  require(command != 0x80, "a server aborts");
  switch (state) {
    case State::initiated:
      state = uploads_in_blocks(static_cast<std::uint8_t>(node)) ? State::block : State::segments;
      out = request(node, state == State::block ? 0xA3 : 0x60);
      return true;
    case State::segments:
      if ((command & 0x01U) != 0) {
        state = State::over;
        return false;
      }
      out = request(node, static_cast<std::uint8_t>(0x60U | ((command & 0x10U) ^ 0x10U)));
      return true;
    case State::block: {
      const std::uint8_t sequence = command & 0x7FU;
      const bool last = (command & 0x80U) != 0;
      if (!last && sequence != kSegmentsOfBlock) {
        return false;
      }
      state = last ? State::block_end : State::block;
      out = request(node, 0xA2);
      out.data[1] = sequence;
      out.data[2] = kSegmentsOfBlock;
      return true;
    }
    case State::block_end:
      state = State::over;
      out = request(node, 0xA1);
      return true;
    default:
      require(false, "an answer without a request");
      return false;
  }
}

}  // namespace linegate::bench
