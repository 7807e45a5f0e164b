// SPDX-License-Identifier: Apache-2.0
// What a line may show of its outputs, from what was on the bus and what the devices have.
//
// The invariant, after each step of a world:
//   1. An output entry is valid only while the line shows its node as present and Operational.
//   2. It is valid only if its value is that of the newest frame of its PDO that the bus
//      acknowledged, and the line submitted that frame after it received the newest sign that the
//      node was not Operational (boot-up message, heartbeat, or guard answer whose toggle bit is
//      not that of the one before) and after its own newest NMT command that ended Operational.
//   3. If it is valid, the dictionary of the simulated device has the value: when the frame was
//      delivered, or, of a synchronous RPDO, at the SYNC after it.
//   4. While the line runs and is on the bus, the own node and the node are Operational and all
//      entries of a PDO are known: if the newest frame has other values, the line submits another
//      one as soon as the inhibit time is over, or, of a synchronous PDO, after as many SYNC
//      messages as its transmission type says, and its controller has room. A SYNC commits
//      when the line queues it, and may wait there for the bus: which PDOs are due after it is
//      decided then. So one that waits counts only for values that the image had when it was
//      queued, whenever it is submitted. No second one is queued meanwhile, so a newer value waits
//      for at most one SYNC more.
//   5. The same if no frame was submitted since the start of the node, 100 ms after it, and after
//      three signs of a node with error control that it is Operational, since the last NMT command
//      to it that ends Operational: the first ones may have been on their way. The command counts
//      until the line hears of its acknowledgement, which is when those of all frames before it are
//      there; one that the line was given counts, though it never got onto the bus. Of one without
//      error control, after an NMT start. What was submitted before the start counts for nothing.
//      The line does not boot the node meanwhile, which may configure its RPDOs: that the line
//      shows its boot status as unfinished is no excuse unless the bus shows a boot process, too:
//      the line reset the node or requested 1000h, and since then no two SDO requests to the node
//      were 2 s apart.
//   6. Nothing older follows anything newer: a frame of an event-driven PDO has the values of the
//      image of the time when the line submits it, one of a synchronous PDO those of the SYNC
//      before it, of an own one those of the time when the line submits it. So the first frame of
//      each PDO after a start of its node has the newest values, each later one those or newer
//      ones, and values between two frames may be left out. PDOs with different COB-IDs have the
//      order of the bus: a newer value of one may come before the first frame of another.
//
// Clause 3 has these exceptions, and no others:
//   - The newest frame reached nobody (losses, swallowed frames): until the next frame of the PDO.
//   - Another station sent a frame with the COB-ID of the RPDO, or the object was written by SDO:
//     until the next frame of the line.
//   - The device left Operational (power, cable, by itself, NMT command of another master), and
//     none of these happened since: the line received a sign as in 2 from it; the line shows it as
//     not present or not Operational; the line sent it an NMT command that ends Operational. A
//     device without error control gives no sign but its boot-up message. The same holds from a
//     heartbeat on that a device left in its controller when it was switched off or left
//     Operational without a bus, and that the bus model transmits afterwards.
//   - The device was not Operational when the frame passed, and the state that the line showed
//     followed from a command of its own that no heartbeat or guard answer had confirmed (a device
//     without error control that missed NMT start): until the next frame of the PDO.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "bridges/sim/bus.h"
#include "stack/can/frame.h"
#include "stack/line/line.h"

namespace linegate::plant {

struct LineSeat;

class OutputModel {
 public:
  explicit OutputModel(const line::Line& line);

  // The line is about to be given it.
  void commanded(LineSeat& seat, const line::Command& command);
  // The line submits it to the bus.
  void submitted(LineSeat& seat, const can::Frame& frame, Instant now);
  // The line is about to be called, or was called: it may have passed a SYNC in between. advanced:
  // it was advanced, which is when it passes its own ones.
  void look_at_sync(LineSeat& seat, Instant now, bool advanced = false);
  // The line is about to hear that the bus acknowledged its frames up to that number, 1 = the
  // first.
  void acknowledged(std::uint64_t number);
  // The frames of the line that did not end are gone.
  void flushed();
  // It ended on the bus; the stations have not processed it yet.
  void ended(LineSeat& seat, const can::Frame& frame, sim::Bus::Endpoint sender, sim::Fate fate);
  // After all stations processed what was due. A sentence about the first entry for which the
  // invariant does not hold; empty if there is none.
  std::string compare(LineSeat& seat, Instant now);

