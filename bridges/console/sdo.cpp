// SPDX-License-Identifier: Apache-2.0
// `linegate sdo`: objects of devices by SDO, from the image, or by PDO.
#include <algorithm>
#include <functional>
#include <optional>
#include <ostream>
#include <utility>

#include <nlohmann/json.hpp>

#include "bridges/console/answer.h"
#include "bridges/console/commands.h"
#include "bridges/console/json_text.h"
#include "bridges/console/lookup.h"
#include "bridges/console/object_text.h"
#include "bridges/console/one_line.h"
#include "bridges/console/output_text.h"
#include "bridges/console/refusal_text.h"
#include "bridges/console/sdo_target.h"
#include "bridges/console/table.h"
#include "bridges/console/value_text.h"
#include "stack/base/byte_order.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"

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

// How a value is printed. name, raw and unit: of JSON, and empty unless its object has them.
struct Shown {
  std::string text;   // with its unit, and the value of the object itself if that is another
  std::string value;  // without them
  std::string name{};
  std::string raw{};
  std::string unit{};
};

// The entry of the process image that has the object, whose name, unit and scaling it has; nothing
// if no PDO carries it, or the layout was not received.
std::optional<image::Entry> entry_of(const SdoTarget& target) {
  if (target.owner == nullptr || target.node.own) {
    return std::nullopt;
  }
  for (const Area& area : target.owner->areas) {
    const auto has_object = [&target](const image::Entry& entry) {
      return entry.node == target.node.node && entry.index == target.address.index &&
             entry.sub == target.address.sub;
    };
    const auto* const layout = area.layout ? &*area.layout : nullptr;
    const auto found = layout == nullptr ? std::vector<image::Entry>::const_iterator()
                                         : std::ranges::find_if(layout->entries, has_object);
    if (layout != nullptr && found != layout->entries.end()) {
      return *found;
    }
  }
  return std::nullopt;
}

// As the image shows the value of that entry. A PDO may carry fewer bits than the object has.
Shown shown_of(image::Entry entry, const std::vector<std::byte>& data) {
  entry.bit_length = static_cast<std::uint16_t>(8 * data.size());
  Shown out{.text = {}, .value = to_text(entry, data), .name = entry.name};
  out.unit = to_number(entry, data) ? unit_of(entry) : "";
  out.text = out.value + (out.unit.empty() ? "" : ' ' + printable(out.unit));
  if (std::string raw = to_text(entry.type, data); raw != out.value) {
    out.text += "  (" + raw + ')';
    out.raw = std::move(raw);
  }
  return out;
}

// Returns true for an empty or known type name; otherwise prints an error.
bool is_type(Context& context, const std::string& type) {
  const bool good = type.empty() || type_from_name(type).has_value();
  if (!good) {
    sdo_usage(context, "unknown data type '" + type + "'");
  }
  return good;
}

// Prints an error for empty data, which the gateway would refuse.
bool is_any(Context& context, const std::vector<std::byte>& data) {
  if (data.empty()) {
    sdo_usage(context, "there is no value to write");
  }
  return !data.empty();
}

// Parses the value; nothing, after an error message, if the type is unknown or the value does not
// fit it.
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
    return std::nullopt;
  }
  return is_any(context, *data) ? data : std::nullopt;
}

// A device that stores or restores its parameters answers only afterwards.
Duration least_patience(std::uint16_t index) {
  return index == od::objects::kStoreParameters || index == od::objects::kRestoreDefaults
             ? std::chrono::seconds(16)
             : Duration::zero();
}

// --- objects as the device file of the node has them --------------------------------------------

using Variables = std::vector<line::ListedObject>;

// The variables of the requested object.
struct Described {
  Variables variables;    // empty: unknown
  std::string failure;    // why the gateway did not answer; empty: the device file lacks the object
  bool permitted = true;  // false: the write is refused, too
};

Described describe_object(Context& context, Model& model, const SdoTarget& target) {
  if (target.owner == nullptr) {
    return {};
  }
  const std::uint16_t index = target.address.index;
  const line::LocalRead list{.node = target.node.own ? std::uint8_t{0} : target.node.node,
                             .what = line::ObjectRange{index, index}};
  const Client::Answer answer = ask_line(context, model, *target.owner, {.request = list});
  if (!answer.reply.ok()) {
    const bool no_file = answer.reply.error == line::to_error(line::Refusal::bad_request);
    return {.variables = {},
            .failure = no_file ? "" : answer.text,
            .permitted = answer.reply.error != line::to_error(line::Refusal::not_permitted)};
  }
  const auto* const listed = std::get_if<Variables>(&answer.reply.data);
  if (listed == nullptr) {
    return {.variables = {}, .failure = "the answer of the gateway is no list of objects"};
  }
  Variables out = *listed;
  std::erase_if(out, [index](const auto& one) { return one.address.index != index; });
  return {.variables = std::move(out), .failure = ""};
}

