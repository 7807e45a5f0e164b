// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/boot_text.h"

#include <string>

#include <gtest/gtest.h>

#include "gateway/publish/event_text.h"
#include "stack/manager/boot_event.h"

namespace linegate::gateway {
namespace {

using manager::BootFinding;

std::string text_of(const std::vector<Property>& properties) {
  std::string out;
  for (const Property& property : properties) {
    out += property.name + "=" + property.value + "\n";
  }
  return out;
}

BootFinding wrong_product() {
  return {.kind = BootFinding::Kind::value,
          .object = {0x1018, 2},
          .abort = AbortCode::none,
          .expected = 7,
          .found = 8};
}

BootFinding refused_object() {
  return {.kind = BootFinding::Kind::abort,
          .object = {0x1017, 0},
          .abort = AbortCode::no_object,
          .expected = 0,
          .found = 0};
}

TEST(BootText, ABootedNodeHasNoProperties) {
  line::NodeState state;
  EXPECT_TRUE(boot_properties(state).empty()) << "its boot process has not ended";
  state.boot = manager::kBooted;
  EXPECT_TRUE(boot_properties(state).empty());
}

TEST(BootText, AValueThatIsNotTheExpectedOne) {
  line::NodeState state;
  state.boot = 'M';
  state.finding = wrong_product();
  EXPECT_EQ(text_of(boot_properties(state)),
            "boot-letter=M\n"
            "boot-text=product code differs from the expected one: 1018:02 is 00000008h, not "
            "00000007h\n"
            "boot-object=1018:02\n"
            "boot-expected=00000007\n"
            "boot-found=00000008\n");
}

TEST(BootText, ATransferThatWasAborted) {
  line::NodeState state;
  state.boot = 'J';
  state.finding = refused_object();
  const std::string text = text_of(boot_properties(state));
  EXPECT_NE(text.find("boot-object=1017:00\nboot-abort=06020000\n"), std::string::npos) << text;
}

TEST(BootText, ALetterAlone) {
  line::NodeState state;
  state.boot = 'K';
  EXPECT_EQ(text_of(boot_properties(state)),
            "boot-letter=K\nboot-text=" + std::string(line::describe_boot('K')) + "\n");
}

TEST(BootText, TheEventSaysTheSame) {
  const line::LineConfig line;
  EXPECT_EQ(describe(manager::boot_result(5, 'M', wrong_product(), {}), line, ""),
            "node 5: boot failed (M): product code differs from the expected one: 1018:02 is "
            "00000008h, not 00000007h");
  EXPECT_EQ(describe(manager::boot_result(5, 'L', {}, {}), line, ""),
            "node 5: booted (L): node was already operational");
  EXPECT_EQ(describe(manager::boot_result(5, '\0', {}, {}), line, ""), "node 5: booted");
}

}  // namespace
}  // namespace linegate::gateway
