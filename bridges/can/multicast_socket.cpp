// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/multicast_socket.h"

#include <array>
#include <cerrno>
#include <cstring>

#include <net/if.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#include "bridges/can/multicast_codec.h"
#include "bridges/can/socket_parts.h"

namespace linegate::can_bridge {
namespace {

constexpr int kReceiveBuffer = 1 << 21;

struct Address {
  sockaddr_storage storage{};
  socklen_t length = 0;

  int family() const { return storage.ss_family; }
  const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&storage); }
  template <class T>
  T as() const {
    T out;
    std::memcpy(&out, &storage, sizeof out);
    return out;
  }
};

// Host and port.
bool same(const sockaddr_storage& a, const sockaddr_storage& b) {
  if (a.ss_family != b.ss_family) {
    return false;
  }
  const Address left{a, 0};
  const Address right{b, 0};
  if (a.ss_family == AF_INET) {
    const auto x = left.as<sockaddr_in>();
    const auto y = right.as<sockaddr_in>();
    return x.sin_port == y.sin_port && x.sin_addr.s_addr == y.sin_addr.s_addr;
  }
  const auto x = left.as<sockaddr_in6>();
  const auto y = right.as<sockaddr_in6>();
  return x.sin6_port == y.sin6_port &&
         std::memcmp(&x.sin6_addr, &y.sin6_addr, sizeof x.sin6_addr) == 0;
}

// 0, or errno.
int resolve(const UdpOptions& options, Address& out) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_DGRAM;
  hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  if (::getaddrinfo(options.group.c_str(), std::to_string(options.port).c_str(), &hints, &found) !=
      0) {
    return EINVAL;
  }
  std::memcpy(&out.storage, found->ai_addr, found->ai_addrlen);
  out.length = found->ai_addrlen;
  ::freeaddrinfo(found);
  return 0;
}

// Number of the network interface; 0 = the system's choice. -1: there is none of that name.
int interface_number(const UdpOptions& options) {
  if (options.interface.empty() && options.ttl > 0) {
    return 0;
  }
  const unsigned number =
      ::if_nametoindex(options.interface.empty() ? "lo" : options.interface.c_str());
  return number == 0 ? -1 : static_cast<int>(number);
}

bool join(int descriptor, const Address& group, int interface) {
  if (group.family() == AF_INET6) {
    ipv6_mreq request{};
    request.ipv6mr_multiaddr = group.as<sockaddr_in6>().sin6_addr;
    request.ipv6mr_interface = static_cast<unsigned>(interface);
    return set_option(descriptor, IPPROTO_IPV6, IPV6_JOIN_GROUP, request);
  }
  ip_mreqn request{};
  request.imr_multiaddr = group.as<sockaddr_in>().sin_addr;
  request.imr_ifindex = interface;
  return set_option(descriptor, IPPROTO_IP, IP_ADD_MEMBERSHIP, request);
}

// Bound to the group, so that datagrams to the same port of other groups stay away.
bool prepare_receiving(int descriptor, const Address& group, int interface) {
  set_option(descriptor, SOL_SOCKET, SO_RCVBUF, kReceiveBuffer);
  return set_option(descriptor, SOL_SOCKET, SO_REUSEADDR, kOn) &&
         set_option(descriptor, SOL_SOCKET, SO_TIMESTAMPNS, kOn) &&
         set_option(descriptor, SOL_SOCKET, SO_RXQ_OVFL, kOn) &&
         ::bind(descriptor, group.get(), group.length) == 0 && join(descriptor, group, interface);
}

bool prepare_sending(int descriptor, const Address& group, int interface, int ttl) {
  bool good = false;
  if (group.family() == AF_INET6) {
    good = set_option(descriptor, IPPROTO_IPV6, IPV6_MULTICAST_HOPS, ttl) &&
           set_option(descriptor, IPPROTO_IPV6, IPV6_MULTICAST_LOOP, kOn) &&
           set_option(descriptor, IPPROTO_IPV6, IPV6_MULTICAST_IF, interface);
  } else {
    ip_mreqn request{};
    request.imr_ifindex = interface;
    good = set_option(descriptor, IPPROTO_IP, IP_MULTICAST_TTL, ttl) &&
           set_option(descriptor, IPPROTO_IP, IP_MULTICAST_LOOP, kOn) &&
           set_option(descriptor, IPPROTO_IP, IP_MULTICAST_IF, request);
  }
  return good && ::connect(descriptor, group.get(), group.length) == 0;
}

}  // namespace

