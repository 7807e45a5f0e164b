// SPDX-License-Identifier: Apache-2.0
// rtps_flood DOMAIN [--seconds N] [--count N] [--seed N] [--protected] [--only REASON] [--traffic
// FILE] [--save FILE]
//
// Captures the datagrams that the participants of a DDS domain exchange over loopback, mutates
// them, and sends each mutation to one socket of a participant. It sends as fast as they receive:
// it reads the fill level of their queues and waits. A guard of its own, which has seen the same
// traffic, judges each datagram, so that the datagrams that pass a guard can be counted.
//
// --protected: the domain's governance protects RTPS messages. --only: sends only datagrams that a
// guard would drop for that reason. --traffic: a file with further datagrams, in hexadecimal, one
// per line; the GUID prefixes EEh (gateway) and DDh (client) in it are replaced by those of the
// first two participants that are discovered. --save: a file for the last datagrams sent, in the
// same format.
//
// Prints its progress once a minute, and at its end the counts of what was sent. Also ends at the
// end of its standard input.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <fstream>
#include <set>
#include <string>
#include <thread>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/dds/flood/capture.h"
#include "tests/dds/flood/census.h"
#include "tests/dds/flood/mutator.h"
#include "tests/dds/flood/target.h"

namespace linegate::flood {
namespace {

using Clock = std::chrono::steady_clock;
using dds::guard::Reason;

struct Options {
  std::uint32_t domain = 0;
  std::int64_t seconds = 20;
  std::uint64_t count = UINT64_MAX;
  std::uint64_t seed = 1;
  bool protection = false;
  std::string only;
  std::string traffic;
  std::string save;
};

std::int64_t nanoseconds() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch())
      .count();
}

bool input_ended() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  char octet = 0;
  return ::poll(&input, 1, 0) > 0 && ::read(STDIN_FILENO, &octet, 1) <= 0;
}

class Flood {
 public:
  explicit Flood(Options options)
      : options_(std::move(options)),
        capture_(options_.domain),
        mutator_(options_.seed),
        guard_(options_.protection) {}

  int run();

 private:
  static constexpr std::uint64_t kRoom = 64 * 1024;  // octets in a queue from which on it waits
  static constexpr int kBatch = 64;
  // Number of participants that receive: the first ones of the domain.
  static constexpr std::uint16_t kParticipants = 2;

  void listen();
  void read_traffic();
  void rename(Bytes& octets) const;
  bool concerns(const Bytes& datagram, Reason reason) const;
  void send_one();
  void wait_for_room();
  void progress();
  void save() const;

  const Options options_;
  Capture capture_;
  Mutator mutator_;
  Seeds seeds_;
  Census census_;
  dds::guard::Guard guard_;
  std::vector<Bytes> prefixes_;  // in the order in which they were discovered
  std::vector<std::uint16_t> ports_;
  std::deque<Bytes> last_;
  std::uint64_t dropped_ = 0;
  std::uint64_t dropped_before_ = UINT64_MAX;
  std::uint16_t own_ = 0;
  Clock::time_point next_progress_ = Clock::now() + std::chrono::minutes(1);
  const int socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
};

// Reads the datagrams that the participants sent since the last call. The own guard must see the
// same datagrams as the guards of the participants.
void Flood::listen() {
  for (const Seen& seen : capture_.read()) {
    if (seen.from == own_)
      continue;
    const auto verdict = guard_.judge(seen.octets, nanoseconds());
    if (verdict.reason == Reason::none) {
      Seen seed = seen;
      if (!options_.only.empty() && options_.only != to_string(Reason::statistics))
        seed.octets.resize(verdict.size);
      seeds_.add(seed);
    }
    const Bytes prefix(seen.octets.begin() + 8, seen.octets.begin() + 20);
    if (std::find(prefixes_.begin(), prefixes_.end(), prefix) == prefixes_.end() &&
        prefixes_.size() < 64)
      prefixes_.push_back(prefix);
  }
}

void Flood::rename(Bytes& octets) const {
  const auto replace = [&](std::uint8_t octet, const Bytes& prefix) {
    const Bytes captured(12, octet);
    for (auto at = octets.begin();;) {
      at = std::search(at, octets.end(), captured.begin(), captured.end());
      if (at == octets.end())
        return;
      at = std::copy(prefix.begin(), prefix.end(), at);
    }
  };
  replace(0xEE, prefixes_[0]);
  replace(0xDD, prefixes_[1 % prefixes_.size()]);
}

void Flood::read_traffic() {
  std::ifstream in(options_.traffic);
  std::string line;
  while (std::getline(in, line)) {
    Seen seen{ports_[mutator_.below(ports_.size())], 0, {}};
    for (std::size_t i = 0; i + 1 < line.size(); i += 2)
      seen.octets.push_back(
          static_cast<std::uint8_t>(std::strtoul(line.substr(i, 2).c_str(), nullptr, 16)));
    rename(seen.octets);
    seeds_.add(seen);
  }
}

// Without a guard, any statistics submessage that is not the last one ends the process. They are
// therefore sent only with --only statistics.
bool Flood::concerns(const Bytes& datagram, Reason reason) const {
  if (options_.only.empty())
    return true;
  if (options_.only != to_string(reason))
    return false;
  const std::vector<Part> parts = split(datagram);
  return reason == Reason::statistics ||
         std::none_of(parts.begin(), parts.end(), [](const Part& it) { return it.kind == 0x80; });
}

