// SPDX-License-Identifier: Apache-2.0
// The data of the replies of a line: a type for each kind of result.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "stack/manager/connection.h"
#include "stack/manager/node_report.h"
#include "stack/manager/state.h"
#include "stack/od/data_type.h"
#include "stack/od/description.h"
#include "stack/scan/scanned_node.h"

namespace linegate::line {

// LocalRead of an ObjectRange: a variable of the own dictionary, or of a device file.
struct ListedObject {
  static constexpr std::size_t kLongestValue = 255;  // bytes
  od::Address address{};
  od::DataType type = od::DataType::none;
  od::Access access = od::Access::ro;
  bool mappable = false;     // PDOs can map it
  bool stored = false;       // 1010h stores it
  bool application = false;  // application object of the own dictionary
  std::string name{};
  // Little-endian. Empty if it cannot be read, or is longer than kLongestValue.
  std::vector<std::byte> value{};

  friend bool operator==(const ListedObject&, const ListedObject&) = default;
};

// ObjectWrite: the value was written by SDO.
struct WrittenBySdo {
  friend bool operator==(WrittenBySdo, WrittenBySdo) = default;
};

// What the PDO waits for. The reply with `none` is sent when the bus acknowledged the frame, with
// `turn` and `bus` after Command::timeout, at the latest after kSendTime. The numbers are part of
// the DDS contract.
enum class PdoWait : std::uint8_t {
  none,         // sent: the bus acknowledged its frame
  update_time,  // LineConfig::pdo_update_time
  values,       // some of its values were never written and have no default
  operational,  // the own node is not Operational
  trigger,      // ObjectWrite::keep_pdo
  turn,         // its inhibit time or its SYNC did not come within the time of the command
  bus,          // the bus did not acknowledge its frame, or accepts none
};
inline constexpr std::size_t kPdoWaits = 7;

// ObjectWrite and SingleOutput: the value was written to a PDO, or to all PDOs that map the object.
// Of several PDOs the reply has the worst reason (values, operational, bus, turn, trigger,
// update_time), and is `none` when the bus acknowledged a frame of each.
struct WrittenByPdo {
  std::uint16_t pdo = 0;  // its number on this line; of several the first one with that reason
  PdoWait wait = PdoWait::none;
  // With PdoWait::values: the positions of the missing entries in the output layout.
  std::vector<std::uint32_t> missing{};

  friend bool operator==(const WrittenByPdo&, const WrittenByPdo&) = default;
};

// MpdoWrite: the value was sent.
struct SentByMpdo {
  std::uint16_t tpdo = 0;  // number of the own TPDO

  friend bool operator==(SentByMpdo, SentByMpdo) = default;
};

// PdoTrigger: the numbers of the PDOs on this line.
using TriggeredPdos = std::vector<std::uint16_t>;

// ProgramFault::value of 1F50h with the error device_state: the device restarted while the program
// was written.
inline constexpr std::uint32_t kProgramRestarted = 1;

// ProgramDownload: what the device reported when it failed.
struct ProgramFault {
  // Program data, flash status, program control or software identification
  od::Address object{};
  std::uint32_t value = 0;  // as read from `object`; 0 if the transfer was aborted

  friend bool operator==(const ProgramFault&, const ProgramFault&) = default;
};

// ConnectionOpen, with one element, and ConnectionList; ascending by number.
using SdoConnections = std::vector<manager::Connection>;

// The data of a reply. std::monostate: none, as in the reply to a write to an object of the own
// node, or to an output that no PDO or MPDO carries. std::vector<std::byte>: the value of an
// object, little-endian; the reply to an LssRequest (stack/lss/procedure.h); a text. ScannedNode:
// Scan and ScanApply. BootOutcome: Boot. NodeReport: Configure. The lists of nodes ascend by
// node-ID, the list of objects by address.
using ReplyData = std::variant<std::monostate, std::vector<std::byte>, std::vector<ListedObject>,
                               WrittenBySdo, WrittenByPdo, SentByMpdo, TriggeredPdos, ProgramFault,
                               std::vector<scan::ScannedNode>, std::vector<manager::BootOutcome>,
                               std::vector<manager::NodeReport>, SdoConnections>;

// The bytes in `data`; empty for every other type of result.
inline const std::vector<std::byte>& bytes_of(const ReplyData& data) {
  static const std::vector<std::byte> kNone;
  const auto* const bytes = std::get_if<std::vector<std::byte>>(&data);
  return bytes == nullptr ? kNone : *bytes;
}

}  // namespace linegate::line
