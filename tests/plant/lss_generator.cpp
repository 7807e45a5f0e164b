// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/lss_generator.h"

#include <array>
#include <iomanip>
#include <random>
#include <sstream>
#include <vector>

namespace linegate::plant {
namespace {

constexpr std::array<const char*, 4> kProfiles{"digital-io", "analog-io", "encoder", "drive"};
constexpr unsigned kFirstUser = 60;  // first name of the devices that use the node-ID of a node
constexpr unsigned kStranger = 90;

// A device of the plant; id: its name in the scenario.
struct Piece {
  unsigned id = 0;
  unsigned node_id = 0;
  bool user = false;  // it uses that node-ID, or is a foreign device
  bool alive = true;
  bool plugged = true;
};

class LssGenerator {
 public:
  explicit LssGenerator(unsigned long seed) : random_(seed), more_(seed) {}

  std::string plant() {
    network();
    for (Piece& piece : pieces_) {
      if (below(piece.user ? 2 : 3) == 0) {
        toggle_power(piece, 0);
      }
    }
    unsigned time = 0;
    const unsigned actions = below(24);
    for (unsigned i = 0; i < actions; ++i) {
      time += 1 + below(below(3) == 0 ? 6000 : 700);
      action(time, i);
      time = unconfirmed(time, i);
    }
    constexpr unsigned kLongestCommand = 12'000;  // ms
    quiet(time + searches_ * kLongestCommand);
    return out_.str();
  }

 private:
  unsigned below(unsigned limit) { return static_cast<unsigned>(random_() % limit); }
  unsigned below_more(unsigned limit) { return static_cast<unsigned>(more_() % limit); }
  Piece& any() { return pieces_[below(static_cast<unsigned>(pieces_.size()))]; }

  void network() {
    constexpr std::array<unsigned, 3> kRates{125'000, 500'000, 1'000'000};
    out_ << "line plant bitrate " << kRates[below(3)] << " lss lss-period " << 1 + below(3) << 's';
    out_ << (below(3) == 0 ? " lss-store" : "") << (below(4) == 0 ? " no-reset" : "") << '\n';
    const unsigned count = 1 + below(5);
    // An observer would decode the PDOs of a device of another profile with the wrong layout, and a
    // command may assign any node-ID to any device.
    const unsigned without_serial = below(4);
    profile_ = kProfiles[(without_serial + 1 + below(3)) % 4];
    by_commands_ = below(2) == 0;
    for (unsigned i = 0; i < count; ++i) {
      node(i, i == 0 && !by_commands_ ? kProfiles[without_serial] : nullptr);
    }
    if (below(3) == 0) {
      constexpr std::array<const char*, 3> kFaults{"", " lss-fault answers-parked",
                                                   " lss-fault takes-no-node-id"};
      out_ << "device " << kStranger << ' ' << profile_ << " unlisted unconfigured has-serial 900"
           << kFaults[below(3)] << '\n';
      pieces_.push_back({.id = kStranger, .node_id = pieces_.front().node_id, .user = true});
    }
  }

  // without_serial: the profile of a device without a serial number, else nullptr.
  void node(unsigned number, const char* without_serial) {
    const unsigned id = 5 + number * 7 + below(7);
    const bool unconfigured = below(5) != 0;
    const char* const kind = without_serial != nullptr ? without_serial : profile_;
    out_ << "device " << id << ' ' << kind << " heartbeat " << (below(2) == 0 ? 0 : 50 + below(200))
         << "ms";
    if (without_serial == nullptr) {
      out_ << " serial " << 100 + id << " has-serial " << 100 + id;
    }
    if (unconfigured) {
      out_ << " unconfigured" << (below(4) == 0 ? " lss-fault boots-at-reset" : "");
    }
    out_ << '\n';
    pieces_.push_back({.id = id, .node_id = id});
    if (unconfigured && below(3) != 0) {
      const unsigned user = kFirstUser + number;
      out_ << "device " << user << ' ' << kind << " unlisted has-serial 500 has-node-id " << id
           << '\n';
      pieces_.push_back({.id = user, .node_id = id, .user = true});
    }
  }

  void at(unsigned time) { out_ << "at " << time << "ms "; }

