// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/event_text.h"

#include <algorithm>
#include <span>

#include <fmt/format.h>

#include "bridges/can/channel.h"
#include "stack/base/abort_code.h"
#include "stack/base/byte_order.h"
#include "stack/can/bus_state.h"
#include "stack/diagnosis/foreign_manager.h"
#include "stack/line/command.h"
#include "stack/line/output_write.h"
#include "stack/line/state.h"
#include "stack/lss/assigner.h"
#include "stack/manager/boot_report.h"
#include "stack/manager/shared_id.h"
#include "stack/nmt/heartbeat_consumer.h"
#include "stack/nmt/state.h"
#include "stack/od/objects.h"

namespace linegate::gateway {
namespace {

constexpr std::size_t kLongestText = 256;

std::string hex(std::span<const std::byte> bytes) {
  std::string out;
  for (const std::byte b : bytes) {
    out += fmt::format("{}{:02X}", out.empty() ? "" : " ", std::to_integer<unsigned>(b));
  }
  return out;
}

std::uint64_t number(const Event& event, std::size_t offset, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = size; i > 0; --i) {
    value = value << 8U | std::to_integer<std::uint64_t>(event.data[offset + i - 1]);
  }
  return value;
}

std::string suppressed(std::uint64_t count) {
  return count == 0 ? std::string() : fmt::format(" ({} more suppressed)", count);
}

// Number of suppressed events: of this kind, or of others in a storm.
std::string suppressed(const Event& event) {
  constexpr std::size_t kOffset = 8;
  constexpr std::size_t kSize = 4;
  return suppressed(event.length < kOffset + kSize ? 0 : number(event, kOffset, kSize));
}

template <class E>
std::string_view as(std::uint32_t code) {
  return name(static_cast<E>(code));
}

std::string object(const Event& event) {
  return fmt::format("{:04X}:{:02X}", number(event, 0, 2), number(event, 2, 1));
}

std::string abort_text(std::uint32_t code) {
  return fmt::format("{} ({:08X})", describe(static_cast<AbortCode>(code)), code);
}

std::string bus_errors(std::uint32_t bits) {
  constexpr std::array<std::string_view, 7> kNames{
      "transmit time-out", "lost arbitration", "controller",        "protocol",
      "transceiver",       "no acknowledge",   "controller restart"};
  std::string out;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if ((bits >> i & 1U) != 0) {
      out += (out.empty() ? "" : ", ") + std::string(kNames[i]);
    }
  }
  return out.empty() ? "unknown" : out;
}

// The signal by which another device was noticed.
std::string_view sign_of_life(std::uint32_t code) {
  const bool by_emcy = static_cast<nmt::State>(code) == nmt::State::unknown;
  return by_emcy ? "it sent an EMCY" : as<nmt::State>(code);
}

std::string reactions(std::uint32_t bits) {
  constexpr std::array<std::string_view, 7> kNames{"outputs set to zero",
                                                   "NMT enter pre-operational",
                                                   "NMT stop",
                                                   "NMT reset communication",
                                                   "NMT reset node",
                                                   "EMCY sent",
                                                   "heartbeat off"};
  std::string out;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if ((bits >> i & 1U) != 0) {
      out += (out.empty() ? "" : ", ") + std::string(kNames[i]);
    }
  }
  return out.empty() ? "outputs held" : out;
}

// For an own device whose node-ID was changed by LSS and differs from the configured one; else
// empty.
std::string node_id_by_lss(const Event& event) {
  const std::uint64_t id = event.length == 0 ? 0 : number(event, 0, 1);
  return id == 0 || event.node == 0 || id == event.node ? std::string()
                                                        : fmt::format(", node-ID {} by LSS", id);
}

std::string boot_text(const Event& event) {
  if (event.code == 0) {
    return "booted";
  }
  const char letter = static_cast<char>(event.code);
  return fmt::format("{} ({}): {}", manager::is_booted(letter) ? "booted" : "boot failed", letter,
                     manager::describe_boot(letter, manager::finding_of(event)));
}

std::string shared_id_text(const Event& event) {
  constexpr std::string_view kWhat = "two devices have this node-ID: ";
  switch (event.code) {
    case manager::kTwoAnswers:
      return fmt::format("{}two answers to one SDO request ({})", kWhat, object(event));
    case manager::kTwoStates:
      return fmt::format("{}heartbeats of two NMT states in turn", kWhat);
    case manager::kBootedBeside:
      return fmt::format("{}a boot-up message, and the heartbeat went on in Operational", kWhat);
    case manager::kTooManyHeartbeats:
      return fmt::format("{}twice as many heartbeats as its 1017h allows", kWhat);
    default:
      return fmt::format("{}heartbeats of two rhythms", kWhat);
  }
}

