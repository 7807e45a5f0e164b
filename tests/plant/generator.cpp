#include "tests/plant/generator.h"

#include <algorithm>
#include <array>
#include <iomanip>
#include <random>
#include <sstream>
#include <utility>
#include <vector>

#include "tests/plant/scenario.h"

namespace linegate::plant {
namespace {

struct Device {
  unsigned id = 0;
  std::string profile;
  unsigned heartbeat = 0;  // ms, 0 = none
  bool guarded = false;
  bool domain = false;
  bool alive = true;
  bool plugged = true;
  unsigned guard_time = 0;  // ms
  unsigned life_time_factor = 0;
  bool mpdo = false;
  unsigned mpdo_of = 0;  // whose MPDOs it takes, 0 = nobody's
};

// What the RPDOs of the profiles map.
struct Output {
  std::string_view profile;
  const char* record;  // communication record of the RPDO
  unsigned sub;        // of the mapping
  const char* object;
  unsigned bytes;
};
constexpr std::array<Output, 8> kOutputs{{
    {"digital-io", "1400", 1, "6200:1", 1},
    {"digital-io", "1400", 2, "6200:2", 1},
    {"analog-io", "1401", 1, "6411:1", 2},
    {"analog-io", "1401", 2, "6411:2", 2},
    {"drive", "1400", 1, "6040:0", 2},
    {"drive", "1400", 2, "6060:0", 1},
    {"drive", "1401", 1, "607A:0", 4},
    {"drive", "1401", 2, "60FF:0", 4},
}};

class Generator {
 public:
  explicit Generator(unsigned long seed)
      : random_(seed),
        random_of_ours_(seed + 0x0475),
        random_of_more_(seed + 0x4D50),
        random_of_states_(seed + 0x5354),
        random_of_outputs_(seed + 0x0107) {}

  std::string plant() {
    network();
    come_late();
    out_ << "at 3s\n";
    unsigned time = 3000;
    const unsigned actions = below(25);
    for (unsigned i = 0; i < actions; ++i) {
      time += 1 + below(400);
      out_ << "at " << time << "ms ";
      action(i);
      ours_speaks(time);
      command_or_mpdo(time);
      change_itself(time);
      write_outputs(time);
    }
    quiet(time);
    return out_.str();
  }

 private:
  unsigned below(unsigned limit) { return static_cast<unsigned>(random_() % limit); }
  Device& any() { return devices_[below(static_cast<unsigned>(devices_.size()))]; }

