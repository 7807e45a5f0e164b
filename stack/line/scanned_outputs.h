// SPDX-License-Identifier: Apache-2.0
// Outputs that are sent by MPDO in source address mode: objects of the own node in the outputs of
// the image that are in the object scanner list (CiA 301 7.2.2.6) and that no PDO carries. Private
// to stack/line.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "stack/can/frame.h"
#include "stack/image/process_image.h"
#include "stack/line/config.h"
#include "stack/line/flying_master_service.h"
#include "stack/node/node.h"

namespace linegate::line {

class ScannedOutputs {
 public:
  // node: the own node. All must outlive it. Without a scanner list there are no such outputs.
  ScannedOutputs(const LineConfig& config, node::Node& node, image::ProcessImage& image,
                 const FlyingMasterService& flying);

  bool empty() const { return outputs_.empty(); }

  // Those bits of the outputs were written. always: send unchanged values, too.
  void written(std::uint32_t bit_offset, std::uint32_t bits, bool always);
  // On entering Operational sends all known outputs: the PDO engine dropped those that waited when
  // the node left Operational, however briefly.
  void follow_state();
  // The known outputs become invalid, and are sent when the own node enters Operational.
  void invalidate();
  // While another flying master is active, outputs are due, but not sent.
  void follow_role();
  // Drops the frames that wait. An output that is known by then is due.
  void drop();
  // A frame was handed to the bus with that number; 0: no acknowledgement is expected.
  void handed_out(const can::Frame& frame, std::uint64_t number);
  // The bus acknowledged the frames up to that number.
  void acknowledged(std::uint64_t number);
  // The frames first..last will never be sent: their outputs are sent again.
  void lost(std::uint64_t first, std::uint64_t last);

  // The progress of the newest value of an output entry.
  enum class Progress : std::uint8_t {
    waits,     // until the own node is Operational, or the PDO engine has room
    sent,      // passed to the PDO engine: the frame is under way
    confirmed  // the bus acknowledged it, or the scanner list lacks the entry
  };
  Progress progress(std::uint32_t entry) const;
  // The frame with the newest value.
  can::Frame frame_of(std::uint32_t entry) const;
  // The TPDO in source address mode; 0 if there is none.
  std::uint16_t tpdo() const;

 private:
  struct Output {
    std::uint32_t entry = 0;
    std::optional<std::uint64_t> sent{};  // the value passed to the PDO engine
    std::uint64_t number = 0;             // of its frame until that is acknowledged
    bool due = false;                     // the newest value must be sent
    bool confirmed = false;               // the newest value was acknowledged
    bool written = false;                 // scratch
  };

  void send();
  void confirm(Output& output);

  const LineConfig& config_;
  node::Node& node_;
  image::ProcessImage& image_;
  const FlyingMasterService& flying_;
  std::vector<Output> outputs_;
  bool due_ = false;          // some outputs are due
  bool passive_ = false;      // another flying master was active at the last follow_role()
  std::uint64_t starts_ = 0;  // starts of the own node at the last follow_state()
};

}  // namespace linegate::line
