// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/event_text.h"

#include <algorithm>
#include <array>
#include <span>
#include <variant>

#include <fmt/format.h>

#include "bridges/can/channel.h"
#include "bridges/request/request.h"
#include "gateway/publish/client_directory.h"
#include "stack/base/abort_code.h"
#include "stack/base/short_text.h"
#include "stack/can/bus_state.h"
#include "stack/emcy/message.h"
#include "stack/line/command.h"
#include "stack/line/output_write.h"
#include "stack/line/state.h"
#include "stack/lss/assigner.h"
#include "stack/manager/assumed_pdo.h"
#include "stack/manager/boot_event.h"
#include "stack/nmt/sleep_protocol.h"
#include "stack/nmt/state.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"
#include "stack/pdo/parameters.h"
#include "stack/routing/post.h"
#include "stack/srdo/receiver.h"

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

template <std::size_t Size>
std::span<const std::byte> first_of(const std::array<std::byte, Size>& bytes, std::size_t used) {
  return std::span(bytes).first(std::min(used, Size));
}

std::string suppressed(std::uint32_t count) {
  return count == 0 ? std::string() : fmt::format(" ({} more suppressed)", count);
}

template <class Data>
std::string object(const Data& data) {
  return od::to_text({data.index, data.sub});
}

std::string abort_text(AbortCode code) {
  return fmt::format("{} ({:08X})", describe(code), static_cast<std::uint32_t>(code));
}

// Names of the bits that are set, separated by commas.
template <std::size_t Count>
std::string bits_text(std::uint32_t bits, const std::array<std::string_view, Count>& names) {
  std::string out;
  for (std::size_t i = 0; i < Count; ++i) {
    if ((bits >> i & 1U) != 0) {
      out += (out.empty() ? "" : ", ") + std::string(names[i]);
    }
  }
  return out;
}

std::string bus_errors(std::uint32_t bits) {
  constexpr std::array<std::string_view, 7> kNames{
      "transmit time-out", "lost arbitration", "controller",        "protocol",
      "transceiver",       "no acknowledge",   "controller restart"};
  const std::string out = bits_text(bits, kNames);
  return out.empty() ? "unknown" : out;
}

std::string reactions(std::uint32_t bits) {
  constexpr std::array<std::string_view, 7> kNames{
      "outputs set to zero", "NMT enter pre-operational", "NMT stop",     "NMT reset communication",
      "NMT reset node",      "EMCY sent or queued",       "heartbeat off"};
  const std::string out = bits_text(bits, kNames);
  return out.empty() ? "outputs held" : out;
}

template <class Emcy>
std::string emcy_text(const Emcy& e) {
  std::string out = fmt::format("EMCY {:04X}h, error register {:02X}h, data {}", e.code,
                                e.error_register, hex(e.manufacturer));
  return e.fd.any ? out + emcy::fd_text(e.fd) : out;
}

std::string_view lost_error_control(event::ErrorControl by) {
  switch (by) {
    case event::ErrorControl::node_guarding:
      return "no answer to node guarding";
    case event::ErrorControl::life_guarding:
      return "not guarded by its master";
    case event::ErrorControl::heartbeat:
      break;
  }
  return "heartbeat lost";
}

std::string shared_id_text(const event::SharedNodeId& e) {
  switch (e.evidence) {
    case event::SharedIdEvidence::two_responses:
      return fmt::format("two answers to one SDO request ({})", object(e));
    case event::SharedIdEvidence::two_states:
      return "heartbeats of two NMT states in turn";
    case event::SharedIdEvidence::unchanged_after_boot_up:
      return "a boot-up message, followed by heartbeats in state Operational";
    case event::SharedIdEvidence::too_many_heartbeats:
      return "twice as many heartbeats as its 1017h allows";
    case event::SharedIdEvidence::two_periods:
    case event::SharedIdEvidence::none:
      break;
  }
  return "heartbeats of two rhythms";
}

