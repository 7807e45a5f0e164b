// SPDX-License-Identifier: Apache-2.0
// One CANopen node: a dictionary and the services CiA 301 puts around it, in the device role. The
// own node of a managed line and every simulated device are the same class.
//
// A node is an object without I/O: frames and time go in, frames and events come out.
#pragma once

#include <cstdint>
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

namespace linegate::emcy {
class Producer;
enum class SendResult : std::uint8_t;
}  // namespace linegate::emcy
namespace linegate::nmt {
class HeartbeatConsumer;
}
namespace linegate::sdo {
class Detour;
}
namespace linegate::storage {
class Medium;
}
namespace linegate::time {
class Service;
struct TimeOfDay;
}  // namespace linegate::time

namespace linegate::node {

// What a node's own EMCYs say in the manufacturer bytes, and when it sends an error reset. 1001h is
// the sum of what is present either way.
enum class ErrorScheme : std::uint8_t {
  // Bytes 3, 4: PDO number or node-ID, else 0. One error reset, when the last error has gone.
  number,
  // Byte 3: errors that are present (bit 0 error control, 1 error passive, 2 bus-off); byte 4:
  // errors there have been since the last reset (bit 0 CAN controller, 1 frames lost, 2 PDO
  // length); bits 5 to 7 of both are the device's, see Node::set_error_bits(). Byte 5: PDO number
  // (its low byte) or node-ID; bytes 6, 7: length of a PDO received and mapped. An error reset for
  // each error that has gone.
  temporary_and_sticky,
};

constexpr std::string_view name(ErrorScheme scheme) {
  return scheme == ErrorScheme::number ? "number" : "temporary_and_sticky";
}

class SdoClients;

// The services of a node that concern other nodes, such as those of a manager. Gets the frames that
// the node does not serve itself (sdo_client, error_control, emcy, sdo_server of other nodes, lss,
// nmt but index 0), whose targets it registers with dispatch(), node control that a node which is
// no NMT slave does not obey, and is called at each SYNC. The node's own targets have an index of
// 100h and more for error_control, emcy (its consumers by 1016h and 1028h) and sdo_client (its
// clients by 1280h), and below 80h for sdo_server: other indices are free.
class MasterServices {
 public:
  virtual ~MasterServices() = default;
  virtual void receive(const can::Target& target, const can::Frame& frame) = 0;
  virtual void synced(Instant now) = 0;  // after RPDOs were committed and TPDOs sampled
  // The node's own consumer (1016h) lost the heartbeat of another node. Does nothing unless it is
  // overridden.
  virtual void consumer_lost(std::uint8_t node, Instant deadline);
  // A frame that nobody wants. Does nothing unless it is overridden.
  virtual void unwanted(const can::Frame& frame);
  // The node boots next, at power-on or by a reset: its values are the defaults and what was
  // stored. What is written now is there when the services are configured and the node decides
  // whether it starts by itself (1F80h). Does nothing unless it is overridden.
  virtual void before_boot(Instant now);
};

// The application or profile of the node. Every function has a default that does nothing.
class Application : public pdo::Listener {
 public:
  virtual void state_changed(nmt::State state, Instant now);
  // The node is about to send an EMCY by itself, an error reset (code 0) among them; not asked of
  // set_error() and reset_error(). info: its manufacturer bytes as the ErrorScheme says, which may
  // be changed. False: it is not sent and not in 1003h; 1001h is as ever.
  virtual bool may_send_emcy(std::uint16_t code, std::span<std::byte, 5> info);
  // Asked before each transition to Operational; false: the node stays in the state it is in.
  virtual bool may_operate(Instant now);
  // A TIME message came (1012h bit 31).
  virtual void time_received(const time::TimeOfDay& time, Instant now);
  // Reset node / reset communication: values have been set back already.
  virtual void reset(bool whole_node, Instant now);
};

struct Options {
  std::uint8_t node_id = 0;  // 1..127
  // Enters Operational by itself. So does an NMT slave whose object 1F80h has bits 0 and 2 clear.
  bool self_starting = false;
  bool nmt_slave = true;  // obeys node control on 000h; false for the NMT master
  // Its clients of 1280h to 12FFh may reach default servers, by 600h and 580h + node-ID. False
  // where an sdo::Arbiter does that for the node, see node/sdo_clients.h.
  bool clients_of_default_servers = true;
  ErrorScheme error_scheme = ErrorScheme::number;
  // Every TPDO to begin with, see pdo::Engine::set_auto_notify().
  bool auto_notify = false;
};

struct NodeCounters {
  std::uint64_t syncs = 0;
  std::uint64_t times = 0;
  std::uint64_t malformed = 0;       // frames a service wanted but could not understand
  std::uint64_t unused = 0;          // frames nobody wanted
  std::uint64_t starts_refused = 0;  // by the application
  std::uint64_t starts = 0;          // how often it became Operational
  std::uint64_t resets = 0;          // of the node or its communication
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
  // Where 1010h stores parameters, before start(); must outlive the node. Without one nothing is
  // stored: 1010h and 1011h refuse.
  void set_medium(storage::Medium* medium);
  // A slow medium ended what it was given. Call advance() soon: the answer to who asked waits.
  void medium_done(bool good);

