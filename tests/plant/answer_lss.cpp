// SPDX-License-Identifier: Apache-2.0
// The LSS part of the answer model.
#include <algorithm>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/lss/message.h"
#include "stack/lss/procedure.h"

#include "tests/plant/answer_model.h"

namespace linegate::plant {
namespace {

using lss::Procedure;

Procedure procedure_of(const line::Command& command) {
  return std::get<line::LssRequest>(command.request).procedure;
}

// The last response of the service; switch_global: the service has no response, or its response is
// not checked.
lss::Command answer_of(Procedure procedure) {
  switch (procedure) {
    case Procedure::switch_selective:
      return lss::Command::selected;
    case Procedure::configure_node_id:
      return lss::Command::configure_node_id;
    case Procedure::configure_bit_timing:
      return lss::Command::configure_bit_timing;
    case Procedure::store:
      return lss::Command::store;
    case Procedure::inquire_address:
      return lss::Command::inquire_serial;
    case Procedure::inquire_node_id:
      return lss::Command::inquire_node_id;
    case Procedure::identify:
    case Procedure::fastscan:
      return lss::Command::identified;
    case Procedure::identify_unconfigured:
      return lss::Command::unconfigured;
    default:
      return lss::Command::switch_global;
  }
}

bool has_error(Procedure procedure) {
  return procedure == Procedure::configure_node_id || procedure == Procedure::store ||
         procedure == Procedure::configure_bit_timing;
}

}  // namespace

bool AnswerModel::is_lss_frame_of(const Given& given, const can::Frame& frame) {
  const auto& data = std::get<line::LssRequest>(given.command.request).arguments;
  const std::uint64_t argument =
      load_le(std::span(data).first(std::min<std::size_t>(data.size(), 4)));
  const bool global = procedure_of(given.command) == Procedure::switch_global;
  const lss::Message message{
      .command = global ? lss::Command::switch_global : lss::Command::activate_bit_timing,
      .number = static_cast<std::uint32_t>(argument)};
  return can::same_content(frame, lss::encode(lss::kMasterId, message));
}

// Clause 9.
std::string AnswerModel::check_lss(const Given& given, const line::Reply& reply) {
  const Procedure procedure = procedure_of(given.command);
  if (procedure == Procedure::switch_global || procedure == Procedure::activate_bit_timing) {
    return check_sent(given);
  }
  const lss::Command wanted = answer_of(procedure);
  const auto outcome = static_cast<lss::Outcome>(reply.bytes().front());
  const bool refused = outcome == lss::Outcome::refused;
  if (wanted == lss::Command::switch_global || (outcome != lss::Outcome::done && !refused)) {
    return {};
  }
  const auto it = lss_answers_.find(static_cast<std::uint8_t>(wanted));
  if (it == lss_answers_.end() || it->second.after < given.order) {
    return "no device answered";
  }
  const auto& answer = it->second.frame.data;
  const auto said = std::span(reply.bytes()).subspan(1);
  if (has_error(procedure)) {
    return answer[1] == said[0] && (!refused || answer[2] == said[1]) &&
                   refused == (answer[1] != std::byte{0})
               ? ""
               : "the answer has another error";
  }
  const auto value = std::span(reply.bytes()).subspan(lss::kReplyHead);
  const std::size_t bytes = procedure == Procedure::inquire_node_id   ? 1
                            : procedure == Procedure::inquire_address ? 4
                                                                      : 0;
  return std::equal(value.end() - static_cast<std::ptrdiff_t>(bytes), value.end(),
                    answer.begin() + 1)
             ? ""
             : "the answer has another value";
}

}  // namespace linegate::plant