const line::ListedObject* find(const Variables& variables, std::uint8_t sub) {
  const auto found =
      std::ranges::find(variables, sub, [](const auto& one) { return one.address.sub; });
  return found == variables.end() ? nullptr : &*found;
}

bool has_subs(const Variables& variables) {
  return std::ranges::any_of(variables, [](const auto& one) { return one.address.sub != 0; });
}

std::string names_of(const Variables& variables) {
  std::string out;
  for (const line::ListedObject& one : variables) {
    out += "\n  " + od::to_text(one.address) + "  " + printable(one.name);
  }
  return out;
}

int name_a_sub(Context& context, const SdoTarget& target, const Variables& variables) {
  return sdo_usage(context, prefix_of(target) + "object " + format_hex(target.address.index, 4) +
                                "h has sub-indices: name one of" + names_of(variables));
}

// --- answers ------------------------------------------------------------------------------------

// The answers of a command, of which there may be several: one text line each, or one JSON
// document.
class Answers {
 public:
  // many: each answer names its node or sub-index.
  Answers(Context& context, bool many) : context_(context), many_(many) {}

  // code: the exit code if the answer is a success.
  void add(const SdoTarget& target, const line::ListedObject* variable,
           const Client::Answer& answer, const std::string& value, int code = kDone) {
    add(target, variable, answer, Shown{.text = value, .value = value}, code);
  }
  void add(const SdoTarget& target, const line::ListedObject* variable,
           const Client::Answer& answer, const Shown& shown, int code = kDone) {
    code_ = answer.reply.ok() ? (code_ == kDone ? code : code_) : kFailed;
    if (!many_ && context_.json) {
      context_.out << one_line(json_of(answer, shown)) << '\n';
      return;
    }
    if (!many_) {
      (void)print_answer(context_, answer, shown.text);
      return;
    }
    const od::Address address = target.address;
    if (context_.json) {
      documents_.push_back(json_of(target, address, variable, answer, shown));
      return;
    }
    std::string label = target.node.all ? node_text(target) : "";
    if (variable != nullptr) {
      label +=
          (label.empty() ? "" : "  ") + od::to_text(address) + "  " + printable(variable->name);
    }
    (answer.reply.ok() ? context_.out : context_.err)
        << label << ": "
        << (!answer.reply.ok()   ? printable(answer.text)
            : shown.text.empty() ? "done"
                                 : shown.text)
        << '\n';
  }
  // Returns the exit code after the last answer.
  int finish() {
    if (many_ && context_.json) {
      context_.out << one_line(nlohmann::ordered_json(documents_)) << '\n';
    }
    return code_;
  }

 private:
  static nlohmann::ordered_json json_of(const Client::Answer& answer, const Shown& shown) {
    auto out = nlohmann::ordered_json::parse(answer_json(answer, shown.value));
    for (const auto& [key, text] :
         {std::pair("raw", &shown.raw), {"unit", &shown.unit}, {"image_name", &shown.name}}) {
      if (!text->empty()) {
        out[key] = printable(*text);
      }
    }
    return out;
  }
  static nlohmann::ordered_json json_of(const SdoTarget& target, od::Address address,
                                        const line::ListedObject* variable,
                                        const Client::Answer& answer, const Shown& shown) {
    nlohmann::ordered_json out{{"object", od::to_text(address)}};
    if (target.node.all) {
      out["node"] = target.node.node;
      out["node_name"] = name_of(target);
    }
    if (variable != nullptr) {
      out["name"] = printable(variable->name);
      out["type"] = od::name(variable->type);
    }
    out.update(json_of(answer, shown));
    return out;
  }

  Context& context_;
  bool many_;
  int code_ = kDone;
  std::vector<nlohmann::ordered_json> documents_;
};

// The type as typed, else that of the device file.
od::DataType type_of(const std::string& typed, const line::ListedObject* variable) {
  if (!typed.empty()) {
    return type_from_name(typed).value_or(od::DataType::none);
  }
  return variable != nullptr ? variable->type : od::DataType::none;
}

// --- read ---------------------------------------------------------------------------------------

struct ReadRequest {
  std::string type;
  const Line* asked = nullptr;
  bool awaited_layouts = false;
};

// For the unit of a value that was read: the layouts of its line, which are usually received before
// the answer. Without them if no gateway sends layouts, or they do not arrive in the time in which
// all samples of a gateway do.
void await_layouts(Context& context, Model& model, const Line& line, ReadRequest& request) {
  const auto are_there = [&line] {
    return std::ranges::all_of(line.areas,
                               [](const Area& area) { return area.layout.has_value(); });
  };
  if (!are_there() && context.client.may_receive_layouts() &&
      !std::exchange(request.awaited_layouts, true)) {
    (void)wait_for_samples(context, model, are_there);
  }
}

