// SPDX-License-Identifier: Apache-2.0
#include "stack/usdo/protocol.h"

#include <algorithm>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/od/hook.h"

namespace linegate::usdo {
namespace {

// Bytes of a frame before its data, or as a whole.
constexpr std::size_t kPlainBytes = 3;
constexpr std::size_t kCountedBytes = 4;
constexpr std::size_t kObjectBytes = 6;
constexpr std::size_t kAbortBytes = 7;
constexpr std::size_t kExpeditedHead = 8;
constexpr std::size_t kLongAbortBytes = 10;
constexpr std::size_t kInitiateBytes = 12;

struct Meaning {
  Code code;
  AbortCode abort;
  std::string_view words;
};

constexpr Meaning kMeanings[] = {
    {Code::command_specifier, AbortCode::command_specifier, "command specifier not valid"},
    {Code::segment_counter, AbortCode::sequence_number, "segment counter not valid"},
    {Code::size, AbortCode::length_mismatch, "size not valid"},
    {Code::session, AbortCode::sdo_connection, "session-ID not valid"},
    {Code::write_only, AbortCode::write_only, "object is write-only"},
    {Code::read_only, AbortCode::read_only, "object is read-only"},
    {Code::no_object, AbortCode::no_object, "object does not exist"},
    {Code::no_sub_index, AbortCode::no_sub_index, "sub-index does not exist"},
    {Code::length_mismatch, AbortCode::length_mismatch, "type or length does not match"},
    {Code::length_too_high, AbortCode::length_too_high, "value is too long"},
    {Code::length_too_low, AbortCode::length_too_low, "value is too short"},
    {Code::cannot_transfer, AbortCode::cannot_transfer, "value cannot be transferred or stored"},
    {Code::device_state, AbortCode::device_state, "device state does not permit the access"},
};

const Meaning* meaning_of(Code code) {
  const auto* const found = std::ranges::find(kMeanings, code, &Meaning::code);
  return found == std::end(kMeanings) ? nullptr : found;
}

can::Frame begin_frame(Route route, Command command, std::size_t bytes) {
  LINEGATE_ASSERT(bytes <= can::kMaxFdData, "the fields fit into a frame");
  can::Frame frame;
  frame.id = route.identifier;
  frame.flags = can::Frame::kFd | can::Frame::kBitRateSwitch;
  frame.length = can::fd_length(bytes);
  frame.data[0] = std::byte{route.receiver};
  frame.data[1] = std::byte{static_cast<std::uint8_t>(command)};
  frame.data[2] = std::byte{route.session};
  return frame;
}

can::Frame begin_object_frame(Route route, Command command, od::Address address,
                              std::size_t bytes) {
  can::Frame frame = begin_frame(route, command, bytes);
  frame.data[3] = std::byte{address.sub};
  store_le(&frame.data[4], address.index);
  return frame;
}

void put(can::Frame& frame, std::size_t at, std::span<const std::byte> data) {
  std::ranges::copy(data, frame.data.begin() + static_cast<std::ptrdiff_t>(at));
}

// Bytes of the fields before the data; 0 for an unknown command.
std::size_t field_bytes(Command command) {
  switch (command) {
    case Command::end_response:
      return kPlainBytes;
    case Command::download_segment:
    case Command::download_end:
    case Command::upload_segment:
    case Command::segment_response:
    case Command::upload_segment_answer:
    case Command::upload_end:
      return kCountedBytes;
    case Command::upload:
    case Command::download_response:
    case Command::initiate_response:
      return kObjectBytes;
    case Command::abort:
      return kAbortBytes;
    case Command::download:
    case Command::upload_response:
      return kExpeditedHead;
    case Command::long_abort:
      return kLongAbortBytes;
    case Command::download_initiate:
    case Command::upload_initiate:
      return kInitiateBytes;
  }
  return 0;
}

}  // namespace

std::string_view describe(Code code) {
  const Meaning* const meaning = meaning_of(code);
  return meaning != nullptr ? meaning->words : std::string_view("unknown abort code");
}

AbortCode to_abort_code(Code code) {
  const Meaning* const meaning = meaning_of(code);
  return meaning != nullptr ? meaning->abort : AbortCode::general;
}

Code to_code(AbortCode code) {
  if (code == AbortCode::length_mismatch) {
    return Code::length_mismatch;  // not Code::size, which is about the transfer
  }
  const auto* const found = std::ranges::find(kMeanings, code, &Meaning::abort);
  return found == std::end(kMeanings) ? Code::cannot_transfer : found->code;
}

can::Frame plain_frame(Route route, Command command) {
  return begin_frame(route, command, kPlainBytes);
}

can::Frame counted_frame(Route route, Command command, std::uint8_t counter) {
  can::Frame frame = begin_frame(route, command, kCountedBytes);
  frame.data[3] = std::byte{counter};
  return frame;
}

can::Frame object_frame(Route route, Command command, od::Address address) {
  return begin_object_frame(route, command, address, kObjectBytes);
}

can::Frame expedited_frame(Route route, Command command, od::Address address, od::DataType type,
                           std::span<const std::byte> data) {
  LINEGATE_ASSERT(data.size() <= kExpeditedData, "the value fits into an expedited frame");
  can::Frame frame = begin_object_frame(route, command, address, kExpeditedHead + data.size());
  frame.data[6] = std::byte{static_cast<std::uint8_t>(type)};
  frame.data[7] = std::byte{static_cast<std::uint8_t>(data.size())};
  put(frame, kExpeditedHead, data);
  return frame;
}

can::Frame initiate_frame(Route route, Command command, od::Address address, od::DataType type,
                          std::uint32_t size) {
  can::Frame frame = begin_object_frame(route, command, address, kInitiateBytes);
  frame.data[6] = std::byte{static_cast<std::uint8_t>(type)};
  store_le(&frame.data[8], size);
  return frame;
}

can::Frame segment_frame(Route route, Command command, std::uint8_t counter,
                         std::span<const std::byte> data) {
  LINEGATE_ASSERT(data.size() == kSegmentData, "a segment is full");
  can::Frame frame = begin_frame(route, command, kCountedBytes + data.size());
  frame.data[3] = std::byte{counter};
  put(frame, kCountedBytes, data);
  return frame;
}

can::Frame end_frame(Route route, Command command, std::span<const std::byte> data) {
  LINEGATE_ASSERT(data.size() <= kSegmentData, "the bytes fit into an end frame");
  can::Frame frame = begin_frame(route, command, kCountedBytes + data.size());
  frame.data[3] = std::byte{static_cast<std::uint8_t>(data.size())};
  put(frame, kCountedBytes, data);
  return frame;
}

can::Frame abort_frame(Route route, od::Address address, AbortCode code, AbortForm form) {
  if (form == AbortForm::one_byte) {
    return abort_frame(route, address, to_code(code), form);
  }
  can::Frame frame = begin_object_frame(route, Command::long_abort, address, kLongAbortBytes);
  store_le(&frame.data[6], static_cast<std::uint32_t>(code));
  return frame;
}

can::Frame abort_frame(Route route, od::Address address, Code code, AbortForm form) {
  if (form == AbortForm::four_bytes) {
    return abort_frame(route, address, to_abort_code(code), form);
  }
  can::Frame frame = begin_object_frame(route, Command::abort, address, kAbortBytes);
  frame.data[6] = std::byte{static_cast<std::uint8_t>(code)};
  return frame;
}

bool well_formed(const can::Frame& frame) {
  return frame.fd() && !frame.remote() && frame.length >= kPlainBytes;
}

od::Address address_of(const can::Frame& frame) {
  return {load_le<std::uint16_t>(&frame.data[4]), byte_of(frame, 3)};
}

std::uint32_t size_of(const can::Frame& frame) {
  return load_le<std::uint32_t>(&frame.data[8]);
}

bool is_known(Command command) {
  return field_bytes(command) != 0;
}

bool has_fields(const can::Frame& frame) {
  const std::size_t bytes = field_bytes(command_of(frame));
  return bytes != 0 && frame.length >= bytes;
}

AbortCode reason_of(const can::Frame& frame) {
  if (command_of(frame) == Command::abort) {
    return to_abort_code(static_cast<Code>(byte_of(frame, 6)));
  }
  const auto code = static_cast<AbortCode>(load_le<std::uint32_t>(&frame.data[6]));
  // kLater is a value that only hooks of a dictionary return.
  return code == AbortCode::none || code == od::kLater ? AbortCode::general : code;
}

std::optional<std::span<const std::byte>> data_of(const can::Frame& frame) {
  std::size_t head = kCountedBytes;
  std::size_t count = kSegmentData;
  switch (command_of(frame)) {
    case Command::download:
    case Command::upload_response:
      head = kExpeditedHead;
      count = byte_of(frame, 7);
      break;
    case Command::download_end:
    case Command::upload_end:
      count = byte_of(frame, 3);
      break;
    case Command::download_segment:
    case Command::upload_segment_answer:
      break;
    default:
      return std::nullopt;
  }
  if (head + count > frame.length) {
    return std::nullopt;
  }
  return std::span(frame.data).subspan(head, count);
}

}  // namespace linegate::usdo
