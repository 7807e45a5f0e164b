#include "bridges/console/commands.h"

#include <algorithm>
#include <array>
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
#include "stack/base/byte_order.h"

namespace linegate::console {
namespace {

int usage(Context& context, const std::string& text) {
  context.err << text << '\n';
  return kUsage;
}

bool is_received(const Line* line) {
  return line->view.has_value();
}

// An observer has states of the nodes only that it has heard.
bool has_its_nodes(const Line* line) {
  const bool all =
      line->view && (line->view->state.role == line::Role::observer || knows_nodes(*line));
  return line->gone || all;
}

// Waits until the lines of all gateways are received, and all lines that match fulfil the
// condition; without a name all lines match. Empty: there is none, which was reported.
std::vector<const Line*> find_lines(Context& context, Model& model, const std::string& line,
                                    bool (*condition)(const Line*)) {
  (void)wait_until_settled(context, model, [&] {
    const auto found = model.find(line);
    return !found.empty() && std::ranges::all_of(found, condition);
  });
  auto found = model.find(line);
  if (std::ranges::none_of(found, is_received)) {
    context.err << (line.empty() ? "no gateway was heard of" : "no line '" + line + "'") << '\n';
    found.clear();
  }
  return found;
}

// What is missing of the lines that were printed, each of which should fulfil the condition.
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
  return code;
}

std::string text_of(const Client::Answer& answer) {
  return {reinterpret_cast<const char*>(answer.reply.data.data()), answer.reply.data.size()};
}

std::string read_text(const std::optional<od::DataType>& type, const std::vector<std::byte>& data) {
  if (type) {
    return to_text(*type, data);
  }
  std::string out = to_hex(data);
  if (!data.empty() && data.size() <= 8) {
    out += "  (" + std::to_string(load_le(std::span<const std::byte>(data))) + ')';
  }
  return out;
}

// Of a type that is known, or of none; otherwise says on context.err that it is neither.
bool is_type(Context& context, const std::string& type) {
  const bool good = type.empty() || type_from_name(type).has_value();
  if (!good) {
    usage(context, "unknown data type '" + type + "'");
  }
  return good;
}

int print_value(Context& context, const Client::Answer& answer, const std::string& type) {
  return print_answer(context, answer,
                      answer.reply.ok() ? read_text(type_from_name(type), answer.reply.data) : "");
}

// Of that type; otherwise says on context.err that there is no such type, or no such value of it.
std::optional<std::vector<std::byte>> value_of(Context& context, const std::string& type,
                                               const std::string& value) {
  const auto data_type = type_from_name(type);
  if (!data_type) {
    usage(context, "unknown data type '" + type + "'");
    return std::nullopt;
  }
  auto data = from_text(*data_type, value);
  if (!data) {
    usage(context, "'" + value + "' is not a value of " + type);
  }
  return data;
}

struct SdoTarget {
  NodeRef node;
  line::Command command;
};

// A network, of one gateway or (empty) any.
struct RemoteNetwork {
  std::uint16_t number = 0;
  std::string gateway;
};

// "NETWORK" or "GATEWAY/NETWORK" with a network-ID that is no line's.
std::optional<RemoteNetwork> remote_network(const Model& model, const std::string& line) {
  const std::size_t slash = line.find('/');
  const bool full_name = slash != std::string::npos;
  const auto number = parse_number(full_name ? line.substr(slash + 1) : line, 0xFFFF, false);
  if (!number || *number == 0 || !model.find(line).empty()) {
    return std::nullopt;
  }
  return RemoteNetwork{static_cast<std::uint16_t>(*number),
                       full_name ? line.substr(0, slash) : std::string()};
}

void ask_in_network(SdoTarget& target, std::uint16_t network) {
  using enum line::CommandKind;
  const bool write = target.command.kind == sdo_write;
  target.command.kind = write ? network_write : network_read;
  target.command.network = network;
}

// Sets the node that a name stands for.
bool resolve_target(Context& context, Model& model, const Line& line, SdoTarget& target) {
  const bool found = resolve_node(context, model, line, target.node);
  target.command.node = target.node.node;
  return found;
}

// The line with the node.
const Line* find_own_line(Context& context, Model& model, SdoTarget& target) {
  const Line* const line = find_line(context, model, target.node.line);
  return line != nullptr && resolve_target(context, model, *line, target) ? line : nullptr;
}

// The line that `via` names; the network is a number, or that of a line.
const Line* find_via(Context& context, Model& model, SdoTarget& target, const std::string& via) {
  if (target.node.own) {
    context.err << "the own node of a line is not asked through another one\n";
    return nullptr;
  }
  const Line* const line = find_line(context, model, via);
  if (line == nullptr) {
    return nullptr;
  }
  target.command.entry = line::kAsDevice;
  const auto number = parse_number(target.node.line, 0xFFFF, false);
  if (number && target.node.name.empty()) {
    ask_in_network(target, static_cast<std::uint16_t>(*number));
    return line;
  }
  const Line* const other = find_line(context, model, target.node.line);
  if (other == nullptr || !resolve_target(context, model, *other, target)) {
    return nullptr;
  }
  ask_in_network(target, other->view->state.network_id);
  return line;
}

// The line that has the node; or the one over which its network is reached, by routes that gateways
// tell of. nullptr: there is neither, which has been said.
const Line* find_target(Context& context, Model& model, SdoTarget& target, const std::string& via) {
  if (!via.empty()) {
    return find_via(context, model, target, via);
  }
  const std::string& line = target.node.line;
  const auto ways = [&] {
    const auto network = remote_network(model, line);
    return network ? find_ways(model, network->number, network->gateway)
                   : std::vector<const Line*>();
  };
  const auto known = [&] {
    return !ways().empty() || std::ranges::any_of(model.find(line), is_received);
  };
  if (target.node.own || !wait_until_settled(context, model, known)) {
    return find_own_line(context, model, target);
  }
  const std::vector<const Line*> found = ways();
  if (found.empty()) {
    return find_own_line(context, model, target);
  }
  if (!target.node.name.empty()) {
    context.err << "nodes of network " << line << " have no names here: give the node-ID\n";
    return nullptr;
  }
  if (found.size() > 1) {
    context.err << "more than one gateway has a route to network " << line << ": name one, as "
                << printable(found.front()->id.gateway) << '/' << line << '\n';
    return nullptr;
  }
  const RemoteNetwork network = *remote_network(model, line);
  ask_in_network(target, network.number);
  return found.front();
}

std::string numbers_text(const std::vector<std::byte>& data) {
  std::string out;
  for (std::size_t i = 0; i + 2 <= data.size(); i += 2) {
    out += (out.empty() ? "PDO " : ", ") + std::to_string(load_le<std::uint16_t>(data.data() + i));
  }
  return out;
}

// A device that stores its parameters, or restores them, answers when it has done so.
Duration least_patience(std::uint16_t index) {
  constexpr std::uint16_t kStore = 0x1010;
  constexpr std::uint16_t kRestore = 0x1011;
  return index == kStore || index == kRestore ? std::chrono::seconds(16) : Duration::zero();
}

std::optional<SdoTarget> sdo_target(Context& context, const std::string& node,
                                    const std::string& index, const std::string& sub, bool write) {
  const auto ref = parse_node(node);
  if (!ref || ref->all) {
    context.err << "'" << node << "' is not LINE:NODE, with a node-ID 1..127, a name or own\n";
    return std::nullopt;
  }
  const auto address = parse_object(context, index, sub);
  if (!address) {
    return std::nullopt;
  }
  using enum line::CommandKind;
  line::Command command{.kind = write ? (ref->own ? local_write : sdo_write)
                                      : (ref->own ? local_read : sdo_read)};
  command.node = ref->node;
  command.index = address->index;
  command.sub = address->sub;
  command.timeout = context.timeout;
  return SdoTarget{*ref, std::move(command)};
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
  return completeness(context, model);
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
      context.out << one->id.line << ' ' << image::name(direction) << '\n';
      print(context.out, image_table(*one, direction));
      if (direction == image::Direction::outputs) {
        print(context.out, group_texts(*one));
      }
    }
  }
  return completeness_of(context, model, found, "the image", has_image);
}

