// SPDX-License-Identifier: Apache-2.0
// What a line offers beside process data is a service: boot, configuration, program download, ...
// Each has its commands, its state and its deadlines, and the line calls them all alike.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "stack/base/time.h"
#include "stack/line/command.h"
#include "stack/line/frames_under_way.h"

namespace linegate::line {

// The line, as a service sees it.
class ServiceHost {
 public:
  ServiceHost() = default;
  ServiceHost(const ServiceHost&) = delete;
  ServiceHost& operator=(const ServiceHost&) = delete;
  virtual ~ServiceHost() = default;

  // The one reply to the command with that tag.
  virtual void reply(std::uint64_t tag, Error error, std::vector<std::byte> data) = 0;
  // The same for a command that is not carried out: reply and event.
  virtual void refuse(const Command& command, Refusal refusal, Instant now) = 0;
  // A Refusal refuses the command, any other error or none is its reply.
  void answer(const Command& command, Error error, std::vector<std::byte> data, Instant now) {
    if (error.domain == Domain::command) {
      refuse(command, static_cast<Refusal>(error.code), now);
    } else {
      reply(command.tag, error, std::move(data));
    }
  }
  // The reply of a service that is not confirmed: when the bus acknowledged its frames, otherwise
  // see Service::answer_unsent(). Refusals: busy (FramesUnderWay::kMost commands wait).
  virtual void answer_when_sent(FramesUnderWay::Sending sending, Instant now) = 0;
  // Refuses commands of that kind which wait for a frame that is gone: it was dropped before it was
  // handed to the bus.
  virtual void refuse_unsent(CommandKind kind, Refusal why, Instant now) = 0;
  // Frames are under way for long, or the bus takes none.
  virtual bool bus_is_stuck(Instant now) const = 0;
  // It was started, and not stopped since.
  virtual bool is_running() const = 0;
  // Frames can be sent and received.
  virtual bool usable() const = 0;
  // The line is NMT master.
  virtual bool manages() const = 0;
};

class Service {
 public:
  explicit Service(ServiceHost& host) : host_(host) {}
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;
  virtual ~Service() = default;

  // The kinds of commands that the line hands to execute(): none, unless both are overridden.
  virtual std::span<const CommandKind> commands() const { return {}; }
  // Its commands are those of an NMT master: when the line becomes a slave it ends them.
  virtual bool needs_master() const { return true; }
  // Each command gets exactly one reply, now or later.
  virtual void execute(Command command, Instant now) {
    host_.refuse(command, Refusal::bad_request, now);
  }
  // Called after something came in and when next_wake() is due.
  virtual void advance(Instant now) = 0;
  // kNever: not before something comes in.
  virtual Instant next_wake() const = 0;
  // Ends every command under way with that reply.
  virtual void end(Refusal why, Instant now) = 0;

  // The bus did not acknowledge all frames of one of its commands in time: the reply. By default
  // the refusal no_acknowledge.
  virtual void answer_unsent(FramesUnderWay::Sending& sending, Instant now) {
    host_.refuse(sending.command, Refusal::no_acknowledge, now);
  }
  // The own node boots next: what it had queued is gone.
  virtual void before_boot(Instant /*now*/) {}

 protected:
  ServiceHost& host() const { return host_; }

 private:
  ServiceHost& host_;
};

}  // namespace linegate::line
