// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/generator.h"

#include <algorithm>
#include <array>
#include <iomanip>
#include <random>
#include <sstream>
#include <utility>
#include <vector>

#include "tests/plant/generator_devices.h"
#include "tests/plant/generator_fd.h"
#include "tests/plant/generator_ours.h"
#include "tests/plant/generator_outputs.h"
#include "tests/plant/generator_requests.h"
#include "tests/plant/generator_services.h"

namespace linegate::plant {
namespace {

// COB-IDs of the own node, 127, on which another station sends only by mistake.
constexpr unsigned kOwnEmergency = 0x0FF;
constexpr unsigned kOwnHeartbeat = 0x77F;

enum class Role : std::uint8_t { master, slave_by_1f80, device };  // of the own node

class Generator {
 public:
  explicit Generator(unsigned long seed)
      : random_(seed),
        random_of_ours_(seed + 0x0475),
        random_of_more_(seed + 0x4D50),
        random_of_states_(seed + 0x5354),
        random_of_line_(seed + 0x4C49),
        random_of_outputs_(seed + 0x0107),
        random_of_mappings_(seed + 0x5457),
        random_of_own_(seed + 0x4F57),
        services_(seed),
        commands_of_ours_(seed),
        requests_(seed),
        fd_(seed >= kFirstFdSeed && seed < kFirstFdSeed + kFdSeeds),
        foreign_clients_(seed) {
    if (fd_) {
      services_.be_fd();
      requests_.be_fd();
    }
  }

  std::string plant() {
    network();
    out_ << "at 0s\n";
    unsigned time = kBooted;
    const unsigned actions = below(25);
    for (unsigned i = 0; i < actions; ++i) {
      time += 1 + below(400);
      action(i, time);
      ours_speaks(time);
      command_or_mpdo(time);
      change_itself(time);
      change_line(i, time);
      write_outputs(time);
      write_own_outputs(time);
      add(services_.draw(devices_, time));
      add(requests_.draw(devices_, time));
      add(commands_of_ours_.draw(ours_, time));
      if (fd_) {
        add(foreign_clients_.draw(devices_, time));
      }
    }
    come_late(time);
    quiet(write_down() + pauses_);
    return out_.str();
  }

 private:
  static constexpr unsigned kBooted = 3000;                                     // ms
  static constexpr const char* kSpecifiers[] = {"01", "02", "80", "81", "82"};  // NMT commands
  static constexpr unsigned kRestart = 10;  // ms, the shortest pause

  unsigned below(unsigned limit) { return static_cast<unsigned>(random_() % limit); }
  unsigned below_more(unsigned limit) { return static_cast<unsigned>(random_of_more_() % limit); }
  unsigned below_ours(unsigned limit) { return static_cast<unsigned>(random_of_ours_() % limit); }
  unsigned below_states(unsigned limit) {
    return static_cast<unsigned>(random_of_states_() % limit);
  }
  unsigned below_line(unsigned limit) { return static_cast<unsigned>(random_of_line_() % limit); }
  unsigned below_outputs(unsigned limit) {
    return static_cast<unsigned>(random_of_outputs_() % limit);
  }
  unsigned below_own(unsigned limit) { return static_cast<unsigned>(random_of_own_() % limit); }
  Device& any() { return devices_[below(static_cast<unsigned>(devices_.size()))]; }

  // An action at that time; the actions are written in the order of their times.
  std::ostringstream& at(unsigned time) {
    acts_.emplace_back(time, std::ostringstream());
    return acts_.back().second;
  }

  void add(const std::vector<std::pair<unsigned, std::string>>& actions) {
    for (const auto& [time, what] : actions) {
      at(time) << what;
    }
  }

  // Writes the actions and returns the last time.
  unsigned write_down() {
    std::ranges::stable_sort(acts_, {}, &std::pair<unsigned, std::ostringstream>::first);
    for (const auto& [time, text] : acts_) {
      out_ << "at " << time << "ms " << text.str() << '\n';
    }
    return acts_.empty() ? kBooted : std::max(kBooted, acts_.back().first);
  }

