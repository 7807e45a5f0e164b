// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/udp.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <optional>
#include <string_view>
#include <utility>

#include <arpa/inet.h>
#include <netinet/in.h>

#include "bridges/can/error_frame.h"
#include "bridges/can/multicast_codec.h"
#include "bridges/can/multicast_socket.h"
#include "bridges/can/receive_clock.h"
#include "bridges/can/sendable.h"

namespace linegate::can_bridge {
namespace {

using can::BusEvent;
using can::BusState;

constexpr Duration kRetryPeriod = std::chrono::milliseconds(500);
// Pause after a full queue: no event signals that there is room.
constexpr Duration kPause = std::chrono::milliseconds(1);
constexpr std::size_t kRoom = 64;

bool passes(int error) {
  return error == EAGAIN || error == EWOULDBLOCK || error == EINTR || error == ENOBUFS;
}

std::int64_t utc_now() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<Duration>(now).count();
}

class UdpChannel final : public Channel {
 public:
  explicit UdpChannel(UdpOptions options) : options_(std::move(options)) {}

  int descriptor() const override { return socket_.descriptor(); }

  std::size_t read(std::span<can::Frame> out, BusEvents& events, Instant now) override {
    if (now >= write_again_) {
      write_again_ = Instant{};
    }
    if (failure_ != 0) {
      fail(std::exchange(failure_, 0), events, now);
    }
    if (!ready() && now >= retry_at_ && events.room() >= BusEvents::kPerFrame) {
      open(events, now);
    }
    // Counts every datagram, own and malformed ones included: their number is unbounded.
    std::size_t looked = 0;
    std::size_t count = 0;
    bool drained = false;
    while (ready() && looked < out.size() && events.room() >= BusEvents::kPerFrame) {
      if (next_ == end_ && (drained || !refill(out.size() - looked, drained, events, now))) {
        break;
      }
      ++looked;
      const bool given = take(socket_.received(next_++), out[count], events);
      count += given ? 1U : 0U;
      events.frames_given(given ? 1U : 0U);
    }
    more_ = ready() && looked == out.size();
    counters_.received += count;
    return count;
  }
  bool more() const override { return more_; }

  std::size_t write(std::span<const can::Frame> frames, Instant now) override {
    std::size_t taken = 0;
    while (taken < frames.size() && room(now) > 0) {
      if (!sendable(frames[taken], true)) {
        ++counters_.refused;
      } else if (const int error = send(frames[taken]); error == 0) {
        ++counters_.sent;
      } else {
        report(error, now);
        break;
      }
      ++taken;
    }
    counters_.stalled += taken < frames.size() ? 1U : 0U;
    counters_.acknowledged = counters_.taken();
    return taken;
  }

  std::size_t room(Instant now) const override {
    return ready() && failure_ == 0 && now >= write_again_ ? kRoom : 0;
  }
  bool wants_writable() const override { return false; }
  Instant next_wake() const override {
    if (!ready()) {
      return retry_at_;
    }
    if (failure_ != 0 || next_ < end_) {
      return Instant{};
    }
    return write_again_ != Instant{} ? write_again_ : kNever;
  }
  const ChannelCounters& counters() const override { return counters_; }

 private:
  bool ready() const { return socket_.descriptor() >= 0; }

  void open(BusEvents& events, Instant now) {
    if (const int error = socket_.open(options_); error != 0) {
      fail(error, events, now);
      return;
    }
    reported_ = 0;
    dropped_ = 0;
    BusEvent event;
    event.kind = BusEvent::Kind::interface_ready;
    event.time = now;
    events.push(event);
    errors_.set_state(BusState::error_active, now, events);
  }

  void fail(int error, BusEvents& events, Instant now) {
    socket_.close();
    next_ = end_ = 0;
    retry_at_ = now + kRetryPeriod;
    if (std::exchange(reported_, error) == error) {
      return;
    }
    BusEvent event;
    event.kind = BusEvent::Kind::interface_failed;
    event.code = static_cast<std::uint32_t>(error);
    event.time = now;
    events.push(event);
    errors_.set_state(BusState::absent, now, events);
  }

  bool refill(std::size_t room, bool& drained, BusEvents& events, Instant now) {
    const std::size_t wanted = std::min(room, MulticastSocket::kBatch);
    const int got = socket_.receive(wanted);
    if (got <= 0) {
      if (got < 0 && !passes(-got)) {
        fail(-got, events, std::max(now, clock_.latest()));
      }
      return false;
    }
    clock_.begin_batch();
    next_ = 0;
    end_ = static_cast<std::size_t>(got);
    drained = end_ < wanted;
    return true;
  }

