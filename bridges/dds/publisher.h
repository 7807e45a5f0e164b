// SPDX-License-Identifier: Apache-2.0
// The gateway's half of the DDS contract (idl/linegate.idl): publishes lines, receives outputs and
// commands.
//
// Passive: it has no thread of its own, and calls the handler only within poll(). Fast DDS has its
// own threads, which never run code of the gateway. They inherit scheduling and affinity from the
// thread that calls make(), so call it from an ordinary thread.
//
// Three groups of calls may run at the same time, each from one thread at a time: set_clock() and
// publish...(); poll(); reply(). Any thread may call wake().
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/dds/clock_map.h"
#include "bridges/dds/guard/counters.h"
#include "bridges/dds/network_choice.h"
#include "bridges/dds/security.h"
#include "bridges/dds/values.h"
#include "bridges/named/device_types.h"
#include "bridges/named/group_types.h"
#include "bridges/request/request.h"
#include "stack/base/diagnostic.h"
#include "stack/base/event.h"
#include "stack/image/layout.h"
#include "stack/image/snapshot.h"
#include "stack/line/command.h"
#include "stack/line/output_state.h"
#include "stack/line/output_write.h"
#include "stack/line/state.h"
#include "stack/pdo/reception.h"

namespace linegate::dds {

class SharedFiles;

struct GatewayOptions {
  std::string gateway;            // up to 64 bytes
  std::uint64_t incarnation = 1;  // random for each start, not 0
  std::uint32_t domain = 0;       // 0..232
  // Fast DDS XML file. Empty: /etc/linegate/linegate-profiles.xml, else the installed file, else
  // the built-in copy.
  std::string profile_file;
  // Names. Images and events of other lines are not published, and commands for them are refused.
  std::vector<std::string> lines;
  // Number of samples, at least 2, after which a new writer replaces a writer: a late joiner
  // processes every sequence number of a writer.
  std::uint64_t renew_after = 8'000'000;
  // Number of other participants that are accepted at the same time, at least 1; 0: as in the
  // profile (allocation/total_participants, which includes this one), or kMostParticipants.
  std::size_t participants = 0;
  NetworkChoice network{};  // beside the profile
  // How long the destructor waits for readers that do not acknowledge (stopped, killed, or too
  // slow).
  Duration last_words = std::chrono::milliseconds(500);
  // Check received datagrams before Fast DDS reads them (bridges/dds/guard).
  bool guard = true;
  // Without `security`: what belongs to a line is published in the partition GATEWAY/LINE beside
  // the default one, everything else in GATEWAY/*, and requests are received in both.
  bool partitions = false;
  Security security{};
};

// A line of another gateway.
struct RemoteLine {
  std::string gateway;
  std::string line;

  friend auto operator<=>(const RemoteLine&, const RemoteLine&) = default;
};

// The line that a sample is of.
struct RemoteSource {
  RemoteLine line;
  std::uint64_t incarnation = 0;
};

struct OutputMessage {
  std::string line;
  std::string client;  // the name in the sample
  line::OutputWrite write;
  Participant from{};
  bool by_name = false;  // by the named topic of its group
};

struct CommandMessage {
  std::string line;
  std::string client;
  std::uint64_t layout_id = 0;  // for CommandKind::output_write; 0 = any
  line::Command command;        // tag is assigned by the bridge: return it in line::Reply::tag
  Participant from{};
};

// A command that the gateway executes itself.
struct GatewayCommandMessage {
  std::string line;  // any name for request::Versions and request::JournalRead
  std::string client;
  request::GatewayCommand command;  // as CommandMessage::command
  Participant from{};
};

// Of a request: names in the sample, and its sender.
struct RequestOrigin {
  std::string line;  // may be a name that does not exist
  std::string client;
  Participant from{};
};

// Called within poll().
class GatewayHandler {
 public:
  virtual ~GatewayHandler() = default;

