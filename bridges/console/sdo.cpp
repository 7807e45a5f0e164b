// `linegate sdo`: objects of devices, by SDO, from the image or by PDO.
#include <algorithm>
#include <functional>
#include <optional>
#include <ostream>
#include <utility>

#include <nlohmann/json.hpp>

#include "bridges/console/answer.h"
#include "bridges/console/commands.h"
#include "bridges/console/dictionary.h"
#include "bridges/console/json_text.h"
#include "bridges/console/lookup.h"
#include "bridges/console/object_text.h"
#include "bridges/console/output_text.h"
#include "bridges/console/refusal_text.h"
#include "bridges/console/routes.h"
#include "bridges/console/table.h"
#include "bridges/console/value_text.h"
#include "stack/base/byte_order.h"
#include "stack/od/address_text.h"

namespace linegate::console {
namespace {

int sdo_usage(Context& context, const std::string& text) {
  context.err << text << '\n';
  return kUsage;
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
    sdo_usage(context, "unknown data type '" + type + "'");
  }
  return good;
}

// Of that type; otherwise says on context.err that there is no such type, or no such value of it.
std::optional<std::vector<std::byte>> value_of(Context& context, const std::string& type,
                                               const std::string& value) {
  const auto data_type = type_from_name(type);
  if (!data_type) {
    sdo_usage(context, "unknown data type '" + type + "'");
    return std::nullopt;
  }
  auto data = from_text(*data_type, value);
  if (!data) {
    sdo_usage(context, "'" + value + "' is not a value of " + type);
  }
  return data;
}

struct SdoTarget {
  NodeRef node;
  line::Command command;
  bool whole_object = false;    // no sub-index was typed
  const Line* owner = nullptr;  // the line with the node; nullptr: it is not received
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
  target.owner = line;
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
  if (number && target.node.name.empty() && !target.node.all) {
    ask_in_network(target, static_cast<std::uint16_t>(*number));
    return line;
  }
  const Line* const other = find_line(context, model, target.node.line);
  if (other == nullptr || !resolve_target(context, model, *other, target)) {
    return nullptr;
  }
  target.owner = other;
  ask_in_network(target, other->view->state.network_id);
  return line;
}

// The line that has the node; or the one over which its network is reached, by routes that gateways
// publish. nullptr: there is neither, and the error is printed.
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
    return !ways().empty() || std::ranges::any_of(model.find(line), [](const Line* one) {
      return one->view.has_value();
    });
  };
  if (target.node.own || !wait_until_settled(context, model, known)) {
    return find_own_line(context, model, target);
  }
  const std::vector<const Line*> found = ways();
  if (found.empty()) {
    return find_own_line(context, model, target);
  }
  if (!target.node.name.empty() || target.node.all) {
    context.err << "the nodes of network " << line << " are not known here: give the node-ID\n";
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

// A device that stores its parameters, or restores them, answers when it has done so.
Duration least_patience(std::uint16_t index) {
  constexpr std::uint16_t kStore = 0x1010;
  constexpr std::uint16_t kRestore = 0x1011;
  return index == kStore || index == kRestore ? std::chrono::seconds(16) : Duration::zero();
}

std::optional<SdoTarget> sdo_target(Context& context, const std::string& node,
                                    const std::string& index, const std::string& sub, bool write) {
  const auto ref = parse_node(node);
  if (!ref) {
    context.err << "'" << node << "' is not LINE:NODE, with a node-ID 1..127, a name, own or all\n";
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
  const bool whole = sub.empty() && index.find(':') == std::string::npos;
  return SdoTarget{.node = *ref, .command = std::move(command), .whole_object = whole};
}

// --- objects as the device file of the node has them --------------------------------------------

using Variables = std::vector<ListedVariable>;

// The variables of the object that the command is about. None: they are not known.
Variables describe_object(Context& context, Model& model, const SdoTarget& target) {
  if (target.owner == nullptr) {
    return {};
  }
  line::Command command{.kind = line::CommandKind::local_read};
  command.node = target.node.own ? std::uint8_t{0} : target.node.node;
  command.index = target.command.index;
  command.entry = target.command.index;
  command.code = line::kListObjects;
  const Client::Answer answer = ask_line(context, model, *target.owner, command);
  auto out = answer.reply.ok() ? decode_list(answer.reply.data) : std::nullopt;
  if (out) {
    std::erase_if(*out, [&](const auto& one) { return one.address.index != command.index; });
  }
  return out ? *std::move(out) : Variables{};
}

const ListedVariable* find(const Variables& variables, std::uint8_t sub) {
  const auto found =
      std::ranges::find(variables, sub, [](const auto& one) { return one.address.sub; });
  return found == variables.end() ? nullptr : &*found;
}

bool has_subs(const Variables& variables) {
  return std::ranges::any_of(variables, [](const auto& one) { return one.address.sub != 0; });
}

std::string names_of(const Variables& variables) {
  std::string out;
  for (const ListedVariable& one : variables) {
    out += "\n  " + od::to_text(one.address) + "  " + printable(one.name);
  }
  return out;
}

int name_a_sub(Context& context, const SdoTarget& target, const Variables& variables) {
  return sdo_usage(context, "object " + format_hex(target.command.index, 4) +
                                "h has sub-indices: name one of" + names_of(variables));
}

// --- answers ------------------------------------------------------------------------------------

// The answers of a command that may have several: one text line each, or one JSON document.
class Answers {
 public:
  // many: each says of which node, or sub-index, it is.
  Answers(Context& context, bool many) : context_(context), many_(many) {}

  // code: that of an answer that was carried out.
  void add(const SdoTarget& target, const ListedVariable* variable, const Client::Answer& answer,
           const std::string& value, int code = kDone) {
    code_ = answer.reply.ok() ? (code_ == kDone ? code : code_) : kFailed;
    if (!many_) {
      (void)print_answer(context_, answer, value);
      return;
    }
    const od::Address address{target.command.index, target.command.sub};
    if (context_.json) {
      documents_.push_back(json_of(target, address, variable, answer, value));
      return;
    }
    std::string label = target.node.all ? node_text(target) : "";
    if (variable != nullptr) {
      label +=
          (label.empty() ? "" : "  ") + od::to_text(address) + "  " + printable(variable->name);
    }
    (answer.reply.ok() ? context_.out : context_.err) << label << ": "
                                                      << (!answer.reply.ok() ? answer.text
                                                          : value.empty()    ? "done"
                                                                             : value)
                                                      << '\n';
  }
  // After the last: the exit code.
  int finish() {
    if (many_ && context_.json) {
      context_.out << nlohmann::ordered_json(documents_).dump() << '\n';
    }
    return code_;
  }

 private:
  static std::string name_of(const SdoTarget& target) {
    const auto known = target.owner->nodes.find(target.node.node);
    return known == target.owner->nodes.end() ? "" : printable(known->second.name);
  }
  static std::string node_text(const SdoTarget& target) {
    const std::string name = name_of(target);
    return std::to_string(target.node.node) + (name.empty() ? "" : " (" + name + ')');
  }
  static nlohmann::ordered_json json_of(const SdoTarget& target, od::Address address,
                                        const ListedVariable* variable,
                                        const Client::Answer& answer, const std::string& value) {
    nlohmann::ordered_json out{{"object", od::to_text(address)}};
    if (target.node.all) {
      out["node"] = target.node.node;
      out["node_name"] = name_of(target);
    }
    if (variable != nullptr) {
      out["name"] = printable(variable->name);
      out["type"] = od::name(variable->type);
    }
    out.update(nlohmann::ordered_json::parse(answer_json(answer, value)));
    return out;
  }

  Context& context_;
  bool many_;
  int code_ = kDone;
  std::vector<nlohmann::ordered_json> documents_;
};

// Each node that is meant, one after the other; the first result that is kUsage ends it.
int for_each_node(Context& context, Model& model, SdoTarget& target,
                  const std::function<int()>& work) {
  if (!target.node.all) {
    return work();
  }
  if (target.owner == nullptr) {
    return kFailed;
  }
  (void)know_nodes(context, model, *target.owner);
  std::vector<std::uint8_t> ids;
  for (const auto& [id, node] : target.owner->nodes) {
    if (node.state.configured || node.state.presence == line::Presence::present) {
      ids.push_back(id);
    }
  }
  if (ids.empty()) {
    context.err << "no node of " << printable(target.owner->id.line) << " is known\n";
    return kFailed;
  }
  for (const std::uint8_t id : ids) {
    target.node.node = id;
    target.command.node = id;
    if (const int code = work(); code == kUsage) {
      return code;
    }
  }
  return kDone;
}

// As it was typed, else of the device file.
od::DataType type_of(const std::string& typed, const ListedVariable* variable) {
  if (!typed.empty()) {
    return type_from_name(typed).value_or(od::DataType::none);
  }
  return variable != nullptr ? variable->type : od::DataType::none;
}

// --- read ---------------------------------------------------------------------------------------

struct ReadRequest {
  std::string type;
  const Line* asked = nullptr;
};

void read_one(Context& context, Model& model, const ReadRequest& request, const SdoTarget& target,
              const ListedVariable* variable, bool named, Answers& answers) {
  const Client::Answer answer = ask_line(context, model, *request.asked, target.command);
  const od::DataType type = type_of(request.type, variable);
  const auto known = type == od::DataType::none ? std::nullopt : std::optional(type);
  answers.add(target, named ? variable : nullptr, answer,
              answer.reply.ok() ? read_text(known, answer.reply.data) : "");
}

int read_node(Context& context, Model& model, const ReadRequest& request, SdoTarget& target,
              std::optional<Answers>& answers) {
  const bool needed = request.type.empty() || target.whole_object;
  const Variables variables = needed ? describe_object(context, model, target) : Variables{};
  const bool several = target.whole_object && has_subs(variables);
  if (several && !request.type.empty()) {
    return name_a_sub(context, target, variables);
  }
  if (!answers) {
    answers.emplace(context, several || target.node.all);
  }
  if (!several) {
    read_one(context, model, request, target, find(variables, target.command.sub), false, *answers);
    return kDone;
  }
  for (const ListedVariable& one : variables) {
    if (od::readable(one.access)) {
      target.command.sub = one.address.sub;
      read_one(context, model, request, target, &one, true, *answers);
    }
  }
  target.command.sub = 0;
  return kDone;
}

int read_nodes(Context& context, Model& model, const ReadRequest& request, SdoTarget& target) {
  std::optional<Answers> answers;
  const int code = for_each_node(
      context, model, target, [&] { return read_node(context, model, request, target, answers); });
  return code != kDone || !answers ? code : answers->finish();
}

// --- write --------------------------------------------------------------------------------------

// Sets the data of the command; otherwise says on context.err what is wrong with the value.
bool set_value(Context& context, Model& model, SdoTarget& target, const std::string& type,
               const std::string& value) {
  const bool needed = type.empty() || target.whole_object;
  const Variables variables = needed ? describe_object(context, model, target) : Variables{};
  if (target.whole_object && has_subs(variables)) {
    (void)name_a_sub(context, target, variables);
    return false;
  }
  const std::string object = od::to_text({target.command.index, target.command.sub});
  const ListedVariable* const variable = find(variables, target.command.sub);
  if (type.empty() && variable == nullptr) {
    context.err << "the data type of " << object
                << " is in no device file that the gateway has: give it, as in " << object
                << " u16 " << printable(value) << '\n';
    return false;
  }
  if (!type.empty()) {
    return !target.command.data.empty();  // of that type, before the line was looked for
  }
  auto data = from_text(variable->type, value);
  if (!data) {
    context.err << "'" << printable(value) << "' is not a value of " << object << ' '
                << printable(variable->name) << ", which is " << od::name(variable->type) << '\n';
    return false;
  }
  target.command.data = *std::move(data);
  return true;
}

// A value whose type was typed; false: it is none, which was reported.
bool typed_value(Context& context, SdoTarget& target, const std::string& type,
                 const std::string& value) {
  if (type.empty()) {
    return true;
  }
  auto data = value_of(context, type, value);
  target.command.data = data ? *std::move(data) : std::vector<std::byte>();
  return data.has_value();
}

}  // namespace

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
  return line == nullptr ? kFailed
                         : read_nodes(context, model, {.type = type, .asked = line}, *target);
}

