// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/boot_report.h"

#include "stack/base/byte_order.h"

namespace linegate::manager {
namespace {

constexpr std::size_t kOutcomeBytes = 18;

}  // namespace

std::vector<std::byte> write_boot_report(std::span<const BootOutcome> outcomes) {
  std::vector<std::byte> out(outcomes.size() * kOutcomeBytes);
  std::byte* at = out.data();
  for (const BootOutcome& outcome : outcomes) {
    at[0] = std::byte{outcome.node};
    at[1] = static_cast<std::byte>(outcome.letter);
    store_le(at + 2, outcome.finding.object.index);
    at[4] = std::byte{outcome.finding.object.sub};
    at[5] = static_cast<std::byte>(outcome.finding.kind);
    store_le(at + 6, static_cast<std::uint32_t>(outcome.finding.abort));
    store_le(at + 10, outcome.finding.expected);
    store_le(at + 14, outcome.finding.found);
    at += kOutcomeBytes;
  }
  return out;
}

Result<std::vector<BootOutcome>> read_boot_report(std::span<const std::byte> data) {
  if (data.size() % kOutcomeBytes != 0) {
    return to_error(AbortCode::length_mismatch);
  }
  std::vector<BootOutcome> out;
  for (; !data.empty(); data = data.subspan(kOutcomeBytes)) {
    const std::byte* const at = data.data();
    BootOutcome outcome{.node = std::to_integer<std::uint8_t>(at[0]),
                        .letter = static_cast<char>(at[1])};
    outcome.finding.object = {load_le<std::uint16_t>(at + 2), std::to_integer<std::uint8_t>(at[4])};
    const auto kind = static_cast<BootFinding::Kind>(at[5]);
    outcome.finding.kind = kind <= BootFinding::Kind::last ? kind : BootFinding::Kind::none;
    outcome.finding.abort = static_cast<AbortCode>(load_le<std::uint32_t>(at + 6));
    outcome.finding.expected = load_le<std::uint32_t>(at + 10);
    outcome.finding.found = load_le<std::uint32_t>(at + 14);
    out.push_back(outcome);
  }
  return out;
}

}  // namespace linegate::manager
