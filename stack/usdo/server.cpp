// SPDX-License-Identifier: Apache-2.0
#include "stack/usdo/server.h"

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <utility>

#include "stack/base/assert.h"
#include "stack/can/dispatch.h"
#include "stack/od/hook.h"
#include "stack/sdo/object_access.h"
#include "stack/sdo/transfer.h"

namespace linegate::usdo {
namespace {

constexpr std::uint32_t kNodeIdBits = 0x7F;

std::uint8_t client_of(const can::Frame& request) {
  return static_cast<std::uint8_t>(request.id & kNodeIdBits);
}

}  // namespace

// The access whose result a hook or a stream defers.
enum class Server::Awaited : std::uint8_t {
  nothing,
  upload,
  upload_segment,  // of a stream
  open_sink,       // at any initiate of a download
  piece,           // a segment or the end, of a stream
  store,           // from here on: storing the value
};

struct Server::Session {
  std::uint8_t client = 0;
  std::uint8_t number = 0;
  bool writing = false;
  std::uint8_t counter = 0;  // of the next segment
  od::Address address;
  Instant deadline = kNever;
  Awaited awaited = Awaited::nothing;
  od::Ticket ticket = 0;
  can::Frame request;  // whose answer is deferred
  sdo::Source source;
  sdo::Sink sink;
  // A hook or stream may reset the server: look at it after each call of the dictionary, a source
  // or a sink.
  bool removed = false;
};

Server::Server(od::Dictionary& dictionary, std::uint8_t node_id, EventLog& events,
               ServerOptions options)
    : dictionary_(dictionary), events_(events), options_(options), node_id_(node_id) {
}

Server::~Server() {
  reset();
}

void Server::receive(const can::Frame& frame, can::TransmitQueue& queue) {
  queue_ = &queue;
  now_ = frame.time;
  if (!well_formed(frame)) {
    ++counters_.malformed;
    events_.emit(can::malformed_event(frame, client_of(frame)));
    return;
  }
  if (receiver_of(frame) != node_id_) {
    return;
  }
  if (is_abort(command_of(frame))) {
    if (Session* const session = find(frame); session != nullptr) {
      ++counters_.aborts;
      drop(session, AbortCode::general);
    }  // never answered with another abort
  } else {
    ++calls_;
    serve(frame);
    --calls_;
  }
  forget_removed();
}

void Server::serve(const can::Frame& request) {
  if (session_of(request) == 0) {
    refuse(request, Code::session);
    return;
  }
  if (waits_for(request)) {  // the bus doubled it: it takes effect once
    return;
  }
  switch (command_of(request)) {
    case Command::upload:
    case Command::download:
    case Command::download_initiate:
      drop(find(request), AbortCode::general);  // replaced
      break;
    case Command::download_segment:
    case Command::download_end:
    case Command::upload_segment:
      serve_segment(request);
      return;
    default:
      refuse(request, Code::command_specifier);
      return;
  }
  if (!has_fields(request)) {
    refuse(request, Code::size);
    return;
  }
  drop_repeated(request);
  if (is_used_by_another(request)) {
    refuse(request, Code::device_state);
  } else if (command_of(request) == Command::upload) {
    upload(request);
  } else if (command_of(request) == Command::download) {
    download(request);
  } else {
    initiate_download(request);
  }
}

bool Server::waits_for(const can::Frame& request) const {
  const Session* const session = find(request);
  const auto content = [](const can::Frame& frame) {
    return std::span(frame.data).first(frame.length);
  };
  return session != nullptr && session->awaited != Awaited::nothing &&
         std::ranges::equal(content(session->request), content(request));
}

void Server::serve_segment(const can::Frame& request) {
  Session* const session = find(request);
  const bool writes = command_of(request) != Command::upload_segment;
  if (session == nullptr) {
    refuse(request, Code::session);
  } else if (session->awaited != Awaited::nothing || session->writing != writes) {
    refuse(request, Code::command_specifier);
  } else if (!has_fields(request)) {
    refuse(request, Code::size);
  } else if (command_of(request) != Command::download_end &&
             counter_of(request) != session->counter) {
    refuse(request, Code::segment_counter);
  } else if (writes) {
    download_piece(*session, request);
  } else {
    upload_segment(*session, request);
  }
}

// --- upload -------------------------------------------------------------------------------------

void Server::upload(const can::Frame& request) {
  od::Ticket ticket = 0;
  const Result<std::span<const std::byte>> value = dictionary_.read(address_of(request), ticket);
  if (value.ok()) {
    answer_upload(request, *value);
    return;
  }
  const auto why = static_cast<AbortCode>(value.error().code);
  Session* const session = why == od::kLater ? open(request) : nullptr;
  if (session == nullptr) {
    if (ticket != 0) {
      dictionary_.cancel(ticket);
    }
    refuse(request, why == od::kLater ? AbortCode::cannot_transfer : why);
    return;
  }
  session->ticket = ticket;
  refuse_or_wait(*session, why, Awaited::upload, request);
}

void Server::answer_upload(const can::Frame& request, std::span<const std::byte> value) {
  const od::Address address = address_of(request);
  const auto variable = dictionary_.find(address);
  // Sub-index FFh has no variable.
  const od::DataType type = variable ? variable->type : od::DataType::unsigned32;
  // An object with a stream has no bytes in the dictionary.
  if (!value.empty() && value.size() <= kExpeditedData) {
    ++counters_.uploads;
    send(expedited_frame(answer_route(request), Command::upload_response, address, type, value));
    return;
  }
  Session* const session = open(request);
  if (session == nullptr) {
    refuse(request, AbortCode::cannot_transfer);
    return;
  }
  const AbortCode why = sdo::open_upload(dictionary_, address, value, options_.max_transfer,
                                         session->source, session->ticket);
  if (is_gone(*session)) {
    return;
  }
  if (why != AbortCode::none) {
    refuse_or_wait(*session, why, Awaited::upload, request);
    return;
  }
  const std::optional<std::uint32_t> size = session->source.size();
  if (value.empty() && size == 0U) {
    ++counters_.uploads;
    session->source.close(AbortCode::none);
    remove(*session);
    send(expedited_frame(answer_route(request), Command::upload_response, address, type, {}));
    return;
  }
  send(initiate_frame(answer_route(request), Command::upload_initiate, address, type,
                      size.value_or(0)));
}

void Server::upload_segment(Session& session, const can::Frame& request) {
  std::array<std::byte, kSegmentData> bytes;
  const std::size_t count = session.source.next(bytes);
  if (is_gone(session)) {
    return;
  }
  if (const AbortCode why = session.source.error(); why != AbortCode::none) {
    session.ticket = why == od::kLater ? dictionary_.put_off_source(session.address) : 0;
    refuse_or_wait(session, why, Awaited::upload_segment, request);
    return;
  }
  session.source.release();
  const Route route = answer_route(request);
  if (session.source.at_end()) {
    ++counters_.uploads;
    session.source.close(AbortCode::none);
    remove(session);
    send(end_frame(route, Command::upload_end, std::span(bytes).first(count)));
    return;
  }
  LINEGATE_ASSERT(count == kSegmentData, "a source gives less only at its end");
  send(segment_frame(route, Command::upload_segment_answer, session.counter++, bytes));
  session.deadline = now_ + options_.timeout;
}

// --- download -----------------------------------------------------------------------------------

void Server::download(const can::Frame& request) {
  const auto data = data_of(request);
  if (!data) {
    refuse(request, Code::size);
    return;
  }
  const od::Address address = address_of(request);
  od::Ticket ticket = 0;
  if (!dictionary_.streams(address)) {
    const AbortCode why = dictionary_.write(address, *data, ticket);
    if (why == AbortCode::none) {
      ++counters_.downloads;
      send(object_frame(answer_route(request), Command::download_response, address));
      return;
    }
    if (why != od::kLater || ticket == 0) {
      refuse(request, od::never_later(why));
      return;
    }
  }
  Session* const session = open(request);
  if (session == nullptr) {
    if (ticket != 0) {
      dictionary_.cancel(ticket);
    }
    refuse(request, AbortCode::cannot_transfer);
    return;
  }
  session->writing = true;
  if (ticket != 0) {
    session->ticket = ticket;
    session->sink.start(std::nullopt, kExpeditedData, AbortCode::length_too_high);
    (void)session->sink.append(*data);
    wait(*session, Awaited::store, request);
    return;
  }
  const AbortCode why =
      sdo::open_download(dictionary_, address, static_cast<std::uint32_t>(data->size()),
                         options_.max_transfer, session->sink, session->ticket);
  if (is_gone(*session)) {
    return;
  }
  if (why != AbortCode::none) {
    refuse_or_wait(*session, why, Awaited::open_sink, request);
    return;
  }
  download_piece(*session, request);
}

void Server::initiate_download(const can::Frame& request) {
  Session* const session = open(request);
  if (session == nullptr) {
    refuse(request, AbortCode::cannot_transfer);
    return;
  }
  session->writing = true;
  const std::uint32_t size = size_of(request);
  const AbortCode why = sdo::open_download(dictionary_, session->address,
                                           size != 0 ? std::optional(size) : std::nullopt,
                                           options_.max_transfer, session->sink, session->ticket);
  if (is_gone(*session)) {
    return;
  }
  if (why != AbortCode::none) {
    refuse_or_wait(*session, why, Awaited::open_sink, request);
    return;
  }
  send(object_frame(answer_route(request), Command::initiate_response, session->address));
}

// A segment, an end, or the data of an expedited download into a stream.
void Server::download_piece(Session& session, const can::Frame& request) {
  const auto data = data_of(request);
  if (!data) {
    refuse(request, Code::size);
    return;
  }
  const AbortCode why = session.sink.append(*data);
  if (is_gone(session)) {
    return;
  }
  if (why != AbortCode::none) {
    session.ticket = why == od::kLater ? dictionary_.put_off_sink(session.address) : 0;
    refuse_or_wait(session, why, Awaited::piece, request);
    return;
  }
  piece_taken(session, request);
}

void Server::piece_taken(Session& session, const can::Frame& request) {
  if (command_of(request) == Command::download_segment) {
    send(counted_frame(answer_route(request), Command::segment_response, session.counter++));
    session.deadline = now_ + options_.timeout;
    return;
  }
  session.request = request;
  stored(session, sdo::store_download(dictionary_, session.address, session.sink, session.ticket));
}

void Server::stored(Session& session, AbortCode why) {
  if (is_gone(session)) {
    return;
  }
  const can::Frame request = session.request;
  if (why != AbortCode::none) {
    refuse_or_wait(session, why, Awaited::store, request);
    return;
  }
  ++counters_.downloads;
  const od::Address address = session.address;
  remove(session);
  const Route route = answer_route(request);
  send(command_of(request) == Command::download
           ? object_frame(route, Command::download_response, address)
           : plain_frame(route, Command::end_response));
}

// --- deferred results ---------------------------------------------------------------------------

void Server::refuse_or_wait(Session& session, AbortCode why, Awaited awaited,
                            const can::Frame& request) {
  if (why == od::kLater && session.ticket != 0) {
    wait(session, awaited, request);
  } else {
    refuse(request, od::never_later(why));
  }
}

void Server::wait(Session& session, Awaited awaited, const can::Frame& request) {
  session.awaited = awaited;
  session.request = request;
  session.deadline = now_ + options_.answer_timeout;
}

bool Server::answered(const Session& session) const {
  return session.ticket != 0 && dictionary_.outcome(session.ticket);
}

void Server::resume(Session& session) {
  const can::Frame request = session.request;
  const Awaited awaited = std::exchange(session.awaited, Awaited::nothing);
  if (awaited == Awaited::store) {
    finish_storing(session);
    return;
  }
  const od::Ticket ticket = std::exchange(session.ticket, 0);
  session.deadline = now_ + options_.timeout;
  if (awaited == Awaited::upload) {
    const Result<std::span<const std::byte>> value = dictionary_.finish_read(ticket);
    if (is_gone(session)) {
      return;
    }
    remove(session);
    if (value.ok()) {
      answer_upload(request, *value);
    } else {
      refuse(request, static_cast<AbortCode>(value.error().code));
    }
    return;
  }
  const AbortCode why = dictionary_.finish(ticket);
  if (is_gone(session)) {
    return;
  }
  if (why != AbortCode::none) {
    refuse(request, why);
  } else if (awaited == Awaited::upload_segment) {
    upload_segment(session, request);
  } else if (awaited == Awaited::piece) {
    piece_taken(session, request);
  } else {
    remove(session);
    serve(request);  // opens the sink now
  }
}

// A sink that received the last bytes may be busy with them, so that finish() had to wait.
void Server::finish_storing(Session& session) {
  const od::Ticket ticket = std::exchange(session.ticket, 0);
  AbortCode why = session.sink.streams() ? dictionary_.finish(ticket)
                                         : dictionary_.finish_write(ticket, session.sink.bytes());
  if (why == AbortCode::none && !is_gone(session) && session.sink.open()) {
    why = sdo::store_download(dictionary_, session.address, session.sink, session.ticket);
  }
  stored(session, why);
}

// --- sessions and time --------------------------------------------------------------------------

void Server::advance(Instant now, can::TransmitQueue& queue) {
  queue_ = &queue;
  now_ = now;
  ++calls_;
  // An answer ends its own session, or all of them.
  for (std::size_t i = sessions_.size(); i > 0; i = std::min(i, sessions_.size())) {
    Session& session = *sessions_[--i];
    if (answered(session)) {
      resume(session);
    } else if (now >= session.deadline) {
      const Route route{can::kSdoResponseBase + node_id_, session.client, session.number};
      const can::Frame abort =
          abort_frame(route, session.address, AbortCode::timeout, options_.abort_form);
      const bool unknown =
          session.awaited == Awaited::store && options_.abort_form == AbortForm::one_byte;
      ++counters_.aborts;
      drop(&session, AbortCode::timeout);
      if (!unknown) {
        send(abort);
      }
    }
  }
  --calls_;
  forget_removed();
  if (now >= outbox_.next_wake()) {
    outbox_.flush(now, queue);
  }
}

Instant Server::next_wake() const {
  Instant next = outbox_.next_wake();
  for (const auto& session : sessions_) {
    if (answered(*session)) {
      return Instant{};  // at once
    }
    next = earlier(next, session->deadline);
  }
  return next;
}

void Server::reset() {
  while (!sessions_.empty()) {
    drop(sessions_.back().get(), AbortCode::general);
  }
  outbox_.clear();
  forget_removed();
}

Route Server::answer_route(const can::Frame& request) const {
  return {can::kSdoResponseBase + node_id_, client_of(request), session_of(request)};
}

Server::Session* Server::find(const can::Frame& request) const {
  const auto found = std::ranges::find_if(sessions_, [&](const auto& session) {
    return session->client == client_of(request) && session->number == session_of(request);
  });
  return found == sessions_.end() ? nullptr : found->get();
}

// The client has begun the transfer anew, in another session: it has given the older one up.
void Server::drop_repeated(const can::Frame& request) {
  const auto older = std::ranges::find_if(sessions_, [&](const auto& session) {
    return session->client == client_of(request) && session->address == address_of(request);
  });
  if (older != sessions_.end()) {
    ++counters_.aborts;
    drop(older->get(), AbortCode::general);
  }
}

bool Server::is_used_by_another(const can::Frame& request) const {
  return std::ranges::any_of(
      sessions_, [&](const auto& session) { return session->address == address_of(request); });
}

// nullptr if there are too many sessions.
Server::Session* Server::open(const can::Frame& request) {
  if (sessions_.size() == kSessions) {
    return nullptr;
  }
  Session& session = *sessions_.emplace_back(std::make_unique<Session>());
  session.client = client_of(request);
  session.number = session_of(request);
  session.address = address_of(request);
  session.deadline = now_ + options_.timeout;
  return &session;
}

void Server::send(const can::Frame& frame) {
  (void)outbox_.send(frame, now_, *queue_);
}

void Server::refuse(const can::Frame& request, AbortCode why) {
  const od::Address address = object_of(request);
  drop(find(request), why);
  ++counters_.aborts;
  send(abort_frame(answer_route(request), address, why, options_.abort_form));
}

void Server::refuse(const can::Frame& request, Code why) {
  const od::Address address = object_of(request);
  drop(find(request), to_abort_code(why));
  ++counters_.aborts;
  send(abort_frame(answer_route(request), address, why, options_.abort_form));
}

// Of the transfer, or of an initiate; 0000h:00 if the request has none.
od::Address Server::object_of(const can::Frame& request) const {
  const Session* const session = find(request);
  if (session != nullptr) {
    return session->address;
  }
  const Command command = command_of(request);
  const bool initiates = command == Command::upload || command == Command::download ||
                         command == Command::download_initiate;
  return initiates && has_fields(request) ? address_of(request) : od::Address{};
}

// Ends a transfer with an error. No effect on nullptr.
void Server::drop(Session* session, AbortCode why) {
  if (session == nullptr) {
    return;
  }
  remove(*session);
  ++calls_;
  close(*session, why);
  --calls_;
}

void Server::close(Session& session, AbortCode why) {
  if (const od::Ticket ticket = std::exchange(session.ticket, 0); ticket != 0) {
    dictionary_.cancel(ticket);
  }
  session.source.close(why);
  session.sink.cancel(why);
}

// Whether the call before removed the session, with a reset. Closes what it has opened meanwhile.
bool Server::is_gone(Session& session) {
  if (session.removed) {
    close(session, AbortCode::general);
  }
  return session.removed;
}

// No effect if it was removed already.
void Server::remove(Session& session) {
  const auto place =
      std::ranges::find_if(sessions_, [&](const auto& each) { return each.get() == &session; });
  if (place != sessions_.end()) {
    session.removed = true;
    removed_.push_back(std::move(*place));
    sessions_.erase(place);
  }
}

void Server::forget_removed() {
  if (calls_ == 0) {
    removed_.clear();
  }
}

}  // namespace linegate::usdo
