// SPDX-License-Identifier: Apache-2.0
// `linegate lss`: layer setting services (CiA 305) on a line, each as one command that finds the
// device and returns it to waiting state.
#pragma once

#include <optional>
#include <string>

#include "bridges/console/commands.h"
#include "stack/lss/message.h"

namespace linegate::console {

struct LssRequest {
  std::string line;
  // scan: all devices without a node-ID. assign: configured node-IDs to all of them. inquire,
  // set-node-id, bit-timing, store: one device. activate: the bit timing of all devices that got
  // one. identify: whether any device has no node-ID.
  std::string what;
  std::string address;  // VENDOR:PRODUCT:REVISION:SERIAL, hexadecimal
  bool only = false;    // instead of an address: exactly one device is on the line
  std::string value;    // node-ID or `none`; kbit/s; delay in ms before and after the switch
  bool store = false;   // store the value in the device
  bool force = false;   // set-node-id: even if another device uses the node-ID
};

// Four hexadecimal numbers between colons, with or without 0x.
std::optional<lss::Address> parse_lss_address(const std::string& text);
std::string lss_address_text(const lss::Address& address);

// Returns the exit code of the program. On every path all devices are returned to waiting state.
int lss(Context& context, const LssRequest& request);

}  // namespace linegate::console
