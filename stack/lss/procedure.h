// SPDX-License-Identifier: Apache-2.0
// The commands to the LSS master: decodes the bytes of a command into services of the master, and
// encodes their answers into the bytes of the reply. All numbers are little-endian.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stack/lss/fastscan.h"
#include "stack/lss/master.h"

namespace linegate::lss {

// The service, with its arguments and result (sizes in bytes in parentheses). An address is vendor,
// product, revision, serial (4 each). Only append: the numbers are part of the DDS contract
// (COMMAND_LSS).
enum class Procedure : std::uint8_t {
  switch_global,     // mode (1): 0 waiting, 1 configuration
  switch_selective,  // address
  // Node-ID (1): 1..127, 255 = remove it; or followed by 1 (1): without a check that it is free.
  configure_node_id,
  configure_bit_timing,  // table (1; 0), index in it (1)
  activate_bit_timing,   // delay in ms (2)
  store,
  inquire_address,        // -> address
  inquire_node_id,        // -> node-ID (1), 255 = none
  identify,               // vendor, product, lowest and highest revision, lowest and highest serial
  identify_unconfigured,  // outcome done: a device is unconfigured; no answer: none is
  // Nothing; or known parts (1: bit 0 vendor .. 3 serial), address -> address; the device is then
  // in configuration.
  fastscan,
  // Runs a round of assignment -> for each device found: verdict (1), node-ID or 0 (1), error (1),
  // specific error (1), address.
  assign,
};
inline constexpr std::uint16_t kProcedures = 12;

// Bytes before the result: outcome (1: lss::Outcome), error and specific error of a refusal (1
// each).
inline constexpr std::size_t kReplyHead = 3;

// Appends the 16 bytes of the address.
void put(const Address& address, std::vector<std::byte>& out);
// Precondition: 16 bytes.
Address read_address(std::span<const std::byte> bytes);

// The execution of one command, except `assign`.
class Course {
 public:
  // Returns nothing if the arguments do not match the procedure.
  static std::optional<Course> make(Procedure procedure, std::span<const std::byte> arguments);

  bool over() const { return over_; }
  // The next node-ID to assign, once checked() confirms that no other device uses it.
  std::optional<std::uint8_t> node_to_check() const;
  void checked(bool free);
  // The node-ID that was assigned to an unconfigured device.
  std::optional<std::uint8_t> given() const;
  // Precondition: not over, no node-ID to check, and the previous request was answered or timed
  // out.
  Request request() const;
  // Of switch_global: into the configuration state.
  bool is_into_configuration() const { return request_.configuration; }
  void answered(const Answer& answer);

  // The bytes of the reply, once it is over.
  std::vector<std::byte> reply() const;
  bool is_fastscan() const { return procedure_ == Procedure::fastscan; }
  // Progress of a fastscan: parts of the address found so far, 0..4.
  unsigned parts() const { return scan_.part(); }

 private:
  // State of configure_node_id: inquires first whether the device already has the node-ID.
  enum class Check : std::uint8_t { none, inquire, check };

  explicit Course(Procedure procedure) : procedure_(procedure) {}
  bool take(std::span<const std::byte> arguments);
  bool read_node_id(std::span<const std::byte> arguments);
  bool read_known(std::span<const std::byte> arguments);
  void scanned(bool yes);
  void inquired(const Answer& answer);

  Procedure procedure_;
  Request request_;
  Fastscan scan_;
  Check check_ = Check::none;
  bool has_none_ = false;  // the device has no node-ID
  bool over_ = false;
  Address address_{};
  Answer last_;
  std::vector<std::byte> data_;
};

}  // namespace linegate::lss
