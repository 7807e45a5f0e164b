#include "bridges/sim/device.h"

#include <algorithm>
#include <array>
#include <utility>

#include "bridges/sim/behaviour.h"
#include "bridges/sim/eds_files.h"
#include "bridges/sim/program_memory.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/eds/reader.h"
#include "stack/storage/parameters.h"

namespace linegate::sim {
namespace {

struct Profile {
  std::string_view name;
  std::string_view file;
  const std::string_view& text;
  std::unique_ptr<Behaviour> (*make)();
};

constexpr std::array<Profile, 4> kProfiles{{
    {"digital-io", "digital-io.eds", kDigitalIoEds, make_digital_io},
    {"analog-io", "analog-io.eds", kAnalogIoEds, make_analog_io},
    {"encoder", "encoder.eds", kEncoderEds, make_encoder},
    {"drive", "drive.eds", kDriveEds, make_drive},
}};

constexpr std::array<std::string_view, kProfiles.size()> kNames{
    kProfiles[0].name, kProfiles[1].name, kProfiles[2].name, kProfiles[3].name};

constexpr std::uint16_t kHeartbeatTime = 0x1017;
constexpr std::int64_t kMostHeartbeatMs = 65535;
// Nobody reads a simulated device's own events unless a test does.
constexpr std::size_t kEvents = 64;

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

// The heartbeat asked for becomes the device's default, so that it survives a reset.
void set_heartbeat(od::DeviceDescription& device, Duration heartbeat) {
  const std::int64_t ms = std::clamp<std::int64_t>(
      std::chrono::duration_cast<std::chrono::milliseconds>(heartbeat).count(), 0,
      kMostHeartbeatMs);
  for (od::ObjectDescription& object : device.objects) {
    if (object.index == kHeartbeatTime) {
      store_le(std::span(object.variables.front().value), static_cast<std::uint64_t>(ms));
    }
  }
}

}  // namespace

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
  const Profile* profile = find(options.profile);
  if (profile == nullptr) {
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
  auto description = eds::load(profile->text, profile->file, options.node_id);
  result.diagnostics = std::move(description.diagnostics);
  if (!description.ok()) {
    return result;
  }
  storage::mark_parameters(*description.value);
  if (options.heartbeat) {
    set_heartbeat(*description.value, *options.heartbeat);
  }
  result.value.emplace(new Device(options, profile->make(), od::Dictionary(*description.value)));
  return result;
}

Device::Device(DeviceOptions options, std::unique_ptr<Behaviour> behaviour,
               od::Dictionary dictionary)
    : options_(std::move(options)), events_(kEvents), behaviour_(std::move(behaviour)) {
  node::Options node_options;
  node_options.node_id = options_.node_id;
  node_options.self_starting = options_.self_starting;
  node_ = std::make_unique<node::Node>(std::move(dictionary), node_options, events_, nullptr);
  if (options_.medium == nullptr) {
    options_.medium = std::make_shared<storage::MemoryMedium>();
  }
  node_->set_medium(options_.medium.get());
  node_->set_application(behaviour_.get());
  behaviour_->attach(*node_, mix_seed());
  program_ = std::make_unique<ProgramMemory>(node_->dictionary());
}

Device::~Device() = default;

// Two devices of a plant with one seed shall not move alike.
std::uint64_t Device::mix_seed() const {
  return options_.seed * 128 + options_.node_id;
}

void Device::set_time(Instant now) {
  behaviour_->set_time(now);
  program_->set_time(now);
}

// Its program was stopped or started.
void Device::restart_if_due(Instant now) {
  if (program_->take_restart(now)) {
    node_->command(nmt::Command::reset_node, now);
  }
}

void Device::start(Instant now) {
  alive_ = true;
  set_time(now);
  node_->start(now);
}

void Device::kill() {
  alive_ = false;
}

void Device::revive(Instant now) {
  if (!alive_) {
    start(now);
  }
}

void Device::receive(std::span<const can::Frame> frames) {
  if (!alive_) {
    return;
  }
  for (const can::Frame& frame : frames) {
    set_time(frame.time);
    node_->receive({&frame, 1});
    behaviour_->run(frame.time);
  }
}

void Device::advance(Instant now) {
  if (alive_) {
    program_->set_time(now);
    restart_if_due(now);
    behaviour_->run(now);
    node_->advance(now);
  }
}

Instant Device::next_wake() const {
  return alive_
             ? earlier(earlier(node_->next_wake(), behaviour_->next_step()), program_->restart_at())
             : kNever;
}

bool Device::next_frame(can::Frame& out, Instant now) {
  if (!alive_) {
    return false;
  }
  set_time(now);
  return node_->next_frame(out, now);
}

bool Device::wants_to_send(Instant now) const {
  return alive_ && node_->wants_to_send(now);
}

std::size_t Device::take_events(std::span<Event> out) {
  return events_.take(out);
}

}  // namespace linegate::sim
