// SPDX-License-Identifier: Apache-2.0
// The subject of the targets `line` and `line_fd`: a line, devices on an ideal bus with it, and
// promises that always hold.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "tests/fuzz/watched_line.h"

namespace linegate::fuzz {

enum class Role : std::uint8_t {
  manager,
  device,   // with one own node
  devices,  // with nodes of its own
  observer,
};

// The options of a line that the input selects.
struct Setup {
  Role role = Role::manager;
  bool sync = false;       // produces SYNC every 10 ms
  bool heartbeat = false;  // produces a heartbeat every 100 ms
  bool groups = false;     // two output groups and a default, instead of one group of all outputs
  bool reset_nodes = false;
  bool answering = false;  // devices answer, in addition to the frames of the input
  bool guarding = false;   // guards the node without a heartbeat every 100 ms
  bool time = false;       // produces TIME every 50 ms and stores parameters; else consumes TIME
  bool lss = false;        // assigns node-IDs, and one of the answering devices has none; role
                           // devices: the last one is an LSS slave
  bool unknown_nodes = false;  // no nodes are configured: a scan finds them
  bool strict_ixxat = false;
  bool keep_operational = false;
  bool start_all = false;      // starts all nodes with one command
  bool starts_nobody = false;  // starts no node, not even its own
  bool all_mandatory = false;  // all nodes are mandatory, else only the first
  bool own_objects = false;    // application objects in the image
  bool stop_all = false;       // stops all nodes when a mandatory node fails
  bool reset_all = false;      // resets all nodes then; takes precedence over stop_all
  bool boot_time = false;      // boot time of mandatory nodes, 1 s
  bool update_time = false;    // update time of data by object, 50 ms
  bool program = false;        // the first node gets a program download
  bool store = false;          // nodes restore their defaults before, and store after configuration
  bool keep_alive = false;     // keep-alive bit of the first two nodes
  bool fd = false;             // CANopen FD: no guarding, no LSS, no routing and no SDO connections
};

class LineSubject {
 public:
  static constexpr std::uint8_t kInterface = 1;  // number of the line's interface in the process

  explicit LineSubject(const Setup& setup);

  Instant now() const { return now_; }
  bool stopped() const { return stopped_; }
  line::Line& line() { return subject_.line(); }

  // Frames from no particular sender.
  void hear(std::span<const can::Frame> frames);
  void execute(line::Command command);  // sets a tag; ignored once the line was stopped
  // A message from another line.
  void deliver(const routing::Message& message);
  // A connection that the line opened: 0 is the last one, 1 the one before, and so on.
  std::uint32_t opened(std::size_t back) const { return opened_[back % opened_.size()]; }
  void stop();
  void advance();
  // Advances the time and calls advance() whenever it is due.
  void pass(Duration time);
  // Advances the time without any call.
  void sleep(Duration time) { now_ += time; }
  // Sends at most `frames` frames, and delivers the answers of the devices.
  void send(unsigned frames);
  void lose(unsigned frames);
  // Frames of and to the devices are lost while their cable is unplugged.
  void plug(bool in) { plugged_ = in; }
  void pop_events(std::size_t count) { subject_.pop_events(count); }
  void check_replies() { subject_.check_replies(); }
  void snapshot(image::Direction direction, bool merge) {
    subject_.snapshot(direction, merge, now_);
  }
  // Stops the line and takes everything that is left.
  void finish();

 private:
  bool next(can::Frame& frame);
  void turn_devices();
  void check_messages();
  void check_refusal(const routing::Message& message);
  void expect_no_connection();
  void run_what_was_found();

  Setup setup_;
  bool routes_;  // takes part in routing
  WatchedLine subject_;
  std::optional<WatchedLine> devices_;  // the answering devices
  bool plugged_ = true;
  std::array<std::uint32_t, 4> opened_{};
  Instant now_{std::chrono::seconds(1)};
  bool stopped_ = false;
};

}  // namespace linegate::fuzz
