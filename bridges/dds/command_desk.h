// SPDX-License-Identifier: Apache-2.0
// Where requests are put together from chunks, told from their duplicates, and where answers are
// kept. Pure bookkeeping: no DDS in here but the types of the contract.
//
// Bounded in every direction: a stranger who sends rubbish, or never ends a request, costs himself
// a refusal and nobody else anything.
#pragma once

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
#include "stack/line/command.h"

namespace linegate::dds {

struct DeskLimits {
  std::size_t clients = 1'024;        // pairs of line and client
  std::size_t window = 256;           // answers kept of each
  std::size_t pending = 256;          // commands of each under way
  std::size_t assemblies = 4;         // requests of each being put together
  std::size_t request = 16U << 20U;   // bytes of data in one request
  std::size_t answers = 64U << 20U;   // bytes of data in all answers kept
  std::size_t requests = 64U << 20U;  // bytes of data in all requests being put together
};

// What goes back to a client.
struct Answer {
  std::string line;
  std::string client;
  std::uint64_t id = 0;
  Error error;
  std::string text;
  std::vector<std::byte> data;
};

class CommandDesk {
 public:
  CommandDesk(std::uint64_t incarnation, std::vector<std::string> lines, DeskLimits limits = {});

  // Whose commands are taken. What was accepted before is still answered.
  void add_line(const std::string& line) { lines_.insert(line); }
  void remove_line(const std::string& line) { lines_.erase(line); }

  // What a request sample leads to: any combination but command with answer; nothing for a chunk
  // that is not the last, and for a duplicate of what is still under way.
  struct Outcome {
    std::optional<CommandMessage> command;  // complete and new: carry it out
    std::shared_ptr<const Answer> answer;   // send it, from byte answer_from of its data
    std::size_t answer_from = 0;
    line::Refusal refused = line::Refusal::none;  // the answer is a refusal made here
  };
  Outcome take(const v1::CommandRequest& request);

  // Keeps the answer of the command with that tag. nullptr: no such command is under way.
  std::shared_ptr<const Answer> answer(const line::Reply& reply);

 private:
  using ClientKey = std::pair<std::string, std::string>;  // line, client

  struct Assembly {
    std::uint64_t id = 0;
    line::Command command;
  };
  struct Client {
    std::list<Assembly> assemblies;  // oldest first
    std::set<std::uint64_t> pending;
    std::deque<std::shared_ptr<const Answer>> window;  // oldest first
    std::uint64_t used = 0;                            // when it last sent something, in requests
  };
  struct Pending {
    ClientKey client;
    std::uint64_t id = 0;
  };

  Outcome refuse(const v1::CommandRequest& request, line::Refusal refusal, std::string why);
  const char* admit(const v1::CommandRequest& request, line::Refusal& refusal) const;
  Client* client_of(const ClientKey& key);
  bool make_room();
  void drop(std::map<ClientKey, Client>::iterator client);
  void drop_assembly(Client& client, std::list<Assembly>::iterator assembly);
  Outcome append(Client& client, const v1::CommandRequest& request);
  Outcome accept(Client& client, const v1::CommandRequest& request, line::Command command);
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
};

}  // namespace linegate::dds
