// SPDX-License-Identifier: Apache-2.0
// The manager's settings for each node, determined when the configuration is loaded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stack/base/result.h"
#include "stack/base/time.h"
#include "stack/manager/assumed_pdo.h"
#include "stack/manager/shared_source.h"
#include "stack/od/description.h"

namespace linegate::manager {

// The date of a node's configuration (CiA 301: 1020h; CiA 302-3: 1F26h and 1F27h).
struct ConfigurationDate {
  std::uint32_t date = 0;  // days since 1984-01-01
  std::uint32_t time = 0;  // ms since midnight

  // Date or time 0 means that the node is always configured.
  bool known() const { return date != 0 && time != 0; }
  friend bool operator==(const ConfigurationDate&, const ConfigurationDate&) = default;
};

// CiA 302-2: the initial values of 1F81h, 1F84h..1F88h and 1F8Ah for one node, and settings without
// an object. Expected values of 0 are not compared.
struct NodePlan {
  std::uint8_t id = 0;
  bool boot = true;  // false: only its error control is started
  bool mandatory = false;
  bool keep_alive = false;   // not reset while it is Operational
  std::uint8_t restore = 0;  // sub-index of 1011h, 0 = none
  std::uint32_t device_type = 0;
  std::uint32_t vendor = 0;
  std::uint32_t product = 0;
  std::uint32_t revision = 0;
  bool revision_major_alone = false;  // the lower 16 bits of the revision number are not compared
  std::uint32_t serial = 0;
  Duration heartbeat_consumer{};  // 0 = guarding, or no error control
  Duration guard_time{};          // 0 = the node is not guarded
  std::uint8_t life_time_factor = 0;
  Duration boot_timeout = std::chrono::seconds(10);  // without an answer until then: boot status B
  // Longest time from a reset to its boot-up message
  Duration reset_time = std::chrono::seconds(1);
  Duration sdo_timeout{};             // 0 = Options::sdo_timeout
  std::vector<ObjectWrite> writes{};  // in this order
  std::vector<AssumedPdo> pdos{};     // compared after `writes`
  ConfigurationDate expected{};       // 1F26h and 1F27h
  // Sub-index of 1010h, written after `writes`; 0 = none. Requires `expected`
  std::uint8_t store = 0;
  std::uint32_t software = 0;    // 1F55h; 0 = its software is not verified (1F81h bit 5)
  bool update_software = false;  // 1F81h bit 6
  SharedBytes program{};         // 1F58h; nullptr = none
};

// Reaction to the loss of a mandatory node (1F80h bits 4 and 6).
enum class ErrorReaction : std::uint8_t {
  node,       // it is reset and booted again, like any other node
  reset_all,  // the network is started again
  stop_all,   // all nodes are stopped, including the own one
};

struct Options {
  bool reset_nodes = true;  // NMT reset communication at the start
  Duration sdo_timeout = std::chrono::milliseconds(500);
  // The initial values of 1F80h, 1F89h and 102Ah.
  bool master = true;       // bit 0
  bool flying = false;      // bit 5: it competes with others for the role of the master
  bool start_all = false;   // bit 1: with one command, when the boot is complete
  bool own_start = true;    // bit 2 = 0: the own node becomes Operational by itself
  bool start_nodes = true;  // bit 3 = 0: the manager starts the nodes
  ErrorReaction on_error = ErrorReaction::node;
  Duration boot_time{};    // of mandatory nodes; 0 = unlimited
  Duration nmt_inhibit{};  // between two NMT commands, whole 100 us
};

// The downloads that bring a device from the default values of its file to the configured ones (DCF
// ParameterValue), in an order that every device accepts: parameters outside the PDO records first;
// then each PDO record in the order of CiA 301 7.5.2.36: COB-ID invalid, mapping count 0, entries,
// count, other parameters, COB-ID valid. Objects whose ObjFlags (CiA 306) forbid a download are
// left out.
std::vector<ObjectWrite> configuration_writes(const od::DeviceDescription& device);

// The PDOs of the device that are in the process image (pdo::describe_pdos()), with the parameters
// that can be written, according to the device file, but the transmission types of TPDOs, which
// change no value. correct: with the writes that remedy a difference.
// max_bits: the longest PDO.
std::vector<AssumedPdo> assumed_pdos(const od::DeviceDescription& device, bool correct,
                                     std::size_t max_bits = 64);
// Adds the other PDOs of each device: they must not have the COB-IDs of PDOs of the image. devices
// and correct: those of the plans, in their order.
void add_other_pdos(std::span<const od::DeviceDescription* const> devices,
                    const std::vector<bool>& correct, std::span<NodePlan> plans,
                    std::size_t max_bits = 64);

// Moves writes to 1020h to the end, because the device clears 1020h with every later write of a
// parameter; writes to 1010h follow them.
void date_last(std::vector<ObjectWrite>& writes);
// The values of the last writes to 1020h:1 and :2; not known() if there are none.
ConfigurationDate date_of(std::span<const ObjectWrite> writes);
// A date for a configuration whose files contain none: equal for equal writes and PDOs, also after
// a restart, and a different one for different ones (a hash). Always known(); it has no meaning as
// a calendar date. OWN.
ConfigurationDate fingerprint_of(std::span<const ObjectWrite> writes,
                                 std::span<const AssumedPdo> pdos = {});

// Concise DCF: the writes that configure a device, in the format of object 1F22h (CiA 302-3) and of
// files.
//
//   U32 count, then count times { U16 index, U8 sub-index, U32 size in bytes, data }
//
// little-endian, without gaps. No bytes at all mean that there are no writes.
std::vector<std::byte> write_concise_dcf(std::span<const ObjectWrite> writes);

// Returns the writes in their order. Fails with length_mismatch if count and sizes do not agree
// with the number of bytes, because no part of the data is then reliable.
Result<std::vector<ObjectWrite>> read_concise_dcf(std::span<const std::byte> data);

}  // namespace linegate::manager