// In the format of candump.
std::string frame_text(const event::CanFrame& e) {
  std::string out = e.extended ? fmt::format("frame {:08X}", e.identifier)
                               : fmt::format("frame {:03X}", e.identifier);
  if (e.remote) {
    out += e.length == 0 ? "#R" : fmt::format("#R{}", e.length);
  } else {
    out += e.fd ? "##4" : "#";
    std::string data = hex(first_of(e.data, e.bytes()));
    std::erase(data, ' ');
    out += data;
  }
  constexpr std::size_t kPiece = event::CanFrame::kPieceBytes;
  out += e.length > kPiece ? fmt::format(" (bytes from {} of {})", kPiece * e.piece, e.length) : "";
  return out + suppressed(e.suppressed);
}

std::string_view service_name(event::SdoService service) {
  switch (service) {
    case event::SdoService::none:
      return "no transfer";
    case event::SdoService::upload:
      return "upload";
    case event::SdoService::download:
      break;
  }
  return "download";
}

std::string_view service_name(routing::RoutedService service) {
  switch (service) {
    case routing::RoutedService::sdo:
      return "SDO";
    case routing::RoutedService::emcy:
      return "EMCY";
    case routing::RoutedService::pdo:
      break;
  }
  return "PDO";
}

std::string source_text(std::uint16_t network) {
  return network == 0 ? std::string("this gateway") : fmt::format("network {}", network);
}

// The words for the data of an event of `node` on `line`.
struct EventWords {
  const line::LineConfig& line;
  std::string_view interface;
  std::uint8_t node;
  const ClientDirectory* clients;

  std::string client_name(std::uint32_t number) const {
    return clients == nullptr ? fmt::format("client {}", number) : clients->describe(number);
  }
  // Empty if it is unknown.
  std::string by(std::uint32_t client) const {
    return client == 0 ? std::string() : " by " + client_name(client);
  }
  std::string of(std::uint32_t client) const {
    return client == 0 ? std::string() : " of " + client_name(client);
  }

  // --- the line and its bus ----------------------------------------------------------------------

  std::string operator()(const event::LineStarted& e) const {
    return fmt::format("started as {}", name(e.role));
  }
  std::string operator()(const event::LineStopped& /*e*/) const { return "stopped"; }
  std::string operator()(const event::BusState& e) const {
    return fmt::format("bus {} (was {}), TEC {}, REC {}", name(e.state), name(e.before),
                       e.transmit_errors, e.receive_errors);
  }
  std::string operator()(const event::BusError& e) const {
    return "bus error: " + bus_errors(e.errors) + suppressed(e.suppressed);
  }
  std::string operator()(const event::FramesLost& e) const {
    return fmt::format("{} frames lost before they could be read", e.frames);
  }
  std::string operator()(const event::InterfaceFailed& e) const {
    return can_bridge::describe_failure(interface, e.error);
  }
  std::string operator()(const event::InterfaceReady& /*e*/) const {
    return fmt::format("interface {} ready", interface);
  }
  std::string operator()(const event::EventsLost& e) const {
    return fmt::format("events {} to {} could not be kept", e.first, e.last);
  }
  std::string operator()(const event::ClockStep& e) const {
    return fmt::format("the wall clock was stepped by {} ms", e.step.count());
  }
  std::string operator()(const event::QueueFull& e) const {
    return fmt::format("a queue of the gateway was full, {} requests lost", e.lost);
  }
  std::string operator()(const event::LayoutChanged& e) const {
    return fmt::format("the image has a new layout: inputs {:016X}, outputs {:016X}", e.inputs,
                       e.outputs);
  }
  std::string operator()(const event::MalformedFrame& e) const {
    return fmt::format("frame {:03X}h of {} bytes not understood: {}{}", e.identifier, e.length,
                       hex(first_of(e.data, e.length)), suppressed(e.suppressed));
  }
  std::string operator()(const event::CanFrame& e) const { return frame_text(e); }

  // --- the own node ------------------------------------------------------------------------------

