// SPDX-License-Identifier: Apache-2.0
// Which outputs of an own device are valid: of LineConfig::devices, or the own node of a line with
// its own_objects (OwnOutputs). Private to stack/line.
//
// An output is valid only while its device is Operational, and only if a TPDO of the device, or an
// MPDO in source address mode, transmitted its newest value since the device entered that state. An
// output that neither carries at present is valid there when it is known, because its master reads
// it by SDO.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/image/process_image.h"
#include "stack/line/frames_under_way.h"
#include "stack/line/output_state.h"
#include "stack/node/node.h"
#include "stack/pdo/engine.h"

namespace linegate::line {

class TransmittedOutputs {
 public:
  // The image must outlive it. Precondition: it does not make these outputs valid by itself, see
  // ProcessImage::follow_transmission() and set_listener().
  explicit TransmittedOutputs(image::ProcessImage& image) : image_(image) {}

  // The device has these entries of the output layout (ascending, without gaps) and no PDOs yet:
  // none is valid until follow().
  void assign(std::span<const std::uint32_t> entries);
  // Follows the mappings of the TPDOs and the scanner list if they have changed. A value that one
  // of its previous TPDOs still carries stays transmitted.
  void follow(const pdo::Engine& pdos);

  // The device has another value of the entry.
  void changed(std::uint32_t entry);
  // The entry was written, with the same value or another one.
  void written(std::uint32_t entry);
  // The device reported the value of that object as changed, or wrote it: requests its TPDOs if the
  // value was not transmitted, and nothing else will do so. A value that returns to that of the
  // last sample is no change for its TPDO.
  void request(od::Address address, pdo::Engine& pdos, Instant now) const;
  bool is_transmitted(std::uint32_t entry) const { return output(entry).is_transmitted; }
  // See pdo::Listener::tpdo_transmitted().
  void transmitted(std::uint16_t tpdo, std::span<const std::byte> differs);
  // See pdo::Listener::mpdo_transmitted().
  void transmitted(od::Address source);
  // Requests the MPDOs of all known outputs that were not transmitted and are not on their way: the
  // engine requests none on entering Operational.
  void request_mpdos(pdo::Engine& pdos, Instant now);
  // The same if the TPDO that sends MPDOs was switched on, or has another COB-ID, since the last
  // call of either.
  void request_new_mpdos(pdo::Engine& pdos, Instant now);
  // The device entered or left Operational.
  void set_operational(bool operational);
  // Until the bus is back, nothing is transmitted.
  void lose_bus();
  // Requests the TPDOs of the values that were not transmitted before or since, and the MPDOs
  // unless the caller does so later. No effect if the bus was not lost.
  void find_bus(pdo::Engine& pdos, Instant now, bool with_mpdos = true);

  // What the entry waits for while the device is Operational. stuck: see Line::bus_is_stuck().
  // Precondition: it is known and not valid.
  OutputWait reason_of(std::uint32_t entry, const pdo::Engine& pdos, bool stuck) const;
  // The frames of that device that send the output: any of its TPDOs, or its MPDO. Empty if none
  // does at present.
  std::vector<FramesUnderWay::Awaited> frames_of(std::uint32_t entry, const node::Node& node) const;
  // MPDOs send it.
  bool is_scanned(std::uint32_t entry) const { return output(entry).is_scanned; }

 private:
  struct Output {
    bool is_carried = false;  // by a TPDO
    bool is_scanned = false;  // by MPDOs in source address mode
    bool is_transmitted = false;
  };
  struct Carried {
    pdo::Engine::SentObject object;
    std::uint32_t entry = 0;

    std::uint16_t tpdo() const { return object.tpdo; }
    bool operator==(const Carried&) const = default;
  };
  struct Object {
    od::Address address;
    std::uint32_t entry = 0;
  };

  void forget();
  void refresh();
  const Object* find(od::Address address) const;
  bool awaits_trigger(std::uint32_t entry, const pdo::Engine& pdos) const;
  Output& output(std::uint32_t entry) { return outputs_[entry - first_]; }
  const Output& output(std::uint32_t entry) const { return outputs_[entry - first_]; }
  std::uint32_t entry_of(std::size_t position) const {
    return first_ + static_cast<std::uint32_t>(position);
  }

  image::ProcessImage& image_;
  std::uint32_t first_ = 0;       // entry of outputs_.front()
  std::vector<Output> outputs_;   // by entry
  std::vector<Object> objects_;   // of the entries, ascending by address
  std::vector<Carried> carried_;  // ascending by TPDO
  std::uint64_t revision_ = 0;    // of the engine at the last follow(); 0 = none since assign()
  can::CobId scanning_{can::CobId::kInvalidBit};  // of the TPDO that sends MPDOs
  bool are_mpdos_new_ = false;  // it was switched on or changed since the last request_mpdos()
  bool is_operational_ = false;
  bool is_bus_lost_ = false;
};

}  // namespace linegate::line
