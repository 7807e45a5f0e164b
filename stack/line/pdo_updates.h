// SPDX-License-Identifier: Apache-2.0
// PDOs whose values are written object by object: decides when such a PDO is requested (CANopenIA
// manual 5.1: the update timer). Private to stack/line.
#pragma once

#include <cstdint>
#include <vector>

#include "stack/base/time.h"
#include "stack/image/layout.h"

namespace linegate::line {

class PdoUpdates {
 public:
  // update_time: from the last write until the PDO is requested, so that several of its objects can
  // be written; 0 = at once.
  explicit PdoUpdates(Duration update_time) : update_time_(update_time) {}
  // From now on.
  void set_update_time(Duration update_time) { update_time_ = update_time; }

  // An output entry was written; its PDO has of_pdo entries. Restarts the update time of the PDO.
  // The PDO is due now if at_once, or if all its entries were written since it was due last.
  void written(const image::Entry& entry, std::uint32_t of_pdo, bool at_once, Instant now);
  struct Due {
    std::uint16_t pdo = 0;  // local number, 0 = none
    std::uint32_t bit_offset = 0;
    std::uint32_t bits = 0;  // from the first written bit to the last
  };
  // Returns one PDO that is due at `now` and must be requested.
  Due expire(Instant now);
  // The PDO was requested otherwise.
  void forget(std::uint16_t pdo);
  bool waits(std::uint16_t pdo) const;
  Instant next_wake() const;

 private:
  struct Waiting {
    std::uint16_t pdo = 0;
    Instant deadline{};
    std::uint32_t begin = 0;  // bit offset in the area
    std::uint32_t end = 0;
    std::vector<std::uint32_t> offsets;  // of the written entries
  };

  Duration update_time_;
  std::vector<Waiting> waiting_;
};

}  // namespace linegate::line
