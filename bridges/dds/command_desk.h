// SPDX-License-Identifier: Apache-2.0
// Assembles requests from chunks, detects duplicates, and keeps answers. No DDS except the types of
// the contract.
//
// Every table is bounded: a client that sends malformed requests, or never completes one, receives
// a refusal and does not affect other clients.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <linegate.h>

#include "bridges/dds/publisher.h"
#include "bridges/request/request.h"
#include "stack/line/command.h"

namespace linegate::dds {

struct DeskLimits {
  std::size_t clients = 1'024;        // of all lines; a name of two participants counts twice
  std::size_t window = 256;           // answers kept for each
  std::size_t pending = 256;          // commands in progress of each
  std::size_t assemblies = 4;         // incomplete requests of each
  std::size_t request = 16U << 20U;   // bytes of data in one request
  std::size_t answers = 64U << 20U;   // bytes of data in all kept answers
  std::size_t requests = 64U << 20U;  // bytes of data in all incomplete requests
  // Bytes of data in commands in progress, those that wait included: of each client, and of all.
  std::size_t data = 64U << 20U;
  std::size_t all_data = 256U << 20U;
};

// The answer to a command, as sent to its client.
struct Answer {
  std::string line;
  std::string client;
  std::uint64_t id = 0;
  Error error;
  std::string text;
  std::vector<std::byte> data;
  std::string partition{};  // see take()
};

class CommandDesk {
 public:
  CommandDesk(std::uint64_t incarnation, std::vector<std::string> lines, DeskLimits limits = {});

  // The lines that accept commands. Commands that were accepted before remove_line() are still
  // answered.
  void add_line(const std::string& line) { lines_.insert(line); }
  void remove_line(const std::string& line) { lines_.erase(line); }

  // The result of a request sample: any combination except an answer with a command. At most one
  // command. Empty for a chunk that is not the last, and for a duplicate of a command in progress.
  struct Outcome {
    std::optional<CommandMessage> command;                 // complete and new: execute it
    std::optional<GatewayCommandMessage> gateway_command;  // the same for one of the gateway
    std::shared_ptr<const Answer> answer;  // send it, from offset answer_from of its data
    std::size_t answer_from = 0;
    line::Refusal refused = line::Refusal::none;  // the answer is a refusal by the desk
  };
  // from: the participant that sent it. Requests of two participants never affect each other, even
  // if they name the same client. partition: of the answers to that participant (security.h); empty
  // without DDS-Security.
  using Sender = decltype(Participant::prefix);
  Outcome take(const v1::CommandRequest& request, const Sender& from,
               const std::string& partition = {});

  // Keeps and returns the answer to the command with that tag; nullptr if no such command is in
  // progress.
  std::shared_ptr<const Answer> answer(const line::Reply& reply);

 private:
  struct ClientKey {
    std::string line;
    std::string client;
    Sender from{};

    auto operator<=>(const ClientKey&) const = default;
  };
  struct Assembly {
    std::uint64_t id = 0;
    request::Request request;  // without its data
    Duration timeout{};
    std::vector<std::byte> data;
  };
  struct Client {
    std::list<Assembly> assemblies;  // oldest first
    std::set<std::uint64_t> pending;
    std::size_t pending_bytes = 0;
    std::deque<std::shared_ptr<const Answer>> window;  // oldest first
    std::uint64_t used = 0;  // number of the request that the client sent last
  };
  struct Pending {
    ClientKey client;
    std::uint64_t id = 0;
    std::string partition;
    std::size_t bytes = 0;  // of its data
  };

  Outcome refuse(const v1::CommandRequest& request, line::Refusal refusal, std::string why);
  const char* admit(const v1::CommandRequest& request, line::Refusal& refusal) const;
  Client* client_of(const ClientKey& key);
  bool make_room();
  void drop(std::map<ClientKey, Client>::iterator client);
  void drop_assembly(Client& client, std::list<Assembly>::iterator assembly);
  Outcome handle(const v1::CommandRequest& request, const Sender& from,
                 const std::string& partition);
  Outcome append(Client& client, const v1::CommandRequest& request, const Sender& from,
                 const std::string& partition);
  Outcome accept(Client& client, const v1::CommandRequest& request, const Sender& from,
                 const std::string& partition, Assembly assembly);
  void trim_answers();
  void drop_oldest_answer(Client& client);

  std::uint64_t incarnation_;
  std::set<std::string> lines_;
  DeskLimits limits_;
  std::map<ClientKey, Client> clients_;
  std::map<std::uint64_t, Pending> pending_;  // by tag
  std::uint64_t next_tag_ = 1;
  std::uint64_t requests_ = 0;
  std::size_t answer_bytes_ = 0;
  std::size_t request_bytes_ = 0;
  std::size_t pending_bytes_ = 0;
};

}  // namespace linegate::dds
