// SPDX-License-Identifier: Apache-2.0
// An arbiter and an owner of requests; the test simulates the servers.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "stack/can/dispatch.h"
#include "stack/sdo/arbiter.h"

#include "tests/stack/sdo/support.h"

namespace linegate::sdo::test {

// Records completed requests; its destructor disowns its requests.
class Requester final : public TransferOwner {
 public:
  explicit Requester(Arbiter& arbiter) : arbiter_(arbiter) {}
  ~Requester() override { arbiter_.disown(*this); }

  void completed(Completion& completion, Instant /*now*/) override {
    done_.push_back(std::move(completion));
    if (on_completed) {
      on_completed(done_.back());
    }
  }
  std::vector<Completion> take() { return std::exchange(done_, {}); }

  std::function<void(const Completion&)> on_completed;

 private:
  Arbiter& arbiter_;
  std::vector<Completion> done_;
};

class ArbiterTest : public testing::Test {
 protected:
  bool submit(std::uint64_t number, Priority priority = Priority::command, std::uint8_t node = 5) {
    return arbiter.submit({.owner = &client,
                           .number = number,
                           .node = node,
                           .address = {0x1018, 1},
                           .timeout = kTimeout,
                           .priority = priority},
                          now);
  }

  // Passes the frame to the channel that registered the identifier, as the line does.
  void receive(std::uint32_t id, const Bytes& data) {
    const can::Frame in = frame(id, data, now);
    for (const can::Target* target = dispatch.find(in); target != nullptr;
         target = dispatch.next(*target)) {
      ASSERT_EQ(target->service, can::Service::sdo_client);
      arbiter.receive(*target, in);
    }
  }
  void answer(std::uint8_t node = 5, const Bytes& data = {0x43, 0x18, 0x10, 1, 1, 2, 3, 4}) {
    receive(0x580U + node, data);
  }
  // Sends the request, and the response of the server.
  void serve(const Bytes& data = {0x43, 0x18, 0x10, 1, 1, 2, 3, 4}) {
    drain(queue, 0x605);
    answer(5, data);
  }

  std::vector<Completion> completions() {
    arbiter.deliver_completions(now);
    return client.take();
  }
  std::vector<std::uint64_t> ended() {
    std::vector<std::uint64_t> out;
    for (const Completion& completion : completions()) {
      out.push_back(completion.number);
    }
    return out;
  }

  static constexpr Duration kTimeout = std::chrono::milliseconds(500);
  const Bytes kRead{0x40, 0x18, 0x10, 1, 0, 0, 0, 0};

  can::Dispatch dispatch;
  can::TransmitQueue queue{256};
  EventLog events;
  Arbiter arbiter{dispatch, queue, events};
  Requester client{arbiter};
  Instant now = at(1s);
};

}  // namespace linegate::sdo::test
