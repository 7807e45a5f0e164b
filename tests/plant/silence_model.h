// SPDX-License-Identifier: Apache-2.0
// The frames that a line may transmit, derived independently from its configuration, the commands
// that it was given and the frames that it received.
//   no NMT command unless the own node is NMT master (1F80h bit 0)
//   only CAN-IDs of services that are configured, or that a command named
//   on a line of CANopen FD: no remote frame, and USDO in place of SDO; it keeps its role
//   no download of a valid COB-ID that is restricted (CiA 301 7.3.5)
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "stack/can/cob_id.h"
#include "stack/can/frame.h"
#include "stack/line/line.h"

namespace linegate::plant {

class SilenceModel {
 public:
  SilenceModel() = default;
  explicit SilenceModel(const line::LineConfig& config);

  // Call it when the line is given this command.
  void commanded(const line::Command& command);
  // Call it before the line receives the frame.
  void before_receive(const can::Frame& frame);
  // Call it when the line sends the frame. Returns a description of the violated rule, or nothing.
  std::string sends(const can::Frame& frame);

 private:
  void allow(const can::CobId& cob_id);
  void allow_pdos(const od::DeviceDescription& device, bool rpdos);
  void note_tpdos(const line::NodeConfig& node);
  void follow_own_reset(std::uint8_t command, std::uint8_t node);
  bool is_of_protocol(const can::Frame& frame) const;
  bool is_allowed(const can::Frame& frame) const;
  std::string check_download(const can::Frame& frame) const;

  std::array<bool, 128> own_{};   // node-IDs of the line
  bool fd_ = false;               // CANopen FD
  std::uint8_t client_ = 0;       // the own node-ID, with which the line requests
  bool is_master_ = false;        // present state
  bool boots_as_master_ = false;  // state after each reset of the own node
  std::bitset<0x800> allowed_;    // 11-bit identifiers
  std::set<std::uint32_t> allowed_extended_;
  std::map<std::pair<unsigned, unsigned>, std::uint32_t> tpdos_;  // CAN-IDs, by node and PDO number
  std::bitset<0x800> requested_;              // CAN-IDs that a command requests with a remote frame
  std::set<std::uint32_t> commanded_writes_;  // node, index, sub-index
};

}  // namespace linegate::plant