  // Well-formed and for this incarnation; the line performs all other checks.
  virtual void on_output_write(OutputMessage message) = 0;
  // Complete (all chunks) and not a duplicate. Exactly one reply() is expected for each.
  virtual void on_command(CommandMessage message) = 0;
  virtual void on_gateway_command(GatewayCommandMessage message) = 0;

  // A sample that is malformed, or for another incarnation of the gateway. A refused command was
  // already answered.
  virtual void on_output_refused(const RequestOrigin& origin, std::uint16_t group,
                                 line::OutputRefusal refusal, std::string_view why) = 0;
  virtual void on_command_refused(const RequestOrigin& origin, std::uint8_t kind,
                                  line::Refusal refusal, std::string_view why) = 0;
  // `samples` more samples could not be deserialized. They are dropped.
  virtual void on_unreadable(std::uint64_t /*samples*/) {}
  // A writer of that topic has a QoS that is incompatible with the requested one, so none of its
  // samples are received: idl/README.md. policy: "ownership", ...
  virtual void on_misfit(std::string_view /*topic*/, std::string_view /*policy*/) {}

  // Of lines of other gateways that follow() names. time: of the sample, by the clock of its
  // gateway. A layout is complete and within its area; that an image belongs to it is not checked.
  virtual void on_remote_state(const RemoteSource& /*source*/, std::int64_t /*time*/) {}
  virtual void on_remote_layout(const RemoteSource& /*source*/, const image::Layout& /*layout*/) {}
  virtual void on_remote_image(const RemoteSource& /*source*/, const image::Snapshot& /*image*/) {}
};

// They never decrease. Read them from the thread that publishes.
struct PublishCounters {
  std::uint64_t samples = 0;  // passed to DDS
  std::uint64_t failed = 0;   // refused by DDS: too many instances, time-out
};

class SamplePort;

class GatewayBridge {
 public:
  // Creates participant, topics and endpoints. Diagnostics name the profile file and its errors.
  // Without a value, everything created was deleted.
  static Loaded<std::unique_ptr<GatewayBridge>> make(const GatewayOptions& options);
  // Uses the endpoints of that port; of the options only the names and the incarnation.
  static std::unique_ptr<GatewayBridge> make(const GatewayOptions& options,
                                             std::unique_ptr<SamplePort> port);
  // Waits until every reader has acknowledged the last samples, which would be lost with their
  // writer, but at most GatewayOptions::last_words.
  ~GatewayBridge();
  GatewayBridge(const GatewayBridge&) = delete;
  GatewayBridge& operator=(const GatewayBridge&) = delete;

  // --- adding and removing lines; no thread may publish or poll meanwhile ------------------------

  // Returns false if the writers of the line could not be created: its image and its events are not
  // published.
  bool add_line(const std::string& line);
  // The instances of its states and layouts end, which readers receive. Its layouts, images and PDO
  // updates are no longer published. Its events remain available to late joiners.
  void remove_line(const std::string& line);

  // The groups of outputs of the line that applications write by name, each with a topic of its
  // own; they replace those before. remove_line() removes them. Returns false if a topic could not
  // be created.
  bool set_named_groups(const std::string& line, std::span<const named::GroupType> types);

  // From now on the handler receives the states, layouts and images of the inputs of these lines of
  // other gateways, those present included. They replace the lines before. Returns false if a
  // reader could not be created.
  bool follow(std::vector<RemoteLine> lines);

  // --- out: false = DDS refused the sample; counted ---------------------------------------------

  void set_clock(const ClockMap& clock);

