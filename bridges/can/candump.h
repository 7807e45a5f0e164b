// SPDX-License-Identifier: Apache-2.0
// Lines of a CAN log in the format of candump -L and -l, which canplayer and tshark read:
//
//   (1436509052.249713) can0 181#0102030405060708       data frame, 11-bit identifier
//   (1436509052.249713) can0 00000181#01                29-bit identifier: eight digits
//   (1436509052.249713) can0 705#R1                     remote frame; a length of 0 is omitted
//   (1436509052.249713) can0 181##51122334455667788     FD frame: a digit of flags (1 = bit rate
//                                                       switch, 2 = error state, 4 = FD) and data
//   (1436509052.249713) can0 20000004#0040000000000000  error frame (linux/can/error.h)
//   DROPCOUNT: dropped 3 CAN frames on 'can0' socket (total drops 5)
//
// The time is UTC in seconds since 1970, with up to nine decimals. Empty lines and lines that begin
// with # are comments. R or T (received or sent, candump -x) may follow the frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <linux/can.h>

#include "stack/can/bus_state.h"
#include "stack/can/frame.h"

namespace linegate::can_bridge {

struct LogEntry {
  enum class Kind : std::uint8_t {
    frame,
    error_frame,
    frames_lost,
    remark,  // no entry: a comment or an empty line
  };
  Kind kind = Kind::remark;
  std::int64_t stamp_ns = 0;   // UTC, ns since 1970; 0 for frames_lost and remarks
  std::string_view interface;  // points into the text that was parsed
  can::Frame frame;            // its time is not set
  canfd_frame error{};         // an error_frame, for ErrorDecoder
  std::uint32_t lost = 0;      // frames_lost: number of lost frames
};

struct LogProblem {
  std::uint32_t column = 0;  // from 1
  std::string_view text;     // static storage
};

// Parses one line without its line end. Returns false if it is malformed, with the reason in
// problem. Never allocates.
bool parse_log_line(std::string_view line, LogEntry& out, LogProblem& problem);

// Length of the longest line that format_log_line() writes, with an interface name of up to 64
// characters.
inline constexpr std::size_t kLogLine = 320;

// Write one line with its line end into out, which must hold kLogLine characters, and return its
// length.
std::size_t format_log_line(std::span<char> out, std::int64_t stamp_ns, std::string_view interface,
                            const can::Frame& frame);
// Writes a change of the controller's state, or errors, as an error frame. Returns 0 if the kernel
// has no error frame for the event.
std::size_t format_log_line(std::span<char> out, std::int64_t stamp_ns, std::string_view interface,
                            const can::BusEvent& event);
std::size_t format_lost(std::span<char> out, std::string_view interface, std::uint64_t lost,
                        std::uint64_t total);

}  // namespace linegate::can_bridge
