// SPDX-License-Identifier: Apache-2.0
// A subscriber's half of the DDS contract (idl/linegate.idl), for the console and for tests.
//
// Everything happens in the caller's thread, within poll() and call(). All times in values given
// out are UTC nanoseconds since 1970-01-01 in the form of an Instant (Instant{} = never).
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/dds/clock_map.h"
#include "bridges/dds/guard/counters.h"
#include "bridges/dds/values.h"
#include "stack/base/diagnostic.h"
#include "stack/base/event.h"
#include "stack/image/layout.h"
#include "stack/image/snapshot.h"
#include "stack/line/command.h"
#include "stack/line/output_state.h"
#include "stack/line/output_write.h"
#include "stack/line/state.h"

namespace linegate::dds {

// Which line of which gateway a sample is from.
struct Source {
  std::string gateway;
  std::string line;
  std::uint64_t incarnation = 0;
  Instant time{};  // of the sample
  ClockQuality clock = ClockQuality::unknown;
};

// Where a command or an output goes.
struct Target {
  std::string gateway;
  std::string line;
  std::uint64_t incarnation = 0;  // 0 = any
};

struct CommandResult {
  std::uint64_t id = 0;
  line::Reply reply;  // tag is the id. no answer in time: Refusal::timed_out
  std::string text;   // the result in words, empty if done
};

// Called from within poll() and call(). What is not overridden is not subscribed to if
// ClientOptions says so.
class ClientListener {
 public:
  virtual ~ClientListener() = default;
  virtual void on_gateway(const Source&, const GatewayInfo&) {}  // Source::line is empty
  virtual void on_line(const Source&, const LineInfo&, const line::LineState&,
                       const std::vector<Property>&) {}
  virtual void on_node(const Source&, const NodeInfo&, const line::NodeState&,
                       const std::vector<Property>&) {}
  virtual void on_output_state(const Source&, const line::OutputState&) {}
  virtual void on_layout(const Source&, const image::Layout&) {}  // once complete
  // acquired = Source::time. A gap in snapshot.sequence: treat every entry as changed.
  virtual void on_image(const Source&, const image::Snapshot&) {}
  virtual void on_pdo(const Source&, const PdoUpdate&) {}
  // A gap in PdoReception::number: samples were lost on the way.
  virtual void on_reception(const Source&, const PdoReception&) {}
  virtual void on_event(const Source&, const Event&, std::string_view /*text*/,
                        const std::vector<Property>&) {}
  // The gateway that published this line has gone, or can no longer be reached.
  virtual void on_line_gone(std::string_view /*gateway*/, std::string_view /*line*/) {}
  // So many samples more could not be read, and were dropped.
  virtual void on_unreadable(std::uint64_t /*samples*/) {}
  // So many samples more were of lines beyond those that a client keeps (4096), and were dropped.
  virtual void on_left_out(std::uint64_t /*samples*/) {}
  // Answers to send(); those of call() are given there.
  virtual void on_reply(const Target&, const CommandResult&) {}
};

struct ClientOptions {
  std::string name;  // unique in the domain, up to 64 bytes; empty: host, process ID and a number
  std::uint32_t domain = 0;
  std::string profile_file;  // as GatewayOptions
  bool guard = true;         // judge what is received (bridges/dds/guard)
  bool gateways = true;      // which topics to subscribe to
  bool lines = true;
  bool nodes = true;
  bool output_states = true;
  bool layouts = true;
  bool images = true;
  bool pdos = true;
  bool receptions = true;
  bool events = true;
  bool commands = true;                             // CommandRequest and CommandReply
  bool outputs = false;                             // OutputWrite
  std::uint32_t output_strength = 0;                // ownership: the strongest writer wins
  Duration retry = std::chrono::milliseconds(250);  // an unanswered request is sent again
};

class Client {
 public:
  static Loaded<std::unique_ptr<Client>> make(const ClientOptions& options);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  // Waits until something was received and handled, wake() was called, or the timeout passed
  // (0 = does not wait), and sends unanswered requests again. Gives how many samples were handled.
  std::size_t poll(Duration timeout, ClientListener& listener);
  // Ends the present poll(), or the next one. The only call from any thread.
  void wake();

  // Sends a command; the answer comes to on_reply(), Refusal::timed_out at the latest after
  // `timeout` (command.timeout is the gateway's business). Gives the id, 0 if this client was made
  // without commands. command.tag is ignored. layout_id as in the contract.
  std::uint64_t send(const Target& target, const line::Command& command, Duration timeout,
                     std::uint64_t layout_id = 0);
  // The same, and waits for the answer. Other samples go to the listener meanwhile: the events that
  // the gateway told before it answered, too.
  CommandResult call(const Target& target, const line::Command& command, Duration timeout,
                     ClientListener& listener, std::uint64_t layout_id = 0);

  // Everything this client has to say about one group of outputs: only the last sample counts.
  // Send it again at least once within the deadline of the profile, or a weaker writer takes over.
  // False: out of the contract's bounds, or DDS did not take it.
  bool write_outputs(const Target& target, const line::OutputWrite& write);

  // Gateways seen by the endpoint that receives commands (outputs): 0 = nobody would hear.
  std::size_t command_peers() const;
  std::size_t output_peers() const;
  const std::string& name() const;
  // The gateways whose participants are discovered, whether or not a sample of them has come, and
  // for how long none has come or gone. From any thread.
  Peers peers() const;
  // What the guard received and dropped. From any thread.
  guard::Counters guard_counters() const;

 private:
  struct Impl;
  explicit Client(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace linegate::dds
