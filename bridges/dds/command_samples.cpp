// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/command_samples.h"

#include <algorithm>
#include <system_error>

#include "bridges/dds/bytes.h"
#include "bridges/dds/request_codec.h"
#include "bridges/dds/values.h"
#include "stack/base/abort_code.h"
#include "stack/base/byte_order.h"

namespace linegate::dds {

void to_wire(const request::Request& from, Duration timeout, v1::CommandRequest& to) {
  write_members(from, to);
  to.timeout_ns(timeout.count());
}

const char* from_wire(const v1::CommandRequest& from, request::Request& to, Duration& timeout) {
  timeout = Duration{from.timeout_ns()};
  const char* const why = read_members(from, to);
  return why != nullptr || from.timeout_ns() >= 0 ? why : "timeout_ns is negative";
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

std::string describe_result(Error error, std::span<const std::byte> data) {
  switch (error.domain) {
    case Domain::none:
      break;
    case Domain::sdo:
      return std::string(describe(static_cast<AbortCode>(error.code)));
    case Domain::can:
      return std::generic_category().message(static_cast<int>(error.code));
    case Domain::command: {
      std::string out(line::describe(static_cast<line::Refusal>(error.code)));
      if (error == line::to_error(line::Refusal::wrong_role) && data.size() == 1) {
        out += ": node " + std::to_string(std::to_integer<unsigned>(data.front())) +
               " is the active NMT master";
      } else if (error == line::to_error(line::Refusal::wrong_state) && data.size() == 2) {
        out += ": the watchdog of output group " +
               std::to_string(load_le<std::uint16_t>(data.data())) +
               " has fired; an OutputWrite with another arming number comes first";
      }
      return out;
    }
  }
  return {};
}

}  // namespace linegate::dds
