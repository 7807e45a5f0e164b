// SPDX-License-Identifier: Apache-2.0
// Records lines as candump logs (bridges/can/candump.h) in a thread that waits for the disk, so
// that no line has to. An executor only copies each frame into a ring.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "bridges/can/channel.h"
#include "gateway/config/plant.h"
#include "gateway/exchange/cell.h"
#include "gateway/exchange/ring.h"
#include "gateway/exchange/wakeup.h"
#include "gateway/runtime/record_file.h"
#include "stack/base/time.h"
#include "stack/can/bus_state.h"
#include "stack/can/frame.h"

namespace linegate::gateway {

// One recorded interface.
class Recording {
 public:
  // interface: name in the log, 1 to 64 characters without blanks. line: for messages.
  Recording(std::string line, std::string interface, const config::Record& plan,
            exchange::Wakeup& writer, FileCalls& calls);

  // --- executor: neither waits nor allocates; entries without room are counted ---

  // frame.time: time on the bus.
  void add(const can::Frame& frame);
  void add(const can::BusEvent& event);

  // --- writer ---

  // Writes the entries of the ring. A failing disk is logged once and tried again every second;
  // entries are dropped until it works, and the log file then states how many. utc: UTC minus the
  // monotonic clock.
  void work(Instant now, Duration utc);

  // What became of the recording; call it while the thread is stopped.
  struct Outcome {
    int error = 0;              // errno of the last attempt to write, 0 = it was written
    std::uint64_t missing = 0;  // frames that could not be written, since the start
  };
  Outcome outcome() const { return {error_, unwritten_}; }

 private:
  struct Entry {
    bool is_event = false;
    can::Frame frame;
    can::BusEvent event;
  };
  static constexpr std::size_t kPlaces = 16'384;  // more than a second of a full 1 Mbit/s bus
  static constexpr std::size_t kBatch = 65'536;   // bytes that are written at once, about

  void push();
  void take(const Entry& entry, Duration utc);
  bool worth_a_line(const can::BusEvent& event);
  void flush(Instant now);
  void miss(std::uint64_t frames);
  void failed(int error, Instant now);
  void works_again();

  const std::string line_;
  const std::string interface_;
  const std::string file_name_;
  exchange::Wakeup& writer_;
  exchange::Ring<Entry> entries_{kPlaces};
  exchange::Counter overflows_;

  Entry next_;                  // used by the executor
  std::size_t since_look_ = 0;  // entries since the ring's fill level was checked

  RecordFile file_;  // from here on used by the writer
  Entry taken_;
  std::string text_;
  bool active_ = true;
  std::uint64_t frames_in_text_ = 0;
  std::uint64_t missing_ = 0;      // lost frames that the file does not state yet
  std::uint64_t all_missing_ = 0;  // all lost frames since the start, also of the interface
  std::uint64_t unwritten_ = 0;    // those that the interface has not lost, since the start
  std::uint64_t overflows_seen_ = 0;
  int error_ = 0;
  Instant again_{};
};

// Records the frames read from and written to an interface, except those that it can never send.
class RecordingChannel final : public can_bridge::Channel {
 public:
  // recording must outlive the channel.
  RecordingChannel(std::unique_ptr<can_bridge::Channel> channel, Recording& recording)
      : channel_(std::move(channel)), recording_(recording) {}

  int descriptor() const override { return channel_->descriptor(); }
  std::size_t read(std::span<can::Frame> out, can_bridge::BusEvents& events, Instant now) override;
  bool more() const override { return channel_->more(); }
  std::size_t write(std::span<const can::Frame> frames, Instant now) override;
  std::size_t room(Instant now) const override { return channel_->room(now); }
  bool wants_writable() const override { return channel_->wants_writable(); }
  Instant next_wake() const override { return channel_->next_wake(); }
  const can_bridge::ChannelCounters& counters() const override { return channel_->counters(); }
  can_bridge::ControllerSetup settings() const override { return channel_->settings(); }
  bool carries_fd() const override { return channel_->carries_fd(); }
  int restart(Instant now) override { return channel_->restart(now); }
  int fault(std::string_view change, std::string& said, Instant now) override {
    return channel_->fault(change, said, now);
  }

 private:
  std::unique_ptr<can_bridge::Channel> channel_;
  Recording& recording_;
  can::Frame sent_;
};

// The thread that writes all recordings.
class Recorder {
 public:
  ~Recorder() { stop(); }

  // Call it while the thread is stopped.
  Recording& add(std::string line, std::string interface, const config::Record& plan,
                 FileCalls& calls = FileCalls::system());
  // Call it while the thread is stopped, after the channel that uses the recording was destroyed.
  void remove(const Recording& recording);
  // May be started again after stop().
  void start();
  // Writes the remaining entries first.
  void stop();

 private:
  void run();

  exchange::Wakeup wakeup_;
  exchange::Flag stop_;
  std::vector<std::unique_ptr<Recording>> recordings_;
  std::thread thread_;
};

}  // namespace linegate::gateway
