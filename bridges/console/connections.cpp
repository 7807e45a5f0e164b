// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/connections.h"

#include <ostream>

#include <nlohmann/json.hpp>

#include "bridges/console/answer.h"
#include "bridges/console/lookup.h"
#include "bridges/console/one_line.h"
#include "bridges/console/value_text.h"
#include "stack/base/abort_code.h"

namespace linegate::console {
namespace {

constexpr std::uint64_t kHighestNumber = 0xFFFF'FFFF;

int wrong_words(Context& context) {
  context.err << "usage: connections LINE [open CLIENT SERVER | close NUMBER]\n";
  return kUsage;
}

// A record or CAN-ID, "-" if there is none yet.
std::string hex_or_none(std::uint16_t number, int digits) {
  return number == 0 ? "-" : hex_digits(number, digits);
}

std::string state_text(const manager::Connection& connection) {
  std::string out(name(connection.state));
  if (connection.abort != AbortCode::none) {
    out += ": " + std::string(describe(connection.abort));
  }
  return out;
}

std::string hint(line::Refusal refusal, bool opens) {
  if (refusal == line::Refusal::wrong_state) {
    return opens ? ": the line has no CAN-IDs for connections (plant.yaml: sdo_connections)"
                 : ": it is being opened or released";
  }
  if (refusal == line::Refusal::bad_request) {
    return opens ? ": a connection has two nodes, and neither is the own node of the line"
                 : ": the line has no connection with that number";
  }
  return {};
}

int print_connections(Context& context, const Line& line, Client::Answer answer, bool opens) {
  if (!answer.reply.ok()) {
    if (answer.reply.error.domain == Domain::command) {
      answer.text += hint(static_cast<line::Refusal>(answer.reply.error.code), opens);
    }
    return print_answer(context, answer);
  }
  const auto* const list = std::get_if<line::SdoConnections>(&answer.reply.data);
  if (list == nullptr && !std::holds_alternative<std::monostate>(answer.reply.data)) {
    context.err << "the gateway's answer cannot be read\n";
    return kFailed;
  }
  const line::SdoConnections connections = list == nullptr ? line::SdoConnections{} : *list;
  if (context.json) {
    context.out << connections_json(line.id, connections) << '\n';
    return kDone;
  }
  for (const std::string& text : text_of(connections_table(line.id, connections))) {
    context.out << text << '\n';
  }
  return kDone;
}

int open_connection(Context& context, const std::string& name, const std::string& client,
                    const std::string& server) {
  auto from = parse_node(name + ':' + client);
  auto to = parse_node(name + ':' + server);
  if (!from || !to || from->all || to->all || from->own || to->own) {
    return wrong_words(context);
  }
  return on_line(context, name, [&](Model& model, const Line& line) {
    if (!resolve_node(context, model, line, *from) || !resolve_node(context, model, line, *to)) {
      return kFailed;
    }
    const line::ConnectionOpen request{.node = from->node, .server = to->node};
    return print_connections(
        context, line,
        ask_line(context, model, line, {.timeout = context.timeout, .request = request}), true);
  });
}

}  // namespace

int connections(Context& context, const std::string& line, const std::vector<std::string>& words) {
  if (words.size() == 3 && words[0] == "open") {
    return open_connection(context, line, words[1], words[2]);
  }
  if (words.empty()) {
    return on_line(context, line, [&](Model& model, const Line& of_name) {
      return print_connections(
          context, of_name,
          ask_line(context, model, of_name,
                   {.timeout = context.timeout, .request = line::ConnectionList{}}),
          false);
    });
  }
  const auto number = words.size() == 2 && words[0] == "close"
                          ? parse_number(words[1], kHighestNumber, false)
                          : std::nullopt;
  if (!number) {
    return wrong_words(context);
  }
  return on_line(context, line, [&](Model& model, const Line& of_name) {
    const line::ConnectionClose request{.number = static_cast<std::uint32_t>(*number)};
    Client::Answer answer =
        ask_line(context, model, of_name, {.timeout = context.timeout, .request = request});
    if (answer.reply.error.domain == Domain::command) {
      answer.text += hint(static_cast<line::Refusal>(answer.reply.error.code), false);
    }
    return print_answer(context, answer);
  });
}

Table connections_table(const LineId& id, const line::SdoConnections& connections) {
  Table out{{{"NUMBER", true},
             {"CLIENT", true},
             {"OBJECT"},
             {"SERVER", true},
             {"OBJECT"},
             {"TO SERVER"},
             {"TO CLIENT"},
             {"STATE"}},
            {},
            {}};
  for (const manager::Connection& each : connections) {
    out.rows.push_back(
        {{id, each.client, each.number},
         {{std::to_string(each.number), each.number},
          {std::to_string(each.client), each.client},
          {hex_or_none(each.client_record, 4), {}},
          {std::to_string(each.server), each.server},
          {hex_or_none(each.server_record, 4), {}},
          {hex_or_none(each.request, 3), {}},
          {hex_or_none(each.response, 3), {}},
          {state_text(each), {}}},
         each.state == manager::ConnectionState::stale ? Style::warning : Style::plain});
  }
  if (connections.empty()) {
    out.notes.push_back({"the line has assigned no connections", Style::plain});
  }
  return out;
}

std::string connections_json(const LineId& id, const line::SdoConnections& connections) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const manager::Connection& each : connections) {
    nlohmann::ordered_json one{{"number", each.number},
                               {"client", each.client},
                               {"server", each.server},
                               {"client_record", each.client_record},
                               {"server_record", each.server_record},
                               {"request", each.request},
                               {"response", each.response},
                               {"state", name(each.state)}};
    if (each.abort != AbortCode::none) {
      one["abort"] = hex_digits(static_cast<std::uint32_t>(each.abort), 8);
    }
    list.push_back(std::move(one));
  }
  return one_line(nlohmann::ordered_json{
      {"gateway", id.gateway}, {"line", id.line}, {"connections", std::move(list)}});
}

}  // namespace linegate::console
