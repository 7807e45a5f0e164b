// SPDX-License-Identifier: Apache-2.0
// SDO transfers of this process with nodes of other networks: clients whose frames go through the
// line's SdoEntrance instead of a bus. Each says the network indication, then makes its transfer;
// where a transfer is begun anew, a new indication goes before.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "stack/routing/sdo_entrance.h"
#include "stack/sdo/request.h"

namespace linegate::routing {

struct RemoteRequest {
  sdo::TransferOwner* owner = nullptr;  // must live until the Completion, or cancel the request
  std::uint64_t number = 0;             // chosen by the owner, unique among its requests
  std::uint16_t network = 0;
  std::uint8_t node = 0;  // 0 = the gateway itself
  od::Address address{};
  bool write = false;
  std::vector<std::byte> data{};  // to be written
  Duration timeout{};             // for each answer, positive
  unsigned repeats = 0;           // as sdo::TransferOptions::repeats; also of an indication that
                                  // nobody answered (0504 0000h)
  bool as_device = false;         // as a device on the bus of the line would request it
};

class RemoteClient {
 public:
  explicit RemoteClient(SdoEntrance& entrance);
  ~RemoteClient();

  // Precondition: request.owner is set. There will be exactly one Completion, unless it is
  // cancelled.
  void start(RemoteRequest request, Instant now);
  // No effect if it is not known.
  void cancel(const sdo::TransferOwner& owner, std::uint64_t number, Instant now);
  // Calls sdo::TransferOwner::completed() for each transfer that has ended, the oldest first.
  void deliver_completions(Instant now);

  // Hands on what the clients have to send. True if there was anything.
  bool pump(Instant now);
  void advance(Instant now);
  Instant next_wake() const;

 private:
  class Transfer;

  SdoEntrance& entrance_;
  std::vector<std::unique_ptr<Transfer>> transfers_;
  // Of transfers that have ended.
  struct Ended {
    sdo::TransferOwner* owner = nullptr;
    sdo::Completion completion;
  };
  std::deque<Ended> ended_;
};

}  // namespace linegate::routing
