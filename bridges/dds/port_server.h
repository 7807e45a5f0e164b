// SPDX-License-Identifier: Apache-2.0
// The other end of a RemotePort: carries out its messages with the endpoints of this process.
//
// Passive: handle() from one thread, poll() from another, wake() from any.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "bridges/dds/clock_map.h"
#include "bridges/dds/guard/stall.h"
#include "bridges/dds/security.h"
#include "stack/base/time.h"
#include "stack/image/snapshot.h"

namespace linegate::dds {

class PortServer {
 public:
  using Message = std::span<const std::byte>;  // see port_codec.h
  // Sends a message; returns false if there is no room.
  using Send = std::function<bool(Message message)>;

  virtual ~PortServer() = default;

  // Creates the endpoints that the first message describes, and sends FromEndpoints::ready or
  // failed. Returns nullptr if it failed. add_functions: sets those that the message cannot
  // contain.
  using AddFunctions = std::function<void(Security& security)>;
  static std::unique_ptr<PortServer> make(Message configure, const Send& send,
                                          const AddFunctions& add_functions = {});

  // Returns false if the message asks to end, or is malformed.
  virtual bool handle(Message message) = 0;

  // Publishes an image of the line that it has received otherwise (ToEndpoints::share_images). From
  // the thread that calls handle().
  virtual void publish(std::string_view line, const image::Snapshot& snapshot,
                       const ClockMap& clock) = 0;
  // What a message asks for besides handle(), which is called afterwards.
  struct SharedImages {
    std::uint64_t tag = 0;  // see MessageLink::share()
    std::string line;
  };
  static std::optional<SharedImages> shared_images(Message message);
  // The line that it removes.
  static std::optional<std::string> removed_line(Message message);

  // Calls `changed` when look_at_readers() may have something to do, in threads of Fast DDS, which
  // it must not block. Call it before handle().
  virtual void watch_readers(std::function<void()> changed) = 0;
  virtual bool readers_changed() const = 0;
  // Finds out which named topics have readers, and lets poll() report it. From the thread that
  // calls handle().
  virtual void look_at_readers() = 0;

  // Waits for samples, at most `timeout`, and sends them, and changes of the status. Returns false
  // if there was no room: try again soon.
  virtual bool poll(Duration timeout, const Send& send) = 0;
  // Ends the present poll(), or the next one.
  virtual void wake() = 0;

  // See SamplePort::longest_stall().
  virtual guard::Stall longest_stall() const = 0;
};

}  // namespace linegate::dds
