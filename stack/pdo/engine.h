// SPDX-License-Identifier: Apache-2.0
// All PDOs of one node, compiled into a flat plan: what goes where is decided when a record changes
// and merely executed when a frame arrives.
//
// The engine reads the records 1400h.., 1600h.., 1800h.., 1A00h.. of the dictionary, watches writes
// to them as their od::Hook (and refuses what CiA 301 refuses), and registers COB-IDs with
// Dispatch. Mapped values are reached by pointer: in the dictionary's own storage, or in a process
// image the variable is bound to; then the image's marks are kept as well. When an object comes,
// goes or moves at run time, the PDOs that map it are compiled anew; those that map one that is
// gone stop and are told as unusable, until it is there again.
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

// Plain counters; they never go back.
struct EngineCounters {
  std::uint64_t received = 0;   // RPDOs taken over
  std::uint64_t too_short = 0;  // RPDOs not processed (EMCY 8210h)
  std::uint64_t too_long = 0;   // RPDOs of which the first bytes were used (EMCY 8220h)
  std::uint64_t sent = 0;
  std::uint64_t mpdos_received = 0;   // for this device, well-formed; also in received
  std::uint64_t mpdos_refused = 0;    // of these: what could not be written
  std::uint64_t mpdos_malformed = 0;  // no MPDO, or of the other mode than their RPDO
  std::uint64_t asked = 0;            // remote frames sent for RPDOs
  std::uint64_t after_window = 0;  // synchronous RPDOs that came, and TPDOs that would have gone,
                                   // too late after the SYNC: dropped
  std::uint64_t coalesced = 0;     // a newer value replaced one that had not been sent
  std::uint64_t receptions_lost = 0;  // of queued RPDOs: dropped because their queue was full
};

// Told what only the device profile or the application cares about. Called from within receive(),
// sync() and advance().
class Listener {
 public:
  virtual ~Listener() = default;
  virtual void rpdo_received(std::uint16_t number, Instant now);  // values are in place
  virtual void before_tpdo(std::uint16_t number);                 // about to be sampled
  // A frame of the wrong length, or a deadline: for EMCY 8210h, 8220h, 8250h.
  virtual void rpdo_wrong_length(std::uint16_t number, unsigned mapped, unsigned received);
  virtual void rpdo_deadline(std::uint16_t number);
  virtual void rpdo_recovered(std::uint16_t number);  // the first frame after a deadline
  // An MPDO's value is in its place. May be called several times for one frame.
  virtual void mpdo_received(std::uint16_t number, od::Address place, Instant now);
  // An MPDO for this device names what is not there or cannot be written (EMCY 8230h if it came in
  // destination address mode).
  virtual void mpdo_refused(std::uint16_t number, MpdoMode mode, od::Address place, AbortCode why);
  virtual void mpdo_malformed(const can::Frame& frame);
  // No such error is present any more: after a wrong length a frame of the right one came, or the
  // RPDO was changed or is gone. Called from within configure() and writes to the records, too.
  virtual void rpdo_in_order(std::uint16_t number);
  // A valid PDO that cannot be used: a COB-ID, an entry or the length (sub 0) of its records is
  // wrong. Told when it begins and when the reason changes, and by every configure(). Called from
  // within configure() and writes to the records.
  virtual void pdo_unusable(od::Address place, AbortCode why);
};

// A number of the device that one TPDO sends: what Engine::set() would have to look up each time.
class TpdoValue {
 private:
  friend class Engine;

  std::byte* data_ = nullptr;  // of a word
  std::uint64_t mask_ = 0;     // bits of the value
  std::uint64_t revision_ = 0;
  std::uint16_t slot_ = 0;
};

class Engine {
 public:
  // image may be nullptr (a device without one). Everything must outlive the engine.
  Engine(od::Dictionary& dictionary, can::Dispatch& dispatch, EventLog& events,
         image::ProcessImage* image);
  ~Engine();
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  // every_frame: whether rpdo_received() and before_tpdo() are wanted, which cost time with every
  // frame.
  void set_listener(Listener* listener, bool every_frame = true);

  // The manager's PDOs are copied to and from the places of the plan; their communication
  // parameters are read from the dictionary where it has records (numbers 1..512), else from the
  // plan. The plan is copied and holds for every later configure(). Precondition: the plan's
  // layouts are the image's.
  void link(const LinkPlan& plan);

  // Of the device, for MPDOs; 1..127.
  void set_node_id(std::uint8_t node_id);

  // Largest PDO in bytes: 8, or 64 on a CAN FD line. Precondition: before configure().
  void set_max_length(std::size_t bytes);

  // What is written now is written at that time. advance() says so, too.
  void pass_time(Instant now);

  // Object 1007h: for how long after a SYNC synchronous PDOs are received and sent; 0 = until the
  // next one. What is later is dropped. Before the first SYNC there is no window.
  void set_sync_window(Duration window);

