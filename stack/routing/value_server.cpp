// SPDX-License-Identifier: Apache-2.0
#include "stack/routing/value_server.h"

#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/sdo/protocol.h"

namespace linegate::routing {
namespace {

constexpr std::uint32_t kFramesOfServer = 48;  // more than it sends at once

// The object of a transfer: its value is that of the device.
od::ObjectDescription object_at(od::Address address) {
  od::ObjectDescription out;
  out.index = address.index;
  out.type = od::ObjectType::domain;
  out.variables = {od::number_variable(address.sub, "Value", od::DataType::domain, od::Access::rw)};
  return out;
}

sdo::ServerOptions options_of(Duration frame_timeout) {
  // The request has a deadline of its own.
  return {.timeout = frame_timeout,
          .stall = frame_timeout / 5,
          .answer_timeout = std::chrono::hours(1),
          .max_transfer = ValueServer::kLongest};
}

}  // namespace

ValueServer::ValueServer(Target& target, EventLog& events, Duration frame_timeout)
    : target_(target),
      server_(dictionary_, can::CobId{0}, can::CobId{0}, events, options_of(frame_timeout)),
      queue_(kFramesOfServer) {
}

SdoPhase::End ValueServer::request(std::uint64_t word, Instant now) {
  if (waits() && word == begun_) {  // the bus doubled the frame: its answer is due
    return SdoPhase::End::none;
  }
  const bool begun = begins(word);
  if (begun) {
    begun_ = word;
    if (const AbortCode why = prepare(sdo::multiplexer(word)); why != AbortCode::none) {
      refuse(word, why);
      return SdoPhase::End::none;
    }
  }
  const SdoPhase::End end = phase_.request(word);
  can::Frame frame;
  frame.length = sdo::kFrameSize;
  frame.time = now;
  store_le(frame.data.data(), begun ? with_size(word) : word);
  server_.receive(frame, queue_);
  return end;
}

// An expedited download that does not indicate its size (CiA 301 7.2.4.3.3) has that of the object:
// a USDO server receives the number of bytes. An unknown size is 4 bytes.
std::uint64_t ValueServer::with_size(std::uint64_t word) const {
  constexpr std::uint64_t kUnsized = 0x22;
  constexpr std::uint64_t kSpecifierAndFlags = 0xE3;
  const std::size_t size =
      (word & kSpecifierAndFlags) == kUnsized ? target_.size_of(sdo::multiplexer(word)) : 0;
  if (size == 0 || size > sdo::kExpeditedSize) {
    return word;
  }
  return (word & ~std::uint64_t{0xFF}) |
         sdo::expedited_byte(sdo::ClientCommand::download_initiate, size);
}

void ValueServer::refuse(std::uint64_t word, AbortCode why) {
  (void)phase_.request(word);
  const bool pushed = queue_.push(can::TransmitClass::sdo, {.length = sdo::kFrameSize},
                                  sdo::abort_word(sdo::multiplexer(word), why));
  LINEGATE_ASSERT(pushed, "the queue has room for the answer to each frame");
}

// The dictionary gets the object of the transfer that begins.
AbortCode ValueServer::prepare(od::Address address) {
  reset();  // a transfer that was not finished
  if (index_ != 0) {
    LINEGATE_ASSERT(dictionary_.remove(index_).ok(), "it was added");
    index_ = 0;
  }
  if (address.index == 0) {
    return AbortCode::no_object;
  }
  if (!dictionary_.add(object_at(address)).ok()) {
    return AbortCode::no_sub_index;  // FFh, the structure of an object
  }
  index_ = address.index;
  LINEGATE_ASSERT(dictionary_.set_hook(index_, this).ok(), "it was added");
  return AbortCode::none;
}

void ValueServer::reset() {
  server_.reset();  // withdraws the request under way
  LINEGATE_ASSERT(ticket_ == 0, "no request without a transfer");
  queue_.clear();
}

// --- the access of the server -------------------------------------------------------------------

AbortCode ValueServer::before_read(od::Address address, const od::Variable& /*variable*/) {
  return ask(address, false, {});
}

AbortCode ValueServer::check_write(od::Address address, std::span<const std::byte> value) {
  return ask(address, true, value);
}

AbortCode ValueServer::ask(od::Address address, bool write, std::span<const std::byte> value) {
  asked_ = address;
  reads_ = !write;
  const AbortCode why = target_.ask(address, write, value);
  return why == AbortCode::none ? od::kLater : why;
}

void ValueServer::put_off(od::Address /*address*/, od::Ticket waiting) {
  ticket_ = waiting;
}

void ValueServer::cancelled(od::Ticket /*waiting*/) {
  ticket_ = 0;
  target_.withdrawn();
}

void ValueServer::finish(AbortCode why, std::span<const std::byte> value, Instant now) {
  LINEGATE_ASSERT(waits(), "an access waits for the result");
  AbortCode result = why == od::kLater ? AbortCode::general : why;
  if (result == AbortCode::none && reads_) {
    result = value.size() > kLongest ? AbortCode::out_of_memory : AbortCode::none;
    if (result == AbortCode::none) {
      LINEGATE_ASSERT(dictionary_.set(asked_, value), "a DOMAIN has any length up to that limit");
    }
  }
  LINEGATE_ASSERT(dictionary_.complete(std::exchange(ticket_, 0), result), "the access waits");
  server_.advance(now, queue_);
}

std::optional<ValueServer::Answer> ValueServer::pop() {
  can::Frame frame;
  if (!queue_.pop(frame)) {
    return std::nullopt;
  }
  const std::uint64_t word = sdo::word_of(frame);
  return Answer{word, phase_.response(word)};
}

}  // namespace linegate::routing
