// SPDX-License-Identifier: Apache-2.0
// A CANopen device: eight digital inputs (CiA 401), sent in TPDO 1 whenever they change.
#include <cstdio>

#include "stack/node/node.h"
#include "stack/od/objects.h"
#include "stack/profile/io_device.h"

using namespace linegate;
using namespace std::chrono_literals;

constexpr std::uint8_t kNode = 5;
constexpr od::Address kInputs{od::objects::cia401::kDigitalInputs, 1};

// Prints the frames of the node until then. A driver sends them, and gives node.receive() those of
// the bus.
static void run(node::Node& node, Instant from, Duration time) {
  for (Instant now = from; now <= from + time; now = std::max(now + 1ms, node.next_wake())) {
    node.advance(now);
    for (can::Frame frame; node.next_frame(frame, now);) {
      std::printf("%4.1f s  %03X ", std::chrono::duration<double>(now.time_since_epoch()).count(),
                  frame.id);
      for (const std::byte byte : frame.bytes()) {
        std::printf(" %02X", std::to_integer<unsigned>(byte));
      }
      std::printf("\n");
    }
  }
}

int main() {
  EventLog events;
  od::Dictionary dictionary(profile::make_io_device({.digital_inputs = 1}, "Switches", kNode));
  node::Node node(std::move(dictionary), {.node_id = kNode, .auto_notify = true}, events, nullptr);
  node.start(Instant{});  // power-on: the boot-up message
  run(node, Instant{}, 1s);
  can::Frame start = can::make_frame(0, {0x01, kNode});  // what an NMT master sends
  start.time = Instant{1s};
  node.receive({&start, 1});
  for (const unsigned second : {1U, 2U, 3U}) {
    node.dictionary().set(kInputs, second);
    run(node, Instant{second * 1s}, 900ms);
  }
  return node.state() == nmt::State::operational ? 0 : 1;
}
