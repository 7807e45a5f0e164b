#include "bridges/can/channel.h"

#include <cerrno>
#include <system_error>

namespace linegate::can_bridge {
namespace {

constexpr std::size_t kMaxInterfaceName = 15;  // IFNAMSIZ without the final zero
constexpr std::size_t kMaxBusName = 64;

bool mergeable(const can::BusEvent& earlier, const can::BusEvent& later) {
  using Kind = can::BusEvent::Kind;
  return earlier.kind == later.kind &&
         (later.kind == Kind::error || later.kind == Kind::frames_lost);
}

bool printable_name(std::string_view name) {
  for (const char c : name) {
    if (c <= ' ' || c > '~' || c == '/') {
      return false;
    }
  }
  return !name.empty();
}

std::string quoted(std::string_view text) {
  return "\"" + std::string(text) + "\"";
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
  if (count_ < kCapacity) {
    frames_before_[count_] = frames_;
    events_[count_++] = event;
  }
}

ParsedUri parse_uri(std::string_view text) {
  ParsedUri parsed;
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) {
    parsed.error = "interface " + quoted(text) +
                   " has no scheme: write \"socketcan:" + std::string(text) +
                   "\" or \"virtual:" + std::string(text) + "\"";
    return parsed;
  }
  parsed.uri.scheme = text.substr(0, colon);
  parsed.uri.name = text.substr(colon + 1);
  const bool socketcan = parsed.uri.scheme == "socketcan";
  if (!socketcan && parsed.uri.scheme != "virtual") {
    parsed.error = "unknown interface scheme " + quoted(parsed.uri.scheme) +
                   ": known are \"socketcan\" and \"virtual\"";
  } else if (!printable_name(parsed.uri.name)) {
    parsed.error = "interface " + quoted(text) +
                   " needs a name of printable characters after the colon, as in \"" +
                   parsed.uri.scheme + (socketcan ? ":can0\"" : ":line1\"");
  } else if (parsed.uri.name.size() > (socketcan ? kMaxInterfaceName : kMaxBusName)) {
    parsed.error = "interface name " + quoted(parsed.uri.name) + " is too long: at most " +
                   std::to_string(socketcan ? kMaxInterfaceName : kMaxBusName) + " characters";
  }
  return parsed;
}

std::string describe_failure(std::string_view interface, std::uint32_t code) {
  const std::string name(interface);
  switch (static_cast<int>(code)) {
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
    case EPERM:
    case EACCES:
      return "no permission to open " + name + ": CAP_NET_RAW may be missing";
    case EPIPE:
    case ECONNRESET:
    case ECONNREFUSED:
      return "the other end of " + name + " is gone";
    default:
      return name + ": " + std::generic_category().message(static_cast<int>(code));
  }
}

}  // namespace linegate::can_bridge
