// SPDX-License-Identifier: Apache-2.0
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

// The content of the first attribute of that type; empty if there is none.
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

template <class T>
bool read_attribute(Bytes attributes, unsigned type, T& out) {
  const Bytes content = find_attribute(attributes, type);
  if (content.size() < sizeof out) {
    return false;
  }
  std::memcpy(&out, content.data(), sizeof out);
  return true;
}

ControllerSetup settings_in(Bytes data) {
  ControllerSetup settings;
  can_bittiming timing{};
  if (read_attribute(data, IFLA_CAN_BITTIMING, timing)) {
    settings.bit_rate = timing.bitrate;
    settings.sample_point = timing.sample_point;
  }
  if (read_attribute(data, IFLA_CAN_DATA_BITTIMING, timing)) {
    settings.data_bit_rate = timing.bitrate;
    settings.data_sample_point = timing.sample_point;
  }
  std::uint32_t restart_ms = 0;
  if (read_attribute(data, IFLA_CAN_RESTART_MS, restart_ms)) {
    settings.restart_ms = restart_ms;
  }
  can_ctrlmode modes{};
  if (read_attribute(data, IFLA_CAN_CTRLMODE, modes)) {
    settings.listen_only = (modes.flags & CAN_CTRLMODE_LISTENONLY) != 0;
  }
  return settings;
}

ControllerReport parse(Bytes answer) {
  constexpr std::size_t kHeaders = NLMSG_HDRLEN + NLMSG_ALIGN(sizeof(ifinfomsg));
  nlmsghdr header;
  if (answer.size() < kHeaders) {
    return {};
  }
  std::memcpy(&header, answer.data(), sizeof header);
  if (header.nlmsg_type != RTM_NEWLINK) {
    return {};
  }
  const Bytes info = find_attribute(answer.subspan(kHeaders), IFLA_LINKINFO);
  const Bytes data = find_attribute(info, IFLA_INFO_DATA);
  std::uint32_t state = CAN_STATE_ERROR_ACTIVE;
  read_attribute(data, IFLA_CAN_STATE, state);
  return {to_bus_state(state), settings_in(data)};
}

}  // namespace

ControllerReport controller_report(int interface_index) {
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
    return {};
  }
  alignas(nlmsghdr) std::array<std::byte, 16384> answer;
  ssize_t length = -1;
  // The kernel answers within send(), so no wait is needed.
  if (::send(descriptor, &request, sizeof request, 0) == static_cast<ssize_t>(sizeof request)) {
    length = ::recv(descriptor, answer.data(), answer.size(), 0);
  }
  ::close(descriptor);
  return length > 0 ? parse(Bytes(answer).first(static_cast<std::size_t>(length)))
                    : ControllerReport{};
}

}  // namespace linegate::can_bridge
