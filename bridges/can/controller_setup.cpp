// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/controller_setup.h"

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <string_view>

#include <linux/can/netlink.h>
#include <linux/if_link.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

namespace linegate::can_bridge {
namespace {

// A netlink request that changes one interface: a header and nested attributes.
class Request {
 public:
  enum class Change { none, up, down };

  Request(int interface_index, Change change) {
    header_.nlmsg_type = RTM_NEWLINK;
    header_.nlmsg_flags = NLM_F_REQUEST | NLM_F_ACK;
    info_.ifi_family = AF_UNSPEC;
    info_.ifi_index = interface_index;
    info_.ifi_flags = change == Change::up ? unsigned{IFF_UP} : 0U;
    info_.ifi_change = change != Change::none ? unsigned{IFF_UP} : 0U;
    size_ = NLMSG_HDRLEN + NLMSG_ALIGN(sizeof info_);
  }

  void add(unsigned short type, const void* data, std::size_t size) {
    const std::size_t at = begin(type);
    std::memcpy(bytes_.data() + size_, data, size);
    size_ += size;
    end(at);
  }
  // Opens a nested attribute: everything until end() is inside it.
  std::size_t begin(unsigned short type) {
    const rtattr header{0, type};
    std::memcpy(bytes_.data() + size_, &header, sizeof header);
    const std::size_t at = size_;
    size_ += sizeof header;
    return at;
  }
  void end(std::size_t at) {
    const auto length = static_cast<unsigned short>(size_ - at);
    std::memcpy(bytes_.data() + at, &length, sizeof length);
    size_ = (size_ + 3) & ~std::size_t{3};
  }

  // Returns 0 or errno.
  int send() {
    header_.nlmsg_len = static_cast<std::uint32_t>(size_);
    std::memcpy(bytes_.data(), &header_, sizeof header_);
    std::memcpy(bytes_.data() + NLMSG_HDRLEN, &info_, sizeof info_);
    const int descriptor =
        ::socket(AF_NETLINK, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, NETLINK_ROUTE);
    if (descriptor < 0) {
      return errno;
    }
    int error = EIO;
    // The kernel processes the request within send(), so the answer is already there.
    if (::send(descriptor, bytes_.data(), size_, 0) == static_cast<ssize_t>(size_)) {
      error = answer(descriptor);
    }
    ::close(descriptor);
    return error;
  }

 private:
  static int answer(int descriptor) {
    struct {
      nlmsghdr header;
      nlmsgerr error;
      std::array<std::byte, 1024> rest;
    } answer{};
    const ssize_t length = ::recv(descriptor, &answer, sizeof answer, 0);
    constexpr auto kShortest = static_cast<ssize_t>(sizeof answer.header + sizeof(int));
    return length >= kShortest && answer.header.nlmsg_type == NLMSG_ERROR ? -answer.error.error
                                                                          : EIO;
  }

  nlmsghdr header_{};
  ifinfomsg info_{};
  alignas(nlmsghdr) std::array<std::byte, 512> bytes_{};
  std::size_t size_ = 0;
};

void add_timing(Request& request, unsigned short type, std::uint32_t bit_rate,
                std::uint32_t sample_point) {
  if (bit_rate == 0) {
    return;
  }
  can_bittiming timing{};
  timing.bitrate = bit_rate;
  timing.sample_point = sample_point;
  request.add(type, &timing, sizeof timing);
}

void add_modes(Request& request, const ControllerSetup& setup) {
  const ControllerModes wanted = modes_of(setup);
  const can_ctrlmode modes{.mask = wanted.mask, .flags = wanted.flags};
  if (modes.mask != 0) {
    request.add(IFLA_CAN_CTRLMODE, &modes, sizeof modes);
  }
}

}  // namespace

ControllerModes modes_of(const ControllerSetup& setup) {
  ControllerModes out;
  if (setup.data_bit_rate != 0) {
    out.mask |= CAN_CTRLMODE_FD;
    out.flags |= CAN_CTRLMODE_FD;
  }
  if (setup.listen_only) {  // also send `off`: the controller may still have it on
    out.mask |= CAN_CTRLMODE_LISTENONLY;
    out.flags |= *setup.listen_only ? CAN_CTRLMODE_LISTENONLY : 0U;
  }
  return out;
}

int set_up_controller(int interface_index, const ControllerSetup& setup) {
  constexpr std::string_view kKind = "can";
  Request settings(interface_index, Request::Change::none);
  const std::size_t info = settings.begin(IFLA_LINKINFO);
  settings.add(IFLA_INFO_KIND, kKind.data(), kKind.size());
  const std::size_t data = settings.begin(IFLA_INFO_DATA);
  add_modes(settings, setup);
  add_timing(settings, IFLA_CAN_BITTIMING, setup.bit_rate, setup.sample_point);
  add_timing(settings, IFLA_CAN_DATA_BITTIMING, setup.data_bit_rate, setup.data_sample_point);
  if (setup.restart_ms) {
    settings.add(IFLA_CAN_RESTART_MS, &*setup.restart_ms, sizeof *setup.restart_ms);
  }
  settings.end(data);
  settings.end(info);
  if (const int error = settings.send(); error != 0) {
    return error;
  }
  return Request(interface_index, Request::Change::up).send();
}

int restart_controller(int interface_index) {
  const int error = Request(interface_index, Request::Change::down).send();
  return error != 0 ? error : Request(interface_index, Request::Change::up).send();
}

}  // namespace linegate::can_bridge
