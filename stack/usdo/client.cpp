// SPDX-License-Identifier: Apache-2.0
#include "stack/usdo/client.h"

#include <array>
#include <span>
#include <utility>

#include "stack/base/assert.h"
#include "stack/od/hook.h"

namespace linegate::usdo {

od::DataType type_of_length(std::size_t bytes) {
  switch (bytes) {
    case 1:
      return od::DataType::unsigned8;
    case 2:
      return od::DataType::unsigned16;
    case 4:
      return od::DataType::unsigned32;
    case 8:
      return od::DataType::unsigned64;
    default:
      return od::DataType::domain;
  }
}

Client::Client(std::uint8_t own, std::uint8_t server, AbortForm form)
    : own_(own), server_(server), form_(form) {
}

void Client::read(od::Address address, Duration timeout, Instant now, can::TransmitQueue& queue,
                  sdo::TransferOptions options) {
  queue_ = &queue;
  begin(address, false, nullptr, timeout, options);
  start(now);
}

void Client::read(od::Address address, od::ByteSink& sink, Duration timeout, Instant now,
                  can::TransmitQueue& queue, sdo::TransferOptions options) {
  queue_ = &queue;
  begin(address, false, &sink, timeout, options);
  start(now);
}

void Client::write(od::Address address, std::vector<std::byte> data, Duration timeout, Instant now,
                   can::TransmitQueue& queue, sdo::TransferOptions options) {
  queue_ = &queue;
  begin(address, true, nullptr, timeout, options);
  source_.start(std::move(data));
  start(now);
}

void Client::write(od::Address address, od::ByteSource& source, Duration timeout, Instant now,
                   can::TransmitQueue& queue, sdo::TransferOptions options) {
  queue_ = &queue;
  begin(address, true, nullptr, timeout, options);
  source_.start(source);
  start(now);
}

void Client::begin(od::Address address, bool write, od::ByteSink* into, Duration timeout,
                   sdo::TransferOptions options) {
  LINEGATE_ASSERT(!busy(), "the transfer before has ended");
  LINEGATE_ASSERT(timeout > Duration::zero(), "the time-out is positive");
  address_ = address;
  writing_ = write;
  into_ = into;
  if (into != nullptr) {
    sink_.start(std::nullopt, *into);  // the stream gets its end call in any case
  }
  timeout_ = timeout;
  options_ = options;
  outcome_.reset();
}

void Client::start(Instant now) {
  sent_before_ = may_be_carried_out();
  now_ = now;
  counter_ = 0;
  session_ = session_ == 0xFF ? std::uint8_t{1} : static_cast<std::uint8_t>(session_ + 1U);
  if (writing_) {
    initiate_download();
  } else {
    request(State::initiate, object_frame(route(), Command::upload, address_));
  }
}

void Client::initiate_download() {
  const std::optional<std::uint32_t> size = source_.size();
  if (!size || *size > kExpeditedData) {
    request(State::initiate, initiate_frame(route(), Command::download_initiate, address_,
                                            od::DataType::domain, size.value_or(0)));
    return;
  }
  std::array<std::byte, kExpeditedData> bytes;
  const auto value = std::span(bytes).first(*size);
  source_.next(value);
  if (source_.error() != AbortCode::none) {
    state_ = State::initiate;
    finish(od::never_later(source_.error()));
    return;
  }
  request(State::initiate, expedited_frame(route(), Command::download, address_,
                                           type_of_length(value.size()), value));
}

void Client::send_segment() {
  std::array<std::byte, kSegmentData> bytes;
  const std::size_t count = source_.next(bytes);
  source_.release();
  if (source_.error() != AbortCode::none) {
    give_up(od::never_later(source_.error()));
  } else if (source_.at_end()) {
    request(State::end, end_frame(route(), Command::download_end, std::span(bytes).first(count)));
  } else {
    LINEGATE_ASSERT(count == kSegmentData, "a source gives less only at its end");
    request(State::segment, segment_frame(route(), Command::download_segment, counter_, bytes));
  }
}

void Client::request(State state, const can::Frame& frame) {
  state_ = state;
  deadline_ = deadline(now_, timeout_);
  (void)outbox_.send(frame, now_, *queue_);
}

sdo::Receipt Client::receive(const can::Frame& frame, can::TransmitQueue& queue) {
  if (!well_formed(frame)) {
    return sdo::Receipt::malformed;
  }
  if (receiver_of(frame) != own_) {
    return sdo::Receipt::elsewhere;
  }
  if (!busy() || session_of(frame) != session_) {
    return sdo::Receipt::stray;
  }
  queue_ = &queue;
  now_ = frame.time;
  if (!has_fields(frame)) {
    give_up(is_known(command_of(frame)) ? Code::size : Code::command_specifier);
  } else if (is_abort(command_of(frame))) {
    finish_or_repeat(reason_of(frame), true);
  } else {
    answered(frame);
  }
  return sdo::Receipt::used;
}

void Client::answered(const can::Frame& frame) {
  switch (state_) {
    case State::initiate:
      initiate_answered(frame);
      return;
    case State::segment:
      segment_answered(frame);
      return;
    case State::end:
      if (command_of(frame) == Command::end_response) {
        source_.acknowledge();
        finish(AbortCode::none);
      } else {
        give_up(Code::command_specifier);
      }
      return;
    case State::idle:
      return;
  }
}

void Client::initiate_answered(const can::Frame& frame) {
  const Command command = command_of(frame);
  const bool segmented = writing_ && !(source_.size() && *source_.size() <= kExpeditedData);
  const bool expected =
      writing_ ? command == (segmented ? Command::initiate_response : Command::download_response)
               : command == Command::upload_response || command == Command::upload_initiate;
  if (!expected) {
    give_up(Code::command_specifier);
  } else if (address_of(frame) != address_) {
    give_up(AbortCode::parameter_incompatible);
  } else if (!writing_) {
    upload_initiated(frame);
  } else if (segmented) {
    send_segment();
  } else {
    finish(AbortCode::none);
  }
}

void Client::upload_initiated(const can::Frame& frame) {
  const bool expedited = command_of(frame) == Command::upload_response;
  const std::uint32_t size = expedited ? 0 : size_of(frame);
  const std::optional<std::uint32_t> announced = size != 0 ? std::optional(size) : std::nullopt;
  if (into_ != nullptr) {
    sink_.start(announced, *into_);
  } else if (size > kMaxUpload) {
    give_up(AbortCode::out_of_memory);
    return;
  } else {
    sink_.start(announced, kMaxUpload, AbortCode::out_of_memory);
  }
  if (expedited) {
    bytes_came(frame, true);
  } else {
    request(State::segment, counted_frame(route(), Command::upload_segment, counter_));
  }
}

void Client::segment_answered(const can::Frame& frame) {
  const Command command = command_of(frame);
  const bool counted =
      command == (writing_ ? Command::segment_response : Command::upload_segment_answer);
  if (!counted && (writing_ || command != Command::upload_end)) {
    give_up(Code::command_specifier);
  } else if (counted && counter_of(frame) != counter_) {
    give_up(Code::segment_counter);
  } else if (writing_) {
    source_.acknowledge();
    ++counter_;
    send_segment();
  } else {
    bytes_came(frame, !counted);
  }
}

void Client::bytes_came(const can::Frame& frame, bool last) {
  const auto data = data_of(frame);
  if (!data) {
    give_up(Code::size);
    return;
  }
  AbortCode why = sink_.append(*data);
  if (why == AbortCode::none && last) {
    why = sink_.finish();
  }
  if (why != AbortCode::none) {
    give_up(od::never_later(why));
  } else if (last) {
    finish(AbortCode::none);
  } else {
    ++counter_;
    request(State::segment, counted_frame(route(), Command::upload_segment, counter_));
  }
}

void Client::advance(Instant now, can::TransmitQueue& queue) {
  queue_ = &queue;
  now_ = now;
  if (outbox_.is_paced() && busy()) {
    deadline_ = deadline(now, timeout_);  // the server can not answer what was not sent yet
  }
  if (now >= deadline_) {
    give_up(AbortCode::timeout);
  }
  if (now >= outbox_.next_wake()) {
    outbox_.flush(now, queue);
  }
}

Instant Client::next_wake() const {
  return earlier(deadline_, outbox_.next_wake());
}

void Client::abort(AbortCode code, Instant now, can::TransmitQueue& queue) {
  if (busy()) {
    queue_ = &queue;
    now_ = now;
    outbox_.clear();
    (void)outbox_.send_urgent(abort_frame(route(), address_, code, form_), now, queue);
    finish(code);
  }
}

std::optional<sdo::Outcome> Client::take() {
  return std::exchange(outcome_, std::nullopt);
}

// An unsent request is discarded.
void Client::give_up(AbortCode why) {
  outbox_.clear();
  (void)outbox_.send_urgent(abort_frame(route(), address_, why, form_), now_, *queue_);
  finish_or_repeat(why);
}

void Client::give_up(Code why) {
  outbox_.clear();
  (void)outbox_.send_urgent(abort_frame(route(), address_, why, form_), now_, *queue_);
  finish_or_repeat(to_abort_code(why));
}

void Client::finish_or_repeat(AbortCode code, bool refused) {
  const bool frame_lost = code == AbortCode::timeout || code == AbortCode::sequence_number;
  const bool may_have_taken_effect = state_ == State::end;
  if (!frame_lost || options_.repeats == 0 || may_have_taken_effect ||
      !(writing_ ? source_.restart() : into_ == nullptr || into_->rewind())) {
    finish(code, refused);
    return;
  }
  --options_.repeats;
  start(now_);
}

void Client::finish(AbortCode code, bool refused) {
  LINEGATE_ASSERT(busy() && !outcome_, "a transfer ends once");
  sdo::Outcome outcome{.abort = code, .data = {}, .refused = refused};
  source_.close(code);
  sink_.cancel(code);
  if (code == AbortCode::none && !writing_) {
    outcome.data = sink_.take();
  }
  outcome_ = std::move(outcome);
  state_ = State::idle;
  deadline_ = kNever;
}

bool Client::may_be_carried_out() const {
  const bool whole = state_ == State::initiate && source_.size() && *source_.size() <= kExpeditedData;
  return busy() && writing_ && (sent_before_ || whole || state_ == State::end);
}

Route Client::route() const {
  return {can::kSdoRequestBase + own_, server_, session_};
}

}  // namespace linegate::usdo