void read_one(Context& context, Model& model, ReadRequest& request, const SdoTarget& target,
              const line::ListedObject* variable, bool named, Answers& answers) {
  const Client::Answer answer = ask_line(context, model, *request.asked, command_of(target));
  const od::DataType type = type_of(request.type, variable);
  const auto known = type == od::DataType::none ? std::nullopt : std::optional(type);
  const line::ListedObject* const shown_variable = named ? variable : nullptr;
  if (answer.reply.ok() && request.type.empty() && target.owner != nullptr) {
    await_layouts(context, model, *target.owner, request);
  }
  // With a typed type, the value of the object itself.
  const auto entry = request.type.empty() ? entry_of(target) : std::nullopt;
  if (answer.reply.ok() && entry && entry->type != od::DataType::none) {
    answers.add(target, shown_variable, answer, shown_of(*entry, answer.reply.bytes()));
    return;
  }
  answers.add(target, shown_variable, answer,
              answer.reply.ok() ? read_text(known, answer.reply.bytes()) : "");
}

void read_node(Context& context, Model& model, ReadRequest& request, SdoTarget& target,
               const Variables& variables, Answers& answers) {
  if (!target.whole_object || !has_subs(variables)) {
    read_one(context, model, request, target, find(variables, target.address.sub), false, answers);
    return;
  }
  for (const line::ListedObject& one : variables) {
    if (od::readable(one.access)) {
      target.address.sub = one.address.sub;
      read_one(context, model, request, target, &one, true, answers);
    }
  }
  target.address.sub = 0;
}

// Reads the device files of all nodes first, so that a usage error precedes all answers.
int read_nodes(Context& context, Model& model, ReadRequest& request, SdoTarget& target) {
  const auto meant = meant_nodes(context, model, target);
  if (!meant) {
    return kFailed;
  }
  const bool needed = request.type.empty() || target.whole_object;
  bool several = target.node.all;
  std::vector<Variables> described;
  for (const std::uint8_t node : meant->nodes) {
    select_node(target, node);
    described.push_back(needed ? describe_object(context, model, target).variables : Variables{});
    if (target.whole_object && has_subs(described.back())) {
      several = true;
      if (!request.type.empty()) {
        return name_a_sub(context, target, described.back());
      }
    }
  }
  Answers answers(context, several);
  for (std::size_t i = 0; i < meant->nodes.size(); ++i) {
    select_node(target, meant->nodes[i]);
    read_node(context, model, request, target, described[i], answers);
  }
  if (!meant->missing.empty()) {
    context.err << "incomplete: " << meant->missing << '\n';
  }
  const int code = answers.finish();
  return code == kDone && !meant->missing.empty() ? kIncomplete : code;
}

// --- write --------------------------------------------------------------------------------------

struct WriteRequest {
  std::string type;
  std::string value;
  std::vector<std::byte> data;  // set if a type was typed
};

// Sets the data of the command and returns kDone; otherwise reports on context.err that the value
// is invalid or its type unknown.
int set_value(Context& context, Model& model, SdoTarget& target, const WriteRequest& request) {
  const bool needed = request.type.empty() || target.whole_object;
  const Described described = needed ? describe_object(context, model, target) : Described{};
  if (target.whole_object && has_subs(described.variables)) {
    return name_a_sub(context, target, described.variables);
  }
  if (!request.type.empty()) {
    target.data = request.data;
    return kDone;
  }
  const std::string object = od::to_text(target.address);
  const line::ListedObject* const variable = find(described.variables, target.address.sub);
  if (!described.permitted) {
    context.err << prefix_of(target) << printable(described.failure) << '\n';
    return kFailed;
  }
  if (variable == nullptr) {
    const bool asked = described.failure.empty();
    context.err << prefix_of(target) << "the data type of " << object
                << (asked ? " is in no device file that the gateway has"
                          : " is not known, " + printable(described.failure))
                << ": give it, as in " << object << " u16 " << printable(request.value) << '\n';
    return asked ? kUsage : kFailed;
  }
  auto data = from_text(variable->type, request.value);
  if (!data) {
    context.err << prefix_of(target) << "'" << printable(request.value) << "' is not a value of "
                << object << ' ' << printable(variable->name) << ", which is "
                << od::name(variable->type) << '\n';
    return kUsage;
  }
  target.data = *std::move(data);
  return is_any(context, target.data) ? kDone : kUsage;
}

