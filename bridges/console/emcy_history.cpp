// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/emcy_history.h"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <ostream>

#include <nlohmann/json.hpp>

#include "bridges/console/answer.h"
#include "bridges/console/explain_words.h"
#include "bridges/console/lookup.h"
#include "bridges/console/one_line.h"
#include "bridges/console/table.h"
#include "bridges/console/value_text.h"
#include "stack/base/abort_code.h"
#include "stack/base/byte_order.h"
#include "stack/od/objects.h"

namespace linegate::console {
namespace {

constexpr std::size_t kMessageSize = 8;

std::string digits_of(std::uint32_t value, int digits) {
  char out[9];
  std::snprintf(out, sizeof out, "%0*X", digits, value);
  return out;
}

std::vector<std::byte> bytes_of(const emcy::ManufacturerInfo& info) {
  return {info.begin(), info.end()};
}

std::string headline_of(const std::string& line, const NodeHistory& node) {
  std::string out = printable(line) + ':' + std::to_string(node.node);
  if (!node.name.empty()) {
    out += ' ' + printable(node.name);
  }
  return out + ", " + std::to_string(node.received) +
         (node.received == 1 ? " EMCY received\n" : " EMCYs received\n");
}

std::string message_text(const emcy::Message& message, bool has_bytes) {
  const std::string bits = describe_error_register(message.error_register);
  return "  " + digits_of(message.code, 4) + "  " + describe_error_code(message.code) +
         ", error register " + digits_of(message.error_register, 2) +
         (bits.empty() ? "" : " (" + bits + ')') +
         (has_bytes ? ", data " + to_hex(bytes_of(message.info)) : "") + '\n';
}

// An observer has no object dictionary with the history.
void add_last_one(const line::NodeState& state, NodeHistory& out) {
  out.last_alone = true;
  if (state.emcy_count != 0) {
    out.messages.push_back({.code = state.last_emcy, .error_register = state.error_register});
  }
}

// The selected nodes with their NodeState.
std::vector<NodeHistory> nodes_meant(const Line& line, std::uint8_t only) {
  std::vector<NodeHistory> out;
  for (const auto& [id, view] : line.nodes) {
    if (only == id || (only == 0 && view.state.emcy_count != 0)) {
      out.push_back(
          {.node = id, .name = view.name, .received = view.state.emcy_count, .messages = {}});
    }
  }
  return out;
}

// Reads 1003h of a device of the line; node 0 is the own node. Returns what is to be printed if it
// cannot be read.
std::optional<Client::Answer> read_errors(Context& context, Model& model, const Line& line,
                                          std::uint8_t node, StoredErrors& out) {
  std::size_t count = 1;
  for (std::size_t sub = 0; sub <= count; ++sub) {
    const od::Address address{od::objects::kErrorHistory, static_cast<std::uint8_t>(sub)};
    const line::LocalRead read{.node = node, .what = address};
    const Client::Answer answer = ask_line(context, model, line, {.request = read});
    if (sub == 0 && answer.reply.error == to_error(AbortCode::no_object)) {
      out.has_object = false;
      return std::nullopt;
    }
    if (!answer.reply.ok()) {
      return answer;
    }
    const std::span<const std::byte> bytes = answer.reply.bytes();
    const auto value = static_cast<std::uint32_t>(
        load_le(bytes.first(std::min(bytes.size(), sizeof(std::uint32_t)))));
    if (sub == 0) {
      count = std::min<std::size_t>(value, 0xFE);
    } else {
      out.fields.push_back(value);
    }
  }
  return std::nullopt;
}

// The selected devices of the line, or its own node.
std::vector<StoredErrors> devices_meant(const Line& line, const NodeRef& meant) {
  std::vector<StoredErrors> out;
  if (meant.own) {
    out.push_back({.node = line.view->state.node_id, .name = "own", .fields = {}});
    return out;
  }
  for (const auto& [id, view] : line.nodes) {
    if (meant.all || id == meant.node) {
      out.push_back({.node = id, .name = view.name, .fields = {}});
    }
  }
  return out;
}

int print_errors(Context& context, Model& model, const Line& line, const NodeRef& meant) {
  std::vector<StoredErrors> nodes = devices_meant(line, meant);
  for (StoredErrors& node : nodes) {
    if (const auto refusal =
            read_errors(context, model, line, meant.own ? std::uint8_t{0} : node.node, node)) {
      return print_answer(context, *refusal);
    }
  }
  if (context.json) {
    context.out << stored_errors_json(line.id, nodes) << '\n';
  } else {
    context.out << stored_errors_text(line.id.line, nodes);
  }
  return kDone;
}

int print_history(Context& context, Model& model, const Line& line, const NodeRef& meant) {
  if (meant.own) {
    return print_errors(context, model, line, meant);
  }
  // NodeState arrives after LineState.
  (void)wait_until(context, model, [&] {
    return meant.all ? line.nodes.size() >= line.view->state.nodes_configured
                     : line.nodes.contains(meant.node);
  });
  if (!meant.all && !line.nodes.contains(meant.node)) {
    report_no_node(context, line, std::to_string(meant.node));
    return kFailed;
  }
  if (line.view->state.role == line::Role::device && !line.nodes.empty()) {
    return print_errors(context, model, line, meant);
  }
  std::vector<NodeHistory> nodes = nodes_meant(line, meant.all ? std::uint8_t{0} : meant.node);
  for (NodeHistory& node : nodes) {
    if (line.view->state.role == line::Role::observer) {
      if (const auto known = line.nodes.find(node.node); known != line.nodes.end()) {
        add_last_one(known->second.state, node);
      }
      continue;
    }
    const line::LocalRead history{.what = od::Address{od::objects::kEmcyHistory, node.node}};
    const Client::Answer answer = ask_line(context, model, line, {.request = history});
    if (!answer.reply.ok()) {
      return print_answer(context, answer);
    }
    node.messages = parse_history(answer.reply.bytes());
  }
  if (context.json) {
    context.out << history_json(line.id, nodes) << '\n';
  } else {
    context.out << history_text(line.id.line, nodes);
  }
  return kDone;
}

}  // namespace

std::vector<emcy::Message> parse_history(std::span<const std::byte> data) {
  const std::size_t count = data.empty() ? 0 : (data.size() - 1) / kMessageSize;
  const std::size_t last = data.empty() ? 0 : std::to_integer<std::size_t>(data[0]);
  if (count == 0 || last == 0 || last > count || data.size() != 1 + count * kMessageSize) {
    return {};
  }
  std::vector<emcy::Message> out;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t place = (last - 1 + count - i) % count;
    const auto bytes = data.subspan(1 + place * kMessageSize, kMessageSize);
    emcy::Message message;
    message.code = static_cast<std::uint16_t>(std::to_integer<unsigned>(bytes[0]) |
                                              std::to_integer<unsigned>(bytes[1]) << 8U);
    message.error_register = std::to_integer<std::uint8_t>(bytes[2]);
    std::ranges::copy(bytes.subspan(3), message.info.begin());
    out.push_back(message);
  }
  return out;
}

