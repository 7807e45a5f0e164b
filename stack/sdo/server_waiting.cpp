// SPDX-License-Identifier: Apache-2.0
// The server while a hook of the object, or its stream, defers a result (split indication).
#include <utility>

#include "stack/base/assert.h"
#include "stack/sdo/server.h"

namespace linegate::sdo {

// Returns whether there is an answer; false while the result is deferred, under ticket_.
bool Server::refuse_or_wait(od::Address address, AbortCode why, Awaited awaited,
                            std::uint64_t request, Instant now, std::uint64_t& reply) {
  if (why != od::kLater || ticket_ == 0) {
    reply = refuse(address, od::never_later(why));
    return true;
  }
  state_ = State::waiting;
  awaited_ = awaited;
  address_ = address;
  newest_request_ = request;
  deadline_ = now + options_.answer_timeout;
  block_wake_ = kNever;
  return false;
}

bool Server::answered() const {
  return ticket_ != 0 && dictionary_.outcome(ticket_);
}

void Server::resume(Instant now, can::TransmitQueue& queue) {
  LINEGATE_ASSERT(answered(), "the hook has answered");
  if (state_ != State::waiting) {
    resume_sub_block(now, queue);
    return;
  }
  std::uint64_t reply = 0;
  if (finish_waiting(now, reply)) {
    outbox_.send(reply, now, queue);
  }
}

bool Server::finish_waiting(Instant now, std::uint64_t& reply) {
  switch (awaited_) {
    case Awaited::upload:
    case Awaited::block_upload:
      return finish_upload(now, reply);
    case Awaited::expedited_download:
    case Awaited::last_segment:
    case Awaited::block_download_end:
      return finish_storing(now, reply);
    default:
      return proceed_with_stream(now, reply);
  }
}

bool Server::finish_upload(Instant now, std::uint64_t& reply) {
  const Result<std::span<const std::byte>> value =
      dictionary_.finish_read(std::exchange(ticket_, 0));
  if (!value.ok()) {
    reply = refuse(address_, static_cast<AbortCode>(value.error().code));
    return true;
  }
  end();
  return awaited_ == Awaited::upload ? answer_upload(newest_request_, *value, now, reply)
                                     : answer_block_upload(newest_request_, *value, now, reply);
}

// A sink that received the last bytes may be busy with them, so that finish() had to wait.
bool Server::finish_storing(Instant now, std::uint64_t& reply) {
  const od::Ticket ticket = std::exchange(ticket_, 0);
  AbortCode why = sink_.streams() ? dictionary_.finish(ticket)
                                  : dictionary_.finish_write(ticket, sink_.bytes());
  if (why == AbortCode::none && sink_.open()) {
    why = store();
  }
  if (why != AbortCode::none) {
    return refuse_or_wait(address_, why, awaited_, newest_request_, now, reply);
  }
  const od::Address address = address_;
  ++counters_.downloads;
  end();
  switch (awaited_) {
    case Awaited::last_segment:
      reply = command_byte(ServerCommand::download_segment, toggle_ ? unsigned{kToggle} : 0U);
      break;
    case Awaited::block_download_end:
      reply = kBlockTakeEnd;
      break;
    default:
      reply = initiate_word(command_byte(ServerCommand::download_initiate), address);
      break;
  }
  return true;
}

// Before the first byte or between pieces.
bool Server::proceed_with_stream(Instant now, std::uint64_t& reply) {
  const AbortCode why = dictionary_.finish(std::exchange(ticket_, 0));
  if (why != AbortCode::none) {
    reply = refuse(address_, why);
    return true;
  }
  switch (awaited_) {
    case Awaited::upload_segment:
      state_ = State::upload_segments;
      return upload_segment(newest_request_, now, reply);
    case Awaited::download_segment:
      state_ = State::download_segments;
      return segment_taken(newest_request_, now, reply);
    case Awaited::sub_block:
      state_ = State::block_download;
      reply = acknowledge_block(now);
      return true;
    default:
      LINEGATE_ASSERT(awaited_ == Awaited::open_sink, "the sink may be opened now");
      end();
      return serve(newest_request_, now, reply);
  }
}

// Continues a sub-block: its segments may be sent, or the received ones may be acknowledged.
void Server::resume_sub_block(Instant now, can::TransmitQueue& queue) {
  LINEGATE_ASSERT(state_ == State::block_download || state_ == State::block_upload,
                  "a stream is waited for within a sub-block");
  const AbortCode why = dictionary_.finish(std::exchange(ticket_, 0));
  if (why != AbortCode::none) {
    outbox_.send(refuse_block(why, now), now, queue);
    return;
  }
  deadline_ = now + options_.timeout;
  block_wake_ = now + options_.stall;
  send_segments(now, queue);
}

// Ends a transfer with an error.
void Server::give_up(AbortCode why) {
  if (ticket_ != 0) {
    dictionary_.cancel(std::exchange(ticket_, 0));
  }
  ++counters_.aborts;
  close_streams(why);
  end();
}

}  // namespace linegate::sdo
