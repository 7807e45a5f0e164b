// SPDX-License-Identifier: Apache-2.0
// A client channel to the server of one device, whatever the protocol: SDO (sdo/client.h), or USDO
// on a line of CANopen FD (stack/usdo).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/base/time.h"
#include "stack/can/frame.h"
#include "stack/can/transmit_queue.h"
#include "stack/od/description.h"
#include "stack/od/stream.h"
#include "stack/sdo/pace.h"

namespace linegate::sdo {

// Protocol of a transfer. If the server refuses a block initiate or does not answer it, the
// transfer continues in segments, unless the abort code concerns the object.
enum class Transfer : std::uint8_t {
  // Expedited up to 4 bytes, in blocks from TransferOptions::block_from on, else in segments. A
  // read begins in segments; when the server indicates such a size, it is aborted (0800 0000h) and
  // restarted in blocks.
  automatic,
  segmented,  // expedited up to 4 bytes, else in segments
  block,      // in blocks; for a read, the server may use segments for a few bytes
};

// Value of TransferOptions::block_from that disables block transfer.
inline constexpr std::uint32_t kNoBlocks = 0xFFFF'FFFF;

struct TransferOptions {
  Transfer transfer = Transfer::automatic;
  // How often a transfer is repeated that ended because a frame was lost: abort 0503 0000h, 0504
  // 0000h, 0504 0003h or 0504 0004h of either side. A write whose last segment was sent is not
  // repeated: it may have taken effect.
  unsigned repeats = 0;
  std::uint32_t block_from = 128;  // bytes, see Transfer::automatic; kNoBlocks: never
  // Bytes of an uploaded value. A longer one is aborted (0504 0005h), as soon as its size is
  // indicated or its first byte too many arrives. Uploads into a stream have no limit.
  std::uint32_t longest = 16 * 1024 * 1024;
};

// The result of a transfer.
struct Outcome {
  // none = success. The server's code, or the code that this client sent.
  AbortCode abort = AbortCode::none;
  // The uploaded value; empty after a download or an abort, and after an upload into a stream.
  std::vector<std::byte> data{};
  // The server sent the abort code for this transfer. Otherwise a frame was lost, or the answer
  // does not match the request.
  bool refused = false;
};

// Classification of a frame with the response identifier.
enum class Receipt : std::uint8_t {
  used,  // belongs to the current transfer (and may have ended it)
  // Expected, but not an answer to the current request: late, repeated, or for another client.
  stray,
  unasked,    // no request is open and no late answer is expected: an answer to another client
  malformed,  // not a frame of the protocol; not processed
  elsewhere,  // USDO: to another client, which may use the server at the same time
};

// One transfer at a time. For the meaning of the functions see Client.
class TransferClient {
 public:
  virtual ~TransferClient() = default;

  virtual void read(od::Address address, Duration timeout, Instant now, can::TransmitQueue& queue,
                    TransferOptions options) = 0;
  virtual void write(od::Address address, std::vector<std::byte> data, Duration timeout,
                     Instant now, can::TransmitQueue& queue, TransferOptions options) = 0;
  virtual void read(od::Address address, od::ByteSink& sink, Duration timeout, Instant now,
                    can::TransmitQueue& queue, TransferOptions options) = 0;
  virtual void write(od::Address address, od::ByteSource& source, Duration timeout, Instant now,
                     can::TransmitQueue& queue, TransferOptions options) = 0;
  virtual Receipt receive(const can::Frame& frame, can::TransmitQueue& queue) = 0;
  virtual void advance(Instant now, can::TransmitQueue& queue) = 0;
  virtual Instant next_wake() const = 0;
  virtual void abort(AbortCode code, Instant now, can::TransmitQueue& queue) = 0;
  virtual std::optional<Outcome> take() = 0;
  virtual bool may_be_carried_out() const = 0;
  virtual bool busy() const = 0;
  virtual bool waits_for_initiate() const = 0;
  virtual void expect_stray() = 0;
  virtual void set_pace(Pace* pace, std::uint32_t client) = 0;
  virtual void set_awaited(bool awaited) = 0;
  virtual void count_received(const can::Header& frame) const = 0;

 protected:
  TransferClient() = default;
  TransferClient(const TransferClient&) = default;
  TransferClient(TransferClient&&) = default;
  TransferClient& operator=(const TransferClient&) = default;
  TransferClient& operator=(TransferClient&&) = default;
};

// Makes the client channel to a node's default server.
using MakeClient = std::function<std::unique_ptr<TransferClient>(std::uint8_t node)>;

}  // namespace linegate::sdo
