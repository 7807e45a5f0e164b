// SPDX-License-Identifier: Apache-2.0
// Follows the PDOs of one device through a log: from its device file, and from SDO transfers in the
// log that change or read them (1400h to 1BFFh; CiA 301 7.5.2.35 to 7.5.2.38). A reset of the
// device ends what it does not store; see observer::PdoKnowledge.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "stack/observer/pdo_knowledge.h"
#include "stack/observer/sdo_follower.h"
#include "stack/od/description.h"

namespace linegate::console {

class PdoFollower {
 public:
  // device may be empty: then only the log is used. node: 1..127.
  PdoFollower(const od::DeviceDescription& device, std::uint8_t node);

  // Processes a transfer of the device's SDO channel that was successful. Returns the change in
  // words: "TPDO 1 is now on 185h: 6041:00 Statusword, 6064:00 Position"; empty if nothing changed.
  std::string follow(const observer::Transfer& transfer);
  // The object may have been written, or not: PDOs that it changes are not known until it is
  // written or read, or the device is reset without having stored it. Returns the change in words.
  std::string doubt(od::Address address);
  // An NMT command resets or starts the device, or it has sent its boot-up message. Return the
  // change in words. Between a reset and the next of the others, a frame of the device may be from
  // before the reset: PDOs that it changes are not known.
  std::string reset();
  std::string start();
  std::string boot_up();

  // The valid PDOs with a known mapping.
  const std::vector<observer::KnownPdo>& pdos() const { return pdos_; }

 private:
  std::vector<observer::KnownPdo> present() const;
  std::string update();
  std::string changes(const std::vector<observer::KnownPdo>& before) const;
  bool is_known(const observer::KnownPdo& pdo) const;

  observer::PdoKnowledge knowledge_;
  std::vector<observer::KnownPdo> pdos_;
  std::optional<std::vector<observer::KnownPdo>> before_reset_;
  std::set<od::Address> doubted_;
  std::set<od::Address> stored_doubted_;  // those whose values after a reset are not known either
};

}  // namespace linegate::console
