// SPDX-License-Identifier: Apache-2.0
// The interface between the gateway and its subscribers: published samples and received requests.
//
// Publisher and RequestReceiver depend on this interface only. dds_edge.h implements it with
// bridges/dds; another bridge, or DDS in a separate process, would be another implementation.
//
// Four groups of calls may run at the same time, each from one thread at a time: set_clock(),
// publish_...(), and the counters; poll() and warnings(); reply(); pop_notice(). Any thread may
// call wake(), namesakes() and other_gateways().
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/request/request.h"
#include "gateway/config/plant.h"
#include "gateway/publish/remote_inputs.h"
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

// What a client may do as far as the edge authenticates clients.
enum class ClientRight : std::uint8_t {
  unlimited,  // the edge does not authenticate
  none,
  operate,   // outputs, and commands that read or change the process state
  engineer,  // also commands that change configuration, firmware and node-IDs
};

// The client that sent a request: the participant, never a name in the request.
struct ClientIdentity {
  std::array<std::uint8_t, 12> id{};  // opaque; DDS: the prefix of its GUID, or of its subject
  std::string host;                   // as announced, up to 64 bytes; empty: unknown
  ClientRight right = ClientRight::unlimited;
  std::string subject{};  // authenticated name; empty: the edge does not authenticate
};

struct OutputRequest {
  std::string line;
  std::string client;  // the name in the request
  line::OutputWrite write;
  ClientIdentity from{};
  bool by_name = false;  // by the named topic of its group
};

struct CommandRequest {
  std::string line;
  std::string client;
  std::uint64_t layout_id = 0;  // for CommandKind::output_write; 0 = any
  line::Command command;        // its tag is assigned by the edge: return it in line::Reply::tag
  ClientIdentity from{};
};

// A command that the gateway executes itself.
struct GatewayCommandRequest {
  std::string line;  // any name for request::Versions and request::JournalRead
  std::string client;
  request::GatewayCommand command;  // as CommandRequest::command
  ClientIdentity from{};
};

// Of a request: names in it, and its sender.
struct RequestOrigin {
  std::string line;  // may be a name that does not exist
  std::string client;
  ClientIdentity from{};
};

// Called within DataEdge::poll().
class RequestHandler {
 public:
  virtual ~RequestHandler() = default;

  // Well-formed and for this incarnation of the gateway; the line performs all other checks.
  virtual void on_output_write(OutputRequest request) = 0;
  // Complete and not a duplicate. Exactly one reply() is expected for each.
  virtual void on_command(CommandRequest request) = 0;
  virtual void on_gateway_command(GatewayCommandRequest request) = 0;

  // A request that is malformed, or for another incarnation of the gateway. A refused command was
  // already answered. kind is that of a command, or an undefined number.
  virtual void on_output_refused(RequestOrigin origin, std::uint16_t group,
                                 line::OutputRefusal refusal, std::string_view why) = 0;
  virtual void on_command_refused(RequestOrigin origin, std::uint8_t kind, line::Refusal refusal,
                                  std::string_view why) = 0;
  // `samples` more samples were malformed and are discarded.
  virtual void on_unreadable(std::uint64_t samples) = 0;
  // Of lines of other gateways that DataEdge::follow() names. time: of the sample, by the clock of
  // its gateway.
  virtual void on_remote_state(const RemoteSource& /*source*/, std::int64_t /*time*/) {}
  virtual void on_remote_layout(const RemoteSource& /*source*/, const image::Layout& /*layout*/) {}
  virtual void on_remote_image(const RemoteSource& /*source*/, const image::Snapshot& /*image*/) {}
  // A subscriber writes that topic with a QoS policy that is incompatible with the requested one,
  // so none of its samples are received. policy: "ownership", ...
  virtual void on_misfit(std::string_view topic, std::string_view policy) = 0;
};

// What happened to the edge itself, as an event of the gateway.
struct EdgeNotice {
  EventData event;
  std::string text;  // description of the event
};

// Statistics of the edge itself, for GatewayState.
struct EdgeStatistics {
  std::size_t participants = 0;        // other participants that are discovered now
  std::size_t participants_most = 0;   // limit; further ones are ignored
  std::vector<NamedCounter> counters;  // listed in idl/README.md
};

class DirectImages;

class DataEdge {
 public:
  virtual ~DataEdge() = default;

  // --- adding and removing lines; no thread may publish or poll meanwhile ------------------------