void Flood::send_one() {
  const Seen& seed = seeds_.pick(mutator_);
  const Bytes datagram = mutator_.mutate(seed.octets, seeds_.pick(mutator_).octets);
  const Reason reason = guard_.judge(datagram, nanoseconds()).reason;
  if (!concerns(datagram, reason))
    return;
  // Most mutations of plain traffic end here: one in 16 is enough.
  if (reason == Reason::unprotected && options_.only.empty() && mutator_.below(16) != 0)
    return;
  // Multicast datagrams, too, go to one participant only.
  std::uint16_t port = seed.port;
  if (std::find(ports_.begin(), ports_.end(), port) == ports_.end() || mutator_.below(16) == 0)
    port = ports_[mutator_.below(ports_.size())];
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(port);
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ::sendto(socket_, datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&to),
           sizeof(to));
  census_.add(datagram, reason);
  last_.push_back(datagram);
  if (last_.size() > 5'000)
    last_.pop_front();
}

// A datagram that does not fit the receiver's queue is lost and tests nothing.
void Flood::wait_for_room() {
  for (int i = 0; i < 60'000; ++i) {
    std::uint64_t waiting = 0;
    std::uint64_t dropped = 0;
    const auto now = queues(options_.domain);
    for (const std::uint16_t port : ports_) {
      const auto it = now.find(port);
      if (it == now.end())
        continue;
      waiting = std::max(waiting, it->second.waiting);
      dropped += it->second.dropped;
    }
    if (dropped_before_ != UINT64_MAX && dropped > dropped_before_)
      dropped_ += dropped - dropped_before_;
    dropped_before_ = dropped;
    if (waiting < kRoom)
      return;
    listen();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  std::printf("stuck: a socket is not read for 60 s\n");
}

void Flood::progress() {
  if (Clock::now() < next_progress_)
    return;
  next_progress_ += std::chrono::minutes(1);
  std::printf("sent %llu, without room %llu, kinds of seeds %zu\n",
              static_cast<unsigned long long>(census_.sent()),
              static_cast<unsigned long long>(dropped_), seeds_.kinds());
}

void Flood::save() const {
  if (options_.save.empty())
    return;
  std::ofstream out(options_.save);
  for (const Bytes& datagram : last_) {
    constexpr const char* kDigits = "0123456789abcdef";
    for (const std::uint8_t octet : datagram)
      out << kDigits[octet >> 4U] << kDigits[octet & 15U];
    out << '\n';
  }
}

int Flood::run() {
  if (!capture_.ok())
    return std::printf("rtps_flood: no packet socket on lo (CAP_NET_RAW)\n"), 1;
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof(own);
  ::bind(socket_, reinterpret_cast<const sockaddr*>(&own), sizeof(own));
  ::getsockname(socket_, reinterpret_cast<sockaddr*>(&own), &length);
  own_ = ntohs(own.sin_port);
  std::printf("listening\n");
  // Some of the captured datagrams are the seeds of all mutations.
  const auto begin = Clock::now();
  while (Clock::now() < begin + std::chrono::seconds(5) || seeds_.kinds() < 8 ||
         prefixes_.size() < 2) {
    if (input_ended())
      return 1;
    listen();
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  const auto first = static_cast<std::uint16_t>(7'400 + 250 * options_.domain);
  for (const auto& [port, queue] : queues(options_.domain)) {
    if (port >= first + 10 && port < first + 10 + 2 * kParticipants)
      ports_.push_back(port);
  }
  if (ports_.empty())
    return std::printf("rtps_flood: nobody listens in domain %u\n", options_.domain), 1;
  read_traffic();
  std::printf("%zu kinds of seeds, %zu participants, %zu ports\n", seeds_.kinds(), prefixes_.size(),
              ports_.size());
  const auto end = Clock::now() + std::chrono::seconds(options_.seconds);
  while (Clock::now() < end && census_.sent() < options_.count && !input_ended()) {
    listen();
    for (int i = 0; i < kBatch; ++i)
      send_one();
    wait_for_room();
    progress();
  }
  save();
  std::printf("%s%llu found no room in a socket\n", census_.text().c_str(),
              static_cast<unsigned long long>(dropped_));
  return 0;
}

bool read_options(int argc, char** argv, Options& out) {
  if (argc < 2)
    return false;
  out.domain = static_cast<std::uint32_t>(std::strtoul(argv[1], nullptr, 10));
  for (int i = 2; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--protected") {
      out.protection = true;
      continue;
    }
    if (++i == argc)
      return false;
    const std::string value = argv[i];
    if (name == "--seconds")
      out.seconds = std::stol(value);
    else if (name == "--count")
      out.count = std::stoull(value);
    else if (name == "--seed")
      out.seed = std::stoull(value);
    else if (name == "--only")
      out.only = value;
    else if (name == "--traffic")
      out.traffic = value;
    else if (name == "--save")
      out.save = value;
    else
      return false;
  }
  return true;
}

}  // namespace
}  // namespace linegate::flood

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  linegate::flood::Options options;
  if (!linegate::flood::read_options(argc, argv, options))
    return std::printf("usage: see rtps_flood.cpp\n"), 2;
  return linegate::flood::Flood(options).run();
}
