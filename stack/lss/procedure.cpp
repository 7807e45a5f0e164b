// SPDX-License-Identifier: Apache-2.0
#include "stack/lss/procedure.h"

#include <algorithm>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"

namespace linegate::lss {
namespace {

constexpr std::size_t kAddressBytes = 16;
constexpr std::size_t kIdentifyBytes = 24;
constexpr std::uint8_t kAllParts = 0x0F;

std::uint8_t byte_at(std::span<const std::byte> bytes, std::size_t i) {
  return std::to_integer<std::uint8_t>(bytes[i]);
}

std::uint32_t word_at(std::span<const std::byte> bytes, std::size_t i) {
  return load_le<std::uint32_t>(bytes.data() + 4 * i);
}

bool is_node_id(std::uint8_t id) {
  return (id >= can::kMinNodeId && id <= can::kMaxNodeId) || id == kNoNodeId;
}

}  // namespace

void put(const Address& address, std::vector<std::byte>& out) {
  for (const std::uint32_t part : address) {
    for (unsigned shift = 0; shift < 32; shift += 8) {
      out.push_back(static_cast<std::byte>(part >> shift));
    }
  }
}

Address read_address(std::span<const std::byte> bytes) {
  LINEGATE_ASSERT(bytes.size() == kAddressBytes, "an address has 16 bytes");
  return {word_at(bytes, 0), word_at(bytes, 1), word_at(bytes, 2), word_at(bytes, 3)};
}

std::optional<Course> Course::make(Procedure procedure, std::span<const std::byte> arguments) {
  Course course(procedure);
  if (!course.take(arguments)) {
    return std::nullopt;
  }
  return course;
}

bool Course::take(std::span<const std::byte> arguments) {
  const std::size_t size = arguments.size();
  switch (procedure_) {
    case Procedure::switch_global:
      request_.service = Service::switch_global;
      request_.configuration = size == 1 && byte_at(arguments, 0) == 1;
      return size == 1 && byte_at(arguments, 0) <= 1;
    case Procedure::switch_selective:
      request_.service = Service::switch_selective;
      if (size == kAddressBytes) {
        request_.address = read_address(arguments);
      }
      return size == kAddressBytes;
    case Procedure::configure_node_id:
      return read_node_id(arguments);
    case Procedure::configure_bit_timing:
      request_.service = Service::configure_bit_timing;
      if (size == 2) {
        request_.table = byte_at(arguments, 0);
        request_.index = byte_at(arguments, 1);
      }
      return size == 2;
    case Procedure::activate_bit_timing:
      request_.service = Service::activate_bit_timing;
      request_.delay_ms = size == 2 ? load_le<std::uint16_t>(arguments.data()) : std::uint16_t{0};
      return size == 2;
    case Procedure::store:
      request_.service = Service::store;
      request_.timeout = kStoreTime;
      return size == 0;
    case Procedure::inquire_address:
      request_.service = Service::inquire_part;
      request_.part = kVendor;
      request_.of_one = true;
      return size == 0;
    case Procedure::inquire_node_id:
      request_.service = Service::inquire_node_id;
      request_.of_one = true;
      return size == 0;
    case Procedure::identify:
      request_.service = Service::identify;
      if (size == kIdentifyBytes) {
        request_.address = {word_at(arguments, 0), word_at(arguments, 1), word_at(arguments, 2),
                            word_at(arguments, 4)};
        request_.highest_revision = word_at(arguments, 3);
        request_.highest_serial = word_at(arguments, 5);
      }
      return size == kIdentifyBytes;
    case Procedure::identify_unconfigured:
      request_.service = Service::identify_unconfigured;
      return size == 0;
    case Procedure::fastscan:
      return read_known(arguments);
    case Procedure::assign:
      break;
  }
  return false;
}

bool Course::read_node_id(std::span<const std::byte> arguments) {
  request_.service = Service::configure_node_id;
  const bool forced = arguments.size() == 2 && byte_at(arguments, 1) == 1;
  if (arguments.size() != 1 && !forced) {
    return false;
  }
  request_.node_id = byte_at(arguments, 0);
  check_ = forced || request_.node_id == kNoNodeId ? Check::none : Check::inquire;
  return is_node_id(request_.node_id);
}

bool Course::read_known(std::span<const std::byte> arguments) {
  request_.service = Service::question;
  if (arguments.empty()) {
    return true;
  }
  if (arguments.size() != 1 + kAddressBytes || byte_at(arguments, 0) > kAllParts) {
    return false;
  }
  const Address address = read_address(arguments.subspan(1));
  Known known;
  for (std::size_t i = 0; i < kParts; ++i) {
    if ((byte_at(arguments, 0) >> i & 1U) != 0) {
      known[i] = address[i];
    }
  }
  scan_ = Fastscan(known);
  return true;
}

std::optional<std::uint8_t> Course::node_to_check() const {
  return check_ == Check::check ? std::optional(request_.node_id) : std::nullopt;
}

void Course::checked(bool free) {
  if (check_ == Check::check) {
    check_ = Check::none;
    over_ = !free;
    last_.outcome = free ? Outcome::done : Outcome::node_id_in_use;
  }
}

// A device keeps an existing node-ID.
void Course::inquired(const Answer& answer) {
  const bool same = answer.value == request_.node_id;
  has_none_ = answer.outcome == Outcome::done && answer.value == kNoNodeId;
  if (answer.outcome != Outcome::done) {
    last_.outcome = answer.outcome;
    over_ = true;
  }
  check_ = over_ || same ? Check::none : Check::check;
}

std::optional<std::uint8_t> Course::given() const {
  const bool done = over_ && last_.outcome == Outcome::done && has_none_;
  return done ? std::optional(request_.node_id) : std::nullopt;
}

Request Course::request() const {
  LINEGATE_ASSERT(!over(), "a procedure that is over requests nothing");
  if (check_ == Check::inquire) {
    return {.service = Service::inquire_node_id, .of_one = true};
  }
  Request out = request_;
  if (is_fastscan()) {
    out.message = scan_.question();
  }
  return out;
}

void Course::answered(const Answer& answer) {
  if (is_fastscan()) {
    scanned(answer.outcome == Outcome::done);
    return;
  }
  if (check_ == Check::inquire) {
    inquired(answer);
    return;
  }
  last_ = answer;
  over_ = true;
  if (answer.outcome != Outcome::done) {
    return;
  }
  if (procedure_ == Procedure::inquire_node_id) {
    data_.push_back(static_cast<std::byte>(answer.value));
  } else if (procedure_ == Procedure::inquire_address) {
    address_[request_.part] = answer.value;
    over_ = request_.part == kSerial;
    if (over_) {
      put(address_, data_);
    } else {
      request_.part = static_cast<Part>(request_.part + 1);
    }
  }
}

void Course::scanned(bool yes) {
  scan_.answered(yes);
  if (scan_.state() == Fastscan::State::running) {
    return;
  }
  over_ = true;
  last_.outcome = Outcome::no_answer;
  if (scan_.state() == Fastscan::State::found) {
    last_.outcome = Outcome::done;
    put(scan_.address(), data_);
  }
}

std::vector<std::byte> Course::reply() const {
  LINEGATE_ASSERT(over_, "the procedure is over");
  std::vector<std::byte> out(3 + data_.size());
  out[0] = static_cast<std::byte>(last_.outcome);
  out[1] = std::byte{last_.error};
  out[2] = std::byte{last_.specific};
  std::ranges::copy(data_, out.begin() + 3);
  return out;
}

}  // namespace linegate::lss
