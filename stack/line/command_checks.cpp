// SPDX-License-Identifier: Apache-2.0
#include "stack/line/command_checks.h"

#include <cstdint>
#include <span>

#include "stack/can/cob_id.h"
#include "stack/line/own_objects.h"

namespace linegate::line {
namespace {

constexpr std::size_t kMostInfo = 5;  // manufacturer bytes of an EMCY

}  // namespace

Error check_single_output(const Command& command, const image::Layout& layout,
                          const Outputs& outputs) {
  if (command.entry >= layout.entries.size()) {
    return to_error(Refusal::unknown_entry);
  }
  if (outputs.is_bound(command.entry)) {
    return to_error(Refusal::bound_entry);
  }
  const std::size_t size = (layout.entries[command.entry].bit_length + 7U) / 8U;
  return command.data.size() == size ? Error{} : to_error(Refusal::bad_request);
}

Error check_emcy(const Command& command, nmt::State state) {
  if (command.data.size() > kMostInfo) {
    return to_error(Refusal::bad_request);
  }
  const bool able = state != nmt::State::stopped && state != nmt::State::initialising;
  return able ? Error{} : to_error(Refusal::wrong_state);
}

Error to_error(emcy::SendResult result) {
  switch (result) {
    case emcy::SendResult::sent:
    case emcy::SendResult::queued:
      return {};
    case emcy::SendResult::inhibited:
      return to_error(Refusal::inhibited);
    case emcy::SendResult::disabled:
    case emcy::SendResult::errors_remain:
      return to_error(Refusal::wrong_state);
  }
  return to_error(Refusal::busy);
}

Error check_nmt(nmt::Command command, std::uint8_t node) {
  const bool known = node <= can::kMaxNodeId && nmt::is_command(static_cast<std::uint8_t>(command));
  return known ? Error{} : to_error(Refusal::bad_request);
}

std::uint16_t last_of_list(const Command& command) {
  const bool to_end = command.entry == 0 || command.entry > 0xFFFF;
  return to_end ? std::uint16_t{0xFFFF} : static_cast<std::uint16_t>(command.entry);
}

Error read_object(od::Dictionary& dictionary, const Command& command,
                  std::vector<std::byte>& data) {
  if ((command.code & kListObjects) != 0) {
    data = list_objects(dictionary, command.index, last_of_list(command));
    return {};
  }
  const Result<std::span<const std::byte>> value = dictionary.read({command.index, command.sub});
  if (!value) {
    return value.error();
  }
  data.assign(value->begin(), value->end());
  return {};
}

}  // namespace linegate::line
