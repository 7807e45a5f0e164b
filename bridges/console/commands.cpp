// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/commands.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <optional>
#include <ostream>
#include <set>
#include <utility>

#include "bridges/console/answer.h"
#include "bridges/console/json_text.h"
#include "bridges/console/lookup.h"
#include "bridges/console/output_text.h"
#include "bridges/console/refusal_text.h"
#include "bridges/console/routes.h"
#include "bridges/console/tables.h"
#include "bridges/console/value_text.h"

namespace linegate::console {
namespace {

int usage(Context& context, const std::string& text) {
  context.err << text << '\n';
  return kUsage;
}

bool is_received(const Line* line) {
  return line->view.has_value();
}

// Whether the state of each configured node was received. A gateway publishes it even for nodes
// that were never heard, and for observers.
bool has_its_nodes(const Line* line) {
  return line->gone || (line->view && knows_nodes(*line));
}

// Waits until the lines of all gateways are received and all matching lines fulfil the condition.
// An empty name matches all lines. Returns an empty list, after an error message, if there is none.
std::vector<const Line*> find_lines(Context& context, Model& model, const std::string& line,
                                    bool (*condition)(const Line*)) {
  (void)wait_until_settled(context, model, [&] {
    const auto found = model.find(line);
    return !found.empty() && std::ranges::all_of(found, condition);
  });
  auto found = model.find(line);
  if (std::ranges::none_of(found, is_received)) {
    context.err << no_line_text(context, model, line) << '\n';
    found.clear();
  }
  return found;
}

// Whether some values may be those of another gateway of the same name, of which the model has
// warned.
bool is_mixed(const std::vector<const Line*>& lines) {
  return std::ranges::any_of(
      lines, [](const Line* line) { return line->view && Model::has_namesake(*line->view); });
}

// Reports what is missing from the printed lines, each of which should fulfil the condition.
int completeness_of(Context& context, const Model& model, const std::vector<const Line*>& lines,
                    std::string_view what, bool (*condition)(const Line*)) {
  int code = completeness(context, model);
  for (const Line* line : lines) {
    if (!condition(line)) {
      context.err << "incomplete: " << what << " of " << printable(line->id.gateway) << '/'
                  << printable(line->id.line) << '\n';
      code = kIncomplete;
    }
  }
  return is_mixed(lines) ? kIncomplete : code;
}

std::string text_of(const Client::Answer& answer) {
  const std::vector<std::byte>& text = answer.reply.bytes();
  return {reinterpret_cast<const char*>(text.data()), text.size()};
}

std::string triggered_text(const line::Reply& reply) {
  std::string out;
  if (const auto* const pdos = std::get_if<line::TriggeredPdos>(&reply.data)) {
    for (const std::uint16_t pdo : *pdos) {
      out += (out.empty() ? "PDO " : ", ") + std::to_string(pdo);
    }
  }
  return out + ", sent";
}

}  // namespace

int lines(Context& context) {
  Model model;
  const auto found = find_lines(context, model, "", is_received);
  if (found.empty()) {
    return kFailed;
  }
  if (context.json) {
    context.out << lines_json(model, found) << '\n';
  } else {
    print(context.out, text_of(lines_of(model, {})));
  }
  const int code = completeness(context, model);
  return is_mixed(found) ? kIncomplete : code;
}

int nodes(Context& context, const std::string& line) {
  Model model;
  const auto found = find_lines(context, model, line, has_its_nodes);
  if (found.empty()) {
    return kFailed;
  }
  if (context.json) {
    context.out << nodes_json(found) << '\n';
  } else {
    print(context.out, text_of(nodes_of(model, {.line = line}, stamp_of(context))));
  }
  return completeness_of(context, model, found, "nodes", has_its_nodes);
}

int routes(Context& context) {
  Model model;
  if (find_lines(context, model, "", is_received).empty()) {
    return kFailed;
  }
  if (context.json) {
    context.out << routes_json(model) << '\n';
    return completeness(context, model);
  }
  const Table table = routes_table(model);
  if (table.rows.empty()) {
    context.out << "nothing is routed\n";
    return completeness(context, model);
  }
  print(context.out, text_of(table));
  context.out << '\n';
  print(context.out, text_of(routing_table(model)));
  return completeness(context, model);
}

int image(Context& context, const std::string& line, image::Direction direction) {
  Model model;
  const auto has_image = direction == image::Direction::inputs
                             ? [](const Line* l) { return l->gone || l->areas[0].complete(); }
                             : [](const Line* l) { return l->gone || l->areas[1].complete(); };
  const auto found = find_lines(context, model, line, has_image);
  if (found.empty()) {
    return kFailed;
  }
  if (direction == image::Direction::outputs) {
    (void)wait_until(context, model, [&] {
      return std::ranges::all_of(found, [](const Line* l) {
        return l->gone || !l->groups.empty() || l->view->state.role == line::Role::observer;
      });
    });
  }
  for (const Line* one : found) {
    if (context.json) {
      context.out << image_json(*one, direction) << '\n';
    } else {
      context.out << printable(one->id.line) << ' ' << image::name(direction) << '\n';
      print(context.out, image_table(*one, direction));
      if (direction == image::Direction::outputs) {
        print(context.out, group_texts(*one));
      }
    }
  }
  return completeness_of(context, model, found, "the image", has_image);
}

int write(Context& context, const std::string& line, const std::string& entry,
          const std::string& value, bool raw) {
  return on_line(context, line, [&](Model& model, const Line& target) {
    const Area& outputs = target.areas[static_cast<std::size_t>(image::Direction::outputs)];
    if (!wait_until(context, model, [&] { return outputs.layout.has_value(); })) {
      context.err << "the output layout of " << printable(target.id.line) << " was not received\n";
      return kFailed;
    }
    // A copy: the gateway may publish another layout before the answer arrives.
    const image::Layout layout = *outputs.layout;
    const auto number = find_entry(context, layout, entry);
    if (!number) {
      return kUsage;
    }
    const image::Entry& place = layout.entries[*number];
    TypedValue typed = typed_value(place, value, raw);
    if (!typed.error.empty()) {
      return usage(context, typed.error);
    }
    const line::SingleOutput output{.entry = *number, .data = std::move(typed.data)};
    Client::Answer answer = ask_line(context, model, target, {.request = output}, layout.id);
    add_node_state(context, model, target, place.node, answer);
    const int code = print_answer(context, answer,
                                  answer.reply.ok() ? way_text(answer.reply.data, &layout) : "");
    return code == kDone && is_held_back(answer.reply.data) ? kHeldBack : code;
  });
}

int pdo_trigger(Context& context, const std::string& what, const std::string& number,
                bool by_offset) {
  const bool of_node = what.find(':') != std::string::npos;
  auto ref = of_node ? parse_node(what) : std::optional(NodeRef{.line = what});
  const auto value = parse_number(number, by_offset ? image::kMaxAreaBytes - 1 : 512, false);
  if (!ref || ref->all || ref->own || (of_node && by_offset)) {
    return usage(context,
                 "'" + what + "' is not LINE or LINE:NODE, with a node-ID 1..127 or a name");
  }
  if (!value || (*value == 0 && !by_offset)) {
    return usage(context, "'" + number + "' is no number of a PDO, 1..512, or offset in bytes");
  }
  line::PdoTrigger trigger;
  if (by_offset) {
    trigger.output_byte = static_cast<std::uint32_t>(*value);
  } else {
    trigger.number = static_cast<std::uint16_t>(*value);
  }
  return on_line(context, ref->line, [&](Model& model, const Line& line) {
    if (!resolve_node(context, model, line, *ref)) {
      return kFailed;
    }
    trigger.node = ref->node;
    Client::Answer answer = ask_line(context, model, line, {.request = trigger});
    if (answer.reply.error.domain == Domain::command) {
      const auto refusal = static_cast<line::Refusal>(answer.reply.error.code);
      const std::string why = trigger_refusal(context, model, line, trigger, refusal);
      answer.text += why.empty() ? "" : ": " + why;
    }
    return print_answer(context, answer, answer.reply.ok() ? triggered_text(answer.reply) : "");
  });
}

int nmt(Context& context, const std::string& command, const std::string& node) {
  constexpr std::pair<std::string_view, nmt::Command> kCommands[] = {
      {"start", nmt::Command::start},
      {"stop", nmt::Command::stop},
      {"pre-operational", nmt::Command::enter_pre_operational},
      {"reset-node", nmt::Command::reset_node},
      {"reset-communication", nmt::Command::reset_communication},
  };
  const auto it = std::ranges::find(kCommands, command, [](const auto& c) { return c.first; });
  auto ref = parse_node(node);
  if (it == std::end(kCommands)) {
    return usage(context, "unknown NMT command '" + command +
                              "': start, stop, pre-operational, reset-node, reset-communication");
  }
  if (!ref) {
    return usage(context,
                 "'" + node + "' is not LINE:NODE, with a node-ID 1..127, a name, own or all");
  }
  return on_line(context, ref->line, [&](Model& model, const Line& line) {
    if (!resolve_node(context, model, line, *ref)) {
      return kFailed;
    }
    const line::NmtRequest request{.node = ref->own ? line.view->state.node_id : ref->node,
                                   .command = it->second};
    const Client::Answer answer = ask_line(context, model, line, {.request = request});
    const bool sent = answer.reply.ok() && line.view->state.role == line::Role::manager &&
                      request.node != line.view->state.node_id;
    return print_answer(context, answer, sent ? "sent" : "");
  });
}

int emcy(Context& context, const std::string& sender, const std::string& code,
         const std::string& error_register, const std::string& bytes) {
  const auto number = parse_number(code, 0xFFFF, true);
  const auto reg = parse_number(error_register, 0xFF, true);
  auto data = from_text(od::DataType::octet_string, bytes);
  if (!number || !reg || !data || data->size() > 5) {
    return usage(context, "an EMCY has a code 0..FFFF, an error register 0..FF and up to 5 bytes");
  }
  line::EmcySend request{.code = static_cast<std::uint16_t>(*number),
                         .error_register = static_cast<std::uint8_t>(*reg)};
  std::ranges::copy(*data, request.manufacturer.begin());
  const bool of_device = sender.find(':') != std::string::npos;
  auto ref = of_device ? parse_node(sender) : std::optional(NodeRef{.line = sender});
  if (!ref || ref->all) {
    return usage(context, "'" + sender + "' is not LINE or LINE:NODE");
  }
  return on_line(context, ref->line, [&](Model& model, const Line& target) {
    if (of_device && !ref->own) {
      if (!resolve_node(context, model, target, *ref)) {
        return kFailed;
      }
      if (target.view->state.role != line::Role::device) {
        context.err << "an EMCY is sent by the line's own node: LINE alone, unless its role is "
                       "device\n";
        return kFailed;
      }
      request.node = ref->node;
    }
    const Client::Answer answer = ask_line(context, model, target, {.request = request});
    return print_answer(context, answer, answer.reply.ok() ? "sent" : "");
  });
}

int bus_restart(Context& context, const std::string& line) {
  return on_line(context, line, [&](Model& model, const Line& target) {
    Client::Answer answer = ask_gateway(context, model, target, request::BusRestart{});
    if (answer.reply.error == Error{Domain::can, EOPNOTSUPP}) {
      answer.text = "the interface " + target.view->interface_uri + " of line " + target.id.line +
                    " has no bus state that could be restarted";
    }
    return print_answer(context, answer);
  });
}

int fault(Context& context, const std::string& line, const std::vector<std::string>& faults) {
  request::BusFault request;
  for (const std::string& text : faults) {
    request.change += (&text == &faults.front() ? "" : "&") + text;
  }
  return on_line(context, line, [&](Model& model, const Line& target) {
    const Client::Answer answer = ask_gateway(context, model, target, request);
    if (!answer.reply.ok() && !answer.reply.bytes().empty() && !context.json) {
      context.err << printable(text_of(answer)) << '\n';
    }
    const int code = print_answer(context, answer, printable(text_of(answer)));
    return answer.reply.error == line::to_error(line::Refusal::bad_request) ? kUsage : code;
  });
}

int versions(Context& context, const std::string& line) {
  Model model;
  const auto found = find_lines(context, model, line, is_received);
  if (found.empty()) {
    return kFailed;
  }
  std::set<std::string> asked;  // gateways
  int code = kDone;
  for (const Line* one : found) {
    if (!one->view || one->gone || !asked.insert(one->id.gateway).second) {
      continue;
    }
    // Of the gateway, not of the line: an identity that is limited to other lines may ask it.
    const Client::Answer answer = context.client.call_gateway(
        {one->id.gateway, ""}, request::Versions{}, context.timeout, model);
    code = std::max(code, print_answer(context, answer, printable(text_of(answer))));
  }
  return std::max(code, completeness(context, model));
}

}  // namespace linegate::console
