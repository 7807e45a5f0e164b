// SPDX-License-Identifier: Apache-2.0
// The subscriber's half of the DDS contract (idl/linegate.idl), for the console and for tests.
//
// Everything runs in the caller's thread, within poll() and call(). All times that it returns are
// UTC nanoseconds since 1970-01-01 in the form of an Instant (Instant{} = never).
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/dds/clock_map.h"
#include "bridges/dds/discovery_record.h"
#include "bridges/dds/guard/counters.h"
#include "bridges/dds/guard/stall.h"
#include "bridges/dds/network_choice.h"
#include "bridges/dds/security.h"
#include "bridges/dds/values.h"
#include "bridges/request/request.h"
#include "stack/base/diagnostic.h"
#include "stack/base/event.h"
#include "stack/image/layout.h"
#include "stack/image/snapshot.h"
#include "stack/line/command.h"
#include "stack/line/output_state.h"
#include "stack/line/output_write.h"
#include "stack/line/state.h"

namespace linegate::dds {

// The gateway and line that published a sample.
struct Source {
  std::string gateway;
  std::string line;
  std::uint64_t incarnation = 0;
  Instant time{};  // of the sample
  ClockQuality clock = ClockQuality::unknown;
};

// The gateway and line that a command or an output is addressed to.
struct Target {
  std::string gateway;
  std::string line;
  std::uint64_t incarnation = 0;  // 0 = any
};

struct CommandResult {
  std::uint64_t id = 0;
  line::Reply reply;  // tag is the id; Refusal::timed_out if no answer arrived in time
  std::string text;   // description of the error; empty if done
  // The data of the reply as received. If they do not match the request, reply.data holds them too.
  std::vector<std::byte> bytes{};
};

// Called within poll() and call(). ClientOptions selects the topics to subscribe to.
class ClientListener {
 public:
  virtual ~ClientListener() = default;
  virtual void on_gateway(const Source&, const GatewayInfo&) {}  // Source::line is empty
  virtual void on_line(const Source&, const LineInfo&, const line::LineState&,
                       const std::vector<Property>&) {}
  virtual void on_node(const Source&, const NodeInfo&, const line::NodeState&,
                       const std::vector<Property>&) {}
  virtual void on_output_state(const Source&, const line::OutputState&) {}
  // Called once all parts of the layout were received
  virtual void on_layout(const Source&, const image::Layout&) {}
  // acquired is Source::time. After a gap in snapshot.sequence, treat every entry as changed.
  virtual void on_image(const Source&, const image::Snapshot&) {}
  virtual void on_pdo(const Source&, const PdoUpdate&) {}
  // A gap in PdoReception::number means that samples were lost.
  virtual void on_reception(const Source&, const PdoReception&) {}
  virtual void on_event(const Source&, const ReceivedEvent&, std::string_view /*text*/,
                        const std::vector<Property>&) {}
  // With complete_events: those numbers of the stream were not used, or their events are lost.
  // Before the next event of the line.
  virtual void on_events_missing(const Source&, std::uint64_t /*stream*/, std::uint64_t /*first*/,
                                 std::uint64_t /*last*/) {}
  // With complete_events: the next events of the line have numbers of another stream. lost: the
  // journal has no event of the line with the stream before, as after its loss, or there is none.
  virtual void on_event_stream(const Source&, std::uint64_t /*before*/, std::uint64_t /*now*/,
                               bool /*lost*/) {}
  // The line was removed, or the gateway that published it has left or is unreachable.
  virtual void on_line_gone(std::string_view /*gateway*/, std::string_view /*line*/) {}
  // The gateway continues without that node (or group of outputs), as after a reload. Those of a
  // line that is gone, and of an earlier incarnation of the gateway, need not be reported.
  virtual void on_node_gone(std::string_view /*gateway*/, std::string_view /*line*/,
                            std::uint8_t /*node*/) {}
  virtual void on_output_state_gone(std::string_view /*gateway*/, std::string_view /*line*/,
                                    std::uint16_t /*group*/) {}
  // `samples` more samples could not be deserialized and were dropped.
  virtual void on_unreadable(std::uint64_t /*samples*/) {}
  // `samples` more samples were dropped because they belong to lines beyond the 4096 that a client
  // keeps.
  virtual void on_left_out(std::uint64_t /*samples*/) {}
  // Answers to send(). call() returns its answer itself.
  virtual void on_reply(const Target&, const CommandResult&) {}
};

// Whether it is "GATEWAY/LINE", without wildcards of partitions.
bool is_line_name(std::string_view text);

struct ClientOptions {
  std::string name;  // unique in the domain, up to 64 bytes; empty: host, process ID and a number
  std::uint32_t domain = 0;
  std::string profile_file;  // see GatewayOptions
  NetworkChoice network{};   // beside the profile
  bool guard = true;         // check received datagrams (bridges/dds/guard)
  // Receive these lines alone, "GATEWAY/LINE", of gateways with GatewayOptions::partitions, and
  // nothing of others. Empty: all. Only without DDS-Security.
  std::vector<std::string> only{};
  bool gateways = true;  // which topics to subscribe to
  bool lines = true;
  bool nodes = true;
  bool output_states = true;
  bool layouts = true;
  bool images = true;
  bool pdos = true;
  bool receptions = true;
  bool events = true;
  // Passes the events of each line to on_event() in order, each once, and reads those that this
  // client missed from the journal of the gateway. Needs events and commands. An event after a gap
  // is passed on when the journal does not have what is missing for 5 s, or at once if the gateway
  // has no journal.
  bool complete_events = false;
  // A line begins with the oldest event in the journal, instead of the first that is received.
  bool events_from_oldest = false;
  bool commands = true;               // CommandRequest and CommandReply; implies gateways and lines
  bool outputs = false;               // OutputWrite
  std::uint32_t output_strength = 0;  // ownership strength: the strongest writer wins
  // A client that sends requests writes those to each line in a partition of their own. A command
  // to a line that its permissions do not name is answered with Refusal::not_permitted.
  Security security{};
  // Receives the participants and endpoints that are discovered; nullptr: not recorded.
  std::shared_ptr<DiscoveryRecord> record{};
  // Pause before an unanswered request is repeated
  Duration retry = std::chrono::milliseconds(250);
  // Makes the participant anew when the host gets an address that the present one was created
  // without: Fast DDS 2.9.1 uses the interfaces that have a carrier and an address at that moment,
  // and no other for ever (participant_change.h). Not over TCP. Then peers(), longest_stall() and
  // guard_counters() may be called from the thread of poll() alone.
  bool follow_interfaces = false;
  // The client is part of a gateway. Events are passed on only of the participant that publishes
  // the state of their line (event_filter.h), without text and properties. Its requests are carried
  // out at most once, and not after their time-outs (request_tracker.h); a request that is not
  // acknowledged is not kept by DDS. Its writer is not volatile, because Fast DDS may then deadlock
  // when a gateway leaves (idl/README.md); readers of requests are, so none of them is received
  // late.
  bool of_gateway = false;
};

class Client {
 public:
  static Loaded<std::unique_ptr<Client>> make(const ClientOptions& options);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  // Waits until samples were received and handled, wake() was called, or the timeout passed (0 =
  // does not wait), and repeats unanswered requests. Returns the number of handled samples.
  std::size_t poll(Duration timeout, ClientListener& listener);
  // Ends the present poll(), or the next one. From any thread.
  void wake();

