// SPDX-License-Identifier: Apache-2.0
// A system of networks in virtual time: processes with several lines each, joined by the buses
// their lines share, with devices and foreign SDO clients on them. Messages between the lines of
// one process take a random time, and keep their order.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <queue>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "stack/line/line.h"
#include "stack/node/node.h"
#include "stack/sdo/client.h"

namespace linegate::plant {

// Networks are numbered from 0, their network-IDs from 1. At most two processes have a line on one,
// so that nobody shares an SDO server that has but one client; but for redundant ones, where there
// is to be but one transfer at a time.
struct Topology {
  std::size_t networks = 0;
  std::vector<std::vector<std::size_t>> processes;  // the networks of each

  static Topology random(std::size_t networks, std::mt19937_64& chance);
  // Network n and the next one are joined by process n; the last with the first.
  static Topology ring(std::size_t networks);
  // A chain in which every other pair of networks is joined by two processes, or three.
  static Topology redundant(std::size_t networks, std::mt19937_64& chance);
  std::vector<std::size_t> processes_on(std::size_t network) const;
  // Processes that join the same networks, this one not among them.
  std::vector<std::size_t> twins_of(std::size_t process) const;
  // Other processes on a network that lie on the ways of least gateways from there.
  std::vector<std::size_t> next_gateways(std::size_t network, std::size_t to,
                                         std::size_t process) const;
  // All processes on the best way.
  std::vector<std::size_t> processes_on_way(std::size_t from, std::size_t to) const;

  // The best way from one network to another.
  struct Way {
    std::size_t gateways = 0;  // on it, 0: it is the same network
    std::size_t first = 0;     // processes
    std::size_t last = 0;
  };
  const Way& way(std::size_t from, std::size_t to) const { return ways[from][to]; }
  std::vector<std::vector<Way>> ways;

 private:
  std::vector<std::size_t> distances(std::size_t to) const;
  void find_ways();
};

// The bytes that transfer `id` writes: its number first, then what follows from it.
std::vector<std::byte> routed_pattern(std::uint32_t id, std::size_t size);

inline constexpr std::uint16_t kShortRead = 0x2000;  // sub 1: U32
inline constexpr std::uint16_t kShortWrite =
    0x2001;  // sub 1: U32, takes the number of the transfer
inline constexpr std::uint16_t kLongWrite = 0x2F00;
inline constexpr std::uint16_t kLongRead = 0x2F10;  // + one of kLongSizes: that many bytes
inline constexpr std::size_t kLongSizes[] = {5, 60, 120, 200, 900, 1800};

// A device that checks what is written to it.
class RoutedDevice final : od::Hook {
 public:
  RoutedDevice(std::size_t network, std::uint8_t node);

  void start(Instant now);
  void kill() { alive_ = false; }
  bool alive() const { return alive_; }
  node::Node& node() { return *node_; }
  bool has_stored(std::uint32_t id) const { return stored_.contains(id); }
  std::uint64_t wrong() const { return wrong_; }
  static std::uint32_t short_value(std::size_t network, std::uint8_t node);
  static std::vector<std::byte> long_value(std::size_t network, std::uint8_t node,
                                           std::size_t size);

 private:
  void written(od::Address address) override;

  EventLog events_;
  std::unique_ptr<node::Node> node_;
  bool alive_ = false;
  std::set<std::uint32_t> stored_;
  std::uint64_t wrong_ = 0;
};

// Somebody on a bus who knows one SDO server of a gateway, and says the indication by hand.
class ForeignClient {
 public:
  ForeignClient(std::uint32_t request_id, std::uint32_t response_id)
      : request_id_(request_id), response_id_(response_id) {}

  struct Job {
    std::uint16_t network = 0;  // network-ID
    std::uint8_t node = 0;
    od::Address address;
    bool write = false;
    std::vector<std::byte> data;
    sdo::Transfer transfer = sdo::Transfer::automatic;
  };

  void start(Job job, Instant now);
  // Dies: says nothing more of what it did.
  void die();
  bool busy() const { return state_ != State::idle; }
  bool take(sdo::Outcome& out);

  void receive(const can::Frame& frame);
  void advance(Instant now);
  Instant next_wake() const;
  bool next_frame(can::Frame& out) { return queue_.pop(out); }

 private:
  enum class State : std::uint8_t { idle, indicating, transfer };

  std::uint32_t request_id_;
  std::uint32_t response_id_;
  State state_ = State::idle;
  Job job_;
  Instant deadline_ = kNever;
  can::TransmitQueue queue_{64};
  std::unique_ptr<sdo::Client> client_;
  std::vector<sdo::Outcome> outcomes_;
};

class RoutedWorld {
 public:
  RoutedWorld(const Topology& topology, std::uint64_t seed);
  ~RoutedWorld();

  Instant now() const { return now_; }
  void run(Instant until);
  // Takes up what a call from outside left to be sent.
  void touch(std::size_t network);

  line::Line& line(std::size_t process, std::size_t network);
  std::vector<line::Line*> lines();
  // For targets that the process reaches on the network.
  RoutedDevice& device(std::size_t network, std::size_t process);
  static std::uint8_t node_of(std::size_t process) {
    return static_cast<std::uint8_t>(process + 1);
  }
  ForeignClient& client(std::size_t network, std::size_t process);
  // From now on so many of a million frames reach nobody, on every bus.
  void lose(std::uint32_t of_a_million);
  // Frames that were on the bus of the network, an identifier and a mask away from it.
  std::uint64_t frames(std::size_t network, std::uint32_t id, std::uint32_t mask) const;
  // A frame of the device there.
  void send(std::size_t network, std::size_t process, const can::Frame& frame);
  // Kills the device now, and revives it at that time.
  void kill(std::size_t network, std::size_t process, Instant revived);
  // A process dies with all its lines, and is started anew at that time.
  void kill_process(std::size_t process, Instant revived);
  bool runs(std::size_t process) const;

 private:
  struct Seat;
  struct Network;
  struct Letter {
    Instant due{};
    std::uint64_t number = 0;
    std::size_t process = 0;
    routing::Message message;
    bool operator>(const Letter& other) const {
      return std::pair(due, number) > std::pair(other.due, other.number);
    }
  };

  void add_process(std::size_t process);
  void make_line(Seat& seat);
  void revive_some();
  routing::Config routing_of(std::size_t process) const;
  void add_devices(std::size_t network);
  void turn(Network& network);
  void turn_line(Network& network, Seat& seat);
  void collect(Seat& seat);
  void deliver(const Letter& letter);
  Seat& seat(std::size_t process, std::size_t network);

  Topology topology_;
  std::mt19937_64 chance_;
  Instant now_{std::chrono::seconds(1)};
  std::vector<std::unique_ptr<Network>> networks_;
  std::map<std::pair<std::size_t, std::size_t>, std::unique_ptr<Seat>> seats_;  // process, network
  std::priority_queue<Letter, std::vector<Letter>, std::greater<>> letters_;
  std::uint64_t letters_sent_ = 0;
  std::map<std::pair<std::size_t, unsigned>, Instant> last_due_;  // by process, both interfaces
  std::multimap<Instant, std::pair<std::size_t, std::size_t>> revivals_;
  std::map<std::size_t, Instant> dead_;  // processes, until when
};

}  // namespace linegate::plant
