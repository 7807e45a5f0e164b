// SPDX-License-Identifier: Apache-2.0
// The client's side of SDO transfers with a device of transfer_device.h.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "stack/can/cob_id.h"
#include "stack/can/transmit_queue.h"
#include "stack/sdo/client.h"

#include "tests/bench/measure.h"
#include "tests/bench/transfer_device.h"

namespace linegate::bench {

enum class TransferKind : std::uint8_t {
  expedited_upload,
  segmented_upload,
  segmented_download,
  block_upload,
  block_download
};

constexpr bool is_download(TransferKind kind) {
  return kind == TransferKind::segmented_download || kind == TransferKind::block_download;
}
constexpr bool uses_blocks(TransferKind kind) {
  return kind == TransferKind::block_upload || kind == TransferKind::block_download;
}

class TransferClient {
 public:
  // bytes: size of the DOMAIN that `domain` serves.
  TransferClient(can::CobId request, std::uint32_t bytes, const PatternDomain& domain)
      : client(request), bytes_(bytes), domain_(domain) {}

  void start(TransferKind kind, Instant now) {
    const sdo::TransferOptions options{.transfer = uses_blocks(kind) ? sdo::Transfer::block
                                                                     : sdo::Transfer::segmented};
    kind_ = kind;
    if (kind == TransferKind::expedited_upload) {
      client.read(kValue, kTimeout, now, queue);
    } else if (is_download(kind)) {
      source_.emplace(bytes_);
      client.write(kDomain, *source_, kTimeout, now, queue, options);
    } else {
      sink_.emplace(bytes_);
      client.read(kDomain, *sink_, kTimeout, now, queue, options);
    }
  }

  // Whether the transfer has ended. Ends the program if it has ended without all its bytes.
  bool ended() {
    const std::optional<sdo::Outcome> outcome = client.take();
    if (!outcome) {
      return false;
    }
    require(outcome->abort == AbortCode::none, "a transfer was aborted");
    if (kind_ != TransferKind::expedited_upload) {
      require(is_download(kind_) ? domain_.complete() : sink_->complete(),
              "the bytes differ from those that were sent");
    }
    return true;
  }

  sdo::Client client;
  can::TransmitQueue queue{16};

 private:
  static constexpr Duration kTimeout = std::chrono::milliseconds(500);

  std::uint32_t bytes_;
  const PatternDomain& domain_;
  TransferKind kind_ = TransferKind::expedited_upload;
  std::optional<PatternSource> source_;
  std::optional<PatternSink> sink_;
};

}  // namespace linegate::bench