  // Returns false if its image and its events cannot be published.
  virtual bool add_line(const std::string& line) = 0;
  // Subscribers receive the end of its states and layouts. Its events remain available to late
  // joiners.
  virtual void remove_line(const std::string& line) = 0;
  // The groups of outputs of the line that applications write by name, until remove_line(). Returns
  // false if one cannot be received.
  virtual bool set_named_groups(const std::string& /*line*/,
                                std::span<const named::GroupType> /*types*/) {
    return true;
  }

  // The lines of other gateways whose states, layouts and images are received from now on, those
  // present included. Returns false if they cannot be received.
  virtual bool follow(const std::vector<config::RemoteLine>& lines) { return lines.empty(); }

  // --- out: refused samples are counted ----------------------------------------------------------

  // Applies to the times of all later samples.
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
  // The way for the images of a line, without the publisher; nullptr: publish_image() is the way.
  // layouts: those of the line, which never change. Call it before the line runs, and
  // share_images() after its layouts were published: from then on its images are.
  virtual std::shared_ptr<DirectImages> make_direct_images(
      const config::LinePlan& /*plan*/, const std::array<image::Layout, 2>& /*layouts*/) {
    return nullptr;
  }
  virtual void share_images(const std::string& /*line*/,
                            const std::shared_ptr<DirectImages>& /*images*/) {}
  // The named topics of that direction of the line, which replace those before: the instances of
  // topics that are no more, or whose type changed, end.
  virtual void set_named_types(std::string_view line, image::Direction direction,
                               std::span<const named::DeviceType> types) = 0;
  // Whether the named topic of that type, one of those set last, has readers. If it has none, its
  // last sample is removed: a later reader does not receive it.
  virtual bool has_readers(const named::DeviceType& /*type*/) { return true; }
  // Calls `changed` whenever has_readers() may have another result, in any thread, which it must
  // not block. Replaces the function before it, which is not called any more. From any thread.
  virtual void watch_readers(std::function<void()> /*changed*/) {}
  // False while a sample of that type would wait in the edge. Publish it later, with newer values:
  // its number has no gap.
  virtual bool accepts_named(const named::DeviceType& /*type*/) const { return true; }
  // With the values of the snapshot, whose layout is that of the types set last.
  virtual void publish_named(const NamedSample& sample, const image::Snapshot& snapshot) = 0;
  // False while an image of the line would wait in the edge. Fetch and publish it later: until then
  // newer values and marks are merged into it, and its number has no gap.
  virtual bool accepts_image(std::string_view /*line*/, image::Direction /*direction*/) const {
    return true;
  }
  // The values of one PDO (mark, of this input snapshot). receptions: number of frames since the
  // last update of that PDO, which this update represents.
  virtual void publish_pdo_update(std::string_view line, const image::Layout& layout,
                                  const image::Snapshot& snapshot, const image::PdoMark& mark,
                                  std::uint32_t receptions) = 0;
  virtual void publish_reception(std::string_view line, const image::Layout& layout,
                                 const pdo::Reception& reception) = 0;
  virtual void publish_gateway(const GatewayInfo& info, Instant now) = 0;
  // line: empty for an event of the gateway itself. text: description of the event, up to 256
  // bytes.
  virtual void publish_event(std::string_view line, const Event& event, std::string_view text) = 0;

  // The members code, value and data of the event's sample.
  virtual EventMembers members(const EventData& data) const = 0;

  // Number of refused samples since the start.
  virtual std::uint64_t failed_samples() const = 0;
  // Like statistics().participants, but cheap enough for each iteration.
  virtual std::size_t participants() const = 0;
  virtual EdgeStatistics statistics() const = 0;

  // Number of other gateways of this name, which subscribers cannot distinguish from this one.
  virtual std::size_t namesakes() const = 0;
  // Names, sorted.
  virtual std::vector<std::string> other_gateways() const = 0;

  // --- in ----------------------------------------------------------------------------------------

  // Waits until samples were received and handled, wake() was called, or the timeout passed (0 =
  // does not wait).
  virtual void poll(Duration timeout, RequestHandler& handler) = 0;
  // Ends the present poll(), or the next one if there is none.
  virtual void wake() = 0;
  // Sentences for the log about data that the edge discarded since the last call; usually empty.
  virtual std::vector<std::string> warnings(Instant now) = 0;
  // Events since the last call that the caller publishes; usually none. From one thread at a time.
  virtual std::optional<EdgeNotice> pop_notice(Instant /*now*/) { return std::nullopt; }
  // What it lacks to work, in words for the status of the service; empty while it works. Any thread
  // may call it.
  virtual std::string condition(Instant /*now*/) const { return {}; }

  // Answers the command with that tag, and keeps the answer for duplicates.
  virtual void reply(const line::Reply& reply) = 0;
};

}  // namespace linegate::gateway
