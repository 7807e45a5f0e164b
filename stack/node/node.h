// One CANopen node: a dictionary and the services CiA 301 puts around it, in the device role. The
// own node of a managed line and every simulated device are the same class.
//
// A node is an object without I/O: frames and time go in, frames and events come out.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/dispatch.h"
#include "stack/can/frame.h"
#include "stack/can/traffic.h"
#include "stack/can/transmit_queue.h"
#include "stack/nmt/state.h"
#include "stack/od/dictionary.h"
#include "stack/pdo/engine.h"

namespace linegate::emcy {
class Producer;
}
namespace linegate::storage {
class Medium;
}
namespace linegate::time {
class Service;
struct TimeOfDay;
}  // namespace linegate::time

namespace linegate::node {

// Gets the frames of services the node does not serve itself (sdo_client, error_control, emcy,
// sdo_server of other nodes, lss), registered with dispatch() by whoever serves them, and
// hears of SYNC. The node's own targets have an index of 100h and more for error_control and emcy
// (its consumers by 1016h and 1028h), and below 80h for sdo_server: other indices are free.
class Companion {
 public:
  virtual ~Companion() = default;
  virtual void receive(const can::Target& target, const can::Frame& frame) = 0;
  virtual void synced(Instant now) = 0;  // after RPDOs were committed and TPDOs sampled
};

// The application or profile of the node. Every function has a default that does nothing.
class Application : public pdo::Listener {
 public:
  virtual void state_changed(nmt::State state, Instant now);
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
};

struct NodeCounters {
  std::uint64_t syncs = 0;
  std::uint64_t times = 0;
  std::uint64_t malformed = 0;       // frames a service wanted but could not understand
  std::uint64_t unused = 0;          // frames nobody wanted
  std::uint64_t starts_refused = 0;  // by the application
  can::Traffic received;
};

class Node {
 public:
  // image may be nullptr. Companion and application are optional. All must outlive the node.
  Node(od::Dictionary dictionary, Options options, EventLog& events, image::ProcessImage* image);
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  void set_companion(Companion* companion);
  void set_application(Application* application);
  // Where 1010h stores parameters, before start(); must outlive the node. Without one nothing is
  // stored: 1010h and 1011h refuse.
  void set_medium(storage::Medium* medium);

  // Power-on: Initialising, boot-up message, Pre-operational (and Operational if self-starting).
  // The first time with the values that are there; again as after power-off: all values restored as
  // by reset node, frames not yet sent are gone. Stored parameters are asked of the medium; with
  // this and every reset they take the place of the defaults. If they cannot be used, the defaults
  // are, which EMCY 6300h and EventKind::configuration_error tell. With start and every reset, PDOs
  // that cannot be used are told as EventKind::configuration_error of this node.
  void start(Instant now);
  // An NMT command for this node itself, as if received (the master obeys its own commands so).
  void command(nmt::Command command, Instant now);
  // An error of the device has occurred: does what 1029h:error_class says, see
  // nmt/error_behaviour.h. The EMCY is the application's.
  void device_error(std::uint8_t error_class, Instant now);

  // Hot. Each frame at its own frame.time; frames whose identifier nobody wants are counted.
  void receive(std::span<const can::Frame> frames);
  void advance(Instant now);
  Instant next_wake() const;
  // Most urgent first: NMT, SYNC, EMCY, TIME, PDO, SDO, error control.
  bool next_frame(can::Frame& out, Instant now);
  bool wants_to_send(Instant now) const;

  nmt::State state() const;
  std::uint8_t node_id() const;
  od::Dictionary& dictionary();
  pdo::Engine& pdos();
  emcy::Producer& emcy();
  time::Service& clock();
  can::Dispatch& dispatch();
  can::TransmitQueue& transmit();
  const NodeCounters& counters() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace linegate::node
