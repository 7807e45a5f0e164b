// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/generator_services.h"

#include <iomanip>
#include <sstream>

#include "tests/plant/generator_outputs.h"

namespace linegate::plant {

std::string ServiceCommands::line_words() {
  has_mpdo_ = below(3) == 0 && !fd_;
  return has_mpdo_ ? " mpdo" : "";
}

// A different value for each command, which no group write has.
std::string ServiceCommands::hex_of(unsigned bytes) const {
  constexpr unsigned kFirst = 0x40;
  std::ostringstream out;
  out << std::hex << std::uppercase << std::setfill('0');
  for (unsigned i = 0; i < bytes; ++i) {
    out << std::setw(2) << kFirst + number_ % (0x100 - kFirst);
  }
  return out.str();
}

// A device without outputs is written by SDO.
std::string ServiceCommands::output(const Device& device) {
  const auto outputs = outputs_of(device);
  const std::string node = std::to_string(device.id);
  const std::string name = std::to_string(number_);
  if (outputs.empty() || !device.listed) {
    return "object o" + name + ' ' + node + " 1015:0 0A00";
  }
  const auto& [object, bytes] = outputs[below(static_cast<unsigned>(outputs.size()))];
  const bool by_object = below(2) == 0;
  return by_object ? "object o" + name + ' ' + node + ' ' + object + ' ' + hex_of(bytes)
                   : "output " + node + '.' + object + " = " + hex_of(bytes);
}

// Switches off the first RPDO with outputs. The line refuses that while the image has its values.
std::string ServiceCommands::pdo_write(const Device& device) const {
  constexpr unsigned kNotValid = 0x80;  // the highest octet
  const bool second = outputs_of(device).front().first.starts_with("6411");
  std::ostringstream out;
  out << "sdo write c" << number_ << ' ' << device.id << (second ? " 1401:1 " : " 1400:1 ")
      << std::hex << std::uppercase << std::setfill('0') << std::setw(2) << device.id
      << (second ? "03" : "02") << "00" << kNotValid;
  return out.str();
}

std::string ServiceCommands::command(const std::vector<Device>& devices) {
  constexpr unsigned kIdentifier = 0x6E4;  // belongs to no service
  constexpr unsigned kSoftware = 0x6000;   // emergency error code
  const Device& device = one_of(devices);
  const std::string name = std::to_string(++number_);
  const std::string node = std::to_string(device.id);
  switch (below(8)) {
    case 0:
      return "send s" + name + ' ' + std::to_string(kIdentifier + below(4)) + ' ' + hex_of(4);
    case 1:
      return "emcy e" + name + ' ' + std::to_string(kSoftware + number_);
    case 2:
      return "trigger t" + name + ' ' + node + ' ' + std::to_string(1 + below(2));
    case 3:
      if (has_mpdo_) {
        return "mpdo m" + name + ' ' + node + " 2F01:0 " + hex_of(4);
      }
      break;
    case 4:
      if (device.listed && !outputs_of(device).empty() && below(4) == 0) {
        return pdo_write(device);
      }
      break;
    default:
      break;
  }
  return output(device);
}

// No station acknowledges, or the controller of the line is bus-off. Returns the duration in ms.
unsigned ServiceCommands::silence(Actions& out, unsigned time) {
  constexpr unsigned kLongest = 1500;  // ms
  const bool off_bus = below(3) == 0;
  const unsigned length = 1 + below(kLongest);
  out.emplace_back(time, off_bus ? "bus off" : "acknowledge off");
  out.emplace_back(time + length, off_bus ? "bus on" : "acknowledge on");
  return length;
}

ServiceCommands::Actions ServiceCommands::draw(const std::vector<Device>& devices, unsigned time) {
  constexpr unsigned kNear = 50;  // ms
  Actions out;
  const bool silent = below(12) == 0;
  if (!silent && below(3) == 0) {
    return out;
  }
  const unsigned within = silent ? silence(out, time) : kNear;
  const unsigned count = 1 + below(silent ? 4 : 2);
  for (unsigned i = 0; i < count; ++i) {
    const unsigned when = time + below(within);
    out.emplace_back(when, command(devices));
  }
  return out;
}

}  // namespace linegate::plant
