// SPDX-License-Identifier: Apache-2.0
// SDO transfers of this process with nodes of other networks: clients whose frames pass through the
// line's SdoIngress instead of a bus. Each sends the network indication and then makes its
// transfer; a repeated transfer needs a new indication.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "stack/routing/sdo_ingress.h"
#include "stack/sdo/request.h"

namespace linegate::routing {

struct RemoteRequest {
  sdo::TransferOwner* owner = nullptr;  // must live until the Completion, or cancel the request
  std::uint64_t number = 0;             // chosen by the owner, unique among its requests
  std::uint16_t network = 0;
  std::uint8_t node = 0;  // 0 = the gateway itself
  od::Address address{};
  bool write = false;
  std::vector<std::byte> data{};  // the value to write
  Duration timeout{};             // for each answer, positive
  // Like sdo::TransferOptions::repeats; also for an indication without an answer (0504 0000h)
  unsigned repeats = 0;
  std::uint8_t hops = 0;     // gateways that the request has passed
  bool as_device = false;    // request it as a device on the line's bus would
  std::uint32_t client = 0;  // whose command caused it, like sdo::Request::client
};

class RemoteClient {
 public:
  explicit RemoteClient(SdoIngress& ingress);
  ~RemoteClient();

  // Precondition: request.owner is set. Exactly one Completion follows, unless the request is
  // cancelled.
  void start(RemoteRequest request, Instant now);
  // No effect if there is no such request.
  void cancel(const sdo::TransferOwner& owner, std::uint64_t number, Instant now);
  // The request is a write that its target may have carried out, see
  // sdo::Client::may_be_carried_out().
  bool may_be_carried_out(const sdo::TransferOwner& owner, std::uint64_t number) const;
  // Calls sdo::TransferOwner::completed() for each ended transfer, oldest first.
  void deliver_completions(Instant now);

  // Forwards queued frames of the clients. True if there were any.
  bool pump(Instant now);
  void advance(Instant now);
  Instant next_wake() const;

 private:
  class Transfer;

  SdoIngress& ingress_;
  std::vector<std::unique_ptr<Transfer>> transfers_;
  // An ended transfer.
  struct Ended {
    sdo::TransferOwner* owner = nullptr;
    sdo::Completion completion;
  };
  std::deque<Ended> ended_;
};

}  // namespace linegate::routing
