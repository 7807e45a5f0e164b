// SPDX-License-Identifier: Apache-2.0
// The bytes of SDO frames (CiA 301, 7.2.4.3): command specifiers, flags and how a frame is put
// together. Client, server and arbiter read and write frames through this header alone.
//
//   byte 0        command: specifier in bits 7..5, flags of the service in bits 4..0
//   bytes 1..3    multiplexer: index (LE), sub-index            -- initiate and abort
//   bytes 4..7    data, size (U32, LE) or abort code (U32, LE)  -- initiate and abort
//   bytes 1..7    data                                          -- segments
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "stack/base/abort_code.h"
#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/base/event_log.h"
#include "stack/can/cob_id.h"
#include "stack/can/frame.h"
#include "stack/od/description.h"

namespace linegate::sdo {

inline constexpr std::uint8_t kFrameSize = 8;  // every SDO frame, whatever it carries
inline constexpr std::size_t kExpeditedSize = 4;
inline constexpr std::size_t kSegmentSize = 7;

using Payload = std::array<std::byte, kFrameSize>;

// Client command specifier (ccs).
enum class ClientCommand : std::uint8_t {
  download_segment = 0,
  download_initiate = 1,
  upload_initiate = 2,
  upload_segment = 3,
  abort = 4,
  block_upload = 5,
  block_download = 6,
};

// Server command specifier (scs).
enum class ServerCommand : std::uint8_t {
  upload_segment = 0,
  download_segment = 1,
  upload_initiate = 2,
  download_initiate = 3,
  abort = 4,
  block_download = 5,
  block_upload = 6,
};

inline constexpr std::uint8_t kSizeIndicated = 0x01;  // s, of an initiate
inline constexpr std::uint8_t kExpedited = 0x02;      // e, of an initiate
inline constexpr std::uint8_t kLastSegment = 0x01;    // c, of a segment with data
inline constexpr std::uint8_t kToggle = 0x10;         // t, of a segment and its answer

// Block transfer. The sender of the segments uses C0h and C1h, the receiver A0h to A3h: client and
// server in a download, server and client in an upload.
inline constexpr std::uint8_t kBlockSend = 0xC0;  // initiate; kBlockCrc, kBlockSize; mux, size
// Bits 4..2: unused bytes of the last segment; bytes 1, 2: CRC.
inline constexpr std::uint8_t kBlockSendEnd = 0xC1;
inline constexpr std::uint8_t kBlockTake = 0xA0;     // initiate; kBlockCrc; mux, byte 4: block size
                                                     // (a client: byte 5: pst)
inline constexpr std::uint8_t kBlockTakeEnd = 0xA1;  // the answer to kBlockSendEnd
inline constexpr std::uint8_t kBlockAck = 0xA2;      // byte 1: ackseq, byte 2: next block size
inline constexpr std::uint8_t kBlockStart = 0xA3;    // client: start of the segments
inline constexpr std::uint8_t kBlockSize = 0x02;     // s, of an initiate
inline constexpr std::uint8_t kBlockCrc = 0x04;      // cc, sc: CRC supported
inline constexpr std::uint8_t kBlockLastSegment = 0x80;  // c, of a segment; bits 6..0: its number
inline constexpr std::uint8_t kMaxBlockSize = 127;

template <class Command>
constexpr std::uint8_t command_byte(Command command, unsigned flags = 0) {
  return static_cast<std::uint8_t>(static_cast<unsigned>(command) << 5U | flags);
}
constexpr std::uint8_t specifier(std::uint8_t command) {
  return command >> 5U;
}
constexpr bool toggle_of(std::uint8_t command) {
  return (command & kToggle) != 0;
}
// Number of bytes used of bytes 4..7 in an expedited initiate, 1..4. Without s it is 4: no size is
// indicated.
constexpr std::size_t expedited_size(std::uint8_t command) {
  return (command & kSizeIndicated) != 0 ? kExpeditedSize - ((command >> 2U) & 3U) : kExpeditedSize;
}
// Number of bytes used of bytes 1..7 in a segment, 0..7.
constexpr std::size_t segment_size(std::uint8_t command) {
  return kSegmentSize - ((command >> 1U) & 7U);
}
// Command byte of an expedited initiate. Precondition: size is 1..4.
template <class Command>
constexpr std::uint8_t expedited_byte(Command command, std::size_t size) {
  LINEGATE_ASSERT_HOT(size >= 1 && size <= kExpeditedSize, "the value has 1 to 4 bytes");
  return command_byte(
      command, static_cast<unsigned>(kExpeditedSize - size) << 2U | kExpedited | kSizeIndicated);
}
// Command byte of a segment with size bytes of data, 0..7.
template <class Command>
constexpr std::uint8_t segment_byte(Command command, bool toggle, std::size_t size, bool last) {
  LINEGATE_ASSERT_HOT(size <= kSegmentSize, "a segment has up to 7 bytes");
  return command_byte(command, (toggle ? unsigned{kToggle} : 0U) |
                                   static_cast<unsigned>(kSegmentSize - size) << 1U |
                                   (last ? unsigned{kLastSegment} : 0U));
}

// Command byte of a segment of a block transfer. number: 1..127.
constexpr std::uint8_t block_segment_byte(std::uint8_t number, bool last) {
  return static_cast<std::uint8_t>(number | (last ? unsigned{kBlockLastSegment} : 0U));
}
// kBlockSend, kBlockTake: without their flags. kBlockSendEnd: without the number of unused bytes.
constexpr bool is_block_send(std::uint8_t command) {
  return (command & 0xE1U) == kBlockSend;
}
constexpr bool is_block_take(std::uint8_t command) {
  return (command & 0xE3U) == kBlockTake;
}
constexpr bool is_block_send_end(std::uint8_t command) {
  return (command & 0xE3U) == kBlockSendEnd;
}

// The first eight bytes of an SDO frame as one number, byte 0 in the lowest bits.
constexpr std::uint64_t initiate_word(std::uint8_t command, od::Address address,
                                      std::uint32_t data = 0) {
  return std::uint64_t{command} | std::uint64_t{address.index} << 8U |
         std::uint64_t{address.sub} << 24U | std::uint64_t{data} << 32U;
}
constexpr std::uint64_t abort_word(od::Address address, AbortCode code) {
  return initiate_word(command_byte(ClientCommand::abort), address,
                       static_cast<std::uint32_t>(code));
}
constexpr od::Address multiplexer(std::uint64_t word) {
  return {static_cast<std::uint16_t>(word >> 8U), static_cast<std::uint8_t>(word >> 24U)};
}
constexpr std::uint32_t long_word(std::uint64_t word) {
  return static_cast<std::uint32_t>(word >> 32U);
}

// Byte `number` (0 to 7) of the frame in `word`.
constexpr std::uint8_t byte_of(std::uint64_t word, unsigned number) {
  return static_cast<std::uint8_t>(word >> (8 * number));
}

constexpr bool is_upload_initiate(std::uint64_t word) {
  return specifier(static_cast<std::uint8_t>(word)) ==
         static_cast<std::uint8_t>(ClientCommand::upload_initiate);
}
// The answer to an upload initiate with a value of size bytes, 1..4; the higher bytes of value are
// 0.
constexpr std::uint64_t expedited_answer(std::uint64_t request, std::uint32_t value,
                                         std::uint32_t size) {
  constexpr std::uint64_t kMultiplexer = 0xFFFF'FF00;
  constexpr std::uint32_t kWithoutData =
      command_byte(ServerCommand::upload_initiate, kExpedited | kSizeIndicated) +
      (kExpeditedSize << 2U);
  return (request & kMultiplexer) | (kWithoutData - (size << 2U)) | std::uint64_t{value} << 32U;
}

inline std::uint64_t word_of(const can::Frame& frame) {
  return load_le<std::uint64_t>(frame.data.data());
}
inline std::uint8_t command_of(const can::Frame& frame) {
  return std::to_integer<std::uint8_t>(frame.data[0]);
}

// True for a classical data frame of 8 bytes, the only valid SDO frame.
inline bool well_formed(const can::Frame& frame) {
  return frame.length == kFrameSize && (frame.flags & (can::Frame::kRemote | can::Frame::kFd)) == 0;
}

// Sets identifier, format and length, not the data.
inline void set_header(can::Frame& frame, can::CobId cob_id) {
  frame.id = cob_id.id();
  frame.flags = cob_id.extended() ? std::uint8_t{can::Frame::kExtended} : std::uint8_t{0};
  frame.length = kFrameSize;
}

// Reports an invalid SDO frame as EventKind::malformed_frame. node: its sender, 0 if unknown.
void report_malformed(const can::Frame& frame, std::uint8_t node, EventLog& events);

}  // namespace linegate::sdo
