// SPDX-License-Identifier: Apache-2.0
// Frames of a CANopen line in words, as somebody who does not know CANopen by heart would want
// them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "bridges/console/explain_sdo.h"
#include "bridges/console/pdo_follower.h"
#include "stack/can/frame.h"
#include "stack/line/config.h"
#include "stack/pdo/parameters.h"

namespace linegate::console {

// Knows the pre-defined connection set (CiA 301, 7.3.3), and of the devices it was told about their
// names, objects and PDOs. An SDO transfer takes several frames: it remembers where each one is, so
// frames are to be given in the order of the bus.
class Explainer {
 public:
  Explainer() = default;
  Explainer(const Explainer&) = delete;
  Explainer& operator=(const Explainer&) = delete;

  // Names, objects and PDOs of a device as its file and the configuration have them.
  void add(const line::NodeConfig& device);

  // One sentence, without a full stop. A PDO that is mapped anew by SDO, or of which a mapping is
  // read, is explained accordingly from then on, also of devices that were not added; the sentence
  // about the frame that completes the transfer says so.
  std::string explain(const can::Frame& frame);

 private:
  struct Pdo {
    unsigned node;
    pdo::Parameters parameters;
    bool transmitted;  // by the device
  };
  // The SDO channel of a node, known or not, and what it makes of the PDOs.
  struct Channel {
    SdoConversation sdo;
    PdoFollower pdos;
  };

  // "5 (inlet)", or "5".
  std::string node(unsigned id) const;
  const line::NodeConfig* device(unsigned id) const;
  const od::DeviceDescription* description(unsigned id) const;
  Channel& channel(unsigned id);
  // The identifiers of its PDOs, as the follower has them now.
  void note_pdos(unsigned id, const PdoFollower& pdos);

  std::string nmt(const can::Frame& frame) const;
  std::string error_control(const can::Frame& frame, unsigned id) const;
  std::string emcy(const can::Frame& frame, unsigned id) const;
  std::string sdo(const can::Frame& frame, unsigned id, bool request);
  std::string pdo(const can::Frame& frame, const Pdo& pdo) const;
  std::string by_identifier(const can::Frame& frame);

  std::map<unsigned, line::NodeConfig> devices_;
  std::map<std::uint32_t, std::vector<Pdo>> pdos_;  // by identifier; 29 bits: with bit 31
  std::map<unsigned, Channel> channels_;            // by node-ID of the server
};

// What a device calls an object: "6083:00 Profile acceleration", "2000:01".
std::string object_text(const od::DeviceDescription* device, od::Address address);
// Its value in the object's own type; as bytes if the device does not know it.
std::string value_of(const od::DeviceDescription* device, od::Address address,
                     std::span<const std::byte> value);

}  // namespace linegate::console
