// SPDX-License-Identifier: Apache-2.0
// Assembles the USDO transfers between other nodes of a line of CANopen FD (stack/usdo/protocol.h)
// from the frames on the bus.
//
// As SdoFollower: a transfer is reported when the server has answered its last frame, or when
// either side has aborted it. One that began before, or of which a frame was missed, is not. A
// session-ID may be used again while the answer to the request before is still to come: an answer
// with the object of another request is ignored.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "stack/base/time.h"
#include "stack/can/frame.h"
#include "stack/observer/sdo_follower.h"
#include "stack/usdo/protocol.h"

namespace linegate::observer {

// A transfer with the node-ID of its server and its client.
struct UsdoTransfer {
  std::uint8_t server = 0;
  std::uint8_t client = 0;
  Transfer transfer;
};

class UsdoFollower {
 public:
  // A transfer without a frame for this time was abandoned by both sides.
  static constexpr Duration kPatience = std::chrono::seconds(10);
  // Transfers at a time; a further one replaces that without a frame for the longest time.
  static constexpr std::size_t kSessions = 64;

  // Process a frame of a client (600h + its node-ID) or of a server (580h + its node-ID), at
  // frame.time. Return the transfer that ends with it, if any. Frames that are no USDO frames have
  // no effect.
  std::optional<UsdoTransfer> request(std::uint8_t client, const can::Frame& frame);
  std::optional<UsdoTransfer> answer(std::uint8_t server, const can::Frame& frame);

  // A download that may have taken effect: its data was complete, and no answer was seen until its
  // client began another transfer in the session or of the object, or aborted it, until the server
  // aborted it without a reason, or for kPatience. Nothing if there is none: call it in a loop
  // after request() and answer(). decode doubts the object; ObserverLine uses what was confirmed,
  // as on a classical line, and does not call it.
  struct Unanswered {
    std::uint8_t server = 0;
    od::Address object;
  };
  std::optional<Unanswered> pop_unanswered();

  // The server is reset: it answers no request from before.
  void reset(std::uint8_t server);

  // The object of the session, for frames that do not name it.
  std::optional<od::Address> object_of(std::uint8_t client, std::uint8_t server,
                                       std::uint8_t session) const;

 private:
  enum class Phase : std::uint8_t {
    idle,
    written,    // a download that is complete: the last answer is expected
    download,   // initiate, or between an answer and the next segment
    upload,     // requested
    uploading,  // answered with a size: segments follow
  };
  struct Session {
    Phase phase = Phase::idle;
    std::uint8_t client = 0;
    std::uint8_t server = 0;
    std::uint8_t number = 0;      // session-ID
    std::uint8_t counter = 0;     // of the next segment
    bool segmented = false;       // a download in segments
    bool holes = false;           // a segment was missed
    bool doubted = false;         // as unanswered
    std::uint32_t announced = 0;  // bytes; 0 = unknown
    Transfer transfer;
    Instant heard_at{};
  };

  const Session* find(std::uint8_t client, std::uint8_t server, std::uint8_t number) const;
  Session* find(std::uint8_t client, std::uint8_t server, const can::Frame& frame);
  Session& begin(std::uint8_t client, const can::Frame& frame);
  void doubt(Session& session);
  static void keep(Session& session, std::span<const std::byte> bytes);
  static void keep_segment(Session& session, const can::Frame& frame);
  static std::optional<UsdoTransfer> end(Session& session);
  std::optional<UsdoTransfer> abort(Session& session, const can::Frame& frame, bool of_client);

  std::array<Session, kSessions> sessions_;
  std::array<Unanswered, kSessions> unanswered_;  // the first waiting_
  std::size_t waiting_ = 0;
};

}  // namespace linegate::observer
