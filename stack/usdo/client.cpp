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

namespace {

// Aligned to a common time grid, so that all clients of a line share wake-ups.
Instant next_look(Instant now) {
  return now - now.time_since_epoch() % Client::kLookAgain + Client::kLookAgain;
}

bool is_loss(AbortCode code) {
  return code == AbortCode::timeout || code == AbortCode::sequence_number;
}

}  // namespace

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
  unsent_ = false;
  deadline_ = deadline(now_, timeout_);
  stale_ = stale_ && is_under_way();
  if (stale_ && state == State::initiate) {
    held_ = frame;
    look_again_ = next_look(now_);
    return;
  }
  (void)outbox_.send(frame, now_, *queue_);
}

// --- requests under way -------------------------------------------------------------------------

bool Client::is_of_server(const can::Frame& frame) const {
  return frame.id == can::kSdoRequestBase + own_ && frame.fd() && receiver_of(frame) == server_;
}

bool Client::is_under_way() const {
  const auto ours = [this](const can::Frame& frame) { return is_of_server(frame); };
  return !outbox_.empty() || queue_->any_of(can::TransmitClass::sdo, ours) ||
         (under_way_ != nullptr && under_way_->any(server_));
}

// Returns false if the last request was handed out.
bool Client::drop_request() {
  const bool held = std::exchange(held_, std::nullopt).has_value();
  look_again_ = kNever;
  const bool waited = !outbox_.empty();
  outbox_.clear();
  const bool queued = queue_->remove(can::TransmitClass::sdo, [this](const can::Frame& frame) {
    return is_of_server(frame) && session_of(frame) == session_;
  });
  return held || waited || queued;
}

void Client::look_at_held() {
  if (is_under_way()) {
    look_again_ = next_look(now_);
    return;
  }
  stale_ = false;
  look_again_ = kNever;
  deadline_ = deadline(now_, timeout_);
  (void)outbox_.send(*std::exchange(held_, std::nullopt), now_, *queue_);
}

// --- answers ------------------------------------------------------------------------------------

sdo::Receipt Client::receive(const can::Frame& frame, can::TransmitQueue& queue) {
  if (!well_formed(frame)) {
    return sdo::Receipt::malformed;
  }
  if (receiver_of(frame) != own_) {
    return sdo::Receipt::elsewhere;
  }
  if (!busy() || held_ || session_of(frame) != session_) {
    return sdo::Receipt::stray;
  }
  queue_ = &queue;
  now_ = frame.time;
  if (!has_fields(frame)) {
    give_up(is_known(command_of(frame)) ? Code::size : Code::command_specifier);
  } else if (is_abort(command_of(frame))) {
    aborted_by_server(frame);
  } else {
    answered(frame);
  }
  return sdo::Receipt::used;
}

void Client::aborted_by_server(const can::Frame& frame) {
  const AbortCode why = reason_of(frame);
  if (is_loss(why) || (state_ == State::segment && why == to_abort_code(Code::session))) {
    repeat_or_finish(why, true);  // without the session: it has given it up after a lost frame
  } else {
    finish(why, true);
  }
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
  const bool segmented = writing_ && !is_expedited_download();
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
  } else if (size > options_.longest) {
    give_up(AbortCode::out_of_memory);
    return;
  } else {
    sink_.start(announced, options_.longest, AbortCode::out_of_memory);
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
  if (held_ && now >= look_again_) {
    look_at_held();
  }
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
  return earlier(earlier(deadline_, look_again_), outbox_.next_wake());
}

void Client::abort(AbortCode code, Instant now, can::TransmitQueue& queue) {
  if (busy()) {
    queue_ = &queue;
    now_ = now;
    end_at_server(abort_frame(route(), address_, code, form_), true);
    finish(code);
  }
}

std::optional<sdo::Outcome> Client::take() {
  return std::exchange(outcome_, std::nullopt);
}

// A request that was not handed out is dropped, and no abort is sent for a transfer of which the
// server has received nothing.
void Client::end_at_server(const can::Frame& abort, bool looks_for_request) {
  unsent_ = drop_request();
  stale_ = stale_ || (looks_for_request && is_under_way());
  if (!unsent_ || state_ != State::initiate) {
    (void)outbox_.send_urgent(abort, now_, *queue_);
  }
}

void Client::give_up(AbortCode why) {
  end_at_server(abort_frame(route(), address_, why, form_), why == AbortCode::timeout);
  is_loss(why) ? repeat_or_finish(why) : finish(why);
}

void Client::give_up(Code why) {
  end_at_server(abort_frame(route(), address_, why, form_), false);
  is_loss(to_abort_code(why)) ? repeat_or_finish(to_abort_code(why)) : finish(to_abort_code(why));
}

bool Client::is_expedited_download() const {
  return writing_ && source_.size() && *source_.size() <= kExpeditedData;
}

bool Client::may_have_taken_effect() const {
  constexpr std::size_t kRepeated = 4;  // bytes; as the expedited download of an SDO client
  const bool whole = state_ == State::initiate && is_expedited_download();
  return !unsent_ && (state_ == State::end || (whole && *source_.size() > kRepeated));
}

// Of a lost frame.
void Client::repeat_or_finish(AbortCode code, bool refused) {
  if (options_.repeats == 0 || may_have_taken_effect() ||
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
  const bool has_sent = !held_ && !unsent_ && (is_expedited_download() || state_ == State::end);
  return busy() && writing_ && (sent_before_ || has_sent);
}

Route Client::route() const {
  return {can::kSdoRequestBase + own_, server_, session_};
}

}  // namespace linegate::usdo
