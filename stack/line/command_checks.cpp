// SPDX-License-Identifier: Apache-2.0
#include "stack/line/command_checks.h"

#include <cstdint>
#include <span>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/line/own_objects.h"

namespace linegate::line {

Error check_single_output(const SingleOutput& request, const image::Layout& layout,
                          const Outputs& outputs) {
  if (request.entry >= layout.entries.size()) {
    return to_error(Refusal::unknown_entry);
  }
  if (outputs.is_bound(request.entry)) {
    return to_error(Refusal::bound_entry);
  }
  const std::size_t size = (layout.entries[request.entry].bit_length + 7U) / 8U;
  if (request.data.size() != size) {
    return to_error(Refusal::bad_request);
  }
  return outputs.fired_group(request.entry) == nullptr ? Error{} : to_error(Refusal::wrong_state);
}

ReplyData fired_group_of(std::uint32_t entry, const Outputs& outputs) {
  const Outputs::Group* const fired = outputs.fired_group(entry);
  if (fired == nullptr) {
    return {};
  }
  std::vector<std::byte> out(sizeof fired->config.number);
  store_le(std::span(out), fired->config.number);
  return out;
}

Error check_emcy(nmt::State state) {
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

Error read_object(od::Dictionary& dictionary, const std::variant<od::Address, ObjectRange>& what,
                  ReplyData& data) {
  if (const auto* const range = std::get_if<ObjectRange>(&what)) {
    data = list_objects(dictionary, *range);
    return {};
  }
  const Result<std::span<const std::byte>> value = dictionary.read(std::get<od::Address>(what));
  if (!value) {
    return value.error();
  }
  data = std::vector<std::byte>(value->begin(), value->end());
  return {};
}

}  // namespace linegate::line
