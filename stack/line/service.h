// SPDX-License-Identifier: Apache-2.0
// A service is a part of a line besides process data: boot, configuration, program download, ...
// Each has its commands, its state and its deadlines, and the line calls all of them in the same
// way.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "stack/base/time.h"
#include "stack/line/command.h"
#include "stack/line/frames_under_way.h"

namespace linegate::line {

class Service;

// The interface of the line for its services.
class ServiceHost {
 public:
  ServiceHost() = default;
  ServiceHost(const ServiceHost&) = delete;
  ServiceHost& operator=(const ServiceHost&) = delete;
  virtual ~ServiceHost() = default;

  // Sends the one reply to the command with that tag.
  virtual void reply(std::uint64_t tag, Error error, ReplyData data) = 0;
  // Refuses a command: sends the reply, with the data, and emits an event.
  // node: that of the event; 0 = the node that the command names.
  virtual void refuse(const Command& command, Refusal refusal, Instant now, std::uint8_t node = 0,
                      ReplyData data = {}) = 0;
  // Refuses the command if the error is a Refusal; otherwise replies with the error, or without
  // one.
  void answer(const Command& command, Error error, ReplyData data, Instant now) {
    if (error.domain == Domain::command) {
      refuse(command, static_cast<Refusal>(error.code), now);
    } else {
      reply(command.tag, error, std::move(data));
    }
  }
  // Replies to a command of an unconfirmed service when the bus acknowledged its frames; otherwise
  // see Service::answer_unsent(). Refusals: busy (FramesUnderWay::kMost commands wait).
  virtual void answer_when_sent(FramesUnderWay::Sending sending, Instant now) = 0;
  // Refuses commands of that kind whose frame was dropped before it was handed to the bus.
  virtual void refuse_unsent(CommandKind kind, Refusal why, Instant now) = 0;
  // The values that those commands wrote are gone: refuses the commands whose frame was not handed
  // to the bus.
  virtual void refuse_gone(const std::function<bool(const Command&)>& is_gone, Refusal why,
                           Instant now) = 0;
  // Whether frames have been under way for too long, or the bus accepts none.
  virtual bool bus_is_stuck(Instant now) const = 0;
  // Whether the line was started, and not stopped since.
  virtual bool is_running() const = 0;
  // Whether frames can be sent and received.
  virtual bool usable() const = 0;
  // Whether the line is NMT master.
  virtual bool manages() const = 0;
  // Whether the network sleeps, or prepares to: nothing is started, and no process data is sent.
  virtual bool sleeps() const { return false; }
  // Whether another master lets the nodes sleep, see SleepService::others_sleep().
  virtual bool others_sleep() const { return false; }
  // Whether it sleeps so that nothing at all is sent.
  virtual bool is_silent() const { return false; }

 protected:
  // The services of this host, in the order in which they were created.
  std::span<Service* const> services() const { return services_; }

 private:
  friend class Service;

  std::vector<Service*> services_;
};

class Service {
 public:
  // Adds itself to the services of the host, which must outlive it.
  explicit Service(ServiceHost& host) : host_(host) { host.services_.push_back(this); }
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;
  virtual ~Service() { std::erase(host_.services_, this); }

  // The kinds of commands that the line passes to execute(). Override both functions or neither.
  virtual std::span<const CommandKind> commands() const { return {}; }
  // Whether its commands are those of an NMT master: the line ends them when it becomes a slave.
  virtual bool needs_master() const { return true; }
  // Each command gets exactly one reply, now or later.
  virtual void execute(Command command, Instant now) {
    host_.refuse(command, Refusal::bad_request, now);
  }
  // Called after any input and when next_wake() is due.
  virtual void advance(Instant now) = 0;
  // kNever: not before the next input.
  virtual Instant next_wake() const = 0;
  // Ends every command under way with that refusal.
  virtual void end(Refusal why, Instant now) = 0;

  // The bus did not acknowledge all frames of one of its commands in time: sends the reply. By
  // default the refusal no_acknowledge.
  virtual void answer_unsent(FramesUnderWay::Sending& sending, Instant now) {
    host_.refuse(sending.command, Refusal::no_acknowledge, now);
  }
  // The own node is about to boot: its queued frames are gone.
  virtual void before_boot(Instant /*now*/) {}

 protected:
  ServiceHost& host() const { return host_; }

 private:
  ServiceHost& host_;
};

}  // namespace linegate::line
