// SPDX-License-Identifier: Apache-2.0
#include "bridges/sim/device.h"

#include <algorithm>
#include <array>
#include <utility>

#include "bridges/sim/behaviour.h"
#include "bridges/sim/eds_files.h"
#include "bridges/sim/program_memory.h"
#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/eds/reader.h"
#include "stack/lss/slave.h"
#include "stack/nmt/node_control.h"
#include "stack/od/objects.h"
#include "stack/storage/parameters.h"

namespace linegate::sim {
namespace {

constexpr std::string_view kFdProfile = "fd-io";

struct Profile {
  std::string_view name;
  std::string_view file;
  const std::string_view& text;
  std::unique_ptr<Behaviour> (*make)();
};

constexpr std::array<Profile, 5> kProfiles{{
    {"digital-io", "digital-io.eds", kDigitalIoEds, make_digital_io},
    {"analog-io", "analog-io.eds", kAnalogIoEds, make_analog_io},
    {"encoder", "encoder.eds", kEncoderEds, make_encoder},
    {"drive", "drive.eds", kDriveEds, make_drive},
    {kFdProfile, "fd-io.eds", kFdIoEds, make_fd_io},
}};

constexpr std::array<std::string_view, kProfiles.size()> kNames{
    kProfiles[0].name, kProfiles[1].name, kProfiles[2].name, kProfiles[3].name, kProfiles[4].name};

constexpr std::int64_t kMostHeartbeatMs = 65535;
// A few are enough: only tests read a simulated device's events.
constexpr std::size_t kEvents = 64;
constexpr std::uint8_t kSerialNumber = 4;
constexpr std::size_t kLssAnswers = 8;

const Profile* find(std::string_view name) {
  const auto* found =
      std::ranges::find_if(kProfiles, [name](const Profile& p) { return p.name == name; });
  return found == kProfiles.end() ? nullptr : found;
}

Diagnostic refusal(std::string text) {
  Diagnostic diagnostic;
  diagnostic.file = "simulated device";
  diagnostic.text = std::move(text);
  return diagnostic;
}

std::string known_profiles() {
  std::string list;
  for (const std::string_view name : kNames) {
    list += (list.empty() ? "" : ", ") + std::string(name);
  }
  return list;
}

// Makes the configured heartbeat time the default of 1017h, so that it survives a reset.
void set_heartbeat(od::DeviceDescription& device, Duration heartbeat) {
  const std::int64_t ms = std::clamp<std::int64_t>(
      std::chrono::duration_cast<std::chrono::milliseconds>(heartbeat).count(), 0,
      kMostHeartbeatMs);
  for (od::ObjectDescription& object : device.objects) {
    if (object.index == od::objects::kProducerHeartbeatTime) {
      store_le(std::span(object.variables.front().value), static_cast<std::uint64_t>(ms));
    }
  }
}

void set_serial(od::DeviceDescription& device, std::uint32_t serial) {
  for (od::ObjectDescription& object : device.objects) {
    for (od::VariableDescription& variable : object.variables) {
      if (object.index == od::objects::kIdentity && variable.sub == kSerialNumber) {
        store_le(std::span(variable.value), std::uint64_t{serial});
      }
    }
  }
}

// Does nothing if the EDS lacks the object.
void set_default(od::DeviceDescription& device, od::Address address, std::uint64_t value) {
  for (od::ObjectDescription& object : device.objects) {
    for (od::VariableDescription& variable : object.variables) {
      if (od::Address{object.index, variable.sub} == address) {
        store_le(std::span(variable.value), value);
      }
    }
  }
}

// Describes the device with that node-ID. Preconditions: the node-ID is valid, the profile exists.
Loaded<od::DeviceDescription> describe(const DeviceOptions& options, std::uint8_t node_id) {
  const Profile* const known = find(options.profile);
  LINEGATE_ASSERT(known != nullptr, "the profile is known");
  const Profile& profile = *known;
  auto out = eds::load(profile.text, profile.file, node_id);
  if (!out.ok()) {
    return out;
  }
  storage::mark_parameters(*out.value);
  if (options.heartbeat) {
    set_heartbeat(*out.value, *options.heartbeat);
  }
  if (options.serial) {
    set_serial(*out.value, *options.serial);
  }
  for (const auto& [address, value] : options.defaults) {
    set_default(*out.value, address, value);
  }
  return out;
}

lss::Address lss_address(od::Dictionary& dictionary) {
  lss::Address out{};
  for (std::uint8_t part = 0; part < lss::kParts; ++part) {
    out[part] = static_cast<std::uint32_t>(
        dictionary.number({od::objects::kIdentity, static_cast<std::uint8_t>(part + 1)})
            .value_or(0));
  }
  return out;
}

}  // namespace

// Its memory survives power-off and lives as long as the Device.
struct Device::Lss final : lss::SlaveHost {
  explicit Lss(const lss::Address& address) : slave(address, this) {}