std::string history_text(const std::string& line, const std::vector<NodeHistory>& nodes) {
  std::string out;
  for (const NodeHistory& node : nodes) {
    out += headline_of(line, node);
    for (const emcy::Message& message : node.messages) {
      out += message_text(message, !node.last_alone);
    }
  }
  return out.empty() ? "no node has sent an EMCY\n" : out;
}

std::string history_json(const LineId& line, const std::vector<NodeHistory>& nodes) {
  using Json = nlohmann::ordered_json;
  Json out = {{"gateway", line.gateway}, {"line", line.line}, {"nodes", Json::array()}};
  for (const NodeHistory& node : nodes) {
    Json emcys = Json::array();
    for (const emcy::Message& message : node.messages) {
      Json one = {{"code", message.code},
                  {"text", describe_error_code(message.code)},
                  {"error_register", message.error_register}};
      if (!node.last_alone) {
        one["bytes"] = to_hex(bytes_of(message.info));
      }
      emcys.push_back(std::move(one));
    }
    out["nodes"].push_back({{"node", node.node},
                            {"name", node.name},
                            {"received", node.received},
                            {"emcys", std::move(emcys)}});
  }
  return one_line(out);
}

std::string stored_errors_text(const std::string& line, const std::vector<StoredErrors>& nodes) {
  std::string out;
  for (const StoredErrors& node : nodes) {
    out += printable(line) + ':' + std::to_string(node.node) + ' ' + printable(node.name);
    if (!node.has_object) {
      out += ", has no 1003h: it stores no errors\n";
      continue;
    }
    out += ", " + std::to_string(node.fields.size()) +
           (node.fields.size() == 1 ? " error in 1003h\n" : " errors in 1003h\n");
    for (const std::uint32_t field : node.fields) {
      const auto code = static_cast<std::uint16_t>(field);
      out += "  " + digits_of(code, 4) + "  " + describe_error_code(code) +
             ", additional information " + digits_of(field >> 16U, 4) + '\n';
    }
  }
  return out;
}

std::string stored_errors_json(const LineId& line, const std::vector<StoredErrors>& nodes) {
  using Json = nlohmann::ordered_json;
  Json out = {{"gateway", line.gateway}, {"line", line.line}, {"nodes", Json::array()}};
  for (const StoredErrors& node : nodes) {
    Json errors = Json::array();
    for (const std::uint32_t field : node.fields) {
      const auto code = static_cast<std::uint16_t>(field);
      errors.push_back(
          {{"code", code}, {"text", describe_error_code(code)}, {"additional", field >> 16U}});
    }
    out["nodes"].push_back({{"node", node.node},
                            {"name", node.name},
                            {"stored", node.has_object},
                            {"errors", std::move(errors)}});
  }
  return one_line(out);
}

int emcy_history(Context& context, const std::string& what) {
  auto meant = line_or_node(context, what, OwnNode::permitted);
  if (!meant) {
    return kUsage;
  }
  return on_line(context, meant->line, [&](Model& model, const Line& line) {
    return resolve_node(context, model, line, *meant) ? print_history(context, model, line, *meant)
                                                      : kFailed;
  });
}

}  // namespace linegate::console
