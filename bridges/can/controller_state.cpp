#include "bridges/can/controller_state.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include <linux/can/netlink.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>
#include <sys/socket.h>
#include <unistd.h>

namespace linegate::can_bridge {
namespace {

using Bytes = std::span<const std::byte>;

constexpr std::size_t aligned(std::size_t length) {
  return (length + 3) & ~std::size_t{3};
}

// The content of the first attribute of that type in a row of attributes; empty if there is none.
Bytes find_attribute(Bytes attributes, unsigned type) {
  while (attributes.size() >= sizeof(rtattr)) {
    rtattr header;
    std::memcpy(&header, attributes.data(), sizeof header);
    if (header.rta_len < sizeof header || header.rta_len > attributes.size()) {
      break;
    }
    if ((header.rta_type & NLA_TYPE_MASK) == type) {
      return attributes.subspan(sizeof header, header.rta_len - sizeof header);
    }
    attributes = attributes.subspan(std::min(aligned(header.rta_len), attributes.size()));
  }
  return {};
}

can::BusState to_bus_state(std::uint32_t state) {
  switch (state) {
    case CAN_STATE_ERROR_WARNING:
      return can::BusState::error_warning;
    case CAN_STATE_ERROR_PASSIVE:
      return can::BusState::error_passive;
    case CAN_STATE_BUS_OFF:
      return can::BusState::bus_off;
    default:
      return can::BusState::error_active;
  }
}

can::BusState parse(Bytes answer) {
  constexpr std::size_t kHeaders = NLMSG_HDRLEN + NLMSG_ALIGN(sizeof(ifinfomsg));
  nlmsghdr header;
  if (answer.size() < kHeaders) {
    return can::BusState::error_active;
  }
  std::memcpy(&header, answer.data(), sizeof header);
  if (header.nlmsg_type != RTM_NEWLINK) {
    return can::BusState::error_active;
  }
  const Bytes info = find_attribute(answer.subspan(kHeaders), IFLA_LINKINFO);
  const Bytes state = find_attribute(find_attribute(info, IFLA_INFO_DATA), IFLA_CAN_STATE);
  std::uint32_t value = CAN_STATE_ERROR_ACTIVE;
  if (state.size() >= sizeof value) {
    std::memcpy(&value, state.data(), sizeof value);
  }
  return to_bus_state(value);
}

}  // namespace

can::BusState controller_state(int interface_index) {
  struct {
    nlmsghdr header{};
    ifinfomsg info{};
  } request;
  request.header.nlmsg_len = sizeof request;
  request.header.nlmsg_type = RTM_GETLINK;
  request.header.nlmsg_flags = NLM_F_REQUEST;
  request.info.ifi_family = AF_UNSPEC;
  request.info.ifi_index = interface_index;
  const int descriptor =
      ::socket(AF_NETLINK, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, NETLINK_ROUTE);
  if (descriptor < 0) {
    return can::BusState::error_active;
  }
  alignas(nlmsghdr) std::array<std::byte, 16384> answer;
  ssize_t length = -1;
  // The kernel answers within send(): there is nothing to wait for.
  if (::send(descriptor, &request, sizeof request, 0) == static_cast<ssize_t>(sizeof request)) {
    length = ::recv(descriptor, answer.data(), answer.size(), 0);
  }
  ::close(descriptor);
  return length > 0 ? parse(Bytes(answer).first(static_cast<std::size_t>(length)))
                    : can::BusState::error_active;
}

}  // namespace linegate::can_bridge