  // Power-on: Initialising, boot-up message, Pre-operational (and Operational if self-starting).
  // The first time with the values that are there; again as after power-off: all values restored as
  // by reset node, frames not yet sent are gone. Stored parameters are asked of the medium; with
  // this and every reset they take the place of the defaults. If they cannot be used, the defaults
  // are, which EMCY 6300h and EventKind::configuration_error tell. With start and every reset, PDOs
  // that cannot be used are told as EventKind::configuration_error of this node.
  void start(Instant now);
  // An NMT command for this node itself, as if received (the master obeys its own commands so).
  void command(nmt::Command command, Instant now);
  // An error of the device began: EMCY with the code, 1001h with the bits of its class (see
  // emcy/error_state.h), an entry in 1003h. info: 5 manufacturer bytes, missing ones are 0.
  emcy::SendResult set_error(std::uint16_t code, std::span<const std::byte> info, Instant now);
  // One error of that class (high byte of the code) has gone: its bits leave 1001h unless another
  // needs them, and the error reset is sent as the ErrorScheme says. False if there is none.
  bool reset_error(std::uint16_t code, std::span<const std::byte> info, Instant now);
  // An EMCY of the application, through the error state machine (CiA 301 7.2.7.1). With a code an
  // error is present from now on: 1001h has the bits of its class and these as well. The same code
  // again is the same error, which is sent again with other bits or info. Code 00xxh: all errors
  // reported so have gone; the error reset is sent unless other errors are present, and otherwise
  // by the node when the last of them has gone. At most kMostReported at a time: a code beyond is
  // SendResult::inhibited.
  static constexpr std::size_t kMostReported = 32;
  emcy::SendResult report_error(std::uint16_t code, std::uint8_t bits,
                                std::span<const std::byte> info, Instant now);
  // One of them has gone. Does nothing if it was not reported.
  void end_reported(std::uint16_t code, Instant now);
  // The device's own bits in EMCYs of ErrorScheme::temporary_and_sticky, from the next one on; only
  // bits 5 to 7 count. temporary: those of errors that are present. sticky: those of errors there
  // have been are added. A reset clears both.
  void set_error_bits(std::uint8_t temporary, std::uint8_t sticky);
  // No error is present, neither of communication nor told by set_error().
  bool error_free() const;
  // What a bridge noticed about the bus: EMCY 8110h, 8120h, 8140h, 1029h:1 at bus-off.
  void bus_event(const can::BusEvent& event);
  // What the indicators of CiA 303-3 show now.
  Indicators indicators() const;
  // An error of the device has occurred: does what 1029h:error_class says, see
  // nmt/error_behaviour.h. The EMCY is the application's.
  void device_error(std::uint8_t error_class, Instant now);

  // Hot. Each frame at its own frame.time; frames whose identifier nobody wants are counted.
  void receive(std::span<const can::Frame> frames);
  void advance(Instant now);
  Instant next_wake() const;

  // For who wants to spare the node rounds in which it would find nothing to do: as long as these
  // stay as they are, dictionary().writes_told() too, and nothing else is called, only the PDOs can
  // have something to do before next_service(). Whoever leaves out advance() says pass_time()
  // before he calls anything else.
  // Grows with each frame that was not simply copied into the image or an answer from the
  // dictionary, which leave no time-out behind, and with each one sent that was no PDO.
  std::uint64_t served() const;
  Instant next_service() const;  // next_wake() but for pdos()
  void pass_time(Instant now);   // nothing was due until then
  // Most urgent first: NMT, SYNC, EMCY, TIME, PDO, SDO, error control. number: see
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
  // The clients of 1280h to 12FFh. Their frames go into transmit().
  SdoClients& sdo_clients();
  // Whether it obeys node control from now on, see Options::nmt_slave.
  void set_nmt_slave(bool slave);
  // Where the SDO servers send what is for other networks; must outlive the node.
  void set_sdo_detour(sdo::Detour* detour);
  time::Service& clock();
  const time::Service& clock() const;
  // 1016h shows what this consumer monitors besides, and its are the events of states and boot-up
  // messages: it listens to all other nodes. It must outlive the node. nullptr: nothing.
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