  void network() {
    constexpr std::array<unsigned, 4> kRates{125'000, 250'000, 500'000, 1'000'000};
    constexpr std::array<const char*, 4> kProfiles{"digital-io", "analog-io", "encoder", "drive"};
    bit_rate_ = kRates[below(4)];
    out_ << "line plant bitrate " << bit_rate_;
    if (below(3) != 0) {
      out_ << " sync " << 10 + below(90) << "ms";
    }
    if (below(3) == 0) {
      out_ << " buffers " << 2 + below(3);
    }
    out_ << '\n';
    const unsigned count = 1 + below(12);
    for (unsigned i = 0; i < count; ++i) {
      Device device{.id = 1 + i * 9 + below(9), .profile = kProfiles[below(4)]};
      device.guarded = device.profile == "digital-io" && below(2) == 0;  // the others cannot be
      device.heartbeat = device.guarded || below(6) == 0 ? 0 : 50 + below(200);
      device.domain = below(3) == 0;
      out_ << "device " << device.id << ' ' << device.profile;
      if (device.guarded) {
        device.guard_time = 50 + below(100);
        device.life_time_factor = 3 + below(3);
        out_ << " guarding " << device.guard_time << "ms " << device.life_time_factor;
      } else {
        out_ << " heartbeat " << device.heartbeat << "ms";
      }
      if (device.domain) {
        out_ << " domain";
      }
      if (below(4) == 0) {
        out_ << " mandatory";
      }
      give_mpdos(device);
      give_pdos(device);
      out_ << '\n';
      devices_.push_back(std::move(device));
    }
    network_of_ours();
  }

  unsigned below_more(unsigned limit) { return static_cast<unsigned>(random_of_more_() % limit); }

  // Profiles that have no TPDO 4 of their own. Each follows the one before it, if there is one.
  void give_mpdos(Device& device) {
    device.mpdo = (device.profile == "encoder" || device.profile == "drive") && below_more(2) == 0;
    if (!device.mpdo) {
      return;
    }
    device.mpdo_of = std::exchange(last_with_mpdos_, device.id);
    out_ << " mpdo";
    if (device.mpdo_of != 0) {
      out_ << " mpdo-of " << device.mpdo_of;
    }
  }

  // Besides: NMT commands of all kinds, to one node or all, and values by MPDO. With dice of their
  // own, as those of ours.
  void command_or_mpdo(unsigned time) {
    const Device& device = devices_[below_more(static_cast<unsigned>(devices_.size()))];
    switch (below_more(5)) {
      case 0: {
        constexpr const char* kCommands[] = {"start", "stop", "pre-operational", "reset-node",
                                             "reset-communication"};
        out_ << "at " << time << "ms nmt " << kCommands[below_more(5)] << ' ';
        below_more(4) == 0 ? out_ << "all\n" : out_ << device.id << '\n';
        break;
      }
      case 1:
        give_by_mpdo(below_more(3) == 0 ? 0 : device.id, time);
        break;
      case 2:
        foreign_command(below_more(4) == 0 ? 0 : device.id, time);
        break;
      default:
        break;
    }
  }

  unsigned below_states(unsigned limit) {
    return static_cast<unsigned>(random_of_states_() % limit);
  }

  // Besides: what devices do by themselves, the same once more soon after, or a loss and return
  // about when the manager finds it out.
  void change_itself(unsigned time) {
    const Device& device = devices_[below_states(static_cast<unsigned>(devices_.size()))];
    const unsigned soon = time + below_states(device.heartbeat + 20);
    switch (below_states(6)) {
      case 0:
        out_ << "at " << time << "ms node " << device.id << " blinks\n";
        if (below_states(2) == 0) {
          out_ << "at " << soon << "ms node " << device.id << " blinks\n";
        }
        break;
      case 1:
        out_ << "at " << time << "ms node " << device.id << " strays\n";
        break;
      case 2:
        if (device.alive) {
          out_ << "at " << time << "ms node " << device.id << " dies\nat "
               << time + below_states(3 * (device.heartbeat + 100)) << "ms node " << device.id
               << " returns\n";
        }
        break;
      default:
        break;
    }
  }

  // Of a second master. 0 = to all.
  void foreign_command(unsigned node, unsigned time) {
    constexpr const char* kSpecifiers[] = {"01", "02", "80", "81", "82"};
    out_ << "at " << time << "ms frame 0x000 " << kSpecifiers[below_more(5)] << std::hex
         << std::setfill('0') << std::setw(2) << node << std::dec << '\n';
  }

  // To 2F01h of that device, 0 = of all; gives the value.
  unsigned give_by_mpdo(unsigned node, unsigned time) {
    const unsigned value = 0x10 + below_more(0xF0);
    out_ << "at " << time << "ms frame 0x57F " << std::hex << std::uppercase << (0x80 | node)
         << "012F00" << value << "000000\n"
         << std::dec;
    return value;
  }

  unsigned below_outputs(unsigned limit) {
    return static_cast<unsigned>(random_of_outputs_() % limit);
  }

  // Transmission types and inhibit times of the RPDOs, with dice of their own as all about outputs.
  void give_pdos(const Device& device) {
    for (const Output& output : kOutputs) {
      if (output.profile != device.profile || output.sub > 1) {
        continue;
      }
      constexpr std::array<unsigned, 3> kSynchronous{0, 1, 3};
      constexpr unsigned kEventDriven = 255;
      // A slow bus has no room for synchronous PDOs of many devices.
      const bool synchronous = below_outputs(4) == 0 && bit_rate_ == 1'000'000;
      const unsigned type = synchronous ? kSynchronous[below_outputs(3)] : kEventDriven;
      out_ << " expected " << output.record << ":2 " << type << " write " << output.record << ":2 "
           << (synchronous ? "0" : "") << std::hex << std::uppercase << type << std::dec;
      if (!synchronous && below_outputs(4) == 0) {
        out_ << " inhibit " << output.record << ' ' << 5 + below_outputs(100) << "ms";
      }
    }
  }

  // One device of six is switched off when the network starts, and on before the rest begins.
  void come_late() {
    std::vector<std::pair<unsigned, unsigned>> returns;  // time in ms, node
    for (const Device& device : devices_) {
      if (below_outputs(6) == 0) {
        out_ << "at 0s node " << device.id << " dies\n";
        returns.emplace_back(1 + below_outputs(2900), device.id);
      }
    }
    std::ranges::sort(returns);
    for (const auto& [time, node] : returns) {
      out_ << "at " << time << "ms node " << node << " returns\n";
    }
  }

  // To all nodes or one; mostly the values that they have.
  void write_outputs(unsigned time) {
    if (below_outputs(3) != 0) {
      return;
    }
    const bool all = below_outputs(2) == 0;
    const Device& one = devices_[below_outputs(static_cast<unsigned>(devices_.size()))];
    std::ostringstream values;
    for (const Device& device : devices_) {
      if (all || device.id == one.id) {
        give_values(device, values);
      }
    }
    if (!values.str().empty()) {
      out_ << "at " << time << "ms write 0 arming " << ++arming_ << values.str() << '\n';
    }
  }

  void give_values(const Device& device, std::ostream& values) {
    for (const Output& output : kOutputs) {
      if (output.profile == device.profile && below_outputs(12) != 0) {
        values << ' ' << device.id << '.' << output.object << " = ";
        for (unsigned i = 0; i < output.bytes; ++i) {
          values << (below_outputs(2) == 0 ? "11" : "2E");
        }
      }
    }
  }

  unsigned below_ours(unsigned limit) { return static_cast<unsigned>(random_of_ours_() % limit); }

  // Beside them, in one plant of three, devices of a line of our own. They have their own dice: the
  // rest of the plant is as it would be without.
  void network_of_ours() {
    const unsigned count = below_ours(3) == 0 ? 1 + below_ours(4) : 0;
    for (unsigned i = 0; i < count; ++i) {
      constexpr unsigned kFirst = 110;
      Device device{.id = kFirst + i * 4 + below_ours(4), .profile = "digital-io"};
      device.heartbeat = 50 + below_ours(200);
      out_ << "device " << device.id << ' ' << device.profile << " heartbeat " << device.heartbeat
           << "ms ours\n";
      ours_.push_back(std::move(device));
    }
  }

  void ours_speaks(unsigned time) {
    if (ours_.empty() || below_ours(3) == 0) {
      return;
    }
    const Device& device = ours_[below_ours(static_cast<unsigned>(ours_.size()))];
    constexpr const char* kCommands[] = {"reset-node", "reset-communication", "start"};
    out_ << "at " << time << "ms ";
    if (below_ours(4) == 0) {
      out_ << "nmt " << kCommands[below_ours(3)] << ' ' << device.id << '\n';
    } else {
      out_ << "ours output " << device.id << ".6000:1 = " << 10 + below_ours(90) << '\n';
    }
  }

  void action(unsigned number) {
    Device& device = any();
    switch (below(13)) {
      case 0:
        out_ << "node " << device.id << " dies\n";
        device.alive = false;
        break;
      case 1:
      case 2:
        out_ << "node " << device.id << " returns\n";
        device.alive = true;
        break;
      case 3:
        out_ << "node " << device.id << (device.plugged ? " unplugged\n" : " plugged\n");
        device.plugged = !device.plugged;
        break;
      case 4:
        out_ << "sdo read r" << number << ' ' << device.id << " 1018:" << below(6) << '\n';
        break;
      case 5:
        out_ << "sdo read r" << number << ' ' << device.id << " 1008:0 timeout 300ms\n";
        break;
      case 6:
        out_ << "sdo write w" << number << ' ' << device.id << " 1015:0 "
             << (below(2) != 0 ? "0A00" : "0A") << '\n';
        break;
      case 7:
        out_ << "nmt " << (below(2) != 0 ? "reset-node " : "reset-communication ") << device.id
             << '\n';
        break;
      case 8:
        stranger();
        break;
      case 9:
        out_ << "losses " << below(20) << '\n';
        break;
      case 10:
        out_ << "write 0 arming " << 1 + below(3) << " watchdog " << 50 + below(500)
             << "ms reactions " << (below(2) != 0 ? "0x21" : "0x20") << '\n';
        break;
      case 11:
        out_ << "doubles " << below(30) << '\n';
        break;
      case 12:
        transfer(device, number);
        break;
      default:
        break;
    }
  }

  void there_and_back(const Device& device, unsigned time) {
    const unsigned size = 40 + below(400);
    out_ << "at " << time << "ms sdo write there" << device.id << ' ' << device.id
         << " 2F00:0 pattern " << size << "\nexpect reply there" << device.id
         << " ok within 5s\nat " << time << "ms sdo read back" << device.id << ' ' << device.id
         << " 2F00:0\nexpect reply back" << device.id << " ok pattern " << size << " within 5s\n";
  }

  // Of a size that goes in segments or in blocks; a device without the object refuses.
  void transfer(const Device& device, unsigned number) {
    if (below(3) == 0) {
      out_ << "sdo read d" << number << ' ' << device.id << " 2F00:0\n";
    } else {
      constexpr std::array<unsigned, 4> kSizes{4, 120, 400, 900};
      out_ << "sdo write d" << number << ' ' << device.id << " 2F00:0 pattern "
           << 40 + below(kSizes[below(4)]) << '\n';
    }
  }

  // Any identifier but that of NMT commands, any length: malformed for most services that listen
  // there.
  void stranger() {
    out_ << "frame " << 1 + below(0x7FF) << ' ';
    const unsigned length = below(9);
    for (unsigned i = 0; i < length; ++i) {
      constexpr const char* kDigits = "0123456789ABCDEF";
      out_ << kDigits[below(16)] << kDigits[below(16)];
    }
    out_ << '\n';
  }

  // Everything that was taken away comes back or stays dead; then the network is left alone.
  void quiet(unsigned time) {
    out_ << "at " << time + 100 << "ms losses 0\nat " << time + 100 << "ms doubles 0\n";
    for (const Device& device : devices_) {
      if (!device.plugged) {
        out_ << "at " << time + 200 << "ms node " << device.id << " plugged\n";
      }
    }
    for (const Device& device : devices_) {
      out_ << "at " << time + 300 << "ms nmt reset-node " << device.id << '\n';
    }
    for (const Device& device : ours_) {
      out_ << "at " << time + 300 << "ms ours output " << device.id
           << ".6000:1 = " << 10 + below_ours(90) << "\nat " << time + 300 << "ms nmt reset-node "
           << device.id << '\n';
    }
    out_ << "at " << time + 12'000 << "ms\n";
    // On a slower bus with many devices, transfers keep heartbeats waiting for too long.
    for (const Device& device : devices_) {
      if (device.alive && device.domain && bit_rate_ >= 500'000) {
        there_and_back(device, time + 12'000);
      }
    }
    bool may_start = std::ranges::all_of(devices_, &Device::alive);
    for (const Device& device : devices_) {
      if (device.alive) {
        out_ << "expect node " << device.id << " operational within 15s\n";
      } else if (device.heartbeat != 0 || device.guarded) {
        out_ << "expect node " << device.id << " missing within 15s\n";
      }
    }
    for (const Device& device : ours_) {
      out_ << "expect node " << device.id << " operational within 15s\nexpect ours node "
           << device.id << " operational within 1s\nexpect input " << device.id
           << ".6000:1 valid within 1s\n";
    }
    if (may_start) {
      out_ << "expect own operational within 1s\nexpect manager running within 1s\n";
    }
    command_and_return(time + 12'000);
    bring_by_mpdo(time + 12'000);
    lose_guarding(time + 12'000);
  }

  // Nothing disturbs the network any more: what is commanded is done, and shown.
  void command_and_return(unsigned time) {
    std::ostringstream shown;
    std::ostringstream back;
    for (const Device& device : devices_) {
      if (!device.alive) {
        continue;
      }
      const bool stop = below_more(2) == 0;
      out_ << "at " << time << "ms nmt " << (stop ? "stop " : "pre-operational ") << device.id
           << '\n';
      shown << "expect node " << device.id << (stop ? " stopped" : " pre-operational")
            << " within 1s\n";
      back << "at " << time << "ms nmt start " << device.id << "\nexpect node " << device.id
           << " operational within 1s\n";
    }
    out_ << shown.str() << back.str();
  }

  // From each to the one that follows it, and so on.
  void bring_by_mpdo(unsigned time) {
    for (const Device& device : devices_) {
      if (!device.mpdo || !device.alive) {
        continue;
      }
      const unsigned value = give_by_mpdo(device.id, time);
      out_ << "expect device " << device.id << " 2F01:0 = " << value << " within 100ms\n";
      for (const Device& follower : devices_) {
        if (follower.mpdo_of == device.id && follower.alive) {
          out_ << "expect device " << follower.id << " 2F02:0 = " << value << " within 100ms\n";
        }
      }
    }
  }

  // Whoever is asked no more says so when it can, and the master has noticed, too.
  void lose_guarding(unsigned time) {
    for (const Device& device : devices_) {
      if (!device.guarded || !device.alive) {
        continue;
      }
      const unsigned life_time = device.guard_time * device.life_time_factor;
      const unsigned within = life_time + 2 * device.guard_time;
      out_ << "at " << time << "ms node " << device.id
           << " unplugged\nexpect heartbeat-lost node=" << device.id
           << " code=1 value=" << life_time << " within " << within << "ms\nexpect device "
           << device.id << " 1001:0 = 17 within " << within << "ms\nat " << time << "ms node "
           << device.id << " plugged\nexpect emcy node=" << device.id
           << " code=0x8130 within 500ms\nexpect node " << device.id << " operational within 15s\n";
    }
  }

  std::mt19937_64 random_;
  std::mt19937_64 random_of_ours_;
  std::mt19937_64 random_of_more_;
  std::mt19937_64 random_of_states_;
  std::mt19937_64 random_of_outputs_;
  unsigned arming_ = 100;  // of the last write
  std::ostringstream out_;
  std::vector<Device> devices_;
  std::vector<Device> ours_;
  unsigned bit_rate_ = 0;
  unsigned last_with_mpdos_ = 0;
};

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> out;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    out.push_back(line);
  }
  return out;
}

std::string join(const std::vector<std::string>& lines) {
  std::string out;
  for (const std::string& line : lines) {
    out += line + '\n';
  }
  return out;
}

// The same but for numbers: fewer statements have other counts and times.
bool similar(std::string a, std::string b) {
  const auto is_digit = [](unsigned char c) { return c >= '0' && c <= '9'; };
  std::erase_if(a, is_digit);
  std::erase_if(b, is_digit);
  return !a.empty() && a == b;
}

}  // namespace

std::string generate(unsigned long seed) {
  return Generator(seed).plant();
}

std::string shrink(const std::string& text, unsigned long seed) {
  // A statement may only go if the rest still fails for the same reason, not because something it
  // needs is gone.
  const auto reason = [seed](const std::string& scenario) {
    const std::string failure = run_scenario("shrunken", scenario, seed).failure;
    const std::size_t place = failure.find(": ");
    return place == std::string::npos ? failure : failure.substr(place + 2);
  };
  const std::string wanted = reason(text);
  const auto fails = [&](const std::vector<std::string>& lines) {
    return similar(reason(join(lines)), wanted);
  };
  std::vector<std::string> lines = lines_of(text);
  bool shorter = true;
  while (shorter) {
    shorter = false;
    for (std::size_t i = lines.size(); i-- > 0;) {
      std::vector<std::string> fewer = lines;
      fewer.erase(fewer.begin() + static_cast<long>(i));
      if (fails(fewer)) {
        lines = std::move(fewer);
        shorter = true;
      }
    }
  }
  return join(lines);
}

}  // namespace linegate::plant
