// SPDX-License-Identifier: Apache-2.0
// All PDOs of one node, compiled into a flat plan: sources and destinations are determined when a
// record changes, and a received frame only executes the plan.
//
// The engine reads the records 1400h.., 1600h.., 1800h.., 1A00h.. of the dictionary, observes
// writes to them as their od::Hook (and refuses what CiA 301 refuses), and registers COB-IDs with
// Dispatch. Mapped values are accessed by pointer: in the dictionary's own storage, or in the
// process image that the variable is bound to; then the image's marks are updated as well. When an
// object is added, removed or moved at run time, the PDOs that map it are compiled again; those
// that map a removed object stop and are reported as unusable until it is added again.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/dispatch.h"
#include "stack/can/frame.h"
#include "stack/can/traffic.h"
#include "stack/can/transmit_queue.h"
#include "stack/od/dictionary.h"
#include "stack/pdo/mpdo.h"
#include "stack/pdo/parameters.h"
#include "stack/pdo/reception.h"

namespace linegate::image {
class ProcessImage;
}
namespace linegate::emcy {
class Producer;
}

namespace linegate::pdo {

struct LinkPlan;
struct Tpdo;

// Counters that never decrease.
struct EngineCounters {
  std::uint64_t received = 0;   // processed RPDOs
  std::uint64_t too_short = 0;  // RPDOs that were not processed (EMCY 8210h)
  std::uint64_t too_long = 0;   // RPDOs whose excess bytes were ignored (EMCY 8220h)
  std::uint64_t sent = 0;
  std::uint64_t mpdos_received = 0;   // well-formed MPDOs for this device; also in received
  std::uint64_t mpdos_refused = 0;    // of these: the value could not be written
  std::uint64_t mpdos_malformed = 0;  // not an MPDO, or of the other mode than their RPDO
  std::uint64_t asked = 0;            // remote frames sent for RPDOs
  // Synchronous RPDOs received, and TPDOs due to be sent, after the window of the SYNC: dropped.
  std::uint64_t after_window = 0;
  std::uint64_t coalesced = 0;  // a newer sample replaced one that was not sent yet
  // Queued RPDO receptions that were dropped because the queue was full.
  std::uint64_t receptions_lost = 0;
};

// PDO events for the device profile or the application. Called from within receive(), sync() and
// advance().
class Listener {
 public:
  virtual ~Listener() = default;
  virtual void rpdo_received(std::uint16_t number, Instant now);  // the values were written
  virtual void before_tpdo(std::uint16_t number);  // the values are about to be sampled
  // See Engine::follow_transmission(). The bus acknowledged a frame of the TPDO: its receivers have
  // the present values, except the bits that are set in `differs`, which is laid out as the frame.
  virtual void tpdo_transmitted(std::uint16_t number, std::span<const std::byte> differs);
  // The same for an MPDO in source address mode: its receivers have the present value of `source`.
  virtual void mpdo_transmitted(od::Address source);
  // A frame of the wrong length (EMCY 8210h, 8220h), or a missed deadline (EMCY 8250h).
  virtual void rpdo_wrong_length(std::uint16_t number, unsigned mapped, unsigned received);
  virtual void rpdo_deadline(std::uint16_t number);
  virtual void rpdo_recovered(std::uint16_t number);  // the first frame after a missed deadline
  // The value of an MPDO was written. May be called several times for one frame.
  virtual void mpdo_received(std::uint16_t number, od::Address place, Instant now);
  // An MPDO for this device addresses an object that does not exist or cannot be written (EMCY
  // 8230h in destination address mode).
  virtual void mpdo_refused(std::uint16_t number, MpdoMode mode, od::Address place, AbortCode why);
  virtual void mpdo_malformed(const can::Frame& frame);
  // Such an error has ended: after a wrong length a frame of the right length was received, or the
  // RPDO was changed or removed. Also called from within configure() and writes to the records.
  virtual void rpdo_in_order(std::uint16_t number);
  // A valid PDO cannot be used: a COB-ID, an entry or the length (sub 0) of its records is wrong.
  // Reported when it begins, when the reason changes, and by every configure(). Called from within
  // configure() and writes to the records.
  virtual void pdo_unusable(od::Address place, AbortCode why);
};

// A handle for a value of the device that one TPDO sends. It saves the look-up that Engine::set()
// would need each time.
class TpdoValue {
 private:
  friend class Engine;

