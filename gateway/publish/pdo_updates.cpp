// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/pdo_updates.h"

namespace linegate::gateway {

void PdoUpdates::add(const image::Snapshot& snapshot) {
  for (const image::PdoMark& mark : snapshot.marks) {
    if (image::is_srdo(mark.remote_pdo)) {
      continue;  // PdoUpdate has no validity
    }
    if (mark.local_pdo >= by_local_pdo_.size()) {
      by_local_pdo_.resize(std::size_t{mark.local_pdo} + 1, kNone);
    }
    std::size_t& index = by_local_pdo_[mark.local_pdo];
    if (index == kNone) {
      index = pdos_.size();
      pdos_.emplace_back();
    }
    Pdo& pdo = pdos_[index];
    if (pdo.receptions == 0) {
      waiting_.push_back(index);
    }
    pdo.receptions += mark.count;
    pdo.mark = mark;
  }
}

}  // namespace linegate::gateway
