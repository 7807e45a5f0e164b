// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/generator_devices.h"

#include <array>

namespace linegate::plant {

Device draw_device(std::mt19937_64& random, unsigned id) {
  constexpr std::array<const char*, 4> kProfiles{"digital-io", "analog-io", "encoder", "drive"};
  const auto below = [&random](unsigned limit) { return static_cast<unsigned>(random() % limit); };
  Device device{.id = id, .profile = kProfiles[below(4)]};
  // Other profiles do not support guarding
  device.guarded = device.profile == "digital-io" && below(2) == 0;
  device.heartbeat = device.guarded || below(6) == 0 ? 0 : 50 + below(200);
  device.domain = below(3) == 0;
  if (device.guarded) {
    device.guard_time = 50 + below(100);
    device.life_time_factor = 3 + below(3);
  }
  device.mandatory = below(4) == 0;
  return device;
}

void draw_manners(std::mt19937_64& random, Device& device) {
  const auto below = [&random](unsigned limit) { return static_cast<unsigned>(random() % limit); };
  constexpr unsigned kTwinSerial = 4711;
  if (below(8) == 0) {
    device.late = true;
    device.alive = false;
  }
  if (below(10) == 0) {
    device.listed = false;
    device.mandatory = false;
    device.guarded = false;
    device.mpdo = false;
  }
  switch (below(24)) {
    case 0:
      device.answers_after = 1 + below(60);
      break;
    case 1:
      device.answers_after = kAnswerTimeout - 150 + below(140);
      break;
    case 2:
      device.answers_after = kAnswerTimeout + 10 + below(1000);
      device.mandatory = false;
      break;
    default:
      break;
  }
  device.serial = below(6) == 0 ? kTwinSerial : 0;
  device.no_cob_ids = below(6) == 0;
  device.swapped = device.listed && below(6) == 0;
}

void be_fd(std::mt19937_64& random, Device& device) {
  const auto below = [&random](unsigned limit) { return static_cast<unsigned>(random() % limit); };
  // A boot process reads each of the 64 objects in a mapping, and may write them: a slow device
  // would need minutes.
  constexpr unsigned kSlow = 60;
  const bool slow = device.answers_after > kSlow && device.answers_after < kAnswerTimeout;
  if (device.profile == "digital-io" || below(6) == 0) {  // digital-io maps bits
    device.profile = slow ? "analog-io" : "fd-io";
    device.swapped = device.swapped && device.answers_after == 0;
  }
  if (device.guarded) {
    device.guarded = false;
    device.heartbeat = 50 + below(200);
  }
  device.mpdo = false;
  device.mpdo_of = 0;
}

namespace {

// Records of the profile that map two objects.
const char* two_objects_of(const std::string& profile) {
  return profile == "digital-io"  ? "1600"
         : profile == "fd-io"     ? "1600"
         : profile == "analog-io" ? "1601"
         : profile == "drive"     ? "1601"
                                  : "1A00";
}

}  // namespace

void describe(std::ostream& out, const Device& device) {
  out << "device " << device.id << ' ' << device.profile;
  if (device.guarded) {
    out << " guarding " << device.guard_time << "ms " << device.life_time_factor;
  } else {
    out << " heartbeat " << device.heartbeat << "ms";
  }
  if (device.domain) {
    out << " domain";
  }
  if (device.mandatory) {
    out << " mandatory";
  }
  if (device.serial != 0) {
    out << " has-serial " << device.serial;
  }
  if (device.no_cob_ids) {
    out << " no-cob-ids";
  }
  if (device.twice) {
    out << " twice";
  }
  if (device.swapped) {
    out << " swapped " << two_objects_of(device.profile);
  }
  if (device.answers_after != 0) {
    out << " answers-after " << device.answers_after << "ms";
  }
  if (!device.listed) {
    out << " unlisted";
  }
  if (device.mpdo) {
    out << " mpdo";
  }
  if (device.mpdo && device.mpdo_of != 0) {
    out << " mpdo-of " << device.mpdo_of;
  }
}

}  // namespace linegate::plant
