// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/reply_codec.h"

#include <cstdint>
#include <string_view>
#include <utility>

#include "bridges/request/field_bytes.h"
#include "stack/base/short_text.h"
#include "stack/can/cob_id.h"
#include "stack/manager/plan.h"

namespace linegate::dds {
namespace {

using request::FieldReader;
using request::FieldWriter;

using line::ReplyData;
using ReplyBytes = std::vector<std::byte>;

constexpr std::uint8_t kBySdo = 0;
constexpr std::uint8_t kByPdo = 1;
constexpr std::size_t kLongestObjectName = 0xFF;  // of a listed object: longer names are cut
constexpr unsigned kMappableFlag = 1;
constexpr unsigned kStoredFlag = 2;
constexpr unsigned kApplicationFlag = 4;

bool is_node(std::uint8_t id) {
  return id >= can::kMinNodeId && id <= can::kMaxNodeId;
}

od::Address read_object(FieldReader& in) {
  const auto index = in.number<std::uint16_t>();
  return {index, in.number<std::uint8_t>()};
}
void write_object(od::Address object, FieldWriter& out) {
  out.number(object.index, 2);
  out.number(object.sub, 1);
}
AbortCode read_abort(FieldReader& in) {
  return static_cast<AbortCode>(in.number<std::uint32_t>());
}

// --- encoding: a write_result() for each type of result ------------------------------------------

void write_result(std::monostate /*none*/, FieldWriter& /*out*/) {
}

void write_result(const ReplyBytes& value, FieldWriter& out) {
  out.bytes(value);
}

void write_result(const std::vector<line::ListedObject>& list, FieldWriter& out) {
  for (const line::ListedObject& one : list) {
    write_object(one.address, out);
    out.number(static_cast<std::uint16_t>(one.type), 2);
    out.number(static_cast<std::uint8_t>(one.access), 1);
    out.number((one.mappable ? kMappableFlag : 0U) | (one.stored ? kStoredFlag : 0U) |
                   (one.application ? kApplicationFlag : 0U),
               1);
    out.sized(short_text(one.name, kLongestObjectName), 1);
    const bool fits = one.value.size() <= line::ListedObject::kLongestValue;
    out.sized(fits ? one.value : ReplyBytes{}, 1);
  }
}

void write_result(line::WrittenBySdo /*way*/, FieldWriter& out) {
  out.number(kBySdo, 1);
}

void write_result(const line::WrittenByPdo& way, FieldWriter& out) {
  out.number(kByPdo, 1);
  out.number(way.pdo, 2);
  out.number(static_cast<std::uint8_t>(way.wait), 1);
  for (const std::uint32_t entry : way.missing)
    out.number(entry, 4);
}

void write_result(line::SentByMpdo sent, FieldWriter& out) {
  out.number(sent.tpdo, 2);
}

void write_result(const line::TriggeredPdos& pdos, FieldWriter& out) {
  for (const std::uint16_t pdo : pdos)
    out.number(pdo, 2);
}

void write_result(const line::ProgramFault& fault, FieldWriter& out) {
  write_object(fault.object, out);
  out.number(fault.value, 4);
}

void write_result(const std::vector<scan::ScannedNode>& nodes, FieldWriter& out) {
  for (const scan::ScannedNode& node : nodes) {
    out.number(node.id, 1);
    out.number(static_cast<std::uint32_t>(node.end), 4);
    out.sized(manager::write_concise_dcf(node.values), 4);
  }
}

void write_result(const std::vector<manager::BootOutcome>& outcomes, FieldWriter& out) {
  for (const manager::BootOutcome& outcome : outcomes) {
    out.number(outcome.node, 1);
    out.number(static_cast<std::uint8_t>(outcome.letter), 1);
    write_object(outcome.finding.object, out);
    out.number(static_cast<std::uint8_t>(outcome.finding.kind), 1);
    out.number(static_cast<std::uint32_t>(outcome.finding.abort), 4);
    out.number(outcome.finding.expected, 4);
    out.number(outcome.finding.found, 4);
  }
}

void write_result(const std::vector<manager::NodeReport>& nodes, FieldWriter& out) {
  for (const manager::NodeReport& node : nodes) {
    out.number(node.node, 1);
    out.number(static_cast<std::uint8_t>(node.boot), 1);
    out.number(static_cast<std::uint32_t>(node.end), 4);
    out.number(node.differences.size(), 4);
    for (const manager::Difference& difference : node.differences) {
      write_object(difference.object, out);
      out.number(static_cast<std::uint32_t>(difference.abort), 4);
      out.sized(difference.expected, 4);
      out.sized(difference.found, 4);
    }
  }
}

void write_result(const line::SdoConnections& connections, FieldWriter& out) {
  for (const manager::Connection& each : connections) {
    out.number(each.number, 4);
    out.number(each.client, 1);
    out.number(each.server, 1);
    out.number(each.client_record, 2);
    out.number(each.server_record, 2);
    out.number(each.request, 2);
    out.number(each.response, 2);
    out.number(static_cast<std::uint8_t>(each.state), 1);
    out.number(static_cast<std::uint32_t>(each.abort), 4);
  }
}

// --- decoding: a read_result() for each type of result -------------------------------------------
// After malformed bytes the reader is not good().

void read_result(FieldReader& in, std::vector<line::ListedObject>& out) {
  while (in.good() && in.left() > 0) {
    line::ListedObject one{.address = read_object(in)};
    one.type = static_cast<od::DataType>(in.number<std::uint16_t>());
    one.access = static_cast<od::Access>(in.number<std::uint8_t>());
    const auto flags = in.number<std::uint8_t>();
    one.mappable = (flags & kMappableFlag) != 0;
    one.stored = (flags & kStoredFlag) != 0;
    one.application = (flags & kApplicationFlag) != 0;
    one.name = in.text(1);
    one.value = in.sized(1);
    out.push_back(std::move(one));
  }
}

void read_result(FieldReader& in, line::WrittenByPdo& out) {
  out.pdo = in.number<std::uint16_t>();
  out.wait = static_cast<line::PdoWait>(in.number<std::uint8_t>());
  while (in.good() && in.left() > 0)
    out.missing.push_back(in.number<std::uint32_t>());
  in.require(static_cast<std::size_t>(out.wait) < line::kPdoWaits);
}

void read_result(FieldReader& in, line::SentByMpdo& out) {
  out.tpdo = in.number<std::uint16_t>();
}

void read_result(FieldReader& in, line::TriggeredPdos& out) {
  while (in.good() && in.left() > 0)
    out.push_back(in.number<std::uint16_t>());
}

void read_result(FieldReader& in, line::ProgramFault& out) {
  out.object = read_object(in);
  out.value = in.number<std::uint32_t>();
}

void read_result(FieldReader& in, std::vector<scan::ScannedNode>& out) {
  while (in.good() && in.left() > 0) {
    scan::ScannedNode node{.id = in.number<std::uint8_t>()};
    node.end = read_abort(in);
    auto values = manager::read_concise_dcf(in.sized(4));
    in.require(values.ok() && is_node(node.id));
    if (values.ok())
      node.values = *std::move(values);
    out.push_back(std::move(node));
  }
}

void read_result(FieldReader& in, std::vector<manager::BootOutcome>& out) {
  using Kind = manager::BootFinding::Kind;
  while (in.good() && in.left() > 0) {
    manager::BootOutcome outcome{.node = in.number<std::uint8_t>()};
    outcome.letter = static_cast<char>(in.number<std::uint8_t>());
    outcome.finding.object = read_object(in);
    const auto kind = static_cast<Kind>(in.number<std::uint8_t>());
    outcome.finding.kind = kind <= Kind::last ? kind : Kind::none;
    outcome.finding.abort = read_abort(in);
    outcome.finding.expected = in.number<std::uint32_t>();
    outcome.finding.found = in.number<std::uint32_t>();
    out.push_back(outcome);
  }
}

void read_result(FieldReader& in, std::vector<manager::NodeReport>& out) {
  constexpr std::size_t kLeastDifference = 15;  // bytes of a difference without values
  while (in.good() && in.left() > 0) {
    manager::NodeReport node{.node = in.number<std::uint8_t>()};
    node.boot = static_cast<char>(in.number<std::uint8_t>());
    node.end = read_abort(in);
    const auto count = in.number<std::uint32_t>();
    in.require(is_node(node.node) && count <= in.left() / kLeastDifference);
    for (std::uint32_t i = 0; i < count && in.good(); ++i) {
      manager::Difference difference{.object = read_object(in)};
      difference.abort = read_abort(in);
      difference.expected = in.sized(4);
      difference.found = in.sized(4);
      node.differences.push_back(std::move(difference));
    }
    out.push_back(std::move(node));
  }
}

void read_result(FieldReader& in, line::SdoConnections& out) {
  while (in.good() && in.left() > 0) {
    manager::Connection each{.number = in.number<std::uint32_t>()};
    each.client = in.number<std::uint8_t>();
    each.server = in.number<std::uint8_t>();
    each.client_record = in.number<std::uint16_t>();
    each.server_record = in.number<std::uint16_t>();
    each.request = in.number<std::uint16_t>();
    each.response = in.number<std::uint16_t>();
    each.state = static_cast<manager::ConnectionState>(in.number<std::uint8_t>());
    each.abort = read_abort(in);
    in.require(is_node(each.client) && is_node(each.server) &&
               each.state <= manager::ConnectionState::stale);
    out.push_back(each);
  }
}

template <class Result>
std::optional<ReplyData> decode_as(std::span<const std::byte> bytes) {
  FieldReader in(bytes);
  Result out{};
  read_result(in, out);
  return in.complete() ? std::optional<ReplyData>(std::move(out)) : std::nullopt;
}

std::optional<ReplyData> decode_bytes(std::span<const std::byte> bytes) {
  return bytes.empty() ? ReplyData{} : ReplyData{ReplyBytes(bytes.begin(), bytes.end())};
}

std::optional<ReplyData> decode_way(std::span<const std::byte> bytes) {
  if (bytes.empty())
    return ReplyData{};
  if (bytes.front() == std::byte{kBySdo})
    return bytes.size() == 1 ? std::optional<ReplyData>(line::WrittenBySdo{}) : std::nullopt;
  return bytes.front() == std::byte{kByPdo} ? decode_as<line::WrittenByPdo>(bytes.subspan(1))
                                            : std::nullopt;
}

std::optional<ReplyData> decode_done(const line::Request& request,
                                     std::span<const std::byte> bytes) {
  switch (line::kind(request)) {
    case line::CommandKind::local_read: {
      const auto& what = std::get<line::LocalRead>(request).what;
      return std::holds_alternative<line::ObjectRange>(what)
                 ? decode_as<std::vector<line::ListedObject>>(bytes)
                 : decode_bytes(bytes);
    }
    case line::CommandKind::output_write:
    case line::CommandKind::object_write:
      return decode_way(bytes);
    case line::CommandKind::pdo_trigger:
      return decode_as<line::TriggeredPdos>(bytes);
    case line::CommandKind::mpdo_write:
      return decode_as<line::SentByMpdo>(bytes);
    case line::CommandKind::connection_open:
    case line::CommandKind::connection_list:
      return decode_as<line::SdoConnections>(bytes);
    case line::CommandKind::scan:
    case line::CommandKind::scan_apply:
      return decode_as<std::vector<scan::ScannedNode>>(bytes);
    case line::CommandKind::boot:
      return decode_as<std::vector<manager::BootOutcome>>(bytes);
    case line::CommandKind::configure:
      return decode_as<std::vector<manager::NodeReport>>(bytes);
    case line::CommandKind::sdo_read:
    case line::CommandKind::sdo_write:
    case line::CommandKind::local_write:
    case line::CommandKind::emcy_send:
    case line::CommandKind::nmt:
    case line::CommandKind::network_read:
    case line::CommandKind::network_write:
    case line::CommandKind::routing_trace:
    case line::CommandKind::program:
    case line::CommandKind::lss:
    case line::CommandKind::can_send:
    case line::CommandKind::can_listen:
    case line::CommandKind::object_create:
    case line::CommandKind::pdo_request:
    case line::CommandKind::connection_close:
    case line::CommandKind::sleep:
      break;
  }
  return decode_bytes(bytes);
}

}  // namespace

std::vector<std::byte> encode_reply(const line::ReplyData& data) {
  FieldWriter out;
  std::visit([&out](const auto& result) { write_result(result, out); }, data);
  return out.take();
}

std::optional<line::ReplyData> decode_reply(const request::Request& request, Error error,
                                            std::span<const std::byte> bytes) {
  const auto* const of_line = std::get_if<line::Request>(&request);
  if (of_line == nullptr)
    return decode_bytes(bytes);
  if (error.domain == Domain::none)
    return decode_done(*of_line, bytes);
  const bool of_program = std::holds_alternative<line::ProgramDownload>(*of_line);
  return of_program && !bytes.empty() ? decode_as<line::ProgramFault>(bytes) : decode_bytes(bytes);
}

}  // namespace linegate::dds