  std::string operator()(const event::ManagerState& e) const {
    return fmt::format("manager {} (was {})", name(e.state), name(e.before));
  }
  std::string operator()(const event::OwnState& e) const {
    // Of an own device whose node-ID was changed by LSS and differs from the configured one.
    const bool by_lss = e.node_id != 0 && node != 0 && e.node_id != node;
    return fmt::format("own node {} (was {}){}", name(e.state), name(e.before),
                       by_lss ? fmt::format(", node-ID {} by LSS", e.node_id) : "");
  }
  std::string operator()(const event::EmcySent& e) const { return "sent " + emcy_text(e); }
  std::string operator()(const event::SyncLost& e) const {
    return fmt::format("no SYNC within 1.5 periods of {} us", e.period.count());
  }
  std::string operator()(const event::DuplicateNodeId& e) const {
    return fmt::format("another device has the same node-ID ({})",
                       e.state == nmt::State::unknown ? "it sent an EMCY" : name(e.state));
  }
  std::string operator()(const event::ObjectWritten& e) const {
    return fmt::format(
        "object {} written: {} bytes{}", object(e), e.size,
        e.suppressed == 0 ? "" : fmt::format(", {} writes before it not shown", e.suppressed));
  }
  std::string operator()(const event::OwnReset& e) const {
    return fmt::format("reset by NMT: {}", name(e.command));
  }
  std::string operator()(const event::TimeReceived& /*e*/) const { return "TIME received"; }

  // --- nodes -------------------------------------------------------------------------------------

  std::string operator()(const event::BootUp& /*e*/) const { return "boot-up"; }
  std::string operator()(const event::NodeState& e) const {
    return fmt::format("{} (was {})", name(e.state), name(e.before));
  }
  std::string operator()(const event::HeartbeatLost& e) const {
    return fmt::format("{} for {} ms", lost_error_control(e.by), e.time.count());
  }
  std::string operator()(const event::HeartbeatRecovered& e) const {
    return fmt::format("heartbeat is back, {}", name(e.state));
  }
  std::string operator()(const event::BootResult& e) const {
    if (e.letter == manager::kBooted) {
      return "booted";
    }
    return fmt::format("{} ({}): {}", manager::is_booted(e.letter) ? "booted" : "boot failed",
                       e.letter, manager::describe_boot(e.letter, manager::finding_of(e)));
  }
  std::string operator()(const event::Emcy& e) const { return emcy_text(e); }
  std::string operator()(const event::ConfigurationError& e) const {
    if (e.index == od::objects::kStoreParameters) {
      return fmt::format("stored parameters cannot be used, defaults are: {}", abort_text(e.abort));
    }
    // The PDOs and SRDOs of the image are read at each boot; PDOs are written if they differ.
    return fmt::format("object {} could not be {}: {}", object(e),
                       manager::is_assumed_object(e.index) ? "read or configured" : "configured",
                       abort_text(e.abort));
  }
  std::string operator()(const event::UnexpectedNode& e) const {
    return fmt::format("not configured, but on the line ({})", name(e.state));
  }
  std::string operator()(const event::SpontaneousChange& e) const {
    return e.state == nmt::State::initialising
               ? fmt::format("booted without an NMT command (it was {})", name(e.before))
               : fmt::format("left operational without an NMT command (now {})", name(e.state));
  }
  std::string operator()(const event::SharedNodeId& e) const {
    return "two devices have this node-ID: " + shared_id_text(e);
  }
  std::string operator()(const event::NodeScanned& e) const {
    return e.abort == AbortCode::none ? fmt::format("scanned, {} objects read", e.objects)
                                      : fmt::format("scanned, {} objects read until it ended: {}",
                                                    e.objects, abort_text(e.abort));
  }
  std::string operator()(const event::LssResult& e) const {
    if (e.verdict == lss::Verdict::nobody_found) {
      return fmt::format("LSS: {}", lss::describe(e.verdict));
    }
    const bool refused = e.error != 0 || e.specific != 0;
    const lss::Address address = e.address.value_or(lss::Address{});
    return fmt::format(
        "LSS: {}{} (vendor {:08X}h, product {:08X}h, revision {:08X}h, serial {:08X}h)",
        lss::describe(e.verdict), refused ? fmt::format(", error {}/{}", e.error, e.specific) : "",
        address[0], address[1], address[2], address[3]);
  }

