// SPDX-License-Identifier: Apache-2.0
// SDO transfers through one gateway and through three, compared with the same transfer to a device
// on the client's own bus. Buses of 1 Mbit/s in virtual time, one for each network; the two lines
// of a gateway exchange their messages without delay. The client sends the network indication
// before each transfer.
//
// Bus time: the duration of a transfer in virtual time, compared with the sum of the times that its
// frames occupy the wires, since there is nothing else to wait for. CPU: the time of everything in
// this program, and, measured in separate transfers, of the gateways' lines.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bridges/sim/bus.h"
#include "stack/can/cob_id.h"
#include "stack/can/transmit_queue.h"
#include "stack/line/line.h"
#include "stack/od/dictionary.h"
#include "stack/routing/sdo_indication.h"
#include "stack/sdo/protocol.h"
#include "stack/sdo/server.h"

#include "tests/bench/clock.h"
#include "tests/bench/measure.h"
#include "tests/bench/transfer_client.h"
#include "tests/bench/transfer_device.h"

namespace {

using namespace linegate;
using bench::kDomain;
using bench::PatternDomain;
using bench::require;
using bench::TransferKind;

// CPU time of this thread in ns.
std::int64_t cpu_time() {
  return bench::read_clock(CLOCK_THREAD_CPUTIME_ID);
}

constexpr std::uint8_t kNode = 5;
constexpr std::uint8_t kFirstGateway = 100;  // node-ID of gateway 0, on both its networks
constexpr std::size_t kPlaces = 3;           // frames that a controller holds

struct Row {
  TransferKind kind;
  const char* name;
  std::uint32_t bytes;  // of a transfer
  unsigned times;       // in one repetition
};

constexpr Row kRows[] = {{TransferKind::expedited_upload, "expedited upload", 4, 500},
                         {TransferKind::segmented_upload, "segmented upload, 5 kB", 5'000, 2},
                         {TransferKind::segmented_download, "segmented download, 5 kB", 5'000, 2},
                         {TransferKind::block_upload, "block upload, 20 kB", 20'000, 1},
                         {TransferKind::block_download, "block download, 20 kB", 20'000, 1}};

// Gateway n connects network n and the next one. The client is in the first network, the device in
// the last.
class Chain {
 public:
  Chain(std::size_t gateways, std::uint32_t bytes)
      : domain_(bytes), transfer_(request_id(gateways), bytes, domain_) {
    require(dictionary_.set_hook(kDomain.index, &domain_).ok(), "no hook");
    for (std::size_t i = 0; i <= gateways; ++i) {
      buses_.push_back(std::make_unique<sim::Bus>(
          sim::BusOptions{.bit_rate = 1'000'000, .queue_depth = kPlaces}));
    }
    client_end_ = buses_.front()->attach();
    server_end_ = buses_.back()->attach();
    for (std::size_t i = 0; i < gateways; ++i) {
      add_gateway(i);
    }
    settle();
  }

  void transfer(const Row& row) {
    if (!lines_.empty()) {
      indicate();
    }
    transfer_.start(row.kind, now_);
    while (!transfer_.ended()) {
      step();
    }
  }

  Instant now() const { return now_; }
  Duration busy() const {
    Duration out{};
    for (const auto& bus : buses_) {
      out += bus->busy();
    }
    return out;
  }
  std::uint64_t frames() const {
    std::uint64_t out = 0;
    for (const auto& bus : buses_) {
      out += bus->frames();
    }
    return out;
  }
  // Starts or stops measuring the CPU time in the lines, in ns. The result includes reading the
  // clock `readings()` times. A reading costs more than many steps, so it is optional.
  void time_lines(bool wanted) {
    timed_ = wanted && !lines_.empty();
    in_lines_ = 0;
    readings_ = 0;
  }
  std::int64_t in_lines() const { return in_lines_; }
  std::int64_t readings() const { return readings_; }

 private:
  struct Seat {
    std::unique_ptr<line::Line> line;
    std::size_t network = 0;
    sim::Bus::Endpoint end = 0;
  };

  static std::uint8_t gateway_node(std::size_t gateway) {
    return static_cast<std::uint8_t>(kFirstGateway + gateway);
  }
  static std::uint16_t network_id(std::size_t network) {
    return static_cast<std::uint16_t>(network + 1);
  }
  // The server that the client addresses: the device itself, or the first gateway.
  static can::CobId request_id(std::size_t gateways) {
    return can::CobId{can::kSdoRequestBase + (gateways == 0 ? kNode : kFirstGateway)};
  }

  // Interface 1 is towards the client, interface 2 towards the device.
  void add_gateway(std::size_t gateway) {
    routing::Config common;
    common.channels = routing::ChannelRule::per_node;
    common.access = {{.first = 1, .last = 100, .sdo_read = true, .sdo_write = true}};
    common.interfaces = {{1, network_id(gateway), gateway_node(gateway)},
                         {2, network_id(gateway + 1), gateway_node(gateway)}};
    for (std::size_t target = 0; target < buses_.size(); ++target) {
      routing::Route route{.first = network_id(target), .last = network_id(target)};
      const bool back = target <= gateway;
      route.interface = back ? std::uint8_t{1} : std::uint8_t{2};
      const bool here = target == gateway || target == gateway + 1;
      route.gateway = here ? std::uint8_t{0} : gateway_node(back ? gateway - 1 : gateway + 1);
      common.routes.push_back(route);
    }
    for (const std::size_t side : {std::size_t{0}, std::size_t{1}}) {
      line::LineConfig config;
      config.name = "gateway " + std::to_string(gateway) + ", side " + std::to_string(side);
      config.network_id = network_id(gateway + side);
      config.node_id = gateway_node(gateway);
      config.role = side == 0 ? line::Role::device : line::Role::manager;
      config.reset_nodes = false;
      config.routing = common;
      config.routing.interface = static_cast<std::uint8_t>(side + 1);
      auto made = line::Line::make(std::move(config));
      require(made.ok(), "no line");
      Seat& seat = lines_.emplace_back();
      seat.line = *std::move(made.value);
      seat.network = gateway + side;
      seat.end = buses_[seat.network]->attach();
      seat.line->start(now_);
    }
  }

  // Waits until the lines have sent their start-up messages.
  void settle() {
    const Instant until = now_ + std::chrono::milliseconds(100);
    while (next_wake() <= until) {
      step();
    }
    now_ = until;
  }

  void indicate() {
    const std::uint64_t said =
        routing::encode({.network = network_id(buses_.size() - 1), .node = kNode});
    transfer_.queue.push(can::TransmitClass::sdo, request_id(lines_.size()).header(8), said);
    answer_.reset();
    while (!answer_) {
      step();
    }
    require(*answer_ == said, "the network indication was refused");
  }

  Instant next_wake() {
    Instant wake = earlier(transfer_.client.next_wake(), server_.next_wake());
    submit(transfer_.queue, *buses_.front(), client_end_);
    submit(from_server_, *buses_.back(), server_end_);
    for (const auto& bus : buses_) {
      wake = earlier(wake, bus->next_wake());
    }
    for (const Seat& seat : lines_) {
      wake = earlier(wake, seat.line->next_wake());
    }
    return wake;
  }

  void step() {
    const Instant wake = next_wake();
    require(wake != kNever, "no frame and no time-out is pending");
    now_ = std::max(now_, wake);
    for (const auto& bus : buses_) {
      bus->advance(now_);
    }
    run_server();
    const std::int64_t begin = timed_ ? cpu_time() : 0;
    run_lines();
    if (timed_) {
      in_lines_ += cpu_time() - begin;
      ++readings_;
    }
    run_client();
  }

  void run_lines() {
    for (Seat& seat : lines_) {
      std::array<can::Frame, 8> frames;
      const std::size_t count = buses_[seat.network]->take(seat.end, frames, now_);
      if (count > 0) {
        seat.line->receive(std::span(frames).first(count), now_);
      }
      if (count > 0 || seat.line->next_wake() <= now_) {
        seat.line->advance(now_);
      }
    }
    carry();
    for (Seat& seat : lines_) {
      sim::Bus& bus = *buses_[seat.network];
      for (can::Frame frame; bus.room(seat.end) > 0 && seat.line->next_frame(frame, now_);) {
        bus.submit(seat.end, frame, now_);
      }
    }
  }

  // Exchanges messages between the lines of each gateway.
  void carry() {
    routing::Message message;
    for (bool any = true; std::exchange(any, false);) {
      for (std::size_t i = 0; i < lines_.size(); ++i) {
        while (lines_[i].line->pop_message(message)) {
          lines_[i ^ 1U].line->deliver(message, now_);
          any = true;
        }
      }
    }
  }

  void run_server() {
    std::array<can::Frame, 8> frames;
    const std::size_t count = buses_.back()->take(server_end_, frames, now_);
    for (const can::Frame& frame : std::span(frames).first(count)) {
      if (frame.id == can::kSdoRequestBase + kNode) {
        server_.receive(frame, from_server_);
      }
    }
    server_.advance(now_, from_server_);
  }

  void run_client() {
    const std::uint32_t response =
        request_id(lines_.size()).id() - can::kSdoRequestBase + can::kSdoResponseBase;
    std::array<can::Frame, 8> frames;
    const std::size_t count = buses_.front()->take(client_end_, frames, now_);
    for (const can::Frame& frame : std::span(frames).first(count)) {
      if (frame.id == response) {
        answer_ = sdo::word_of(frame);
        transfer_.client.receive(frame, transfer_.queue);
      }
    }
    transfer_.client.advance(now_, transfer_.queue);
  }

  void submit(can::TransmitQueue& queue, sim::Bus& bus, sim::Bus::Endpoint end) const {
    for (can::Frame frame; bus.room(end) > 0 && queue.pop_rest(frame);) {
      bus.submit(end, frame, now_);
    }
  }

  Instant now_{std::chrono::seconds(1)};
  std::vector<std::unique_ptr<sim::Bus>> buses_;
  std::vector<Seat> lines_;  // two for each gateway
  PatternDomain domain_;
  od::Dictionary dictionary_{bench::transfer_device()};
  EventLog events_;
  can::TransmitQueue from_server_{16};
  sdo::Server server_{dictionary_, can::CobId{can::kSdoRequestBase + kNode},
                      can::CobId{can::kSdoResponseBase + kNode}, events_};
  bench::TransferClient transfer_;
  sim::Bus::Endpoint client_end_ = 0;
  sim::Bus::Endpoint server_end_ = 0;
  std::optional<std::uint64_t> answer_;  // the last answer of the server
  bool timed_ = false;
  std::int64_t in_lines_ = 0;
  std::int64_t readings_ = 0;
};

// One path to the device. Virtual times are the same in each repetition.
struct Course {
  Course(const char* what, std::size_t gateways, const Row& row)
      : name(what), chain(gateways, row.bytes), kind(row) {}

  // Returns the CPU time of a transfer in us.
  double once() {
    const Instant before = chain.now();
    const Duration busy = chain.busy();
    const std::uint64_t sent = chain.frames();
    const std::int64_t begin = cpu_time();
    transfers();
    const std::int64_t all = cpu_time() - begin;
    time = std::chrono::duration<double, std::milli>(chain.now() - before).count() / kind.times;
    wire = std::chrono::duration<double, std::milli>(chain.busy() - busy).count() / kind.times;
    frames = static_cast<double>(chain.frames() - sent) / kind.times;
    chain.time_lines(true);
    transfers();
    const double reading = static_cast<double>(chain.readings()) * clock_cost();
    in_lines.push_back((static_cast<double>(chain.in_lines()) - reading) / 1000 / kind.times);
    chain.time_lines(false);
    return static_cast<double>(all) / 1000 / kind.times;
  }
  void transfers() {
    for (unsigned i = 0; i < kind.times; ++i) {
      chain.transfer(kind);
    }
  }
  // The time between two consecutive readings of the clock, in ns.
  static double clock_cost() {
    constexpr int kReadings = 1000;
    const std::int64_t begin = cpu_time();
    for (int i = 1; i < kReadings; ++i) {
      (void)cpu_time();
    }
    return static_cast<double>(cpu_time() - begin) / kReadings;
  }

  const char* name;
  Chain chain;
  const Row& kind;
  std::vector<double> in_lines;  // us per transfer
  double time = 0;               // ms per transfer, virtual time
  double wire = 0;               // ms, sum of all wires
  double frames = 0;
};

void compare(const Row& row) {
  std::vector<std::unique_ptr<Course>> courses;
  courses.push_back(std::make_unique<Course>("direct", 0, row));
  courses.push_back(std::make_unique<Course>("through one gateway", 1, row));
  courses.push_back(std::make_unique<Course>("through three gateways", 3, row));
  std::vector<bench::Contestant> contestants;
  for (const auto& course : courses) {
    contestants.push_back({course->name, [&course] { return course->once(); }, {}});
  }
  bench::interleave(contestants);
  bench::print_heading(std::string("routed SDO: ") + row.name);
  for (std::size_t i = 0; i < courses.size(); ++i) {
    const Course& course = *courses[i];
    std::printf(
        "    %-24s %8.3f ms (%.2f x direct; wires %.3f ms), %7.0f frames, "
        "CPU %8.2f us (%.2f x direct), %8.2f us of it in the gateways\n",
        course.name, course.time, course.time / courses[0]->time, course.wire, course.frames,
        bench::median(contestants[i].figures), bench::median_ratio(contestants[i], contestants[0]),
        bench::median(course.in_lines));
    // Transfers with one frame at a time wait only for the wires.
    if (!bench::uses_blocks(row.kind)) {
      require(course.time <= 1.02 * course.wire,
              "a routed transfer takes longer than the wires are occupied");
    }
  }
  std::fflush(stdout);
}

}  // namespace

int main() {
  for (const Row& row : kRows) {
    compare(row);
  }
}
