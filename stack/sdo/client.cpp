// SPDX-License-Identifier: Apache-2.0
#include "stack/sdo/client.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "stack/base/assert.h"
#include "stack/od/hook.h"
#include "stack/sdo/protocol.h"

namespace linegate::sdo {
namespace {

// False for success, and for codes that only hooks of a dictionary return.
bool is_abort_code(AbortCode code) {
  return code != AbortCode::none && code != od::kLater;
}

}  // namespace

Client::Client(can::CobId request) : outbox_(request) {
}

void Client::read(od::Address address, Duration timeout, Instant now, can::TransmitQueue& queue,
                  TransferOptions options) {
  begin(address, false, nullptr, timeout, options);
  start(now, queue);
}

void Client::read(od::Address address, od::ByteSink& sink, Duration timeout, Instant now,
                  can::TransmitQueue& queue, TransferOptions options) {
  begin(address, false, &sink, timeout, options);
  start(now, queue);
}

void Client::write(od::Address address, std::vector<std::byte> data, Duration timeout, Instant now,
                   can::TransmitQueue& queue, TransferOptions options) {
  begin(address, true, nullptr, timeout, options);
  source_.start(std::move(data));
  start(now, queue);
}

void Client::write(od::Address address, od::ByteSource& source, Duration timeout, Instant now,
                   can::TransmitQueue& queue, TransferOptions options) {
  begin(address, true, nullptr, timeout, options);
  source_.start(source);
  start(now, queue);
}

Receipt Client::receive(const can::Frame& frame, can::TransmitQueue& queue) {
  if (!well_formed(frame)) {
    return Receipt::malformed;
  }
  const std::uint64_t word = word_of(frame);
  // Also before the request was sent: another program may have sent a request before.
  if (!busy() || (waits_for_initiate() && (held_ || outbox_.waits(queue)))) {
    note_answer(frame.time, queue);
    return receive_stray(word, frame.time) || word == last_used_ ? Receipt::stray
                                                                 : Receipt::unasked;
  }
  if (is_abort(command_of(frame))) {
    return aborted_by_server(word, frame.time, queue);
  }
  if (waits_for_initiate()) {
    return initiate_answered(word, frame.time, queue);
  }
  if (in_block() && is_repetition(word, queue)) {
    return Receipt::stray;
  }
  const AbortCode why = answered(word, frame.time, queue);
  if (why == AbortCode::command_specifier && receive_stray(word, frame.time)) {
    return Receipt::stray;
  }
  last_used_ = word;
  if (why != AbortCode::none) {
    give_up(why, frame.time, queue);
  }
  return Receipt::used;
}

void Client::advance(Instant now, can::TransmitQueue& queue) {
  if (now >= look_again_) {
    follow_unanswered(now, queue);
  }
  extend_while_paced(now);
  if (now >= deadline_ && !fall_back_unanswered(now, queue)) {
    give_up(AbortCode::timeout, now, queue);
  }
  if (now >= outbox_.next_wake()) {
    outbox_.flush(now, queue);
  }
  if (now >= block_wake_) {
    advance_block(now, queue);
  }
}

// The server can not answer a request that was not sent yet.
void Client::extend_while_paced(Instant now) {
  if (outbox_.is_paced()) {
    restart_timeout(now);
  }
}

void Client::restart_timeout(Instant now) {
  if (deadline_ != kNever) {
    deadline_ = deadline(now, timeout_);
  }
}

Instant Client::next_wake() const {
  return earlier(earlier(deadline_, block_wake_), earlier(look_again_, outbox_.next_wake()));
}

void Client::abort(AbortCode code, Instant now, can::TransmitQueue& queue) {
  if (busy()) {
    send_abort(code, now, queue);
    finish(code);
  }
}

void Client::configure(can::CobId request) {
  if (busy()) {
    finish(AbortCode::sdo_connection);
  }
  outbox_.clear();
  outbox_.set_cob_id(request);
  strays_expected_ = 0;
  blocks_refused_ = false;
  block_unanswered_ = false;
  late_ = {};
  unanswered_ = Unanswered::nothing;
  look_again_ = kNever;
  held_.reset();
}

std::optional<Outcome> Client::take() {
  return std::exchange(outcome_, std::nullopt);
}

void Client::begin(od::Address address, bool write, od::ByteSink* into, Duration timeout,
                   TransferOptions options) {
  LINEGATE_ASSERT(!busy(), "the transfer before has ended");
  LINEGATE_ASSERT(timeout > Duration::zero(), "the time-out is positive");
  address_ = address;
  writing_ = write;
  sent_before_ = false;
  into_ = into;
  if (into != nullptr) {
    sink_.start(std::nullopt, *into);  // the stream gets its end call in any case
  }
  timeout_ = timeout;
  options_ = options;
  outcome_.reset();
}

void Client::start(Instant now, can::TransmitQueue& queue) {
  toggle_ = false;
  tried_block_ = false;
  announced_size_.reset();
  const bool block = options_.transfer == Transfer::block ||
                     (writing_ && worth_a_block(source_.size())) ||
                     (into_ != nullptr && worth_a_block(std::nullopt));
  block ? initiate_block(now, queue) : initiate(now, queue);
}

// An empty value is sent as one empty segment: an expedited initiate cannot encode 0 bytes.
void Client::initiate(Instant now, can::TransmitQueue& queue) {
  if (!writing_) {
    request(State::upload_initiate,
            initiate_word(command_byte(ClientCommand::upload_initiate), address_), now, queue);
    return;
  }
  const std::optional<std::uint32_t> size = source_.size();
  std::uint8_t command =
      command_byte(ClientCommand::download_initiate, size ? unsigned{kSizeIndicated} : 0U);
  std::uint32_t value = size.value_or(0);
  if (size && *size >= 1 && *size <= kExpeditedSize) {
    std::array<std::byte, kExpeditedSize> bytes;
    source_.next(std::span(bytes).first(*size));
    std::ranges::fill(std::span(bytes).subspan(*size), std::byte{0});
    command = expedited_byte(ClientCommand::download_initiate, *size);
    value = load_le<std::uint32_t>(bytes.data());
  }
  if (source_.error() != AbortCode::none) {
    finish(od::never_later(source_.error()));
    return;
  }
  request(State::download_initiate, initiate_word(command, address_, value), now, queue);
}

void Client::request(State state, std::uint64_t word, Instant now, can::TransmitQueue& queue) {
  state_ = state;
  if (unanswered_ != Unanswered::nothing && waits_for_initiate()) [[unlikely]] {
    hold(word, now);
    return;
  }
  deadline_ = now + timeout_;
  outbox_.send(word, now, queue);
}

void Client::request_upload_segment(Instant now, can::TransmitQueue& queue) {
  request(State::upload_segment,
          command_byte(ClientCommand::upload_segment, toggle_ ? unsigned{kToggle} : 0U), now,
          queue);
}

AbortCode Client::send_download_segment(Instant now, can::TransmitQueue& queue) {
  Payload segment;
  const std::size_t size = source_.next(std::span(segment).subspan(1));
  source_.release();
  if (source_.error() == AbortCode::none) {
    segment[0] =
        std::byte{segment_byte(ClientCommand::download_segment, toggle_, size, source_.at_end())};
    request(State::download_segment, load_le<std::uint64_t>(segment.data()), now, queue);
  }
  return source_.error();
}

bool Client::receive_stray(std::uint64_t word, Instant now) {
  if (late_.expected() && late_.take(static_cast<std::uint8_t>(word), now)) {
    return true;
  }
  const bool expected = strays_expected_ > 0;
  strays_expected_ -= expected ? 1U : 0U;
  return expected;
}

bool Client::waits_for_initiate() const {
  return state_ == State::upload_initiate || state_ == State::download_initiate ||
         state_ == State::block_upload_initiate || state_ == State::block_download_initiate;
}

// Segments of a block look like aborts.
bool Client::is_abort(std::uint8_t command) const {
  constexpr std::uint8_t kAbort = command_byte(ServerCommand::abort);
  const bool among_segments =
      state_ == State::block_upload || state_ == State::block_upload_end || late_.expected();
  return among_segments ? command == kAbort : specifier(command) == specifier(kAbort);
}

Receipt Client::initiate_answered(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
  LINEGATE_ASSERT_HOT(waits_for_initiate() && !held_, "the initiate was sent");
  const auto command = static_cast<std::uint8_t>(word);
  const ServerCommand wanted =
      writing_ ? ServerCommand::download_initiate : ServerCommand::upload_initiate;
  // The server may answer a block upload request with a segmented upload.
  const bool ordinary = state_ != State::block_download_initiate &&
                        specifier(command) == static_cast<unsigned>(wanted);
  AbortCode why = AbortCode::none;
  if (initiate_answer_lost(command, now)) {
    return Receipt::stray;
  }
  if (!ordinary && !fits_block_initiate(command)) {
    why = AbortCode::command_specifier;
  } else if (multiplexer(word) != address_) {
    why = AbortCode::parameter_incompatible;
  }
  if (why != AbortCode::none && (word == last_used_ || receive_stray(word, now))) {
    return Receipt::stray;
  }
  last_used_ = word;
  if (why == AbortCode::none) {
    why = !ordinary  ? block_initiated(word, now, queue)
          : writing_ ? download_initiated(now, queue)
                     : upload_initiated(word, now, queue);
  }
  if (why != AbortCode::none) {
    give_up(why, now, queue);
  }
  return Receipt::used;
}

AbortCode Client::download_initiated(Instant now, can::TransmitQueue& queue) {
  if (!source_.at_end() || source_.size() == 0U) {
    return send_download_segment(now, queue);
  }
  finish(AbortCode::none);
  return AbortCode::none;
}

AbortCode Client::upload_initiated(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
  const auto command = static_cast<std::uint8_t>(word);
  if ((command & kExpedited) != 0) {
    std::array<std::byte, kExpeditedSize> bytes;
    store_le(bytes.data(), long_word(word));
    start_sink(std::nullopt);
    sink_.append(std::span(bytes).first(expedited_size(command)));
    return finish_upload();
  }
  std::optional<std::uint32_t> announced;
  if ((command & kSizeIndicated) != 0) {
    announced = long_word(word);
  }
  const AbortCode why = start_sink(announced);
  if (why != AbortCode::none) {
    return why;
  }
  if (announced && !tried_block_ && worth_a_block(*announced)) {
    announced_size_ = announced;
    // The upload is open: a server may refuse a block initiate before its end.
    outbox_.send(abort_word(address_, AbortCode::general), now, queue);
    expect_stray();  // some servers answer an abort
    initiate_block(now, queue);
  } else {
    request_upload_segment(now, queue);
  }
  return AbortCode::none;
}

AbortCode Client::start_sink(std::optional<std::uint32_t> announced) {
  if (into_ != nullptr) {
    sink_.start(announced, *into_);
    return AbortCode::none;
  }
  if (announced && *announced > options_.longest) {
    return AbortCode::out_of_memory;
  }
  sink_.start(announced, options_.longest, AbortCode::out_of_memory);
  return AbortCode::none;
}

AbortCode Client::answered(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
  return in_block() ? block_answered(word, now, queue) : segment_answered(word, now, queue);
}

AbortCode Client::segment_answered(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
  LINEGATE_ASSERT_HOT(state_ == State::upload_segment || state_ == State::download_segment,
                      "a segment was sent or requested");
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
  const AbortCode why = sink_.append(std::span(bytes).subspan(1, segment_size(command)));
  if (why != AbortCode::none) {
    return why;
  }
  if ((command & kLastSegment) == 0) {
    request_upload_segment(now, queue);
    return AbortCode::none;
  }
  return finish_upload();
}

AbortCode Client::finish_upload() {
  const AbortCode why = sink_.finish();
  if (why == AbortCode::none) {
    finish(AbortCode::none);
  }
  return why;
}

AbortCode Client::download_segment_taken(Instant now, can::TransmitQueue& queue) {
  source_.acknowledge();
  if (!source_.at_end()) {
    return send_download_segment(now, queue);
  }
  finish(AbortCode::none);
  return AbortCode::none;
}

// Some servers abort without a multiplexer. An abort ends the transfer, unless it may belong to an
// earlier one.
Receipt Client::aborted_by_server(std::uint64_t word, Instant now, can::TransmitQueue& queue) {
  const od::Address address = multiplexer(word);
  const bool ours = address == address_ || address == od::Address{};
  if (!ours && waits_for_initiate() && (word == last_used_ || receive_stray(word, now))) {
    return Receipt::stray;
  }
  last_used_ = word;
  auto code = static_cast<AbortCode>(long_word(word));
  if (state_ == State::block_upload && code == AbortCode::command_specifier &&
      receiver_.unheard()) {
    code = AbortCode::timeout;  // the server still waits for the start request, which was lost
  }
  if (!fall_back(code, now, queue)) {
    if (code == AbortCode::timeout) {
      sent_before_ = may_be_carried_out();  // the abort of a gateway that lost its server
    }
    finish_or_repeat(is_abort_code(code) ? code : AbortCode::general, now, queue);
    if (outcome_) {
      outcome_->refused = ours && is_abort_code(code);
    }
  }
  return Receipt::used;
}

void Client::send_abort(AbortCode code, Instant now, can::TransmitQueue& queue) {
  if (std::exchange(held_, std::nullopt)) {
    return;  // no frame of this transfer was sent
  }
  outbox_.clear();  // discard a request that waits for space
  // One frame, which ends the transfer: the server need not wait.
  outbox_.send_urgent(abort_word(address_, code), now, queue);
  expect_stray();  // the pending answer
  expect_stray();  // an abort by the server, if it times out too
  if (state_ == State::block_upload) {
    late_.expect(receiver_.last_seen(), receiver_.most_expected(), now);
  }
}

void Client::give_up(AbortCode why, Instant now, can::TransmitQueue& queue) {
  const AbortCode code = od::never_later(why);
  if (code == AbortCode::timeout) {
    note_unanswered(now, queue);
  }
  sent_before_ = may_be_carried_out();
  send_abort(code, now, queue);
  finish_or_repeat(code, now, queue);
}

void Client::finish_or_repeat(AbortCode code, Instant now, can::TransmitQueue& queue) {
  const bool frame_lost = code == AbortCode::timeout || code == AbortCode::toggle_bit ||
                          code == AbortCode::sequence_number || code == AbortCode::crc;
  if (!frame_lost || options_.repeats == 0 || may_have_taken_effect() || !restart_streams()) {
    finish(code);
    return;
  }
  --options_.repeats;
  block_wake_ = kNever;
  start(now, queue);
}

// For a segmented or block write: all data was sent, as far as known here.
bool Client::may_have_taken_effect() const {
  const bool in_segments = state_ == State::download_segment || state_ == State::block_download ||
                           state_ == State::block_download_end;
  return writing_ && in_segments && source_.at_end();
}

bool Client::may_be_carried_out() const {
  return busy() && writing_ && (sent_before_ || has_sent_value());
}

// Of the current attempt. Precondition: it is a write.
bool Client::has_sent_value() const {
  switch (state_) {
    case State::download_initiate:  // an empty value is sent as a segment
      return !held_ && outbox_.empty() && source_.at_end() && source_.size() != 0U;
    case State::download_segment:
      return outbox_.empty() && source_.at_end();
    case State::block_download_end:
      return outbox_.empty();
    default:
      return false;
  }
}

bool Client::restart_streams() {
  return writing_ ? source_.restart() : into_ == nullptr || into_->rewind();
}

void Client::finish(AbortCode code) {
  LINEGATE_ASSERT(!outcome_, "a transfer ends once");
  Outcome outcome{.abort = code, .data = {}};
  source_.close(code);
  sink_.cancel(code);
  if (code == AbortCode::none && !writing_) {
    outcome.data = sink_.take();
  }
  // Another device may answer next time.
  blocks_refused_ = blocks_refused_ && code != AbortCode::timeout;
  outcome_ = std::move(outcome);
  state_ = State::idle;
  deadline_ = kNever;
  block_wake_ = kNever;
}

}  // namespace linegate::sdo