  // Reads all PDO records and compiles them. What cannot be compiled stays invalid and is told,
  // here in words and to the listener.
  std::vector<Diagnostic> configure();

  // A valid PDO cannot be used, see Listener::pdo_unusable().
  bool any_unusable() const;

  // Entering or leaving Operational: only then are PDOs received (but see keep_early()),
  // sampled and sent. Entering requests every event-driven TPDO once, so that consumers get first
  // values.
  void set_operational(bool operational, Instant now);

  // Whether the newest frame of each RPDO that is given to receive() outside of Operational is
  // kept, and taken on entering it: an event-driven one then, a synchronous one with the SYNC
  // after. For an NMT master in Pre-operational, which waits for nodes while others are started and
  // send what they will not repeat (CiA 302-2). With false, what is kept is forgotten unless the
  // engine is Operational.
  void keep_early(bool keep);

  // Hot. Takes frames from the front as long as each is wanted by one RPDO alone and needs nothing
  // but being copied (or kept for SYNC); gives how many, and adds them to traffic. The frame it
  // stopped at goes to whom Dispatch says. Uses frame.time. No allocation, lock, exception.
  std::size_t receive_ordinary(std::span<const can::Frame> frames, can::Traffic& traffic);
  // The same for one frame, with an 11-bit identifier: false if it is not taken. Hot.
  bool receive_alone(const can::Frame& frame, can::Traffic& traffic);
  // The oldest reception of those linked RPDOs that have a queue (LinkedPdo::queue), in the order
  // of reception; false if there is none. A synchronous one is there when it came, before the SYNC.
  // No allocation.
  bool take_reception(Reception& out);
  // Those that wait are no longer wanted: they count as lost.
  void drop_receptions();
  // Any frame. slot: Target::index of Service::rpdo.
  void receive(std::uint16_t slot, const can::Frame& frame);
  // A remote frame on a TPDO's COB-ID.
  void remote_request(std::uint16_t slot, Instant now);
  // SYNC: commits synchronous RPDOs, samples synchronous TPDOs. counter: 0 = none.
  void sync(std::uint8_t counter, Instant now);
  // The SYNC that sync() was called for waited for the bus until now: the TPDOs after it take the
  // values of now, and its window begins now. What sync() committed and counted stays.
  void sync_handed_out(Instant now);

  // What the node sent and waits for SYNC is no longer wanted: it is invalid.
  void drop_waiting(std::uint8_t node);

  // TPDOs with output entries of the image are held back, whatever requests them, until every one
  // of these entries is known. When such a TPDO was transmitted with the newest values, and its
  // receiver is `unknown` or `started`, its entries become valid.

  // unknown: nothing is known about the node's state, every TPDO is taken as received (at first).
  // waiting: the node is not started; TPDOs to it are sent when they change, but not on entering
  // Operational, and their entries are not valid.
  // started: the node is Operational. On entering it every TPDO to the node is requested once,
  // changed or not, as trigger() does it.
  // unheard: nothing was received from the node, and the line does not boot it: TPDOs to it are
  // sent as to an unknown one, but their entries are not valid.
  enum class Receiver : std::uint8_t { unknown, waiting, started, unheard };
  // Precondition: node is 1..127. The state is kept over configure().
  void set_receiver(std::uint8_t node, Receiver state);
  Receiver receiver(std::uint8_t node) const;

  // Auto-notify, off for every TPDO to begin with: whether a mapped value that becomes another one
  // requests the TPDO by itself, if it is event-driven, or of type 0 at the next SYNC; of an MPDO
  // in source address mode the objects of the scanner list, of a linked TPDO the network variables
  // (A000h..A47Fh) that show its bytes, of whatever type. It does not matter who changes the value:
  // SDO, MPDO, or the device through the dictionary. Not noticed are the same value once more, a
  // value that an RPDO brings, and what is written past the dictionary, into a variable's memory or
  // an image, see outputs_written(). number: 1..512, of TPDOs that do not exist, too: it is kept
  // over every configure(). The second form is for all of them.
  void set_auto_notify(std::uint16_t number, bool wanted);
  void set_auto_notify(bool wanted);

  // A mapped value was changed by the device itself: requests its event-driven TPDOs, with
  // auto-notify or without.
  void value_changed(od::Address address, Instant now);
  // For a device that knows which TPDO sends a value, and sets it often: the value at that address.
  // Nothing if its type is not of fixed size, up to 8 bytes, if no TPDO or more than one sends it,
  // if it lies elsewhere than in the dictionary, or if a hook is called when it is written. Valid
  // until revision() grows.
  std::optional<TpdoValue> value(od::Address address) const;
  // Gives it the low bits of `number`. Another value requests the TPDO as value_changed() does; the
  // same one does nothing. Neither hooks nor observers of the dictionary are called. False, and
  // nothing is done, if the value is not valid any more: value() gives it anew.
  bool set(const TpdoValue& value, std::uint64_t number);

