// SPDX-License-Identifier: Apache-2.0
// What the target `line` drives: a line, devices on an ideal bus with it, and promises that hold
// whatever happens to them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "tests/fuzz/watched_line.h"

namespace linegate::fuzz {

enum class Role : std::uint8_t {
  manager,
  device,   // with the one own node
  devices,  // with nodes of its own
  observer,
};

// What an input chooses about its line.
struct Setup {
  Role role = Role::manager;
  bool sync = false;       // produces SYNC, 10 ms
  bool heartbeat = false;  // produces a heartbeat, 100 ms
  bool groups = false;     // two output groups and a default instead of one group of all
  bool reset_nodes = false;
  bool answering = false;  // there are devices that answer, and not the input's frames alone
  bool guarding = false;   // of the node without a heartbeat, every 100 ms
  bool time = false;       // produces TIME, 50 ms, and stores parameters; otherwise consumes it
  bool lss = false;  // node-IDs are assigned, and one of the devices that answer has none. Devices:
                     // the last is an LSS slave
  bool unknown_nodes = false;  // no nodes are configured: a scan is to find them
  bool strict_ixxat = false;
  bool keep_operational = false;
  bool start_all = false;      // with one command
  bool starts_nobody = false;  // not even itself
  bool all_mandatory = false;  // and not the first alone
  bool own_objects = false;    // of an application, in the image
  bool stop_all = false;       // when a mandatory node fails
  bool reset_all = false;      // the same, and it wins
  bool boot_time = false;      // of mandatory nodes, 1 s
  bool update_time = false;    // of data by object, 50 ms
  bool program = false;        // the first node is to have a program
  bool store = false;          // nodes restore their defaults first and store at the end
  bool keep_alive = false;     // of the first two nodes
};

class LineSubject {
 public:
  static constexpr std::uint8_t kInterface = 1;  // of the line, among those of the process

  explicit LineSubject(const Setup& setup);

  Instant now() const { return now_; }
  bool stopped() const { return stopped_; }
  line::Line& line() { return subject_.line(); }

  // Frames from nowhere.
  void hear(std::span<const can::Frame> frames);
  void execute(line::Command command);  // gives it a tag; nothing once the line was stopped
  // What another line has for it.
  void deliver(const routing::Message& message);
  // A connection that the line has opened: the last one, the one before, ...
  std::uint32_t opened(std::size_t back) const { return opened_[back % opened_.size()]; }
  void stop();
  void advance();
  // Time passes, and what is due is done on time.
  void pass(Duration time);
  // Time passes, and nobody looks.
  void sleep(Duration time) { now_ += time; }
  // At most that many frames, and what devices say to them.
  void send(unsigned frames);
  void lose(unsigned frames);
  // Frames of the devices and to them are lost while their cable is unplugged.
  void plug(bool in) { plugged_ = in; }
  void take_events(std::size_t count) { subject_.take_events(count); }
  void take_replies() { subject_.take_replies(); }
  void snapshot(image::Direction direction, bool merge) {
    subject_.snapshot(direction, merge, now_);
  }
  // Stops the line and takes all there is.
  void finish();

 private:
  bool next(can::Frame& frame);
  void turn_devices();
  void take_messages();
  void take_refusal(const routing::Message& message);
  void expect_no_connection();
  void run_what_was_found();

  Setup setup_;
  bool routes_;  // takes part in routing
  WatchedLine subject_;
  std::optional<WatchedLine> devices_;  // those that answer
  bool plugged_ = true;
  std::array<std::uint32_t, 4> opened_{};
  Instant now_{std::chrono::seconds(1)};
  bool stopped_ = false;
};

}  // namespace linegate::fuzz