  std::byte* data_ = nullptr;   // start of a 64-bit word
  std::uint64_t mask_ = 0;      // bits of the value
  std::uint64_t revision_ = 0;  // of the engine, and whether the TPDO is direct: see Engine::Impl
  Tpdo* pdo_ = nullptr;         // that sends it; exists as long as the handle is valid
};

class Engine {
 public:
  // image may be nullptr (a device without one). All arguments must outlive the engine.
  Engine(od::Dictionary& dictionary, can::Dispatch& dispatch, EventLog& events,
         image::ProcessImage* image);
  ~Engine();
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  // every_frame: whether to call rpdo_received() and before_tpdo(), which costs time for every
  // frame.
  void set_listener(Listener* listener, bool every_frame = true);

  // Copies the manager's PDOs to and from the locations in the plan; their communication parameters
  // are read from the dictionary where it has records (numbers 1..512), else from the plan. The
  // plan is copied and applies to every later configure(). Precondition: the image has the plan's
  // layouts.
  void link(const LinkPlan& plan);

  // Node-ID of the device, for MPDOs; 1..127.
  void set_node_id(std::uint8_t node_id);

  // Largest PDO in bytes: 8, or 64 on a CAN FD line. Precondition: before configure().
  void set_max_length(std::size_t bytes);

  // Calls Listener::tpdo_transmitted() from now on, for TPDOs that are not linked and no MPDOs, and
  // mpdo_transmitted(). Frames that were handed out before the node left Operational, or before
  // their TPDO was changed, do not count. Precondition: before configure().
  void follow_transmission();
  // The frames that were handed out until now do not count either: the bus was lost.
  void forget_transmission();

  // Sets the time of subsequent writes. advance() does so too.
  void pass_time(Instant now);

  // Object 1007h: how long after a SYNC synchronous PDOs are received and sent; 0 = until the next
  // SYNC. Later PDOs are dropped. Before the first SYNC there is no window.
  void set_sync_window(Duration window);

  // Reads and compiles all PDO records. A PDO that cannot be compiled stays inactive, and is
  // reported in the result and to the listener.
  std::vector<Diagnostic> configure();

  // Whether a valid PDO cannot be used, see Listener::pdo_unusable().
  bool any_unusable() const;

  // Enters or leaves Operational. PDOs are received (but see keep_early()), sampled and sent only
  // in Operational. Entering requests every event-driven TPDO once, so that consumers get initial
  // values.
  void set_operational(bool operational, Instant now);

  // Whether to keep the last frame of each RPDO passed to receive() outside of Operational, and to
  // process it on entering Operational: an event-driven one at once, a synchronous one at the next
  // SYNC. For an NMT master in Pre-operational, which waits for nodes while others are already
  // started and send values that they will not repeat (CiA 302-2). false also drops the kept
  // frames, unless the engine is Operational.
  void keep_early(bool keep);

  // Hot. Processes frames from the front as long as each is used by one RPDO only and just needs to
  // be copied (or kept for SYNC). Returns their number, and adds them to traffic. Pass the next
  // frame to its service by Dispatch. Uses frame.time. No allocation, lock, exception.
  std::size_t receive_ordinary(std::span<const can::Frame> frames, can::Traffic& traffic);
  // The same for one frame whose only target is RPDO `slot` (can::Target::index); false if it is
  // not processed. Hot.
  bool receive_alone(std::uint16_t slot, const can::Frame& frame, can::Traffic& traffic);
  // Returns the oldest queued reception of the linked RPDOs with a queue (LinkedPdo::queue), in the
  // order of reception; false if there is none. A synchronous RPDO is queued at its reception,
  // before the SYNC. No allocation.
  bool pop_reception(Reception& out);
  // Drops the queued receptions, which count as lost.
  void drop_receptions();
  // Processes any frame. slot: Target::index of Service::rpdo.
  void receive(std::uint16_t slot, const can::Frame& frame);
  // Processes a remote frame on a TPDO's COB-ID.
  void remote_request(std::uint16_t slot, Instant now);
  // SYNC: commits synchronous RPDOs, samples synchronous TPDOs. counter: 0 = none.
  void sync(std::uint8_t counter, Instant now);
  // The SYNC of the last sync() waited for the bus until now: its TPDOs are sampled again, and its
  // window begins now. RPDOs and counts of sync() are unaffected.
  void sync_handed_out(Instant now);

  // Drops PDOs of the node that wait for SYNC, because they are outdated.
  void drop_waiting(std::uint8_t node);

  // TPDOs with output entries of the image are held back, whatever requests them, until all these
  // entries are known. When such a TPDO was transmitted with the newest values, and its receiver is
  // `unknown` or `started`, its entries become valid.

