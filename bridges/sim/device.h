// SPDX-License-Identifier: Apache-2.0
// A simulated CANopen device: a node::Node with the dictionary of one of our EDS files and the
// behaviour of its profile. Values move as a function of seed and time alone.
//
// An object without I/O, thread or clock, as the stack is: a test runs it on a Bus in virtual time,
// `linegate simulate` on any channel.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "stack/base/diagnostic.h"
#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/frame.h"
#include "stack/lss/slave.h"
#include "stack/node/node.h"
#include "stack/storage/medium.h"

namespace linegate::sim {

struct DeviceOptions {
  std::string profile;                      // one of profiles()
  std::uint8_t node_id = 1;                 // 1..127; what it is called by even if it has another
  std::uint64_t seed = 0;                   // same seed, same values
  std::optional<Duration> heartbeat;        // 1017h, 0..65535 ms; nothing = what the EDS says
  bool self_starting = false;               // goes Operational without being told
  bool unconfigured = false;                // it begins without a node-ID, for LSS to give it one
  std::optional<std::uint8_t> has_node_id;  // stored by LSS before; nothing = node_id
  lss::SlaveFaults lss_faults;
  std::optional<std::uint32_t> serial;  // 1018h:4; nothing = what the EDS says
  std::vector<std::pair<od::Address, std::uint64_t>> defaults;  // other than the EDS says
  std::shared_ptr<storage::Medium> medium;  // keeps stored parameters; nothing = the device's own
                                            // memory, which outlives kill() but not the Device
};

// "digital-io" (CiA 401), "analog-io" (CiA 401), "encoder" (CiA 406), "drive" (CiA 402).
std::span<const std::string_view> profiles();

// The EDS file of a profile: its name ("digital-io.eds") and text; empty if there is no such
// profile.
std::string_view eds_name(std::string_view profile);
std::string_view eds_text(std::string_view profile);

class Behaviour;
class ProgramMemory;

class Device {
 public:
  // Fails for an unknown profile or node-ID.
  static Loaded<std::unique_ptr<Device>> make(const DeviceOptions& options);
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  // Power on: boot-up message, Pre-operational.
  void start(Instant now);
  // Power off: hears and says nothing until it is revived.
  void kill();
  // Power on again: values as in the EDS or as stored (1010h), boot-up message; the node-ID as
  // stored by LSS.
  void revive(Instant now);
  bool alive() const { return alive_; }

  // Each frame at its own time. Ignored while dead.
  void receive(std::span<const can::Frame> frames);
  // Moves the values and runs what is due.
  void advance(Instant now);
  Instant next_wake() const;
  // The most urgent frame to send; false if none.
  bool next_frame(can::Frame& out, Instant now);
  bool wants_to_send(Instant now) const;

  // The node-ID it has on the bus; 0 = none, and nothing but LSS is heard.
  std::uint8_t node_id() const;
  // The LSS slave.
  const lss::Slave& lss_slave() const;

  // What happened to the node itself, oldest first; gives how many.
  std::size_t take_events(std::span<Event> out);

  const DeviceOptions& options() const { return options_; }
  // Another one when it gets another node-ID.
  node::Node& node() { return *node_; }
  const node::Node& node() const { return *node_; }
  od::Dictionary& dictionary() { return node_->dictionary(); }

 private:
  struct Lss;

  explicit Device(DeviceOptions options);
  std::uint64_t mix_seed() const;
  void build(const od::DeviceDescription& description);
  void be_lss_slave();
  void rebuild(std::uint8_t node_id);
  void follow_lss(Instant now);
  void hear_without_node_id(const can::Frame& frame);
  bool has_node_id() const;
  void set_time(Instant now);
  void restart_if_due(Instant now);

  DeviceOptions options_;
  EventLog events_;
  std::unique_ptr<Behaviour> behaviour_;
  std::unique_ptr<node::Node> node_;
  std::unique_ptr<Lss> lss_;
  std::unique_ptr<ProgramMemory> program_;  // on the node's dictionary
  bool alive_ = false;
};

}  // namespace linegate::sim