// Writes to all nodes once the values of all are known; otherwise to none.
int write_nodes(Context& context, Model& model, SdoTarget& target, const WriteRequest& request,
                const std::function<void(Answers&)>& write_one) {
  const auto meant = meant_nodes(context, model, target);
  if (!meant) {
    return kFailed;
  }
  if (!meant->missing.empty()) {
    context.err << "nothing was written: " << meant->missing
                << "; use a longer --wait, or name a node\n";
    return kFailed;
  }
  std::vector<std::vector<std::byte>> values;
  for (const std::uint8_t node : meant->nodes) {
    select_node(target, node);
    if (const int code = set_value(context, model, target, request); code != kDone) {
      context.err << (target.node.all ? "nothing was written to any node\n" : "");
      return code;
    }
    values.push_back(target.data);
  }
  Answers answers(context, target.node.all);
  for (std::size_t i = 0; i < meant->nodes.size(); ++i) {
    select_node(target, meant->nodes[i]);
    target.data = values[i];
    write_one(answers);
  }
  return answers.finish();
}

// Returns false, after an error message, if the text is not a value of its type.
bool read_value(Context& context, WriteRequest& request) {
  if (request.type.empty()) {
    return true;
  }
  auto data = value_of(context, request.type, request.value);
  request.data = data ? *std::move(data) : std::vector<std::byte>();
  return data.has_value();
}

void await_output_layout(Context& context, Model& model, const Line& line) {
  const Area& outputs = line.areas[static_cast<std::size_t>(image::Direction::outputs)];
  if (!outputs.layout) {
    (void)wait_until(context, model, [&] { return outputs.layout.has_value(); });
  }
}

}  // namespace

int sdo_read(Context& context, const std::string& node, const std::string& index,
             const std::string& sub, const std::string& type, const std::string& via, bool cached) {
  auto target = sdo_target(context, node, index, sub, false);
  if (!is_type(context, type) || !target) {
    return kUsage;
  }
  target->from_scan = cached;
  Model model;
  const Line* line = find_target(context, model, *target, via);
  if (line == nullptr) {
    return kFailed;
  }
  ReadRequest request{.type = type, .asked = line};
  return read_nodes(context, model, request, *target);
}

int sdo_write(Context& context, const std::string& node, const std::string& index,
              const std::string& sub, const std::string& type, const std::string& value,
              const std::string& via) {
  auto target = sdo_target(context, node, index, sub, true);
  WriteRequest request{.type = type, .value = value, .data = {}};
  if (!target || !read_value(context, request)) {
    return kUsage;
  }
  context.timeout = std::max(context.timeout, least_patience(target->address.index));
  target->timeout = context.timeout;
  Model model;
  const Line* line = find_target(context, model, *target, via);
  if (line == nullptr) {
    return kFailed;
  }
  return write_nodes(context, model, *target, request, [&](Answers& answers) {
    answers.add(*target, nullptr, ask_line(context, model, *line, command_of(*target)), "");
  });
}

int image_read(Context& context, const std::string& node, const std::string& index,
               const std::string& sub, const std::string& type) {
  auto target = sdo_target(context, node, index, sub, false);
  if (!is_type(context, type) || !target) {
    return kUsage;
  }
  target->from_image = true;
  Model model;
  const Line* const line = find_own_line(context, model, *target);
  if (line == nullptr) {
    return kFailed;
  }
  ReadRequest request{.type = type, .asked = line};
  return read_nodes(context, model, request, *target);
}

int object_write(Context& context, const std::string& node, const std::string& index,
                 const std::string& sub, const std::string& type, const std::string& value,
                 bool keep) {
  auto target = sdo_target(context, node, index, sub, true);
  WriteRequest request{.type = type, .value = value, .data = {}};
  if (!target || !read_value(context, request)) {
    return kUsage;
  }
  Model model;
  const Line* const line = find_own_line(context, model, *target);
  if (line == nullptr) {
    return kFailed;
  }
  return write_nodes(context, model, *target, request, [&](Answers& answers) {
    const std::uint8_t id = target->node.own ? line->view->state.node_id : target->node.node;
    Client::Answer answer = ask_line(
        context, model, *line,
        {.timeout = target->timeout,
         .request = line::ObjectWrite{
             .node = id, .address = target->address, .data = target->data, .keep_pdo = keep}});
    add_node_state(context, model, *line, id, answer);
    if (names_entries(answer.reply.data)) {
      await_output_layout(context, model, *line);
    }
    const Area& outputs = line->areas[static_cast<std::size_t>(image::Direction::outputs)];
    const std::string way =
        way_text(answer.reply.data, outputs.layout ? &*outputs.layout : nullptr);
    answers.add(*target, nullptr, answer,
                !answer.reply.ok() ? ""
                : way.empty()      ? "own node"
                                   : way,
                is_held_back(answer.reply.data) ? kHeldBack : kDone);
  });
}

}  // namespace linegate::console
