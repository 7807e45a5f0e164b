// SPDX-License-Identifier: Apache-2.0
// What the manager is to do with each node, decided when the configuration is loaded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stack/base/result.h"
#include "stack/base/time.h"
#include "stack/manager/shared_source.h"
#include "stack/od/description.h"

namespace linegate::manager {

// One SDO download of the configuration step.
struct ObjectWrite {
  od::Address address;
  std::vector<std::byte> data;  // little-endian
};

// When a node got its configuration (CiA 301: 1020h; CiA 302-3: 1F26h and 1F27h).
struct ConfigurationDate {
  std::uint32_t date = 0;  // days since 1984-01-01
  std::uint32_t time = 0;  // ms since midnight

  // 0 means: always to be configured.
  bool known() const { return date != 0 && time != 0; }
  friend bool operator==(const ConfigurationDate&, const ConfigurationDate&) = default;
};

// CiA 302-2: what 1F81h, 1F84h..1F88h and 1F8Ah of one node begin with, and what no object says.
// Expected values of 0 are not compared.
struct NodePlan {
  std::uint8_t id = 0;
  bool boot = true;  // else only its error control is started
  bool mandatory = false;
  bool keep_alive = false;   // not reset as long as it is Operational
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
  Duration boot_timeout = std::chrono::seconds(10);  // without an answer: boot status B
  Duration reset_time = std::chrono::seconds(1);     // from a reset to its boot-up message, at most
  Duration sdo_timeout{};                            // 0 = Options::sdo_timeout
  std::vector<ObjectWrite> writes{};                 // in this order
  ConfigurationDate expected{};                      // 1F26h and 1F27h
  std::uint8_t store = 0;        // sub-index of 1010h, after them; 0 = none. Needs `expected`
  std::uint32_t software = 0;    // 1F55h; 0 = its software is not verified (1F81h bit 5)
  bool update_software = false;  // 1F81h bit 6
  SharedBytes program{};         // 1F58h; nullptr = none
};

// What happens when a mandatory node is lost (1F80h bits 4 and 6).
enum class ErrorReaction : std::uint8_t {
  node,       // it is reset and booted again, as any other
  reset_all,  // the network is started anew
  stop_all,   // all nodes are stopped, the own one too
};

struct Options {
  bool reset_nodes = true;  // NMT reset communication at the start
  Duration sdo_timeout = std::chrono::milliseconds(500);
  // What 1F80h, 1F89h and 102Ah begin with.
  bool master = true;       // bit 0
  bool start_all = false;   // bit 1: with one command, when the boot is complete
  bool own_start = true;    // bit 2 = 0: the own node becomes Operational by itself
  bool start_nodes = true;  // bit 3 = 0: the manager starts the nodes
  ErrorReaction on_error = ErrorReaction::node;
  Duration boot_time{};    // of mandatory nodes; 0 = as long as it takes
  Duration nmt_inhibit{};  // between two NMT commands, whole 100 us
};

// The downloads that bring a device from what its file describes as default to what it describes as
// configured (DCF ParameterValue), but for objects whose ObjFlags (CiA 306) say that they are not
// to be written, in an order every device accepts: parameters outside the PDO records first; then
// each PDO record as CiA 301 7.5.2.36 wants it: COB-ID invalid, mapping count 0, entries, count,
// other parameters, COB-ID valid.
std::vector<ObjectWrite> configuration_writes(const od::DeviceDescription& device);

// Moves what is written to 1020h to the end, for every later write of a parameter would make the
// device clear it; behind that what is written to 1010h.
void date_last(std::vector<ObjectWrite>& writes);
// What the last writes of 1020h:1 and :2 say; not known if there are none.
ConfigurationDate date_of(std::span<const ObjectWrite> writes);
// A date for a configuration whose files name none: the same for the same writes, after a restart
// too; another one for others. Always known(); as a calendar it means nothing. OWN.
ConfigurationDate fingerprint_of(std::span<const ObjectWrite> writes);

// Concise DCF: the writes that configure a device, as object 1F22h (CiA 302-3) and files hold them.
//
//   U32 count, then so many times { U16 index, U8 sub-index, U32 size in bytes, data }
//
// little-endian, without gaps. No bytes at all: nothing to do. Empty if there are no writes.
std::vector<std::byte> write_concise_dcf(std::span<const ObjectWrite> writes);

// The writes in their order. Fails with length_mismatch if count and sizes do not agree with the
// number of bytes: nothing of it can be trusted then.
Result<std::vector<ObjectWrite>> read_concise_dcf(std::span<const std::byte> data);

}  // namespace linegate::manager