int write(Context& context, const std::string& line, const std::string& entry,
          const std::string& value) {
  return on_line(context, line, [&](Model& model, const Line& target) {
    const Area& outputs = target.areas[static_cast<std::size_t>(image::Direction::outputs)];
    if (!wait_until(context, model, [&] { return outputs.layout.has_value(); })) {
      context.err << "the output layout of " << target.id.line << " was not received\n";
      return kFailed;
    }
    const auto number = find_entry(context, *outputs.layout, entry);
    if (!number) {
      return kUsage;
    }
    const image::Entry& place = outputs.layout->entries[*number];
    auto data = from_text(place.type, value);
    if (!data) {
      return usage(context,
                   "'" + value + "' is not a value of " + std::string(od::name(place.type)));
    }
    line::Command command{.kind = line::CommandKind::output_write};
    command.entry = *number;
    command.data = *std::move(data);
    Client::Answer answer = ask_line(context, model, target, command, outputs.layout->id);
    add_node_state(context, model, target, place.node, answer);
    return print_answer(context, answer,
                        answer.reply.ok() ? way_text(answer.reply.data, &*outputs.layout) : "");
  });
}

int sdo_read(Context& context, const std::string& node, const std::string& index,
             const std::string& sub, const std::string& type, const std::string& via, bool cached) {
  auto target = sdo_target(context, node, index, sub, false);
  if (!is_type(context, type) || !target) {
    return kUsage;
  }
  if (target->command.kind == line::CommandKind::sdo_read && cached) {
    target->command.code = line::kFromCache;
  }
  Model model;
  const Line* line = find_target(context, model, *target, via);
  if (line == nullptr) {
    return kFailed;
  }
  return print_value(context, ask_line(context, model, *line, target->command), type);
}

