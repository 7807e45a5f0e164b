// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/explain_usdo.h"

#include <span>

#include "bridges/console/explain.h"
#include "bridges/console/explain_words.h"
#include "bridges/console/value_text.h"
#include "stack/base/abort_code.h"
#include "stack/usdo/protocol.h"

namespace linegate::console {
namespace {

using usdo::Command;

std::string usdo_bytes(std::size_t count) {
  return std::to_string(count) + (count == 1 ? " byte" : " bytes");
}

// The value of an expedited frame; by the data type in the frame if the device file lacks the
// object.
std::string usdo_value(const can::Frame& frame, const od::DeviceDescription* device,
                       od::Address address) {
  const auto data = usdo::data_of(frame);
  if (!data) {
    return "not all of its bytes";
  }
  const auto type = static_cast<od::DataType>(usdo::byte_of(frame, 6));
  const bool known = device != nullptr && device->find(address) != nullptr;
  return !known && od::byte_size(type) == data->size() && !data->empty()
             ? to_text(type, *data)
             : value_of(device, address, *data);
}

std::string size_in_segments(const can::Frame& frame) {
  const std::uint32_t size = usdo::size_of(frame);
  return size == 0 ? "in segments" : "in segments, " + usdo_bytes(size);
}

std::string usdo_reason(const can::Frame& frame) {
  if (usdo::command_of(frame) == Command::long_abort) {
    const AbortCode code = usdo::reason_of(frame);
    return std::string(describe(code)) + " (" + hex_digits(static_cast<std::uint32_t>(code), 8) +
           "h)";
  }
  const std::uint8_t code = usdo::byte_of(frame, 6);
  return std::string(usdo::describe(static_cast<usdo::Code>(code))) + " (" + hex_digits(code, 2) +
         "h)";
}

std::string part_text(const can::Frame& frame) {
  const auto data = usdo::data_of(frame);
  return data ? usdo_bytes(data->size()) : "not all of its bytes";
}

}  // namespace

std::string explain_usdo(const can::Frame& frame, const od::DeviceDescription* device,
                         std::optional<od::Address> object) {
  const od::Address address = usdo::address_of(frame);
  const std::string named = object_text(device, address);
  const std::string of_session =
      object ? object_text(device, *object) : "an object of an earlier request";
  const std::string segment = "segment " + std::to_string(usdo::counter_of(frame));
  switch (usdo::command_of(frame)) {
    case Command::download:
      return "write " + named + " = " + usdo_value(frame, device, address);
    case Command::download_initiate:
      return "write " + named + ' ' + size_in_segments(frame);
    case Command::download_segment:
      return "write " + of_session + ": " + segment + ", " + part_text(frame);
    case Command::download_end:
      return "write " + of_session + ": the last " + part_text(frame);
    case Command::upload:
      return "read " + named;
    case Command::upload_segment:
      return "read on in " + of_session + ": " + segment;
    case Command::download_response:
      return "written: " + named;
    case Command::initiate_response:
      return "takes segments of " + named;
    case Command::segment_response:
      return "taken: " + segment + " of " + of_session;
    case Command::end_response:
      return "written: " + of_session;
    case Command::upload_response:
      return named + " = " + usdo_value(frame, device, address);
    case Command::upload_initiate:
      return named + " is uploaded " + size_in_segments(frame);
    case Command::upload_segment_answer:
      return of_session + ": " + segment + ", " + part_text(frame);
    case Command::upload_end:
      return of_session + ": the last " + part_text(frame);
    case Command::abort:
    case Command::long_abort:
      return "aborted: " + named + ": " + usdo_reason(frame);
  }
  return "a command that there is not";
}

}  // namespace linegate::console
