// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/channel.h"

#include <cerrno>
#include <system_error>

#include "stack/base/assert.h"

namespace linegate::can_bridge {
namespace {

bool mergeable(const can::BusEvent& earlier, const can::BusEvent& later) {
  using Kind = can::BusEvent::Kind;
  return earlier.kind == later.kind &&
         (later.kind == Kind::error || later.kind == Kind::frames_lost);
}

}  // namespace

void BusEvents::push(const can::BusEvent& event) {
  if (count_ > 0 && mergeable(events_[count_ - 1], event)) {
    can::BusEvent& last = events_[count_ - 1];
    last.errors |= event.errors;
    last.count += event.count;
    last.transmit_errors = event.transmit_errors;
    last.receive_errors = event.receive_errors;
    last.time = event.time;
    frames_before_[count_ - 1] = frames_;
    return;
  }
  LINEGATE_ASSERT(room() > 0, "read() stops before its events overflow");
  frames_before_[count_] = frames_;
  events_[count_++] = event;
}

int Channel::restart(Instant /*now*/) {
  return EOPNOTSUPP;
}

int Channel::fault(std::string_view /*change*/, std::string& /*said*/, Instant /*now*/) {
  return EOPNOTSUPP;
}

std::string describe_failure(std::string_view interface, std::uint32_t code) {
  const std::string name(interface);
  switch (static_cast<int>(code)) {
    case ENOENT:
      return "no such file: " + name;
    case ENODEV:
    case ENXIO:
      return "no such interface: " + name;
    case ENETDOWN:
      return "interface " + name + " is down: ip link set " + name + " up";
    case EMEDIUMTYPE:
      return name + " is not a CAN interface";
    case EAFNOSUPPORT:
      return "this kernel has no CAN support (AF_CAN): load the can and can-raw modules "
             "(modprobe can-raw)";
    case EPROTONOSUPPORT:
      return "this kernel has no raw CAN sockets (CAN_RAW): load the can-raw module "
             "(modprobe can-raw)";
    case EMSGSIZE:
      return name + " carries no CAN FD frames, which the line needs: set its controller up with " +
             "fd on, or a virtual interface with ip link set " + name + " mtu 72";
    case EPERM:
    case EACCES:
      return "no permission to open " + name + ": CAP_NET_RAW may be missing";
    case ENODATA:
      return name + " is at its end";
    case EPIPE:
    case ECONNRESET:
    case ECONNREFUSED:
      return "the other end of " + name + " is gone";
    default:
      return name + ": " + std::generic_category().message(static_cast<int>(code));
  }
}

}  // namespace linegate::can_bridge
