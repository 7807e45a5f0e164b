// What the target `line` drives: a line, devices on an ideal bus with it, and the promises of
// stack/line/line.h, checked with every call.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <set>
#include <span>
#include <vector>

#include "stack/line/line.h"
#include "stack/node/node.h"

namespace linegate::fuzz {

// What an input chooses about its line.
struct Setup {
  bool device_role = false;  // otherwise a manager
  bool sync = false;         // produces SYNC, 10 ms
  bool heartbeat = false;    // produces a heartbeat, 100 ms
  bool groups = false;       // two output groups and a default instead of one group of all
  bool reset_nodes = false;
  bool answering = false;  // there are devices that answer, and not the input's frames alone
  bool guarding = false;   // of the node without a heartbeat, every 100 ms
  bool time = false;       // produces TIME, 50 ms, and stores parameters; otherwise consumes it
};

class LineSubject {
 public:
  static constexpr std::uint8_t kInterface = 1;  // of the line, among those of the process

  explicit LineSubject(const Setup& setup);

  Instant now() const { return now_; }
  bool stopped() const { return stopped_; }
  line::Line& line() { return *line_; }

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
  void take_events(std::size_t count);
  void take_replies();
  void snapshot(image::Direction direction, bool merge);
  // Stops the line and takes all there is: every command was answered, no event is missing.
  void finish();

 private:
  struct Device {
    explicit Device(const od::DeviceDescription& description, std::uint8_t id);
    EventLog events;
    std::unique_ptr<node::Node> node;
  };

  bool next(can::Frame& frame);
  void turn_devices();
  void check_event(const Event& event);
  void take_messages();
  void expect_no_connection();

  std::unique_ptr<line::Line> line_;
  std::vector<std::unique_ptr<Device>> devices_;
  image::Snapshot snapshots_[2];
  std::set<std::uint64_t> open_;  // tags of commands that were not answered yet
  std::array<std::uint32_t, 4> opened_{};
  Instant now_{std::chrono::seconds(1)};
  std::uint64_t next_tag_ = 1;
  std::uint64_t next_event_ = 1;
  std::uint64_t heard_ = 0;
  std::uint64_t sent_ = 0;
  bool stopped_ = false;
};

}  // namespace linegate::fuzz
