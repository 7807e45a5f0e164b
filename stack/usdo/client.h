// SPDX-License-Identifier: Apache-2.0
// One USDO client channel (CiA 1301): one transfer at a time with one server; expedited up to 56
// bytes, segmented above.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/base/time.h"
#include "stack/can/frame.h"
#include "stack/can/transmit_queue.h"
#include "stack/od/data_type.h"
#include "stack/od/description.h"
#include "stack/sdo/requests_under_way.h"
#include "stack/sdo/transfer.h"
#include "stack/sdo/transfer_client.h"
#include "stack/usdo/outbox.h"
#include "stack/usdo/protocol.h"

namespace linegate::usdo {

// The data type that a download indicates if none is known: UNSIGNED8, 16, 32 or 64 by the length,
// DOMAIN for others. OWN: the published documents do not say what a server compares it with.
od::DataType type_of_length(std::size_t bytes);

class Client final : public sdo::TransferClient {
 public:
  // Interval of checks whether frames of an earlier transfer are still under way.
  static constexpr Duration kLookAgain = std::chrono::milliseconds(10);

  // own, server: node-IDs.
  Client(std::uint8_t own, std::uint8_t server, AbortForm form = AbortForm::one_byte);

  // under_way, which must outlive the client, states which requests were acknowledged on the bus.
  // The first request of a transfer waits until no frame of a transfer that timed out or was
  // aborted here is under way: when a bus without another node returns, it carries at most one
  // request to each server that is not awaited any more.
  void follow(const sdo::RequestsUnderWay& under_way) { under_way_ = &under_way; }

  // Of TransferOptions only `repeats` and `longest` matter. A transfer is repeated if a frame was
  // lost: after a time-out, after an abort for a wrong segment counter, and if the server does not
  // know the session of a segment. A download is not if it may have taken effect: its end was sent,
  // or its only frame with more than 4 bytes.
  void read(od::Address address, Duration timeout, Instant now, can::TransmitQueue& queue,
            sdo::TransferOptions options) override;
  void write(od::Address address, std::vector<std::byte> data, Duration timeout, Instant now,
             can::TransmitQueue& queue, sdo::TransferOptions options) override;
  void read(od::Address address, od::ByteSink& sink, Duration timeout, Instant now,
            can::TransmitQueue& queue, sdo::TransferOptions options) override;
  void write(od::Address address, od::ByteSource& source, Duration timeout, Instant now,
             can::TransmitQueue& queue, sdo::TransferOptions options) override;

  // Processes a frame with the identifier 580h + node-ID of the server; frame.time is the current
  // time. Every transfer, and every repetition, has a new session-ID, so that a late answer is
  // never taken for that of the present request: it is a stray. Errors of the server end the
  // transfer with an abort: 13h another answer, 14h segment counter, 15h a frame without all of its
  // fields or bytes, 37h or 38h more or fewer bytes than indicated; 60h another object.
  sdo::Receipt receive(const can::Frame& frame, can::TransmitQueue& queue) override;
  void advance(Instant now, can::TransmitQueue& queue) override;
  Instant next_wake() const override;
  void abort(AbortCode code, Instant now, can::TransmitQueue& queue) override;
  std::optional<sdo::Outcome> take() override;
  bool may_be_carried_out() const override;
  bool busy() const override { return state_ != State::idle; }
  bool waits_for_initiate() const override { return state_ == State::initiate; }
  void expect_stray() override {}  // its session-ID shows a stray
  void set_pace(sdo::Pace* pace, std::uint32_t client) override { outbox_.set_pace(pace, client); }
  void set_awaited(bool awaited) override { outbox_.set_awaited(awaited); }
  void count_received(const can::Header& frame) const override { outbox_.count(frame); }

 private:
  enum class State : std::uint8_t {
    idle,
    initiate,  // each waits for the answer to that request
    segment,
    end,  // of a download
  };

  void begin(od::Address address, bool write, od::ByteSink* into, Duration timeout,
             sdo::TransferOptions options);
  void start(Instant now);
  void initiate_download();
  void send_segment();
  void request(State state, const can::Frame& frame);
  bool is_of_server(const can::Frame& frame) const;
  bool is_under_way() const;
  bool drop_request();
  void look_at_held();
  void aborted_by_server(const can::Frame& frame);
  bool is_expedited_download() const;
  bool may_have_taken_effect() const;
  void answered(const can::Frame& frame);
  void initiate_answered(const can::Frame& frame);
  void upload_initiated(const can::Frame& frame);
  void segment_answered(const can::Frame& frame);
  void bytes_came(const can::Frame& frame, bool last);
  void end_at_server(const can::Frame& abort, bool looks_for_request);
  void give_up(AbortCode why);
  void give_up(Code why);
  void repeat_or_finish(AbortCode code, bool refused = false);
  void finish(AbortCode code, bool refused = false);
  Route route() const;

  std::uint8_t own_;
  std::uint8_t server_;
  AbortForm form_;
  State state_ = State::idle;
  std::uint8_t session_ = 0;
  std::uint8_t counter_ = 0;  // of the segment under way
  od::Address address_;
  bool writing_ = false;
  bool sent_before_ = false;      // an earlier attempt of this transfer sent the whole value
  bool unsent_ = false;           // the last request was not handed out, and is dropped
  od::ByteSink* into_ = nullptr;  // of an upload into a stream
  Duration timeout_{};
  sdo::TransferOptions options_;
  Instant deadline_ = kNever;
  sdo::Source source_;
  sdo::Sink sink_;
  FrameOutbox outbox_;
  std::optional<sdo::Outcome> outcome_;
  const sdo::RequestsUnderWay* under_way_ = nullptr;
  bool stale_ = false;                   // frames of an earlier transfer may be under way
  std::optional<can::Frame> held_;       // the first request, which waits for them
  Instant look_again_ = kNever;          // at them; only of a held request
  can::TransmitQueue* queue_ = nullptr;  // of the present call
  Instant now_{};                        // of the present call
};

}  // namespace linegate::usdo
