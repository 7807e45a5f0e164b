// SPDX-License-Identifier: Apache-2.0
// The SDO servers of a node: the default one on 600h and 580h + node-ID, and one for each object
// 1201h to 127Fh in the dictionary (CiA 301, 7.5.2.33).
//   sub 1  U32  COB-ID client to server, bit 31 = not valid, bit 30 = assigned dynamically
//   sub 2  U32  COB-ID server to client, likewise
//   sub 3  U8   node-ID of the client
// The COB-IDs of 1200h follow from the node-ID, and are read-only. A server described with an
// identifier of a preceding server is not valid.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/can/dispatch.h"
#include "stack/can/transmit_queue.h"
#include "stack/od/dictionary.h"
#include "stack/sdo/server.h"

namespace linegate::node {

// Shared by the SDO channels of a node, 1200h to 127Fh and 1280h to 12FFh.

// Sub-indices of a channel: the COB-IDs from client to server, and from server to client.
inline constexpr std::uint8_t kRequestSub = 1;
inline constexpr std::uint8_t kResponseSub = 2;

// Whether one of the objects first to last (inclusive), except that of place, has the identifier of
// cob_id at the sub-index of place, and both are valid. Two channels on one identifier would
// process each other's frames.
bool has_identifier(const od::Dictionary& dictionary, std::uint16_t first, std::uint16_t last,
                    od::Address place, can::CobId cob_id);

inline constexpr std::uint16_t kSdoServers = 128;

// Hook of 1200h to 127Fh. Writes take effect at the next apply_writes(), after the answer to the
// write, because the request may have come through the server that it changes.
class SdoServers final : public od::Hook {
 public:
  // Creates a server for each object and sets the hooks. Requests are registered as
  // Service::sdo_server with the server's number, 0 = default. All must outlive it.
  SdoServers(od::Dictionary& dictionary, can::Dispatch& dispatch, EventLog& events,
             std::uint8_t node_id);

  // Drops all transfers and reads the COB-IDs again, including those of objects added since.
  void configure();
  // Drops all transfers.
  void reset();
  // For all servers, including later ones; see sdo::Server::set_network_handler().
  void set_network_handler(sdo::NetworkHandler* handler);

  // number: Target::index. Returns nullptr if there is no such server.
  sdo::Server* find(std::uint16_t number) {
    return number == 0 ? default_server_ : find_other(number);
  }
  sdo::Server& default_server() { return *default_server_; }
  void apply_writes();
  void advance(Instant now, can::TransmitQueue& queue);
  Instant next_wake() const;

  // Number of frames that are not SDO frames.
  std::uint64_t malformed() const;

  // Returns read_only for 1200h; invalid_value by the rules of other COB-IDs (can/cob_id_rule.h),
  // for a COB-ID of another server, and for a node-ID above 127.
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  void written(od::Address address) override;

 private:
  struct Entry {
    std::uint16_t number = 0;
    can::CobId request;  // as registered; invalid = not registered
    std::unique_ptr<sdo::Server> server;
  };

  sdo::Server* find_other(std::uint16_t number);
  void configure(Entry& entry);
  void find_objects();
  void show_default_server();
  can::CobId cob_id(std::uint16_t number, std::uint8_t sub) const;
  bool of_an_earlier_one(std::uint16_t number, can::CobId request, can::CobId response) const;

  od::Dictionary& dictionary_;
  can::Dispatch& dispatch_;
  EventLog& events_;
  std::uint8_t node_id_;
  std::vector<Entry> entries_;  // ascending by number, the default server first
  sdo::Server* default_server_ = nullptr;
  sdo::NetworkHandler* network_handler_ = nullptr;
  bool changed_ = false;
  std::size_t first_ = 0;  // served first in the next advance()
};

}  // namespace linegate::node
