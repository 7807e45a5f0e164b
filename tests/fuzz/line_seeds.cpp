// SPDX-License-Identifier: Apache-2.0
// Writes the inputs of the target `line` that are kept in corpus/line: runs a line together with
// simulated devices, and records the frames of the devices, with their times, as steps of the
// target. With `fd`, those of the target `line_fd` in corpus/line_fd.
//
// usage: line_seeds FOLDER [fd]
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bridges/sim/device_group.h"
#include "stack/emcy/producer.h"
#include "stack/usdo/protocol.h"

#include "tests/fuzz/line_command_seeds.h"
#include "tests/fuzz/line_steps.h"
#include "tests/fuzz/line_subject.h"

namespace {

using namespace linegate;
using fuzz::Role;
using fuzz::SetupBit;
using fuzz::Step;
using fuzz::Steps;
using line::CommandKind;
using std::chrono::milliseconds;

class Recording {
 public:
  explicit Recording(const fuzz::SetupBytes& setup, bool fd = false)
      : fd_(fd), subject_(subject(setup, fd)), steps_(setup) {}

  void add_device(std::uint8_t node, std::string profile) {
    sim::DeviceOptions options;
    options.profile = std::move(profile);
    options.node_id = node;
    options.fd = fd_;
    auto device = sim::Device::make(options);
    (*device.value)->start(subject_.now());
    devices_.add(*std::move(device.value));
  }
  sim::Device& device(std::uint8_t node) { return *devices_.find(node); }
  Instant now() const { return subject_.now(); }

  // Runs line and devices, and records the frames of the devices.
  void run(int ms) {
    for (; ms > 0; --ms) {
      exchange();
      subject_.sleep(milliseconds(1));
      ++passed_;
    }
  }

  void hear(std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    hear(can::make_frame(id, data));
  }
  void hear(can::Frame frame) {
    frame.time = subject_.now();
    catch_up();
    steps_.frame(frame);
    subject_.hear(std::span(&frame, 1));
  }

  void command(CommandKind kind, std::uint8_t node, od::Address address,
               std::initializer_list<std::uint8_t> data = {}, nmt::Command nmt = {}) {
    fuzz::CommandForm form{.kind = kind, .node = node, .nmt = nmt};
    form.index = address.index;
    form.sub = address.sub;
    for (const std::uint8_t byte : data) {
      form.data.push_back(std::byte{byte});
    }
    catch_up();
    steps_.command(form);
    subject_.execute(fuzz::to_command(std::move(form)));
  }

  // A message from line 2. connection: as in Step::message.
  void message(routing::MessageKind kind, std::uint8_t connection, std::uint16_t network,
               std::uint8_t node, std::uint64_t word = 0, std::uint8_t gateway = 0) {
    routing::Message out{.from = 2,
                         .to = fuzz::LineSubject::kInterface,
                         .kind = kind,
                         .hops = 1,
                         .connection = connection < 128 ? subject_.opened(connection) : connection,
                         .network = network,
                         .source = 2,
                         .node = node,
                         .gateway = gateway};
    store_le(out.data.data(), word);
    catch_up();
    steps_.step(Step::message, {static_cast<std::uint8_t>(kind), 2, 0, connection,
                                Steps::byte_of(network, 0), 2, node, gateway, 1});
    steps_.put_data(out.data);
    subject_.deliver(out);
  }

  // Writes 2 bytes to an entry of a group, without reactions. The effect on the devices is recorded
  // in their frames.
  void write_outputs(std::uint8_t group, std::uint8_t arming, std::uint8_t watchdog_ms,
                     std::uint8_t entry, std::uint16_t value) {
    catch_up();
    steps_.step(Step::write, {group, arming, watchdog_ms, 0, 1, entry, 2, Steps::byte_of(value, 0),
                              Steps::byte_of(value, 1)});
  }

  void save(const std::filesystem::path& file) {
    catch_up();
    steps_.step(Step::advance);
    steps_.step(Step::replies);
    steps_.step(Step::snapshot, {0, 0});
    steps_.save(file);
  }