  lss::StoreResult store(const lss::Settings& settings) override {
    kept = settings;
    return lss::StoreResult::stored;
  }
  // The bus determines the bit rate; the configured value is only stored.
  bool has_bit_timing(std::uint8_t index) const override {
    return lss::bit_rate(index).has_value();
  }

  lss::Settings kept;
  std::optional<bool> reset;  // an NMT reset while the device has no node-ID; true: reset node
  lss::Slave slave;
  can::TransmitQueue answers{kLssAnswers};
};

bool needs_fd(std::string_view profile) {
  return profile == kFdProfile;
}

std::span<const std::string_view> profiles() {
  return kNames;
}

std::string_view eds_name(std::string_view profile) {
  const Profile* found = find(profile);
  return found != nullptr ? found->file : std::string_view{};
}

std::string_view eds_text(std::string_view profile) {
  const Profile* found = find(profile);
  return found != nullptr ? found->text : std::string_view{};
}

Loaded<std::unique_ptr<Device>> Device::make(const DeviceOptions& options) {
  Loaded<std::unique_ptr<Device>> result;
  if (find(options.profile) == nullptr) {
    result.diagnostics.push_back(
        refusal("unknown profile \"" + options.profile + "\": known are " + known_profiles()));
  }
  if (options.node_id < can::kMinNodeId || options.node_id > can::kMaxNodeId) {
    result.diagnostics.push_back(
        refusal("node-ID " + std::to_string(options.node_id) + " is not in 1..127"));
  }
  if (!result.diagnostics.empty()) {
    return result;
  }
  auto description = describe(options, options.node_id);
  result.diagnostics = std::move(description.diagnostics);
  if (!description.ok()) {
    return result;
  }
  std::unique_ptr<Device> device(new Device(options));
  device->build(*description.value);
  device->be_lss_slave();
  result.value.emplace(std::move(device));
  return result;
}

Device::Device(DeviceOptions options) : options_(std::move(options)), events_(kEvents) {
  if (options_.medium == nullptr) {
    options_.medium = std::make_shared<storage::MemoryMedium>();
  }
}

Device::~Device() = default;

void Device::build(const od::DeviceDescription& description) {
  node::Options node_options;
  node_options.node_id = description.node_id;
  node_options.self_starting = options_.self_starting;
  node_options.fd = options_.fd || needs_fd(options_.profile);
  node_options.emcy_fd = options_.emcy_fd;
  program_.reset();  // it refers to the previous node
  node_ = std::make_unique<node::Node>(od::Dictionary(description), node_options, events_, nullptr);
  behaviour_ = find(options_.profile)->make();
  node_->set_medium(options_.medium.get());
  node_->set_application(behaviour_.get());
  behaviour_->attach(*node_, mix_seed());
  program_ = std::make_unique<ProgramMemory>(node_->dictionary());
}

// The LSS address does not depend on the node-ID.
void Device::be_lss_slave() {
  const lss::Address address = lss_address(node_->dictionary());
  options_.serial = address[lss::kSerial];
  lss_ = std::make_unique<Lss>(address);
  lss_->kept.node_id =
      options_.unconfigured ? lss::kNoNodeId : options_.has_node_id.value_or(options_.node_id);
  lss_->slave.set_faults(options_.lss_faults);
  lss_->slave.power_on(lss_->kept);
}

// Values that depend on the node-ID are in the description.
void Device::rebuild(std::uint8_t node_id) {
  if (node_->node_id() != node_id) {
    build(*describe(options_, node_id).value);
  }
}

// Two devices with the same seed must not move alike.
std::uint64_t Device::mix_seed() const {
  return options_.seed * 128 + options_.node_id;
}

bool Device::has_node_id() const {
  return lss_->slave.active_node_id() != lss::kNoNodeId;
}

std::uint8_t Device::node_id() const {
  return has_node_id() ? node_->node_id() : std::uint8_t{0};
}

const lss::Slave& Device::lss_slave() const {
  return lss_->slave;
}

void Device::set_time(Instant now) {
  behaviour_->set_time(now);
  program_->set_time(now);
}

// After its program was stopped or started.
void Device::restart_if_due(Instant now) {
  if (program_->pop_restart(now)) {
    node_->command(nmt::Command::reset_node, now);
  }
}

void Device::start(Instant now) {
  alive_ = true;
  lss_->slave.power_on(lss_->kept);
  lss_->answers.clear();
  if (!has_node_id()) {
    return;
  }
  rebuild(lss_->slave.active_node_id());
  set_time(now);
  node_->start(now);
  // Discard the power-on reset, which the LSS slave already processed
  (void)behaviour_->pop_reset();
}

void Device::kill() {
  alive_ = false;
}

void Device::revive(Instant now) {
  if (!alive_) {
    start(now);
  }
}

// The pending node-ID becomes active at an NMT reset, and when the slave leaves LSS configuration
// state with its first node-ID.
void Device::follow_lss(Instant now) {
  std::optional<bool> reset = behaviour_->pop_reset();
  reset = reset ? reset : lss_->reset;
  lss_->reset.reset();
  const bool first = lss_->slave.pop_reset();
  if (!first && !reset) {
    return;
  }
  const std::uint8_t before = lss_->slave.active_node_id();
  const std::uint8_t active = lss_->slave.reset(reset.value_or(false));
  if (active != before && active != lss::kNoNodeId) {
    rebuild(active);
    behaviour_->set_time(now);
    node_->start(now);
    (void)behaviour_->pop_reset();
  }
}

// Devices with the fault `boots_at_reset` take their node-ID at the next NMT reset.
void Device::hear_without_node_id(const can::Frame& frame) {
  const auto control =
      frame.id == can::kNmtId && !frame.extended() ? nmt::decode_node_control(frame) : std::nullopt;
  const bool meant = control && nmt::is_reset(control->command) &&
                     (control->node == 0 || control->node == lss_->slave.pending().node_id);
  if (meant && options_.lss_faults.boots_at_reset) {
    lss_->reset = control->command == nmt::Command::reset_node;
  }
}

void Device::receive(std::span<const can::Frame> frames) {
  if (!alive_) {
    return;
  }
  for (const can::Frame& frame : frames) {
    if (frame.id == lss::kMasterId && !frame.extended()) {
      (void)lss_->slave.receive(frame, lss_->answers);
    } else if (has_node_id()) {
      set_time(frame.time);
      node_->receive({&frame, 1});
      behaviour_->run(frame.time);
    } else {
      hear_without_node_id(frame);
    }
    follow_lss(frame.time);
  }
}

void Device::advance(Instant now) {
  if (!alive_) {
    return;
  }
  lss_->slave.advance(now);
  if (has_node_id()) {
    program_->set_time(now);
    restart_if_due(now);
    behaviour_->run(now);
    node_->advance(now);
  }
  follow_lss(now);
}

Instant Device::next_wake() const {
  if (!alive_) {
    return kNever;
  }
  const Instant wake = lss_->slave.next_wake();
  const Instant restart = earlier(wake, program_->restart_at());
  return has_node_id() ? earlier(restart, earlier(node_->next_wake(), behaviour_->next_step()))
                       : wake;
}

bool Device::next_frame(can::Frame& out, Instant now) {
  if (!wants_to_send(now)) {
    return false;
  }
  set_time(now);
  if (has_node_id() && node_->next_frame(out, now)) {
    return true;
  }
  return lss_->answers.pop(out);
}

bool Device::wants_to_send(Instant now) const {
  if (!alive_ || lss_->slave.silent()) {
    return false;
  }
  return (has_node_id() && node_->wants_to_send(now)) || !lss_->answers.empty();
}

std::size_t Device::pop_events(std::span<Event> out) {
  return events_.take(out);
}

}  // namespace linegate::sim
