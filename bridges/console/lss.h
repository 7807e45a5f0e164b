// SPDX-License-Identifier: Apache-2.0
// `linegate lss`: the layer setting services of CiA 305 on a line, each as a person wants it: from
// finding a device to leaving it as it was, or is to be.
#pragma once

#include <optional>
#include <string>

#include "bridges/console/commands.h"
#include "stack/lss/message.h"

namespace linegate::console {

struct LssRequest {
  std::string line;
  // scan: every device that has no node-ID. assign: node-IDs as configured, to all who have none.
  // inquire, set-node-id, bit-timing, store: of one device. activate: the bit timing of all who
  // were given one. identify: whether anybody has no node-ID.
  std::string what;
  std::string address;  // VENDOR:PRODUCT:REVISION:SERIAL, hexadecimal
  bool only = false;    // in its place: there is but one device on the line
  std::string value;    // node-ID or none; kbit/s; ms until the switch, and after it
  bool store = false;   // the device keeps it
  bool force = false;   // set-node-id: even if another device uses the node-ID
};

// Four hexadecimal numbers between colons, with or without 0x.
std::optional<lss::Address> parse_lss_address(const std::string& text);
std::string lss_address_text(const lss::Address& address);

// Gives the program's exit code. Whatever happens, no device is left in configuration by it.
int lss(Context& context, const LssRequest& request);

}  // namespace linegate::console
