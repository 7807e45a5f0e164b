// SPDX-License-Identifier: Apache-2.0
// The bytes of USDO frames (CiA 1301, as published by SOFA-CANopenFD). Client and server read and
// write frames through this header alone. All fields are little-endian.
//
//   byte 0      node-ID of the receiver
//   byte 1      command specifier
//   byte 2      session-ID, 1..255, chosen by the client
//   byte 3      sub-index; of a segment its counter, of an end frame the number of data bytes
//   bytes 4, 5  index
//   byte 6      data type (code of CiA 301), or abort code
//   byte 7      number of data bytes, expedited; 0 in an initiate
//   bytes 8..   data, or the size (U32) of a segmented transfer (OWN: 0 = unknown)
//
// A frame ends after its last field; zeros fill it up to the next length of CAN FD. Bytes after the
// counted data are ignored when a frame is received.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "stack/base/abort_code.h"
#include "stack/can/cob_id.h"
#include "stack/can/frame.h"
#include "stack/od/data_type.h"
#include "stack/od/description.h"
#include "stack/usdo/abort_form.h"

namespace linegate::usdo {

inline constexpr std::size_t kExpeditedData = 56;  // bytes in an expedited frame
inline constexpr std::size_t kSegmentData = 60;    // bytes in a segment; also the most in an end

// Bit 5: response; bit 4: upload; bits 3..0: 1 expedited, 2 initiate, 3 segment, 4 end.
enum class Command : std::uint8_t {
  download = 0x01,           // type, length, data
  download_initiate = 0x02,  // type, 0, size
  download_segment = 0x03,   // counter, 60 bytes
  download_end = 0x04,       // number of bytes, 1 to 60 bytes; OWN: 0 ends an empty stream
  upload = 0x11,
  upload_segment = 0x13,         // counter
  download_response = 0x21,      // index, sub-index
  initiate_response = 0x22,      // of a download: index, sub-index
  segment_response = 0x23,       // of a download: counter
  end_response = 0x24,           // of a download
  upload_response = 0x31,        // expedited: type, length, data
  upload_initiate = 0x32,        // response to `upload`: type, 0, size
  upload_segment_answer = 0x33,  // counter, 60 bytes
  upload_end = 0x34,             // number of bytes, 1 to 60 bytes
  abort = 0x7F,                  // index, sub-index, abort code of one byte
  long_abort = 0x80,             // index, sub-index, SDO abort code of four bytes in bytes 6..9
};

// Abort codes of one byte. 1xh and 2xh: protocol; 3xh: object; 6xh: storage and device.
enum class Code : std::uint8_t {
  command_specifier = 0x13,
  segment_counter = 0x14,
  size = 0x15,
  session = 0x21,
  write_only = 0x31,
  read_only = 0x32,
  no_object = 0x33,
  no_sub_index = 0x34,
  length_mismatch = 0x36,
  length_too_high = 0x37,
  length_too_low = 0x38,
  cannot_transfer = 0x60,  // OWN: also for every reason that has no code of its own
  device_state = 0x62,
};

// The code in words; "unknown abort code" for other values.
std::string_view describe(Code code);
// The SDO abort code with the meaning of a received code; general for unknown values.
AbortCode to_abort_code(Code code);
// The code to send; cannot_transfer for an SDO abort code without a counterpart.
Code to_code(AbortCode code);

// Where a frame goes. A request has 600h, a response 580h + the node-ID of its own sender.
struct Route {
  std::uint32_t identifier = 0;
  std::uint8_t receiver = 0;
  std::uint8_t session = 0;
};

// Frames, with the bit rate switched.
can::Frame plain_frame(Route route, Command command);  // 3 bytes
can::Frame counted_frame(Route route, Command command, std::uint8_t counter);
can::Frame object_frame(Route route, Command command, od::Address address);
// Precondition: data has at most kExpeditedData bytes.
can::Frame expedited_frame(Route route, Command command, od::Address address, od::DataType type,
                           std::span<const std::byte> data);
can::Frame initiate_frame(Route route, Command command, od::Address address, od::DataType type,
                          std::uint32_t size);
// A segment, or for an end command the last bytes. Precondition: a segment has kSegmentData bytes,
// an end at most kSegmentData.
can::Frame segment_frame(Route route, Command command, std::uint8_t counter,
                         std::span<const std::byte> data);
can::Frame end_frame(Route route, Command command, std::span<const std::byte> data);
can::Frame abort_frame(Route route, od::Address address, AbortCode code, AbortForm form);
can::Frame abort_frame(Route route, od::Address address, Code code, AbortForm form);

// Whether it is a CAN FD data frame with a receiver, a command and a session.
bool well_formed(const can::Frame& frame);

// The fields of a well-formed frame that has them, see has_fields().
inline std::uint8_t byte_of(const can::Frame& frame, std::size_t at) {
  return std::to_integer<std::uint8_t>(frame.data[at]);
}
inline std::uint8_t receiver_of(const can::Frame& frame) {
  return byte_of(frame, 0);
}
inline Command command_of(const can::Frame& frame) {
  return static_cast<Command>(byte_of(frame, 1));
}
inline std::uint8_t session_of(const can::Frame& frame) {
  return byte_of(frame, 2);
}
inline std::uint8_t counter_of(const can::Frame& frame) {
  return byte_of(frame, 3);
}
od::Address address_of(const can::Frame& frame);
std::uint32_t size_of(const can::Frame& frame);

bool is_known(Command command);
// Whether the frame has all fields of its command; false for an unknown command.
bool has_fields(const can::Frame& frame);
inline bool is_abort(Command command) {
  return command == Command::abort || command == Command::long_abort;
}
// The reason in an abort frame of either form; never none. Precondition: has_fields().
AbortCode reason_of(const can::Frame& frame);
// The data of an expedited frame, a segment or an end frame; nothing if the frame ends before, or
// the number is not allowed. Precondition: has_fields().
std::optional<std::span<const std::byte>> data_of(const can::Frame& frame);

}  // namespace linegate::usdo
