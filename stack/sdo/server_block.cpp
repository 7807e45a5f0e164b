// SPDX-License-Identifier: Apache-2.0
// The server side of block transfer (CiA 301, 7.2.4.3.9 to 7.2.4.3.16).
#include "stack/base/assert.h"
#include "stack/sdo/server.h"

namespace linegate::sdo {
namespace {

constexpr std::uint8_t kAbort = command_byte(ClientCommand::abort);
constexpr std::uint8_t kNetworkSpecifier = 7;  // of the network indication

// Whether the request begins a transfer: permitted at any time except within a sub-block.
bool initiates(std::uint8_t command) {
  const auto service = static_cast<ClientCommand>(specifier(command));
  return service == ClientCommand::upload_initiate || service == ClientCommand::download_initiate ||
         is_block_send(command) || is_block_take(command);
}

}  // namespace

// --- initiate -----------------------------------------------------------------------------------

bool Server::initiate_block(std::uint64_t request, Instant now, std::uint64_t& reply) {
  const auto command = static_cast<std::uint8_t>(request);
  if (is_block_take(command)) {
    return initiate_block_upload(request, now, reply);
  }
  if (is_block_send(command)) {
    return initiate_block_download(request, now, reply);
  }
  reply = refuse(address_, AbortCode::command_specifier);
  return true;
}

bool Server::initiate_block_download(std::uint64_t request, Instant now, std::uint64_t& reply) {
  drop();
  const od::Address address = multiplexer(request);
  std::optional<std::uint32_t> announced;
  if ((request & kBlockSize) != 0) {
    announced = long_word(request);
  }
  const AbortCode why = prepare_download(address, announced);
  if (why != AbortCode::none) {
    return refuse_or_wait(address, why, Awaited::open_sink, request, now, reply);
  }
  begin(State::block_download, address, now);
  receiver_.start(announced, (request & kBlockCrc) != 0);
  pace_ = {};
  block_wake_ = now + options_.stall;
  reply = initiate_word(kBlockTake | kBlockCrc, address, receiver_.block_size());
  return true;
}

bool Server::initiate_block_upload(std::uint64_t request, Instant now, std::uint64_t& reply) {
  drop();
  const od::Address address = multiplexer(request);
  const std::uint8_t block_size = byte_of(request, 4);
  if (block_size == 0 || block_size > kMaxBlockSize) {
    reply = refuse(address, AbortCode::block_size);
    return true;
  }
  const Result<std::span<const std::byte>> value = dictionary_.read(address, ticket_);
  if (!value.ok()) {
    return refuse_or_wait(address, static_cast<AbortCode>(value.error().code),
                          Awaited::block_upload, request, now, reply);
  }
  return answer_block_upload(request, *value, now, reply);
}

bool Server::answer_block_upload(std::uint64_t request, std::span<const std::byte> value,
                                 Instant now, std::uint64_t& reply) {
  const od::Address address = multiplexer(request);
  const std::uint8_t switch_threshold = byte_of(request, 5);
  const bool expedited = !value.empty() && value.size() <= kExpeditedSize;
  if (expedited && value.size() <= switch_threshold) {
    return answer_upload(request, value, now, reply);
  }
  if (!initiate_segmented_upload(request, value, Awaited::block_upload, now, reply)) {
    return false;
  }
  const std::optional<std::uint32_t> size = busy() ? source_.size() : std::nullopt;
  if (!busy() || (size && *size <= switch_threshold && switch_threshold > 0)) {
    return true;
  }
  begin(State::block_upload_initiate, address, now);
  sender_.start(byte_of(request, 4), (request & kBlockCrc) != 0);
  reply = initiate_word(static_cast<std::uint8_t>(kBlockSend | kBlockCrc | (size ? kBlockSize : 0)),
                        address, size.value_or(0));
  return true;
}

// --- requests during a transfer -----------------------------------------------------------------

bool Server::serve_block(std::uint64_t request, Instant now, std::uint64_t& reply) {
  const auto command = static_cast<std::uint8_t>(request);
  switch (state_) {
    case State::late_segments:
      if (late_.take(command, now)) {
        return false;
      }
      break;
    case State::block_download:
      if (command != kAbort) {
        return block_segment(request, now, reply);
      }
      break;
    case State::block_download_end:
      if (receiver_.is_repetition(request)) {
        return false;
      }
      if (is_block_send_end(command)) {
        return end_block_download(request, now, reply);
      }
      break;
    case State::block_upload_initiate:
      if (command == kBlockStart) {
        state_ = State::block_upload;
        newest_request_ = request;
        block_wake_ = now;
        return false;
      }
      break;
    case State::block_upload:
      if (command == kBlockAck) {
        return block_acknowledged(request, now, reply);
      }
      [[fallthrough]];
    case State::block_upload_end:
      if (request == newest_request_) {
        return false;  // a repeated frame
      }
      if (state_ == State::block_upload_end && command == kBlockTakeEnd) {
        uploaded();
        return false;
      }
      break;
    case State::waiting:
      if (!initiates(command) &&
          (request == newest_request_ ||
           (awaited_ == Awaited::sub_block && receiver_.is_repetition(request)))) {
        return false;  // a repeated frame
      }
      break;
    case State::diverted:
      network_handler_->diverted_request(*this, request, now);
      return false;
    default:
      break;
  }
  return serve_other(request, now, reply);
}

// A request that does not fit the state of the block transfer.
bool Server::serve_other(std::uint64_t request, Instant now, std::uint64_t& reply) {
  const auto command = static_cast<std::uint8_t>(request);
  const bool for_network_handler =
      network_handler_ != nullptr && specifier(command) == kNetworkSpecifier;
  if (!busy() || command == kAbort || initiates(command) || for_network_handler) {
    drop();
    state_ = State::idle;
    return serve(request, now, reply);
  }
  reply = refuse(address_, AbortCode::command_specifier);
  return true;
}

// --- download -----------------------------------------------------------------------------------

bool Server::block_segment(std::uint64_t request, Instant now, std::uint64_t& reply) {
  LINEGATE_ASSERT_HOT(state_ == State::block_download, "a sub-block is received");
  const AbortCode why = receiver_.take(request, sink_);
  if (why == od::kLater) {
    ticket_ = dictionary_.put_off_sink(address_);
  }
  if (why != AbortCode::none && ticket_ == 0) {
    reply = refuse_block(od::never_later(why), now);
    return true;
  }
  deadline_ = now + options_.timeout;
  pace_.came(now);
  block_wake_ = now + (receiver_.lossy() ? pace_.stall(options_.stall) : options_.stall);
  if (!receiver_.over()) {
    return false;
  }
  if (ticket_ != 0) {
    return refuse_or_wait(address_, od::kLater, Awaited::sub_block, request, now, reply);
  }
  reply = acknowledge_block(now);
  return true;
}

std::uint64_t Server::acknowledge_block(Instant now) {
  const std::uint64_t reply = receiver_.acknowledge();
  pace_.pause();
  deadline_ = now + options_.timeout;
  block_wake_ = now + options_.stall;
  if (receiver_.complete()) {
    state_ = State::block_download_end;
    block_wake_ = kNever;
  }
  return reply;
}

bool Server::end_block_download(std::uint64_t request, Instant now, std::uint64_t& reply) {
  LINEGATE_ASSERT(state_ == State::block_download_end, "every segment was acknowledged");
  AbortCode why = receiver_.finish(request, sink_);
  if (why == od::kLater) {
    ticket_ = dictionary_.put_off_sink(address_);
  } else if (why == AbortCode::none) {
    why = store();
  }
  if (why != AbortCode::none) {
    return refuse_or_wait(address_, why, Awaited::block_download_end, request, now, reply);
  }
  ++counters_.downloads;
  end();
  reply = kBlockTakeEnd;
  return true;
}

std::uint64_t Server::refuse_block(AbortCode code, Instant now) {
  const bool sub_block = state_ == State::block_download;
  const std::uint64_t reply = refuse(address_, code);
  if (sub_block) {
    expect_late_segments(now);
  }
  return reply;
}

void Server::expect_late_segments(Instant now) {
  late_.expect(receiver_.last_seen(), receiver_.most_expected(), now);
  state_ = late_.expected() ? State::late_segments : State::idle;
}

// --- upload -------------------------------------------------------------------------------------

// A repeated acknowledgement: segments of the current sub-block were not handed out to the bus yet.
bool Server::acknowledges_waiting_segments(std::uint64_t request,
                                           const can::TransmitQueue& queue) const {
  return state_ == State::block_upload && request == newest_request_ && outbox_.waits(queue);
}

bool Server::block_acknowledged(std::uint64_t request, Instant now, std::uint64_t& reply) {
  if (sender_.sending() && request == newest_request_) {
    return false;  // a repeated frame
  }
  newest_request_ = request;
  deadline_ = now + (ticket_ == 0 ? options_.timeout : options_.answer_timeout);
  return proceed_with_block(sender_.acknowledge(byte_of(request, 1), byte_of(request, 2), source_),
                            now, reply);
}

// After an acknowledgement, and its result.
bool Server::proceed_with_block(AbortCode why, Instant now, std::uint64_t& reply) {
  if (why != AbortCode::none) {
    reply = refuse(address_, why);
    return true;
  }
  if (!sender_.complete()) {
    block_wake_ = now;
    return false;
  }
  state_ = State::block_upload_end;
  block_wake_ = kNever;
  reply = sender_.end_request();
  return true;
}

void Server::send_segments(Instant now, can::TransmitQueue& queue) {
  if (state_ != State::block_upload) {
    return;
  }
  while (ticket_ == 0 && sender_.sending() && outbox_.has_room_for_many(queue)) {
    const std::uint64_t segment = sender_.next_segment(source_);
    if (source_.error() != AbortCode::none) {
      put_off_or_abort(source_.error(), now, queue);
      return;
    }
    outbox_.send(segment, now, queue);
    deadline_ = now + options_.timeout;
  }
  std::uint64_t reply = 0;
  if (sender_.early_due() && proceed_with_block(sender_.acknowledge_early(source_), now, reply)) {
    outbox_.send(reply, now, queue);
    return;
  }
  block_wake_ = ticket_ == 0 && sender_.sending() ? now + Outbox::kRetry : kNever;
}

// The source has no next segment.
void Server::put_off_or_abort(AbortCode why, Instant now, can::TransmitQueue& queue) {
  ticket_ = why == od::kLater ? dictionary_.put_off_source(address_) : od::Ticket{0};
  if (ticket_ == 0) {
    outbox_.send(refuse(address_, od::never_later(why)), now, queue);
    return;
  }
  deadline_ = now + options_.answer_timeout;
  block_wake_ = kNever;
}

void Server::advance_block(Instant now, can::TransmitQueue& queue) {
  if (state_ == State::block_upload) {
    send_segments(now, queue);
  } else if (state_ == State::block_download && ticket_ == 0 && receiver_.may_acknowledge()) {
    outbox_.send(acknowledge_block(now), now, queue);
  } else {
    block_wake_ = kNever;
  }
}

}  // namespace linegate::sdo
