// SPDX-License-Identifier: Apache-2.0
// The pending requests of a client: schedules repetitions and assembles answers from chunks. No DDS
// except the types of the contract.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include <linegate.h>

#include "bridges/dds/client.h"
#include "stack/base/time.h"

namespace linegate::dds {

struct Request {
  Target target;
  line::Command command;
  std::vector<std::byte> data;  // of the command
  std::uint64_t id = 0;
  std::uint64_t layout_id = 0;
  Instant deadline{};  // time at which the request times out
};

class RequestTracker {
 public:
  // retry: pause before the first repetition. It doubles with each repetition, up to 16 times, and
  // for requests in several chunks up to 256 times, because each repetition sends all chunks.
  explicit RequestTracker(Duration retry) : retry_(retry) {}

  void add(Request request, Instant now);
  bool empty() const { return waiting_.empty(); }

  struct Done {
    Target target;
    CommandResult result;
  };
  // Processes a reply to any client. Returns the answer once it is complete.
  std::optional<Done> take(const v1::CommandReply& reply, Instant now);

  // Returns the next request to be sent (again) now, or nullptr. It is sent completely, or, if
  // reply_offset() > 0, only its head, to fetch the rest of its answer. Valid until the next call.
  const Request* due(Instant now);
  std::uint32_t reply_offset(std::uint64_t id) const;
  std::optional<Done> expired(Instant now);
  Instant next_wake() const;

 private:
  struct Waiting {
    Request request;
    CommandResult result;    // the part received so far
    Instant send_at{};       // time of the next transmission
    unsigned sent = 0;       // number of transmissions
    std::size_t chunks = 0;  // received since it was last sent
  };
  Done finish(std::map<std::uint64_t, Waiting>::iterator waiting);

  Duration retry_;
  std::map<std::uint64_t, Waiting> waiting_;  // by id
};

}  // namespace linegate::dds
