// SPDX-License-Identifier: Apache-2.0
// What is known of the PDOs of one node: what its device file says, and what was overheard since
// when somebody wrote or read its PDO parameters (1400h to 1BFFh; CiA 301, 7.5.2.35 to 7.5.2.38).
//
// A reset of the node is not the end of what is known: who has configured it once does it again.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/time.h"
#include "stack/can/frame.h"
#include "stack/od/description.h"
#include "stack/pdo/mapping.h"
#include "stack/pdo/parameters.h"

namespace linegate::observer {

// One PDO as known.
struct KnownPdo {
  pdo::PdoKind kind = pdo::PdoKind::tpdo;
  pdo::Parameters parameters;
  bool complete = true;  // false: only its COB-ID and its length are known, its mapping is raw
};

class PdoKnowledge {
 public:
  // How often a frame on one of the identifiers of the pre-defined connection set, of which nothing
  // is known, must come with the same length to be taken for a PDO.
  static constexpr unsigned kUnknownFrames = 3;
  // What comes so soon after a frame that was counted is not: it may be the same frame, which CAN
  // repeats when one station did not get its last bit.
  static constexpr Duration kRepeated = std::chrono::milliseconds(1);

  PdoKnowledge(od::DeviceDescription device, std::uint8_t node);

  // An object of the device has this value. True if something of its PDOs became different.
  bool learn(od::Address address, std::span<const std::byte> value);
  // A frame that no known PDO has. True if it is of a PDO of this node, of which now the length is
  // known: pdos() has it from now on.
  bool hear(const can::Frame& frame);

  // A valid PDO of the node has its COB-ID.
  bool has_record(const can::Frame& frame) const {
    return !frame.extended() && !frame.remote() && cob_ids_.contains(frame.id);
  }

  // Everything known completely, and raw what is not; ascending by number. What was never heard
  // and is not known completely is left out: not even its length is known.
  std::vector<KnownPdo> pdos() const;

  const od::DeviceDescription& device() const { return device_; }
  std::uint8_t node() const { return node_; }

 private:
  struct Heard {
    std::uint8_t length = 0;
    unsigned frames = 0;
    Instant counted = kNever;  // the newest of these frames
  };

  od::VariableDescription& variable(od::Address address, std::size_t size);
  void add_recorded(pdo::PdoKind kind, std::vector<KnownPdo>& out) const;
  void add_unrecorded(std::vector<KnownPdo>& out) const;
  void read_records();

  od::DeviceDescription device_;
  std::uint8_t node_;
  std::map<std::uint32_t, bool> cob_ids_;  // of valid records -> mapping is known
  std::map<std::uint32_t, Heard> heard_;   // by identifier
};

}  // namespace linegate::observer
