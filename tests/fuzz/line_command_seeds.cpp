// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/line_command_seeds.h"

#include <chrono>
#include <cstdint>
#include <initializer_list>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "stack/lss/procedure.h"

#include "tests/fuzz/line_steps.h"

namespace linegate::fuzz {
namespace {

using line::CommandKind;
using std::chrono::milliseconds;

constexpr std::uint8_t kAll = 0;
constexpr std::uint8_t kDrive = 5;
constexpr std::uint8_t kInputsOutputs = 6;
constexpr std::uint8_t kEncoder = 7;

std::vector<std::byte> bytes(std::initializer_list<std::uint8_t> octets) {
  std::vector<std::byte> out;
  for (const std::uint8_t octet : octets) {
    out.push_back(std::byte{octet});
  }
  return out;
}

class Script {
 public:
  Script(Role role, std::initializer_list<SetupBit> bits) : steps_(setup_bytes(role, bits)) {}

  void ask(const CommandForm& form, std::initializer_list<std::uint8_t> data = {}) {
    ask(form, bytes(data));
  }
  // Whether ask() was called with that kind.
  bool has_asked(CommandKind kind) const { return asked_.contains(kind); }
  void ask(lss::Procedure procedure, const std::vector<std::byte>& data = {}) {
    ask({.kind = CommandKind::lss, .code = static_cast<std::uint16_t>(procedure)}, data);
    wait(5);
  }
  void hear(std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    steps_.frame(can::make_frame(id, data));
  }
  void wait(std::uint8_t tenths) { steps_.step(Step::wait, {tenths}); }
  void unplug_for(std::uint8_t tenths) {
    steps_.step(Step::cable, {0});
    wait(tenths);
    steps_.step(Step::cable, {1});
  }
  void look() {
    steps_.step(Step::replies);
    steps_.step(Step::events, {64});
    steps_.step(Step::snapshot, {0, 0});
    steps_.step(Step::snapshot, {1, 0});
  }
  void save(const std::filesystem::path& file) {
    look();
    steps_.save(file);
  }

 private:
  void ask(CommandForm form, const std::vector<std::byte>& data) {
    form.data = data;
    asked_.insert(form.kind);
    steps_.command(form);
  }

