// SPDX-License-Identifier: Apache-2.0
// The PDOs of one device while its log is read: as its file has them, and as SDO transfers in the
// log change them or tell them (1400h to 1BFFh; CiA 301, 7.5.2.35 to 7.5.2.38).
#pragma once

#include <string>
#include <vector>

#include "stack/can/frame.h"
#include "stack/observer/pdo_knowledge.h"
#include "stack/observer/sdo_follower.h"
#include "stack/od/description.h"

namespace linegate::console {

class PdoFollower {
 public:
  // device may be empty: then all that is known is what the log tells. node 1..127.
  PdoFollower(const od::DeviceDescription& device, std::uint8_t node);

  // A frame of the device's SDO channel, to it (request) or from it. What is different from now on,
  // in words: "TPDO 1 is now on 185h: 6041:00 Statusword, 6064:00 Position"; empty if nothing is.
  std::string follow(const can::Frame& frame, bool request);

  // Those that are valid, and of which the mapping is known.
  const std::vector<observer::KnownPdo>& pdos() const { return pdos_; }

 private:
  std::string changes(const std::vector<observer::KnownPdo>& before) const;

  observer::SdoFollower transfers_;
  observer::PdoKnowledge knowledge_;
  std::vector<observer::KnownPdo> pdos_;
};

}  // namespace linegate::console
