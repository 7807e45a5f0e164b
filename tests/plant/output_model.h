// SPDX-License-Identifier: Apache-2.0
// The permitted validity of the outputs of a line, derived from the frames on the bus and the
// values in the devices.
//
// The invariant, after each step of a world:
//   1. An output entry is valid only while the line shows its node as present and Operational, and,
//      if the line boots the node, its boot process has configured it since the node restarted or
//      was found running: before that its PDOs may not be those of the image. A line that has
//      given up its role holds back only the PDOs of nodes whose last boot process was refused one
//      of them. Clauses 4 and 5 do not apply to a node that is not booted.
//   2. It is valid only if its value is that of the newest frame of its PDO that the bus
//      acknowledged, and the line submitted that frame after it received the newest sign that the
//      node was not Operational (boot-up message, heartbeat, or guard response whose toggle bit
//      differs from the previous one) and after its own newest NMT command that ended Operational.
//   3. If it is valid, the dictionary of the simulated device has the value: from the delivery of
//      the frame on, or, for a synchronous RPDO, from the SYNC after it.
//   4. While the line runs and is on the bus, the own node and the node are Operational and all
//      entries of a PDO are known: if the newest frame has other values, the line submits another
//      frame as soon as the inhibit time has passed, or, for a synchronous PDO, after the number of
//      SYNC messages in its transmission type, and its controller has room. A SYNC commits when the
//      line queues it, and may wait there for the bus: the PDOs that are due after it are
//      determined then. So a waiting SYNC counts only for values that the image had when it was
//      queued, whenever it is submitted. No second SYNC is queued meanwhile, so a newer value waits
//      for at most one more SYNC. From the boot-up message of the own node on they are counted
//      anew.
//   5. The same if no frame was submitted since the start of the node, 100 ms after the start, and,
//      for a node with error control, after three signs that it is Operational, since the last NMT
//      command to it that ends Operational: the first signs may have been under way. The command
//      counts until its acknowledgement is reported to the line, which is when all frames before it
//      are acknowledged; a command that was given to the line counts, although it never got onto
//      the bus. For a node without error control, after an NMT start. Frames submitted before the
//      start do not count. The line does not boot the node meanwhile, because a boot process may
//      configure its RPDOs: an unfinished boot status is an exception only if the bus shows a boot
//      process, too: the line reset the node or requested 1000h, and since then no two SDO requests
//      to the node were 2 s apart.
//   6. No older value follows a newer one: a frame of an event-driven PDO has the values of the
//      image when the line submits it, a frame of a synchronous PDO the values at the SYNC before
//      it, or, for an own SYNC, when the line submits that SYNC. So the first frame of each PDO
//      after a start of its node has the newest values, each later frame has the same values or
//      newer ones, and values between two frames may be omitted. PDOs with different COB-IDs have
//      the order of the bus: a newer value of one may precede the first frame of another.
//
// Clause 3 has these exceptions, and no others:
//   - The newest frame reached no station (losses, swallowed frames): until the next frame of the
//     PDO.
//   - Another station sent a frame with the COB-ID of the RPDO, or the object was written by SDO,
//     or with another value by another RPDO of the device: until the next frame of the line.
//   - The device left Operational (power, cable, spontaneously, NMT command of another master), and
//     none of these happened since: the line received a sign as in 2 from it; the line shows it as
//     not present or not Operational; the line sent it an NMT command that ends Operational. A
//     device without error control gives no sign except its boot-up message. The same holds from a
//     heartbeat on that remained in the controller of a device when it was switched off or left
//     Operational without a bus, and that the bus model transmits afterwards.
//   - A device without error control restarted, and the line did not receive its boot-up message,
//     because it was off the bus or the frame was lost: until the next boot-up message. The device
//     may have other PDOs than before. The same while the boot-up message waits in the controller
//     of the device: on a bus without acknowledgements it waits for all frames with a lower
//     identifier, also for NMT commands, SYNC messages and PDOs of the line, and nothing that the
//     line can receive shows the restart before. An NMT command of the line does not end this
//     exception, because it changes the NMT state and not the PDOs of the device. The same for a
//     guarded device: it answers requests after a restart as if it had left Operational by itself,
//     if the toggle bit is the expected one.
//   - The device was not Operational when the frame passed, and the state that the line showed
//     followed from a command of its own that no heartbeat or guard response had confirmed (a
//     device without error control that missed the NMT start): until the next frame of the PDO.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "bridges/sim/bus.h"
#include "stack/can/frame.h"
#include "stack/line/line.h"

#include "tests/plant/output_fields.h"

namespace linegate::plant {

struct LineSeat;

class OutputModel {
 public:
  explicit OutputModel(const line::Line& line);

  // Call it before the line is given the command.
  void commanded(LineSeat& seat, const line::Command& command);
  // Call it when the line submits the frame to the bus.
  void submitted(LineSeat& seat, const can::Frame& frame, Instant now);
  // Call it before and after each call of the line, which may process a SYNC. advanced: the call
  // was advance(), in which the line processes its own SYNCs.
  void look_at_sync(LineSeat& seat, Instant now, bool advanced = false);
  // Call it before the line learns that the bus acknowledged its frames up to that number, 1 = the
  // first.
  void acknowledged(std::uint64_t number);
  // The frames of the line that did not end are discarded.
  void flushed();
  // Call it when a device submits the frame to the bus.
  void submitted_by_device(const can::Frame& frame);
  // The frame ended on the bus; the stations have not processed it yet.
  void ended(LineSeat& seat, const can::Frame& frame, sim::Bus::Endpoint sender, sim::Fate fate);
  // Call it after all stations processed what was due. Returns a description of the first entry
  // that violates the invariant; empty if there is none.
  std::string compare(LineSeat& seat, Instant now);

