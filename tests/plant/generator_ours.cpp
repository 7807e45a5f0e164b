// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/generator_ours.h"

#include <iomanip>
#include <sstream>

namespace linegate::plant {

// Uses values that no other command has, unless there are too many commands.
std::string OwnDeviceCommands::command(const Device& device) {
  constexpr unsigned kEmergency = 0x5000;
  constexpr unsigned kFirst = 0x80;  // all other commands use lower values
  std::ostringstream value;
  value << std::hex << std::uppercase << kFirst + ++number_ % kFirst;
  const std::string node = std::to_string(device.id);
  switch (below(4)) {
    case 0:
      return "ours emcy " + node + ' ' + std::to_string(kEmergency + number_);
    case 1:
      return "ours trigger " + node + " 1";
    case 2:
      return "ours write " + node + " 6000:1 " + value.str();
    default:
      if (device.text && below(2) == 0) {
        return "ours output " + node + ".2300:0 = 412D" + value.str() + "7A";
      }
      return "ours output " + node + ".6000:" + std::to_string(1 + below(2)) + " = " + value.str();
  }
}

void OwnDeviceCommands::expect_value(std::ostream& out, const Device& device, unsigned time) {
  const unsigned value = 1 + below(0x7F);
  out << "at " << time << "ms ours write " << device.id << " 6000:1 " << std::hex << std::uppercase
      << std::setfill('0') << std::setw(2) << value << std::dec << "\nexpect input " << device.id
      << ".6000:1 = " << value << " within 1s\n";
  if (device.text) {
    const unsigned last = '!' + below('~' - '!');
    out << "at " << time << "ms ours output " << device.id << ".2300:0 = 4F6B2D" << std::hex
        << std::uppercase << last << std::dec << "\nexpect input " << device.id
        << ".2300:0 = " << (last << 24U | 0x2D6B4FU) << " within 1s\n";
  }
}

OwnDeviceCommands::Actions OwnDeviceCommands::draw(const std::vector<Device>& ours, unsigned time) {
  constexpr unsigned kNear = 50;  // ms
  Actions out;
  const unsigned count = ours.empty() || below(2) == 0 ? 0 : 1 + below(2);
  for (unsigned i = 0; i < count; ++i) {
    const Device& device = ours[below(static_cast<unsigned>(ours.size()))];
    const unsigned when = time + below(kNear);
    out.emplace_back(when, command(device));
  }
  if (!ours.empty()) {
    disturb(out, time);
  }
  return out;
}

// One time in six. Frames are lost right after a command, if there is one at that time.
void OwnDeviceCommands::disturb(Actions& out, unsigned time) {
  constexpr unsigned kLongest = 1500;  // ms
  switch (below_bus(12)) {
    case 0:
      out.emplace_back(out.empty() ? time : out.back().first, "ours loses");
      break;
    case 1:
      out.emplace_back(time, "ours bus off");
      out.emplace_back(time + 1 + below_bus(kLongest), "ours bus on");
      break;
    default:
      break;
  }
}

}  // namespace linegate::plant
