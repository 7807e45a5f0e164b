// SPDX-License-Identifier: Apache-2.0
// A CANopen manager: boots, configures and starts one node, reads its inputs, writes its outputs.
#include <cstdio>

#include "stack/line/line.h"
#include "stack/node/node.h"
#include "stack/od/objects.h"
#include "stack/profile/io_device.h"

using namespace linegate;
using namespace std::chrono_literals;

constexpr std::uint8_t kNode = 5;

// A bus in memory: what one sends the other receives. A driver takes the place of the device here.
static void run(line::Line& line, node::Node& device, Instant& now, Duration time) {
  const Instant end = now + time;
  while (now < end) {
    line.advance(now);
    device.advance(now);
    can::Frame frame;
    while (line.next_frame(frame, now)) {
      frame.time = now;
      device.receive({&frame, 1});
    }
    while (device.next_frame(frame, now)) {
      frame.time = now;
      line.receive({&frame, 1}, now);
    }
    Event event;
    while (line.pop_events({&event, 1}) != 0) {
      std::printf("%-13s node %u", name(event.kind()).data(), event.node);
      if (const auto* own = event.get<event::OwnState>()) {
        std::printf(" %s", name(own->state).data());
      } else if (const auto* manager = event.get<event::ManagerState>()) {
        std::printf(" %s", name(manager->state).data());
      }
      std::printf("\n");
    }
    now += 1ms;
  }
}

int main() {
  const od::DeviceDescription panel =
      profile::make_io_device({.digital_inputs = 1, .digital_outputs = 1}, "Panel", kNode);
  EventLog log;
  node::Node device(od::Dictionary(panel), {.node_id = kNode, .auto_notify = true}, log, nullptr);

  line::LineConfig config;
  config.name = "machine";
  config.nodes.push_back({.id = kNode, .name = "panel", .device = panel, .heartbeat = 100ms});
  const auto made = line::Line::make(std::move(config));
  for (const Diagnostic& diagnostic : made.diagnostics) {
    std::printf("%s\n", to_string(diagnostic).c_str());
  }
  if (!made.ok()) {
    return 1;
  }
  line::Line& line = **made.value;
  Instant now{};
  device.start(now);
  line.start(now);
  run(line, device, now, 3s);

  device.dictionary().set({od::objects::cia401::kDigitalInputs, 1}, 0x81);
  line::OutputWrite write{.layout_id = line.layout(image::Direction::outputs).id};
  write.values.push_back({.entry = 0, .length = 1, .data = {std::byte{0x0F}}});
  line.write_outputs(write, now);
  run(line, device, now, 100ms);
  const auto outputs = device.dictionary().number({od::objects::cia401::kDigitalOutputs, 1});
  std::printf("inputs %02X, outputs %02X\n", static_cast<unsigned>(line.input(0).value),
              static_cast<unsigned>(outputs.value_or(0)));
  return line.node_state(kNode).state == nmt::State::operational ? 0 : 1;
}
