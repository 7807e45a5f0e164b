// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/dictionary.h"

#include <algorithm>
#include <array>
#include <optional>
#include <ostream>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "bridges/console/answer.h"
#include "bridges/console/json_text.h"
#include "bridges/console/lookup.h"
#include "bridges/console/one_line.h"
#include "bridges/console/table.h"
#include "bridges/console/tables.h"
#include "bridges/console/value_text.h"
#include "stack/od/data_type.h"
#include "stack/od/description.h"

namespace linegate::console {
namespace {

constexpr std::array<std::string_view, 6> kAccessNames{"ro", "wo", "rw", "rwr", "rww", "const"};

std::string_view access_name(od::Access access) {
  const auto place = static_cast<std::size_t>(access);
  return place < kAccessNames.size() ? kAccessNames[place] : "unknown";
}

std::string listed_value(const line::ListedObject& variable) {
  return variable.value.empty() ? std::string() : to_text(variable.type, variable.value);
}

// Returns nothing, after an error message, if the line refuses.
std::optional<std::vector<line::ListedObject>> listed(Context& context, Model& model,
                                                      const Line& line, std::uint8_t node,
                                                      std::uint16_t first, std::uint16_t last) {
  const line::LocalRead list{.node = node, .what = line::ObjectRange{first, last}};
  const Client::Answer answer = ask_line(context, model, line, {.request = list});
  if (!answer.reply.ok()) {
    print_answer(context, answer);
    return std::nullopt;
  }
  const auto* const variables = std::get_if<std::vector<line::ListedObject>>(&answer.reply.data);
  if (variables == nullptr) {
    context.err << "the list of objects is damaged\n";
    return std::nullopt;
  }
  return *variables;
}

std::string list_json(const std::vector<line::ListedObject>& variables) {
  auto out = nlohmann::ordered_json::array();
  for (const line::ListedObject& one : variables) {
    std::string data = to_hex(one.value);
    std::erase(data, ' ');
    out.push_back({{"index", one.address.index},
                   {"sub", one.address.sub},
                   {"name", one.name},
                   {"type", od::name(one.type)},
                   {"access", access_name(one.access)},
                   {"mappable", one.mappable},
                   {"stored", one.stored},
                   {"application", one.application},
                   {"data", data},
                   {"value", listed_value(one)}});
  }
  return one_line(out);
}

Table list_table(const std::vector<line::ListedObject>& variables) {
  Table out{{{"OBJECT"}, {"TYPE"}, {"ACCESS"}, {"PDO"}, {"STORED"}, {"NAME"}, {"VALUE"}}, {}, {}};
  for (const line::ListedObject& one : variables) {
    out.rows.push_back({{},
                        {{od::to_text(one.address), {}},
                         {std::string(od::name(one.type)), {}},
                         {std::string(access_name(one.access)), {}},
                         {one.mappable ? "yes" : "-", {}},
                         {one.stored ? "yes" : "-", {}},
                         {printable(one.name), {}},
                         {printable(listed_value(one)), {}}}});
  }
  return out;
}

// Commands find an object by its name or its address. What they take the name for, instead: "" if
// for nothing else. Without a sub-index or 0x it is a name, as Feed, unless there is that object.
std::string_view reading_of(const std::string& name) {
  if (name == "*") {
    return "all objects";
  }
  const bool is_address =
      od::parse_address(name).has_value() &&
      (name.find(':') != std::string::npos || name.starts_with("0x") || name.starts_with("0X"));
  return is_address ? "an object, INDEX:SUB" : "";
}

// Returns false, after an error message, if commands take the name for an object of the own node.
bool is_free_name(Context& context, Model& model, const Line& line, const std::string& name,
                  std::uint16_t created) {
  const std::optional<od::Address> address = od::parse_address(name);
  if (!address) {
    return true;
  }
  bool exists = address->index == created;
  if (!exists) {
    const auto variables = listed(context, model, line, 0, address->index, address->index);
    if (!variables) {
      return false;
    }
    exists = !variables->empty();
  }
  if (exists) {
    context.err << "'" << name << "' reads as object " << od::to_text(*address)
                << " in commands: choose another name\n";
  }
  return !exists;
}

// The object without its address and place; nothing, after an error message, if a text does not
// fit.
std::optional<line::OwnObject> created_object(Context& context, const NewObject& object) {
  const auto type = type_from_name(object.type);
  const auto* const access = std::ranges::find(kAccessNames, object.access);
  if (!type || access == kAccessNames.end() || object.name.size() > 0xFF) {
    context.err << "'" << object.type << "' is no data type, '" << object.access
                << "' no access (ro, wo, rw, rwr, rww, const), or the name is too long\n";
    return std::nullopt;
  }
  if (const std::string_view reading = reading_of(object.name); !reading.empty()) {
    context.err << "'" << object.name << "' reads as " << reading
                << " in commands: choose another name\n";
    return std::nullopt;
  }
  line::OwnObject out{.in_image = !object.offset.empty()};
  out.variable.name = object.name;
  out.variable.type = *type;
  out.variable.access = static_cast<od::Access>(access - kAccessNames.begin());
  out.variable.mappable = object.mappable;
  const std::pair<const std::string*, std::vector<std::byte>*> values[] = {
      {&object.value, &out.variable.value},
      {&object.low, &out.variable.low_limit},
      {&object.high, &out.variable.high_limit}};
  for (const auto& [text, into] : values) {
    auto value = text->empty() ? std::vector<std::byte>() : from_text(*type, *text);
    if (!value || value->size() > 0xFF) {
      context.err << "'" << *text << "' is not a value of " << object.type << '\n';
      return std::nullopt;
    }
    *into = *std::move(value);
  }
  return out;
}

// what: LINE, or LINE:NODE with a device of a line in the role device. Calls work(model, line,
// node).
template <class Work>
int on_dictionary(Context& context, const std::string& what, const Work& work) {
  const bool of_device = what.find(':') != std::string::npos;
  auto ref = of_device ? parse_node(what) : std::optional(NodeRef{.line = what});
  if (!ref || ref->all) {
    context.err << "usage: '" << what << "' is not LINE or LINE:NODE\n";
    return kUsage;
  }
  return on_line(context, ref->line, [&](Model& model, const Line& line) {
    if (of_device && !ref->own && !resolve_node(context, model, line, *ref)) {
      return kFailed;
    }
    if (of_device && !ref->own && line.view->state.role != line::Role::device) {
      context.err
          << "the line's own node has the dictionary: LINE alone, unless its role is device\n";
      return kFailed;
    }
    return work(model, line, ref->node);
  });
}

}  // namespace

int od_list(Context& context, const std::string& line, const std::string& index) {
  const auto address = parse_object(context, index.empty() ? "0" : index, "");
  if (!address) {
    return kUsage;
  }
  return on_dictionary(context, line, [&](Model& model, const Line& target, std::uint8_t node) {
    const std::uint16_t last = index.empty() ? std::uint16_t{0xFFFF} : address->index;
    const auto variables = listed(context, model, target, node, address->index, last);
    if (!variables) {
      return kFailed;
    }
    if (context.json) {
      context.out << list_json(*variables) << '\n';
    } else if (variables->empty()) {
      context.out << "there is no such object\n";
    } else {
      for (const std::string& row : text_of(list_table(*variables))) {
        context.out << row << '\n';
      }
    }
    return kDone;
  });
}

int od_read(Context& context, const std::string& line, const std::string& index,
            const std::string& sub) {
  const auto address = parse_object(context, index, sub);
  if (!address) {
    return kUsage;
  }
  return on_dictionary(context, line, [&](Model& model, const Line& target, std::uint8_t node) {
    const line::LocalRead read{.node = node, .what = *address};
    const Client::Answer answer = ask_line(context, model, target, {.request = read});
    if (!answer.reply.ok()) {
      return print_answer(context, answer);
    }
    const auto variables = listed(context, model, target, node, address->index, address->index);
    if (!variables) {
      return kFailed;
    }
    const auto known = std::ranges::find(*variables, *address, &line::ListedObject::address);
    const od::DataType type = known == variables->end() ? od::DataType::none : known->type;
    const std::string value = to_text(type, answer.reply.bytes());
    context.out << (context.json ? answer_json(answer, value) : printable(value)) << '\n';
    return kDone;
  });
}

int od_write(Context& context, const std::string& line, const std::string& index,
             const std::string& sub, const std::string& value, bool own) {
  const auto address = parse_object(context, index, sub);
  if (!address) {
    return kUsage;
  }
  return on_dictionary(context, line, [&](Model& model, const Line& target, std::uint8_t node) {
    const auto variables = listed(context, model, target, node, address->index, address->index);
    if (!variables) {
      return kFailed;
    }
    const auto known = std::ranges::find(*variables, *address, &line::ListedObject::address);
    if (known == variables->end()) {
      context.err << "there is no object " << od::to_text(*address) << '\n';
      return kFailed;
    }
    auto data = from_text(known->type, value);
    if (!data) {
      context.err << "'" << value << "' is not a value of " << od::name(known->type) << '\n';
      return kUsage;
    }
    const line::LocalWrite write{
        .node = node, .address = *address, .as_owner = own, .data = *std::move(data)};
    return print_answer(context, ask_line(context, model, target, {.request = write}));
  });
}

int od_create(Context& context, const std::string& line, const NewObject& object) {
  const auto address = parse_object(context, object.index, object.sub);
  const auto offset =
      parse_number(object.offset.empty() ? "0" : object.offset, image::kMaxAreaBytes - 1, false);
  if (!offset) {
    context.err << "'" << object.offset << "' is no offset in the image, in bytes\n";
  }
  auto created = address && offset ? created_object(context, object) : std::nullopt;
  if (!created) {
    return kUsage;
  }
  created->index = address->index;
  created->variable.sub = address->sub;
  created->offset = static_cast<std::uint32_t>(*offset);
  const line::ObjectCreate request{.what = *std::move(created)};
  return on_line(context, line, [&](Model& model, const Line& target) {
    if (!is_free_name(context, model, target, object.name, address->index)) {
      return kFailed;
    }
    return print_answer(context, ask_line(context, model, target, {.request = request}));
  });
}

int od_remove(Context& context, const std::string& line, const std::string& index) {
  const auto address = parse_object(context, index, "");
  if (!address) {
    return kUsage;
  }
  const line::ObjectCreate request{.what = line::ObjectRemoval{address->index}};
  return on_line(context, line, [&](Model& model, const Line& target) {
    return print_answer(context, ask_line(context, model, target, {.request = request}));
  });
}

}  // namespace linegate::console