  // Valid entries that were compared with the dictionary of their device.
  std::uint64_t compared() const { return compared_; }

 private:
  struct Field {
    std::size_t entry = 0;  // in the output layout
    od::Address address;    // in the dictionary of the device
    unsigned frame_bit = 0;
    unsigned image_bit = 0;
    unsigned bits = 0;
  };
  struct Pdo {
    std::uint8_t node = 0;
    std::uint16_t number = 0;  // of the RPDO
    can::CobId cob_id;
    std::uint8_t type = 0;
    Duration inhibit{};
    std::vector<Field> fields;
    can::Frame newest;         // submitted by the line
    bool transmitted = false;  // ... since the start of the node
    // Frames that were submitted and did not end, oldest first: submitted since then?
    std::deque<bool> under_way;
    can::Frame acknowledged;       // the newest that ended
    bool is_acknowledged = false;  // ... and was submitted since the start of the node
    bool lost = false;
    bool written_by_others = false;
    bool unconfirmed = false;  // the device missed it, see the last exception
    bool awaits_sync = false;
    Instant free_at{};         // end of the inhibit time
    std::uint64_t wanted = 0;  // what the image has, as a frame carries it
    Instant due_at = kNever;   // since when it differs from the newest frame, or the grace after
    std::uint32_t due_sync = 0;
    std::uint64_t before_sync = 0;  // what the image had before the call in which SYNC passed
    std::uint64_t at_sync = 0;      // ... and after it
    std::uint64_t latest = 0;       // ... when it was looked at last
  };
  struct Node {
    bool guarded = false;
    Duration period{};   // of its heartbeats or guard requests, 0 = none
    unsigned signs = 0;  // that it is Operational, since the last that it is not
    std::uint64_t end =
        0;               // frame of the newest NMT command that ends Operational, 0 = acknowledged
    Instant boots_at{};  // newest frame of its boot process, as the bus shows it
    bool booted_now = false;
    bool signed_now = false;
    Instant signed_at{};
    std::byte toggle{0x80};    // of its newest guard answer
    bool operational = false;  // the device, when it was looked at last
    bool commanded = false;    // the line sent it a command that ends Operational
    bool unnoticed = false;    // it left Operational, see the third exception
    bool shown = false;        // the line shows it as present and Operational
    bool confirmed = false;    // ... by a message of the node
  };

  void pdo_ended(LineSeat& seat, Pdo& pdo, const can::Frame& frame, bool by_line, sim::Fate fate);
  void follow_command(const can::Frame& frame, std::uint8_t id);
  void state_ended(LineSeat& seat, const can::Frame& frame);
  void withdraw(std::uint8_t node);
  void forget_frames(std::uint8_t node);
  void look_at(LineSeat& seat, std::uint8_t id);
  std::uint64_t values(const Pdo& pdo) const;
  static std::uint64_t carried(const Pdo& pdo, const can::Frame& frame);
  void follow_boot(const can::Frame& frame, std::uint8_t id, Instant now);
  void hand_out_sync(LineSeat& seat, Instant now);
  void check_order(LineSeat& seat, const Pdo& pdo, const can::Frame& frame, Instant now);
  std::string compare(LineSeat& seat, Pdo& pdo);
  std::string check_due(LineSeat& seat, Pdo& pdo, Instant now);
  std::uint32_t due_sync_of(const Pdo& pdo) const;
  std::string compare_device(LineSeat& seat, const Field& field, std::uint64_t shown,
                             std::uint8_t node);

  std::vector<Pdo> pdos_;
  std::vector<std::uint8_t> ids_;  // of the nodes that have one
  std::array<Node, 128> nodes_{};
  std::uint64_t compared_ = 0;
  std::uint64_t submitted_ = 0;  // frames of the line
  std::uint32_t syncs_ = 0;      // SYNC messages that the line submitted
  bool sync_waits_ = false;      // one that it passed is not submitted yet
  std::uint32_t passed_ = 0;     // that it passed, its own ones and others
  Instant passed_at_{};
  std::string older_;  // of a frame with values that are not the newest
  image::Snapshot snapshot_;
};

}  // namespace linegate::plant
