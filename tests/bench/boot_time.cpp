// SPDX-License-Identifier: Apache-2.0
// The boot of a whole line in virtual time: 126 devices, 20 objects configured in each, at 1
// Mbit/s. A device answers each request 0.5 ms after its last bit. For comparison, the time that
// the frames required by CiA 302-2 occupy the wire, plus one response time: the minimum for any
// manager.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bridges/sim/bus.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/line/line.h"

#include "tests/bench/measure.h"

namespace {

using namespace linegate;

constexpr std::uint8_t kDevices = 126;
constexpr unsigned kObjects = 20;  // 1017h is one of them
constexpr std::uint8_t kOwn = 127;
constexpr Duration kResponse = std::chrono::microseconds(500);
constexpr Duration kHeartbeat = std::chrono::seconds(1);
constexpr double kLimit = 1.2;
// 1000h, 1018h:1 to 4 and the objects: one request and one answer each.
constexpr std::size_t kSdoFrames = 2 * (5 + kObjects);

constexpr std::uint8_t kUploadAnswer = 0x43;  // expedited, 4 bytes
constexpr std::uint8_t kDownloadAnswer = 0x60;

od::ObjectDescription object(std::uint16_t index, std::vector<std::uint32_t> values) {
  od::ObjectDescription out{.index = index, .name = "object"};
  for (std::size_t sub = 0; sub < values.size(); ++sub) {
    od::VariableDescription variable;
    variable.sub = static_cast<std::uint8_t>(sub);
    variable.type = od::DataType::unsigned32;
    variable.access = od::Access::ro;
    variable.value.resize(4);
    store_le(std::span(variable.value), std::uint64_t{values[sub]});
    out.variables.push_back(std::move(variable));
  }
  return out;
}

std::uint32_t value_of(od::Address address) {
  return address.index == 0x1000 ? 0x0003'0191U : 100U + address.sub;
}

line::LineConfig config() {
  line::LineConfig out;
  out.name = "bench";
  out.node_id = kOwn;
  for (std::uint8_t id = 1; id <= kDevices; ++id) {
    line::NodeConfig node;
    node.id = id;
    node.name = "node" + std::to_string(id);
    node.device.objects = {object(0x1000, {value_of({0x1000, 0})}),
                           object(0x1018, {4, value_of({0x1018, 1}), value_of({0x1018, 2}),
                                           value_of({0x1018, 3}), value_of({0x1018, 4})})};
    node.serial = value_of({0x1018, 4});
    node.heartbeat = kHeartbeat;
    for (unsigned n = 1; n < kObjects; ++n) {
      node.objects.push_back({{static_cast<std::uint16_t>(0x2000 + n), 0},
                              std::vector<std::byte>(4, std::byte{static_cast<std::uint8_t>(n)})});
    }
    out.nodes.push_back(std::move(node));
  }
  return out;
}

// A device as the manager sees it: a boot-up message, an SDO server, a heartbeat.
class Device {
 public:
  explicit Device(std::uint8_t id) : id_(id) {}

  void receive(const can::Frame& frame) {
    if (frame.id == 0 && frame.length == 2 &&
        (frame.data[1] == std::byte{0} || frame.data[1] == std::byte{id_})) {
      receive_command(frame);
    } else if (frame.id == can::kSdoRequestBase + id_) {
      answer(frame);
    }
  }

  Instant next_wake() const {
    return earlier(heartbeat_, waiting_.empty() ? kNever : waiting_.front().time);
  }

  // Stores the frame that is due in out. Returns false if none is due.
  bool next_frame(can::Frame& out, Instant now) {
    if (!waiting_.empty() && waiting_.front().time <= now) {
      out = waiting_.front();
      waiting_.pop_front();
      return true;
    }
    if (heartbeat_ <= now) {
      heartbeat_ += kHeartbeat;
      const auto state = static_cast<std::uint8_t>(operational_ ? 0x05 : 0x7F);
      out = can::make_frame(can::kErrorControlBase + id_, {state});
      return true;
    }
    return false;
  }

  bool operational() const { return operational_; }

 private:
  void receive_command(const can::Frame& frame) {
    operational_ = frame.data[0] == std::byte{0x01};
    if (frame.data[0] == std::byte{0x82}) {
      heartbeat_ = kNever;
      push(can::make_frame(can::kErrorControlBase + id_, {0x00}), frame.time);
    }
  }

  void answer(const can::Frame& frame) {
    const od::Address address{load_le<std::uint16_t>(frame.data.data() + 1),
                              std::to_integer<std::uint8_t>(frame.data[3])};
    can::Frame out = frame;
    out.id = can::kSdoResponseBase + id_;
    const bool upload = frame.data[0] == std::byte{0x40};
    out.data[0] = std::byte{upload ? kUploadAnswer : kDownloadAnswer};
    store_le(out.data.data() + 4, upload ? value_of(address) : 0U);
    push(out, frame.time);
    if (!upload && address.index == 0x1017) {
      heartbeat_ = frame.time + kResponse;  // a producer sends its first heartbeat at once
    }
  }

