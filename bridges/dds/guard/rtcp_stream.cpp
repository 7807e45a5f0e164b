// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/rtcp_stream.h"

#include <algorithm>
#include <bit>
#include <string_view>

namespace linegate::dds::guard {
namespace {

constexpr std::string_view kSync = "RTCP";
constexpr std::size_t kControlHeader = 16;
constexpr std::size_t kCode = 4;           // of a response
constexpr std::size_t kContentHeader = 6;  // encapsulation and length
constexpr std::size_t kSequence = 8;       // CDR encapsulation and number of elements
// readSerializedPayload() copies that many octets from behind the longest message.
constexpr std::size_t kCopiedBehind = 10;

enum class ControlKind : std::uint8_t {  // TCPCPMKind
  bind_request = 0xD1,
  open_port_request = 0xD2,
  check_ports_request = 0xD3,
  keep_alive_request = 0xD4,
  port_closed_request = 0xD5,
  unbind_request = 0xD6,
  bind_response = 0xE1,
  open_port_response = 0xE2,
  check_ports_response = 0xE3,
  keep_alive_response = 0xE4,
};

// Its only member is a sequence of 16-bit numbers, for which the library allocates memory.
bool is_sequence(ControlKind kind) {
  return kind == ControlKind::check_ports_request || kind == ControlKind::check_ports_response;
}

// content: from its encapsulation and length on.
bool content_is_valid(Wire content, std::size_t size, bool sequence) {
  if (size < kContentHeader || content.u32(2) != size - kContentHeader)
    return false;
  if (!sequence)
    return true;
  if (size < kContentHeader + kSequence)
    return false;
  const bool little = (content.u8(kContentHeader + 1) & 1U) != 0;
  const std::uint32_t elements = Wire(content.octets(), little).u32(kContentHeader + 4);
  return elements <= (size - kContentHeader - kSequence) / sizeof(std::uint16_t);
}

}  // namespace

Wire RtcpStream::kept() const {
  return {Octets(kept_).first(size_), std::endian::native == std::endian::little};
}

bool RtcpStream::take(Octets octets) {
  while (valid_ && !octets.empty()) {
    if (rest_ > 0) {
      const std::size_t skipped = std::min(rest_, octets.size());
      rest_ -= skipped;
      octets = octets.subspan(skipped);
    } else {
      keep(octets);
    }
  }
  return valid_;
}

void RtcpStream::keep(Octets& octets) {
  const std::size_t taken = std::min(wanted_ - size_, octets.size());
  std::copy_n(octets.begin(), taken, kept_.begin() + static_cast<std::ptrdiff_t>(size_));
  size_ += taken;
  octets = octets.subspan(taken);
  valid_ = std::equal(kSync.begin(),
                      kSync.begin() + static_cast<std::ptrdiff_t>(std::min(size_, kSync.size())),
                      kept_.begin());
  if (valid_ && size_ == wanted_)
    check();
}

void RtcpStream::check() {
  if (size_ == kHeader)
    return check_header();
  valid_ = control_is_valid();
  accepted_ = first_ ? kept().u8(kHeader) == static_cast<std::uint8_t>(ControlKind::bind_request)
                     : accepted_;
  first_ = false;
  rest_ = body_ + kHeader - size_;
  size_ = 0;
  wanted_ = kHeader;
}

void RtcpStream::check_header() {
  const std::uint32_t length = kept().u32(4);
  valid_ = length >= kHeader && length - kHeader <= largest_;
  body_ = length - kHeader;
  if (kept().u16(12) != 0) {
    first_ = false;
    rest_ = body_;
    size_ = 0;
    return;
  }
  valid_ = valid_ && body_ >= kControlHeader && body_ + kCopiedBehind <= largest_;
  wanted_ = kHeader + std::min(body_, kControl);
}

bool RtcpStream::control_is_valid() const {
  const Wire body = kept().from(kHeader);
  if (body.u16(2) != body_)
    return false;
  const auto kind = static_cast<ControlKind>(body.u8(0));
  switch (kind) {
    case ControlKind::bind_request:
    case ControlKind::open_port_request:
    case ControlKind::check_ports_request:
    case ControlKind::keep_alive_request:
    case ControlKind::port_closed_request:
      return content_is_valid(body.from(kControlHeader), body_ - kControlHeader, is_sequence(kind));
    case ControlKind::bind_response:
    case ControlKind::check_ports_response:
      return body_ >= kControlHeader + kCode &&
             content_is_valid(body.from(kControlHeader + kCode), body_ - kControlHeader - kCode,
                              is_sequence(kind));
    case ControlKind::open_port_response:
    case ControlKind::keep_alive_response:
      return body_ == kControlHeader + kCode;
    case ControlKind::unbind_request:
      return body_ == kControlHeader;
  }
  return false;  // the library returns it to its sender, whose library returns it again
}

}  // namespace linegate::dds::guard
