// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/scan.h"

#include <algorithm>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "stack/base/byte_order.h"

namespace linegate::console {
namespace {

void set(scan::ScannedNode& node, od::Address address, std::uint64_t value, std::size_t size) {
  std::vector<std::byte> data(size);
  store_le(std::span(data), value);
  node.values.push_back({address, data});
}

// Two modules that send on the same identifier. The first has its analogue inputs disabled; the
// second stopped answering.
ScanResult troubled() {
  ScanResult out;
  out.id = {"plant", "press"};
  scan::ScannedNode first{.id = 3};
  set(first, {0x1000, 0}, 0x0004'0191, 4);
  set(first, {0x1008, 0}, 0x4142, 2);
  set(first, {0x1017, 0}, 250, 2);
  set(first, {0x1018, 1}, 0x4C47, 4);
  set(first, {0x1800, 0}, 2, 1);
  set(first, {0x1800, 1}, 0x183, 4);
  set(first, {0x1801, 0}, 2, 1);
  set(first, {0x1801, 1}, 0x8000'0283, 4);
  set(first, {0x1A00, 0}, 1, 1);
  set(first, {0x1A00, 1}, 0x6401'0110, 4);
  set(first, {0x6423, 0}, 0, 1);
  scan::ScannedNode second{.id = 4, .end = AbortCode::timeout};
  set(second, {0x1000, 0}, 0x0004'0191, 4);
  set(second, {0x1401, 1}, 0x183, 4);
  set(second, {0x1800, 0}, 2, 1);
  set(second, {0x1800, 1}, 0x4000'0183, 4);
  out.nodes = {first, second};
  return out;
}

bool any_note(const Table& table, const std::string& part) {
  return std::ranges::any_of(
      table.notes, [&](const Note& note) { return note.text.find(part) != std::string::npos; });
}

TEST(ScanTable, ShowsIdentityPdosAndErrorControlOfEachNode) {
  const Table table = scan_table(troubled());
  ASSERT_EQ(table.rows.size(), 2U);
  EXPECT_EQ(table.rows[0].cells[1].text, "BA");
  EXPECT_EQ(table.rows[0].cells[2].text, "00040191");
  EXPECT_EQ(table.rows[0].cells[7].text, "1") << "TPDO 2 is disabled";
  EXPECT_EQ(table.rows[0].cells[9].text, "heartbeat 250 ms");
  EXPECT_EQ(table.rows[1].cells[3].text, "-") << "not read";
}

TEST(ScanTable, SaysWhatWillNotWorkAsItIs) {
  const Table table = scan_table(troubled());
  EXPECT_TRUE(any_note(table, "183h is sent by node 3 (1800:01) and by node 4 (1800:01)"));
  EXPECT_TRUE(
      any_note(table, "node 4: RPDO 2 is never sent to, its identifier 183h is sent by node 3"));
  EXPECT_TRUE(any_note(table, "node 3: 6423h is false"));
  EXPECT_TRUE(any_note(table, "node 4: read until it ended with 05040000h"));
  EXPECT_TRUE(any_note(table, "node 4: no heartbeat and no guarding"));
  EXPECT_FALSE(any_note(table, "node 3: no heartbeat"));
  EXPECT_TRUE(any_note(scan_table({}), "no device answered"));
}

TEST(ScanJson, HasEachPdoWithItsMapping) {
  const auto json = nlohmann::json::parse(scan_json(troubled()));
  EXPECT_EQ(json["line"], "press");
  const auto& pdo = json["nodes"][0]["pdos"][0];
  EXPECT_EQ(pdo["cob_id"], 0x183);
  EXPECT_EQ(pdo["mapping"][0]["object"], "6401:01");
  EXPECT_EQ(pdo["mapping"][0]["bits"], 16);
  EXPECT_EQ(json["nodes"][0]["pdos"][1]["valid"], false);
  EXPECT_EQ(json["nodes"][1]["complete"], false);
  EXPECT_EQ(json["conflicts"].size(), 1U);
}

}  // namespace
}  // namespace linegate::console