  void toggle_power(Piece& piece, unsigned time) {
    at(time);
    out_ << "node " << piece.id << (piece.alive ? " dies\n" : " returns\n");
    piece.alive = !piece.alive;
  }

  void toggle_plug(Piece& piece, unsigned time) {
    at(time);
    out_ << "node " << piece.id << (piece.plugged ? " unplugged\n" : " plugged\n");
    piece.plugged = !piece.plugged;
  }

  void action(unsigned time, unsigned number) {
    Piece& piece = any();
    switch (below(12)) {
      case 0:
        at(time);
        out_ << "node " << piece.id << " blinks\n";
        break;
      case 1:
        if (piece.user) {
          toggle_plug(piece, time);
        }
        break;
      case 2:
        command(piece, time);
        break;
      case 3:
        ++searches_;
        at(time);
        out_ << "lss assign" << number << " 11\n";
        break;
      case 4:
        at(time);
        out_ << "sdo read r" << number << ' ' << piece.node_id << " 1000:0\n";
        break;
      case 5:
        at(time);
        out_ << "doubles " << below(20) << '\n';
        break;
      case 6:
        if (by_commands_) {
          by_hand(piece, time, number);
        }
        break;
      default:
        toggle_power(piece, time);
        break;
    }
  }

  void command(const Piece& piece, unsigned time) {
    constexpr std::array<const char*, 5> kCommands{"start", "stop", "pre-operational", "reset-node",
                                                   "reset-communication"};
    at(time);
    out_ << "nmt " << kCommands[below(5)] << ' ';
    below(4) == 0 ? out_ << "all\n" : out_ << piece.node_id << '\n';
  }

  // Assigns the node-ID to all devices in configuration state, if there is one.
  void by_hand(const Piece& piece, unsigned time, unsigned number) {
    ++searches_;
    at(time);
    out_ << "lss found" << number << " 10\n";
    at(time);
    out_ << "lss given" << number << " 2 " << std::hex << std::setfill('0') << std::setw(2)
         << piece.node_id << std::dec << '\n';
    at(time);
    out_ << "lss waiting" << number << " 0 00\n";
  }

  // A service without a response, usually while the bus acknowledges nothing. Returns the end of
  // that time.
  unsigned unconfirmed(unsigned time, unsigned number) {
    constexpr std::array<const char*, 3> kServices{"0 00", "0 01", "4 0500"};
    if (below_more(8) != 0) {
      return time;
    }
    ++searches_;
    const bool silent = below_more(3) != 0;
    if (silent) {
      at(time);
      out_ << "acknowledge off\n";
    }
    at(time);
    out_ << "lss sent" << number << ' ' << kServices[below_more(3)] << '\n';
    if (silent) {
      time += below_more(2) == 0 ? below_more(100) : 700 + below_more(1500);
      at(time);
      out_ << "acknowledge on\n";
    }
    return time;
  }

  // The devices that use the node-ID of a node are removed, the nodes return: each gets its
  // node-ID.
  void quiet(unsigned time) {
    out_ << "at " << time + 10'000 << "ms doubles 0\n";
    for (Piece& piece : pieces_) {
      if (!piece.plugged) {
        toggle_plug(piece, time + 10'000);
      }
      if (piece.alive) {
        toggle_power(piece, time + 10'000);
      }
    }
    for (Piece& piece : pieces_) {
      if (!piece.user) {
        toggle_power(piece, time + 12'000);
      }
    }
    for (const Piece& piece : pieces_) {
      if (!piece.user) {
        at(time + 13'000);
        out_ << "nmt reset-node " << piece.node_id << '\n';
      }
    }
    at(time + 14'000);
    out_ << '\n';
    for (const Piece& piece : pieces_) {
      if (!piece.user) {
        out_ << "expect node " << piece.id << " operational within 90s\n";
      }
    }
  }

  std::mt19937_64 random_;
  // For later additions: apart from them the plant of a seed remains the same
  std::minstd_rand more_;
  std::ostringstream out_;
  std::vector<Piece> pieces_;
  const char* profile_ = nullptr;  // profile of all devices with a serial number
  bool by_commands_ = false;
  unsigned searches_ = 0;  // number of searches by commands
};

}  // namespace

std::string generate_lss(unsigned long seed) {
  return LssGenerator(seed).plant();
}

}  // namespace linegate::plant
