// SPDX-License-Identifier: Apache-2.0
// Remote frames: received ones that request a TPDO, and sent ones that request an RPDO from another
// node.
#include "stack/base/assert.h"
#include "stack/pdo/engine_impl.h"

namespace linegate::pdo {

void Engine::remote_request(std::uint16_t slot, Instant /*now*/) {
  if (!impl_->operational || slot >= impl_->tpdos.size()) {
    return;
  }
  const Tpdo& pdo = impl_->tpdos[slot];
  const bool rtr_allowed = (pdo.cob_id.raw & can::CobId::kNoRtrBit) == 0;
  if (!pdo.active || pdo.mpdo != MpdoMode::none || !rtr_allowed || impl_->held_back(slot)) {
    return;
  }
  // A TPDO sampled at SYNC is answered with the sample of the last SYNC; before the first SYNC a
  // new sample is taken.
  const bool at_sync = is_synchronous(pdo.type) || pdo.type == kRtrOnSync;
  if (!at_sync || !pdo.of_sync) {
    impl_->sample(slot);
  }
  impl_->pending.set(pdo.rank);
}

bool Engine::request_rpdo(std::uint16_t number) {
  const auto slot = static_cast<std::uint16_t>(number - 1U);
  if (!impl_->operational || number == 0 || number > impl_->details.size()) {
    return false;
  }
  const RpdoDetails& pdo = impl_->details[slot];
  const bool rtr_allowed =
      pdo.mpdo == MpdoMode::none && (pdo.cob_id.raw & can::CobId::kNoRtrBit) == 0;
  if (!pdo.active || !rtr_allowed || impl_->max_bytes > can::kMaxClassicData) {
    return false;
  }
  impl_->asked.set(slot);
  return true;
}

void Engine::drop_requests() {
  impl_->asked.clear_all();
}

// Sets out to the remote frame of highest priority, and returns the slot of its RPDO. Precondition:
// asked.any().
std::size_t Engine::Impl::first_remote_frame(can::Frame& out) const {
  LINEGATE_ASSERT_HOT(asked.any(), "a PDO is to be requested");
  std::size_t first = kNoRank;
  for_each_bit(asked.words(), [&](std::size_t slot) {
    const can::Frame frame = remote_frame(static_cast<std::uint16_t>(slot));
    if (first == kNoRank || can::wins_arbitration(frame, out)) {
      first = slot;
      out = frame;
    }
  });
  return first;
}

// Sends the remote frame if it has a higher priority than the TPDO of that rank.
bool Engine::Impl::next_remote_frame(can::Frame& out, std::size_t rank) {
  const std::size_t first = first_remote_frame(out);
  if (rank != kNoRank && can::wins_arbitration(tpdos[by_rank[rank]].frame, out)) {
    return false;
  }
  asked.clear(first);
  ++counters.asked;
  return true;
}

can::Frame Engine::Impl::remote_frame(std::uint16_t slot) const {
  const RpdoDetails& pdo = details[slot];
  can::Frame frame;
  frame.id = pdo.cob_id.id();
  frame.flags = can::Frame::kRemote;
  if (pdo.cob_id.extended()) {
    frame.flags |= can::Frame::kExtended;
  }
  frame.length = static_cast<std::uint8_t>(pdo.plan.bytes());
  return frame;
}

}  // namespace linegate::pdo
