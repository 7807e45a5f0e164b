// SPDX-License-Identifier: Apache-2.0
// Messages to and from the process that has the DDS endpoints. The gateway implements it, because
// it starts that process again whenever it ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "stack/base/diagnostic.h"
#include "stack/base/time.h"

namespace linegate::dds {

// Identifies one start of the process: 1, 2, 3, ...; 0: it does not run.
using ProcessNumber = std::uint64_t;

// Longer messages are never sent.
inline constexpr std::size_t kLongestMessage = 4'000'000;

// Memory that a link can pass to the process; this bridge does not read it.
class SharedFiles {
 public:
  virtual ~SharedFiles() = default;
};

class MessageLink {
 public:
  virtual ~MessageLink() = default;

  // From any thread.
  virtual ProcessNumber process() const = 0;
  // Returns false if there is no room, or that process no longer runs. Never waits. From one thread
  // at a time.
  virtual bool send(ProcessNumber process, std::span<const std::byte> message) = 0;
  // The same for memory, before a message with that tag.
  virtual bool share(ProcessNumber process, std::uint64_t tag,
                     const std::shared_ptr<SharedFiles>& files) = 0;
  // In octets since the start of the process: behind the last message that was sent, and behind the
  // last one that the process has carried out.
  struct Positions {
    std::uint64_t sent = 0;
    std::uint64_t done = 0;
  };
  virtual Positions positions(ProcessNumber process) = 0;

  // Returns the next message of the process that runs now, and its number; 0 if there is none. From
  // one thread at a time. The message may contain anything.
  virtual ProcessNumber receive(std::vector<std::byte>& message) = 0;
  // Waits until a message may have arrived, another process was started, wake() was called, or the
  // timeout passed.
  virtual void wait(Duration timeout) = 0;
  // From any thread.
  virtual void wake() = 0;

  // The process has sent what no working process sends: it is replaced.
  virtual void reject(ProcessNumber process, std::string_view reason) = 0;
  // That process was asked to end, and is replaced when it has ended, or after a time. From any
  // thread.
  virtual void replace(ProcessNumber process, std::string_view reason) = 0;
  // Adds an entry to the log.
  virtual void log(Severity severity, std::string_view text) = 0;
  // Ends the process, which was asked to end, within `limit`.
  virtual void finish(Duration limit) = 0;
};

}  // namespace linegate::dds
