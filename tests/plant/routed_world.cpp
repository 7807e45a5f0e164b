// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/routed_world.h"

#include <algorithm>

#include "stack/routing/sdo_indication.h"
#include "stack/sdo/protocol.h"

#include "tests/plant/routed_wire.h"

namespace linegate::plant {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr Duration kSdoTimeout = milliseconds(200);
// Longest delay of a message between two lines
constexpr Duration kLongestDelay = microseconds(300);
constexpr std::uint8_t kFirstGateway = 100;       // node-ID of process 0, on each network
constexpr std::uint32_t kForeignRequest = 0x680;  // + process
constexpr std::uint32_t kForeignResponse = 0x6B0;

std::uint8_t gateway_node(std::size_t process) {
  return static_cast<std::uint8_t>(kFirstGateway + process);
}
std::uint16_t network_id(std::size_t network) {
  return static_cast<std::uint16_t>(network + 1);
}

od::ObjectDescription object(std::uint16_t index, std::uint8_t sub, od::DataType type,
                             od::Access access, std::vector<std::byte> value) {
  od::ObjectDescription out{.index = index, .name = "object"};
  out.type = sub == 0 ? od::ObjectType::variable : od::ObjectType::record;
  if (sub != 0) {
    od::VariableDescription count;
    count.type = od::DataType::unsigned8;
    count.value = {std::byte{sub}};
    out.variables.push_back(std::move(count));
  }
  od::VariableDescription variable;
  variable.sub = sub;
  variable.type = type;
  variable.access = access;
  variable.value = std::move(value);
  out.variables.push_back(std::move(variable));
  return out;
}

std::vector<std::byte> u32(std::uint32_t value) {
  std::vector<std::byte> out(4);
  store_le(out.data(), value);
  return out;
}

}  // namespace

std::vector<std::byte> routed_pattern(std::uint32_t id, std::size_t size) {
  std::vector<std::byte> out(size);
  std::uint32_t state = id * 2654435761U + 1;
  for (std::size_t i = 0; i < size; ++i) {
    state = state * 1664525U + 1013904223U;
    out[i] = i < 4 ? static_cast<std::byte>(id >> (8 * i)) : static_cast<std::byte>(state >> 24U);
  }
  return out;
}

// --- a device -----------------------------------------------------------------------------------

RoutedDevice::RoutedDevice(std::size_t network, std::uint8_t id, bool fd) {
  od::Dictionary dictionary;
  const auto add = [&](const od::ObjectDescription& description) {
    (void)dictionary.add(description).ok();
  };
  add(object(kShortRead, 1, od::DataType::unsigned32, od::Access::ro,
             u32(short_value(network, id))));
  add(object(kShortWrite, 1, od::DataType::unsigned32, od::Access::rw, u32(0)));
  add(object(kLongWrite, 0, od::DataType::domain, od::Access::rw, {}));
  for (std::size_t i = 0; i < std::size(kLongSizes); ++i) {
    add(object(static_cast<std::uint16_t>(kLongRead + i), 0, od::DataType::domain, od::Access::ro,
               long_value(network, id, kLongSizes[i])));
  }
  node_ = std::make_unique<node::Node>(std::move(dictionary),
                                       node::Options{.node_id = id, .fd = fd}, events_, nullptr);
  node_->dictionary().add_hook(kShortWrite, *this).ok();
  node_->dictionary().add_hook(kLongWrite, *this).ok();
}