  // The same for bytes [offset, offset + length) of the image's output area; always: even TPDOs
  // whose bytes are as they were last sent.
  void outputs_written(std::uint32_t bit_offset, std::uint32_t bits, bool always, Instant now);
  // The same, in less time, for bits from the first of an output entry on that all belong to its
  // PDO. Precondition: the image has the entry.
  void output_written(std::uint32_t entry, std::uint32_t bits, bool always, Instant now);
  // Grows whenever a PDO comes, goes or maps something else.
  std::uint64_t revision() const;

  // The RPDO has not come within its deadline. number: 1..
  bool timed_out(std::uint16_t rpdo) const;

  // Requests one TPDO by number, unchanged or not: an event-driven one at once, one of type 0 at
  // the next SYNC; others keep their own pace. False if there is no such valid TPDO or the node is
  // not Operational.
  bool trigger(std::uint16_t number, Instant now);

  // Sends the value of the object that the TPDO maps in destination address mode to an object of
  // `consumer`, 0 = all. What waits for the inhibit time is sent in turn; a newer value to the same
  // destination replaces one that waits. device_state outside of Operational;
  // no_object if there is no such valid TPDO in that mode; out_of_memory if kMpdosWaiting wait,
  // held ones included.
  AbortCode send_mpdo(std::uint16_t number, std::uint8_t consumer, od::Address destination);
  // Sends an object of the device in source address mode, as value_changed() does for those in the
  // scanner list, which has room for all of them. no_object also for one that is not in it.
  AbortCode send_mpdo(od::Address source);
  static constexpr std::size_t kMpdosWaiting = 64;

  // For a group of writes: until release(), nothing is requested by a changed value, trigger() or
  // send_mpdo(); then every TPDO that would have been, once, with the values of then, and every
  // MPDO, once for each of its destinations or sources, with the newest value it was given. SYNC,
  // remote frames, event timers, and what was requested before go on.
  void hold();
  void release(Instant now);

  // Asks the producer of an RPDO for it with a remote frame (CiA 301, 7.2.2.5.2), which is sent in
  // its turn, once however often it is asked for until then. False if there is no such valid RPDO,
  // bit 30 of its COB-ID says that there is no RTR, the line is CAN FD, or the node is not
  // Operational.
  bool request_rpdo(std::uint16_t number);

  // Inhibit times, event timers, RPDO deadlines. next_wake() is about what has to be waited for;
  // what can be sent already is told by wants_to_send().
  void advance(Instant now);
  // When advance() is wanted, or an inhibit time ends; what could be sent already is no reason.
  Instant next_wake() const;

  // The requested TPDO with the lowest CAN-ID whose inhibit time is over. Hot.
  // number: of the frame among those that are handed to a bus that reports acknowledgements, in
  // ascending order; 0 = the bus reports none: the frame counts as transmitted at once.
  // With sent: is added to it.
  bool next_frame(can::Frame& out, Instant now, std::uint64_t number = 0);
  bool next_frame(can::Frame& out, Instant now, std::uint64_t number, can::Traffic& sent);
  // Identifier and flags of the frame that it would give now, nothing else of it. False if there is
  // none.
  bool peek(can::Frame& out, Instant now);
  // The bus acknowledged the frames up to that number, except those that are lost. No allocation.
  void acknowledged(std::uint64_t number);
  // The frames first..last never get onto the bus, or it is not known whether they did: what they
  // carried stays not valid. TPDOs with output entries are requested again, as trigger() does it,
  // unless their receiver is `waiting`.
  void lost(std::uint64_t first, std::uint64_t last);
  // Number of the first valid TPDO that maps the object; 0 if there is none.
  std::uint16_t first_tpdo(od::Address address) const;
  // Of that TPDO, since it was configured; 0 if there is none. number: 1..
  std::uint64_t samples(std::uint16_t number) const;
  static constexpr std::uint64_t kEverySample = std::numeric_limits<std::uint64_t>::max();
  // The frame is that TPDO with the newest values, or with those of a sample that came after so
  // many: of what is sampled at SYNC, the newest may have come since. number: 1..
  bool carries_newest(std::uint16_t number, const can::Frame& frame,
                      std::uint64_t samples = kEverySample) const;
  // The TPDO is requested by events only, and no request carries the newest values of these bits of
  // the output area: they are sent when it is requested next. number: 1..
  bool awaits_trigger(std::uint16_t number, std::uint32_t bit_offset, std::uint32_t bits) const;
  // Nothing is requested, not even what an inhibit time holds back: next_frame() gives none. Hot.
  bool quiet() const { return (sending_ | asking_) == 0; }
  bool wants_to_send(Instant now) const;

  const EngineCounters& counters() const;

 private:
  struct Impl;
  std::uint64_t sending_ = 0;  // not 0: TPDOs to be sent
  std::uint64_t asking_ = 0;   // not 0: RPDOs to be asked for
  std::unique_ptr<Impl> impl_;
};

}  // namespace linegate::pdo
