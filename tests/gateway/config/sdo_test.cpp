// SPDX-License-Identifier: Apache-2.0
// `sdo:` of a node.
#include <utility>

#include <gtest/gtest.h>

#include "gateway/config/plant.h"
#include "stack/sdo/client.h"

#include "tests/paths.h"

namespace linegate::config {
namespace {

TEST(SdoSection, BlockTransferOfANodeMayBeLimited) {
  const auto with = [](const std::string& block) {
    return read(
        "schema: 1\nlines:\n  - name: a\n    interface: 'virtual:x'\n    nodes:\n"
        "      - {id: 5, eds: bridges/sim/eds/drive.eds, sdo: {block: " +
            block + "}}\n",
        paths::in_repository("plant.yaml"));
  };
  for (const auto& [text, from] :
       {std::pair("4096", std::uint32_t{4096}), std::pair("never", sdo::kNoBlocks)}) {
    const auto loaded = with(text);
    ASSERT_TRUE(loaded.ok()) << to_string(loaded.diagnostics.at(0));
    EXPECT_EQ(loaded.value->lines[0].config.nodes[0].block_from, from);
  }
  for (const char* wrong : {"4", "always", "-1", "[]"}) {
    EXPECT_FALSE(with(wrong).ok()) << wrong;
  }
}

}  // namespace
}  // namespace linegate::config
