// SPDX-License-Identifier: Apache-2.0
// The part of the answer model for transfers on a line of CANopen FD: a transfer is that of its
// session, whose frames are in order.
#include "tests/plant/answer_model.h"
#include "tests/plant/usdo_fields.h"

namespace linegate::plant {

namespace {

void append_usdo(std::vector<std::byte>& to, const can::Frame& frame) {
  const auto data = usdo_data(frame);
  to.insert(to.end(), data.begin(), data.end());
}

bool is_usdo_abort(const can::Frame& frame) {
  return usdo_command(frame) == kUsdoAbort || usdo_command(frame) == kUsdoLongAbort;
}

}  // namespace

void AnswerModel::usdo_request(const can::Frame& frame) {
  const std::uint8_t node = usdo_receiver(frame) & can::kMaxNodeId;
  Transfer& transfer = transfers_[node];
  const unsigned command = usdo_command(frame);
  if (command == kUsdoUpload || begins_usdo_download(frame)) {
    transfer = {.phase = Phase::initiated,
                .upload = command == kUsdoUpload,
                .session = usdo_session(frame),
                .address = usdo_object(frame),
                .value = {}};
    begun_[node] = commands_;
    if (command == kUsdoDownload) {
      append_usdo(transfer.value, frame);
      transfer.last = true;
      transfer.whole = true;
    }
    return;
  }
  if (usdo_session(frame) != transfer.session) {
    return;
  }
  if (is_usdo_abort(frame)) {
    transfer = {};
  } else if (transfer.phase == Phase::segments && command == kUsdoUploadSegment) {
    transfer.counter = usdo_counter(frame);
    transfer.awaits = true;
  } else if (transfer.phase == Phase::segments) {
    append_usdo(transfer.value, frame);
    transfer.last = command == kUsdoDownloadEnd;
    transfer.whole = transfer.last;
  }
}

void AnswerModel::usdo_response(const can::Frame& frame) {
  const auto node = static_cast<std::uint8_t>(frame.id - can::kSdoResponseBase);
  Transfer& transfer = transfers_[node];
  const bool is_ours = transfer.phase != Phase::idle &&
                       usdo_receiver(frame) == line_.config().node_id &&
                       usdo_session(frame) == transfer.session;
  if (!is_ours) {
    return;
  }
  const unsigned answered = usdo_command(frame) & ~kUsdoResponse;
  const bool is_first = transfer.phase == Phase::initiated;
  const bool fits = usdo_object(frame) == transfer.address;
  if (is_usdo_abort(frame)) {
    transfer = {};
  } else if (is_first && fits && answered == (transfer.upload ? kUsdoUpload : kUsdoDownload)) {
    if (transfer.upload) {
      append_usdo(transfer.value, frame);
    }
    end(node);
  } else if (is_first && fits &&
             answered == (transfer.upload ? kUsdoUploadInitiate : kUsdoDownloadInitiate)) {
    transfer.phase = Phase::segments;
  } else if (transfer.upload && transfer.awaits && answered == kUsdoUploadEnd) {
    append_usdo(transfer.value, frame);
    end(node);
  } else if (transfer.upload && transfer.awaits && answered == kUsdoUploadSegment &&
             usdo_counter(frame) == transfer.counter) {
    append_usdo(transfer.value, frame);
    transfer.awaits = false;
  } else if (transfer.last && answered == kUsdoDownloadEnd) {
    end(node);
  }
}

}  // namespace linegate::plant
