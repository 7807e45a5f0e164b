// SPDX-License-Identifier: Apache-2.0
// Links the PDOs of a line's devices to its manager: every TPDO of a device becomes an RPDO of the
// manager that sets input entries, every RPDO a TPDO that sends output entries. The result is the
// layout of the process image and the manager's own PDO records.
//
// To make a line:
//   Loaded<LinkPlan> plan = plan_links(nodes);
//   image::ProcessImage image(plan.value->inputs, plan.value->outputs);
//   add_linked_objects(dictionary, image, *plan.value);      // 1400h.., A000h..
//   pdo::Engine engine(dictionary, dispatch, events, &image);
//   engine.link(*plan.value);                                // then engine.configure()
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "stack/base/diagnostic.h"
#include "stack/base/result.h"
#include "stack/base/time.h"
#include "stack/image/layout.h"
#include "stack/image/process_image.h"
#include "stack/od/description.h"
#include "stack/od/dictionary.h"
#include "stack/pdo/parameters.h"

namespace linegate::pdo {

// A device whose PDOs are to be linked.
struct RemoteNode {
  std::uint8_t id = 0;  // 1..127
  std::string name;
  DevicePdos pdos;                                // see describe_pdos()
  const od::DeviceDescription* device = nullptr;  // types, names, 1000h, 1018h:2; never nullptr
  Duration deadline{};                 // for each of its TPDOs, in whole ms; 0 = not monitored
  std::vector<Parameters> srdos = {};  // that it transmits, as PDOs: see srdo::as_pdo()
};

// A part of a PDO and its location in the image.
struct LinkTarget {
  std::uint32_t frame_bit = 0;  // from the start of the PDO
  std::uint32_t image_bit = 0;  // from the start of the area
  std::uint16_t bits = 0;
};

// One PDO of the manager.
struct LinkedPdo {
  // number: local; cob_id, type, event_timer: as sent or expected by the manager; mapping: the
  // network variables that show the values, or dummy entries for values beyond them.
  Parameters parameters;
  std::uint8_t node = 0;
  std::uint16_t remote_pdo = 0;
  std::uint16_t mapped_bits = 0;   // length of the PDO, fillers included
  std::vector<std::uint8_t> also;  // of a TPDO: other nodes that have an RPDO with its COB-ID
  std::vector<LinkTarget> targets;
  // Of an RPDO: largest number of queued receptions, see Engine::pop_reception(); 0: no queue,
  // only the newest values are kept.
  std::uint32_t queue = 0;
  // An SRDO: its frames are checked elsewhere, and passed to Engine::receive() when they are valid.
  bool is_srdo() const { return image::is_srdo(remote_pdo); }
};

struct LinkPlan {
  image::Layout inputs;
  image::Layout outputs;
  std::vector<LinkedPdo> rpdos;  // ascending by number; numbers above kMaxPdo have no object
  std::vector<LinkedPdo> tpdos;
};

// Local PDO numbers are 1, 2, ... in the order (node, remote number), whatever the order of
// `nodes`; those of SRDOs follow the ones of all TPDOs. Entries have the order of their PDOs; a PDO
// begins at a multiple of the largest alignment of its values, so that a PDO whose values are
// aligned in the frame is one copy. Values of n whole bytes (n <= 8) are located at a multiple of
// n, also for n = 3, 5, 6, 7, so that a network variable of their size can show them. A BOOLEAN
// that is mapped as a byte has one bit here. Other bit lengths are packed, beginning at a new byte
// after a whole-byte value and in every PDO. Names: object_names.h. Dummy entries are fillers of
// the frame and have no entry.
//
// Transmission type: that of the device's PDO if it is synchronous or event-driven; RPDOs of
// devices that answer to remote frames (252, 253) are event-driven, and may be requested by remote
// frame if bit 30 of the device's COB-ID allows it. A TPDO whose receiver monitors it (RPDO event
// timer) gets half that time as its event timer; an event-driven one gets the inhibit time of the
// RPDO.
//
// Left out with a note: RPDOs whose COB-ID is that of a node's TPDO (the nodes are linked
// directly). Left out with a warning: RPDOs with the COB-ID of one already linked; they receive the
// same frame. Errors: two TPDOs with one COB-ID; an area larger than kMaxAreaBytes. The only files
// in diagnostics are device files.
Loaded<LinkPlan> plan_links(std::span<const RemoteNode> nodes);

// Adds the manager's PDO records (1400h.., 1600h.., 1800h.., 1A00h..) and the network variables to
// the dictionary. COB-ID and mapping are read-only, because a change would invalidate the layout.
Result<void> add_linked_objects(od::Dictionary& dictionary, image::ProcessImage& image,
                                const LinkPlan& plan);

// Adds the records of a PDO without a configured device. COB-ID, mapping and all other parameters
// are writable. Its number must be free.
Result<void> add_own_pdo(od::Dictionary& dictionary, PdoKind kind, const Parameters& pdo);

}  // namespace linegate::pdo
