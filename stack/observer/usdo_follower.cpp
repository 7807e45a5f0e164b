// SPDX-License-Identifier: Apache-2.0
#include "stack/observer/usdo_follower.h"

#include <algorithm>
#include <utility>

namespace linegate::observer {

using usdo::Command;

const UsdoFollower::Session* UsdoFollower::find(std::uint8_t client, std::uint8_t server,
                                                std::uint8_t number) const {
  const auto found = std::ranges::find_if(sessions_, [&](const Session& each) {
    return each.phase != Phase::idle && each.client == client && each.server == server &&
           each.number == number;
  });
  return found == sessions_.end() ? nullptr : &*found;
}

UsdoFollower::Session* UsdoFollower::find(std::uint8_t client, std::uint8_t server,
                                          std::uint8_t number, Instant now) {
  const Session* const known = find(client, server, number);
  if (known == nullptr) {
    return nullptr;
  }
  Session& session = sessions_[static_cast<std::size_t>(known - sessions_.data())];
  if (now - session.heard_at > kPatience) {
    session.phase = Phase::idle;
    return nullptr;
  }
  session.heard_at = now;
  return &session;
}

// A client that begins a transfer has given up the one with the same session-ID.
UsdoFollower::Session& UsdoFollower::begin(std::uint8_t client, const can::Frame& frame) {
  const std::uint8_t server = usdo::receiver_of(frame);
  const std::uint8_t number = usdo::session_of(frame);
  const Session* place = find(client, server, number);
  if (place != nullptr && place->phase == Phase::written) {
    unanswered_ = Unanswered{server, place->transfer.address};
  }
  if (place == nullptr) {
    place = std::ranges::min_element(sessions_, [](const Session& a, const Session& b) {
      const bool idle = a.phase == Phase::idle;
      return idle != (b.phase == Phase::idle) ? idle : a.heard_at < b.heard_at;
    });
  }
  Session& session = sessions_[static_cast<std::size_t>(place - sessions_.data())];
  session = {.client = client,
             .server = server,
             .number = number,
             .transfer = {.address = usdo::address_of(frame)},
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

std::optional<UsdoTransfer> UsdoFollower::abort(Session* session, const can::Frame& frame) {
  if (session == nullptr) {
    return std::nullopt;
  }
  session->holes = false;
  session->transfer.aborted = true;
  session->transfer.abort = usdo::reason_of(frame);
  session->transfer.size = 0;
  return end(*session);
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
  Session* const session =
      find(client, usdo::receiver_of(frame), usdo::session_of(frame), frame.time);
  if (usdo::is_abort(command)) {
    return abort(session, frame);
  }
  if (session == nullptr || session->phase != Phase::download) {
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
  Session* const session =
      find(usdo::receiver_of(frame), server, usdo::session_of(frame), frame.time);
  if (usdo::is_abort(command)) {
    return abort(session, frame);
  }
  if (session == nullptr) {
    return std::nullopt;
  }
  const auto data = usdo::data_of(frame);
  switch (command) {
    case Command::download_response:
    case Command::end_response:
      return session->phase == Phase::written ? end(*session) : std::nullopt;
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
  return std::exchange(unanswered_, std::nullopt);
}

std::optional<od::Address> UsdoFollower::object_of(std::uint8_t client, std::uint8_t server,
                                                   std::uint8_t session) const {
  const Session* const known = find(client, server, session);
  return known == nullptr ? std::nullopt : std::optional(known->transfer.address);
}

}  // namespace linegate::observer