  // --- PDO and SDO -------------------------------------------------------------------------------

  std::string operator()(const event::PdoLength& e) const {
    return fmt::format("PDO {}: {} bytes received, {} mapped", e.number, e.received, e.mapped);
  }
  std::string operator()(const event::PdoTimeout& e) const {
    return fmt::format("PDO {} not received for {} ms", e.number, e.deadline.count());
  }
  std::string operator()(const event::PdoRecovered& e) const {
    return fmt::format("PDO {} received again", e.number);
  }
  std::string operator()(const event::ForeignSdo& e) const {
    return fmt::format("another client uses its SDO server ({:03X}h)", e.identifier);
  }
  std::string operator()(const event::SdoAbort& e) const {
    return fmt::format("SDO transfer of {} ended: {}{}", object(e), abort_text(e.abort),
                       suppressed(e.suppressed));
  }

  // --- outputs and commands ----------------------------------------------------------------------

  // The source of a group whose values come from another gateway; empty for other groups.
  std::string source_of(std::uint16_t number) const {
    const auto group = std::ranges::find(line.groups, number, &line::OutputGroup::number);
    return group != line.groups.end() && group->forwarded ? group->name : std::string();
  }
  std::string operator()(const event::OutputRefused& e) const {
    const std::string source = source_of(e.group);
    return source.empty()
               ? fmt::format("outputs of group {}{} refused: {}{}", e.group, of(e.client),
                             line::describe(e.refusal), suppressed(e.suppressed))
               : fmt::format("outputs of group {} (forwarded from {}){} refused: {}{}", e.group,
                             source, of(e.client), line::describe(e.refusal),
                             suppressed(e.suppressed));
  }
  std::string operator()(const event::OutputArmed& e) const {
    if (const std::string source = source_of(e.group); !source.empty()) {
      return fmt::format("outputs of group {} have a value of {}, time-out {} ms", e.group, source,
                         e.watchdog.count());
    }
    return e.watchdog.count() == 0 ? fmt::format("outputs of group {} in use{}, without watchdog",
                                                 e.group, by(e.client))
                                   : fmt::format("outputs of group {} in use{}, watchdog {} ms",
                                                 e.group, by(e.client), e.watchdog.count());
  }
  std::string operator()(const event::OutputWatchdog& e) const {
    const std::string source = source_of(e.group);
    return source.empty()
               ? fmt::format("watchdog of output group {} fired: {}", e.group,
                             reactions(e.reactions))
               : fmt::format("no valid value of {} within the time-out of output group {}: {}",
                             source, e.group, reactions(e.reactions));
  }
  std::string operator()(const event::CommandRefused& e) const {
    return fmt::format("command {}{} refused: {}{}", request::command_name(e.command), of(e.client),
                       line::describe(e.refusal), suppressed(e.suppressed));
  }
  std::string operator()(const event::CommandAccepted& e) const {
    return fmt::format("command {}{}{} accepted{}", request::command_name(e.command),
                       e.index == 0 ? std::string() : " to " + object(e), of(e.client),
                       suppressed(e.suppressed));
  }
  std::string operator()(const event::OutputOwner& e) const {
    return fmt::format("outputs of group {} taken over{}{}{}", e.group, by(e.client),
                       e.before == 0 ? std::string() : " from " + client_name(e.before),
                       suppressed(e.suppressed));
  }
  std::string operator()(const event::ClientLimited& e) const {
    return fmt::format(
        "{} exceeds its share of the bus: {} commands waited, {} refused, {} outputs joined with "
        "newer ones",
        client_name(e.client), e.delayed, e.refused, e.replaced);
  }
  std::string operator()(const event::CommandProgress& e) const {
    const std::string_view unit = e.command == line::CommandKind::configure ? " objects"
                                  : e.command == line::CommandKind::program ? " bytes"
                                                                            : "";
    return e.total == 0 ? fmt::format("{}: {}{}", name(e.command), e.done, unit)
                        : fmt::format("{}: {} of {}{}", name(e.command), e.done, e.total, unit);
  }