  void push(can::Frame frame, Instant heard) {
    frame.time = heard + kResponse;
    waiting_.push_back(frame);
  }

  std::uint8_t id_;
  std::deque<can::Frame> waiting_;  // ordered by the time from which on they may be sent
  Instant heartbeat_ = kNever;
  bool operational_ = false;
};

class Network {
 public:
  Network() : bus_({.bit_rate = 1'000'000}) {
    auto made = line::Line::make(config());
    bench::require(made.ok(), "no line");
    line_ = *std::move(made.value);
    end_ = bus_.attach();
    for (std::uint8_t id = 1; id <= kDevices; ++id) {
      devices_.emplace_back(id);
      ends_.push_back(bus_.attach());
    }
    watch_ = bus_.attach();
  }

  void run() {
    line_->start(now_);
    while (line_->state().nodes_operational < kDevices && !all_started()) {
      step();
      bench::require(now_ - begin_ < std::chrono::minutes(1), "the boot does not end");
    }
  }

  Duration time() const { return now_ - begin_; }
  Duration necessary() const { return necessary_; }
  std::size_t sdo_frames() const { return sdo_frames_; }
  std::uint64_t frames() const { return bus_.frames(); }
  bool all_booted() const {
    for (std::uint8_t id = 1; id <= kDevices; ++id) {
      if (line_->node_state(id).boot != manager::kBooted) {
        return false;
      }
    }
    return true;
  }

 private:
  bool all_started() const { return std::ranges::all_of(devices_, &Device::operational); }

  void step() {
    send();
    Instant wake = earlier(bus_.next_wake(), line_->next_wake());
    for (const Device& device : devices_) {
      wake = earlier(wake, device.next_wake());
    }
    bench::require(wake != kNever, "no frame and no time-out is pending");
    now_ = std::max(now_, wake);
    bus_.advance(now_);
    std::array<can::Frame, 8> frames;
    for (std::size_t i = 0; i < devices_.size(); ++i) {
      const std::size_t count = bus_.take(ends_[i], frames, now_);
      for (const can::Frame& frame : std::span(frames).first(count)) {
        devices_[i].receive(frame);
      }
    }
    const std::size_t count = bus_.take(end_, frames, now_);
    line_->receive(std::span(frames).first(count), now_);
    line_->advance(now_);
    count_frames();
  }

  void send() {
    can::Frame frame;
    while (bus_.room(end_) > 0 && line_->next_frame(frame, now_)) {
      bus_.submit(end_, frame, now_);
    }
    for (std::size_t i = 0; i < devices_.size(); ++i) {
      while (bus_.room(ends_[i]) > 0 && devices_[i].next_frame(frame, now_)) {
        bus_.submit(ends_[i], frame, now_);
      }
    }
  }

  // Counts the necessary frames: boot-up messages, SDO, NMT, and the first heartbeat of each node.
  void count_frames() {
    std::array<can::Frame, 8> frames;
    const std::size_t count = bus_.take(watch_, frames, now_);
    for (const can::Frame& frame : std::span(frames).first(count)) {
      const bool error_control = frame.id > can::kErrorControlBase;
      if (error_control && frame.data[0] != std::byte{0} &&
          std::exchange(heard_[frame.id - can::kErrorControlBase], true)) {
        continue;
      }
      sdo_frames_ += !error_control && frame.id > can::kSdoResponseBase ? 1U : 0U;
      necessary_ += bus_.time_on_wire(frame);
    }
  }

  Instant begin_{std::chrono::seconds(1)};
  Instant now_ = begin_;
  sim::Bus bus_;
  std::unique_ptr<line::Line> line_;
  std::vector<Device> devices_;
  sim::Bus::Endpoint end_ = 0;
  std::vector<sim::Bus::Endpoint> ends_;
  sim::Bus::Endpoint watch_ = 0;
  std::array<bool, 128> heard_{};
  Duration necessary_{};
  std::size_t sdo_frames_ = 0;
};

double milliseconds(Duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

}  // namespace

int main() {
  Network network;
  network.run();
  bench::require(network.all_booted(), "not all nodes were booted");
  bench::require(network.sdo_frames() == kSdoFrames * kDevices,
                 "other transfers than those that are needed");
  const Duration floor = network.necessary() + kResponse;
  bench::print_heading("boot of 126 devices, 20 objects each, 1 Mbit/s, virtual time");
  std::printf("    boot      %10.3f ms, %lu frames\n", milliseconds(network.time()),
              static_cast<unsigned long>(network.frames()));
  std::printf("    necessary %10.3f ms on the wire, and %.1f ms response time\n",
              milliseconds(network.necessary()), milliseconds(kResponse));
  bench::print_target("boot of a line / bus-limited minimum",
                      milliseconds(network.time()) / milliseconds(floor), kLimit, "x");
}
