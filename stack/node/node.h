// SPDX-License-Identifier: Apache-2.0
// One CANopen node in the device role: a dictionary and its services by CiA 301. The own node of a
// managed line and every simulated device are of this class.
//
// A node has no I/O: frames and time are inputs, frames and events are outputs.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string_view>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/bus_state.h"
#include "stack/can/dispatch.h"
#include "stack/can/frame.h"
#include "stack/can/traffic.h"
#include "stack/can/transmit_queue.h"
#include "stack/nmt/state.h"
#include "stack/node/indicators.h"
#include "stack/od/dictionary.h"
#include "stack/pdo/engine.h"
#include "stack/storage/image.h"
#include "stack/usdo/abort_form.h"

namespace linegate::emcy {
class Producer;
enum class SendResult : std::uint8_t;
}  // namespace linegate::emcy
namespace linegate::nmt {
class HeartbeatConsumer;
}
namespace linegate::sdo {
class NetworkHandler;
}
namespace linegate::storage {
class Medium;
}
namespace linegate::time {
class Service;
struct TimeOfDay;
}  // namespace linegate::time

namespace linegate::node {

// The manufacturer bytes of the node's own EMCYs, and when an error reset is sent. In both schemes
// 1001h is the union of all present errors.
enum class ErrorScheme : std::uint8_t {
  // Bytes 3, 4: PDO number or node-ID, else 0. One error reset when the last error has ended.
  number,
  // Byte 3: present errors (bit 0 error control, 1 error passive, 2 bus-off); byte 4: errors since
  // the last reset (bit 0 CAN controller, 1 frames lost, 2 PDO length); bits 5 to 7 of both belong
  // to the device, see Node::set_error_bits(). Byte 5: PDO number (its low byte) or node-ID; bytes
  // 6, 7: received and mapped length of a PDO. An error reset for each error that has ended.
  temporary_and_sticky,
};

constexpr std::string_view name(ErrorScheme scheme) {
  return scheme == ErrorScheme::number ? "number" : "temporary_and_sticky";
}

class SdoClients;

// The services of a node that concern other nodes, such as those of a manager. It receives the
// frames that the node does not serve itself (sdo_client, error_control, emcy, sdo_server of other
// nodes, lss, nmt except index 0), whose targets it registers with dispatch(), and node control
// that a node without the NMT slave role does not obey; it is called at each SYNC. The node's own
// targets have an index of 100h or more for error_control, emcy (its consumers by 1016h and 1028h)
// and sdo_client (its clients by 1280h), and below 80h for sdo_server; other indices are free.
class MasterServices {
 public:
  virtual ~MasterServices() = default;
  virtual void receive(const can::Target& target, const can::Frame& frame) = 0;
  virtual void synced(Instant now) = 0;  // after RPDOs were committed and TPDOs sampled
  // The node's own consumer (1016h) lost the heartbeat of another node. The default does nothing.
  virtual void consumer_lost(std::uint8_t node, Instant deadline);
  // A frame that no service uses. The default does nothing.
  virtual void unwanted(const can::Frame& frame);
  // The node is about to boot, at power-on or by a reset: its values are the defaults and the
  // stored parameters. Values written now are used when the services are configured and when the
  // node decides whether it is self-starting (1F80h). The default does nothing.
  virtual void before_boot(Instant now);
  // The node has another NMT state; PDOs follow it already. The default does nothing.
  virtual void state_changed(nmt::State state, Instant now);
  // See pdo::Listener. The defaults do nothing.
  virtual void tpdo_transmitted(std::uint16_t number, std::span<const std::byte> differs);
  virtual void mpdo_transmitted(od::Address source);
};

// The application or device profile of the node. The default of every function does nothing.
class Application : public pdo::Listener {
 public:
  virtual void state_changed(nmt::State state, Instant now);
  // Called before the node sends an EMCY of its own, including error resets (code 0); not for
  // set_error() and reset_error(). info: the manufacturer bytes by the ErrorScheme, which may be
  // changed. Return false to suppress the EMCY and its entry in 1003h; 1001h is unaffected.
  virtual bool may_send_emcy(std::uint16_t code, std::span<std::byte, 5> info);
  // Called before each transition to Operational. Return false to stay in the current state.
  virtual bool may_operate(Instant now);
  // A TIME message was received (1012h bit 31).
  virtual void time_received(const time::TimeOfDay& time, Instant now);
  // Reset node or reset communication; the values are already reset.
  virtual void reset(bool whole_node, Instant now);
};

struct Options {
  std::uint8_t node_id = 0;  // 1..127
  // Enters Operational by itself, as does an NMT slave whose object 1F80h has bits 0 and 2 clear,
  // or bits 0 and 5 set and bit 2 clear (a flying master that is not the active one).
  bool self_starting = false;
  bool nmt_slave = true;  // obeys node control on 000h; false for the NMT master
  // Whether its clients of 1280h to 12FFh may use default servers (600h and 580h + node-ID). False
  // if an sdo::Arbiter uses these, see node/sdo_clients.h.
  bool clients_of_default_servers = true;
  ErrorScheme error_scheme = ErrorScheme::number;
  // CANopen FD (CiA 1301): a USDO server instead of SDO servers and clients, PDOs of up to 64 bytes
  // in whole bytes, no remote frames. The dictionary loses 100Ch, 100Dh and 1200h to 12FFh.
  bool fd = false;
  usdo::AbortForm usdo_abort = usdo::AbortForm::one_byte;
  // With `fd`: sends EMCYs of CANopen FD, and consumes them beside classical ones (OWN layout, see
  // emcy/message.h).
  bool emcy_fd = false;
  // Initial setting of all TPDOs, see pdo::Engine::set_auto_notify().
  bool auto_notify = false;
};

struct NodeCounters {
  std::uint64_t syncs = 0;
  std::uint64_t times = 0;
  std::uint64_t malformed = 0;       // frames that a service could not decode
  std::uint64_t unused = 0;          // frames that no service uses
  std::uint64_t starts_refused = 0;  // refused by the application
  std::uint64_t starts = 0;          // transitions to Operational
  std::uint64_t resets = 0;          // reset node and reset communication
  can::Traffic received;
  can::Traffic sent;  // handed out by next_frame()
};

class Node {
 public:
  // image may be nullptr. MasterServices and Application are optional. All must outlive the node.
  Node(od::Dictionary dictionary, Options options, EventLog& events, image::ProcessImage* image);
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  void set_master_services(MasterServices* master_services);
  void set_application(Application* application);
  // The storage of 1010h; set it before start(). It must outlive the node. Without one, 1010h and
  // 1011h refuse.
  void set_medium(storage::Medium* medium);
  // See storage::Storage::set_adjustment().
  void set_stored_adjustment(std::function<void(storage::StoredValue& value)> adjustment);
  // A slow medium completed its operation. Call advance() soon: the client's answer is pending.
  void medium_done(bool good);