  // --- traffic of other nodes --------------------------------------------------------------------

  std::string operator()(const event::NmtCommand& e) const {
    return fmt::format("NMT {}{}", name(e.command), node == 0 ? " to all" : "");
  }
  std::string operator()(const event::SdoTransfer& e) const {
    return fmt::format("object {} {}, {} bytes: {}{}", object(e), e.download ? "written" : "read",
                       e.size, hex(first_of(e.data, e.size)), suppressed(e.suppressed));
  }
  std::string operator()(const event::PdoMapping& e) const {
    return fmt::format("mapping of its {} {} is {}known",
                       e.kind == pdo::PdoKind::tpdo ? "TPDO" : "RPDO", e.number,
                       e.complete ? "" : "not ");
  }
  std::string operator()(const event::ForeignManager& e) const {
    if (e.evidence == event::ManagerEvidence::sleep) {
      return fmt::format(
          "another NMT master: prepares the nodes for sleep (message {:03X}h), which take no "
          "outputs until they wake",
          e.identifier);
    }
    if (e.evidence != event::ManagerEvidence::nmt_command) {
      return fmt::format("another NMT master: flying-master message {:03X}h", e.identifier);
    }
    return fmt::format(
        "another NMT master: {} to {}", name(e.command),
        e.addressee == 0 ? std::string("all nodes") : fmt::format("node {}", e.addressee));
  }
  std::string operator()(const event::FlyingMaster& e) const {
    return fmt::format("flying master: {}, before {}, priority {}{}", name(e.state), name(e.before),
                       e.priority,
                       node == 0 ? "" : fmt::format("; the active NMT master is node {}", node));
  }

  // --- other networks ----------------------------------------------------------------------------

  // From the source to the target, over which interface and gateway.
  template <class Connection>
  std::string way(const Connection& e) const {
    const auto& lines = line.routing.interfaces;
    const auto left_by = std::find_if(
        lines.begin(), lines.end(), [&](const auto& known) { return known.number == e.interface; });
    return fmt::format(
        "{} to node {} of network {} over {}{}", source_text(e.source), e.target_node, e.target,
        left_by == lines.end() || left_by->name.empty() ? fmt::format("interface {}", e.interface)
                                                        : left_by->name,
        e.gateway == 0 ? "" : fmt::format(":{}", e.gateway));
  }
  std::string operator()(const event::RoutingOpened& e) const {
    return fmt::format("connection {:08X} from {} opened{}", e.connection, way(e),
                       suppressed(e.suppressed));
  }
  std::string operator()(const event::RoutingEnded& e) const {
    return fmt::format("connection {:08X} from {} ended, {}{}, {} bytes: {}", e.connection, way(e),
                       service_name(e.service),
                       e.service == event::SdoService::none ? "" : " of " + object(e), e.bytes,
                       e.abort == AbortCode::none ? "done" : abort_text(e.abort));
  }
  std::string operator()(const event::EmcyRouted& e) const {
    return fmt::format("EMCY {:04X}h of node {} in network {}, error register {:02X}h, {} hops",
                       e.code, e.source_node, e.source, e.error_register, e.hops);
  }
  std::string operator()(const event::RoutingRefused& e) const {
    const bool of_emcys = e.service == routing::RoutedService::emcy;
    if (of_emcys && e.abort == AbortCode::timeout) {
      return fmt::format("EMCYs from {} were lost, or were too old to be sent",
                         source_text(e.source));
    }
    if (of_emcys && e.abort == AbortCode::out_of_memory) {
      return fmt::format("EMCYs from {} were not sent: there are too many", source_text(e.source));
    }
    return fmt::format("{} from {} to node {} of network {} refused: {}", service_name(e.service),
                       source_text(e.source), e.target_node, e.target, abort_text(e.abort));
  }

