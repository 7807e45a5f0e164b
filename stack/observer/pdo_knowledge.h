// SPDX-License-Identifier: Apache-2.0
// The known PDOs of one node: those of its device file, with changes from SDO transfers on the bus
// that wrote or read its PDO parameters (1400h to 1BFFh; CiA 301, 7.5.2.35 to 7.5.2.38).
//
// They are kept over a reset of the node, because its master is expected to configure it in the
// same way again.
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

// One known PDO.
struct KnownPdo {
  pdo::PdoKind kind = pdo::PdoKind::tpdo;
  pdo::Parameters parameters;
  bool complete = true;  // false: only its COB-ID and its length are known, and its mapping is raw
};

class PdoKnowledge {
 public:
  // An unknown frame on an identifier of the pre-defined connection set counts as a PDO after it
  // was received this many times with the same length.
  static constexpr unsigned kUnknownFrames = 3;
  // A frame that follows a counted one within this time is not counted: it may be the same frame,
  // which CAN repeats if one station missed its last bit.
  static constexpr Duration kRepeated = std::chrono::milliseconds(1);

  PdoKnowledge(od::DeviceDescription device, std::uint8_t node);

  // Processes a value of an object of the device. Returns true if it changes a PDO.
  bool learn(od::Address address, std::span<const std::byte> value);
  // Processes a frame that belongs to no known PDO. Returns true if it is a PDO of this node whose
  // length is now known, so that pdos() contains it from now on.
  bool hear(const can::Frame& frame);

  // Whether a valid PDO of the node has its COB-ID.
  bool has_record(const can::Frame& frame) const {
    return !frame.extended() && !frame.remote() && cob_ids_.contains(frame.id);
  }

  // All completely known PDOs, and the others as raw, ascending by number. Incompletely known PDOs
  // that were never received are omitted, because not even their length is known.
  std::vector<KnownPdo> pdos() const;

  const od::DeviceDescription& device() const { return device_; }
  std::uint8_t node() const { return node_; }

 private:
  struct Heard {
    std::uint8_t length = 0;
    unsigned frames = 0;
    Instant counted = kNever;  // time of the last counted frame
  };

  od::VariableDescription& variable(od::Address address, std::size_t size);
  void add_recorded(pdo::PdoKind kind, std::vector<KnownPdo>& out) const;
  void add_unrecorded(std::vector<KnownPdo>& out) const;
  void read_records();

  od::DeviceDescription device_;
  std::uint8_t node_;
  std::map<std::uint32_t, bool> cob_ids_;  // valid records -> mapping is known
  std::map<std::uint32_t, Heard> heard_;   // by identifier
};

}  // namespace linegate::observer
