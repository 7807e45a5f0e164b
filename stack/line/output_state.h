// SPDX-License-Identifier: Apache-2.0
// The result of the writes to a group of outputs, and what its values wait for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "stack/base/time.h"
#include "stack/line/output_write.h"

namespace linegate::line {

// Why an output entry is not valid. Append only: DDS contract.
enum class OutputWait : std::uint8_t {
  value,     // it was never written and has no default
  values,    // another entry of its PDO was never written and has no default
  own_node,  // the own node is not Operational
  node,      // the node that receives its PDO is not confirmed as Operational, or has other PDOs
  turn,      // the transmission type, the inhibit time or the arbitration on the bus
  bus,       // the bus does not acknowledge frames, or accepts none
  trigger,   // it was written without a request of its PDO: ObjectWrite::keep_pdo, 5F41h:04h bit 6
  update_time,  // LineConfig::pdo_update_time
};

// The reason of a value that nothing but its PDO delays. awaits_trigger: see
// pdo::Engine::awaits_trigger(); stuck: see ServiceHost::bus_is_stuck().
constexpr OutputWait wait_of_request(bool awaits_trigger, bool stuck) {
  if (awaits_trigger) {
    return OutputWait::trigger;
  }
  return stuck ? OutputWait::bus : OutputWait::turn;
}

struct OutputState {
  std::uint16_t group = 0;
  std::string name;           // as configured
  std::string owner;          // OutputWrite::client of the last write that was applied
  std::uint64_t applied = 0;  // writes since the start of the line
  std::uint64_t refused = 0;
  Instant applied_at{};  // time of the last applied write
  Instant refused_at{};
  OutputRefusal refusal = OutputRefusal::none;  // of the last refused write
  // Its OutputWrite::client; empty if the owner of the line refused it, who knows the number.
  std::string refused_client;
  std::uint32_t refused_number = 0;  // its OutputWrite::client_number
  std::uint64_t arming = 0;          // of the last write that was applied
  // Only another arming number than `arming` is applied: the watchdog has fired, or another flying
  // master was active.
  bool arming_wanted = false;
  Duration watchdog{};        // 0 = none
  Instant deadline = kNever;  // when the watchdog fires
  std::uint32_t waiting = 0;  // entries of the group that are not valid
  struct Wait {
    std::uint32_t entry = 0;  // of the output layout
    OutputWait reason = OutputWait::value;

    friend bool operator==(const Wait&, const Wait&) = default;
  };
  static constexpr std::size_t kMostWaits = 64;
  std::vector<Wait> waits;  // the first kMostWaits of them
};

}  // namespace linegate::line
