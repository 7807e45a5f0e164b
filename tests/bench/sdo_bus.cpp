// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/sdo_bus.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <span>
#include <utility>

#include <sys/prctl.h>
#include <sys/socket.h>

#include "gateway/runtime/clock.h"
#include "stack/base/event_log.h"
#include "stack/can/cob_id.h"
#include "stack/can/transmit_queue.h"
#include "stack/od/dictionary.h"
#include "stack/sdo/server.h"

#include "tests/bench/bare_loop.h"
#include "tests/bench/measure.h"
#include "tests/bench/transfer_device.h"

namespace linegate::bench {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kWaiting = 4096;      // frames per end: more than can occur
constexpr std::size_t kPlaces = 8;          // frames that the controller of the devices holds
constexpr std::int64_t kIdle = 50'000'000;  // ns between two checks whether to stop
constexpr auto kLook = 10ms;
constexpr int kLooks = 3000;

}  // namespace

class SdoBus::Device {
 public:
  explicit Device(std::uint8_t node)
      : domain_(kUploadBytes, uploads_in_blocks(node)),
        server_(dictionary_, can::CobId{can::kSdoRequestBase + node},
                can::CobId{can::kSdoResponseBase + node}, events_, {.timeout = kSdoPatience}) {
    require(dictionary_.set_hook(kDomain.index, &domain_).ok(), "no hook");
  }

  void receive(const can::Frame& frame) {
    if (frame.id == server_.request_id().id()) {
      server_.receive(frame, answers_);
    }
  }
  bool next_answer(can::Frame& out, Instant now) {
    server_.advance(now, answers_);
    return answers_.pop_rest(out);
  }

 private:
  PatternDomain domain_;
  od::Dictionary dictionary_{transfer_device()};
  EventLog events_;
  can::TransmitQueue answers_{16};
  sdo::Server server_;
};

SdoBus::SdoBus()
    : bus_({.bit_rate = 1'000'000, .queue_depth = kWaiting}),
      measured_(bus_.attach()),
      devices_(bus_.attach()) {
  const int on = 1;
  require(setsockopt(wire.near(), SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) == 0, "no stamps");
  for (std::uint8_t node = 1; node <= kUploadNodes; ++node) {
    all_.push_back(std::make_unique<Device>(node));
  }
}

SdoBus::~SdoBus() {
  stop();
}

void SdoBus::start() {
  thread_ = std::thread([this] { run(); });
}

void SdoBus::stop() {
  stop_ = true;
  if (thread_.joinable()) {
    thread_.join();
  }
}

SyncTimes SdoBus::record_syncs(std::size_t count) {
  record_ = {};
  record_.stamps.reserve(count);
  record_.counters.reserve(count);
  wanted_.store(count, std::memory_order_release);
  for (int looks = 0; wanted_.load(std::memory_order_acquire) != 0; ++looks) {
    require(looks < kLooks, "no SYNC is received");
    std::this_thread::sleep_for(kLook);
  }
  return std::move(record_);
}

void SdoBus::run() {
  prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
  BareLoop loop(wire.near());
  while (!stop_) {
    const Instant now = gateway::monotonic_now();
    loop.drain([&](const can_frame& frame, std::int64_t stamp) { take(frame, stamp, now); });
    bus_.advance(now);
    deliver(now);
    submit_answers(now);
    const Instant wake = bus_.next_wake();
    loop.wait(wake == kNever ? kIdle : (wake - gateway::monotonic_now()).count());
  }
}

void SdoBus::take(const can_frame& frame, std::int64_t stamp, Instant now) {
  if (frame.can_id == can::kSyncId) {
    receive_sync(frame, stamp, now);
  }
  require(frame.can_id <= CAN_SFF_MASK && frame.len <= can::kMaxClassicData,
          "not a valid CAN frame");
  const can::Frame copy =
      can::make_frame(frame.can_id, std::as_bytes(std::span(frame.data, frame.len)));
  require(bus_.submit(measured_, copy, now), "more frames than the protocol allows");
}

void SdoBus::receive_sync(const can_frame& frame, std::int64_t stamp, Instant now) {
  const std::size_t wanted = wanted_.load(std::memory_order_acquire);
  if (wanted == 0) {
    return;
  }
  if (record_.stamps.empty()) {
    recorded_from_ = now;
    busy_before_ = bus_.busy();
  }
  record_.stamps.push_back(stamp);
  record_.counters.push_back(frame.len == 1 ? frame.data[0] : std::uint8_t{0});
  if (record_.stamps.size() == wanted) {
    record_.bus_use =
        static_cast<double>((bus_.busy() - busy_before_).count()) /
        static_cast<double>(std::max((now - recorded_from_).count(), Duration::rep{1}));
    wanted_.store(0, std::memory_order_release);
  }
}

void SdoBus::deliver(Instant now) {
  std::array<can::Frame, 64> frames;
  for (std::size_t count = 0; (count = bus_.take(devices_, frames, now)) > 0;) {
    for (std::size_t i = 0; i < count; ++i) {
      for (const auto& device : all_) {
        device->receive(frames[i]);
      }
    }
  }
  for (std::size_t count = 0; (count = bus_.take(measured_, frames, now)) > 0;) {
    std::vector<can_frame> out = raw(std::span(frames.data(), count));
    wire.send(out);
  }
}

// The devices send in turn. By arbitration alone the device with the lowest identifier would use
// the whole bus.
void SdoBus::submit_answers(Instant now) {
  can::Frame frame;
  for (std::size_t silent = 0; silent < all_.size() && bus_.room(devices_) > kWaiting - kPlaces;) {
    Device& device = *all_[turn_];
    turn_ = (turn_ + 1) % all_.size();
    silent = device.next_answer(frame, now) ? 0 : silent + 1;
    if (silent == 0) {
      require(bus_.submit(devices_, frame, now), "more frames than the protocol allows");
    }
  }
}

}  // namespace linegate::bench