  std::string operator()(const event::RoutingUnanswered& e) const {
    const auto way = routing::find_way(line.routing.interfaces, e.interface);
    return fmt::format(
        "write of {} from {} to node {} of network {} has no certain answer of gateway {}: it may "
        "have been carried out{}",
        object(e), source_text(e.source), e.target_node, e.target,
        way == nullptr ? fmt::format("{}", e.interface) : way->to.gateway,
        suppressed(e.suppressed));
  }

  std::string operator()(const event::SleepState& e) const {
    return fmt::format("sleep: {} after {}, by {}", nmt::name(e.phase), nmt::name(e.before),
                       nmt::name(e.cause));
  }
  std::string operator()(const event::SrdoState& e) const {
    return fmt::format("SRDO {} is {}{}{}", e.number,
                       e.fault == srdo::Fault::none ? "" : "unsafe: ", srdo::name(e.fault),
                       suppressed(e.suppressed));
  }

  // --- SDO connections ---------------------------------------------------------------------------

  static std::string_view result_text(event::ConnectionResult result) {
    switch (result) {
      case event::ConnectionResult::opened:
        return "opened";
      case event::ConnectionResult::closed:
        return "closed";
      case event::ConnectionResult::failed:
        return "not opened";
      case event::ConnectionResult::lost:
        return "released, one of its nodes booted";
      case event::ConnectionResult::stale:
        return "stale, a record is still valid";
      case event::ConnectionResult::cleared:
        return "cleared, it was stale";
    }
    return "unknown";
  }
  std::string operator()(const event::SdoConnection& e) const {
    const std::string records =
        e.request == 0 ? std::string()
                       : fmt::format(" ({:04X}h, {:04X}h, CAN-IDs {:03X}h, {:03X}h)",
                                     e.client_record, e.server_record, e.request, e.response);
    return fmt::format("SDO connection {} from node {} to node {}{} {}{}", e.number, e.client,
                       e.server, records, result_text(e.result),
                       e.abort == AbortCode::none ? "" : ": " + abort_text(e.abort));
  }

  // --- the gateway -------------------------------------------------------------------------------

  std::string operator()(const event::GatewayStarted& /*e*/) const { return "gateway started"; }
  std::string operator()(const event::GatewayReloaded& /*e*/) const {
    return "configuration reloaded";
  }
  std::string operator()(const event::GatewayReloadRefused& /*e*/) const {
    return "reload refused";
  }
  std::string operator()(const event::JournalState& /*e*/) const {
    return "the journal is in another condition";
  }
  std::string operator()(const event::DdsProcessEnded& /*e*/) const {
    return "the DDS process ended and is started again";
  }
};

// Events that are always about an own device. Others may be about another node of that number, as a
// boot-up message. own_state has its own words for the node-ID.
bool is_of_own_device(EventKind kind) {
  using enum EventKind;
  constexpr std::array kKinds{emcy_sent,      pdo_length, pdo_timeout,
                              pdo_recovered,  sync_lost,  duplicate_node_id,
                              object_written, own_reset,  time_received};
  return std::ranges::find(kKinds, kind) != kKinds.end();
}

std::string who(const Event& event, const line::LineConfig& line, std::uint8_t node_id) {
  if (event.node == 0) {
    return {};
  }
  const auto it = std::find_if(line.nodes.begin(), line.nodes.end(),
                               [&](const auto& node) { return node.id == event.node; });
  const std::string name = it == line.nodes.end() ? std::string() : fmt::format(" ({})", it->name);
  const bool by_lss = node_id != 0 && node_id != event.node && is_of_own_device(event.kind());
  return fmt::format("node {}{}{}: ", event.node, name,
                     by_lss ? fmt::format(" (node-ID {})", node_id) : "");
}

}  // namespace

std::string describe(const Event& event, const line::LineConfig& line, std::string_view interface,
                     const ClientDirectory* clients, std::uint8_t node_id) {
  const EventWords words{
      .line = line, .interface = interface, .node = event.node, .clients = clients};
  return short_text(who(event, line, node_id) + std::visit(words, event.data), kLongestText);
}

std::string describe_bus_errors(std::uint32_t bits) {
  return bus_errors(bits);
}

}  // namespace linegate::gateway
