// SPDX-License-Identifier: Apache-2.0
// A system of networks in virtual time: processes with several lines each, connected by the buses
// of their lines, with devices and foreign SDO clients. Messages between the lines of one process
// take a random time, and keep their order.
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

// Networks are numbered from 0, their network-IDs from 1. At most two processes have a line on a
// network, so that two clients never share an SDO server that supports one client; except for
// redundant processes, where there must be only one transfer at a time.
struct Topology {
  std::size_t networks = 0;
  std::vector<std::vector<std::size_t>> processes;  // the networks of each process
  // Networks of CANopen FD. Each has a line of one process: remote USDO, which would reach a next
  // gateway, is not public.
  std::set<std::size_t> fd{};

  static Topology random(std::size_t networks, std::mt19937_64& chance);
  // About two thirds of the networks with one process, at least one, are of CANopen FD from now on.
  void make_leaves_fd(std::mt19937_64& chance);
  // Process n connects network n and the next one; the last process connects the last network and
  // the first.
  static Topology ring(std::size_t networks);
  // A chain in which two or three processes connect every second pair of networks.
  static Topology redundant(std::size_t networks, std::mt19937_64& chance);
  std::vector<std::size_t> processes_on(std::size_t network) const;
  // The other processes that connect the same networks.
  std::vector<std::size_t> twins_of(std::size_t process) const;
  // The other processes on a network that are on a route with the fewest gateways from there.
  std::vector<std::size_t> next_gateways(std::size_t network, std::size_t to,
                                         std::size_t process) const;
  // All processes on the shortest route.
  std::vector<std::size_t> processes_on_way(std::size_t from, std::size_t to) const;

  // The shortest route from one network to another.
  struct Way {
    std::size_t gateways = 0;  // number of gateways, 0: the same network
    std::size_t first = 0;     // process
    std::size_t last = 0;
  };
  const Way& way(std::size_t from, std::size_t to) const { return ways[from][to]; }
  std::vector<std::vector<Way>> ways;

 private:
  std::vector<std::size_t> distances(std::size_t to) const;
  void find_ways();
};

// The bytes that transfer `id` writes: its number, then bytes that are derived from it.
std::vector<std::byte> routed_pattern(std::uint32_t id, std::size_t size);

inline constexpr std::uint16_t kShortRead = 0x2000;  // sub 1: U32
inline constexpr std::uint16_t kShortWrite =
    0x2001;  // sub 1: U32, receives the number of the transfer
inline constexpr std::uint16_t kLongWrite = 0x2F00;
// + index in kLongSizes: an object of that many bytes
inline constexpr std::uint16_t kLongRead = 0x2F10;
inline constexpr std::size_t kLongSizes[] = {5, 60, 120, 200, 900, 1800};

// A device that checks the values written to it.
class RoutedDevice final : od::Hook {
 public:
  RoutedDevice(std::size_t network, std::uint8_t node, bool fd);

  void start(Instant now);
  void kill() { alive_ = false; }
  bool alive() const { return alive_; }
  node::Node& node() { return *node_; }
  bool has_stored(std::uint32_t id) const { return stored_.contains(id); }
  std::uint64_t wrong() const { return wrong_; }
  std::uint64_t repeated() const { return repeated_; }  // values that were written before
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
  std::uint64_t repeated_ = 0;
};

// A foreign client on a bus that uses one SDO server of a gateway, and sends the network indication
// itself.
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
  // Terminates the client in the middle of a transfer, without an outcome.
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
  // Processes frames to be sent after a call from outside.
  void touch(std::size_t network);

  line::Line& line(std::size_t process, std::size_t network);
  std::vector<line::Line*> lines();
  // The device with node_of(process) on the network: the target for transfers over that process.
  RoutedDevice& device(std::size_t network, std::size_t process);
  static std::uint8_t node_of(std::size_t process) {
    return static_cast<std::uint8_t>(process + 1);
  }
  ForeignClient& client(std::size_t network, std::size_t process);
  // From now on, on every bus, this many of a million frames are lost.
  void lose(std::uint32_t of_a_million);
  // Number of frames on the bus of the network whose identifier matches id under mask.
  std::uint64_t frames(std::size_t network, std::uint32_t id, std::uint32_t mask) const;
  // Sends a frame of that device.
  void send(std::size_t network, std::size_t process, const can::Frame& frame);
  // Switches the device off now, and on again at that time.
  void kill(std::size_t network, std::size_t process, Instant revived);
  // Terminates a process with all its lines, and starts it again at that time.
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
  // By process and network
  std::map<std::pair<std::size_t, std::size_t>, std::unique_ptr<Seat>> seats_;
  std::priority_queue<Letter, std::vector<Letter>, std::greater<>> letters_;
  std::uint64_t letters_sent_ = 0;
  std::map<std::pair<std::size_t, unsigned>, Instant> last_due_;  // by process and both interfaces
  std::multimap<Instant, std::pair<std::size_t, std::size_t>> revivals_;
  std::map<std::size_t, Instant> dead_;  // terminated processes, with the time of their restart
};

}  // namespace linegate::plant