// For routing_opened and routing_ended.
std::string connection_text(const Event& e, const line::LineConfig& line) {
  const auto from = number(e, 0, 2);
  const auto out = number(e, 5, 1);
  const auto& lines = line.routing.interfaces;
  const auto left_by = std::find_if(lines.begin(), lines.end(),
                                    [&](const auto& known) { return known.number == out; });
  std::string way =
      fmt::format("{} to node {} of network {} over {}",
                  from == 0 ? std::string("this gateway") : fmt::format("network {}", from),
                  number(e, 4, 1), number(e, 2, 2),
                  left_by == lines.end() || left_by->name.empty() ? fmt::format("interface {}", out)
                                                                  : left_by->name);
  way += number(e, 6, 1) == 0 ? "" : fmt::format(":{}", number(e, 6, 1));
  if (e.kind == EventKind::routing_opened) {
    return fmt::format("connection {:08X} from {} opened{}", e.code, way,
                       e.value == 0 ? "" : fmt::format(" ({} more suppressed)", e.value));
  }
  constexpr std::array<std::string_view, 3> kServices{"no transfer", "upload", "download"};
  const auto service = std::min<std::uint64_t>(number(e, 7, 1), kServices.size() - 1);
  const std::string object =
      service == 0 ? "" : fmt::format(" of {:04X}:{:02X}", number(e, 8, 2), number(e, 10, 1));
  return fmt::format("connection {:08X} from {} ended, {}{}, {} bytes: {}", number(e, 11, 4), way,
                     kServices[service], object, e.value,
                     e.code == 0 ? "done" : abort_text(e.code));
}

std::string routing_text(const Event& e) {
  if (e.kind == EventKind::emcy_routed) {
    return fmt::format("EMCY {:04X}h of node {} in network {}, error register {:02X}h, {} hops",
                       e.code, number(e, 3, 1), number(e, 1, 2), number(e, 0, 1), number(e, 4, 1));
  }
  constexpr std::array<std::string_view, 3> kServices{"SDO", "EMCY", "PDO"};
  const auto from = number(e, 0, 2);
  return fmt::format("{} from {} to node {} of network {} refused: {}",
                     kServices[std::min<std::size_t>(number(e, 5, 1), kServices.size() - 1)],
                     from == 0 ? std::string("this gateway") : fmt::format("network {}", from),
                     number(e, 4, 1), number(e, 2, 2), abort_text(e.code));
}

std::string progress_text(const Event& e) {
  const auto kind = static_cast<line::CommandKind>(e.code);
  const auto total = number(e, 0, 4);
  const std::string_view unit = kind == line::CommandKind::configure ? " objects"
                                : kind == line::CommandKind::program ? " bytes"
                                                                     : "";
  return total == 0 ? fmt::format("{}: {}{}", name(kind), e.value, unit)
                    : fmt::format("{}: {} of {}{}", name(kind), e.value, total, unit);
}

// In the format of candump.
std::string frame_text(const Event& e) {
  constexpr std::uint32_t kExtended = 0x8000'0000;
  const std::uint32_t length = e.value & 0xFFU;
  const std::uint32_t piece = e.value >> 10U & 3U;
  const std::uint32_t before = e.value >> 16U;
  std::string out = (e.code & kExtended) != 0 ? fmt::format("frame {:08X}", e.code & ~kExtended)
                                              : fmt::format("frame {:03X}", e.code);
  if ((e.value & 0x100U) != 0) {
    out += length == 0 ? "#R" : fmt::format("#R{}", length);
  } else {
    out += (e.value & 0x200U) != 0 ? "##4" : "#";
    std::string data = hex(std::span(e.data).first(std::min<std::size_t>(e.length, 16)));
    std::erase(data, ' ');
    out += data;
  }
  out += length > 16 ? fmt::format(" (bytes from {} of {})", 16 * piece, length) : "";
  return before == 0 ? out : out + fmt::format(" ({} more suppressed)", before);
}

