// SPDX-License-Identifier: Apache-2.0
// Implements the console's client with the subscriber's half of bridges/dds.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "bridges/console/client.h"
#include "stack/base/diagnostic.h"

namespace linegate::gateway {

struct RemoteClientOptions {
  std::uint32_t domain = 0;
  std::string profile;   // file of QoS profiles; empty = the installed one, or the built-in copy
  std::string security;  // folder of an identity; empty = without DDS-Security
  std::vector<std::string> interfaces;  // of this host; none = those of the profile
  std::vector<std::string> peers;       // hosts that multicast does not reach
  std::vector<std::string> servers;     // discovery servers, instead of multicast and peers
  bool multicast = false;               // receive images by multicast
  std::vector<std::string> only;        // lines, "GATEWAY/LINE"; none = all
  // The topics to subscribe to besides the states of gateways, lines and nodes.
  bool images = false;  // and states of outputs
  bool layouts = false;
  bool events = false;
  bool commands = false;  // commands can be sent
  bool outputs = false;   // outputs can be written
};

// Without a value, a diagnostic states the reason.
Loaded<std::unique_ptr<console::Client>> make_remote_client(const RemoteClientOptions& options);

}  // namespace linegate::gateway
