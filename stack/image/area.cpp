// SPDX-License-Identifier: Apache-2.0
#include "stack/image/area.h"

namespace linegate::image {

Area::Area(std::size_t byte_size, std::size_t pdos)
    : bytes_(byte_size + kSlackBytes),
      dirty_(byte_size + kSlackBytes),
      generations_((byte_size + kSlackBytes) / kBlockBytes + 1) {
  hot_.bytes = bytes_.data();
  hot_.dirty = dirty_.data();
  hot_.generations = generations_.data();
  grow_pdos(pdos);
}

void Area::grow_pdos(std::size_t count) {
  if (count > pdos_.size()) {
    pdos_.resize(count, PdoState{.attention = PdoState::kNotValid});
    touched_.resize((count + 63) / 64);
    hot_.pdos = pdos_.data();
    hot_.touched = touched_.data();
  }
}

}  // namespace linegate::image