  // Returns true if it is a frame for the caller.
  bool take(const MulticastSocket::Received& received, can::Frame& out, BusEvents& events) {
    const Instant time = clock_.instant(received.stamp_ns);
    if (received.has_dropped && received.dropped != dropped_) {
      BusEvent event;
      event.kind = BusEvent::Kind::frames_lost;
      event.count = received.dropped - dropped_;
      event.time = time;
      events.push(event);
      counters_.lost += event.count;
      dropped_ = received.dropped;
    }
    if (received.own) {
      ++counters_.confirmed;
      return false;
    }
    canfd_frame error{};
    const auto result = received.cut_short ? MulticastDecoder::Result::malformed
                                           : decoder_.decode(received.datagram, out, error);
    out.time = time;
    counters_.malformed += result == MulticastDecoder::Result::malformed ? 1U : 0U;
    if (result == MulticastDecoder::Result::error_frame) {
      errors_.decode(error, time, events);
    }
    return result == MulticastDecoder::Result::frame;
  }

  int send(const can::Frame& frame) {
    const std::size_t length = encode_multicast(frame, utc_now(), datagram_);
    return socket_.send(std::span(datagram_).first(length));
  }

  void report(int error, Instant now) {
    if (passes(error)) {
      write_again_ = now + kPause;
    } else {
      failure_ = error;
    }
  }

  const UdpOptions options_;
  MulticastSocket socket_;
  MulticastDecoder decoder_;
  ErrorDecoder errors_;
  ReceiveClock clock_;
  ChannelCounters counters_;
  std::array<char, kMulticastDatagram> datagram_{};
  std::size_t next_ = 0;  // position in the batch that was read last
  std::size_t end_ = 0;
  bool more_ = false;
  int failure_ = 0;   // detected while writing; the next read() reports it
  int reported_ = 0;  // the last reported failure, while it lasts
  std::uint32_t dropped_ = 0;
  Instant retry_at_{};
  Instant write_again_{};
};

bool is_multicast(const std::string& group) {
  in_addr v4{};
  in6_addr v6{};
  if (::inet_pton(AF_INET, group.c_str(), &v4) == 1) {
    return IN_MULTICAST(ntohl(v4.s_addr));
  }
  return ::inet_pton(AF_INET6, group.c_str(), &v6) == 1 && v6.s6_addr[0] == 0xFF;
}

std::optional<unsigned> number(std::string_view text, unsigned highest) {
  unsigned value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool good = read.ec == std::errc{} && read.ptr == text.data() + text.size();
  return good && value <= highest ? std::optional(value) : std::nullopt;
}

// "239.74.163.2:43113", "[ff15::1]:43113".
bool read_address(std::string_view name, UdpOptions& out) {
  const std::size_t colon = name.rfind(':');
  if (colon == std::string_view::npos) {
    return false;
  }
  std::string_view group = name.substr(0, colon);
  const bool brackets = group.starts_with('[') && group.ends_with(']');
  if (brackets) {
    group = group.substr(1, group.size() - 2);
  }
  out.group = group;
  const auto port = number(name.substr(colon + 1), 65'535);
  out.port = static_cast<std::uint16_t>(port.value_or(0));
  const bool v6 = group.find(':') != std::string_view::npos;
  return out.port != 0 && brackets == v6 && is_multicast(out.group);
}

}  // namespace

ParsedUdp udp_options(const InterfaceUri& uri) {
  ParsedUdp parsed;
  if (!read_address(uri.name, parsed.options)) {
    parsed.error = "interface \"udp:" + uri.name +
                   "\" needs a multicast address and a port, as in \"udp:239.74.163.2:43113\" or "
                   "\"udp:[ff15::1]:43113\"";
    return parsed;
  }
  for (const UriOption& option : uri.options) {
    const auto ttl = number(option.value, 255);
    if (option.key == "ttl" && ttl) {
      parsed.options.ttl = static_cast<std::uint8_t>(*ttl);
    } else if (option.key == "interface" && !option.value.empty()) {
      parsed.options.interface = option.value;
    } else {
      parsed.error = "a udp interface has the options ttl (0 to 255) and interface, not \"" +
                     option.key + "=" + option.value + "\"";
    }
  }
  return parsed;
}

std::unique_ptr<Channel> open_udp(const UdpOptions& options) {
  return std::make_unique<UdpChannel>(options);
}

}  // namespace linegate::can_bridge
