// SPDX-License-Identifier: Apache-2.0
// A client's requests that wait for their answers: when to send again, and answers put together
// from chunks. Pure bookkeeping, no DDS in here but the types of the contract.
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
  std::uint64_t id = 0;
  std::uint64_t layout_id = 0;
  Instant deadline{};  // then it has timed out
};

class RequestTracker {
 public:
  // retry: pause before the first repetition; each further one is twice as long, up to 16 times, of
  // requests in several chunks up to 256 times: all of it is sent again each time.
  explicit RequestTracker(Duration retry) : retry_(retry) {}

  void add(Request request, Instant now);
  bool empty() const { return waiting_.empty(); }

  struct Done {
    Target target;
    CommandResult result;
  };
  // A sample of any client's. Gives the answer once it is complete.
  std::optional<Done> take(const v1::CommandReply& reply, Instant now);

  // The next request to be sent (again) now, or nullptr: the whole, or if reply_offset() > 0 the
  // head alone, to fetch the rest of its answer. Valid until the next call.
  const Request* due(Instant now);
  std::uint32_t reply_offset(std::uint64_t id) const;
  std::optional<Done> expired(Instant now);
  Instant next_wake() const;

 private:
  struct Waiting {
    Request request;
    CommandResult result;    // as far as it has come
    Instant send_at{};       // when it is due
    unsigned sent = 0;       // how often
    std::size_t chunks = 0;  // received since it was last sent
  };
  Done finish(std::map<std::uint64_t, Waiting>::iterator waiting);

  Duration retry_;
  std::map<std::uint64_t, Waiting> waiting_;  // by id
};

}  // namespace linegate::dds