int sdo_write(Context& context, const std::string& node, const std::string& index,
              const std::string& sub, const std::string& type, const std::string& value,
              const std::string& via) {
  auto target = sdo_target(context, node, index, sub, true);
  if (!target || !typed_value(context, *target, type, value)) {
    return kUsage;
  }
  context.timeout = std::max(context.timeout, least_patience(target->command.index));
  target->command.timeout = context.timeout;
  Model model;
  const Line* line = find_target(context, model, *target, via);
  if (line == nullptr) {
    return kFailed;
  }
  Answers answers(context, target->node.all);
  const int code = for_each_node(context, model, *target, [&] {
    if (!set_value(context, model, *target, type, value)) {
      return kUsage;
    }
    answers.add(*target, nullptr, ask_line(context, model, *line, target->command), "");
    return kDone;
  });
  return code != kDone ? code : answers.finish();
}

int image_read(Context& context, const std::string& node, const std::string& index,
               const std::string& sub, const std::string& type) {
  auto target = sdo_target(context, node, index, sub, false);
  if (!is_type(context, type) || !target) {
    return kUsage;
  }
  target->command.code = line::kFromImage;
  Model model;
  const Line* const line = find_own_line(context, model, *target);
  return line == nullptr ? kFailed
                         : read_nodes(context, model, {.type = type, .asked = line}, *target);
}