std::string line_text(const Event& e, std::string_view interface) {
  switch (e.kind) {
    case EventKind::line_started:
      return fmt::format("started as {}", as<line::Role>(e.code));
    case EventKind::line_stopped:
      return "stopped";
    case EventKind::bus_state:
      return fmt::format("bus {} (was {}), TEC {}, REC {}", as<can::BusState>(e.code),
                         as<can::BusState>(e.value), number(e, 0, 1), number(e, 1, 1));
    case EventKind::bus_error:
      return "bus error: " + bus_errors(e.code) + suppressed(e);
    case EventKind::frames_lost:
      return fmt::format("{} frames lost before they could be read", e.value);
    case EventKind::interface_failed:
      return can_bridge::describe_failure(interface, e.code);
    case EventKind::interface_ready:
      return fmt::format("interface {} ready", interface);
    case EventKind::manager_state:
      return fmt::format("manager {} (was {})", as<line::ManagerState>(e.code),
                         as<line::ManagerState>(e.value));
    case EventKind::own_state:
      return fmt::format("own node {} (was {}){}", as<nmt::State>(e.code), as<nmt::State>(e.value),
                         node_id_by_lss(e));
    case EventKind::sync_lost:
      return fmt::format("no SYNC within 1.5 periods of {} us", e.value);
    case EventKind::malformed_frame:
      return fmt::format("frame {:03X}h of {} bytes not understood: {}{}", e.code, e.value,
                         hex(std::span(e.data).first(std::min<std::size_t>(e.value, 8))),
                         suppressed(e));
    case EventKind::events_lost:
      return fmt::format("events {} to {} could not be kept", number(e, 0, 8), number(e, 8, 8));
    case EventKind::clock_step:
      return fmt::format("the wall clock was stepped by {} ms", e.value);
    case EventKind::routing_refused:
    case EventKind::emcy_routed:
      return routing_text(e);
    case EventKind::gateway_started:
      return "gateway started";
    case EventKind::gateway_reloaded:
      return "configuration reloaded";
    case EventKind::gateway_reload_refused:
      return "reload refused";
    case EventKind::can_frame:
      return frame_text(e);
    case EventKind::queue_full:
      return fmt::format("a queue of the gateway was full, {} requests lost", e.value);
    default:
      return std::string(name(e.kind));
  }
}

std::string_view lost_error_control(std::uint32_t code) {
  switch (code) {
    case nmt::kByNodeGuarding:
      return "no answer to node guarding";
    case nmt::kByLifeGuarding:
      return "not guarded by its master";
    default:
      return "heartbeat lost";
  }
}

std::string foreign_manager_text(const Event& e) {
  if (e.code != diagnosis::kForeignCommand) {
    return fmt::format("another NMT master: flying-master message {:03X}h", e.value);
  }
  const std::uint64_t node = number(e, 0, 1);
  return fmt::format("another NMT master: {} to {}", as<nmt::Command>(e.value),
                     node == 0 ? std::string("all nodes") : fmt::format("node {}", node));
}

// Events of an observer.
std::string overheard_text(const Event& e) {
  switch (e.kind) {
    case EventKind::nmt_command:
      return fmt::format("NMT {}{}", as<nmt::Command>(e.code), e.node == 0 ? " to all" : "");
    case EventKind::sdo_transfer:
      return fmt::format("object {} {}, {} bytes: {}{}", object(e),
                         (e.code & 1U) == 0 ? "read" : "written", e.value,
                         hex(std::span(e.data).subspan(3).first(
                             std::min<std::size_t>(e.value, e.data.size() - 3))),
                         suppressed(e.code >> 16U));
    case EventKind::pdo_mapping:
      return fmt::format("mapping of its {} {} is {}known", e.value == 0 ? "TPDO" : "RPDO", e.code,
                         number(e, 0, 1) == 0 ? "not " : "");
    default:
      return fmt::format("the image has a new layout: inputs {:016X}, outputs {:016X}",
                         number(e, 0, 8), number(e, 8, 8));
  }
}

std::string lss_text(const Event& e) {
  const auto verdict = static_cast<lss::Verdict>(e.code);
  if (verdict == lss::Verdict::nobody_found) {
    return fmt::format("LSS: {}", lss::describe(verdict));
  }
  const bool refused = e.value != 0;
  return fmt::format(
      "LSS: {}{} (vendor {:08X}h, product {:08X}h, revision {:08X}h, serial {:08X}h)",
      lss::describe(verdict),
      refused ? fmt::format(", error {}/{}", e.value & 0xFFU, e.value >> 8U) : "", number(e, 0, 4),
      number(e, 4, 4), number(e, 8, 4), number(e, 12, 4));
}

std::string emcy_text(const Event& e) {
  return fmt::format("EMCY {:04X}h, error register {:02X}h, data {}", e.code, e.value,
                     hex(std::span(e.data).first(5)));
}

// Events about outputs and commands of clients.
std::string request_text(const Event& e) {
  switch (e.kind) {
    case EventKind::output_refused:
      return fmt::format("outputs of group {} refused: {}{}", e.value,
                         line::describe(static_cast<line::OutputRefusal>(e.code)), suppressed(e));
    case EventKind::output_armed:
      return e.code == 0
                 ? fmt::format("outputs of group {} in use, without watchdog", e.value)
                 : fmt::format("outputs of group {} in use, watchdog {} ms", e.value, e.code);
    case EventKind::output_watchdog:
      return fmt::format("watchdog of output group {} fired: {}", e.value, reactions(e.code));
    case EventKind::command_refused:
      return fmt::format("command {} refused: {}{}", as<line::CommandKind>(e.value),
                         line::describe(static_cast<line::Refusal>(e.code)), suppressed(e));
    default:
      return {};
  }
}

