// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/boot_text.h"

#include <string>

#include <fmt/format.h>

#include "stack/od/description.h"

namespace linegate::gateway {

std::vector<Property> boot_properties(const line::NodeState& state) {
  using Kind = manager::BootFinding::Kind;
  const manager::BootFinding& finding = state.finding;
  std::vector<Property> out;
  if (state.boot == manager::kBooted || state.boot == manager::kBootUnfinished) {
    return out;
  }
  out.push_back({"boot-letter", std::string(1, state.boot)});
  out.push_back({"boot-text", manager::describe_boot(state.boot, finding)});
  if (finding.kind != Kind::none) {
    out.push_back({"boot-object", od::to_text(finding.object)});
  }
  if (finding.kind == Kind::abort) {
    out.push_back({"boot-abort", fmt::format("{:08X}", static_cast<std::uint32_t>(finding.abort))});
  }
  if (finding.kind == Kind::value) {
    out.push_back({"boot-expected", fmt::format("{:08X}", finding.expected)});
    out.push_back({"boot-found", fmt::format("{:08X}", finding.found)});
  }
  return out;
}

}  // namespace linegate::gateway
