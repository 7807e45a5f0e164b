// SPDX-License-Identifier: Apache-2.0
// The devices of random plants. Private to the generator.
#pragma once

#include <ostream>
#include <random>
#include <string>

namespace linegate::plant {

inline constexpr unsigned kAnswerTimeout = 500;  // ms

struct Device {
  unsigned id = 0;
  std::string profile;
  unsigned heartbeat = 0;  // ms, 0 = none
  bool guarded = false;
  bool domain = false;
  bool mandatory = false;
  bool listed = true;
  bool late = false;  // it is switched on later than the line
  bool no_cob_ids = false;
  bool swapped = false;  // it has stored another mapping than that of its file
  bool alive = true;
  bool plugged = true;
  unsigned guard_time = 0;  // ms
  unsigned life_time_factor = 0;
  // Ms, of its SDO server; with kAnswerTimeout or more it never answers in time
  unsigned answers_after = 0;
  unsigned serial = 0;  // 0 = that of the device file
  bool text = false;    // its TPDO 1 has a string, 2300h
  bool twice = false;   // two of its RPDOs have the same object
  bool mpdo = false;
  unsigned mpdo_of = 0;  // the node whose MPDOs it receives, 0 = none
};

// Chooses its profile and its error control.
Device draw_device(std::mt19937_64& random, unsigned id);
// Chooses deviations: it appears late, is not configured, answers slowly, or has the identity of
// another device.
void draw_manners(std::mt19937_64& random, Device& device);
// Makes it a device of CANopen FD, which has no guarding and no MPDOs; some have PDOs of 64 bytes.
void be_fd(std::mt19937_64& random, Device& device);
// Writes its statement in the scenario, without the line end.
void describe(std::ostream& out, const Device& device);

}  // namespace linegate::plant
