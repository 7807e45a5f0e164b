// SPDX-License-Identifier: Apache-2.0
// What a line needs to know to take part in routing (CiA 302-7), and what it counts.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "stack/base/time.h"
#include "stack/routing/table.h"

namespace linegate::routing {

// Which definition of what the public texts leave open, see README.md.
enum class Definition : std::uint8_t { own };

// Which client SDO of the line that is entered carries a connection. One client SDO carries one
// connection at a time; its COB-IDs are those of the target's default server.
enum class ChannelRule : std::uint8_t {
  client_1,  // always client SDO 1: one connection at a time
  per_node,  // client SDO n for node n: one for each node, the next one waits (channel_wait)
};

// Who may enter the line. What no rule allows is refused.
struct AccessRule {
  std::uint16_t first = 0;  // networks that it comes from, both included
  std::uint16_t last = 0;
  bool sdo_read = false;
  bool sdo_write = false;
  bool emcy = false;
  bool pdo = false;
};

inline constexpr std::uint8_t kMaxHops = 8;

struct Config {
  std::uint8_t interface = 0;         // of this line; 0 = it takes no part
  std::vector<Interface> interfaces;  // all lines of the process, this one included
  std::vector<Route> routes;          // 1F2Ch:1 and following, at most 254
  // Nodes of this line whose EMCYs are forwarded ones, beside the next gateways of its routes.
  std::vector<std::uint8_t> gateways;
  // 1F2Fh, by node-ID: to which networks EMCYs of a node go on, bit k-1 = network k.
  std::array<std::uint32_t, 128> emcy_networks{};
  std::vector<AccessRule> access;  // of requests that enter this line; none = closed
  // Whether clients of this process itself, whichever line they asked, may enter it, too. What a
  // line's own commands do in its own network is not looked at here.
  bool process_reads = true;
  bool process_writes = true;

  Definition network_indication = Definition::own;  // OWN A
  Definition routing_table = Definition::own;       // OWN B
  Definition forwarded_emcy = Definition::own;      // OWN C

  ChannelRule channels = ChannelRule::client_1;
  // Asked for each connection instead of the rule: which client SDO (1..127) is to be used for that
  // node of this line, 0 = none is free. Called from the line.
  std::function<std::uint8_t(std::uint16_t network, std::uint8_t node)> choose_channel;

  // A request, or an EMCY, that has come through more gateways goes no further; 1..kMaxHops.
  std::uint8_t hop_limit = kMaxHops;

  // Time-outs; 0 = as said.
  Duration arm_timeout = std::chrono::seconds(5);  // from the network indication to the transfer
  Duration frame_timeout{};    // between two frames of a transfer: 2 x LineConfig::sdo_timeout
  Duration gateway_timeout{};  // for the answer of the next gateway: 2 x LineConfig::sdo_timeout
  Duration channel_wait{};     // until the target's server is free: LineConfig::sdo_timeout / 2

  // Servers of the own node beside the default one: 1201h and following, not valid until somebody
  // writes COB-IDs. Each may carry a connection.
  std::uint8_t additional_servers = 0;
};

// Since the line was made; they never go back, but for what is open now.
struct Counters {
  // Of connections whose client is on this line (or is this process, through this line):
  // opened = open + finished + aborted + timed_out.
  std::uint64_t opened = 0;
  std::uint64_t finished = 0;   // ended with a final response
  std::uint64_t aborted = 0;    // by either side, or given up by the client
  std::uint64_t timed_out = 0;  // nothing came in time, the arm timer among it
  std::uint64_t refused = 0;    // network indications, never opened
  std::uint32_t open = 0;       // at present
  // Of connections that use a client SDO of this line:
  std::uint32_t channels = 0;       // reserved or waited for, at present
  std::uint64_t not_permitted = 0;  // refused by the rules of access
  // Frames of connections that left on this line's bus.
  std::uint64_t forwarded = 0;
  // Last frames of connections that had ended, which the bus did not take in time.
  std::uint64_t lost = 0;
  // EMCYs handed to other lines, and those that were not, or went no further here: repeats, back at
  // their source, too many hops, no route, no room in queue or inhibit time.
  std::uint64_t emcy_forwarded = 0;
  std::uint64_t emcy_dropped = 0;
  // PDO forwarding: values that PDOs of other lines brought here.
  std::uint64_t values = 0;
  // Messages of other lines that nobody here waited for: late, or for a role that cannot.
  std::uint64_t unexpected = 0;
};

}  // namespace linegate::routing
