// SPDX-License-Identifier: Apache-2.0
// One device of a line in the role device: a node with the dictionary of its device file, whose
// process data is in the line's image. Private to stack/line.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/emcy/producer.h"
#include "stack/image/process_image.h"
#include "stack/line/config.h"
#include "stack/line/device_lss.h"
#include "stack/line/state.h"
#include "stack/line/transmitted_outputs.h"
#include "stack/node/node.h"
#include "stack/od/hook.h"
#include "stack/pdo/parameters.h"
#include "stack/profile/io_behaviour.h"

namespace linegate::line {

// The dictionary holds the values: a value that an RPDO, an SDO or the application writes there is
// copied to the image immediately, whatever PDOs the master has configured.
class VirtualDevice final : node::Application {
 public:
  // image: of the whole line, laid out by device_plan(). reporter: for the EMCYs that the device
  // sends. All must outlive the device.
  VirtualDevice(const DeviceConfig& config, const LineConfig& line, image::ProcessImage& image,
                EventLog& events, emcy::SentReporter& reporter);

  void start(Instant now);
  // Processes the frame at frame.time. Returns true if a service used it.
  bool receive(const can::Frame& frame);
  void advance(Instant now);
  Instant next_wake() const;
  // number: see pdo::Engine::next_frame().
  bool next_frame(can::Frame& out, Instant now, std::uint64_t number);
  // See pdo::Engine.
  void acknowledged(std::uint64_t number) { node_->pdos().acknowledged(number); }
  void lost(std::uint64_t first, std::uint64_t last) { node_->pdos().lost(first, last); }
  // See pdo::Engine::peek().
  bool peek(can::Frame& out, Instant now);
  bool wants_to_send(Instant now) const;
  void set_utc(Duration offset);
  void set_medium(storage::Medium* medium);
  // Sets the medium of its LSS slave; no effect without one.
  void set_lss_medium(storage::Medium* medium);
  void lss_medium_done(bool good);
  // Executes an NMT command as if received. Ignored without a node-ID.
  void command(nmt::Command command, Instant now);
  // Writes the values of these output entries, which belong to this device, to the dictionary. All
  // values are written before the first TPDO is requested. always: requests the TPDOs of unchanged
  // values, too; otherwise of those whose change the profile reports.
  void apply_outputs(std::span<const std::uint32_t> entries, bool always, Instant now);
  // Makes the inputs invalid, because nothing can be received.
  void inputs_lost();
  // The bus was lost: nothing is received or transmitted until it is back. A device that is still
  // Operational then transmits its outputs again.
  void lose_bus();
  void find_bus(Instant now) { transmitted_.find_bus(node_->pdos(), now); }
  // Why the output entry is not valid. stuck: see Line::bus_is_stuck(). Precondition: it is not.
  OutputWait reason_of(std::uint32_t output, bool stuck) const;
  // The frames that send the output entry, see TransmittedOutputs::frames_of().
  std::vector<FramesUnderWay::Awaited> frames_of(std::uint32_t output);
  // Sends an EMCY on behalf of the application.
  emcy::SendResult send_emcy(std::uint16_t code, std::uint8_t error_register,
                             std::span<const std::byte> info, Instant now);

  // Writes an object on behalf of a command. own: as the device itself, see LocalWrite::as_owner.
  // Requests a TPDO that maps the object if its value changes.
  AbortCode write(od::Address address, std::span<const std::byte> value, bool own, Instant now);

  std::uint8_t id() const { return id_; }
  // Without a node-ID the device only uses LSS.
  bool has_node_id() const { return lss_ == nullptr || lss_->has_node_id(); }
  // Replaced when the node-ID changes.
  node::Node& node() { return *node_; }
  const node::Node& node() const { return *node_; }
  NodeState state() const;
  OwnDevice shown() const;
  // Over all nodes that it has had.
  struct Counts {
    std::uint64_t malformed = 0;
    std::uint64_t received = 0;
    std::uint64_t sent = 0;
    std::uint64_t coalesced = 0;
    std::uint64_t syncs = 0;
  };
  Counts counts() const;
  // Increases with every change of state().
  std::uint64_t revision() const { return revision_; }

