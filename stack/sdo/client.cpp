#include "stack/sdo/client.h"

#include <array>
#include <span>
#include <utility>

#include "stack/sdo/protocol.h"

namespace linegate::sdo {

Client::Client(can::CobId request) : outbox_(request) {
}

void Client::read(od::Address address, Duration timeout, Instant now, can::TransmitQueue& queue) {
  begin(address, timeout);
  request(State::upload_initiate,
          initiate_word(command_byte(ClientCommand::upload_initiate), address), now, queue);
}

// An empty value goes in one empty segment: expedited transfer has no way to say 0 bytes.
void Client::write(od::Address address, std::vector<std::byte> data, Duration timeout, Instant now,
                   can::TransmitQueue& queue) {
  begin(address, timeout);
  const std::size_t size = data.size();
  source_.start(std::move(data));
  std::uint8_t command = command_byte(ClientCommand::download_initiate, kSizeIndicated);
  auto value = static_cast<std::uint32_t>(size);
  if (size >= 1 && size <= kExpeditedSize) {
    std::array<std::byte, kExpeditedSize> bytes;
    source_.next(bytes);
    command = expedited_byte(ClientCommand::download_initiate, size);
    value = load_le<std::uint32_t>(bytes.data());
  }
  request(State::download_initiate, initiate_word(command, address, value), now, queue);
}

Receipt Client::receive(const can::Frame& frame, can::TransmitQueue& queue) {
  if (!well_formed(frame)) {
    return Receipt::malformed;
  }
  const std::uint64_t word = word_of(frame);
  if (!busy()) {
    return take_stray() || word == last_used_ ? Receipt::stray : Receipt::unasked;
  }
  if (specifier(command_of(frame)) == static_cast<unsigned>(ServerCommand::abort)) {
    return aborted_by_server(word);
  }
  if (waits_for_initiate()) {
    return initiate_answered(word, frame.time, queue);
  }
  const AbortCode why = segment_answered(word, frame.time, queue);
  if (why == AbortCode::command_specifier && take_stray()) {
    return Receipt::stray;
  }
  last_used_ = word;
  if (why != AbortCode::none) {
    abort(why, frame.time, queue);
  }
  return Receipt::used;
}

void Client::advance(Instant now, can::TransmitQueue& queue) {
  if (now >= deadline_) {
    abort(AbortCode::timeout, now, queue);
  }
  if (now >= outbox_.next_wake()) {
    outbox_.flush(now, queue);
  }
}

Instant Client::next_wake() const {
  return earlier(deadline_, outbox_.next_wake());
}

void Client::abort(AbortCode code, Instant now, can::TransmitQueue& queue) {
  if (!busy()) {
    return;
  }
  outbox_.clear();  // a request that waits for room is void
  outbox_.send(abort_word(address_, code), now, queue);
  expect_stray();  // the answer that was waited for
  expect_stray();  // the server's own abort, if it gives up as well
  finish(code);
}

std::optional<Outcome> Client::take() {
  return std::exchange(outcome_, std::nullopt);
}

void Client::begin(od::Address address, Duration timeout) {
  address_ = address;
  timeout_ = timeout;
  toggle_ = false;
  outcome_.reset();
}

void Client::request(State state, std::uint64_t word, Instant now, can::TransmitQueue& queue) {
  state_ = state;
  deadline_ = now + timeout_;
  outbox_.send(word, now, queue);
}

void Client::request_upload_segment(Instant now, can::TransmitQueue& queue) {
  request(State::upload_segment,
          command_byte(ClientCommand::upload_segment, toggle_ ? unsigned{kToggle} : 0U), now,
          queue);
}

void Client::send_download_segment(Instant now, can::TransmitQueue& queue) {
  Payload segment;
  const std::size_t size = source_.next(std::span(segment).subspan(1));
  segment[0] = std::byte{
      segment_byte(ClientCommand::download_segment, toggle_, size, source_.remaining() == 0)};
  request(State::download_segment, load_le<std::uint64_t>(segment.data()), now, queue);
}

bool Client::take_stray() {
  const bool expected = strays_expected_ > 0;
  strays_expected_ -= expected ? 1U : 0U;
  return expected;
}

bool Client::waits_for_initiate() const {
  return state_ == State::upload_initiate || state_ == State::download_initiate;
}

Receipt Client::initiate_answered(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
  const ServerCommand wanted = state_ == State::upload_initiate ? ServerCommand::upload_initiate
                                                                : ServerCommand::download_initiate;
  AbortCode why = AbortCode::none;
  if (specifier(static_cast<std::uint8_t>(word)) != static_cast<unsigned>(wanted)) {
    why = AbortCode::command_specifier;
  } else if (multiplexer(word) != address_) {
    why = AbortCode::parameter_incompatible;
  }
  if (why != AbortCode::none && take_stray()) {
    return Receipt::stray;
  }
  last_used_ = word;
  if (why == AbortCode::none) {
    if (state_ == State::upload_initiate) {
      why = upload_initiated(word, now, queue);
    } else if (source_.remaining() > 0 || source_.size() == 0) {
      send_download_segment(now, queue);
    } else {
      finish(AbortCode::none);
    }
  }
  if (why != AbortCode::none) {
    abort(why, now, queue);
  }
  return Receipt::used;
}

AbortCode Client::upload_initiated(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
  const auto command = static_cast<std::uint8_t>(word);
  if ((command & kExpedited) != 0) {
    std::array<std::byte, kExpeditedSize> bytes;
    store_le(bytes.data(), long_word(word));
    sink_.start(std::nullopt, kExpeditedSize);
    sink_.append(std::span(bytes).first(expedited_size(command)), AbortCode::none);
    finish(AbortCode::none);
    return AbortCode::none;
  }
  std::optional<std::uint32_t> announced;
  if ((command & kSizeIndicated) != 0) {
    announced = long_word(word);
    if (*announced > kMaxUpload) {
      return AbortCode::out_of_memory;
    }
  }
  sink_.start(announced, kMaxUpload);
  request_upload_segment(now, queue);
  return AbortCode::none;
}

AbortCode Client::segment_answered(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
  const auto command = static_cast<std::uint8_t>(word);
  const ServerCommand wanted = state_ == State::upload_segment ? ServerCommand::upload_segment
                                                               : ServerCommand::download_segment;
  if (specifier(command) != static_cast<unsigned>(wanted)) {
    return AbortCode::command_specifier;
  }
  if (toggle_of(command) != toggle_) {
    return AbortCode::toggle_bit;
  }
  toggle_ = !toggle_;
  return state_ == State::upload_segment ? upload_segment_came(word, now, queue)
                                         : download_segment_taken(now, queue);
}

AbortCode Client::upload_segment_came(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
  const auto command = static_cast<std::uint8_t>(word);
  Payload bytes;
  store_le(bytes.data(), word);
  const AbortCode why =
      sink_.append(std::span(bytes).subspan(1, segment_size(command)), AbortCode::out_of_memory);
  if (why != AbortCode::none) {
    return why;
  }
  if ((command & kLastSegment) == 0) {
    request_upload_segment(now, queue);
    return AbortCode::none;
  }
  const AbortCode complete = sink_.finish();
  if (complete == AbortCode::none) {
    finish(AbortCode::none);
  }
  return complete;
}

AbortCode Client::download_segment_taken(Instant now, can::TransmitQueue& queue) {
  if (source_.remaining() > 0) {
    send_download_segment(now, queue);
  } else {
    finish(AbortCode::none);
  }
  return AbortCode::none;
}

// Some servers abort without a multiplexer. An abort is always the end of the transfer, unless it
// can be that of an earlier one.
Receipt Client::aborted_by_server(std::uint64_t word) {
  const od::Address address = multiplexer(word);
  const bool ours = address == address_ || address == od::Address{};
  if (!ours && waits_for_initiate() && take_stray()) {
    return Receipt::stray;
  }
  last_used_ = word;
  const auto code = static_cast<AbortCode>(long_word(word));
  finish(code == AbortCode::none ? AbortCode::general : code);
  return Receipt::used;
}

void Client::finish(AbortCode code) {
  Outcome outcome{.abort = code, .data = {}};
  if (code == AbortCode::none &&
      (state_ == State::upload_initiate || state_ == State::upload_segment)) {
    outcome.data = sink_.take();
  }
  outcome_ = std::move(outcome);
  state_ = State::idle;
  deadline_ = kNever;
}

}  // namespace linegate::sdo
