// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/command_desk.h"

#include <algorithm>

#include "bridges/dds/bytes.h"
#include "bridges/dds/command_samples.h"
#include "bridges/dds/reply_codec.h"
#include "bridges/dds/request_codec.h"

namespace linegate::dds {

using line::Refusal;

CommandDesk::CommandDesk(std::uint64_t incarnation, std::vector<std::string> lines,
                         DeskLimits limits)
    : incarnation_(incarnation), lines_(lines.begin(), lines.end()), limits_(limits) {
}

CommandDesk::Outcome CommandDesk::refuse(const v1::CommandRequest& request, Refusal refusal,
                                         std::string why) {
  auto answer = std::make_shared<Answer>();
  answer->line = request.line().to_string();
  answer->client = request.client().to_string();
  answer->id = request.id();
  answer->error = line::to_error(refusal);
  answer->text = why.empty() ? std::string(describe(refusal)) : std::move(why);
  Outcome outcome;
  outcome.answer = std::move(answer);
  outcome.refused = refusal;
  return outcome;
}

// Why the sample is refused, or nullptr if it is accepted.
const char* CommandDesk::admit(const v1::CommandRequest& request, Refusal& refusal) const {
  refusal = Refusal::bad_request;
  if (request.id() == 0)
    return "id is 0";
  if (request.client().size() == 0)
    return "client is empty";
  if (request.data().size() > kChunkBytes)
    return "a chunk has more than 8192 bytes";
  if (request.data().empty() && !request.last())
    return "a chunk before the last one is empty";
  refusal = Refusal::wrong_incarnation;
  if (request.incarnation() != 0 && request.incarnation() != incarnation_)
    return "";
  refusal = Refusal::unknown_line;
  const bool needs_line =
      request.kind() != v1::COMMAND_VERSIONS && request.kind() != v1::COMMAND_JOURNAL_READ;
  if (needs_line && !lines_.contains(request.line().to_string()))
    return "";
  return nullptr;
}

CommandDesk::Outcome CommandDesk::take(const v1::CommandRequest& request, const Sender& from,
                                       const std::string& partition) {
  Outcome outcome = handle(request, from, partition);
  if (outcome.refused != Refusal::none) {
    auto refusal = std::make_shared<Answer>(*outcome.answer);
    refusal->partition = partition;
    outcome.answer = std::move(refusal);
  }
  return outcome;
}

CommandDesk::Outcome CommandDesk::handle(const v1::CommandRequest& request, const Sender& from,
                                         const std::string& partition) {
  ++requests_;
  Refusal refusal{};
  if (const char* why = admit(request, refusal))
    return refuse(request, refusal, why);

  Client* client = client_of({request.line().to_string(), request.client().to_string(), from});
  if (client == nullptr)
    return refuse(request, Refusal::busy, "too many clients");
  client->used = requests_;
  if (client->pending.contains(request.id()))
    return {};

  const auto known = std::find_if(client->window.begin(), client->window.end(),
                                  [&](const auto& kept) { return kept->id == request.id(); });
  if (known != client->window.end()) {
    if (request.offset() != 0)
      return {};
    Outcome outcome;
    outcome.answer = *known;
    outcome.answer_from = std::min<std::size_t>(request.reply_offset(), (*known)->data.size());
    return outcome;
  }
  if (request.reply_offset() != 0) {
    return refuse(request, Refusal::bad_request, "the answer is no longer kept");
  }
  return append(*client, request, from, partition);
}

CommandDesk::Outcome CommandDesk::append(Client& client, const v1::CommandRequest& request,
                                         const Sender& from, const std::string& partition) {
  auto assembly = std::find_if(client.assemblies.begin(), client.assemblies.end(),
                               [&](const Assembly& a) { return a.id == request.id(); });
  if (request.offset() == 0) {
    if (assembly != client.assemblies.end())
      drop_assembly(client, assembly);
    request::Request read;
    Duration timeout{};
    if (const char* why = from_wire(request, read, timeout)) {
      return refuse(request, Refusal::bad_request, why);
    }
    if (client.assemblies.size() >= limits_.assemblies) {
      drop_assembly(client, client.assemblies.begin());
    }
    client.assemblies.push_back({request.id(), std::move(read), timeout, {}});
    assembly = std::prev(client.assemblies.end());
  } else if (assembly == client.assemblies.end() || assembly->data.size() != request.offset()) {
    const std::size_t have = assembly == client.assemblies.end() ? 0 : assembly->data.size();
    if (assembly != client.assemblies.end())
      drop_assembly(client, assembly);
    return refuse(request, Refusal::bad_request,
                  "the chunk at offset " + std::to_string(request.offset()) + " follows " +
                      std::to_string(have) + " bytes: send all again from offset 0");
  }
  if (assembly->data.size() + request.data().size() > limits_.request) {
    drop_assembly(client, assembly);
    return refuse(request, Refusal::bad_request, "the data of the request are too long");
  }
  if (request_bytes_ + request.data().size() > limits_.requests) {
    drop_assembly(client, assembly);
    return refuse(request, Refusal::busy, "too many long requests at once");
  }
  append_bytes(request.data(), assembly->data);
  request_bytes_ += request.data().size();
  if (!request.last())
    return {};
  Assembly whole = std::move(*assembly);
  request_bytes_ -= whole.data.size();
  client.assemblies.erase(assembly);
  return accept(client, request, from, partition, std::move(whole));
}

CommandDesk::Outcome CommandDesk::accept(Client& client, const v1::CommandRequest& request,
                                         const Sender& from, const std::string& partition,
                                         Assembly assembly) {
  const std::size_t bytes = assembly.data.size();
  if (const char* why = decode_data(std::move(assembly.data), assembly.request))
    return refuse(request, Refusal::bad_request, why);
  if (client.pending.size() >= limits_.pending)
    return refuse(request, Refusal::busy, "");
  if (bytes > limits_.data - client.pending_bytes)
    return refuse(request, Refusal::busy,
                  "unanswered requests of this client have too much data: repeat it later");
  if (bytes > limits_.all_data - pending_bytes_)
    return refuse(request, Refusal::busy,
                  "unanswered requests of all clients have too much data: repeat it later");
  const std::uint64_t tag = next_tag_++;
  client.pending.insert(request.id());
  client.pending_bytes += bytes;
  pending_bytes_ += bytes;
  ClientKey key{request.line().to_string(), request.client().to_string(), from};
  Outcome outcome;
  if (auto* const of_line = std::get_if<line::Request>(&assembly.request)) {
    line::Command command{.tag = tag, .timeout = assembly.timeout, .request = std::move(*of_line)};
    outcome.command =
        CommandMessage{key.line, key.client, request.layout_id(), std::move(command), {}};
  } else {
    request::GatewayCommand command{
        .tag = tag, .request = std::get<request::GatewayRequest>(std::move(assembly.request))};
    outcome.gateway_command = GatewayCommandMessage{key.line, key.client, std::move(command), {}};
  }
  pending_[tag] = {std::move(key), request.id(), partition, bytes};
  return outcome;
}

std::shared_ptr<const Answer> CommandDesk::answer(const line::Reply& reply) {
  const auto pending = pending_.find(reply.tag);
  if (pending == pending_.end())
    return nullptr;
  const Pending asked = std::move(pending->second);
  pending_.erase(pending);
  pending_bytes_ -= asked.bytes;
  const auto client = clients_.find(asked.client);
  if (client == clients_.end() || client->second.pending.erase(asked.id) == 0)
    return nullptr;
  client->second.pending_bytes -= asked.bytes;

  auto answer = std::make_shared<Answer>();
  answer->line = asked.client.line;
  answer->client = asked.client.client;
  answer->id = asked.id;
  answer->partition = asked.partition;
  answer->error = reply.error;
  answer->data = encode_reply(reply.data);
  answer->text = describe_result(reply.error, answer->data);
  answer_bytes_ += answer->data.size();
  client->second.window.push_back(answer);
  if (client->second.window.size() > limits_.window)
    drop_oldest_answer(client->second);
  trim_answers();
  return answer;
}

// Drops the oldest answers of the client that has been silent the longest first.
void CommandDesk::trim_answers() {
  while (answer_bytes_ > limits_.answers) {
    Client* oldest = nullptr;
    for (auto& [key, client] : clients_) {
      if (client.window.empty())
        continue;
      if (oldest == nullptr || client.used < oldest->used)
        oldest = &client;
    }
    if (oldest == nullptr)
      return;
    drop_oldest_answer(*oldest);
  }
}

void CommandDesk::drop_oldest_answer(Client& client) {
  answer_bytes_ -= client.window.front()->data.size();
  client.window.pop_front();
}

CommandDesk::Client* CommandDesk::client_of(const ClientKey& key) {
  const auto known = clients_.find(key);
  if (known != clients_.end())
    return &known->second;
  if (clients_.size() >= limits_.clients && !make_room())
    return nullptr;
  return &clients_[key];
}

// Drops the client that has been silent the longest among those without a pending command. Returns
// false if there is none.
bool CommandDesk::make_room() {
  auto oldest = clients_.end();
  for (auto client = clients_.begin(); client != clients_.end(); ++client) {
    if (!client->second.pending.empty())
      continue;
    if (oldest == clients_.end() || client->second.used < oldest->second.used)
      oldest = client;
  }
  if (oldest == clients_.end())
    return false;
  drop(oldest);
  return true;
}

void CommandDesk::drop(std::map<ClientKey, Client>::iterator client) {
  for (const auto& answer : client->second.window)
    answer_bytes_ -= answer->data.size();
  for (const auto& assembly : client->second.assemblies) {
    request_bytes_ -= assembly.data.size();
  }
  clients_.erase(client);
}

void CommandDesk::drop_assembly(Client& client, std::list<Assembly>::iterator assembly) {
  request_bytes_ -= assembly->data.size();
  client.assemblies.erase(assembly);
}

}  // namespace linegate::dds
