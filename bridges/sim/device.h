// SPDX-License-Identifier: Apache-2.0
// A simulated CANopen device: a node::Node with the dictionary of an EDS file of this folder and
// the behaviour of its profile. Its values depend on seed and time alone.
//
// It has no I/O, thread or clock: tests run it on a Bus in virtual time, `linegate simulate` on any
// channel.
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
  std::string profile;       // one of profiles()
  std::uint8_t node_id = 1;  // 1..127; identifies the device even if its active node-ID differs
  std::uint64_t seed = 0;    // the same seed gives the same values
  std::optional<Duration> heartbeat;        // 1017h, 0..65535 ms; empty = default of the EDS
  bool fd = false;                          // CANopen FD, see node::Options; "fd-io" always is
  bool emcy_fd = false;                     // with CANopen FD: see node::Options
  bool self_starting = false;               // enters Operational without an NMT command
  bool unconfigured = false;                // starts without a node-ID, which LSS assigns
  std::optional<std::uint8_t> has_node_id;  // a node-ID that LSS stored before; empty = node_id
  lss::SlaveFaults lss_faults;
  std::optional<std::uint32_t> serial;  // 1018h:4; empty = default of the EDS
  std::vector<std::pair<od::Address, std::uint64_t>> defaults;  // replace defaults of the EDS
  std::shared_ptr<storage::Medium> medium;  // holds stored parameters; empty = memory of the
                                            // Device, which survives kill()
};

// "digital-io" (CiA 401), "analog-io" (CiA 401), "encoder" (CiA 406), "drive" (CiA 402),
// "fd-io": 64 bytes in and out, of CANopen FD.
std::span<const std::string_view> profiles();
// Whether its devices are always of CANopen FD.
bool needs_fd(std::string_view profile);

// The name ("digital-io.eds") and the text of a profile's EDS file; empty if there is no such
// profile.
std::string_view eds_name(std::string_view profile);
std::string_view eds_text(std::string_view profile);

class Behaviour;
class ProgramMemory;

class Device {
 public:
  // Fails for an unknown profile or an invalid node-ID.
  static Loaded<std::unique_ptr<Device>> make(const DeviceOptions& options);
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  // Power-on: boot-up message, then Pre-operational.
  void start(Instant now);
  // Power-off: neither receives nor sends until revive().
  void kill();
  // Power-on again: values of the EDS or stored ones (1010h), boot-up message, the node-ID that LSS
  // stored.
  void revive(Instant now);
  bool alive() const { return alive_; }

  // Processes each frame at its own time. Ignored after kill().
  void receive(std::span<const can::Frame> frames);
  // Updates the values and runs due time-outs.
  void advance(Instant now);
  Instant next_wake() const;
  // Returns the most urgent frame to send; false if there is none.
  bool next_frame(can::Frame& out, Instant now);
  bool wants_to_send(Instant now) const;

  // The active node-ID; 0 = none: the device processes LSS alone.
  std::uint8_t node_id() const;
  // The LSS slave.
  const lss::Slave& lss_slave() const;

  // Moves events of the node to `out`, oldest first, and returns their number.
  std::size_t pop_events(std::span<Event> out);

  const DeviceOptions& options() const { return options_; }
  // The reference is invalid after the device gets another node-ID.
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
  std::unique_ptr<ProgramMemory> program_;  // registered with the node's dictionary
  bool alive_ = false;
};

}  // namespace linegate::sim
