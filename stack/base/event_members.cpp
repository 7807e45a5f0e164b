// SPDX-License-Identifier: Apache-2.0
#include "stack/base/event_members.h"

#include <chrono>

namespace linegate {
namespace {

template <class Number>
std::uint64_t number(Number value) {
  return static_cast<std::uint64_t>(value);
}
template <class Rep, class Period>
std::uint64_t number(std::chrono::duration<Rep, Period> value) {
  return static_cast<std::uint64_t>(value.count());
}

void visit(const event::LineStarted& of, EventMemberVisitor& to) {
  to.number("role", number(of.role));
}

void visit(const event::LineStopped& /*of*/, EventMemberVisitor& /*to*/) {
}

void visit(const event::BusState& of, EventMemberVisitor& to) {
  to.number("state", number(of.state));
  to.number("before", number(of.before));
  to.number("transmit_errors", number(of.transmit_errors));
  to.number("receive_errors", number(of.receive_errors));
}

void visit(const event::BusError& of, EventMemberVisitor& to) {
  to.number("errors", number(of.errors));
  to.number("suppressed", number(of.suppressed));
}

void visit(const event::FramesLost& of, EventMemberVisitor& to) {
  to.number("frames", number(of.frames));
}

void visit(const event::InterfaceFailed& of, EventMemberVisitor& to) {
  to.number("error", number(of.error));
}

void visit(const event::InterfaceReady& /*of*/, EventMemberVisitor& /*to*/) {
}

void visit(const event::ManagerState& of, EventMemberVisitor& to) {
  to.number("state", number(of.state));
  to.number("before", number(of.before));
}

void visit(const event::OwnState& of, EventMemberVisitor& to) {
  to.number("state", number(of.state));
  to.number("before", number(of.before));
  to.number("node_id", number(of.node_id));
}

void visit(const event::BootUp& /*of*/, EventMemberVisitor& /*to*/) {
}

void visit(const event::NodeState& of, EventMemberVisitor& to) {
  to.number("state", number(of.state));
  to.number("before", number(of.before));
}

void visit(const event::HeartbeatLost& of, EventMemberVisitor& to) {
  to.number("by", number(of.by));
  to.number("time", number(of.time));
}

void visit(const event::HeartbeatRecovered& of, EventMemberVisitor& to) {
  to.number("state", number(of.state));
}

void visit(const event::BootResult& of, EventMemberVisitor& to) {
  to.number("letter", number(of.letter));
  to.number("cause", number(of.cause));
  to.number("sub", number(of.sub));
  to.number("index", number(of.index));
  to.number("abort", number(of.abort));
  to.number("found", number(of.found));
  to.number("expected", number(of.expected));
}

void visit_fd(const event::FdEmcy& of, EventMemberVisitor& to) {
  if (!of.any) {
    return;
  }
  to.number("fd", number(of.any));
  to.number("logical_device", number(of.logical_device));
  to.number("status", number(of.status));
  to.number("profile", number(of.profile));
  to.bytes("time_of_day", of.time_of_day);
}

void visit(const event::Emcy& of, EventMemberVisitor& to) {
  to.number("code", number(of.code));
  to.number("error_register", number(of.error_register));
  to.bytes("manufacturer", of.manufacturer);
  visit_fd(of.fd, to);
}

void visit(const event::EmcySent& of, EventMemberVisitor& to) {
  to.number("code", number(of.code));
  to.number("error_register", number(of.error_register));
  to.bytes("manufacturer", of.manufacturer);
  visit_fd(of.fd, to);
}

void visit(const event::ConfigurationError& of, EventMemberVisitor& to) {
  to.number("abort", number(of.abort));
  to.number("index", number(of.index));
  to.number("sub", number(of.sub));
}

void visit(const event::PdoLength& of, EventMemberVisitor& to) {
  to.number("number", number(of.number));
  to.number("mapped", number(of.mapped));
  to.number("received", number(of.received));
}

void visit(const event::PdoTimeout& of, EventMemberVisitor& to) {
  to.number("number", number(of.number));
  to.number("deadline", number(of.deadline));
}

void visit(const event::PdoRecovered& of, EventMemberVisitor& to) {
  to.number("number", number(of.number));
}

void visit(const event::SyncLost& of, EventMemberVisitor& to) {
  to.number("period", number(of.period));
}

void visit(const event::MalformedFrame& of, EventMemberVisitor& to) {
  to.number("identifier", number(of.identifier));
  to.number("length", number(of.length));
  to.bytes("data", of.data);
  to.number("suppressed", number(of.suppressed));
}

void visit(const event::UnexpectedNode& of, EventMemberVisitor& to) {
  to.number("state", number(of.state));
}

void visit(const event::ForeignSdo& of, EventMemberVisitor& to) {
  to.number("identifier", number(of.identifier));
}

void visit(const event::SdoAbort& of, EventMemberVisitor& to) {
  to.number("abort", number(of.abort));
  to.number("index", number(of.index));
  to.number("sub", number(of.sub));
  to.number("suppressed", number(of.suppressed));
}

void visit(const event::OutputRefused& of, EventMemberVisitor& to) {
  to.number("refusal", number(of.refusal));
  to.number("group", number(of.group));
  to.number("suppressed", number(of.suppressed));
  to.number("client", number(of.client));
}

void visit(const event::OutputArmed& of, EventMemberVisitor& to) {
  to.number("group", number(of.group));
  to.number("watchdog", number(of.watchdog));
  to.number("client", number(of.client));
}

void visit(const event::OutputWatchdog& of, EventMemberVisitor& to) {
  to.number("group", number(of.group));
  to.number("reactions", number(of.reactions));
}

void visit(const event::CommandRefused& of, EventMemberVisitor& to) {
  to.number("refusal", number(of.refusal));
  to.number("command", number(of.command));
  to.number("suppressed", number(of.suppressed));
  to.number("client", number(of.client));
}

void visit(const event::CommandAccepted& of, EventMemberVisitor& to) {
  to.number("command", number(of.command));
  to.number("index", number(of.index));
  to.number("sub", number(of.sub));
  to.number("client", number(of.client));
  to.number("suppressed", number(of.suppressed));
}

void visit(const event::OutputOwner& of, EventMemberVisitor& to) {
  to.number("group", number(of.group));
  to.number("client", number(of.client));
  to.number("before", number(of.before));
  to.number("suppressed", number(of.suppressed));
}

void visit(const event::ClientLimited& of, EventMemberVisitor& to) {
  to.number("client", number(of.client));
  to.number("delayed", number(of.delayed));
  to.number("refused", number(of.refused));
  to.number("replaced", number(of.replaced));
}

void visit(const event::EventsLost& of, EventMemberVisitor& to) {
  to.number("first", number(of.first));
  to.number("last", number(of.last));
}

void visit(const event::ClockStep& of, EventMemberVisitor& to) {
  to.number("step", number(of.step));
}

void visit(const event::QueueFull& of, EventMemberVisitor& to) {
  to.number("queue", number(of.queue));
  to.number("lost", number(of.lost));
}

void visit(const event::DuplicateNodeId& of, EventMemberVisitor& to) {
  to.number("state", number(of.state));
}

void visit(const event::NmtCommand& of, EventMemberVisitor& to) {
  to.number("command", number(of.command));
}

void visit(const event::SdoTransfer& of, EventMemberVisitor& to) {
  to.number("size", number(of.size));
  to.number("suppressed", number(of.suppressed));
  to.number("index", number(of.index));
  to.number("sub", number(of.sub));
  to.number("download", number(of.download));
  to.bytes("data", of.data);
}

void visit(const event::PdoMapping& of, EventMemberVisitor& to) {
  to.number("number", number(of.number));
  to.number("kind", number(of.kind));
  to.number("complete", number(of.complete));
}

void visit(const event::LayoutChanged& of, EventMemberVisitor& to) {
  to.number("inputs", number(of.inputs));
  to.number("outputs", number(of.outputs));
}

void visit(const event::RoutingRefused& of, EventMemberVisitor& to) {
  to.number("abort", number(of.abort));
  to.number("source", number(of.source));
  to.number("target", number(of.target));
  to.number("target_node", number(of.target_node));
  to.number("service", number(of.service));
}

void visit(const event::EmcyRouted& of, EventMemberVisitor& to) {
  to.number("code", number(of.code));
  to.number("source", number(of.source));
  to.number("source_node", number(of.source_node));
  to.number("error_register", number(of.error_register));
  to.number("hops", number(of.hops));
  to.number("number", number(of.number));
}

void visit(const event::RoutingOpened& of, EventMemberVisitor& to) {
  to.number("connection", number(of.connection));
  to.number("suppressed", number(of.suppressed));
  to.number("source", number(of.source));
  to.number("target", number(of.target));
  to.number("target_node", number(of.target_node));
  to.number("interface", number(of.interface));
  to.number("gateway", number(of.gateway));
  to.number("hops", number(of.hops));
}

void visit(const event::RoutingEnded& of, EventMemberVisitor& to) {
  to.number("connection", number(of.connection));
  to.number("abort", number(of.abort));
  to.number("bytes", number(of.bytes));
  to.number("source", number(of.source));
  to.number("target", number(of.target));
  to.number("index", number(of.index));
  to.number("sub", number(of.sub));
  to.number("target_node", number(of.target_node));
  to.number("interface", number(of.interface));
  to.number("gateway", number(of.gateway));
  to.number("service", number(of.service));
}

void visit(const event::NodeScanned& of, EventMemberVisitor& to) {
  to.number("abort", number(of.abort));
  to.number("objects", number(of.objects));
}

void visit(const event::CommandProgress& of, EventMemberVisitor& to) {
  to.number("command", number(of.command));
  to.number("done", number(of.done));
  to.number("total", number(of.total));
}

void visit(const event::LssResult& of, EventMemberVisitor& to) {
  to.number("verdict", number(of.verdict));
  to.number("error", number(of.error));
  to.number("specific", number(of.specific));
  const auto address = of.address.value_or(std::array<std::uint32_t, 4>{});
  to.number("vendor", address[0]);
  to.number("product", address[1]);
  to.number("revision", address[2]);
  to.number("serial", address[3]);
}

void visit(const event::ForeignManager& of, EventMemberVisitor& to) {
  to.number("evidence", number(of.evidence));
  to.number("command", number(of.command));
  to.number("addressee", number(of.addressee));
  to.number("identifier", number(of.identifier));
}

void visit(const event::CanFrame& of, EventMemberVisitor& to) {
  to.number("identifier", number(of.identifier));
  to.number("suppressed", number(of.suppressed));
  to.number("length", number(of.length));
  to.number("extended", number(of.extended));
  to.number("remote", number(of.remote));
  to.number("fd", number(of.fd));
  to.number("piece", number(of.piece));
  to.bytes("data", of.data);
}

void visit(const event::GatewayStarted& of, EventMemberVisitor& to) {
  to.number("lines", number(of.lines));
}

void visit(const event::GatewayReloaded& of, EventMemberVisitor& to) {
  to.number("changed", number(of.changed));
  to.number("lines", number(of.lines));
}

void visit(const event::GatewayReloadRefused& of, EventMemberVisitor& to) {
  to.number("errors", number(of.errors));
}

void visit(const event::SpontaneousChange& of, EventMemberVisitor& to) {
  to.number("state", number(of.state));
  to.number("before", number(of.before));
}

void visit(const event::SharedNodeId& of, EventMemberVisitor& to) {
  to.number("evidence", number(of.evidence));
  to.number("sub", number(of.sub));
  to.number("index", number(of.index));
}

void visit(const event::ObjectWritten& of, EventMemberVisitor& to) {
  to.number("size", number(of.size));
  to.number("suppressed", number(of.suppressed));
  to.number("index", number(of.index));
  to.number("sub", number(of.sub));
  to.bytes("data", of.data);
}

void visit(const event::OwnReset& of, EventMemberVisitor& to) {
  to.number("command", number(of.command));
}

void visit(const event::TimeReceived& of, EventMemberVisitor& to) {
  to.number("utc", number(of.utc));
}

void visit(const event::JournalState& of, EventMemberVisitor& to) {
  to.number("condition", number(of.condition));
  to.number("error", number(of.error));
  to.number("lost", number(of.lost));
}

void visit(const event::DdsProcessEnded& of, EventMemberVisitor& to) {
  to.number("cause", number(of.cause));
  to.number("detail", number(of.detail));
  to.number("ends", number(of.ends));
  to.number("pause_ms", number(of.pause_ms));
  to.number("process", number(of.process));
}

void visit(const event::RoutingUnanswered& of, EventMemberVisitor& to) {
  to.number("suppressed", number(of.suppressed));
  to.number("source", number(of.source));
  to.number("target", number(of.target));
  to.number("index", number(of.index));
  to.number("sub", number(of.sub));
  to.number("target_node", number(of.target_node));
  to.number("interface", number(of.interface));
}

void visit(const event::SrdoState& of, EventMemberVisitor& to) {
  to.number("suppressed", number(of.suppressed));
  to.number("fault", number(of.fault));
  to.number("number", number(of.number));
}

void visit(const event::SdoConnection& of, EventMemberVisitor& to) {
  to.number("number", number(of.number));
  to.number("abort", number(of.abort));
  to.number("client_record", number(of.client_record));
  to.number("server_record", number(of.server_record));
  to.number("request", number(of.request));
  to.number("response", number(of.response));
  to.number("client", number(of.client));
  to.number("server", number(of.server));
  to.number("result", number(of.result));
}

void visit(const event::FlyingMaster& of, EventMemberVisitor& to) {
  to.number("state", number(of.state));
  to.number("before", number(of.before));
  to.number("priority", number(of.priority));
}

void visit(const event::SleepState& of, EventMemberVisitor& to) {
  to.number("phase", number(of.phase));
  to.number("before", number(of.before));
  to.number("cause", number(of.cause));
}

}  // namespace

void visit_members(const EventData& data, EventMemberVisitor& visitor) {
  std::visit([&visitor](const auto& of) { visit(of, visitor); }, data);
}

}  // namespace linegate
