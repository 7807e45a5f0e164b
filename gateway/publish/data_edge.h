// SPDX-License-Identifier: Apache-2.0
// The edge of the gateway towards subscribers: what is published, and what they request.
//
// Publisher and RequestReceiver know this interface alone. dds_edge.h implements it with
// bridges/dds; another bridge, or DDS in a process of its own, is another implementation.
//
// Three groups of calls may run at the same time, each from one thread at a time: set_clock(),
// publish_...(), and the counters; poll() and warnings(); reply(). wake(), namesakes() and
// other_gateways() may be called from any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/publish/values.h"
#include "gateway/runtime/clock.h"
#include "stack/base/event.h"
#include "stack/image/layout.h"
#include "stack/image/snapshot.h"
#include "stack/line/command.h"
#include "stack/line/output_state.h"
#include "stack/line/output_write.h"
#include "stack/line/state.h"
#include "stack/pdo/reception.h"

namespace linegate::gateway {

struct OutputRequest {
  std::string line;
  std::string client;  // the name it gives itself
  line::OutputWrite write;
};

struct CommandRequest {
  std::string line;  // for CommandKind::versions any name
  std::string client;
  std::uint64_t layout_id = 0;  // for CommandKind::output_write; 0 = any
  line::Command command;        // its tag is the edge's: hand it back in line::Reply::tag
};

// Called from within DataEdge::poll().
class RequestHandler {
 public:
  virtual ~RequestHandler() = default;

  // Well-formed and for this start of the gateway; everything else is the line's to judge.
  virtual void on_output_write(OutputRequest request) = 0;
  // Complete and not a duplicate. Exactly one reply() is expected for each.
  virtual void on_command(CommandRequest request) = 0;

  // A request that cannot be understood, or is for another start of the gateway. A command has been
  // answered already. `line` may be a name that does not exist; kind is line::CommandKind, or a
  // number that is none.
  virtual void on_output_refused(std::string_view line, std::uint16_t group,
                                 line::OutputRefusal refusal, std::string_view why) = 0;
  virtual void on_command_refused(std::string_view line, std::string_view client, std::uint8_t kind,
                                  line::Refusal refusal, std::string_view why) = 0;
  // So many more samples were damaged and are discarded.
  virtual void on_unreadable(std::uint64_t samples) = 0;
  // A subscriber writes that topic with a QoS policy that is incompatible with the one requested,
  // so nothing of it is received. policy: "ownership", ...
  virtual void on_misfit(std::string_view topic, std::string_view policy) = 0;
};

// Of the edge itself, for GatewayState.
struct EdgeStatistics {
  std::size_t participants = 0;        // others that are discovered now
  std::size_t participants_most = 0;   // further ones are ignored
  std::vector<NamedCounter> counters;  // idl/README.md lists them
};

class DataEdge {
 public:
  virtual ~DataEdge() = default;

  // --- lines that come and go; nobody may publish or poll meanwhile ------------------------------

  // False: its image and its events cannot be published.
  virtual bool add_line(const std::string& line) = 0;
  // Subscribers receive the end of its states and layouts; its events stay for late joiners.
  virtual void remove_line(const std::string& line) = 0;

  // --- out: a sample that is not taken is counted ------------------------------------------------

  // For the times of all samples after it.
  virtual void set_clock(const ClockMap& clock) = 0;

  virtual void publish_line(const LineInfo& info, const line::LineState& state, Instant now,
                            const std::vector<Property>& properties) = 0;
  virtual void publish_node(std::string_view line, const NodeInfo& info,
                            const line::NodeState& state, Instant now,
                            const std::vector<Property>& properties) = 0;
  virtual void publish_output_state(std::string_view line, const line::OutputState& state,
                                    Instant now) = 0;
  virtual void publish_layout(std::string_view line, const image::Layout& layout) = 0;
  virtual void publish_image(std::string_view line, const image::Snapshot& snapshot) = 0;
  // The values of one PDO (mark, of this input snapshot). receptions: frames it stands for, since
  // the last update of that PDO.
  virtual void publish_pdo_update(std::string_view line, const image::Layout& layout,
                                  const image::Snapshot& snapshot, const image::PdoMark& mark,
                                  std::uint32_t receptions) = 0;
  virtual void publish_reception(std::string_view line, const image::Layout& layout,
                                 const pdo::Reception& reception) = 0;
  virtual void publish_gateway(const GatewayInfo& info, Instant now) = 0;
  // line: empty for an event of the gateway itself. text: the event in words, up to 256 bytes.
  virtual void publish_event(std::string_view line, const Event& event, std::string_view text) = 0;

  // Samples that were not taken, since the start.
  virtual std::uint64_t failed_samples() const = 0;
  // As in statistics(), for a look in each round.
  virtual std::size_t participants() const = 0;
  virtual EdgeStatistics statistics() const = 0;

  // Other gateways of this name, which subscribers cannot distinguish from this one.
  virtual std::size_t namesakes() const = 0;
  // Names, sorted.
  virtual std::vector<std::string> other_gateways() const = 0;

  // --- in ----------------------------------------------------------------------------------------

  // Waits until something was received and handled, wake() was called, or the timeout passed
  // (0 = does not wait).
  virtual void poll(Duration timeout, RequestHandler& handler) = 0;
  // Ends the present poll(), or the next one if there is none.
  virtual void wake() = 0;
  // Sentences for the log on what the edge discarded since the last call; none in most calls.
  virtual std::vector<std::string> warnings(Instant now) = 0;

  // Answers the command with that tag; it is kept for duplicates.
  virtual void reply(const line::Reply& reply) = 0;
};

}  // namespace linegate::gateway