std::string pdo_text(const Event& e) {
  switch (e.kind) {
    case EventKind::pdo_length:
      return fmt::format("PDO {}: {} bytes received, {} mapped", e.code, number(e, 0, 1), e.value);
    case EventKind::pdo_timeout:
      return fmt::format("PDO {} not received for {} ms", e.code, e.value);
    case EventKind::pdo_recovered:
      return fmt::format("PDO {} received again", e.code);
    default:
      return {};
  }
}

std::string change_text(const Event& e) {
  return e.code == 0
             ? fmt::format("booted without an NMT command (it was {})", as<nmt::State>(e.value))
             : fmt::format("left operational without an NMT command (now {})",
                           as<nmt::State>(e.code));
}

std::string text(const Event& e, std::string_view interface) {
  switch (e.kind) {
    case EventKind::boot_up:
      return "boot-up";
    case EventKind::node_state:
      return fmt::format("{} (was {})", as<nmt::State>(e.code), as<nmt::State>(e.value));
    case EventKind::heartbeat_lost:
      return fmt::format("{} for {} ms", lost_error_control(e.code), e.value);
    case EventKind::heartbeat_recovered:
      return fmt::format("heartbeat is back, {}", as<nmt::State>(e.code));
    case EventKind::boot_result:
      return boot_text(e);
    case EventKind::emcy:
      return emcy_text(e);
    case EventKind::emcy_sent:
      return "sent " + emcy_text(e);
    case EventKind::configuration_error:
      if (number(e, 0, 2) == od::objects::kStoreParameters) {
        return fmt::format("stored parameters cannot be used, defaults are: {}",
                           abort_text(e.code));
      }
      return fmt::format("object {} could not be configured: {}", object(e), abort_text(e.code));
    case EventKind::pdo_length:
    case EventKind::pdo_timeout:
    case EventKind::pdo_recovered:
      return pdo_text(e);
    case EventKind::duplicate_node_id:
      return fmt::format("another device has the same node-ID ({})", sign_of_life(e.code));
    case EventKind::shared_node_id:
      return shared_id_text(e);
    case EventKind::object_written:
      return fmt::format("object {} written: {} bytes{}", object(e), e.value,
                         e.code == 0 ? "" : fmt::format(", {} writes before it not shown", e.code));
    case EventKind::own_reset:
      return fmt::format("reset by NMT: {}", as<nmt::Command>(e.code));
    case EventKind::time_received:
      return "TIME received";
    case EventKind::spontaneous_change:
      return change_text(e);
    case EventKind::unexpected_node:
      return fmt::format("not configured, but on the line ({})", as<nmt::State>(e.code));
    case EventKind::foreign_sdo:
      return fmt::format("somebody else uses its SDO server ({:03X}h)", e.code);
    case EventKind::sdo_abort:
      return fmt::format("SDO transfer of {} ended: {}{}", object(e), abort_text(e.code),
                         suppressed(e));
    case EventKind::output_refused:
    case EventKind::output_armed:
    case EventKind::output_watchdog:
    case EventKind::command_refused:
      return request_text(e);
    case EventKind::foreign_manager:
      return foreign_manager_text(e);
    case EventKind::node_scanned:
      return e.code == 0 ? fmt::format("scanned, {} objects read", e.value)
                         : fmt::format("scanned, {} objects read until it ended: {}", e.value,
                                       abort_text(e.code));
    case EventKind::lss_result:
      return lss_text(e);
    case EventKind::command_progress:
      return progress_text(e);
    case EventKind::nmt_command:
    case EventKind::sdo_transfer:
    case EventKind::pdo_mapping:
    case EventKind::layout_changed:
      return overheard_text(e);
    default:
      return line_text(e, interface);
  }
}

std::string who(const Event& event, const line::LineConfig& line) {
  if (event.node == 0) {
    return {};
  }
  const auto it = std::find_if(line.nodes.begin(), line.nodes.end(),
                               [&](const auto& node) { return node.id == event.node; });
  return it == line.nodes.end() ? fmt::format("node {}: ", event.node)
                                : fmt::format("node {} ({}): ", event.node, it->name);
}

}  // namespace

std::string describe(const Event& event, const line::LineConfig& line, std::string_view interface) {
  const bool connection =
      event.kind == EventKind::routing_opened || event.kind == EventKind::routing_ended;
  std::string out =
      who(event, line) + (connection ? connection_text(event, line) : text(event, interface));
  if (out.size() > kLongestText) {
    out.resize(kLongestText);
  }
  return out;
}

std::string describe_bus_errors(std::uint32_t bits) {
  return bus_errors(bits);
}

}  // namespace linegate::gateway