int sdo_write(Context& context, const std::string& node, const std::string& index,
              const std::string& sub, const std::string& type, const std::string& value,
              const std::string& via) {
  auto target = sdo_target(context, node, index, sub, true);
  auto data = value_of(context, type, value);
  if (!target || !data) {
    return kUsage;
  }
  target->command.data = *std::move(data);
  context.timeout = std::max(context.timeout, least_patience(target->command.index));
  target->command.timeout = context.timeout;
  Model model;
  const Line* line = find_target(context, model, *target, via);
  if (line == nullptr) {
    return kFailed;
  }
  return print_answer(context, ask_line(context, model, *line, target->command));
}

int image_read(Context& context, const std::string& node, const std::string& index,
               const std::string& sub, const std::string& type) {
  auto target = sdo_target(context, node, index, sub, false);
  if (!is_type(context, type) || !target) {
    return kUsage;
  }
  target->command.code = line::kFromImage;
  return on_line(context, target->node.line, [&](Model& model, const Line& line) {
    if (!resolve_target(context, model, line, *target)) {
      return kFailed;
    }
    return print_value(context, ask_line(context, model, line, target->command), type);
  });
}

int object_write(Context& context, const std::string& node, const std::string& index,
                 const std::string& sub, const std::string& type, const std::string& value,
                 bool keep) {
  auto target = sdo_target(context, node, index, sub, true);
  auto data = value_of(context, type, value);
  if (!target || !data) {
    return kUsage;
  }
  line::Command& command = target->command;
  command.kind = line::CommandKind::object_write;
  command.code = keep ? line::kKeepPdo : std::uint16_t{0};
  command.data = *std::move(data);
  return on_line(context, target->node.line, [&](Model& model, const Line& line) {
    if (!resolve_target(context, model, line, *target)) {
      return kFailed;
    }
    command.node = target->node.own ? line.view->state.node_id : command.node;
    Client::Answer answer = ask_line(context, model, line, command);
    add_node_state(context, model, line, command.node, answer);
    const Area& outputs = line.areas[static_cast<std::size_t>(image::Direction::outputs)];
    const std::string way =
        way_text(answer.reply.data, outputs.layout ? &*outputs.layout : nullptr);
    return print_answer(context, answer, !answer.reply.ok() ? "" : way.empty() ? "own node" : way);
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
  line::Command command{.kind = line::CommandKind::pdo_trigger};
  command.code = by_offset ? std::uint16_t{0} : static_cast<std::uint16_t>(*value);
  command.entry = by_offset ? static_cast<std::uint32_t>(*value) : 0;
  return on_line(context, ref->line, [&](Model& model, const Line& line) {
    if (!resolve_node(context, model, line, *ref)) {
      return kFailed;
    }
    command.node = ref->node;
    Client::Answer answer = ask_line(context, model, line, command);
    if (answer.reply.error.domain == Domain::command) {
      const auto refusal = static_cast<line::Refusal>(answer.reply.error.code);
      const std::string why = trigger_refusal(context, model, line, command, refusal);
      answer.text += why.empty() ? "" : ": " + why;
    }
    return print_answer(context, answer, answer.reply.ok() ? numbers_text(answer.reply.data) : "");
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
    line::Command request{.kind = line::CommandKind::nmt};
    request.nmt = it->second;
    request.node = ref->own ? line.view->state.node_id : ref->node;
    return print_answer(context, ask_line(context, model, line, request));
  });
}

int emcy(Context& context, const std::string& line, const std::string& code,
         const std::string& error_register, const std::string& bytes) {
  const auto number = parse_number(code, 0xFFFF, true);
  const auto reg = parse_number(error_register, 0xFF, true);
  auto data = from_text(od::DataType::octet_string, bytes);
  if (!number || !reg || !data || data->size() > 5) {
    return usage(context, "an EMCY has a code 0..FFFF, an error register 0..FF and up to 5 bytes");
  }
  line::Command request{.kind = line::CommandKind::emcy_send};
  request.code = static_cast<std::uint16_t>(*number);
  request.error_register = static_cast<std::uint8_t>(*reg);
  request.data = *std::move(data);
  return on_line(context, line, [&](Model& model, const Line& target) {
    return print_answer(context, ask_line(context, model, target, request));
  });
}

int bus_restart(Context& context, const std::string& line) {
  return on_line(context, line, [&](Model& model, const Line& target) {
    return print_answer(context,
                        ask_line(context, model, target, {.kind = line::CommandKind::bus_restart}));
  });
}

int fault(Context& context, const std::string& line, const std::vector<std::string>& faults) {
  line::Command request{.kind = line::CommandKind::bus_fault};
  for (const std::string& text : faults) {
    const std::string part = (&text == &faults.front() ? "" : "&") + text;
    const auto* const bytes = reinterpret_cast<const std::byte*>(part.data());
    request.data.insert(request.data.end(), bytes, bytes + part.size());
  }
  return on_line(context, line, [&](Model& model, const Line& target) {
    const Client::Answer answer = ask_line(context, model, target, request);
    if (!answer.reply.ok() && !answer.reply.data.empty() && !context.json) {
      context.err << text_of(answer) << '\n';
    }
    return print_answer(context, answer, text_of(answer));
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
    const Client::Answer answer =
        ask_line(context, model, *one, {.kind = line::CommandKind::versions});
    code = std::max(code, print_answer(context, answer, text_of(answer)));
  }
  return std::max(code, completeness(context, model));
}

}  // namespace linegate::console