  // State of the receiver of TPDOs:
  //   unknown  the node's state is unknown, and every TPDO counts as received (initial state)
  //   waiting  the node is not started; TPDOs to it are sent when they change, but not on entering
  //            Operational, and their entries are not valid
  //   started  the node is Operational; on entering this state every TPDO to the node is requested
  //            once, changed or not, as by trigger()
  //   unheard  no frame was received from the node, and the line does not boot it: TPDOs to it are
  //            sent as in state unknown, but their entries are not valid
  //   unlike   the node is known to have other PDOs: TPDOs to it are held back, requested ones are
  //            dropped, and their entries are not valid; on leaving this state every TPDO that
  //            other nodes receive, too, is requested once
  enum class Receiver : std::uint8_t { unknown, waiting, started, unheard, unlike };
  // Precondition: node is 1..127. configure() keeps the state.
  void set_receiver(std::uint8_t node, Receiver state);
  Receiver receiver(std::uint8_t node) const;

  // Auto-notify, initially off for all TPDOs: whether a change of a mapped value requests the TPDO,
  // if it is event-driven, or of type 0 (at the next SYNC). For an MPDO in source address mode, the
  // values are the objects of the scanner list; for a linked TPDO, the network variables
  // (A000h..A47Fh) that show its bytes, of any type. The change may be made by SDO, MPDO, or the
  // device through the dictionary. Not detected are a write of the same value, a value received by
  // RPDO, and writes that bypass the dictionary, into a variable's memory or an image, see
  // outputs_written(). number: 1..512; the setting is kept over every configure(), also for TPDOs
  // that do not exist yet. The second form applies to all TPDOs.
  void set_auto_notify(std::uint16_t number, bool wanted);
  void set_auto_notify(bool wanted);

  // The device itself changed a mapped value: requests its event-driven TPDOs, with or without
  // auto-notify.
  void value_changed(od::Address address, Instant now);
  // The handle of the value at that address, for a device that sets it often. Returns nothing if
  // its type is not of fixed size up to 8 bytes, if not exactly one TPDO sends it, if it is stored
  // outside of the dictionary, or if a hook is called when it is written. Valid until revision()
  // changes.
  std::optional<TpdoValue> value(od::Address address) const;
  // Sets the value to the low bits of `number`. A different value requests the TPDO as
  // value_changed() does; the same value has no effect. Hooks and observers of the dictionary are
  // not called. Returns false, without an effect, if the handle is no longer valid: call value()
  // again.
  bool set(const TpdoValue& value, std::uint64_t number);

  // The same for these bits of the image's output area; always: even for TPDOs whose bytes have not
  // changed since they were last sent.
  void outputs_written(std::uint32_t bit_offset, std::uint32_t bits, bool always, Instant now);
  // A faster form for bits from the start of an output entry, all in its PDO. Precondition: the
  // image has the entry.
  void output_written(std::uint32_t entry, std::uint32_t bits, bool always, Instant now);
  // Increases whenever a PDO is added, removed or mapped differently.
  std::uint64_t revision() const;

  // Whether the RPDO missed its deadline. number: 1..
  bool timed_out(std::uint16_t rpdo) const;

  // Requests one TPDO by number, changed or not: an event-driven one at once, one of type 0 at the
  // next SYNC; others are not affected. Returns false if there is no such valid TPDO or the node is
  // not Operational.
  bool trigger(std::uint16_t number, Instant now);

  // Sends the value of the object that the TPDO maps in destination address mode to an object of
  // `consumer`, 0 = all. MPDOs that wait for the inhibit time are sent in order; a newer value to
  // the same destination replaces a waiting one. Returns device_state outside of Operational;
  // no_object if there is no such valid TPDO in that mode; out_of_memory if kMpdosWaiting MPDOs
  // wait, including held ones.
  AbortCode send_mpdo(std::uint16_t number, std::uint8_t consumer, od::Address destination);
  // Sends an object of the device in source address mode, as value_changed() does for the objects
  // of the scanner list; there is space for all of them. Returns no_object also for an object that
  // is not in the list.
  AbortCode send_mpdo(od::Address source);
  static constexpr std::size_t kMpdosWaiting = 64;
  // Drops the MPDOs that wait: all in destination address mode, and those of these objects, of
  // which those that are under way are neither reported nor sent again.
  void drop_mpdos(std::span<const od::Address> sources);