  // With follow_interfaces: poll() makes another participant, as if the host got an address.
  void change_participant();
  // The number of the participant that is used, from 1.
  std::uint64_t participants() const;

  // The line begins after that event (ReceivedEvent::stream and number): what follows it was
  // missed. Call it before the first poll(). Only with complete_events.
  void begin_events_after(const std::string& gateway, const std::string& line,
                          request::EventPosition position);

  // Sends a command. on_reply() receives the answer, or Refusal::timed_out at the latest after
  // `timeout`, which is independent of command.timeout, the time limit of the gateway. Returns the
  // id, or 0 if this client was created without commands. If several participants publish the line,
  // the answer is Refusal::not_permitted with their hosts and GUID prefixes, and nothing is sent.
  // command.tag is ignored. layout_id: see the contract.
  std::uint64_t send(const Target& target, const line::Command& command, Duration timeout,
                     std::uint64_t layout_id = 0);
  // The same for a request of either kind; command_timeout: line::Command::timeout.
  std::uint64_t send_request(const Target& target, const request::Request& request,
                             Duration command_timeout, Duration timeout,
                             std::uint64_t layout_id = 0);
  // With DDS-Security: creates the writer of requests to that line, so that the gateway has matched
  // it when the first one is sent. No effect otherwise.
  void prepare(const Target& target);
  // Ends a request that was sent without an answer, and repeats it no more. No effect if it is
  // answered. The gateway may carry it out nevertheless.
  void cancel(std::uint64_t id);
  // Like send(), and waits for the answer. Meanwhile the listener receives all other samples,
  // including the events that the gateway published before it answered.
  CommandResult call(const Target& target, const line::Command& command, Duration timeout,
                     ClientListener& listener, std::uint64_t layout_id = 0);
  // Like call(), for a request that the gateway executes itself.
  CommandResult call_gateway(const Target& target, const request::GatewayRequest& request,
                             Duration timeout, ClientListener& listener);

  // Publishes all output values of this client for one group: only the last sample counts. Repeat
  // it at least once within the deadline of the profile, or a weaker writer takes over. Returns
  // false if the values exceed the contract's bounds, or DDS refused the sample.
  bool write_outputs(const Target& target, const line::OutputWrite& write);

  // Number of matched gateway endpoints that receive commands (or outputs); 0: nothing would be
  // received. With DDS-Security: those of the lines to which this client has sent one before.
  std::size_t command_peers() const;
  std::size_t output_peers() const;
  // Number of matched gateway endpoints that send layouts; 0: none arrives.
  std::size_t layout_peers() const;
  const std::string& name() const;
  // Number of replies to requests of this client that were ignored, because their sender does not
  // publish the LineState of that line (for the gateway itself: its GatewayState), or because
  // several participants publish it.
  std::uint64_t foreign_replies() const;
  // Number of samples that were ignored, because their writer has not the certificate of the
  // gateway that they name (Security::is_holder).
  std::uint64_t foreign_samples() const;
  // The gateways whose participants are discovered, whether or not a sample of them was received,
  // and for how long this list has not changed. From any thread.
  Peers peers() const;
  // The readers of this client, as others discover them.
  std::vector<ObservedEndpoint> own_readers() const;
  // See SamplePort. longest_stall() from any thread.
  guard::Stall longest_stall() const;
  void watch_timers();
  // The number of datagrams that the guard received and dropped. From any thread.
  guard::Counters guard_counters() const;

 private:
  struct Impl;
  explicit Client(std::unique_ptr<Impl> impl);
  // Waits for the answer to the request with that id; 0: it was not sent.
  CommandResult wait_for(std::uint64_t id, Duration timeout, ClientListener& listener);
  std::unique_ptr<Impl> impl_;
};

}  // namespace linegate::dds
