// SPDX-License-Identifier: Apache-2.0
// The input is a whole nodelist.cpj. Promises: no crash, an error never comes with a list, and a
// list is in order.
#include "stack/eds/node_list.h"

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "tests/fuzz/expect.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto loaded = linegate::eds::read_node_list(text, "fuzz.cpj");
  LINEGATE_EXPECT(loaded.ok() == !linegate::has_errors(loaded.diagnostics));
  if (!loaded.ok()) {
    return 0;
  }
  LINEGATE_EXPECT(!loaded.value->networks.empty());
  for (const auto& network : loaded.value->networks) {
    std::uint8_t last = 0;
    for (const auto& node : network.nodes) {
      LINEGATE_EXPECT(node.id > last && node.id <= 127);
      last = node.id;
    }
  }
  return 0;
}
