// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/foreign_sdo.h"

#include <algorithm>

#include "stack/can/cob_id.h"

namespace linegate::plant {
namespace {

constexpr std::uint8_t kAbort = 0x80;
constexpr std::uint8_t kBlockEnd = 0xA1;

std::uint8_t command_of(const can::Frame& frame) {
  return std::to_integer<std::uint8_t>(frame.data[0]);
}

}  // namespace

can::Frame ForeignSdo::refusal(const can::Frame& request) const {
  can::Frame out = can::make_frame(can::kSdoResponseBase + node_, {kAbort, 0, 0, 0, 1, 0, 4, 5});
  std::copy_n(request.data.begin() + 1, 3, out.data.begin() + 1);
  return out;
}

ForeignSdo::Verdict ForeignSdo::receive(const can::Frame& frame) {
  if (frame.extended() || frame.remote() || frame.id != can::kSdoRequestBase + node_ ||
      frame.length != 8) {
    return {};
  }
  const std::uint8_t command = command_of(frame);
  const unsigned specifier = command >> 5U;
  if (command == kAbort || (open_ == Open::block_upload && command == kBlockEnd)) {
    open_ = Open::nothing;
    return {};
  }
  if (open_ == Open::upload && specifier != 3) {
    open_ = Open::nothing;
    return {.taken = true, .answer = refusal(frame), .abort_device = true};
  }
  if (open_ != Open::nothing || specifier < 5) {
    return {};
  }
  if (blocks_ == Blocks::served) {
    open_ = specifier == 5 ? Open::block_upload_initiate : Open::block_download;
    return {};
  }
  return {.taken = true,
          .answer = blocks_ == Blocks::refused ? std::optional(refusal(frame)) : std::nullopt};
}

void ForeignSdo::follow(const can::Frame& frame) {
  if (frame.id != can::kSdoResponseBase + node_ || frame.extended()) {
    return;
  }
  const std::uint8_t command = command_of(frame);
  const unsigned specifier = command >> 5U;
  const bool segments = specifier == 2 && (command & 2U) == 0;
  switch (open_) {
    case Open::block_download:
      open_ = command == kBlockEnd || command == kAbort ? Open::nothing : open_;
      return;
    case Open::block_upload_initiate:
      open_ = segments ? Open::upload : specifier == 6 ? Open::block_upload : Open::nothing;
      return;
    case Open::block_upload:
      open_ = command == kAbort ? Open::nothing : open_;
      return;
    case Open::upload:
      open_ = (specifier == 0 && (command & 1U) != 0) || command == kAbort ? Open::nothing : open_;
      return;
    case Open::nothing:
      open_ = segments ? Open::upload : open_;
      return;
  }
}

}  // namespace linegate::plant
