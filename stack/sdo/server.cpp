// SPDX-License-Identifier: Apache-2.0
#include "stack/sdo/server.h"

#include <algorithm>

#include "stack/base/assert.h"
#include "stack/sdo/object_access.h"
#include "stack/sdo/protocol.h"

namespace linegate::sdo {
namespace {

// A value of 1 to 4 bytes in the layout of bytes 4..7 of a frame.
std::uint32_t expedited_data(std::span<const std::byte> value) {
  const std::byte* p = value.data();
  switch (value.size()) {
    case 4:
      return load_le<std::uint32_t>(p);
    case 2:
      return load_le<std::uint16_t>(p);
    case 1:
      return std::to_integer<std::uint32_t>(*p);
    default:
      return static_cast<std::uint32_t>(load_le(value));
  }
}

// The size of a value whose expedited download indicates none.
std::size_t unannounced_size(const od::Dictionary& dictionary, od::Address address) {
  const auto variable = dictionary.find(address);
  return variable ? std::min(kExpeditedSize, std::size_t{variable->capacity}) : kExpeditedSize;
}

}  // namespace

Server::Server(od::Dictionary& dictionary, can::CobId request, can::CobId response,
               EventLog& events, ServerOptions options)
    : dictionary_(dictionary),
      events_(events),
      options_(options),
      request_(request),
      outbox_(response) {
}

// --- the most frequent request: an expedited upload ---------------------------------------------

inline bool Server::answer_value(std::uint64_t request, std::span<const std::byte> value,
                                 Instant now, std::uint64_t& reply) {
  if (value.empty() || value.size() > kExpeditedSize) {
    return initiate_segmented_upload(request, value, Awaited::upload, now, reply);
  }
  ++counters_.uploads;
  reply = initiate_word(expedited_byte(ServerCommand::upload_initiate, value.size()),
                        multiplexer(request), expedited_data(value));
  return true;
}

inline bool Server::initiate_upload(std::uint64_t request, Instant now, std::uint64_t& reply) {
  drop();
  const od::Address address = multiplexer(request);
  const Result<std::span<const std::byte>> value = dictionary_.read(address, ticket_);
  if (!value.ok()) {
    return refuse_or_wait(address, static_cast<AbortCode>(value.error().code), Awaited::upload,
                          request, now, reply);
  }
  return answer_value(request, *value, now, reply);
}

inline bool Server::serve_request(std::uint64_t request, Instant now, std::uint64_t& reply) {
  if (in_block()) [[unlikely]] {
    return serve_block(request, now, reply);
  }
  const auto command = static_cast<std::uint8_t>(request);
  switch (static_cast<ClientCommand>(specifier(command))) {
    case ClientCommand::upload_initiate:
      return initiate_upload(request, now, reply);
    case ClientCommand::download_initiate:
      return initiate_download(request, now, reply);
    case ClientCommand::upload_segment:
      return upload_segment(request, now, reply);
    case ClientCommand::download_segment:
      return download_segment(request, now, reply);
    case ClientCommand::abort:
      drop();
      return false;
    case ClientCommand::block_upload:
    case ClientCommand::block_download:
      return initiate_block(request, now, reply);
  }
  return serve_unknown(request, now, reply);
}

// Command specifier 7.
bool Server::serve_unknown(std::uint64_t request, Instant now, std::uint64_t& reply) {
  if (network_handler_ == nullptr) {
    reply = refuse(address_, AbortCode::command_specifier);
    return true;
  }
  drop();
  network_handler_->network_request(*this, request, now);
  return false;
}

void Server::divert(bool diverted) {
  LINEGATE_ASSERT(network_handler_ != nullptr || !diverted,
                  "a network handler receives the requests");
  drop();
  state_ = diverted ? State::diverted : State::idle;
}

bool Server::respond(std::uint64_t word, can::TransmitQueue& queue) const {
  if (!outbox_.ready(queue)) {
    return false;
  }
  outbox_.send_at_once(word, queue);
  return true;
}

void Server::receive(const can::Frame& frame, can::TransmitQueue& queue) {
  if (!well_formed(frame)) [[unlikely]] {
    ++counters_.malformed;
    report_malformed(frame, 0, events_);
    return;
  }
  if (answer_at_once(word_of(frame), queue)) {
    return;
  }
  if (in_block() && acknowledges_waiting_segments(word_of(frame), queue)) [[unlikely]] {
    return;
  }
  std::uint64_t reply = 0;
  if (serve_request(word_of(frame), frame.time, reply)) {
    outbox_.send(reply, frame.time, queue);
  }
  if (in_block()) [[unlikely]] {
    send_segments(frame.time, queue);
  }
}

void Server::advance(Instant now, can::TransmitQueue& queue) {
  if (answered()) {
    resume(now, queue);
  } else if (now >= deadline_) {
    outbox_.send(refuse_block(AbortCode::timeout, now), now, queue);
  }
  if (now >= outbox_.next_wake()) {
    outbox_.flush(now, queue);
  }
  if (now >= block_wake_) {
    advance_block(now, queue);
  }
}

Instant Server::next_wake() const {
  if (answered()) [[unlikely]] {
    return Instant{};  // at once
  }
  return earlier(earlier(deadline_, block_wake_), outbox_.next_wake());
}

bool Server::answer(const can::Frame& in, can::Frame& out) {
  std::uint64_t reply = 0;
  if (!serve_request(word_of(in), in.time, reply)) {
    return false;
  }
  set_header(out, outbox_.cob_id());
  store_le(out.data.data(), reply);
  return true;
}

void Server::reset() {
  if (state_ == State::diverted) {
    state_ = State::idle;
    network_handler_->diverted_reset(*this);
  }
  const bool sub_block = state_ == State::block_download;
  const Instant heard = deadline_ - options_.timeout;
  drop();
  outbox_.clear();
  if (sub_block) {
    expect_late_segments(heard);
  }
}

void Server::configure(can::CobId request, can::CobId response) {
  reset();
  request_ = request;
  outbox_.set_cob_id(response);
}

// --- all other requests -------------------------------------------------------------------------

bool Server::serve(std::uint64_t request, Instant now, std::uint64_t& reply) {
  return serve_request(request, now, reply);
}

bool Server::answer_upload(std::uint64_t request, std::span<const std::byte> value, Instant now,
                           std::uint64_t& reply) {
  return answer_value(request, value, now, reply);
}

// An empty value is sent as one empty segment: an expedited initiate cannot encode 0 bytes.
bool Server::initiate_segmented_upload(std::uint64_t request, std::span<const std::byte> value,
                                       Awaited awaited, Instant now, std::uint64_t& reply) {
  const od::Address address = multiplexer(request);
  const AbortCode why = open_source(address, value);
  if (why != AbortCode::none) {
    return refuse_or_wait(address, why, awaited, request, now, reply);
  }
  begin(State::upload_segments, address, now);
  const std::optional<std::uint32_t> size = source_.size();
  reply = initiate_word(
      command_byte(ServerCommand::upload_initiate, size ? unsigned{kSizeIndicated} : 0U), address,
      size.value_or(0));
  return true;
}

AbortCode Server::open_source(od::Address address, std::span<const std::byte> value) {
  return open_upload(dictionary_, address, value, options_.max_transfer, source_, ticket_);
}

void Server::uploaded() {
  LINEGATE_ASSERT(source_.at_end(), "every byte was sent");
  ++counters_.uploads;
  source_.close(AbortCode::none);
  end();
}

void Server::close_streams(AbortCode why) {
  source_.close(why);
  sink_.cancel(why);
}

bool Server::upload_segment(std::uint64_t request, Instant now, std::uint64_t& reply) {
  const AbortCode why = check_segment(State::upload_segments, request);
  if (why != AbortCode::none) {
    reply = refuse(address_, why);
    return true;
  }
  Payload segment;
  const std::size_t size = source_.next(std::span(segment).subspan(1));
  if (source_.error() != AbortCode::none) {
    if (source_.error() == od::kLater) {
      ticket_ = dictionary_.put_off_source(address_);
    }
    return refuse_or_wait(address_, source_.error(), Awaited::upload_segment, request, now, reply);
  }
  source_.release();
  const bool last = source_.at_end();
  segment[0] = std::byte{segment_byte(ServerCommand::upload_segment, toggle_, size, last)};
  if (last) {
    uploaded();
  } else {
    proceed(now);
  }
  reply = load_le<std::uint64_t>(segment.data());
  return true;
}

bool Server::initiate_download(std::uint64_t request, Instant now, std::uint64_t& reply) {
  drop();
  const od::Address address = multiplexer(request);
  AbortCode why = AbortCode::none;
  Awaited awaited = Awaited::open_sink;
  if ((request & kExpedited) != 0) {
    why = expedited_download(request, address, awaited);
  } else {
    why = prepare_download(address, (request & kSizeIndicated) != 0
                                        ? std::optional(long_word(request))
                                        : std::nullopt);
    begin(State::download_segments, address, now);
  }
  if (why != AbortCode::none) {
    return refuse_or_wait(address, why, awaited, request, now, reply);
  }
  reply = initiate_word(command_byte(ServerCommand::download_initiate), address);
  return true;
}

AbortCode Server::expedited_download(std::uint64_t request, od::Address address, Awaited& awaited) {
  const auto command = static_cast<std::uint8_t>(request);
  const std::size_t size = (command & kSizeIndicated) != 0 ? expedited_size(command)
                                                           : unannounced_size(dictionary_, address);
  std::array<std::byte, kExpeditedSize> data;
  store_le(data.data(), long_word(request));
  const auto value = std::span<const std::byte>(data).first(size);
  const bool streams = dictionary_.streams(address);
  const AbortCode why =
      streams ? write_stream(address, value, awaited) : dictionary_.write(address, value, ticket_);
  if (why == AbortCode::none) {
    ++counters_.downloads;
  } else if (why == od::kLater && !streams) {
    awaited = Awaited::expedited_download;
    sink_.start(std::nullopt, kExpeditedSize, AbortCode::length_too_high);
    (void)sink_.append(value);
  }
  return why;
}

AbortCode Server::write_stream(od::Address address, std::span<const std::byte> value,
                               Awaited& awaited) {
  AbortCode why = prepare_download(address, static_cast<std::uint32_t>(value.size()));
  if (why == AbortCode::none) {
    why = sink_.append(value);
  }
  if (why == AbortCode::none) {
    address_ = address;
    awaited = Awaited::expedited_download;
    why = store();
  }
  return why;
}

AbortCode Server::prepare_download(od::Address address, std::optional<std::uint32_t> announced) {
  return open_download(dictionary_, address, announced, options_.max_transfer, sink_, ticket_);
}

bool Server::download_segment(std::uint64_t request, Instant now, std::uint64_t& reply) {
  AbortCode why = check_segment(State::download_segments, request);
  if (why != AbortCode::none) {
    reply = refuse(address_, why);
    return true;
  }
  Payload bytes;
  store_le(bytes.data(), request);
  const auto command = static_cast<std::uint8_t>(request);
  why = sink_.append(std::span(bytes).subspan(1, segment_size(command)));
  if (why != AbortCode::none) {
    if (why == od::kLater) {
      ticket_ = dictionary_.put_off_sink(address_);
    }
    return refuse_or_wait(address_, why, Awaited::download_segment, request, now, reply);
  }
  return segment_taken(request, now, reply);
}

bool Server::segment_taken(std::uint64_t request, Instant now, std::uint64_t& reply) {
  const bool last = (request & kLastSegment) != 0;
  const AbortCode why = last ? store() : AbortCode::none;
  if (why != AbortCode::none) {
    return refuse_or_wait(address_, why, Awaited::last_segment, request, now, reply);
  }
  reply = command_byte(ServerCommand::download_segment, toggle_ ? unsigned{kToggle} : 0U);
  if (last) {
    ++counters_.downloads;
    end();
  } else {
    proceed(now);
  }
  return true;
}

AbortCode Server::store() {
  return store_download(dictionary_, address_, sink_, ticket_);
}

AbortCode Server::check_segment(State wanted, std::uint64_t request) const {
  if (state_ != wanted) {
    return AbortCode::command_specifier;
  }
  const bool as_expected = toggle_of(static_cast<std::uint8_t>(request)) == toggle_;
  return as_expected ? AbortCode::none : AbortCode::toggle_bit;
}

std::uint64_t Server::refuse(od::Address address, AbortCode code) {
  give_up(code);
  return abort_word(address, code);
}

void Server::begin(State state, od::Address address, Instant now) {
  state_ = state;
  address_ = address;
  toggle_ = false;
  deadline_ = now + options_.timeout;
}

void Server::proceed(Instant now) {
  toggle_ = !toggle_;
  deadline_ = now + options_.timeout;
}

}  // namespace linegate::sdo
