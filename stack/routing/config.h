// SPDX-License-Identifier: Apache-2.0
// The configuration of a line for routing (CiA 302-7), and its counters.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "stack/base/time.h"
#include "stack/routing/table.h"

namespace linegate::routing {

// Which definition is used where the public texts leave the protocol open, see README.md.
enum class Definition : std::uint8_t { own };

// Selects the client SDO of the entered line that carries a connection. One client SDO carries one
// connection at a time; its COB-IDs are those of the target's default server.
enum class ChannelRule : std::uint8_t {
  client_1,  // always client SDO 1: one connection at a time
  per_node,  // client SDO n for node n: one for each node, further connections wait (channel_wait)
};

// Permits requests from networks to enter the line. Requests that no rule permits are refused.
struct AccessRule {
  std::uint16_t first = 0;  // range of source networks, both ends included
  std::uint16_t last = 0;
  bool sdo_read = false;
  bool sdo_write = false;
  bool emcy = false;
  bool pdo = false;
};

inline constexpr std::uint8_t kMaxHops = 8;

struct Config {
  std::uint8_t interface = 0;         // number of this line; 0 = it does not take part in routing
  std::vector<Interface> interfaces;  // all lines of the process, including this one
  std::vector<Route> routes;          // 1F2Ch:1 and following, at most 254
  // Nodes of this line whose EMCYs are forwarded EMCYs, in addition to the next gateways of its
  // routes.
  std::vector<std::uint8_t> gateways;
  // 1F2Fh, by node-ID: the networks to which EMCYs of a node are forwarded, bit k-1 = network k.
  std::array<std::uint32_t, 128> emcy_networks{};
  std::vector<AccessRule> access;  // for requests that enter this line; empty = closed
  // Whether clients of this process may enter this line, from any line. They do not affect commands
  // of a line in its own network.
  bool process_reads = true;
  bool process_writes = true;

  Definition network_indication = Definition::own;  // OWN A
  Definition routing_table = Definition::own;       // OWN B
  Definition forwarded_emcy = Definition::own;      // OWN C

  ChannelRule channels = ChannelRule::client_1;
  // Replaces the rule: called from the line for each connection, and returns the client SDO
  // (1..127) to use for that node of this line, 0 = none is free.
  std::function<std::uint8_t(std::uint16_t network, std::uint8_t node)> choose_channel;

  // Largest number of hops, 1..kMaxHops: a request or an EMCY with more is not forwarded.
  std::uint8_t hop_limit = kMaxHops;

  // Time-outs. A value of 0 stands for the duration in the comment.
  Duration arm_timeout = std::chrono::seconds(5);  // from the network indication to the transfer
  Duration frame_timeout{};    // between two frames of a transfer: 2 x LineConfig::sdo_timeout
  Duration gateway_timeout{};  // for the answer of the next gateway: 2 x LineConfig::sdo_timeout
  Duration channel_wait{};     // until the target's server is free: LineConfig::sdo_timeout / 2

  // Number of servers of the own node in addition to the default one: 1201h and following, not
  // valid until COB-IDs are written. Each may carry a connection.
  std::uint8_t additional_servers = 0;
};

// Counted since the line was created. They never decrease, except `open` and `channels`.
struct Counters {
  // Connections whose client is on this line (or is this process, through this line):
  // opened = open + finished + aborted + timed_out.
  std::uint64_t opened = 0;
  std::uint64_t finished = 0;   // ended with a final response
  std::uint64_t aborted = 0;    // by either side, or abandoned by the client
  std::uint64_t timed_out = 0;  // no frame arrived in time, arm_timeout included
  std::uint64_t refused = 0;    // network indications that opened no connection
  std::uint32_t open = 0;       // at present
  // Connections that use a client SDO of this line:
  std::uint32_t channels = 0;       // reserved or waiting, at present
  std::uint64_t not_permitted = 0;  // refused by the access rules
  // Frames of connections that were queued for this line's bus.
  std::uint64_t forwarded = 0;
  // Last frames of ended connections that the bus did not accept in time.
  std::uint64_t lost = 0;
  // EMCYs handed to other lines, and EMCYs that were dropped here: repeats, returned to their
  // source, too many hops, no route, no room in the queue, or inhibited.
  std::uint64_t emcy_forwarded = 0;
  std::uint64_t emcy_dropped = 0;
  // PDO forwarding: values received from PDOs of other lines.
  std::uint64_t values = 0;
  // Messages of other lines without a matching connection or service: late, or not supported in
  // this role.
  std::uint64_t unexpected = 0;
};

}  // namespace linegate::routing
