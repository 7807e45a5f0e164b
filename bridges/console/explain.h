// SPDX-License-Identifier: Apache-2.0
// Explains frames of a CANopen line in words, for readers who do not know CANopen by heart.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "bridges/console/emcy_identifier.h"
#include "bridges/console/explain_sdo.h"
#include "bridges/console/pdo_follower.h"
#include "stack/can/frame.h"
#include "stack/line/config.h"
#include "stack/nmt/state.h"
#include "stack/observer/sdo_follower.h"
#include "stack/observer/usdo_follower.h"
#include "stack/pdo/parameters.h"

namespace linegate::console {

// Uses the predefined connection set (CiA 301 7.3.3), and the names, objects and PDOs of the
// devices that were added. It keeps the state of SDO transfers, so pass it frames in the order of
// the bus.
class Explainer {
 public:
  Explainer() = default;
  Explainer(const Explainer&) = delete;
  Explainer& operator=(const Explainer&) = delete;

  // Adds the names, objects and PDOs of a device from its file and configuration.
  void add(const line::NodeConfig& device);
  // Adds the own node of the line, if the configuration gives it objects or PDOs, and the gateways
  // to other networks.
  void add_own_node(const line::LineConfig& line);

  // Returns one sentence without a full stop. If SDO transfers remap a PDO or read its mapping, the
  // PDO is explained accordingly until a reset of the device, also for devices that were not added;
  // the sentence for the frame that completes the transfer, or resets the device, mentions it. The
  // same holds for the COB-ID of its EMCYs (1014h).
  std::string explain(const can::Frame& frame);

 private:
  struct Pdo {
    unsigned node;
    pdo::Parameters parameters;
    bool transmitted;  // by the device
  };
  // The SDO channel of a node, known or not, and the changes of its PDOs and of its EMCY seen on
  // it.
  struct Channel {
    SdoConversation sdo;
    observer::SdoFollower transfers;
    PdoFollower pdos;
    EmcyIdentifier emcy;
  };

  // "5 (inlet)", or "5".
  std::string node(unsigned id) const;
  const line::NodeConfig* device(unsigned id) const;
  const od::DeviceDescription* description(unsigned id) const;
  Channel& channel(unsigned id);
  // Updates the identifiers of its PDOs and of its EMCY from the followers.
  void note_pdos(unsigned id, const PdoFollower& pdos);
  void note_emcy(unsigned id, const EmcyIdentifier& emcy);

  // Returns the changes of its PDOs in words.
  std::string follow_nmt(nmt::Command command, std::uint8_t to);
  std::string nmt(const can::Frame& frame);
  std::string error_control(const can::Frame& frame, unsigned id);
  // assumed: by its predefined identifier alone.
  std::string emcy(const can::Frame& frame, unsigned id, bool assumed) const;
  // Returns the changes in words: the object may have been written, or not.
  std::string follow_doubt(unsigned id, Channel& with, od::Address object);
  std::string usdo(const can::Frame& frame, unsigned id, bool request);
  std::string follow_transfer(unsigned id, Channel& with, const observer::Transfer& transfer);
  std::string sdo(const can::Frame& frame, unsigned id, bool request);
  std::string pdo(const can::Frame& frame, const Pdo& pdo) const;
  std::string mpdo(const can::Frame& frame) const;
  // The PDOs and EMCYs that are known to have the identifier; empty if there are none.
  std::string by_known_identifier(const can::Frame& frame);
  std::string by_identifier(const can::Frame& frame);

  std::map<unsigned, line::NodeConfig> devices_;
  std::set<unsigned> gateways_;  // may forward EMCYs of other networks (routing/emcy_frame.h)
  // By identifier; bit 31 marks 29-bit identifiers
  std::map<std::uint32_t, std::vector<Pdo>> pdos_;
  std::map<std::uint32_t, std::set<unsigned>> emcys_;  // the same: nodes
  std::map<unsigned, Channel> channels_;               // by node-ID of the server
  observer::UsdoFollower usdo_;
};

// The object with its alias, or its name in the device file: "6083:00 Profile acceleration",
// "2000:01".
std::string object_text(const od::DeviceDescription* device, od::Address address);
// The value by the object's data type, in its unit; as bytes if the device file lacks the object.
std::string value_of(const od::DeviceDescription* device, od::Address address,
                     std::span<const std::byte> value);

}  // namespace linegate::console
