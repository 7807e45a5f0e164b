// SPDX-License-Identifier: Apache-2.0
// Compares the devices of a line with their configuration, boots those that differ, and prints the
// last errors of the line.
#include <cstdio>

#include <linegate/commands.h>

using namespace linegate::client;

int main() {
  Client client(Options{.domain = 0});
  const Commands press(client.line("press"));
  auto compared = press.compare();
  if (!compared.wait()) {
    std::fprintf(stderr, "not compared: %s\n", compared.text().c_str());
    return 1;
  }
  for (const Configuration& node : compared.result()) {
    std::printf("node %d: %zu differences\n", node.node, node.differences.size());
    if (node.ok)
      continue;
    auto booted = press.boot(node.node);
    booted.wait();
    for (const BootResult& result : booted.result())
      std::printf("node %d: %s\n", result.node, result.text.c_str());
  }
  auto errors =
      press.read_journal({.line = "press", .severity = 2, .newest_first = true, .most = 5});
  errors.wait();  // without a journal there are none
  for (const Event& error : errors.result().events)
    std::printf("%s\n", error.text.c_str());
  return 0;
}
