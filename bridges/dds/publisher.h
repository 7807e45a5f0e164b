// SPDX-License-Identifier: Apache-2.0
// The gateway's half of the DDS contract (idl/linegate.idl): publishes lines, receives outputs and
// commands.
//
// Passive: it has no thread of its own and calls nobody but from poll(). Fast DDS has its own
// threads, and none of them enters the gateway's code. They inherit scheduling and affinity from
// the thread that calls make(): call it from an ordinary one.
//
// Three groups of calls may run at the same time, each from one thread at a time:
// set_clock() and publish...(); poll(); reply(). wake() may come from anywhere.
#pragma once

#include <chrono>
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
#include "stack/pdo/reception.h"

namespace linegate::dds {

struct GatewayOptions {
  std::string gateway;            // up to 64 bytes
  std::uint64_t incarnation = 1;  // random per start, not 0
  std::uint32_t domain = 0;       // 0..232
  // Fast DDS XML file. Empty: /etc/linegate/linegate-profiles.xml, else the installed one, else the
  // copy built in.
  std::string profile_file;
  // Names. Of others no image and no event is published, and commands for them are refused.
  std::vector<std::string> lines;
  // So many samples of a writer, at least 2: then a new one takes its place. A late joiner works
  // through every sequence number of a writer.
  std::uint64_t renew_after = 8'000'000;
  // Other participants that are taken note of at the same time, at least 1; 0: as the profile says
  // (allocation/total_participants, which counts this one as well), or kMostParticipants.
  std::size_t participants = 0;
  // How long the end waits for readers that do not acknowledge: stopped, killed, or too slow.
  Duration last_words = std::chrono::milliseconds(500);
  // Judge what is received before Fast DDS does (bridges/dds/guard).
  bool guard = true;
};

struct OutputMessage {
  std::string line;
  std::string client;  // as it calls itself
  line::OutputWrite write;
};

struct CommandMessage {
  std::string line;  // for CommandKind::versions any name
  std::string client;
  std::uint64_t layout_id = 0;  // for CommandKind::output_write; 0 = any
  line::Command command;        // tag is given by the bridge: hand it back in line::Reply::tag
};

// Called from within poll().
class GatewayHandler {
 public:
  virtual ~GatewayHandler() = default;

  // Well-formed and meant for this incarnation; everything else is the line's to judge.
  virtual void on_output_write(OutputMessage message) = 0;
  // Complete (all chunks) and not a duplicate. Exactly one reply() is expected for each.
  virtual void on_command(CommandMessage message) = 0;

  // A sample that could not be understood or is not meant for this start of the gateway. A command
  // has been answered already. `line` may be a name that does not exist.
  virtual void on_output_refused(std::string_view line, std::uint16_t group,
                                 line::OutputRefusal refusal, std::string_view why) = 0;
  virtual void on_command_refused(std::string_view line, std::string_view client, std::uint8_t kind,
                                  line::Refusal refusal, std::string_view why) = 0;
  // So many samples more were so damaged that nothing of them could be read. They are dropped.
  virtual void on_unreadable(std::uint64_t /*samples*/) {}
  // Somebody writes that topic with a QoS that does not fit what is asked for, and is not heard:
  // idl/README.md. policy: "ownership", ...
  virtual void on_misfit(std::string_view /*topic*/, std::string_view /*policy*/) {}
};

// Plain counters; they never go back. Read them from the thread that publishes.
struct PublishCounters {
  std::uint64_t samples = 0;  // handed to DDS
  std::uint64_t failed = 0;   // write refused by DDS: too many instances, time-out
};

class GatewayBridge {
 public:
  // Creates participant, topics and endpoints. Diagnostics name the profile file used and what is
  // wrong with it. Without a value nothing remains.
  static Loaded<std::unique_ptr<GatewayBridge>> make(const GatewayOptions& options);
  // What was published last must not be lost with its writer: waits until every reader has it, but
  // no longer than GatewayOptions::last_words.
  ~GatewayBridge();
  GatewayBridge(const GatewayBridge&) = delete;
  GatewayBridge& operator=(const GatewayBridge&) = delete;

  // --- lines that come and go; nobody may publish or poll meanwhile ------------------------------

  // False: DDS has no writers for it; its image and its events are not published.
  bool add_line(const std::string& line);
  // Its states, layouts, images and PDO updates end, and readers receive the end of its states and
  // layouts. Its events stay for late joiners.
  void remove_line(const std::string& line);

  // --- out: false = DDS did not take the sample; counted ----------------------------------------

  void set_clock(const ClockMap& clock);

  bool publish(const LineInfo& line, const line::LineState& state, Instant now,
               const std::vector<Property>& properties = {});
  bool publish(std::string_view line, const NodeInfo& info, const line::NodeState& state,
               Instant now, const std::vector<Property>& properties = {});
  // The answer to the OutputWrites of a group.
  bool publish(std::string_view line, const line::OutputState& state, Instant now);
  // In parts of kMaxLayoutPart entries.
  bool publish(std::string_view line, const image::Layout& layout);
  // Gives false too if it holds more than the contract's bounds (kMaxEntries, kMaxStamps).
  bool publish(std::string_view line, const image::Snapshot& snapshot);
  // The values of one PDO (mark, of this input snapshot) with the layout that explains them.
  // receptions: frames it stands for, since the last update of that PDO.
  bool publish_pdo_update(std::string_view line, const image::Layout& layout,
                          const image::Snapshot& snapshot, const image::PdoMark& mark,
                          std::uint32_t receptions);
  // With the layout that explains it. Numbered here, per line.
  bool publish(std::string_view line, const image::Layout& layout, const pdo::Reception& reception);
  bool publish(const GatewayInfo& info, Instant now);
  // line: empty for an event of the gateway itself. text: the event in words, up to 256 bytes.
  bool publish(std::string_view line, const Event& event, std::string_view text,
               const std::vector<Property>& properties = {});

  const PublishCounters& counters() const;

  // Other gateways of this name that are in the domain: subscribers cannot tell them from this one,
  // and requests for one reach all. Known some seconds after the other has come (the lease of its
  // participant). From any thread.
  std::size_t namesakes() const;
  // The names of the other gateways of the domain, sorted. From any thread.
  std::vector<std::string> other_gateways() const;
  // From any thread.
  DiscoveryCounters discovery() const;

  // What the guard received and dropped. From any thread.
  guard::Counters guard_counters() const;

  // --- in ---------------------------------------------------------------------------------------

  // Waits until something was received and handled, wake() was called, or the timeout passed
  // (0 = does not wait). Gives how many samples were handled.
  std::size_t poll(Duration timeout, GatewayHandler& handler);
  // Ends the present poll(), or the next one if there is none.
  void wake();

  // Answers the command with that tag and keeps the answer for duplicates: the last 256 of each
  // client. False: no such command is waiting (answered already, or its client has gone), or DDS
  // did not take it; the client then asks again and gets it from the window.
  bool reply(const line::Reply& reply);

 private:
  struct Impl;
  explicit GatewayBridge(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace linegate::dds