  // Number of valid entries that were compared with the dictionary of their device.
  std::uint64_t compared() const { return compared_; }

 private:
  struct Field {
    std::size_t entry = 0;  // index in the output layout
    od::Address address;    // in the dictionary of the device
    unsigned frame_bit = 0;
    unsigned image_bit = 0;
    unsigned bits = 0;
    // Another RPDO of the device wrote another value since the newest frame
    bool overwritten = false;
  };
  struct Pdo {
    std::uint8_t node = 0;
    std::uint16_t number = 0;  // number of the RPDO
    can::CobId cob_id;
    std::uint8_t type = 0;
    Duration inhibit{};
    std::vector<Field> fields;
    can::Frame newest;         // the newest frame that the line submitted
    bool transmitted = false;  // `newest` was submitted since the start of the node
    // For each submitted frame that did not end, oldest first: submitted since the start of the
    // node?
    std::deque<bool> under_way;
    can::Frame acknowledged;       // the newest frame that ended
    bool is_acknowledged = false;  // `acknowledged` was submitted since the start of the node
    bool lost = false;
    bool written_by_others = false;
    bool unconfirmed = false;  // the device missed it, see the last exception
    bool awaits_sync = false;
    Instant free_at{};   // end of the inhibit time
    PdoValues wanted{};  // the values of the image in the form of a frame
    // Since when `wanted` differs from the newest frame, or the end of the grace period
    Instant due_at = kNever;
    std::uint32_t due_sync = 0;
    PdoValues before_sync{};  // values of the image before the call that processed SYNC
    PdoValues at_sync{};      // values of the image after that call
    PdoValues latest{};       // values of the image at the last look
  };
  struct Node {
    bool guarded = false;
    Duration period{};  // period of its heartbeats or guarding requests, 0 = none
    // Number of signs that it is Operational, since the last sign that it is not
    unsigned signs = 0;
    std::uint64_t end =
        0;  // frame of the newest NMT command that ends Operational, 0 = acknowledged
    // No boot process has compared them since its restart, or the last one was refused a PDO
    bool other_pdos = false;
    Instant boots_at{};  // time of the newest frame of its boot process on the bus
    bool restarted_unheard = false;
    unsigned boot_ups_waiting = 0;  // number of boot-up messages in the controller of the device
    bool booted_now = false;
    bool signed_now = false;
    Instant signed_at{};
    std::byte toggle{0x80};    // of its newest guard response
    bool operational = false;  // state of the device at the last look
    bool commanded = false;    // the line sent it a command that ends Operational
    bool unnoticed = false;    // it left Operational, see the third exception
    bool shown = false;        // the line shows it as present and Operational
    bool confirmed = false;    // a message of the node confirmed `shown`
  };

  void pdo_ended(LineSeat& seat, Pdo& pdo, const can::Frame& frame, bool by_line, sim::Fate fate);
  void note_shared(Pdo& pdo, const can::Frame& frame);
  void follow_command(const can::Frame& frame, std::uint8_t id);
  void state_ended(LineSeat& seat, const can::Frame& frame);
  void withdraw(std::uint8_t node);
  void forget_frames(std::uint8_t node);
  void look_at(LineSeat& seat, std::uint8_t id);
  static bool manages(const line::Line& line);
  static bool is_to_boot(const LineSeat& seat, std::uint8_t id);
  PdoValues values(const Pdo& pdo) const;
  static PdoValues carried(const Pdo& pdo, const can::Frame& frame);
  void follow_boot(const can::Frame& frame, std::uint8_t id, Instant now);
  void hand_out_sync(LineSeat& seat, Instant now);
  void check_order(LineSeat& seat, const Pdo& pdo, const can::Frame& frame, Instant now);
  std::string compare(LineSeat& seat, Pdo& pdo);
  std::string check_due(LineSeat& seat, Pdo& pdo, Instant now);
  std::uint32_t due_sync_of(const Pdo& pdo) const;
  std::string compare_device(LineSeat& seat, const Field& field, std::uint64_t shown,
                             std::uint8_t node);

  std::vector<Pdo> pdos_;
  std::vector<std::uint8_t> ids_;  // node-IDs with a PDO
  std::array<Node, 128> nodes_{};
  std::uint64_t compared_ = 0;
  std::uint64_t submitted_ = 0;  // number of frames of the line
  std::uint32_t syncs_ = 0;      // number of SYNC messages that the line submitted
  bool sync_waits_ = false;      // a processed SYNC is not submitted yet
  // Number of SYNC messages that the line processed, own ones and others
  std::uint32_t passed_ = 0;
  Instant passed_at_{};
  std::string older_;  // description of a frame whose values are not the newest
  image::Snapshot snapshot_;
};

}  // namespace linegate::plant
