// SPDX-License-Identifier: Apache-2.0
// The fields of USDO frames as the models read them (stack/usdo/README.md), without the code of the
// product.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/can/frame.h"
#include "stack/od/description.h"

namespace linegate::plant {

// Byte 1, of a request; a response has bit 5, too.
inline constexpr unsigned kUsdoDownload = 0x01;  // expedited
inline constexpr unsigned kUsdoDownloadInitiate = 0x02;
inline constexpr unsigned kUsdoDownloadSegment = 0x03;
inline constexpr unsigned kUsdoDownloadEnd = 0x04;
inline constexpr unsigned kUsdoUpload = 0x11;
inline constexpr unsigned kUsdoUploadInitiate = 0x12;  // as a response alone
inline constexpr unsigned kUsdoUploadSegment = 0x13;
inline constexpr unsigned kUsdoUploadEnd = 0x14;  // as a response alone
inline constexpr unsigned kUsdoResponse = 0x20;
inline constexpr unsigned kUsdoAbort = 0x7F;
inline constexpr unsigned kUsdoLongAbort = 0x80;

inline unsigned usdo_byte(const can::Frame& frame, std::size_t at) {
  return std::to_integer<unsigned>(frame.data[at]);
}

// Whether it is a USDO frame with an identifier base + node-ID of its sender.
inline bool is_usdo(const can::Frame& frame, std::uint32_t base) {
  constexpr std::uint8_t kLeast = 3;
  return frame.fd() && !frame.extended() && frame.length >= kLeast && frame.id > base &&
         frame.id <= base + can::kMaxNodeId;
}

inline std::uint8_t usdo_receiver(const can::Frame& frame) {
  return static_cast<std::uint8_t>(usdo_byte(frame, 0));
}
inline unsigned usdo_command(const can::Frame& frame) {
  return usdo_byte(frame, 1);
}
inline unsigned usdo_session(const can::Frame& frame) {
  return usdo_byte(frame, 2);
}
inline unsigned usdo_counter(const can::Frame& frame) {
  return usdo_byte(frame, 3);
}
inline od::Address usdo_object(const can::Frame& frame) {
  return {load_le<std::uint16_t>(frame.data.data() + 4),
          static_cast<std::uint8_t>(usdo_byte(frame, 3))};
}

// The data of an expedited frame, a segment or an end.
inline std::span<const std::byte> usdo_data(const can::Frame& frame) {
  constexpr std::size_t kExpeditedAt = 8;
  constexpr std::size_t kSegmentAt = 4;
  const unsigned kind = usdo_command(frame) & 0x0FU;
  const std::size_t at = kind == kUsdoDownload ? kExpeditedAt : kSegmentAt;
  const std::size_t most = frame.length - std::min<std::size_t>(at, frame.length);
  const std::size_t count = kind == kUsdoDownload          ? usdo_byte(frame, 7)
                            : kind == kUsdoDownloadSegment ? most
                                                           : usdo_byte(frame, 3);
  return std::span(frame.data).subspan(at, std::min(count, most));
}

// Whether the request writes an object, with all of its value or the begin of it.
inline bool begins_usdo_download(const can::Frame& frame) {
  return is_usdo(frame, can::kSdoRequestBase) &&
         (usdo_command(frame) == kUsdoDownload || usdo_command(frame) == kUsdoDownloadInitiate);
}

}  // namespace linegate::plant
