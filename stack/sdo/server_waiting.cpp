// The server while a hook of the object owes it an answer (split indication).
#include "stack/sdo/server.h"

namespace linegate::sdo {

// Gives whether there is an answer: none yet if a hook answers later.
bool Server::refuse_or_wait(od::Address address, AbortCode why, Awaited awaited,
                            std::uint64_t request, Instant now, std::uint64_t& reply) {
  if (why != od::kLater) {
    reply = refuse(address, why);
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
  return state_ == State::waiting && dictionary_.outcome(ticket_);
}

// Precondition: answered().
std::uint64_t Server::finish_waiting(Instant now) {
  const od::Address address = address_;
  if (awaited_ == Awaited::upload || awaited_ == Awaited::block_upload) {
    const Result<std::span<const std::byte>> value = dictionary_.finish_read(ticket_);
    if (!value.ok()) {
      return refuse(address, static_cast<AbortCode>(value.error().code));
    }
    end();
    return awaited_ == Awaited::upload ? answer_upload(address, *value, now)
                                       : answer_block_upload(newest_request_, *value, now);
  }
  const AbortCode why = dictionary_.finish_write(ticket_, sink_.bytes());
  if (why != AbortCode::none) {
    return refuse(address, why);
  }
  const bool toggle = toggle_;
  ++counters_.downloads;
  end();
  switch (awaited_) {
    case Awaited::last_segment:
      return command_byte(ServerCommand::download_segment, toggle ? unsigned{kToggle} : 0U);
    case Awaited::block_download_end:
      return kBlockTakeEnd;
    default:
      return initiate_word(command_byte(ServerCommand::download_initiate), address);
  }
}

// A transfer that does not end well.
void Server::give_up(AbortCode why) {
  if (state_ == State::waiting) {
    dictionary_.cancel(ticket_);
  }
  ++counters_.aborts;
  close_streams(why);
  end();
}

}  // namespace linegate::sdo
