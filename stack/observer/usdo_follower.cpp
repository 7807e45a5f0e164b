// SPDX-License-Identifier: Apache-2.0
#include "stack/observer/usdo_follower.h"

#include <algorithm>
#include <utility>

namespace linegate::observer {

using usdo::Command;

namespace {

bool names_object(Command command) {
  switch (command) {
    case Command::download_response:
    case Command::initiate_response:
    case Command::upload_response:
    case Command::upload_initiate:
    case Command::abort:
    case Command::long_abort:
      return true;
    default:
      return false;
  }
}

// A server's abort that is no refusal: the download may yet be carried out.
bool says_nothing(const can::Frame& frame) {
  return usdo::command_of(frame) == Command::abort &&
         usdo::byte_of(frame, 6) == static_cast<std::uint8_t>(usdo::Code::cannot_transfer);
}

}  // namespace

const UsdoFollower::Session* UsdoFollower::find(std::uint8_t client, std::uint8_t server,
                                                std::uint8_t number) const {
  const auto found = std::ranges::find_if(sessions_, [&](const Session& each) {
    return each.phase != Phase::idle && each.client == client && each.server == server &&
           each.number == number;
  });
  return found == sessions_.end() ? nullptr : &*found;
}

// The session of a frame, unless the frame is of another request: of those that name an object,
// only a server's abort without its session names none.
UsdoFollower::Session* UsdoFollower::find(std::uint8_t client, std::uint8_t server,
                                          const can::Frame& frame) {
  const Session* const known = find(client, server, usdo::session_of(frame));
  if (known == nullptr) {
    return nullptr;
  }
  Session& session = sessions_[static_cast<std::size_t>(known - sessions_.data())];
  if (frame.time - session.heard_at > kPatience) {
    doubt(session);
    session.phase = Phase::idle;
    return nullptr;
  }
  const Command command = usdo::command_of(frame);
  const od::Address named = usdo::address_of(frame);
  const bool is_any = usdo::is_abort(command) && named == od::Address{};
  if (names_object(command) && !is_any && named != session.transfer.address) {
    return nullptr;
  }
  session.heard_at = frame.time;
  return &session;
}

void UsdoFollower::doubt(Session& session) {
  if (session.phase == Phase::written && !std::exchange(session.doubted, true) &&
      waiting_ < unanswered_.size()) {
    unanswered_[waiting_++] = {session.server, session.transfer.address};
  }
}

// A client that begins a transfer has given up the one with the same session-ID, and one of the
// same object.
UsdoFollower::Session& UsdoFollower::begin(std::uint8_t client, const can::Frame& frame) {
  const std::uint8_t server = usdo::receiver_of(frame);
  const std::uint8_t number = usdo::session_of(frame);
  const od::Address object = usdo::address_of(frame);
  for (Session& session : sessions_) {
    const bool is_old = frame.time - session.heard_at > kPatience;
    const bool is_same = session.client == client && session.server == server &&
                         (session.number == number || session.transfer.address == object);
    if (is_old || is_same) {
      doubt(session);
    }
    session.phase = is_old ? Phase::idle : session.phase;
  }
  const Session* place = find(client, server, number);
  if (place == nullptr) {
    place = std::ranges::min_element(sessions_, [](const Session& a, const Session& b) {
      const bool idle = a.phase == Phase::idle;
      return idle != (b.phase == Phase::idle) ? idle : a.heard_at < b.heard_at;
    });
  }
  Session& session = sessions_[static_cast<std::size_t>(place - sessions_.data())];
  doubt(session);
  session = {.client = client,
             .server = server,
             .number = number,
             .transfer = {.address = object},
             .heard_at = frame.time};
  return session;
}

void UsdoFollower::keep(Session& session, std::span<const std::byte> bytes) {
  Transfer& transfer = session.transfer;
  if (transfer.size < Transfer::kKept) {
    const auto at = static_cast<std::size_t>(transfer.size);
    std::ranges::copy(bytes.first(std::min(bytes.size(), Transfer::kKept - at)),
                      transfer.data.begin() + static_cast<std::ptrdiff_t>(at));
  }
  transfer.size += bytes.size();
}

// A segment that is repeated has the counter before; any other counter shows that one was missed.
void UsdoFollower::keep_segment(Session& session, const can::Frame& frame) {
  const std::uint8_t counter = usdo::counter_of(frame);
  if (session.transfer.size > 0 && counter == static_cast<std::uint8_t>(session.counter - 1)) {
    return;
  }
  session.holes |= counter != session.counter;
  session.counter = static_cast<std::uint8_t>(counter + 1);
  if (const auto data = usdo::data_of(frame)) {
    keep(session, *data);
  }
}

std::optional<UsdoTransfer> UsdoFollower::end(Session& session) {
  session.phase = Phase::idle;
  const bool is_whole = session.announced == 0 || session.announced == session.transfer.size;
  if (session.holes || (!is_whole && !session.transfer.aborted)) {
    return std::nullopt;
  }
  return UsdoTransfer{session.server, session.client, session.transfer};
}

std::optional<UsdoTransfer> UsdoFollower::abort(Session& session, const can::Frame& frame,
                                                bool of_client) {
  if (of_client || says_nothing(frame)) {
    doubt(session);
  }
  session.holes = false;
  session.transfer.aborted = true;
  session.transfer.abort = usdo::reason_of(frame);
  session.transfer.size = 0;
  return end(session);
}

std::optional<UsdoTransfer> UsdoFollower::request(std::uint8_t client, const can::Frame& frame) {
  if (!usdo::well_formed(frame) || !usdo::has_fields(frame)) {
    return std::nullopt;
  }
  const Command command = usdo::command_of(frame);
  const auto data = usdo::data_of(frame);
  switch (command) {
    case Command::download:
      if (data) {
        Session& session = begin(client, frame);
        session.phase = Phase::written;
        session.transfer.download = true;
        keep(session, *data);
      }
      return std::nullopt;
    case Command::download_initiate: {
      Session& session = begin(client, frame);
      session.phase = Phase::download;
      session.segmented = true;
      session.transfer.download = true;
      session.announced = usdo::size_of(frame);
      return std::nullopt;
    }
    case Command::upload:
      begin(client, frame).phase = Phase::upload;
      return std::nullopt;
    default:
      break;
  }
  Session* const session = find(client, usdo::receiver_of(frame), frame);
  if (session == nullptr) {
    return std::nullopt;
  }
  if (usdo::is_abort(command)) {
    return abort(*session, frame, true);
  }
  if (session->phase != Phase::download) {
    return std::nullopt;
  }
  if (command == Command::download_segment) {
    keep_segment(*session, frame);
  } else if (command == Command::download_end && data) {
    keep(*session, *data);
    session->phase = Phase::written;
  }
  return std::nullopt;
}

std::optional<UsdoTransfer> UsdoFollower::answer(std::uint8_t server, const can::Frame& frame) {
  if (!usdo::well_formed(frame) || !usdo::has_fields(frame)) {
    return std::nullopt;
  }
  const Command command = usdo::command_of(frame);
  Session* const session = find(usdo::receiver_of(frame), server, frame);
  if (session == nullptr) {
    return std::nullopt;
  }
  if (usdo::is_abort(command)) {
    return abort(*session, frame, false);
  }
  const auto data = usdo::data_of(frame);
  switch (command) {
    case Command::download_response:
    case Command::end_response:
      if (session->phase == Phase::written &&
          session->segmented == (command == Command::end_response)) {
        return end(*session);
      }
      break;
    case Command::upload_response:
      if (session->phase == Phase::upload && data) {
        keep(*session, *data);
        return end(*session);
      }
      break;
    case Command::upload_initiate:
      if (session->phase == Phase::upload) {
        session->phase = Phase::uploading;
        session->announced = usdo::size_of(frame);
      }
      break;
    case Command::upload_segment_answer:
      if (session->phase == Phase::uploading) {
        keep_segment(*session, frame);
      }
      break;
    case Command::upload_end:
      if (session->phase == Phase::uploading && data) {
        keep(*session, *data);
        return end(*session);
      }
      break;
    default:
      break;
  }
  return std::nullopt;
}

void UsdoFollower::reset(std::uint8_t server) {
  for (Session& session : sessions_) {
    if (session.server == server) {
      session.phase = Phase::idle;
    }
  }
}

std::optional<UsdoFollower::Unanswered> UsdoFollower::pop_unanswered() {
  return waiting_ == 0 ? std::nullopt : std::optional(unanswered_[--waiting_]);
}

std::optional<od::Address> UsdoFollower::object_of(std::uint8_t client, std::uint8_t server,
                                                   std::uint8_t session) const {
  const Session* const known = find(client, server, session);
  return known == nullptr ? std::nullopt : std::optional(known->transfer.address);
}

}  // namespace linegate::observer