  Steps steps_;
  std::set<CommandKind> asked_;
};

// A command of each kind, with valid fields for a manager of these devices.
void ask_everything(Script& script) {
  script.ask({.kind = CommandKind::sdo_read, .node = kDrive, .index = 0x1018, .sub = 1});
  script.ask({.kind = CommandKind::sdo_write, .node = kDrive, .index = 0x1015}, {0x0A, 0x00});
  script.ask(
      {.kind = CommandKind::local_read, .index = 0x1000, .code = kFormRange, .entry = 0x6000});
  script.ask({.kind = CommandKind::local_write, .index = 0x1017}, {0x64, 0x00});
  script.ask({.kind = CommandKind::output_write, .entry = 0}, {6, 0});
  script.ask({.kind = CommandKind::emcy_send, .node = kDrive, .sub = 1, .code = 0x2310}, {1, 2});
  script.ask({.kind = CommandKind::nmt, .node = kDrive, .nmt = nmt::Command::start});
  script.ask({.kind = CommandKind::network_read, .node = 5, .network = 2, .index = 0x1000});
  script.ask({.kind = CommandKind::network_write, .node = 5, .network = 1, .index = 0x1015},
             {0x0A, 0x00});
  script.ask({.kind = CommandKind::routing_trace, .code = 60});
  script.ask({.kind = CommandKind::sleep, .code = 1});
  script.ask({.kind = CommandKind::object_write, .node = kInputsOutputs, .index = 0x6200, .sub = 1},
             {0x55});
  script.ask({.kind = CommandKind::object_write,
              .node = kInputsOutputs,
              .index = 0x6200,
              .sub = 1,
              .code = kFormKeepPdo},
             {0xAA});
  script.ask({.kind = CommandKind::object_write,
              .node = kInputsOutputs,
              .index = 0x6200,
              .sub = 1,
              .code = kFormForceSdo},
             {0x0F});
  // All values of a PDO, so that it may be sent.
  script.ask({.kind = CommandKind::object_write, .node = kInputsOutputs, .index = 0x6200, .sub = 2},
             {0x33});
  script.ask({.kind = CommandKind::pdo_trigger, .node = kInputsOutputs, .code = 1});
  script.ask({.kind = CommandKind::pdo_trigger, .entry = 1});
  script.ask({.kind = CommandKind::pdo_request, .node = kInputsOutputs, .code = 1});
  script.ask({.kind = CommandKind::mpdo_write, .index = 0x2000}, {1});
  script.ask({.kind = CommandKind::connection_open, .node = kInputsOutputs, .code = kDrive});
  script.ask({.kind = CommandKind::connection_list});
  script.ask({.kind = CommandKind::connection_close, .entry = 1});
  script.ask({.kind = CommandKind::can_listen, .code = 30});
  script.ask({.kind = CommandKind::can_send, .entry = 0x8ABC'DEF0}, {1, 2, 3});
  script.ask({.kind = CommandKind::can_send, .sub = 5, .entry = 0x6F0}, {1, 2, 3, 4});
  script.ask({.kind = CommandKind::can_send, .code = 4, .entry = 0x4000'06F1});
  script.ask({.kind = CommandKind::object_create, .index = 0x2001, .sub = 1}, {0x05, 2, 1, 7});
  script.ask({.kind = CommandKind::object_create, .index = 0x2001, .code = kFormRemoval});
  script.ask({.kind = CommandKind::scan, .node = kDrive, .timeout = milliseconds(12'000)});
  script.wait(5);
  script.ask({.kind = CommandKind::boot, .node = kInputsOutputs, .timeout = milliseconds(3000)});
  script.ask({.kind = CommandKind::configure, .node = kDrive, .timeout = milliseconds(3000)});
  script.ask({.kind = CommandKind::program, .node = kDrive, .sub = 1},
             {'L', 'G', 'F', 'W', 4, 3, 2, 1, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8});
  script.ask(lss::Procedure::assign);
  script.ask({.kind = CommandKind::scan_apply, .node = kAll, .timeout = milliseconds(5000)});
  for (const CommandKind kind : line::kRequestKinds) {
    if (!script.has_asked(kind)) {
      throw std::logic_error("ask_everything() has no command of the kind " +
                             std::string(line::name(kind)));
    }
  }
  script.wait(40);
  script.look();
}

void save_everything(const std::filesystem::path& folder) {
  Script manager(Role::manager, {kAnswering, kHeartbeat, kOwnObjects, kUpdateTime});
  manager.wait(120);  // the boot time-out of the encoder has expired
  ask_everything(manager);
  manager.save(folder / "commands-manager");

  Script device(Role::device, {kAnswering, kOwnObjects});
  device.hear(0x000, {0x01, 0x00});
  ask_everything(device);
  device.save(folder / "commands-device");

  Script devices(Role::devices, {kLss, kSync});
  devices.hear(0x000, {0x01, 0x00});
  ask_everything(devices);
  devices.hear(0x7E5, {0x04, 1, 0, 0, 0, 0, 0, 0});
  devices.hear(0x7E5, {0x11, 7, 0, 0, 0, 0, 0, 0});
  devices.hear(0x7E5, {0x17, 0, 0, 0, 0, 0, 0, 0});
  devices.hear(0x7E5, {0x04, 0, 0, 0, 0, 0, 0, 0});
  devices.wait(2);
  devices.save(folder / "commands-devices");

  Script observer(Role::observer, {kAnswering, kHeartbeat});
  ask_everything(observer);
  observer.hear(0x6F0, {1, 2, 3});
  observer.save(folder / "commands-observer");
}

void save_scans(const std::filesystem::path& folder) {
  Script scan(Role::manager, {kAnswering, kUnknownNodes});
  scan.wait(5);
  scan.ask({.kind = CommandKind::scan});
  scan.wait(100);
  scan.ask({.kind = CommandKind::sdo_read,
            .node = kDrive,
            .index = 0x1018,
            .sub = 1,
            .code = kFormFromScan});
  scan.ask({.kind = CommandKind::scan, .node = kEncoder});
  scan.hear(0x707, {0x00});
  scan.wait(20);
  scan.save(folder / "scan");

  Script apply(Role::manager, {kAnswering, kUnknownNodes, kHeartbeat, kStrict});
  apply.wait(5);
  apply.ask({.kind = CommandKind::scan_apply, .code = kFormSetUp | kFormRestore});
  apply.wait(20);
  apply.unplug_for(5);
  apply.wait(100);
  apply.ask({.kind = CommandKind::scan_apply, .timeout = milliseconds(300)});
  apply.wait(20);
  apply.save(folder / "scan-and-apply");
}

void save_configuration(const std::filesystem::path& folder) {
  Script boot(Role::manager, {kAnswering, kHeartbeat, kResetNodes, kStore});
  boot.wait(10);
  boot.ask({.kind = CommandKind::boot, .node = kDrive});
  boot.wait(5);
  boot.ask({.kind = CommandKind::boot, .node = kAll, .timeout = milliseconds(2000)});
  boot.unplug_for(5);
  boot.wait(25);
  boot.ask({.kind = CommandKind::configure, .node = kAll});
  boot.wait(20);
  boot.ask({.kind = CommandKind::configure, .node = kInputsOutputs, .code = 1});
  boot.wait(20);
  boot.save(folder / "boot-and-configure");

  Script program(Role::manager, {kAnswering, kHeartbeat, kProgram});
  program.wait(50);
  program.ask(
      {.kind = CommandKind::program, .node = kDrive, .sub = 1, .timeout = milliseconds(10'000)},
      {'L', 'G', 'F', 'W', 4, 3, 2, 1, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8});
  program.wait(20);
  program.unplug_for(10);
  program.wait(100);
  program.save(folder / "program");
}

// The LSS address of the encoder, from its device file.
lss::Address encoder_address() {
  lss::Address out{};
  for (std::uint8_t part = 0; part < lss::kParts; ++part) {
    const auto* const variable = description(2).find({0x1018, static_cast<std::uint8_t>(part + 1)});
    for (std::size_t i = 0; variable != nullptr && i < variable->value.size(); ++i) {
      out[part] |= std::to_integer<std::uint32_t>(variable->value[i]) << 8U * i;
    }
  }
  return out;
}

void save_lss(const std::filesystem::path& folder) {
  using lss::Procedure;
  std::vector<std::byte> address;
  lss::put(encoder_address(), address);

  Script assign(Role::manager, {kAnswering, kLss, kStore, kResetNodes});
  assign.wait(100);
  assign.ask(Procedure::assign);
  assign.unplug_for(10);
  assign.wait(100);
  assign.save(folder / "lss-assign");

  Script services(Role::manager, {kAnswering, kLss, kUnknownNodes});
  services.ask(Procedure::identify_unconfigured);
  services.ask(Procedure::fastscan);
  services.wait(20);
  services.ask(Procedure::inquire_address);
  services.ask(Procedure::inquire_node_id);
  services.ask(Procedure::configure_node_id, bytes({7}));
  services.ask(Procedure::configure_bit_timing, bytes({0, 2}));
  services.ask(Procedure::store);
  services.ask(Procedure::switch_global, bytes({0}));
  services.ask(Procedure::switch_selective, address);
  services.ask(Procedure::activate_bit_timing, bytes({10, 0}));
  services.wait(10);
  services.ask(Procedure::identify, bytes({1,   0,   0,   0,   1, 0, 0, 0, 0,   0,   0,   0,
                                           255, 255, 255, 255, 0, 0, 0, 0, 255, 255, 255, 255}));
  services.save(folder / "lss-services");
}

// Mandatory nodes appear late, fail and return, each input with another reaction of 1F80h.
void save_reactions(const std::filesystem::path& folder) {
  const auto fail = [](Script script, const std::filesystem::path& file) {
    script.wait(20);
    script.unplug_for(20);
    script.wait(30);
    script.ask({.kind = CommandKind::nmt, .node = 0, .nmt = nmt::Command::reset_node});
    script.wait(20);
    script.ask({.kind = CommandKind::local_read, .index = 0x1F82, .sub = kDrive});
    script.ask({.kind = CommandKind::local_write, .index = 0x1F82, .sub = kAll}, {5});
    script.ask({.kind = CommandKind::local_write, .index = 0x1F80}, {0, 0, 0, 0});
    script.wait(10);
    script.ask({.kind = CommandKind::local_write, .index = 0x1F80}, {1, 0, 0, 0});
    script.wait(20);
    script.save(file);
  };
  fail(Script(Role::manager, {kAnswering, kHeartbeat, kStopAll, kStartAll, kKeepOperational}),
       folder / "stop-all");
  fail(Script(Role::manager, {kAnswering, kGuarding, kResetAll, kMandatory, kBootTime}),
       folder / "reset-all");
  fail(Script(Role::manager, {kAnswering, kHeartbeat, kStartsNobody, kKeepAlive, kSync}),
       folder / "starts-nobody");
}

// The conditions that the manual calls fatal.
void save_strict(const std::filesystem::path& folder) {
  Script strict(Role::manager, {kAnswering, kHeartbeat, kStrict, kMandatory, kSync, kGroups});
  strict.wait(20);
  strict.hear(0x185, {1});
  strict.wait(5);
  strict.hear(0x70A, {0x05});
  strict.wait(5);
  strict.ask({.kind = CommandKind::nmt, .node = 10, .nmt = nmt::Command::reset_node});
  strict.wait(20);
  strict.hear(0x000, {0x02, 0x00});
  strict.hear(0x071, {});
  strict.wait(20);
  strict.save(folder / "strict");
}

}  // namespace

void save_command_seeds(const std::filesystem::path& folder) {
  save_everything(folder);
  save_scans(folder);
  save_configuration(folder);
  save_lss(folder);
  save_reactions(folder);
  save_strict(folder);
}

}  // namespace linegate::fuzz