int object_write(Context& context, const std::string& node, const std::string& index,
                 const std::string& sub, const std::string& type, const std::string& value,
                 bool keep) {
  auto target = sdo_target(context, node, index, sub, true);
  if (!target || !typed_value(context, *target, type, value)) {
    return kUsage;
  }
  line::Command& command = target->command;
  command.kind = line::CommandKind::object_write;
  command.code = keep ? line::kKeepPdo : std::uint16_t{0};
  Model model;
  const Line* const line = find_own_line(context, model, *target);
  if (line == nullptr) {
    return kFailed;
  }
  Answers answers(context, target->node.all);
  const int code = for_each_node(context, model, *target, [&] {
    command.node = target->node.own ? line->view->state.node_id : target->node.node;
    if (!set_value(context, model, *target, type, value)) {
      return kUsage;
    }
    Client::Answer answer = ask_line(context, model, *line, command);
    add_node_state(context, model, *line, command.node, answer);
    const Area& outputs = line->areas[static_cast<std::size_t>(image::Direction::outputs)];
    const std::string way =
        way_text(answer.reply.data, outputs.layout ? &*outputs.layout : nullptr);
    answers.add(*target, nullptr, answer,
                !answer.reply.ok() ? ""
                : way.empty()      ? "own node"
                                   : way,
                is_held_back(answer.reply.data) ? kHeldBack : kDone);
    return kDone;
  });
  return code != kDone ? code : answers.finish();
}

}  // namespace linegate::console