 private:
  static fuzz::Setup subject(const fuzz::SetupBytes& setup, bool fd) {
    fuzz::Setup out = fuzz::setup(setup);
    out.fd = fd;
    return out;
  }

  void catch_up() {
    for (; passed_ > 0; passed_ -= std::min(passed_, 255)) {
      steps_.step(Step::pass, {static_cast<std::uint8_t>(std::min(passed_, 255))});
    }
  }

  void exchange() {
    subject_.advance();
    devices_.advance(now());
    can::Frame frame;
    for (bool busy = true; busy;) {
      busy = false;
      while (subject_.line().next_frame(frame, now())) {
        frame.time = now();
        devices_.receive(std::span(&frame, 1));
        busy = true;
      }
      while (devices_.next_frame(frame, now())) {
        hear(frame);
        busy = true;
      }
    }
  }

  const bool fd_;
  fuzz::LineSubject subject_;
  sim::DeviceGroup devices_;
  Steps steps_;
  int passed_ = 0;  // milliseconds that are not recorded yet
};

Recording plant(std::initializer_list<SetupBit> bits) {
  Recording out(fuzz::setup_bytes(Role::manager, bits));
  out.add_device(5, "drive");
  out.add_device(6, "digital-io");
  out.add_device(7, "encoder");
  return out;
}

void save_boot(const std::filesystem::path& folder) {
  Recording boot = plant({fuzz::kHeartbeat, fuzz::kResetNodes});
  boot.run(400);
  boot.save(folder / "boot");
}

void save_outputs(const std::filesystem::path& folder) {
  Recording outputs = plant({fuzz::kSync, fuzz::kGroups});
  outputs.run(60);
  outputs.write_outputs(1, 1, 50, 0, 6);
  outputs.write_outputs(2, 1, 0, 2, 0x55);
  outputs.run(30);
  outputs.write_outputs(1, 1, 50, 0, 7);
  outputs.run(120);  // the watchdog fires
  outputs.write_outputs(1, 2, 50, 0, 15);
  outputs.run(20);
  outputs.save(folder / "outputs-and-sync");
}

void save_transfers(const std::filesystem::path& folder) {
  Recording transfers = plant({});
  transfers.run(40);
  transfers.command(CommandKind::sdo_read, 5, {0x1018, 1});
  transfers.command(CommandKind::sdo_read, 6, {0x1008, 0});  // segmented
  transfers.command(CommandKind::sdo_read, 7, {0x1FFF, 0});  // aborted
  transfers.run(5);
  transfers.command(CommandKind::sdo_write, 5, {0x1017, 0}, {0x14, 0x00});
  transfers.command(CommandKind::sdo_write, 5, {0x1018, 1}, {1, 2, 3, 4});
  transfers.command(CommandKind::local_read, 0, {0x1000, 0});
  transfers.run(60);
  transfers.command(CommandKind::nmt, 6, {}, {}, nmt::Command::reset_node);
  transfers.run(40);
  transfers.save(folder / "transfers");
}

void save_faults(const std::filesystem::path& folder) {
  Recording faults = plant({fuzz::kHeartbeat});
  faults.run(40);
  faults.device(5).node().emcy().send(0x2310, 0x03, {}, faults.now());
  faults.run(10);
  faults.device(5).node().emcy().send(0, 0, {}, faults.now());
  faults.hear(0x185, {0x01});           // too short
  faults.hear(0x587, {0x01, 0x02});     // not an SDO frame
  faults.hear(0x707, {0x05, 0x05});     // not a heartbeat
  faults.hear(0x087, {0x00, 0x10, 1});  // not an EMCY
  faults.hear(0x63F, {0x40, 0x18, 0x10, 1, 0, 0, 0, 0});
  faults.device(7).kill();
  faults.run(600);
  faults.device(7).revive(faults.now());
  faults.run(100);
  faults.save(folder / "faults");
}

void save_guarding(const std::filesystem::path& folder) {
  Recording guarding = plant({fuzz::kGuarding});
  guarding.run(300);
  guarding.device(6).kill();
  guarding.run(500);
  guarding.device(6).revive(guarding.now());
  guarding.run(300);
  guarding.save(folder / "guarding");
}

// The own node produces TIME and stores its parameters.
void save_time(const std::filesystem::path& folder) {
  Recording time = plant({fuzz::kTime});
  time.run(120);
  time.hear(0x60A, {0x2B, 0x15, 0x10, 0, 0x0A, 0x00, 0, 0});
  time.hear(0x60A, {0x23, 0x10, 0x10, 1, 's', 'a', 'v', 'e'});
  time.hear(0x60A, {0x23, 0x11, 0x10, 1, 'l', 'o', 'a', 'd'});
  time.hear(0x60A, {0x23, 0x20, 0x10, 1, 1, 2, 3, 4});
  time.run(60);
  time.save(folder / "time-and-storage");
}

// The line routes in both directions: clients here reach line 2, and clients of line 2 reach
// devices here.
void save_routing(const std::filesystem::path& folder) {
  using routing::MessageKind;
  Recording routed = plant({});
  routed.run(60);
  routed.hear(0x60A, {0xE0, 2, 0, 5, 1, 0, 0, 0});
  routed.message(MessageKind::sdo_opened, 0, 0, 0);
  routed.hear(0x60A, {0x40, 0x18, 0x10, 1, 0, 0, 0, 0});
  routed.message(MessageKind::sdo_response, 0, 0, 0, 0x0000'0191'0110'1843);
  // The first gateway refuses, the second does not answer.
  routed.hear(0x60A, {0xE0, 3, 0, 7, 1, 0, 0, 0});
  routed.message(MessageKind::sdo_refused, 0, 0, 0, 0x0504'0000);
  routed.message(MessageKind::sdo_opened, 0, 0, 0);
  routed.hear(0x60A, {0xC6, 0x00, 0x20, 1, 20, 0, 0, 0});
  routed.message(MessageKind::sdo_response, 0, 0, 0, 0x0000'007F'0120'00A4);
  for (const std::uint8_t segment : std::initializer_list<std::uint8_t>{0x01, 0x02, 0x83}) {
    routed.hear(0x60A, {segment, 1, 2, 3, 4, 5, 6, 7});
  }
  routed.hear(0x60A, {0x80, 0x00, 0x20, 1, 0, 0, 0, 8});
  routed.message(MessageKind::sdo_open, 200, 1, 5);
  routed.run(2);
  routed.message(MessageKind::sdo_request, 200, 0, 0, 0x0000'0000'0110'1840);
  routed.run(5);
  routed.message(MessageKind::sdo_open, 201, 4, 7, 0, 5);  // node 5 as the next gateway
  routed.run(20);
  routed.message(MessageKind::sdo_open, 202, 1, 10);  // the own node
  routed.message(MessageKind::sdo_request, 202, 0, 0, 0x0000'0000'001F'2C40);
  routed.message(MessageKind::sdo_close, 202, 0, 0, 0x0800'0000);
  routed.message(MessageKind::emcy, 0, 1, 5, 0x0101'0500'0211'8130);
  routed.device(5).node().emcy().send(0x2310, 0x03, {}, routed.now());
  routed.device(6).node().emcy().send(0x2310, 0x03, {}, routed.now());
  routed.run(20);
  routed.save(folder / "routing");
}

// The own node, 10, as a device. The frames of its master are written here by hand.
void save_device(const std::filesystem::path& folder) {
  Recording device(fuzz::setup_bytes(Role::device, {fuzz::kHeartbeat}));
  device.run(5);
  device.hear(0x60A, {0x40, 0x18, 0x10, 1, 0, 0, 0, 0});
  device.hear(0x60A, {0x40, 0x08, 0x10, 0, 0, 0, 0, 0});
  for (const std::uint8_t segment : std::initializer_list<std::uint8_t>{0x60, 0x70, 0x60}) {
    device.hear(0x60A, {segment, 0, 0, 0, 0, 0, 0, 0});
  }
  device.hear(0x60A, {0x2B, 0x17, 0x10, 0, 0x0A, 0x00, 0, 0});
  device.hear(0x60A, {0xC6, 0x17, 0x10, 0, 2, 0, 0, 0});     // block download
  device.hear(0x60A, {0xA4, 0x08, 0x10, 0, 0x7F, 0, 0, 0});  // block upload
  device.hear(0x60A, {0x80, 0x08, 0x10, 0, 0, 0, 0x04, 0x05});
  device.hear(0x000, {0x01, 0x0A});
  for (std::uint8_t i = 0; i < 5; ++i) {
    device.hear(0x080, {});
    device.hear(0x185, {i, 0x06, 0, 0});
    device.hear(0x186, {i, i});
    device.run(10);
  }
  device.hear(0x000, {0x82, 0x00});
  device.run(10);
  device.hear(0x000, {0x02, 0x0A});
  device.run(10);
  device.save(folder / "device-role");
}

// --- CANopen FD ---------------------------------------------------------------------------------

Recording fd_plant(std::initializer_list<SetupBit> bits) {
  Recording out(fuzz::setup_bytes(Role::manager, bits), true);
  for (const fuzz::Member& member : fuzz::kMembers) {
    out.add_device(member.id, "fd-io");
  }
  return out;
}

// USDO transfers of each kind, outputs of more than 8 bytes, an EMCY, a device that restarts.
void save_fd_seeds(const std::filesystem::path& folder) {
  Recording boot = fd_plant({fuzz::kHeartbeat, fuzz::kResetNodes});
  boot.run(400);
  boot.save(folder / "boot");

  Recording transfers = fd_plant({fuzz::kSync, fuzz::kGroups});
  transfers.run(60);
  transfers.write_outputs(1, 1, 50, 0, 6);
  transfers.run(30);
  transfers.command(CommandKind::sdo_read, 5, {0x1018, 1});
  transfers.command(CommandKind::sdo_read, 6, {0x1008, 0});
  transfers.command(CommandKind::sdo_read, 7, {0x1FFF, 0});  // aborted
  transfers.command(CommandKind::sdo_write, 5, {0x1017, 0}, {0x14, 0x00});
  transfers.run(60);
  transfers.device(5).node().emcy().send(0x2310, 0x03, {}, transfers.now());
  transfers.command(CommandKind::nmt, 6, {}, {}, nmt::Command::reset_node);
  transfers.run(100);
  transfers.device(7).kill();
  transfers.run(500);
  transfers.save(folder / "transfers-and-faults");

  Recording device(fuzz::setup_bytes(Role::device, {fuzz::kHeartbeat}), true);
  device.run(5);
  device.hear(usdo::object_frame({0x601, 10, 1}, usdo::Command::upload, {0x1018, 1}));
  device.hear(usdo::object_frame({0x601, 10, 2}, usdo::Command::upload, {0x1008, 0}));
  constexpr std::array kValue{std::byte{10}, std::byte{0}};
  device.hear(usdo::expedited_frame({0x602, 10, 1}, usdo::Command::download, {0x1017, 0},
                                    od::DataType::unsigned16, kValue));
  device.hear(usdo::initiate_frame({0x602, 10, 3}, usdo::Command::download_initiate, {0x1F50, 1},
                                   od::DataType::domain, 100));
  device.run(30);
  device.save(folder / "device-role");
}

void save_classical_seeds(const std::filesystem::path& folder) {
  save_boot(folder);
  save_outputs(folder);
  save_transfers(folder);
  save_faults(folder);
  save_guarding(folder);
  save_time(folder);
  save_routing(folder);
  save_device(folder);
  fuzz::save_command_seeds(folder);
}

}  // namespace

int main(int argc, char** argv) {
  const std::span<char*> words(argv, static_cast<std::size_t>(argc));
  const bool fd = words.size() == 3 && std::string_view(words[2]) == "fd";
  if (words.size() != 2 && !fd) {
    std::fputs("usage: line_seeds FOLDER [fd]\n", stderr);
    return 2;
  }
  const std::filesystem::path folder = words[1];
  std::filesystem::create_directories(folder);
  fd ? save_fd_seeds(folder) : save_classical_seeds(folder);
  return 0;
}
