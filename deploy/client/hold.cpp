// SPDX-License-Identifier: Apache-2.0
// Reads two inputs, holds one output and sends one command, whatever becomes of the gateway.
#include <cstdio>

#include <linegate/client.h>

using namespace linegate::client;

int main() {
  Client client(Options{.domain = 0});
  const Line press = client.line("press");
  const auto values = press.on_change(
      {"angle.Position value", "panel.Read input bit.Input 1"}, [](const Snapshot& now) {
        for (const Value& value : now.values)
          std::printf("%s = %s, %s\n", value.name.c_str(), value.text().c_str(),
                      describe(value.quality).data());
      });
  Group lamps = press.group("lamps");
  const auto states =
      lamps.on_state([](const Group& now) { std::printf("lamps: %s\n", now.text().c_str()); });
  const auto lines = client.on_line([](const Change& now) {
    std::printf("%s: %s\n", now.line.c_str(), describe(now.status).data());
  });
  std::chrono::steady_clock::time_point next;
  for (; client.poll(std::chrono::milliseconds(100)); std::fflush(stdout)) {
    const auto now = std::chrono::steady_clock::now();
    if (!press.ready() || (lamps.state() != GroupState::idle && !lamps.lost()) || now < next)
      continue;
    // At the start and after each loss this application decides to hold the lamps again.
    next = now + std::chrono::seconds(1);
    if (lamps.set("panel.Write output 8-bit.Outputs 1 to 8", 5) != Error::none ||
        lamps.arm() != Error::none)  // the line is not ready
      continue;
    press.sdo_read(8, 0x1018, 1).on_done([](const Call& done) {
      std::printf("vendor: %llu %s\n", static_cast<unsigned long long>(done.number()),
                  done.text().c_str());
    });
  }
  std::fprintf(stderr, "%s\n", client.error().c_str());
}
