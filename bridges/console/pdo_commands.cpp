// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/pdo_commands.h"

#include <ostream>

#include "bridges/console/answer.h"
#include "bridges/console/lookup.h"
#include "bridges/console/refusal_text.h"
#include "bridges/console/value_text.h"
#include "stack/pdo/parameters.h"

namespace linegate::console {
namespace {

int wrong_usage(Context& context, const std::string& what) {
  context.err << "usage: " << what << '\n';
  return kUsage;
}

// The number after "tpdo" or "rpdo"; 0 if it is malformed.
std::uint16_t pdo_number(const std::string& text, const std::string& kind) {
  if (!text.starts_with(kind)) {
    return 0;
  }
  const auto number = parse_number(text.substr(kind.size()), pdo::kMaxPdo, false);
  return static_cast<std::uint16_t>(number.value_or(0));
}

std::string why_not_requested(const line::PdoRequest& request, line::Refusal refusal) {
  const std::string pdo = (request.node == 0 ? "RPDO " : "TPDO ") + std::to_string(request.number);
  switch (refusal) {
    case line::Refusal::bad_request:
      return pdo +
             " cannot be requested: bit 30 of its COB-ID does not allow RTR (plant.yaml: "
             "rtr: true)";
    case line::Refusal::unknown_entry:
      return "the line receives no " + pdo +
             (request.node == 0 ? "" : " of node " + std::to_string(request.node));
    case line::Refusal::timed_out:
      return pdo + " was not received in time";
    case line::Refusal::wrong_state:
      return "the own node is not Operational";
    default:
      return {};
  }
}

}  // namespace

int pdo_request(Context& context, const std::string& what) {
  const std::size_t colon = what.rfind(':');
  const std::string of = colon == std::string::npos ? "" : what.substr(0, colon);
  const std::string pdo = colon == std::string::npos ? "" : what.substr(colon + 1);
  auto ref = parse_node(of);
  const std::uint16_t number =
      ref && !ref->all ? pdo_number(pdo, ref->own ? "rpdo" : "tpdo") : std::uint16_t{0};
  if (number == 0) {
    return wrong_usage(context, "'" + what + "' is not LINE:NODE:tpdoN or LINE:own:rpdoN");
  }
  return on_line(context, ref->line, [&](Model& model, const Line& line) {
    if (!resolve_node(context, model, line, *ref)) {
      return kFailed;
    }
    const line::PdoRequest request{.node = ref->own ? std::uint8_t{0} : ref->node,
                                   .number = number};
    Client::Answer answer =
        ask_line(context, model, line, {.timeout = context.timeout, .request = request});
    if (answer.reply.error.domain == Domain::command) {
      const std::string why =
          why_not_requested(request, static_cast<line::Refusal>(answer.reply.error.code));
      answer.text += why.empty() ? "" : ": " + why;
    }
    return print_answer(context, answer);
  });
}

int mpdo_write(Context& context, const std::string& node, const std::vector<std::string>& words) {
  constexpr std::size_t kMostBytes = 4;
  const auto split = split_object(words, 2, 2);
  auto ref = parse_node(node);
  if (!split || !ref || ref->own) {
    return wrong_usage(context,
                       "pdo mpdo LINE:NODE INDEX:SUB TYPE VALUE, NODE: 1..127, a name or all");
  }
  const auto object = parse_object(context, split->index, split->sub);
  const auto type = type_from_name(split->rest[0]);
  auto data = type ? from_text(*type, split->rest[1]) : std::nullopt;
  if (!object) {
    return kUsage;
  }
  if (!data || data->empty() || data->size() > kMostBytes) {
    return wrong_usage(context, "'" + split->rest[1] + "' is not a value of " + split->rest[0] +
                                    " with 1 to 4 bytes");
  }
  line::MpdoWrite write{.address = *object, .data = *std::move(data)};
  return on_line(context, ref->line, [&](Model& model, const Line& line) {
    if (!ref->all && !resolve_node(context, model, line, *ref)) {
      return kFailed;
    }
    write.node = ref->all ? std::uint8_t{0} : ref->node;
    Client::Answer answer = ask_line(context, model, line, {.request = write});
    if (answer.reply.error == line::to_error(line::Refusal::unknown_entry)) {
      answer.text +=
          ": the own node has no TPDO in destination address mode (plant.yaml: own_pdos: {tpdoN: "
          "{mpdo: destination}})";
    }
    const auto* const by = std::get_if<line::SentByMpdo>(&answer.reply.data);
    return print_answer(context, answer,
                        by == nullptr ? "" : "by TPDO " + std::to_string(by->tpdo) + ", sent");
  });
}

}  // namespace linegate::console