  bool publish(const LineInfo& line, const line::LineState& state, Instant now,
               const std::vector<Property>& properties = {});
  bool publish(std::string_view line, const NodeInfo& info, const line::NodeState& state,
               Instant now, const std::vector<Property>& properties = {});
  // The state of an output group, published in response to OutputWrites.
  bool publish(std::string_view line, const line::OutputState& state, Instant now);
  // Published in parts of kMaxLayoutPart entries.
  bool publish(std::string_view line, const image::Layout& layout);
  // False while an image would wait: fetch and publish it later, with newer values.
  bool accepts_image(std::string_view line, image::Direction direction) const;
  // Returns false also if it exceeds the contract's bounds (kMaxEntries, kMaxStamps).
  bool publish(std::string_view line, const image::Snapshot& snapshot);
  // Images of the line that the process of the endpoints takes from that memory (message_link.h),
  // after the layouts that were published before. Returns false if there is no such process.
  bool share_images(const std::string& line, std::shared_ptr<SharedFiles> files);
  // The named topics of that direction of the line, which replace those before. The instances of
  // topics that are no more, or whose type changed, end. Returns false if a topic could not be
  // created.
  bool set_named_types(std::string_view line, image::Direction direction,
                       std::span<const named::DeviceType> types);
  // Whether the topic of that type, one of those set last, has readers. If it has none, its last
  // sample is removed: a later reader does not receive it.
  bool has_readers(const named::DeviceType& type);
  // Calls `changed` whenever has_readers() may have another result, in threads of DDS, which it
  // must not block. Replaces the function before it, which is not called any more. From any thread.
  void watch_readers(std::function<void()> changed);
  // False while a sample of that type would wait: publish it later, with newer values.
  bool accepts_named(const named::DeviceType& type) const;
  // A sample of a named topic with the values of the snapshot, whose layout is that of the types
  // set last. number: 1, 2, ...; times: of the PDOs of the type, Instant{} = never.
  bool publish(const named::DeviceType& type, const image::Snapshot& snapshot, std::uint64_t number,
               std::span<const Instant> times, std::span<const std::uint8_t> waits = {});
  // The values of one PDO (mark, of this input snapshot) with the layout that describes them.
  // receptions: number of frames since the last update of that PDO, which this update represents.
  bool publish_pdo_update(std::string_view line, const image::Layout& layout,
                          const image::Snapshot& snapshot, const image::PdoMark& mark,
                          std::uint32_t receptions);
  // With the layout that describes it. Assigns the numbers, per line.
  bool publish(std::string_view line, const image::Layout& layout, const pdo::Reception& reception);
  bool publish(const GatewayInfo& info, Instant now);
  // line: empty for an event of the gateway itself. text: description of the event, up to 256
  // bytes.
  bool publish(std::string_view line, const Event& event, std::string_view text,
               const std::vector<Property>& properties = {});

  PublishCounters counters() const;

  // Number of other gateways of this name in the domain: subscribers cannot distinguish them from
  // this one, and requests for one reach all. Detected some seconds after the other gateway
  // appeared (the lease duration of its participant). From any thread.
  std::size_t namesakes() const;
  // The names of the other gateways in the domain, sorted. From any thread.
  std::vector<std::string> other_gateways() const;
  // From any thread.
  DiscoveryCounters discovery() const;

  // The number of datagrams that the guard received and dropped. From any thread.
  guard::Counters guard_counters() const;
  // Number of processes that were started for the endpoints; 0: they are in this process.
  std::uint64_t process_starts() const;

  // The earliest end of validity of the certificates of other participants, in s since 1970; 0:
  // there were none. From any thread.
  std::int64_t next_expiry() const;
  // Replaces the process of the endpoints, so that each other participant is authenticated anew.
  // Nothing that was published is lost, except samples of named topics that are on their way, which
  // the present state follows, and nothing is carried out twice. Returns false if the
  // endpoints are in this process, or it cannot be done now. From the thread that polls.
  bool replace_process(std::string_view reason);

  // --- in ---------------------------------------------------------------------------------------

  // Waits until samples were received and handled, wake() was called, or the timeout passed (0 =
  // does not wait). Returns the number of handled samples.
  std::size_t poll(Duration timeout, GatewayHandler& handler);
  // Ends the present poll(), or the next one if there is none.
  void wake();

  // Answers the command with that tag and keeps the answer for duplicates: the last 256 of each
  // client. Returns false if no such command is waiting (it was answered already, or its client has
  // left), or if DDS refused the sample; in the latter case the client repeats the request and
  // receives the kept answer.
  bool reply(const line::Reply& reply);

 private:
  struct Impl;
  explicit GatewayBridge(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace linegate::dds
