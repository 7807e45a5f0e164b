// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/interface.h"

#include <cerrno>
#include <cstring>

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/ethtool.h>
#include <linux/net_tstamp.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "bridges/can/controller_state.h"
#include "bridges/can/hardware_clock.h"
#include "bridges/can/socket_parts.h"

namespace linegate::can_bridge {
namespace {

// Closes what a failed attempt leaves behind.
class Attempt {
 public:
  Attempt() : descriptor_(::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW)) {}
  ~Attempt() {
    if (descriptor_ >= 0) {
      ::close(descriptor_);
    }
  }
  Attempt(const Attempt&) = delete;
  Attempt& operator=(const Attempt&) = delete;

  int descriptor() const { return descriptor_; }
  int release() {
    const int descriptor = descriptor_;
    descriptor_ = -1;
    return descriptor;
  }

 private:
  int descriptor_;
};

// 0, or errno. index becomes the interface's, fd whether it carries CAN FD.
int examine(int descriptor, const std::string& name, int& index, bool& fd) {
  ifreq request{};
  std::strncpy(request.ifr_name, name.c_str(), IFNAMSIZ - 1);
  if (::ioctl(descriptor, SIOCGIFINDEX, &request) != 0) {
    return errno;
  }
  index = request.ifr_ifindex;
  if (::ioctl(descriptor, SIOCGIFHWADDR, &request) != 0) {
    return errno;
  }
  if (request.ifr_hwaddr.sa_family != ARPHRD_CAN) {
    return EMEDIUMTYPE;
  }
  if (::ioctl(descriptor, SIOCGIFFLAGS, &request) != 0) {
    return errno;
  }
  if ((request.ifr_flags & IFF_UP) == 0) {
    return ENETDOWN;
  }
  if (::ioctl(descriptor, SIOCGIFMTU, &request) != 0) {
    return errno;
  }
  fd = request.ifr_mtu >= static_cast<int>(CANFD_MTU);
  return 0;
}

// Whether the controller stamps what it receives; not if the driver does not say so.
bool has_hardware_stamps(int descriptor, const std::string& name) {
  ethtool_ts_info info{};
  info.cmd = ETHTOOL_GET_TS_INFO;
  ifreq request{};
  std::strncpy(request.ifr_name, name.c_str(), IFNAMSIZ - 1);
  request.ifr_data = reinterpret_cast<char*>(&info);
  return ::ioctl(descriptor, SIOCETHTOOL, &request) == 0 && offers_hardware_stamps(info);
}

// The kernel's stamps, and those of the controller where it is said to make them.
bool stamp(int descriptor, bool& hardware) {
  const int both = SOF_TIMESTAMPING_RX_HARDWARE | SOF_TIMESTAMPING_RAW_HARDWARE |
                   SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE;
  hardware = hardware && set_option(descriptor, SOL_SOCKET, SO_TIMESTAMPING, both);
  return hardware || set_option(descriptor, SOL_SOCKET, SO_TIMESTAMPNS, kOn);
}

bool configure(int descriptor, bool fd, int receive_buffer) {
  const can_err_mask_t errors = CAN_ERR_MASK;
  // A larger buffer than the system's limit needs a privilege; what is granted has to do.
  if (!set_option(descriptor, SOL_SOCKET, SO_RCVBUFFORCE, receive_buffer)) {
    set_option(descriptor, SOL_SOCKET, SO_RCVBUF, receive_buffer);
  }
  return set_option(descriptor, SOL_SOCKET, SO_RXQ_OVFL, kOn) &&
         set_option(descriptor, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, errors) &&
         set_option(descriptor, SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, kOn) &&
         (!fd || set_option(descriptor, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, kOn));
}

int bind_to(int descriptor, int index) {
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  return ::bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0
             ? 0
             : errno;
}

}  // namespace

OpenedInterface open_interface(const std::string& name, int receive_buffer,
                               const ControllerSetup& setup) {
  OpenedInterface result;
  Attempt attempt;
  if (attempt.descriptor() < 0) {
    result.error = errno;
    return result;
  }
  int index = 0;
  result.error = examine(attempt.descriptor(), name, index, result.fd);
  if (result.error == ENETDOWN && setup.any()) {
    result.error = set_up_controller(index, setup);
    if (result.error == 0) {
      result.error = examine(attempt.descriptor(), name, index, result.fd);
    } else if (result.error == EPERM) {
      result.error = ENETDOWN;
    }
  }
  bool hardware = result.error == 0 && has_hardware_stamps(attempt.descriptor(), name);
  if (result.error == 0 && (!configure(attempt.descriptor(), result.fd, receive_buffer) ||
                            !stamp(attempt.descriptor(), hardware))) {
    result.error = errno;
  }
  if (result.error == 0) {
    result.error = bind_to(attempt.descriptor(), index);
  }
  if (result.error == 0) {
    const ControllerReport report = controller_report(index);
    result.state = report.state;
    result.settings = report.settings;
    result.settings.hardware_stamps = hardware;
    result.descriptor = attempt.release();
  }
  return result;
}

}  // namespace linegate::can_bridge
