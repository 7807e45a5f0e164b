// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/command_samples.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include "bridges/dds/bytes.h"
#include "bridges/dds/values.h"
#include "stack/base/abort_code.h"
#include "stack/can/frame.h"
#include "stack/lss/procedure.h"

namespace linegate::dds {

namespace {

bool in_network(line::CommandKind kind) {
  return kind == line::CommandKind::network_read || kind == line::CommandKind::network_write;
}

}  // namespace

void to_wire(const line::Command& from, v1::CommandRequest& to) {
  to.kind(static_cast<std::uint8_t>(from.kind));
  to.node(from.node);
  to.index(from.index);
  to.sub(from.sub);
  to.nmt(static_cast<std::uint8_t>(from.nmt));
  to.code(in_network(from.kind) ? from.network : from.code);
  to.error_register(from.error_register);
  to.entry(from.entry);
  to.timeout_ns(from.timeout.count());
}

const char* from_wire(const v1::CommandRequest& from, line::Command& to) {
  if (from.kind() >= line::kCommandKinds)
    return "kind is not a CommandKind";
  if (from.timeout_ns() < 0)
    return "timeout_ns is negative";
  to.kind = static_cast<line::CommandKind>(from.kind());
  to.node = from.node();
  to.index = from.index();
  to.sub = from.sub();
  to.code = from.code();
  to.error_register = from.error_register();
  to.entry = from.entry();
  to.timeout = Duration{from.timeout_ns()};
  switch (to.kind) {
    case line::CommandKind::network_read:
    case line::CommandKind::network_write:
      to.network = std::exchange(to.code, std::uint16_t{0});
      if (to.network == 0)
        return "code is no network-ID";
      if (to.entry > line::kAsDevice)
        return "entry is not 0 or 1";
      [[fallthrough]];
    case line::CommandKind::sdo_read:
    case line::CommandKind::sdo_write:
    case line::CommandKind::object_write:
      return from.node() < 1 || from.node() > 127 ? "node is not 1..127" : nullptr;
    case line::CommandKind::scan_apply:
      if (from.code() > (v1::SCAN_SET_UP | v1::SCAN_RESTORE))
        return "code has other bits than SCAN_SET_UP and SCAN_RESTORE";
      [[fallthrough]];
    case line::CommandKind::scan:
    case line::CommandKind::boot:
      return from.node() > 127 ? "node is not 0..127" : nullptr;
    case line::CommandKind::program:
      if (from.sub() == 0)
        return "sub is not 1..255";
      return from.node() < 1 || from.node() > 127 ? "node is not 1..127" : nullptr;
    case line::CommandKind::configure:
      if (from.code() > 1)
        return "code is not 0 or 1";
      [[fallthrough]];
    case line::CommandKind::pdo_trigger:
    case line::CommandKind::pdo_request:
    case line::CommandKind::mpdo_write:
      return from.node() > 127 ? "node is not 0..127" : nullptr;
    case line::CommandKind::nmt:
      if (from.node() > 127)
        return "node is not 0..127";
      if (!nmt::is_command(from.nmt()))
        return "nmt is not a command specifier";
      to.nmt = static_cast<nmt::Command>(from.nmt());
      return nullptr;
    case line::CommandKind::local_read:
    case line::CommandKind::local_write:
    case line::CommandKind::output_write:
    case line::CommandKind::emcy_send:
    case line::CommandKind::versions:
    case line::CommandKind::bus_restart:
    case line::CommandKind::routing_trace:
    case line::CommandKind::bus_fault:
    case line::CommandKind::can_send:
    case line::CommandKind::can_listen:
    case line::CommandKind::object_create:
      break;
    case line::CommandKind::lss:
      return from.code() >= lss::kProcedures ? "code is no LSS service" : nullptr;
  }
  return nullptr;
}

const char* check_data(const line::Command& command) {
  const std::size_t size = command.data.size();
  switch (command.kind) {
    case line::CommandKind::sdo_write:
    case line::CommandKind::network_write:
    case line::CommandKind::local_write:
    case line::CommandKind::program:
    case line::CommandKind::object_write:
      return size == 0 ? "there are no data to write" : nullptr;
    case line::CommandKind::output_write:
      return size < 1 || size > 8 ? "data is not 1 to 8 bytes" : nullptr;
    case line::CommandKind::emcy_send:
      return size > 5 ? "data is more than 5 manufacturer bytes" : nullptr;
    case line::CommandKind::mpdo_write:
      return size < 1 || size > 4 ? "data is not 1 to 4 bytes" : nullptr;
    case line::CommandKind::lss:
      return size > 24 ? "data is more than the arguments of an LSS service" : nullptr;
    case line::CommandKind::can_send:
      return size > can::kMaxFdData ? "data is more than 64 bytes" : nullptr;
    case line::CommandKind::can_listen:
      return size != 0 && size != 4 ? "data is no mask of 4 bytes" : nullptr;
    case line::CommandKind::object_create:
      return size > 4 * 0xFF + 9 ? "data is no description of an object" : nullptr;
    case line::CommandKind::bus_fault:
      return size > 256 ? "data is more than 256 bytes of text" : nullptr;
    case line::CommandKind::sdo_read:
    case line::CommandKind::network_read:
    case line::CommandKind::local_read:
    case line::CommandKind::nmt:
    case line::CommandKind::versions:
    case line::CommandKind::bus_restart:
    case line::CommandKind::routing_trace:
    case line::CommandKind::scan:
    case line::CommandKind::boot:
    case line::CommandKind::configure:
    case line::CommandKind::pdo_trigger:
    case line::CommandKind::pdo_request:
    case line::CommandKind::scan_apply:
      break;
  }
  return size != 0 ? "this kind of command takes no data" : nullptr;
}

template <class Sample>
void set_chunk(std::span<const std::byte> data, std::size_t offset, Sample& to) {
  const std::size_t length = std::min(kChunkBytes, data.size() - offset);
  to.offset(static_cast<std::uint32_t>(offset));
  to.last(offset + length == data.size());
  copy_bytes(data.subspan(offset, length), to.data());
}
template void set_chunk(std::span<const std::byte>, std::size_t, v1::CommandRequest&);
template void set_chunk(std::span<const std::byte>, std::size_t, v1::CommandReply&);

std::string describe_result(Error error) {
  switch (error.domain) {
    case Domain::none:
      break;
    case Domain::sdo:
      return std::string(describe(static_cast<AbortCode>(error.code)));
    case Domain::can:
      return std::generic_category().message(static_cast<int>(error.code));
    case Domain::command:
      return std::string(line::describe(static_cast<line::Refusal>(error.code)));
  }
  return {};
}

}  // namespace linegate::dds
