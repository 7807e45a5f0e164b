// SPDX-License-Identifier: Apache-2.0
// The last EMCYs of each node, from 5F18h of the line (stack/diagnosis/emcy_record.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "bridges/console/commands.h"
#include "stack/emcy/message.h"

namespace linegate::console {

struct NodeHistory {
  std::uint8_t node = 0;
  std::string name;
  std::uint32_t received = 0;           // since the gateway was started
  std::vector<emcy::Message> messages;  // newest first, at most four
  // Of an observer, which keeps the code and the error register of the last EMCY alone: the one
  // message has no manufacturer bytes.
  bool last_alone = false;
};

// Decodes 5F18h:node; empty if it is malformed.
std::vector<emcy::Message> parse_history(std::span<const std::byte> data);

std::string history_text(const std::string& line, const std::vector<NodeHistory>& nodes);
// {"gateway":..,"line":..,"nodes":[{"node":..,"name":..,"received":..,"emcys":[{"code":..,..}]}]},
// without "bytes" where they are not known
std::string history_json(const LineId& line, const std::vector<NodeHistory>& nodes);

// The errors that a device of a line in the role device, or the own node, keeps in 1003h.
struct StoredErrors {
  std::uint8_t node = 0;
  std::string name;
  bool has_object = true;             // whether it has 1003h
  std::vector<std::uint32_t> fields;  // newest first: error code, additional information << 16
};

std::string stored_errors_text(const std::string& line, const std::vector<StoredErrors>& nodes);
// {"gateway":..,"line":..,"nodes":[{"node":..,"name":..,"stored":true,"errors":[{"code":..,..}]}]}
std::string stored_errors_json(const LineId& line, const std::vector<StoredErrors>& nodes);

// what: LINE for all nodes that sent an EMCY, or LINE:NODE; of an observer the last one of each. Of
// the own node (LINE:own) and of the devices of a line in the role device, which the gateway does
// not receive EMCYs of: their 1003h.
int emcy_history(Context& context, const std::string& what);

}  // namespace linegate::console