  void network() {
    constexpr std::array<unsigned, 4> kRates{125'000, 250'000, 500'000, 1'000'000};
    bit_rate_ = kRates[below(4)];
    out_ << "line plant bitrate " << bit_rate_;
    if (fd_) {
      out_ << foreign_clients_.line_words();
    }
    if (below(3) != 0) {
      out_ << " sync " << 10 + below(90) << "ms";
    }
    if (below(3) == 0) {
      out_ << " buffers " << 2 + below(3);
    }
    roles();
    has_own_outputs_ = below_own(3) == 0 && !fd_;  // one of them is sent by MPDO
    out_ << services_.line_words() << (has_own_outputs_ ? " own-outputs" : "") << '\n';
    const unsigned count = 1 + below(12);
    for (unsigned i = 0; i < count; ++i) {
      devices_.push_back(draw_device(random_, 1 + i * 9 + below(9)));
      give_mpdos(devices_.back());
      draw_manners(random_of_states_, devices_.back());
      if (fd_) {
        be_fd(foreign_clients_.random(), devices_.back());
      }
      devices_.back().twice = devices_.back().profile == "drive" && random_of_mappings_() % 2 == 0;
      if (role_ == Role::device) {
        devices_.back().listed = false;
        devices_.back().mandatory = false;
      }
      if (stops_all_) {
        bear_transfers(devices_.back());
      }
      if (role_ != Role::master) {  // nobody corrects it
        devices_.back().swapped = false;
      }
      describe(out_, devices_.back());
      if (devices_.back().listed) {
        give_pdos(out_, random_of_outputs_, devices_.back(), bit_rate_);
      }
      out_ << requests_.device_words(devices_.back()) << '\n';
      if (!devices_.back().alive) {
        at(0) << "node " << devices_.back().id << " dies";
      }
    }
    network_of_ours();
  }

  // A fifth of the lines are not NMT master; some of the others react to the loss of a node with
  // more than its reset.
  void roles() {
    switch (below_line(10)) {
      case 0:
        if (fd_) {  // the role of a line of CANopen FD is that of its configuration
          role_ = Role::device;
          out_ << " slave";
          break;
        }
        role_ = Role::slave_by_1f80;
        out_ << " own-value 1F80:0 " << (below_line(2) == 0 ? "00000000" : "04000000");
        break;
      case 1:
        role_ = Role::device;
        out_ << " slave";
        break;
      case 2:
        out_ << " on-error reset-all";
        reacts_ = true;
        break;
      case 3:
        out_ << " on-error stop-all";
        reacts_ = true;
        stops_all_ = true;
        break;
      case 4:
        out_ << " start-all";
        starts_all_ = true;
        break;
      default:
        break;
    }
  }

  // On a slower bus the SDO transfers of all nodes that boot at the same time occupy it for longer
  // than the shortest consumer heartbeat times, because heartbeats and guarding have lower
  // priority. The resulting loss of a mandatory node would stop all nodes until the next command
  // `boot`.
  void bear_transfers(Device& device) const {
    constexpr unsigned kLonger = 300;  // ms
    if (!device.mandatory || bit_rate_ >= 500'000) {
      return;
    }
    device.heartbeat += device.heartbeat != 0 ? kLonger : 0;
    device.guard_time += device.guarded ? kLonger : 0;
  }

  // For profiles without a TPDO 4. Each device receives the MPDOs of the previous one, if any.
  void give_mpdos(Device& device) {
    device.mpdo = (device.profile == "encoder" || device.profile == "drive") && below_more(2) == 0;
    if (device.mpdo) {
      device.mpdo_of = std::exchange(last_with_mpdos_, device.id);
    }
  }

  // Additional actions: NMT commands of all kinds, to one node or all, and values by MPDO. They
  // have their own random numbers, like the own devices.
  void command_or_mpdo(unsigned time) {
    const Device& device = devices_[below_more(static_cast<unsigned>(devices_.size()))];
    switch (below_more(5)) {
      case 0: {
        constexpr const char* kCommands[] = {"start", "stop", "pre-operational", "reset-node",
                                             "reset-communication"};
        const char* const command = kCommands[below_more(5)];
        const bool all = below_more(4) == 0;
        at(time) << "nmt " << command << ' ' << (all ? "all" : std::to_string(device.id));
        break;
      }
      case 1:
        if (!fd_) {
          give_by_mpdo(at(time), below_more(3) == 0 ? 0 : device.id);
        }
        break;
      case 2:
        foreign_command(below_more(4) == 0 ? 0 : device.id, time);
        break;
      default:
        break;
    }
  }

  // Additional actions: spontaneous state changes of devices, sometimes repeated soon after, or a
  // loss and return near the time when the manager detects the loss.
  void change_itself(unsigned time) {
    const Device& device = devices_[below_states(static_cast<unsigned>(devices_.size()))];
    const unsigned soon = time + below_states(device.heartbeat + 20);
    switch (below_states(6)) {
      case 0:
        at(time) << "node " << device.id << " blinks";
        if (below_states(2) == 0) {
          at(soon) << "node " << device.id << " blinks";
        }
        break;
      case 1:
        at(time) << "node " << device.id << " strays";
        break;
      case 2:
        if (device.alive) {
          at(time) << "node " << device.id << " dies";
          at(time + below_states(3 * (device.heartbeat + 100)))
              << "node " << device.id << " returns";
        }
        break;
      default:
        break;
    }
  }

  // Additional actions: the line is stopped and started again, a master becomes a slave for a
  // while, and another master commands its own node.
  void change_line(unsigned number, unsigned time) {
    switch (below_line(24)) {
      case 0:
        at(time) << "restart";
        pauses_ += kRestart;
        break;
      case 1: {
        const unsigned pause = below_line(1500);
        at(time) << "restart after " << pause << "ms";
        pauses_ += kRestart + pause;
        break;
      }
      case 2:
        if (role_ == Role::master && !stops_all_ &&
            std::ranges::none_of(devices_, &Device::swapped)) {
          at(time) << "sdo write off" << number << " 127 1F80:0 04000000";
          at(time + below_line(1500)) << "sdo write on" << number << " 127 1F80:0 01000000";
        }
        break;
      case 3:
      case 4:
        at(time) << "frame 0x000 " << kSpecifiers[below_line(5)] << "7F";
        break;
      case 5:
        at(time) << "nmt " << (below_line(2) == 0 ? "reset-node 127" : "reset-communication 127");
        break;
      default:
        break;
    }
  }

  // To all nodes or one, with own random numbers.
  void write_outputs(unsigned time) {
    if (below_outputs(3) != 0) {
      return;
    }
    const bool all = below_outputs(2) == 0;
    const Device& one = devices_[below_outputs(static_cast<unsigned>(devices_.size()))];
    std::ostringstream values;
    for (const Device& device : devices_) {
      if (device.listed && (all || device.id == one.id)) {
        give_values(values, random_of_outputs_, device);
      }
    }
    if (!values.str().empty()) {
      at(time) << "write 0 arming " << ++arming_ << values.str();
    }
  }

  // Outputs that are objects of the own node.
  void write_own_outputs(unsigned time) {
    constexpr unsigned kNear = 300;  // ms
    for (unsigned i = 0; has_own_outputs_ && i < below_own(3); ++i) {
      std::ostringstream values;
      for (unsigned sub = 1; sub <= 4; ++sub) {
        if (below_own(2) == 0) {
          values << " 127.2101:" << sub << " = " << (below_own(2) == 0 ? "11" : "2E") << "00";
        }
      }
      at(time + below_own(kNear)) << "write 0 arming " << ++arming_ << values.str();
      for (unsigned sub = 1; sub <= 4; ++sub) {
        if (below_own(4) == 0) {
          at(time + below_own(kNear))
              << "output 127.2101:" << sub << " = " << (below_own(2) == 0 ? "22" : "5C") << "00";
        }
      }
    }
  }

  // A command of a second master. node: 0 = all.
  void foreign_command(unsigned node, unsigned time) {
    at(time) << "frame 0x000 " << kSpecifiers[below_more(5)] << std::hex << std::setfill('0')
             << std::setw(2) << node;
  }

  // Writes 2F01h of that device, 0 = of all, and returns the value.
  unsigned give_by_mpdo(std::ostream& out, unsigned node) {
    const unsigned value = 0x10 + below_more(0xF0);
    out << "frame 0x57F " << std::hex << std::uppercase << (0x80 | node) << "012F00" << value
        << "000000" << std::dec;
    return value;
  }

  // One plant of three also has the devices of an own line. They have their own random numbers: the
  // rest of the plant is the same without them.
  void network_of_ours() {
    const unsigned count = role_ != Role::device && below_ours(3) == 0 ? 1 + below_ours(4) : 0;
    for (unsigned i = 0; i < count; ++i) {
      constexpr unsigned kFirst = 110;
      Device device{.id = kFirst + i * 4 + below_ours(4), .profile = "digital-io"};
      device.heartbeat = 50 + below_ours(200);
      device.text = below_ours(2) == 0;
      if (fd_) {
        device.profile = "fd-io";
        device.text = false;  // its TPDO has no room
      }
      out_ << "device " << device.id << ' ' << device.profile << " heartbeat " << device.heartbeat
           << "ms ours" << (device.text ? " text" : "") << requests_.device_words(device) << '\n';
      ours_.push_back(std::move(device));
    }
  }

  void ours_speaks(unsigned time) {
    if (ours_.empty() || below_ours(3) == 0) {
      return;
    }
    const Device& device = ours_[below_ours(static_cast<unsigned>(ours_.size()))];
    constexpr const char* kCommands[] = {"reset-node", "reset-communication", "start"};
    if (below_ours(4) == 0) {
      at(time) << "nmt " << kCommands[below_ours(3)] << ' ' << device.id;
    } else {
      at(time) << "ours output " << device.id << ".6000:1 = " << 10 + below_ours(90);
    }
  }

  void action(unsigned number, unsigned time) {
    Device& device = any();
    switch (below(13)) {
      case 0:
        at(time) << "node " << device.id << " dies";
        device.alive = false;
        break;
      case 1:
      case 2:
        at(time) << "node " << device.id << " returns";
        device.alive = true;
        break;
      case 3:
        at(time) << "node " << device.id << (device.plugged ? " unplugged" : " plugged");
        device.plugged = !device.plugged;
        break;
      case 4:
        at(time) << "sdo read r" << number << ' ' << device.id << " 1018:" << below(6);
        break;
      case 5:
        at(time) << "sdo read r" << number << ' ' << device.id << " 1008:0 timeout 300ms";
        break;
      case 6:
        at(time) << "sdo write w" << number << ' ' << device.id << " 1015:0 "
                 << (below(2) != 0 ? "0A00" : "0A");
        break;
      case 7:
        at(time) << "nmt " << (below(2) != 0 ? "reset-node " : "reset-communication ") << device.id;
        break;
      case 8:
        stranger(at(time));
        break;
      case 9:
        at(time) << "losses " << below(20);
        break;
      case 10:
        write_group(at(time));
        break;
      case 11:
        at(time) << "doubles " << below(30);
        break;
      case 12:
        transfer(at(time), device, number);
        break;
      default:
        break;
    }
  }

  void write_group(std::ostream& out) {
    out << "write 0 arming " << 1 + below(3) << " watchdog " << 50 + below(500) << "ms reactions "
        << (below(2) != 0 ? "0x21" : "0x20");
  }

  void there_and_back(const Device& device, unsigned time) {
    const unsigned size = 40 + below(400);
    out_ << "at " << time << "ms sdo write there" << device.id << ' ' << device.id
         << " 2F00:0 pattern " << size << "\nexpect reply there" << device.id
         << " ok within 5s\nat " << time << "ms sdo read back" << device.id << ' ' << device.id
         << " 2F00:0\nexpect reply back" << device.id << " ok pattern " << size << " within 5s\n";
  }

  // The number of bytes that a slow device accepts in segments in the time at the end of the plant.
  static unsigned most_in_segments(const Device& device) {
    constexpr unsigned kTime = 10'000;  // ms
    constexpr unsigned kSegment = 7;
    return kTime / std::max(device.answers_after, 1U) * kSegment;
  }

  // With a size for segments or for blocks; a device without the object refuses.
  void transfer(std::ostream& out, const Device& device, unsigned number) {
    if (below(3) == 0) {
      out << "sdo read d" << number << ' ' << device.id << " 2F00:0";
    } else {
      constexpr std::array<unsigned, 4> kSizes{4, 120, 400, 900};
      const unsigned size = 40 + below(kSizes[below(4)]);
      out << "sdo write d" << number << ' ' << device.id << " 2F00:0 pattern "
          << std::min(size, most_in_segments(device));
    }
  }

  // Any identifier except that of NMT commands, and any length: malformed for most services with
  // that identifier.
  void stranger(std::ostream& out) {
    const unsigned id = 1 + below(0x7FF);
    takes_own_id_ = takes_own_id_ || id == kOwnEmergency || id == kOwnHeartbeat;
    out << "frame " << id << ' ';
    const unsigned length = below(9);
    for (unsigned i = 0; i < length; ++i) {
      constexpr const char* kDigits = "0123456789ABCDEF";
      out << kDigits[below(16)] << kDigits[below(16)];
    }
  }

  // Switches on most of the devices that were off at the start.
  void come_late(unsigned time) {
    for (Device& device : devices_) {
      if (device.late && below_states(4) != 0) {
        at(1 + below_states(time + 1000)) << "node " << device.id << " returns";
        device.alive = true;
      }
    }
  }

  // All removed devices return or stay off; then the network is not disturbed any more.
  void quiet(unsigned time) {
    out_ << "at " << time + 100 << "ms losses 0\nat " << time + 100 << "ms doubles 0\n";
    // Queued NMT commands of another master would stop nodes again.
    out_ << "at " << time + 100 << "ms frame none\n";
    for (Device& device : devices_) {
      device.alive = device.alive || (device.mandatory && starts_all_);
      if (!device.plugged) {
        out_ << "at " << time + 200 << "ms node " << device.id << " plugged\n";
      }
      out_ << "at " << time + 200 << "ms node " << device.id
           << (device.alive ? " returns\n" : " dies\n");
    }
    if (role_ != Role::master) {
      out_ << "at " << time + 4000 << "ms\nexpect no frame 0x000 within 1s\n";
      return;
    }
    if (takes_own_id_) {  // a second node with the own node-ID stops the network permanently
      out_ << "at " << time + 250 << "ms nmt reset-communication 127\n";
    }
    if (stops_all_) {
      out_ << "at " << time + 300 << "ms boot again all\n";
    }
    // The boot processes of all nodes together may delay a heartbeat too long: one after the other
    // if its loss stops the network.
    const unsigned pause = reacts_ ? 100 : 0;  // ms
    unsigned reset = time + 300;
    for (const Device& device : devices_) {
      out_ << "at " << reset << "ms nmt reset-node " << device.id << '\n';
      reset += pause;
    }
    for (const Device& device : ours_) {
      out_ << "at " << reset << "ms ours output " << device.id
           << ".6000:1 = " << 10 + below_ours(90) << "\nat " << reset << "ms nmt reset-node "
           << device.id << '\n';
      reset += pause;
    }
    come_to_rest(time + 12'000);
  }

  void come_to_rest(unsigned time) {
    out_ << "at " << time << "ms\n";
    // SDO transfers have priority over heartbeats, which would be delayed too long on a slower bus,
    // or while transfers follow each other.
    constexpr unsigned kPause = 250;  // ms
    for (const Device& device : devices_) {
      if (device.alive && device.domain && bit_rate_ >= 500'000 && device.answers_after == 0) {
        there_and_back(device, time);
        time += kPause;
      }
    }
    for (const Device& device : devices_) {
      if (!device.listed || device.answers_after >= kAnswerTimeout) {
        continue;
      }
      if (device.alive) {
        out_ << "expect node " << device.id << " operational within "
             << (device.answers_after == 0 ? "15s\n" : "60s\n");
      } else if (device.heartbeat != 0 || device.guarded) {
        out_ << "expect node " << device.id << " missing within 15s\n";
      }
    }
    const bool is_released = std::ranges::all_of(
        devices_, [](const Device& device) { return !device.mandatory || device.alive; });
    for (const Device& device : ours_) {
      out_ << "expect node " << device.id << " operational within 15s\nexpect ours node "
           << device.id << " operational within 1s\n";
      if (is_released) {
        requests_.request_by_stranger(out_, device, time);
        out_ << "expect input " << device.id << ".6000:1 valid within 1s\n";
        if (!requests_.sends_on_request(device)) {
          commands_of_ours_.expect_value(out_, device, time);
        }
      }
    }
    const bool may_start = std::ranges::all_of(devices_, [](const Device& device) {
      return !device.listed || (device.alive && device.answers_after < kAnswerTimeout);
    });
    if (may_start) {
      out_ << "expect own operational within 1s\nexpect manager running within 1s\n";
      requests_.expect_answers(out_, devices_, time);
    }
    command_and_return(time);
    bring_by_mpdo(time);
    lose_guarding(time);
  }

  // Whether every reaction of the device can be expected once the network is not disturbed any
  // more.
  static bool is_calm(const Device& device) {
    return device.alive && device.listed && device.answers_after == 0;
  }

  // The network is not disturbed any more: commands are executed, and their effect is shown.
  void command_and_return(unsigned time) {
    std::ostringstream shown;
    std::ostringstream back;
    for (const Device& device : devices_) {
      if (!is_calm(device)) {
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

  // From each device to the device that receives its MPDOs.
  void bring_by_mpdo(unsigned time) {
    for (const Device& device : devices_) {
      if (!device.mpdo || !is_calm(device)) {
        continue;
      }
      out_ << "at " << time << "ms ";
      const unsigned value = give_by_mpdo(out_, device.id);
      out_ << "\nexpect device " << device.id << " 2F01:0 = " << value << " within 100ms\n";
      for (const Device& follower : devices_) {
        if (follower.mpdo_of == device.id && is_calm(follower)) {
          out_ << "expect device " << follower.id << " 2F02:0 = " << value << " within 100ms\n";
        }
      }
    }
  }

  // A device without guarding requests reports it when it can, and the master has also detected the
  // loss. Before, it must be guarded: its life guarding begins with a request since its last reset,
  // and the return of another device may have delayed requests so long that the line reset it. A
  // delayed response may end the boot process before the first request reached the device; that it
  // is Operational is the response to a later one.
  void lose_guarding(unsigned time) {
    for (const Device& device : devices_) {
      if (!device.guarded || !is_calm(device) || (device.mandatory && reacts_)) {
        continue;
      }
      const unsigned life_time = device.guard_time * device.life_time_factor;
      const unsigned within = life_time + 2 * device.guard_time;
      out_ << "expect boot " << device.id << " booted within 15s\nexpect node " << device.id
           << " operational within 15s\nat " << time << "ms node " << device.id
           << " unplugged\nexpect heartbeat-lost node=" << device.id << " by=1 time=" << life_time
           << " within " << within << "ms\nexpect device " << device.id << " 1001:0 = 17 within "
           << within << "ms\nat " << time << "ms node " << device.id
           << " plugged\nexpect emcy node=" << device.id
           << " code=0x8130 within 500ms\nexpect node " << device.id << " operational within 15s\n";
    }
  }

  std::mt19937_64 random_;
  std::mt19937_64 random_of_ours_;
  std::mt19937_64 random_of_more_;
  std::mt19937_64 random_of_states_;
  std::mt19937_64 random_of_line_;
  std::mt19937_64 random_of_outputs_;
  std::mt19937_64 random_of_mappings_;
  std::mt19937_64 random_of_own_;
  ServiceCommands services_;
  OwnDeviceCommands commands_of_ours_;
  RequestsAndBursts requests_;
  bool fd_;
  ForeignClients foreign_clients_;
  unsigned arming_ = 100;  // arming number of the last write
  std::ostringstream out_;
  std::vector<std::pair<unsigned, std::ostringstream>> acts_;
  std::vector<Device> devices_;
  std::vector<Device> ours_;
  unsigned bit_rate_ = 0;
  unsigned last_with_mpdos_ = 0;
  unsigned pauses_ = 0;  // ms in which the line was stopped: all later actions are delayed by it
  Role role_ = Role::master;
  bool has_own_outputs_ = false;
  bool starts_all_ = false;
  bool reacts_ = false;        // the loss of a mandatory node affects all nodes
  bool stops_all_ = false;     // that loss stops all nodes
  bool takes_own_id_ = false;  // a foreign frame had a COB-ID that only the own node may use
};

}  // namespace

std::string generate(unsigned long seed) {
  return Generator(seed).plant();
}

}  // namespace linegate::plant
