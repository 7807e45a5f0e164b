// SPDX-License-Identifier: Apache-2.0
#include "stack/base/byte_order.h"
#include "stack/manager/boot_report.h"

namespace linegate::manager {
namespace {

constexpr std::uint8_t kLength = 8;

}  // namespace

Event boot_result(std::uint8_t node, char letter, const BootFinding& finding, Instant now) {
  Event event{.time = now, .kind = EventKind::boot_result, .node = node};
  event.code = static_cast<std::uint8_t>(letter);
  if (finding.kind == BootFinding::Kind::none) {
    return event;
  }
  event.length = kLength;
  event.value = finding.kind == BootFinding::Kind::abort ? static_cast<std::uint32_t>(finding.abort)
                                                         : finding.found;
  store_le(event.data.data(), finding.object.index);
  event.data[2] = std::byte{finding.object.sub};
  event.data[3] = static_cast<std::byte>(finding.kind);
  store_le(event.data.data() + 4, finding.expected);
  return event;
}

BootFinding finding_of(const Event& event) {
  BootFinding out;
  const auto kind = static_cast<BootFinding::Kind>(event.data[3]);
  if (event.length < kLength || kind == BootFinding::Kind::none || kind > BootFinding::Kind::last) {
    return out;
  }
  out.kind = kind;
  out.expected = load_le<std::uint32_t>(event.data.data() + 4);
  out.object = {load_le<std::uint16_t>(event.data.data()),
                std::to_integer<std::uint8_t>(event.data[2])};
  if (kind == BootFinding::Kind::abort) {
    out.abort = static_cast<AbortCode>(event.value);
  } else if (kind == BootFinding::Kind::value) {
    out.found = event.value;
  }
  return out;
}

bool is_communication_error(AbortCode abort) {
  return abort == AbortCode::timeout || abort == AbortCode::toggle_bit ||
         abort == AbortCode::command_specifier || abort == AbortCode::block_size ||
         abort == AbortCode::sequence_number || abort == AbortCode::crc;
}

bool is_refusal(const BootFinding& finding) {
  return finding.kind == BootFinding::Kind::abort &&
         (!is_communication_error(finding.abort) || finding.expected != 0);
}

}  // namespace linegate::manager
