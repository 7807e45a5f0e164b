// SPDX-License-Identifier: Apache-2.0
// RPDOs received by an NMT master before Operational: see Engine::keep_early().
#include "stack/pdo/engine_impl.h"

namespace linegate::pdo {

void Engine::keep_early(bool keep) {
  impl_->keeps_early = keep;
  if (!keep && !impl_->operational) {
    impl_->shadows.clear();
  }
}

// Problems of a frame are reported only in Operational.
void Engine::Impl::receive_early(std::uint16_t slot, const can::Frame& frame) {
  const RpdoDetails& pdo = details[slot];
  const std::size_t mapped = pdo.plan.bytes();
  const std::size_t expected = frame.fd() ? can::fd_length(mapped) : mapped;
  if (keeps_early && pdo.mpdo == MpdoMode::none && frame.length == expected) {
    keep(slot, frame);
  }
}

// The deadline starts at the entry into Operational: the kept frame may be old.
void Engine::Impl::process_early() {
  for (std::size_t place = 0; place < shadows.size(); ++place) {
    const Shadow early = shadows[place];  // a copy: the listener may change PDOs
    if (early.frames == 0 || is_synchronous(details[early.slot].type)) {
      continue;
    }
    shadows.remove(early.slot);
    commit(early);
    if (early.slot < details.size() && details[early.slot].deadline > Duration::zero()) {
      timers.set(early.slot, latest + details[early.slot].deadline);
    }
  }
}

}  // namespace linegate::pdo