std::uint32_t RoutedDevice::short_value(std::size_t network, std::uint8_t node) {
  return static_cast<std::uint32_t>((network + 1) * 0x0101'0000U + node * 0x0101U);
}

std::vector<std::byte> RoutedDevice::long_value(std::size_t network, std::uint8_t node,
                                                std::size_t size) {
  return routed_pattern(short_value(network, node) + static_cast<std::uint32_t>(size), size);
}

void RoutedDevice::start(Instant now) {
  alive_ = true;
  node_->start(now);
}

void RoutedDevice::written(od::Address address) {
  const auto value = node_->dictionary().read(address);
  if (!value.ok() || value->size() < 4) {
    ++wrong_;
    return;
  }
  const auto id = load_le<std::uint32_t>(value->data());
  const std::vector<std::byte> expected = routed_pattern(id, value->size());
  if (!std::ranges::equal(*value, expected)) {
    ++wrong_;
  } else if (!stored_.insert(id).second) {
    ++repeated_;
  }
}

// --- a foreign client ---------------------------------------------------------------------------

void ForeignClient::start(Job job, Instant now) {
  job_ = std::move(job);
  state_ = State::indicating;
  deadline_ = now + 20 * kSdoTimeout;
  outcomes_.clear();
  client_ = std::make_unique<sdo::Client>(can::CobId{request_id_});
  const routing::Indication indication{.network = job_.network, .node = job_.node};
  queue_.push(can::TransmitClass::sdo, can::CobId{request_id_}.header(8),
              routing::encode(indication));
}

void ForeignClient::die() {
  state_ = State::idle;
  deadline_ = kNever;
  queue_.clear();
  client_.reset();
  outcomes_.clear();
}

bool ForeignClient::take(sdo::Outcome& out) {
  if (outcomes_.empty()) {
    return false;
  }
  out = std::move(outcomes_.front());
  outcomes_.clear();
  state_ = State::idle;
  deadline_ = kNever;
  return true;
}

void ForeignClient::receive(const can::Frame& frame) {
  if (frame.id != response_id_ || frame.length != sdo::kFrameSize) {
    return;
  }
  const std::uint64_t word = sdo::word_of(frame);
  if (state_ == State::indicating) {
    const auto command = static_cast<std::uint8_t>(word);
    if (command == 0x80 && sdo::multiplexer(word) == od::Address{}) {
      outcomes_.push_back({.abort = static_cast<AbortCode>(sdo::long_word(word)), .data = {}});
    } else if (word == routing::encode({.network = job_.network, .node = job_.node})) {
      state_ = State::transfer;
      deadline_ = kNever;
      const Duration timeout = 10 * kSdoTimeout;
      // An abort ends the connection: a read that began in segments cannot change to blocks.
      const sdo::TransferOptions options{.transfer = job_.transfer,
                                         .block_from = job_.write ? 128U : sdo::kNoBlocks};
      if (job_.write) {
        client_->write(job_.address, job_.data, timeout, frame.time, queue_, options);
      } else {
        client_->read(job_.address, timeout, frame.time, queue_, options);
      }
    }
  } else if (state_ == State::transfer) {
    (void)client_->receive(frame, queue_);
  }
  advance(frame.time);
}

void ForeignClient::advance(Instant now) {
  if (state_ == State::indicating && now >= deadline_) {
    deadline_ = kNever;
    outcomes_.push_back({.abort = AbortCode::timeout, .data = {}});
  }
  if (state_ == State::transfer) {
    client_->advance(now, queue_);
    if (auto outcome = client_->take()) {
      outcomes_.push_back(*std::move(outcome));
    }
  }
}

Instant ForeignClient::next_wake() const {
  return state_ == State::transfer ? client_->next_wake() : deadline_;
}

// --- the world ----------------------------------------------------------------------------------

struct RoutedWorld::Seat {
  std::unique_ptr<line::Line> line;
  std::size_t process = 0;
  std::size_t network = 0;
  std::size_t end = 0;
  std::unique_ptr<ForeignClient> client;
  std::size_t client_end = 0;
  std::unique_ptr<RoutedDevice> device;
  std::size_t device_end = 0;
};

struct RoutedWorld::Network {
  Wire bus;
  std::vector<Seat*> seats;
  Instant wake = kNever;
};

RoutedWorld::RoutedWorld(const Topology& topology, std::uint64_t seed)
    : topology_(topology), chance_(seed) {
  for (std::size_t i = 0; i < topology.networks; ++i) {
    networks_.push_back(std::make_unique<Network>());
  }
  for (std::size_t process = 0; process < topology.processes.size(); ++process) {
    add_process(process);
  }
  for (const auto& network : networks_) {
    turn(*network);
  }
}

RoutedWorld::~RoutedWorld() = default;

// First the shortest route to each network, then the routes of equal length over other gateways on
// that network.
routing::Config RoutedWorld::routing_of(std::size_t process) const {
  const std::vector<std::size_t>& own = topology_.processes[process];
  routing::Config common;
  common.channels = routing::ChannelRule::per_node;
  common.channel_wait = kSdoTimeout;
  common.gateway_timeout = 4 * kSdoTimeout;
  common.access = {{.first = 1, .last = 100, .sdo_read = true, .sdo_write = true, .emcy = true}};
  common.emcy_networks.fill(0xFFFF'FFFF);
  common.additional_servers = 1;
  for (std::size_t i = 0; i < own.size(); ++i) {
    common.interfaces.push_back(
        {static_cast<std::uint8_t>(i + 1), network_id(own[i]), gateway_node(process)});
  }
  for (std::size_t target = 0; target < topology_.networks; ++target) {
    std::size_t best = topology_.networks + 1;
    std::size_t over = 0;  // index in `own`
    for (std::size_t i = 0; i < own.size(); ++i) {
      const Topology::Way& way = topology_.way(own[i], target);
      if ((own[i] == target || way.first != process) && way.gateways < best) {
        best = way.gateways;
        over = i;
      }
    }
    routing::Route route{.first = network_id(target),
                         .last = network_id(target),
                         .interface = static_cast<std::uint8_t>(over + 1),
                         .cost = static_cast<std::uint16_t>(best * 10)};
    if (own[over] == target) {
      common.routes.push_back(route);
      continue;
    }
    for (const std::size_t next : topology_.next_gateways(own[over], target, process)) {
      route.gateway = gateway_node(next);
      common.routes.push_back(route);
      ++route.cost;
    }
  }
  return common;
}

void RoutedWorld::add_process(std::size_t process) {
  for (const std::size_t own : topology_.processes[process]) {
    auto made = std::make_unique<Seat>();
    Network& network = *networks_[own];
    made->process = process;
    made->network = own;
    made->end = network.bus.attach();
    made->client_end = network.bus.attach();
    made->device_end = network.bus.attach();
    made->client =
        std::make_unique<ForeignClient>(static_cast<std::uint32_t>(kForeignRequest + process),
                                        static_cast<std::uint32_t>(kForeignResponse + process));
    made->device =
        std::make_unique<RoutedDevice>(own, node_of(process), topology_.fd.contains(own));
    made->device->start(now_);
    make_line(*made);
    network.seats.push_back(made.get());
    seats_[{process, own}] = std::move(made);
  }
}

void RoutedWorld::make_line(Seat& seat) {
  const std::size_t process = seat.process;
  const std::vector<std::size_t>& own = topology_.processes[process];
  line::LineConfig config;
  config.name = "p" + std::to_string(process) + "n" + std::to_string(seat.network);
  config.network_id = network_id(seat.network);
  config.node_id = gateway_node(process);
  config.sdo_timeout = kSdoTimeout;
  config.role = topology_.processes_on(seat.network).front() == process ? line::Role::manager
                                                                        : line::Role::device;
  config.canopen_fd = topology_.fd.contains(seat.network);
  config.reset_nodes = false;
  config.routing = routing_of(process);
  config.routing.interface =
      static_cast<std::uint8_t>(std::ranges::find(own, seat.network) - own.begin() + 1);
  for (const std::size_t other : topology_.processes_on(seat.network)) {
    config.routing.gateways.push_back(gateway_node(other));
  }
  seat.line = *line::Line::make(config).value;
  seat.line->start(now_);
  if (config.canopen_fd) {
    return;  // it has no SDO servers
  }
  seat.line->dictionary().set({0x1201, 1}, static_cast<std::uint32_t>(kForeignRequest + process));
  seat.line->dictionary().set({0x1201, 2}, static_cast<std::uint32_t>(kForeignResponse + process));
}

RoutedWorld::Seat& RoutedWorld::seat(std::size_t process, std::size_t network) {
  return *seats_.at({process, network});
}
line::Line& RoutedWorld::line(std::size_t process, std::size_t network) {
  return *seat(process, network).line;
}
RoutedDevice& RoutedWorld::device(std::size_t network, std::size_t process) {
  return *seat(process, network).device;
}
ForeignClient& RoutedWorld::client(std::size_t network, std::size_t process) {
  return *seat(process, network).client;
}

std::vector<line::Line*> RoutedWorld::lines() {
  std::vector<line::Line*> out;
  for (const auto& [place, each] : seats_) {
    if (each->line != nullptr) {
      out.push_back(each->line.get());
    }
  }
  return out;
}

void RoutedWorld::kill_process(std::size_t process, Instant revived) {
  if (!runs(process)) {
    return;
  }
  for (const std::size_t network : topology_.processes[process]) {
    seat(process, network).line.reset();
  }
  dead_[process] = revived;
}

bool RoutedWorld::runs(std::size_t process) const {
  return !dead_.contains(process);
}

void RoutedWorld::kill(std::size_t network, std::size_t process, Instant revived) {
  RoutedDevice& device = *seat(process, network).device;
  if (device.alive()) {
    device.kill();
    revivals_.emplace(revived, std::pair(network, process));
  }
}

void RoutedWorld::lose(std::uint32_t of_a_million) {
  for (const auto& network : networks_) {
    network->bus.lose(of_a_million, chance_());
  }
}

std::uint64_t RoutedWorld::frames(std::size_t network, std::uint32_t id, std::uint32_t mask) const {
  return networks_[network]->bus.carried(id, mask);
}

void RoutedWorld::send(std::size_t network, std::size_t process, const can::Frame& frame) {
  networks_[network]->bus.submit(seat(process, network).device_end, frame, now_);
  turn(*networks_[network]);
}

void RoutedWorld::touch(std::size_t network) {
  turn(*networks_[network]);
}

void RoutedWorld::run(Instant until) {
  for (;;) {
    Instant next = letters_.empty() ? kNever : letters_.top().due;
    next = earlier(next, revivals_.empty() ? kNever : revivals_.begin()->first);
    for (const auto& [process, revived] : dead_) {
      next = earlier(next, revived);
    }
    for (const auto& network : networks_) {
      next = earlier(next, network->wake);
    }
    if (next > until) {
      now_ = until;
      return;
    }
    now_ = std::max(now_, next);
    revive_some();
    while (!letters_.empty() && letters_.top().due <= now_) {
      const Letter letter = letters_.top();
      letters_.pop();
      deliver(letter);
    }
    for (const auto& network : networks_) {
      if (network->wake <= now_) {
        turn(*network);
      }
    }
  }
}

void RoutedWorld::revive_some() {
  while (!revivals_.empty() && revivals_.begin()->first <= now_) {
    const auto [network, process] = revivals_.begin()->second;
    revivals_.erase(revivals_.begin());
    seat(process, network).device->start(now_);
    turn(*networks_[network]);
  }
  std::vector<std::size_t> revived;
  std::erase_if(dead_, [&](const auto& each) {
    if (each.second <= now_) {
      revived.push_back(each.first);
    }
    return each.second <= now_;
  });
  for (const std::size_t process : revived) {
    for (const std::size_t network : topology_.processes[process]) {
      make_line(seat(process, network));
      turn(*networks_[network]);
    }
  }
}

// A message to a terminated process is lost.
void RoutedWorld::deliver(const Letter& letter) {
  const std::size_t network = topology_.processes[letter.process].at(letter.message.to - 1U);
  if (line::Line* const line = seat(letter.process, network).line.get()) {
    line->deliver(letter.message, now_);
    turn(*networks_[network]);
  }
}

void RoutedWorld::turn(Network& network) {
  network.bus.advance(now_);
  network.wake = kNever;
  can::Frame frame;
  for (Seat* const each : network.seats) {
    turn_line(network, *each);
    RoutedDevice& device = *each->device;
    while (network.bus.take(each->device_end, frame)) {
      if (device.alive()) {
        device.node().receive(std::span(&frame, 1));
      }
    }
    if (device.alive()) {
      device.node().advance(now_);
      while (network.bus.room(each->device_end) > 0 && device.node().next_frame(frame, now_)) {
        network.bus.submit(each->device_end, frame, now_);
      }
      network.wake = earlier(network.wake, device.node().next_wake());
    }
    while (network.bus.take(each->client_end, frame)) {
      each->client->receive(frame);
    }
    each->client->advance(now_);
    while (network.bus.room(each->client_end) > 0 && each->client->next_frame(frame)) {
      network.bus.submit(each->client_end, frame, now_);
    }
    network.wake = earlier(network.wake, each->client->next_wake());
  }
  network.wake = earlier(network.wake, network.bus.next_wake());
}

void RoutedWorld::turn_line(Network& network, Seat& seat) {
  can::Frame frame;
  while (network.bus.take(seat.end, frame)) {
    if (seat.line != nullptr) {
      seat.line->receive(std::span(&frame, 1), now_);
    }
  }
  if (seat.line == nullptr) {
    return;
  }
  seat.line->advance(now_);
  while (network.bus.room(seat.end) > 0 && seat.line->next_frame(frame, now_)) {
    network.bus.submit(seat.end, frame, now_);
  }
  collect(seat);
  network.wake = earlier(network.wake, seat.line->next_wake());
}

void RoutedWorld::collect(Seat& seat) {
  routing::Message message;
  while (seat.line->pop_message(message)) {
    Instant& last = last_due_[{seat.process, message.from * 256U + message.to}];
    const auto delay = Duration(
        static_cast<Duration::rep>(chance_() % static_cast<std::uint64_t>(kLongestDelay.count())));
    last = std::max(last, now_ + delay);
    letters_.push({last, ++letters_sent_, seat.process, message});
  }
}

}  // namespace linegate::plant
