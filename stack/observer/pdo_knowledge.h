// SPDX-License-Identifier: Apache-2.0
// The known PDOs of one node: those of its device file, with changes from SDO transfers on the bus
// that wrote or read its PDO parameters (1400h to 1BFFh; CiA 301, 7.5.2.35 to 7.5.2.38).
//
// A reset of the node ends those that are not stored, see LearnedParameters. A device stores the
// communication and mapping parameters of a PDO together: if one of them is stored unlike the
// device file, its COB-ID and mapping are known only as far as they were read since the boot-up,
// before they were written, or were written since the reset. Else the PDO shown would be a mixture
// of stored and default values that no device has. A PDO with a value that is not known is treated
// as one without a record. Entries beyond the number of mapped objects may be unknown.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/time.h"
#include "stack/can/frame.h"
#include "stack/observer/learned_parameters.h"
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

  // longest: bits of the longest PDO, 64, or more on a line of CANopen FD.
  PdoKnowledge(od::DeviceDescription device, std::uint8_t node, std::size_t longest = 64);

  // Processes a value of an object of the device that a client wrote or read successfully. Returns
  // true if it changes a PDO.
  using Seen = LearnedParameters::Seen;
  bool learn(od::Address address, std::span<const std::byte> value, Seen seen);
  // An NMT command resets the device: its parameters have their stored values from now on.
  void reset();
  // The device has sent its boot-up message: the same.
  void boot_up();
  // Processes a frame that belongs to no known PDO. Returns true if it is a PDO of this node whose
  // length is now known, so that pdos() contains it from now on.
  bool hear(const can::Frame& frame);

  // The kind of the PDO of the node that has the frame's identifier: a valid one, or one that
  // hear() has found. Nothing for other frames.
  std::optional<pdo::PdoKind> kind_of(const can::Frame& frame) const;
  // Whether all parameters of the PDO that are not those of the device file were seen since the
  // last reset, or are known to be stored. number: 1..kMaxPdo.
  bool is_known(pdo::PdoKind kind, std::uint16_t number) const;

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

  struct Record {
    pdo::PdoKind kind = pdo::PdoKind::tpdo;
    bool complete = false;  // its mapping is known
  };

  void take_learned();
  void doubt_others(od::Address address);
  od::VariableDescription& variable(od::Address address, std::size_t size);
  void add_recorded(pdo::PdoKind kind, std::vector<KnownPdo>& out) const;
  void add_unrecorded(std::vector<KnownPdo>& out) const;
  void read_records();

  od::DeviceDescription device_;
  std::uint8_t node_;
  std::size_t longest_;
  LearnedParameters learned_;
  std::map<std::uint32_t, Record> cob_ids_;  // of valid records
  std::map<std::uint32_t, Heard> heard_;     // by identifier
};

}  // namespace linegate::observer