  // For a group of writes: until release(), changed values, trigger() and send_mpdo() request
  // nothing. release() then requests every TPDO once, with its values at that time, and every MPDO
  // once for each of its destinations or sources, with the newest value. SYNC, remote frames, event
  // timers and earlier requests continue.
  void hold();
  void release(Instant now);

  // Requests an RPDO from its producer with a remote frame (CiA 301, 7.2.2.5.2), which is sent in
  // order of priority, and once for all requests until then. Returns false if there is no such
  // valid RPDO, bit 30 of its COB-ID forbids RTR, the line is CAN FD, or the node is not
  // Operational.
  bool request_rpdo(std::uint16_t number);
  // Drops the remote frames that wait.
  void drop_requests();

  // Processes inhibit times, event timers and RPDO deadlines. next_wake() covers time-outs only;
  // wants_to_send() shows whether a frame can be sent already.
  void advance(Instant now);
  // When advance() is due or an inhibit time ends; excludes frames that can be sent already.
  Instant next_wake() const;

  // Returns the requested TPDO with the lowest CAN-ID whose inhibit time has passed. Hot.
  //   number  counts the frames handed to a bus that reports acknowledgements, ascending; 0 = the
  //           bus reports none: the frame counts as transmitted at once
  //   sent    the frame is added to it
  bool next_frame(can::Frame& out, Instant now, std::uint64_t number = 0);
  bool next_frame(can::Frame& out, Instant now, std::uint64_t number, can::Traffic& sent);
  // Sets only identifier and flags of the frame that next_frame() would return now. Returns false
  // if there is none.
  bool peek(can::Frame& out, Instant now);
  // The bus acknowledged the frames up to that number, except lost ones. No allocation.
  void acknowledged(std::uint64_t number);
  // The frames first..last were not sent on the bus, or their fate is unknown: their values stay
  // not valid. TPDOs with output entries, and those of follow_transmission(), are requested again,
  // as by trigger(), unless their receiver is `waiting`. MPDOs in source address mode are requested
  // with the present value.
  void lost(std::uint64_t first, std::uint64_t last);
  // Number of samples of that TPDO since it was configured; 0 if there is no such TPDO. number: 1..
  std::uint64_t samples(std::uint16_t number) const;
  static constexpr std::uint64_t kEverySample = std::numeric_limits<std::uint64_t>::max();
  // Whether the frame is that TPDO with the newest values, or the TPDO has more than `samples`
  // samples and the frame is the last one: values of a TPDO sampled at SYNC may have changed since.
  // number: 1..
  bool carries_newest(std::uint16_t number, const can::Frame& frame,
                      std::uint64_t samples = kEverySample) const;
  // Whether the TPDO is requested by events only, and no request has the newest values of these
  // bits of the output area yet: the next request sends them. number: 1..
  bool awaits_trigger(std::uint16_t number, std::uint32_t bit_offset, std::uint32_t bits) const;
  // An object that a valid TPDO sends, which is neither linked nor an MPDO.
  struct SentObject {
    od::Address address;
    std::uint16_t tpdo = 0;  // its number: 1..
    can::CobId cob_id;
    std::uint16_t frame_bit = 0;  // its first bit in the frame
    std::uint16_t bits = 0;

    bool operator==(const SentObject&) const = default;
    // Whether one of its bits is set.
    bool has_bit(std::span<const std::byte> frame) const;
  };
  // Ascending by TPDO. The same until revision() changes.
  std::vector<SentObject> sent_objects() const;
  // As above, for the bits of that object.
  bool awaits_trigger(const SentObject& object) const;
  // Number of the valid TPDO that sends MPDOs in source address mode; 0 if there is none.
  std::uint16_t scanning_tpdo() const;
  // Its COB-ID; not a valid one if there is none.
  can::CobId scanning_cob_id() const;
  // Whether that TPDO sends the object: it is in the scanner list, exists, and can be mapped. The
  // same until revision() changes.
  bool scans(od::Address source) const;
  // Whether no MPDO with the present value of that object is requested or under way. The latter is
  // known with follow_transmission(). False if not scans(source).
  bool awaits_trigger(od::Address source) const;
  // No frame is requested, not even one that an inhibit time delays: next_frame() would return
  // false. Hot.
  bool quiet() const { return (sending_ | asking_) == 0; }
  bool wants_to_send(Instant now) const;

  const EngineCounters& counters() const;

 private:
  struct Impl;
  std::uint64_t sending_ = 0;  // not 0: TPDOs are requested
  std::uint64_t asking_ = 0;   // not 0: remote frames for RPDOs are requested
  std::unique_ptr<Impl> impl_;
};

}  // namespace linegate::pdo
