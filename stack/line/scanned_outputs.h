// SPDX-License-Identifier: Apache-2.0
// Outputs that go by MPDO in source address mode: objects of the own node in the outputs of the
// image, which the object scanner list names (CiA 301 7.2.2.6) and no PDO carries. Private to
// stack/line.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "stack/can/frame.h"
#include "stack/image/process_image.h"
#include "stack/line/config.h"
#include "stack/node/node.h"

namespace linegate::line {

class ScannedOutputs {
 public:
  // node: the own one. All must outlive it. There are none without a scanner list.
  ScannedOutputs(const LineConfig& config, node::Node& node, image::ProcessImage& image);

  bool empty() const { return outputs_.empty(); }

  // Those bits of the outputs were written. always: sent although nothing has changed.
  void written(std::uint32_t bit_offset, std::uint32_t bits, bool always);
  // On entering Operational all that are known are sent: the PDO engine dropped what waited when it
  // was left, be it for a moment only.
  void follow_state();
  // A frame was handed out with that number; 0: no acknowledgement is expected.
  void handed_out(const can::Frame& frame, std::uint64_t number);
  // The bus acknowledged the frames up to that number.
  void acknowledged(std::uint64_t number);
  // The frames first..last never get onto the bus: those outputs are sent again.
  void lost(std::uint64_t first, std::uint64_t last);

  // How far the newest value of that entry of the outputs is.
  enum class Progress : std::uint8_t {
    waits,     // for the own node to be Operational, or for room in the PDO engine
    sent,      // to the PDO engine: the frame is under way
    confirmed  // the bus acknowledged it; or the list does not have the entry
  };
  Progress progress(std::uint32_t entry) const;
  // With the newest value.
  can::Frame frame_of(std::uint32_t entry) const;
  // The TPDO in source address mode; 0 if there is none.
  std::uint16_t tpdo() const;

 private:
  struct Output {
    std::uint32_t entry = 0;
    std::optional<std::uint64_t> sent{};  // the value that the PDO engine took
    std::uint64_t number = 0;             // of its frame, while it is under way to the bus
    bool due = false;                     // the newest value has to be sent
    bool confirmed = false;               // it was acknowledged
    bool written = false;                 // scratch
  };

  void send();
  void confirm(Output& output);

  const LineConfig& config_;
  node::Node& node_;
  image::ProcessImage& image_;
  std::vector<Output> outputs_;
  bool due_ = false;          // some of them are
  std::uint64_t starts_ = 0;  // of the own node, as follow_state() saw them
};

}  // namespace linegate::line