  // Power-on: Initialising, boot-up message, Pre-operational (and Operational if self-starting).
  // The first call uses the present values; later calls act as after power-off: all values are
  // reset as by reset node, and unsent frames are dropped. At each start and reset, parameters
  // stored on the medium replace the defaults. If they cannot be used, the defaults are, with EMCY
  // 6300h and EventKind::configuration_error. At each start and reset, PDOs that cannot be used are
  // reported as EventKind::configuration_error of this node.
  void start(Instant now);
  // Executes an NMT command for this node, as if received (the master applies its own commands so).
  void command(nmt::Command command, Instant now);
  // An error of the device began: sends an EMCY with the code, sets the bits of its class in 1001h
  // (see emcy/error_state.h), and adds an entry to 1003h. info: 5 manufacturer bytes, missing ones
  // are 0.
  emcy::SendResult set_error(std::uint16_t code, std::span<const std::byte> info, Instant now);
  // One error of that class (high byte of the code) has ended: clears its bits in 1001h unless
  // another error has them, and sends an error reset by the ErrorScheme. Returns false if no such
  // error is present.
  bool reset_error(std::uint16_t code, std::span<const std::byte> info, Instant now);
  // Sends an EMCY of the application through the error state machine (CiA 301 7.2.7.1). A code
  // begins an error: 1001h gets the bits of its class and the given ones. The same code again is
  // the same error, sent again with other bits or info. Code 00xxh ends all errors reported this
  // way; the error reset is sent at once, or by the node when the last other error has ended. At
  // most kMostReported codes at a time; for a further one SendResult::inhibited.
  static constexpr std::size_t kMostReported = 32;
  emcy::SendResult report_error(std::uint16_t code, std::uint8_t bits,
                                std::span<const std::byte> info, Instant now);
  // Ends one of them. No effect if the code was not reported.
  void end_reported(std::uint16_t code, Instant now);
  // Sets the device's bits in EMCYs of ErrorScheme::temporary_and_sticky, from the next one on;
  // only bits 5 to 7 are used. temporary: bits of the present errors. sticky: bits to add to those
  // of past errors. A reset clears both.
  void set_error_bits(std::uint8_t temporary, std::uint8_t sticky);
  // No error is present, neither of communication nor by set_error().
  bool error_free() const;
  // All nodes fall asleep: until resume(), also over a reset, the node expects no heartbeat
  // (1016h), guarding request or SYNC of others, and neither sends nor receives PDOs. Call resume()
  // right before a reset, which restarts error control.
  void suspend(Instant now);
  void resume();
  // A bus event of a bridge: causes EMCY 8110h, 8120h or 8140h, and 1029h:1 at bus-off.
  void bus_event(const can::BusEvent& event);
  // The present patterns of the indicators of CiA 303-3.
  Indicators indicators() const;
  // An error of the device occurred: performs the reaction of 1029h:error_class, see
  // nmt/error_behaviour.h. The application sends the EMCY.
  void device_error(std::uint8_t error_class, Instant now);

