// SPDX-License-Identifier: Apache-2.0
// A line in the role observer: another master owns the bus. It has no own node and no transmit
// queue, so it cannot transmit. Private to stack/line.
#pragma once

#include <memory>

#include "stack/can/traffic.h"
#include "stack/image/process_image.h"
#include "stack/line/generic_can.h"
#include "stack/line/line.h"
#include "stack/line/srdo_reception.h"
#include "stack/nmt/sleep.h"
#include "stack/observer/learned_parameters.h"
#include "stack/observer/nodes.h"
#include "stack/observer/pdo_knowledge.h"
#include "stack/observer/sdo_channels.h"
#include "stack/observer/sdo_follower.h"
#include "stack/observer/usdo_follower.h"
#include "stack/pdo/engine.h"
#include "stack/pdo/link.h"
#include "stack/sync/consumer.h"
#include "stack/time/message.h"

namespace linegate::line {

// One direction of the image, filled from the frames on the bus. Only the side `inputs` of its
// image is used, with the layout of that direction: an observer receives the PDOs of the master to
// the devices, too.
struct Overheard {
  // pdos: described as RPDOs.
  // longest_pdo: bytes, 8 or 64.
  Overheard(EventLog& events_, can::Dispatch& dispatch, image::Layout layout,
            std::vector<pdo::LinkedPdo> pdos, std::size_t longest_pdo);

  const image::Layout& layout() const { return image.layout(image::Direction::inputs); }
  // The node of a PDO in this direction. slot: index of its target.
  std::uint8_t node_of(std::uint16_t slot) const {
    return image.node_of(image::Direction::inputs, static_cast<std::uint16_t>(slot + 1U));
  }
  void set_all_invalid();
  // Replaces the PDOs; the layout stays the same.
  void link(std::vector<pdo::LinkedPdo> pdos);
  // Whether frames of the PDO are received; initially they are. remote_pdo: as in Entry. No effect
  // if there is no such PDO.
  void listen(std::uint8_t node, std::uint16_t remote_pdo, bool on);
  // Copies the values of the same objects in the same PDOs, with their validity.
  void copy_values(const Overheard& before);

  struct Source {
    std::uint8_t node = 0;
    std::uint16_t remote_pdo = 0;
    can::CobId cob_id;
  };

  image::ProcessImage image;
  od::Dictionary dictionary;
  pdo::Engine engine;
  can::Dispatch& frames;
  std::vector<Source> sources = {};  // of the PDOs, by slot
};

// PDOs to the devices, as PDOs that are received: the bytes are the same as in the image of the
// master that sends them, only later.
std::vector<pdo::LinkedPdo> as_received(std::vector<pdo::LinkedPdo> sent);

// Adds the counters that an observer uses.
void add(pdo::EngineCounters& sum, const pdo::EngineCounters& more);

// Target::index of SDO frames on default channels: the node-ID, with this flag for requests of the
// client. For other channels see observer::SdoChannels.
inline constexpr std::uint16_t kSdoRequest = 0x80;

class ObserverLine final : public Line, observer::NodeListener {
 public:
  // plan: of the configuration; see Line::make().
  ObserverLine(LineConfig line_config, pdo::LinkPlan plan);

 private:
  const image::Layout& layout(image::Direction direction) const override;
  void do_start(Instant now) override;
  void do_receive(std::span<const can::Frame> frames) override;
  void do_bus_event(const can::BusEvent& event) override;
  bool advance(Instant now) override;
  void do_execute(Command command, Instant now) override;
  OutputRefusal do_write_outputs(const OutputWrite& write, Instant now) override;
  void do_stop(Instant now) override;
  Instant next_wake() const override;
  void snapshot(image::Direction direction, image::Snapshot& into, Instant now,
                bool merge) override;
  bool image_changed(image::Direction direction) const override;
  bool image_touched(image::Direction direction) const override;
  Input input(std::uint32_t entry, std::uint8_t part) const override;
  bool pop_reception(pdo::Reception& out) override;
  std::optional<Duration> network_utc(Instant now) const override;
  LineState do_state() const override;
  std::uint64_t do_node_revision(std::uint8_t id) const override;
  NodeState do_node_state(std::uint8_t id) const override;
  od::Dictionary& do_dictionary() override { return inputs->dictionary; }
  const od::Dictionary& do_dictionary() const override { return inputs->dictionary; }

