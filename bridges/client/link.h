// SPDX-License-Identifier: Apache-2.0
// The connection of a client to a DDS domain, as the client library sees it. gateway/client
// implements it with the subscriber's half of bridges/dds; tests with samples of their own.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "bridges/client/client.h"
#include "bridges/dds/client.h"
#include "bridges/request/request.h"
#include "stack/base/time.h"
#include "stack/line/output_write.h"

namespace linegate::client {

class Link {
 public:
  virtual ~Link() = default;
  // Passes received samples to the listener; returns at once if there are some or wake() was
  // called.
  virtual void poll(linegate::Duration timeout, dds::ClientListener& listener) = 0;
  virtual void wake() = 0;  // from any thread
  // The answer is passed to ClientListener::on_reply(), after the time-out a refusal. Returns its
  // id; 0: no commands can be sent.
  virtual std::uint64_t send(const dds::Target& target, const request::Request& request,
                             linegate::Duration timeout, std::uint64_t layout_id) = 0;
  // No answer is passed on any more.
  virtual void cancel(std::uint64_t id) = 0;
  virtual bool write_outputs(const dds::Target& target, const line::OutputWrite& write) = 0;
  virtual dds::Peers peers() const = 0;
  virtual std::string name() const = 0;
  // A clock that never goes back, and the wall clock.
  virtual Instant now() const = 0;
  virtual std::int64_t utc() const = 0;
};

// A client with that link.
std::shared_ptr<Core> make_core(std::unique_ptr<Link> link, std::string error = {});
Client make_client(std::shared_ptr<Core> core);

}  // namespace linegate::client
