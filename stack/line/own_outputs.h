// SPDX-License-Identifier: Apache-2.0
// The outputs of a line that are objects of its own node (own_objects): which of them are valid,
// and the MPDOs in source address mode (CiA 301 7.2.2.6) that send them. Private to stack/line.
//
// The PDO engine requests the TPDOs that map such objects when their bytes of the image are
// written. MPDOs are requested here.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "stack/image/process_image.h"
#include "stack/line/config.h"
#include "stack/line/flying_master_service.h"
#include "stack/line/frames_under_way.h"
#include "stack/line/transmitted_outputs.h"
#include "stack/node/node.h"

namespace linegate::line {

class OwnOutputs final : public image::OutputListener {
 public:
  // node: the own node, whose PDOs are not configured yet. All must outlive it.
  OwnOutputs(const LineConfig& config, node::Node& node, image::ProcessImage& image,
             const FlyingMasterService& flying);

  bool empty() const { return values_.empty(); }

  // The application wrote those bits of the outputs, and their TPDOs were requested. always: sends
  // unchanged values by MPDO, too.
  void written(std::uint32_t bit_offset, std::uint32_t bits, bool always, Instant now);
  // Follows the PDO records and the scanner list. While another flying master is active, MPDOs are
  // not requested; those that are missing are requested afterwards.
  void advance(Instant now);
  // Another flying master is active: drops the MPDOs that wait.
  void give_up();

  // See node::MasterServices.
  void state_changed(nmt::State state, Instant now);
  void tpdo_transmitted(std::uint16_t number, std::span<const std::byte> differs);
  void mpdo_transmitted(od::Address source);
  // The bus was lost, or the network sleeps: nothing is transmitted until it is back.
  void lose_bus();
  void find_bus(Instant now);

  // Precondition of the following functions: the entry is one of these outputs.
  // While the node boots: whether a reset has replaced the value that was written last.
  bool is_reset(std::uint32_t entry) const;
  // See TransmittedOutputs.
  OutputWait reason_of(std::uint32_t entry, bool stuck) const;
  // The frames that send the output: any of its TPDOs, or its MPDO. Empty if it is read by SDO.
  std::vector<FramesUnderWay::Awaited> frames_of(std::uint32_t entry);

 private:
  void output_written(std::uint32_t entry) override;
  od::Address address_of(std::uint32_t entry) const;

  const LineConfig& config_;
  node::Node& node_;
  image::ProcessImage& image_;
  const FlyingMasterService& flying_;
  TransmittedOutputs transmitted_;
  std::uint32_t first_ = 0;            // entry of values_.front()
  std::vector<std::uint64_t> values_;  // by entry, as of the last write
  bool passive_ = false;               // another flying master was active at the last advance()
};

}  // namespace linegate::line
