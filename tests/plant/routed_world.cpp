#include "tests/plant/routed_world.h"

#include <algorithm>
#include <deque>
#include <numeric>

#include "stack/routing/sdo_indication.h"
#include "stack/sdo/protocol.h"

#include "tests/plant/routed_wire.h"

namespace linegate::plant {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr Duration kSdoTimeout = milliseconds(200);
constexpr Duration kLongestDelay = microseconds(300);  // of a message between two lines
constexpr std::uint8_t kFirstGateway = 100;            // node-ID of process 0, on each network
constexpr std::uint32_t kForeignRequest = 0x680;       // + process
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

// --- topology -----------------------------------------------------------------------------------

// A chain first, so that there is a way over three gateways; then branches, then perhaps a ring.
Topology Topology::random(std::size_t networks, std::mt19937_64& chance) {
  Topology out;
  out.networks = networks;
  std::size_t made = 1;
  while (made < networks) {
    std::vector<std::size_t> open;
    for (std::size_t network = 0; network < made; ++network) {
      if (out.processes_on(network).size() < 2) {
        open.push_back(network);
      }
    }
    const bool chain = out.processes.size() < 4;
    const std::size_t from = chain ? made - 1 : open[chance() % open.size()];
    const std::size_t more = chain ? 1 : 1 + chance() % 3;
    std::vector<std::size_t> joined = {from};
    while (joined.size() <= more && made < networks) {
      joined.push_back(made++);
    }
    out.processes.push_back(joined);
  }
  std::vector<std::size_t> ends;
  for (std::size_t network = 0; network < networks; ++network) {
    if (out.processes_on(network).size() < 2) {
      ends.push_back(network);
    }
  }
  if (ends.size() >= 2 && out.distances(ends.front())[ends.back()] > 5) {
    out.processes.push_back({ends.front(), ends.back()});
  }
  out.find_ways();
  return out;
}

Topology Topology::ring(std::size_t networks) {
  Topology out;
  out.networks = networks;
  for (std::size_t network = 0; network < networks; ++network) {
    out.processes.push_back({network, (network + 1) % networks});
  }
  out.find_ways();
  return out;
}

std::vector<std::size_t> Topology::processes_on(std::size_t network) const {
  std::vector<std::size_t> out;
  for (std::size_t process = 0; process < processes.size(); ++process) {
    if (std::ranges::find(processes[process], network) != processes[process].end()) {
      out.push_back(process);
    }
  }
  return out;
}

std::vector<std::size_t> Topology::distances(std::size_t to) const {
  std::vector<std::size_t> distance(networks, networks + 1);
  std::deque<std::size_t> next = {to};
  distance[to] = 0;
  while (!next.empty()) {
    const std::size_t at = next.front();
    next.pop_front();
    for (const std::size_t process : processes_on(at)) {
      for (const std::size_t beyond : processes[process]) {
        if (distance[beyond] > distance[at] + 1) {
          distance[beyond] = distance[at] + 1;
          next.push_back(beyond);
        }
      }
    }
  }
  return distance;
}

void Topology::find_ways() {
  ways.assign(networks, std::vector<Way>(networks));
  for (std::size_t to = 0; to < networks; ++to) {
    const std::vector<std::size_t> distance = distances(to);
    std::vector<std::size_t> nearest_first(networks);
    std::iota(nearest_first.begin(), nearest_first.end(), std::size_t{0});
    std::ranges::sort(nearest_first, {}, [&](std::size_t from) { return distance[from]; });
    for (const std::size_t from : nearest_first) {
      Way& way = ways[from][to];
      way.gateways = distance[from];
      bool found = false;
      for (const std::size_t process : processes_on(from)) {
        for (const std::size_t beyond : processes[process]) {
          // The first of equal ones, as the routes are made.
          if (distance[beyond] + 1 == distance[from] && !found) {
            found = true;
            way.first = process;
            way.last = beyond == to ? process : ways[beyond][to].last;
          }
        }
      }
    }
  }
}

// --- a device -----------------------------------------------------------------------------------

RoutedDevice::RoutedDevice(std::size_t network, std::uint8_t id) {
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
  node_ = std::make_unique<node::Node>(std::move(dictionary), node::Options{.node_id = id}, events_,
                                       nullptr);
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
  std::ranges::equal(*value, expected) ? (void)stored_.insert(id) : (void)++wrong_;
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
      const sdo::TransferOptions options{.transfer = job_.transfer};
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

void RoutedWorld::add_process(std::size_t process) {
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
    routing::Route route{.first = network_id(target), .last = network_id(target)};
    for (std::size_t i = 0; i < own.size(); ++i) {
      const Topology::Way& way = topology_.way(own[i], target);
      if ((own[i] == target || way.first != process) && way.gateways < best) {
        best = way.gateways;
        route.interface = static_cast<std::uint8_t>(i + 1);
        route.gateway = own[i] == target ? std::uint8_t{0} : gateway_node(way.first);
        route.cost = static_cast<std::uint16_t>(best * 10);
      }
    }
    common.routes.push_back(route);
  }
  for (std::size_t i = 0; i < own.size(); ++i) {
    line::LineConfig config;
    config.name = "p" + std::to_string(process) + "n" + std::to_string(own[i]);
    config.network_id = network_id(own[i]);
    config.node_id = gateway_node(process);
    config.sdo_timeout = kSdoTimeout;
    config.role = topology_.processes_on(own[i]).front() == process ? line::Role::manager
                                                                    : line::Role::device;
    config.reset_nodes = false;
    config.routing = common;
    config.routing.interface = static_cast<std::uint8_t>(i + 1);
    for (const std::size_t other : topology_.processes_on(own[i])) {
      config.routing.gateways.push_back(gateway_node(other));
    }
    auto made = std::make_unique<Seat>();
    Network& network = *networks_[own[i]];
    made->line = *line::Line::make(std::move(config)).value;
    made->process = process;
    made->network = own[i];
    made->end = network.bus.attach();
    made->client_end = network.bus.attach();
    made->device_end = network.bus.attach();
    const auto request = static_cast<std::uint32_t>(kForeignRequest + process);
    const auto response = static_cast<std::uint32_t>(kForeignResponse + process);
    made->client = std::make_unique<ForeignClient>(request, response);
    made->device = std::make_unique<RoutedDevice>(own[i], node_of(process));
    made->device->start(now_);
    made->line->start(now_);
    made->line->dictionary().set({0x1201, 1}, request);
    made->line->dictionary().set({0x1201, 2}, response);
    network.seats.push_back(made.get());
    seats_[{process, own[i]}] = std::move(made);
  }
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
    out.push_back(each->line.get());
  }
  return out;
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
    for (const auto& network : networks_) {
      next = earlier(next, network->wake);
    }
    if (next > until) {
      now_ = until;
      return;
    }
    now_ = std::max(now_, next);
    while (!revivals_.empty() && revivals_.begin()->first <= now_) {
      const auto [network, process] = revivals_.begin()->second;
      revivals_.erase(revivals_.begin());
      seat(process, network).device->start(now_);
      turn(*networks_[network]);
    }
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

void RoutedWorld::deliver(const Letter& letter) {
  const std::size_t network = topology_.processes[letter.process].at(letter.message.to - 1U);
  seat(letter.process, network).line->deliver(letter.message, now_);
  turn(*networks_[network]);
}

void RoutedWorld::turn(Network& network) {
  network.bus.advance(now_);
  network.wake = kNever;
  can::Frame frame;
  for (Seat* const each : network.seats) {
    while (network.bus.take(each->end, frame)) {
      each->line->receive(std::span(&frame, 1), now_);
    }
    each->line->advance(now_);
    while (network.bus.room(each->end) > 0 && each->line->next_frame(frame, now_)) {
      network.bus.submit(each->end, frame, now_);
    }
    collect(*each);
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
    network.wake =
        earlier(network.wake, earlier(each->line->next_wake(), each->client->next_wake()));
  }
  network.wake = earlier(network.wake, network.bus.next_wake());
}

void RoutedWorld::collect(Seat& seat) {
  routing::Message message;
  while (seat.line->take_message(message)) {
    Instant& last = last_due_[{seat.process, message.from * 256U + message.to}];
    const auto delay = Duration(
        static_cast<Duration::rep>(chance_() % static_cast<std::uint64_t>(kLongestDelay.count())));
    last = std::max(last, now_ + delay);
    letters_.push({last, ++letters_sent_, seat.process, message});
  }
}

}  // namespace linegate::plant
