// SPDX-License-Identifier: Apache-2.0
// Client and server, connected by a bus that can lose, repeat and corrupt frames.
#pragma once

#include <functional>

#include "stack/sdo/client.h"
#include "stack/sdo/server.h"

#include "tests/stack/sdo/support.h"

namespace linegate::sdo::test {

class TransferPair : public testing::Test {
 protected:
  enum class Fault : std::uint8_t { none, lose, repeat, shorten };
  // Returns the fault of a frame. number: from 0, both directions counted.
  using Faults = std::function<Fault(const can::Frame& frame, int number)>;

  // Delivers frames, 0.1 ms each, until the transfer of the client has ended.
  Outcome run(const Faults& faults) {
    std::optional<Outcome> outcome;
    frames = 0;
    while (!(outcome = client.take())) {
      if (!pass_one(faults)) {
        if (when_quiet) {
          when_quiet();
        }
        now = std::max(now, earlier(client.next_wake(), server.next_wake()));
        if (now == kNever) {
          ADD_FAILURE() << "both sides wait endlessly";
          return {};
        }
        server.advance(now, to_client);
        client.advance(now, to_server);
      }
    }
    return *outcome;
  }
  // Applies the fault to the frame with the number faulty.
  Outcome run(Fault fault = Fault::none, int faulty = -1) {
    return run([fault, faulty](const can::Frame& /*frame*/, int number) {
      return number == faulty ? fault : Fault::none;
    });
  }

  // Delivers the remaining frames, and waits until all time-outs have expired.
  void settle() {
    pass_all();
    now += 10s;
    client.advance(now, to_server);
    server.advance(now, to_client);
    pass_all();
    EXPECT_FALSE(server.busy());
    EXPECT_FALSE(client.busy());
  }

  void read(od::Address address, TransferOptions options = {}) {
    client.read(address, kTimeout, now, to_server, options);
  }
  void write(od::Address address, std::vector<std::byte> data, TransferOptions options = {}) {
    client.write(address, std::move(data), kTimeout, now, to_server, options);
  }

  // Processes a request that arrives at the server.
  virtual void serve(const can::Frame& request) { server.receive(request, to_client); }

  static constexpr Duration kTimeout = std::chrono::milliseconds(500);

  od::Dictionary dictionary{device()};
  EventLog events;
  can::TransmitQueue to_server{8};
  can::TransmitQueue to_client{8};
  Server server{dictionary, can::CobId{kRequestId}, can::CobId{kResponseId}, events};
  Client client{can::CobId{kRequestId}};
  Instant now = at(1s);
  int frames = 0;
  std::function<void()> when_quiet;  // called when both sides wait, before the time advances

 private:
  template <class Receive>
  bool pass(can::TransmitQueue& from, const Faults& faults, Receive receive) {
    can::Frame next;
    if (!from.pop_rest(next)) {
      return false;
    }
    now += 100us;
    next.time = now;
    const Fault happens = faults(next, frames++);
    if (happens == Fault::shorten) {
      next.length = 7;
    }
    if (happens != Fault::lose) {
      receive(next);
    }
    if (happens == Fault::repeat) {
      receive(next);
    }
    return true;
  }

  bool pass_one(const Faults& faults) {
    return pass(to_server, faults, [this](const can::Frame& f) { serve(f); }) ||
           pass(to_client, faults, [this](const can::Frame& f) { client.receive(f, to_server); });
  }

  void pass_all() {
    while (pass_one([](const can::Frame&, int) { return Fault::none; })) {
    }
  }
};

}  // namespace linegate::sdo::test