  std::uint64_t layout_revision() const override { return revision; }

  void node_data_invalid(std::uint8_t id) override;
  void node_reset(std::uint8_t id) override;
  void node_booted(std::uint8_t id) override;

  // A configured node.
  struct Device {
    observer::PdoKnowledge pdos;
    std::vector<observer::KnownPdo> used;  // PDOs in the image
    // Its PDOs are being written: `used` does not change until then. kNever: a reset has ended
    // `used`, and its master is expected to write the same again; until its NMT start or its
    // first PDO.
    Instant written_until{};
    bool resetting = false;  // reset by a command, and its boot-up message was not received yet
    std::vector<observer::KnownPdo> ended = {};  // PDOs in `used` that a reset has ended
  };
  static std::vector<observer::KnownPdo> known_pdos(const Device& device, Instant now);

  Overheard& side(image::Direction direction) const {
    return direction == image::Direction::inputs ? *inputs : *outputs;
  }
  Device* find(std::uint8_t id);
  void receive(const can::Frame& frame);
  bool dispatch_frame(const can::Frame& frame);
  bool takes_outputs(std::uint8_t id) const;
  bool is_new_pdo(const can::Frame& frame);
  void serve(const can::Target& target, const can::Frame& frame);
  void receive_error_control(std::uint8_t id, const can::Frame& frame);
  void receive_node_control(const can::Frame& frame);
  void receive_sync(const can::Frame& frame);
  void receive_time(const can::Frame& frame);
  void malformed(const can::Frame& frame, std::uint8_t id);
  void follow_sleep();
  void set_pdos_active(bool active, Instant now);
  bool ends_configuration(Device& device, const can::Frame& frame) const;

  // --- observer_sdo.cpp -------------------------------------------------------------------------
  void receive_sdo(std::uint16_t index, const can::Frame& frame);
  void receive_usdo(std::uint16_t index, const can::Frame& frame);
  std::size_t longest_pdo_bytes() const;
  std::optional<observer::Transfer> follow(std::uint16_t index, const can::Frame& frame);
  void report_transfer(std::uint8_t id, const observer::Transfer& transfer, Instant now);
  void learn(std::uint8_t id, const observer::Transfer& transfer, Instant now);
  void learn_identifier(std::uint8_t id, const observer::Transfer& transfer);
  void set_identifier(std::uint8_t id, od::Address address, std::span<const std::byte> value);
  std::vector<std::byte> described_identifier(std::uint8_t id, od::Address address) const;
  void follow_boot_up(std::uint8_t id);
  // Builds the image anew from the PDOs that are known.
  void relink(Instant now);
  bool nothing_new(Instant now) const;
  Loaded<pdo::LinkPlan> plan_of_what_is_known(Instant now) const;
  void report_mappings(Device& device, Instant now);
  void follow_reset(Device& device, bool booted);
  void listen(const Device& device, bool on);
  void replace(image::Direction direction, const image::Layout& layout,
               std::vector<pdo::LinkedPdo> pdos, Instant now);

  // Two tables: an identifier may be that of an RPDO in one and of any service in the other, and
  // the slots of PDOs count from 0 in each direction.
  can::Dispatch dispatch;
  can::Dispatch output_dispatch;
  std::unique_ptr<Overheard> inputs;  // never nullptr
  std::unique_ptr<Overheard> outputs;
  pdo::EngineCounters inputs_before;  // of earlier engines
  pdo::EngineCounters outputs_before;
  Listening listening;
  observer::Nodes nodes;
  std::array<observer::SdoFollower, can::kMaxNodeId + 1> transfers;
  observer::UsdoFollower usdo;  // of a line of CANopen FD, instead of `transfers` and `channels`
  observer::SdoChannels channels;
  // By node-ID: the COB-IDs of EMCY and SDO servers
  std::array<observer::LearnedParameters, can::kMaxNodeId + 1> identifiers;
  std::vector<Device> devices;  // in the order of config.nodes
  std::uint64_t revision = 0;
  Instant relink_at = kNever;
  sync::Consumer sync;
  SrdoReception srdos;
  nmt::Sleep sleep;
  std::optional<time::TimeOfDay> network_time;
  Instant network_time_at{};
  can::Traffic received;
};

}  // namespace linegate::line
