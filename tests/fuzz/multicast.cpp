// SPDX-License-Identifier: Apache-2.0
// A datagram of a multicast group. Promise: an accepted frame is valid, and equal after encoding
// and decoding.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "bridges/can/multicast_codec.h"
#include "stack/can/frame.h"

#include "tests/fuzz/expect.h"

namespace {

using linegate::can::Frame;
using linegate::can_bridge::encode_multicast;
using linegate::can_bridge::kMulticastDatagram;
using linegate::can_bridge::MulticastDecoder;

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static MulticastDecoder decoder;
  const auto* const bytes = reinterpret_cast<const char*>(data);
  Frame frame;
  canfd_frame error{};
  if (decoder.decode(std::span(bytes, std::min(size, kMulticastDatagram)), frame, error) !=
      MulticastDecoder::Result::frame) {
    return 0;
  }
  LINEGATE_EXPECT(frame.length <= (frame.fd() ? 64 : 8));
  LINEGATE_EXPECT(frame.id <= (frame.extended() ? 0x1FFF'FFFFU : 0x7FFU));
  std::array<char, kMulticastDatagram> datagram{};
  const std::size_t length = encode_multicast(frame, 0, datagram);
  Frame again;
  LINEGATE_EXPECT(decoder.decode(std::span<const char>(datagram).first(length), again, error) ==
                  MulticastDecoder::Result::frame);
  LINEGATE_EXPECT(linegate::can::same_content(frame, again));
  return 0;
}
