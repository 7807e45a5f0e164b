// SPDX-License-Identifier: Apache-2.0
// The known PDOs of one node: those of its device file, with changes from SDO transfers on the bus
// that wrote or read its PDO parameters (1400h to 1BFFh; CiA 301, 7.5.2.35 to 7.5.2.38).
//
// A reset of the node ends written values: reset node and reset communication restore the
// communication parameters to their power-on values, which are the stored ones (CiA 301,
// 7.3.2.2.1). These are the values of the device file, until a transfer shows others:
//   1010h:1, :2 "save" written      the present values are the stored ones
//   1011h:1, :2 "load" written      the values of the device file are the stored ones
//   a value was read that was not   it is the stored one if the boot-up message was received, else
//   written since the boot-up       the stored one is not known, unless it is that of the file
//   1010h or 1011h written from     sub-index 4 on, which the manufacturer defines: the stored
//                                   values that this may change are not known
//   a value was written             the stored one is not known if 1010h:1 or :2 of the device file
//                                   says that the device stores by itself (bit 1)
// A PDO with a value that is not known is treated as one without a record.
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

  // Processes a value of an object of the device that a client wrote or read successfully. Returns
  // true if it changes a PDO.
  enum class Seen : std::uint8_t { written, read };
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
  // A parameter that did not always have the value of the device file.
  struct Learned {
    std::vector<std::byte> file;                   // its value there; empty: none
    std::optional<std::vector<std::byte>> stored;  // its value after a reset; nothing: not known
    bool written = false;                          // since the last reset
    bool unknown = false;                          // its present value is not known
  };

  void store(std::uint8_t sub);
  void restore(std::uint8_t sub);
  void note_stored(Learned& known, std::span<const std::byte> value, Seen seen) const;
  od::VariableDescription& variable(od::Address address, std::size_t size);
  void add_recorded(pdo::PdoKind kind, std::vector<KnownPdo>& out) const;
  void add_unrecorded(std::vector<KnownPdo>& out) const;
  void read_records();

  od::DeviceDescription device_;
  std::uint8_t node_;
  bool stores_itself_ = false;               // according to 1010h of the device file
  bool booted_ = false;                      // its boot-up message was received
  std::map<od::Address, Learned> learned_;   // PDO parameters
  std::map<std::uint32_t, Record> cob_ids_;  // of valid records
  std::map<std::uint32_t, Heard> heard_;     // by identifier
};

}  // namespace linegate::observer