struct MulticastSocket::Buffers {
  std::array<mmsghdr, kBatch> headers{};
  std::array<iovec, kBatch> vectors{};
  std::array<std::array<char, kMulticastDatagram>, kBatch> datagrams{};
  std::array<sockaddr_storage, kBatch> senders{};
  std::array<Control, kBatch> controls{};
  sockaddr_storage self{};  // what own datagrams come from
};

MulticastSocket::MulticastSocket() : buffers_(std::make_unique<Buffers>()) {
}

MulticastSocket::~MulticastSocket() {
  close();
}

void MulticastSocket::close() {
  for (int* descriptor : {&receiving_, &sending_}) {
    if (*descriptor >= 0) {
      ::close(*descriptor);
    }
    *descriptor = -1;
  }
}

int MulticastSocket::open(const UdpOptions& options) {
  constexpr int kType = SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC;
  close();
  Address group;
  if (const int error = resolve(options, group); error != 0) {
    return error;
  }
  const int interface = interface_number(options);
  if (interface < 0) {
    return ENODEV;
  }
  receiving_ = ::socket(group.family(), kType, 0);
  sending_ = ::socket(group.family(), kType, 0);
  socklen_t length = sizeof buffers_->self;
  if (receiving_ >= 0 && sending_ >= 0 && prepare_receiving(receiving_, group, interface) &&
      prepare_sending(sending_, group, interface, options.ttl) &&
      ::getsockname(sending_, reinterpret_cast<sockaddr*>(&buffers_->self), &length) == 0) {
    return 0;
  }
  const int error = errno;
  close();
  return error;
}

int MulticastSocket::receive(std::size_t count) {
  Buffers& b = *buffers_;
  for (std::size_t i = 0; i < count; ++i) {
    b.vectors[i] = {b.datagrams[i].data(), b.datagrams[i].size()};
    b.headers[i] = {};
    msghdr& header = b.headers[i].msg_hdr;
    header.msg_name = &b.senders[i];
    header.msg_namelen = sizeof b.senders[i];
    header.msg_iov = &b.vectors[i];
    header.msg_iovlen = 1;
    header.msg_control = &b.controls[i];
    header.msg_controllen = sizeof b.controls[i];
  }
  const int got =
      ::recvmmsg(receiving_, b.headers.data(), static_cast<unsigned>(count), MSG_DONTWAIT, nullptr);
  return got >= 0 ? got : -errno;
}

MulticastSocket::Received MulticastSocket::received(std::size_t index) const {
  Buffers& b = *buffers_;
  msghdr& header = b.headers[index].msg_hdr;
  Received out;
  out.datagram = std::span(b.datagrams[index]).first(b.headers[index].msg_len);
  out.cut_short = (header.msg_flags & MSG_TRUNC) != 0;
  out.own = same(b.senders[index], b.self);
  for (cmsghdr* part = CMSG_FIRSTHDR(&header); part != nullptr; part = CMSG_NXTHDR(&header, part)) {
    if (part->cmsg_level != SOL_SOCKET) {
      continue;
    }
    if (part->cmsg_type == SCM_TIMESTAMPNS) {
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(part), sizeof stamp);
      out.stamp_ns = std::int64_t{stamp.tv_sec} * 1'000'000'000 + stamp.tv_nsec;
    } else if (part->cmsg_type == SO_RXQ_OVFL) {
      std::memcpy(&out.dropped, CMSG_DATA(part), sizeof out.dropped);
      out.has_dropped = true;
    }
  }
  return out;
}

int MulticastSocket::send(std::span<const char> datagram) {
  const ssize_t sent = ::send(sending_, datagram.data(), datagram.size(), MSG_DONTWAIT);
  return sent >= 0 ? 0 : errno;
}

}  // namespace linegate::can_bridge