  // Hot. Processes each frame at its frame.time; counts frames that no service uses.
  void receive(std::span<const can::Frame> frames);
  void advance(Instant now);
  Instant next_wake() const;

  // Lets callers skip idle advance() calls: while this and dictionary().writes_reported() are
  // unchanged, and no other function is called, only the PDOs can need service before
  // next_service(). A caller that skips advance() calls pass_time() before any other function.
  // Increases with each received frame except those copied into the image and requests answered
  // from the dictionary, which start no time-out, and with each frame sent except PDOs.
  std::uint64_t served() const;
  Instant next_service() const;  // next_wake() without pdos()
  void pass_time(Instant now);   // nothing was due before now
  // Returns the most urgent frame: NMT, SYNC, EMCY, TIME, PDO, SDO, error control. number: see
  // pdo::Engine::next_frame().
  bool next_frame(can::Frame& out, Instant now, std::uint64_t number = 0);
  // See pdo::Engine::peek().
  bool peek(can::Frame& out, Instant now);
  bool wants_to_send(Instant now) const;

  nmt::State state() const;
  std::uint8_t node_id() const;
  od::Dictionary& dictionary();
  const od::Dictionary& dictionary() const;
  pdo::Engine& pdos();
  const pdo::Engine& pdos() const;
  emcy::Producer& emcy();
  const emcy::Producer& emcy() const;
  // The clients of 1280h to 12FFh. They send through transmit().
  SdoClients& sdo_clients();
  // Whether the node obeys node control from now on, see Options::nmt_slave.
  void set_nmt_slave(bool slave);
  // Receives requests to the SDO servers that address other networks; must outlive the node.
  void set_sdo_network_handler(sdo::NetworkHandler* handler);
  time::Service& clock();
  const time::Service& clock() const;
  // Shows the nodes that this consumer monitors in 1016h too. It listens to all other nodes, so it
  // reports their states and boot-up messages instead of the node. It must outlive the node.
  // nullptr: none.
  void show_monitored(const nmt::HeartbeatConsumer* consumer);
  can::Dispatch& dispatch();
  can::TransmitQueue& transmit();
  const can::TransmitQueue& transmit() const;
  const NodeCounters& counters() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace linegate::node
