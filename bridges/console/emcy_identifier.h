// SPDX-License-Identifier: Apache-2.0
// Follows the COB-ID of the EMCYs of one device (1014h) through a log: from its device file and
// configuration, and from SDO transfers in the log. A reset of the device ends what it does not
// store; see observer::LearnedParameters.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "stack/can/cob_id.h"
#include "stack/line/config.h"
#include "stack/observer/learned_parameters.h"
#include "stack/observer/sdo_follower.h"

namespace linegate::console {

// The device stores communication parameters when they are written, without a command (bit 1 of
// 1010h:1 or :2 in its device file).
bool stores_by_itself(const od::DeviceDescription& device);

class EmcyIdentifier {
 public:
  // device: nullptr if nothing is known about it.
  explicit EmcyIdentifier(const line::NodeConfig* device);

  // Processes a transfer of the device's SDO channel that was successful.
  void follow(const observer::Transfer& transfer);
  // 1014h may have been written, or not.
  void doubt();
  void reset();
  void boot_up();

  // Nothing: not known. It may be one that is not valid: the device sends no EMCYs.
  std::optional<can::CobId> cob_id() const;

 private:
  std::vector<std::byte> configured_;  // empty: not known
  observer::LearnedParameters learned_;
  bool doubted_ = false;
  bool stores_by_itself_ = false;
  bool stored_doubted_ = false;  // its value after a reset is not known either
};

}  // namespace linegate::console
