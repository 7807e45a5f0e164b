// SPDX-License-Identifier: Apache-2.0
// The SDO clients of a node: one for each object 1280h to 12FFh in the dictionary (CiA
// 301, 7.5.2.34).
//   sub 1  U32  COB-ID client to server, bit 31 = not valid, bit 30 = assigned dynamically
//   sub 2  U32  COB-ID server to client, likewise
//   sub 3  U8   node-ID of the server
// Contrary to CiA 301's table of restricted identifiers, a client may use those of a default server
// (600h and 580h + node-ID), because it could not reach one otherwise. But not where an
// sdo::Arbiter uses all of them (the own node of a line): a default server serves one transfer at a
// time, and the arbiter schedules these. There, writing them is refused with 0609 0030h, as any
// restricted identifier, and a client described with them is not valid. Nor is a client described
// with an identifier of a preceding client.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/can/dispatch.h"
#include "stack/can/transmit_queue.h"
#include "stack/od/dictionary.h"
#include "stack/sdo/client.h"

namespace linegate::node {

inline constexpr std::uint16_t kSdoClients = 128;

// Hook of 1280h to 12FFh. Writes take effect at the next apply_writes().
class SdoClients final : public od::Hook {
 public:
  // Index bit of the sdo_client targets registered here; the low bits are the client number from 0.
  static constexpr std::uint16_t kMark = 0x100;

  // Creates a client for each object and sets the hooks. All must outlive it.
  SdoClients(od::Dictionary& dictionary, can::Dispatch& dispatch, EventLog& events,
             bool of_default_servers);

  // The client of object 1280h + number - 1, for a transfer: start it, and take() its outcome when
  // it has ended. advance() of the node processes it. Returns sdo_connection (060A 0023h) if there
  // is no such object, a COB-ID in it is not valid, or a transfer is under way.
  Result<sdo::Client*> client(std::uint16_t number);

  // Drops all transfers, which end with sdo_connection, and reads the COB-IDs again, including
  // those of objects added since.
  void configure();
  // Drops all transfers.
  void reset();

  // index: of a target with the bit kMark.
  void receive(std::uint16_t index, const can::Frame& frame, can::TransmitQueue& queue);
  void apply_writes();
  void advance(Instant now, can::TransmitQueue& queue);
  Instant next_wake() const;

  // Number of frames that are not SDO frames.
  std::uint64_t malformed() const { return malformed_; }

  // Returns invalid_value by the rules of other COB-IDs (can/cob_id_rule.h), for a COB-ID of
  // another client, and for a node-ID above 127.
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  void written(od::Address address) override;

 private:
  struct Entry {
    std::uint16_t index = 0;  // of the object
    can::CobId request;       // invalid: not in use
    can::CobId response;      // as registered
    std::unique_ptr<sdo::Client> client;
  };

  void find_objects();
  Entry* find(std::uint16_t index);
  void configure(Entry& entry);
  can::CobId cob_id(od::Address address) const;
  bool allowed(can::CobId cob_id, std::uint8_t sub) const;
  bool usable(can::CobId cob_id, std::uint8_t sub) const;

  od::Dictionary& dictionary_;
  can::Dispatch& dispatch_;
  EventLog& events_;
  bool of_default_servers_;
  std::vector<Entry> entries_;  // ascending by index
  bool changed_ = false;
  std::uint64_t malformed_ = 0;
};

}  // namespace linegate::node
