// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/boot_event.h"

namespace linegate::manager {
namespace {

constexpr bool is_same_cause(event::BootCause cause, BootFinding::Kind kind) {
  return static_cast<unsigned>(cause) == static_cast<unsigned>(kind);
}
static_assert(is_same_cause(event::BootCause::none, BootFinding::Kind::none) &&
              is_same_cause(event::BootCause::abort, BootFinding::Kind::abort) &&
              is_same_cause(event::BootCause::value, BootFinding::Kind::value) &&
              is_same_cause(event::BootCause::written, BootFinding::Kind::last));

}  // namespace

Event boot_result(std::uint8_t node, char letter, const BootFinding& finding, Instant now) {
  const bool is_abort = finding.kind == BootFinding::Kind::abort;
  event::BootResult result{.letter = letter};
  if (finding.kind != BootFinding::Kind::none) {
    result.cause = static_cast<event::BootCause>(finding.kind);
    result.index = finding.object.index;
    result.sub = finding.object.sub;
    result.abort = is_abort ? finding.abort : AbortCode::none;
    result.found = is_abort ? 0 : finding.found;
    result.expected = finding.expected;
  }
  return {.time = now, .node = node, .data = result};
}

BootFinding finding_of(const event::BootResult& result) {
  return {.kind = static_cast<BootFinding::Kind>(result.cause),
          .object = {result.index, result.sub},
          .abort = result.abort,
          .expected = result.expected,
          .found = result.found};
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
