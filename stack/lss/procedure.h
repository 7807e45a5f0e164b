// SPDX-License-Identifier: Apache-2.0
// What a person asks of the LSS master, as one command each: from the bytes of the command to the
// services of the master, and from their answers to the bytes of the reply. All numbers are
// little-endian.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stack/lss/fastscan.h"
#include "stack/lss/master.h"

namespace linegate::lss {

// Which service, with its arguments and what is answered. An address is vendor, product, revision,
// serial (4 each). Grows at the end only: the numbers are those of the DDS contract (COMMAND_LSS).
enum class Procedure : std::uint8_t {
  switch_global,         // mode (1): 0 waiting, 1 configuration
  switch_selective,      // address
  configure_node_id,     // node-ID (1): 1..127, 255 = none; or with 1 (1): in use or not
  configure_bit_timing,  // table (1; 0), index in it (1)
  activate_bit_timing,   // delay in ms (2)
  store,
  inquire_address,        // -> address
  inquire_node_id,        // -> node-ID (1), 255 = none
  identify,               // vendor, product, lowest and highest revision, lowest and highest serial
  identify_unconfigured,  // somebody has no node-ID: done; nobody: no answer
  fastscan,  // nothing; or known parts (1: bit 0 vendor .. 3 serial), address -> address; the
             // device is in configuration then
  assign,  // a round of assignment -> of each device that was found: verdict (1), node-ID or 0 (1),
           // error (1), specific error (1), address
};
inline constexpr std::uint16_t kProcedures = 12;

// Before what is answered: outcome (1: lss::Outcome), error and specific error of a refusal (1
// each).
inline constexpr std::size_t kReplyHead = 3;

// Address as bytes, appended.
void put(const Address& address, std::vector<std::byte>& out);
// Precondition: 16 bytes.
Address read_address(std::span<const std::byte> bytes);

// One of them on its way, but for `assign`.
class Course {
 public:
  // Nothing if the arguments are not those of the procedure.
  static std::optional<Course> make(Procedure procedure, std::span<const std::byte> arguments);

  bool over() const { return over_; }
  // The node-ID that is given next, as soon as checked() says that no other device uses it.
  std::optional<std::uint8_t> node_to_check() const;
  void checked(bool free);
  // The node-ID that a device without one was given.
  std::optional<std::uint8_t> given() const;
  // Precondition: not over, no node-ID is to be checked, what was requested before has been
  // answered.
  Request request() const;
  void answered(const Answer& answer);

  // It is over: the bytes of the reply.
  std::vector<std::byte> reply() const;
  bool is_fastscan() const { return procedure_ == Procedure::fastscan; }
  // Fastscan: parts of the address that it has so far, 0..4.
  unsigned parts() const { return scan_.part(); }

 private:
  // Of configure_node_id, which is for a device that may have the node-ID already.
  enum class Check : std::uint8_t { none, inquire, check };

  explicit Course(Procedure procedure) : procedure_(procedure) {}
  bool take(std::span<const std::byte> arguments);
  bool take_node_id(std::span<const std::byte> arguments);
  bool take_known(std::span<const std::byte> arguments);
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