 private:
  // Copies the value of an object to the image, whatever the source of the write.
  class Mirror final : public od::Hook {
   public:
    Mirror(VirtualDevice& device, image::Direction direction)
        : device_(device), direction_(direction) {}
    void add(std::uint8_t sub, std::uint32_t entry);
    void written(od::Address address) override;
    void came_by_rpdo(od::Address address) override;

   private:
    static constexpr std::uint32_t kNoEntry = 0xFFFF'FFFF;

    VirtualDevice& device_;
    image::Direction direction_;
    std::vector<std::uint32_t> entries_;  // by sub-index
  };
  // Called when the conversion between the values of an object and those of the image (CiA 401) has
  // changed.
  class Conversion final : public od::Hook {
   public:
    explicit Conversion(VirtualDevice& device) : device_(device) {}
    void written(od::Address address) override;

   private:
    VirtualDevice& device_;
  };
  // Emits an event for writes of other nodes to objects that are not in the image.
  class Watcher final : public od::Hook {
   public:
    explicit Watcher(VirtualDevice& device) : device_(device) {}
    AbortCode execute_write(od::Address address, std::span<const std::byte> value) override;

   private:
    VirtualDevice& device_;
  };
  // Local PDO number in the image, by the device's own PDO number: 0 = not in the image.
  using Numbers = std::array<std::uint16_t, pdo::kMaxPdo + 1>;

  void build(const od::DeviceDescription& description);
  void rebuild(std::uint8_t node_id);
  void start_node(Instant now);
  // Follows what a call of the node may have changed.
  void follow(Instant now);
  void follow_lss(Instant now);
  void mirror(image::Direction direction);
  void convert(od::Address process);
  void copy_from_image(std::uint32_t output);
  std::uint64_t value_of(std::uint32_t output) const;
  void copy_to_image(image::Direction direction, std::uint32_t entry, od::Address address);
  void touch(image::Direction direction, std::uint16_t pdo, Instant now);

  void note_emcy(std::uint16_t code);
  void report_write(od::Address address, std::span<const std::byte> value);
  bool is_in_image(od::Address address) const;

  // node::Application
  void rpdo_received(std::uint16_t number, Instant now) override;
  void before_tpdo(std::uint16_t number) override;
  void tpdo_transmitted(std::uint16_t number, std::span<const std::byte> differs) override;
  void mpdo_transmitted(od::Address source) override;
  void state_changed(nmt::State state, Instant now) override;
  bool may_send_emcy(std::uint16_t code, std::span<std::byte, 5> info) override;
  void time_received(const time::TimeOfDay& time, Instant now) override;
  void reset(bool whole_node, Instant now) override;

  const std::uint8_t id_;
  const node::Options options_;  // without a node-ID
  image::ProcessImage& image_;
  emcy::SentReporter& reporter_;
  EventLog events_;                    // of the line, with the line's node-ID of the device
  std::unique_ptr<DeviceLss> lss_;     // nullptr if it is not an LSS slave
  od::DeviceDescription description_;  // for an LSS slave: to build a node with another node-ID
  storage::Medium* medium_ = nullptr;
  std::optional<Duration> utc_;
  Counts before_;              // of earlier nodes
  std::optional<bool> reset_;  // its node was reset; true: reset node
  std::vector<std::unique_ptr<Mirror>> mirrors_;
  Conversion conversion_{*this};
  Watcher watcher_{*this};
  // Values outside the image that the application wrote as the device itself.
  std::map<od::Address, std::vector<std::byte>> own_values_;
  bool by_itself_ = false;  // a write or reset does not come from a master
  std::optional<Instant> time_reported_;
  std::array<Numbers, 2> numbers_{};                   // by image::Direction
  std::array<std::vector<std::uint32_t>, 2> entries_;  // of this device, by image::Direction
  TransmittedOutputs transmitted_;
  std::vector<od::Address> changed_;  // used by apply_outputs()
  bool from_image_ = false;  // the value being written comes from the image and is not copied back
  std::unique_ptr<node::Node> node_;
  std::optional<profile::IoBehaviour> io_;  // only for a device of CiA 401
  nmt::State last_state_ = nmt::State::initialising;
  std::uint64_t revision_ = 1;
  std::uint16_t last_emcy_ = 0;
  std::uint32_t emcys_ = 0;
  Instant now_{};  // time of the present call, for callbacks without a time
};

}  // namespace linegate::line
