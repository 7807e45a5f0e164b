// SPDX-License-Identifier: Apache-2.0
// The console's view of gateways. The console depends on this interface only; gateway/ implements
// it with DDS subscribers. Times are UTC nanoseconds since 1970-01-01 in the form of an Instant.
#pragma once

#include <chrono>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "bridges/request/request.h"
#include "stack/base/event.h"
#include "stack/base/time.h"
#include "stack/image/layout.h"
#include "stack/image/snapshot.h"
#include "stack/line/command.h"
#include "stack/line/output_state.h"
#include "stack/line/output_write.h"
#include "stack/line/state.h"

namespace linegate::console {

struct LineId {
  std::string gateway;
  std::string line;

  friend auto operator<=>(const LineId&, const LineId&) = default;
};

struct LineView {
  std::string interface_uri;
  std::uint32_t bit_rate = 0;
  std::string access;  // off, read, all
  Instant time{};
  line::LineState state;
  std::vector<std::pair<std::string, std::string>> properties;  // name, value
  std::uint64_t incarnation = 0;                                // of its gateway
};

struct NodeView {
  std::string name;
  Instant since{};  // last change of state or presence
  line::NodeState state;
  std::vector<std::pair<std::string, std::string>> properties{};  // name, value
  std::uint64_t incarnation = 0;                                  // of its gateway
};

struct GatewayView {
  std::string version;
  Instant time{};
  Instant started{};
  Instant configured{};
  std::uint64_t configuration = 0;  // hash
  std::uint32_t reloads = 0;
  std::uint32_t reloads_refused = 0;
  std::uint64_t events = 0;
  std::uint64_t event_stream = 0;  // identity of the event numbers; 0 = not known
  std::uint64_t participants = 0;
  std::uint64_t participants_most = 0;
  std::vector<std::pair<std::string, std::string>> lines;  // name, interface
  std::vector<std::pair<std::string, std::uint64_t>> counters;
};

struct OutputStateView {
  line::OutputState state;
  Instant time{};                 // of the sample
  std::uint64_t incarnation = 0;  // of its gateway
};

struct EventView {
  std::uint64_t number = 0;
  Instant time{};    // UTC
  EventKind kind{};  // kinds that are unknown to this version keep their number
  EventSeverity severity{};
  std::uint8_t node = 0;
  std::optional<EventData> data{};  // nothing: the kind is unknown
  // The members of the sample, for output that is not for people.
  std::uint32_t code = 0;
  std::uint32_t value = 0;
  std::vector<std::byte> bytes{};
  std::string text{};

  // As Event::get().
  template <class Data>
  const Data* get() const {
    return data ? std::get_if<Data>(&*data) : nullptr;
  }
};

// Receives samples during Client::poll() and call().
class Listener {
 public:
  virtual ~Listener() = default;
  virtual void on_gateway(const std::string& /*name*/, const GatewayView& /*gateway*/) {}
  virtual void on_line(const LineId& id, const LineView& line) = 0;
  virtual void on_line_gone(const LineId& id) = 0;
  virtual void on_node(const LineId& id, const NodeView& node) = 0;
  virtual void on_output_state(const LineId& /*id*/, const OutputStateView& /*state*/) {}
  // The gateway continues without them, as after a reload.
  virtual void on_node_gone(const LineId& id, std::uint8_t node) = 0;
  virtual void on_output_state_gone(const LineId& id, std::uint16_t group) = 0;
  virtual void on_layout(const LineId& id, const image::Layout& layout) = 0;
  virtual void on_image(const LineId& id, const image::Snapshot& image) = 0;
  virtual void on_event(const LineId& id, const EventView& event) = 0;
  // Number of samples dropped since the last call: malformed, or beyond the number of lines that
  // are kept.
  virtual void on_unreadable(std::uint64_t samples) = 0;
  virtual void on_left_out(std::uint64_t samples) = 0;
};

// The gateways in the domain, whether or not a sample of them was received.
struct Discovery {
  std::vector<std::string> gateways;             // names
  Duration unchanged = std::chrono::seconds(1);  // since the last change of `gateways`
};

class Client {
 public:
  virtual ~Client() = default;

  // The name of this client in its requests, unique in the domain; empty: not known.
  virtual std::string name() const { return {}; }

  virtual Discovery discovery() const { return {}; }
  // Whether a gateway in the domain has a DataWriter of layouts: without one none arrives.
  virtual bool may_receive_layouts() const { return false; }

  // Processes received samples; waits up to `timeout` if there are none.
  virtual void poll(Duration timeout, Listener& listener) = 0;

  struct Answer {
    line::Reply reply;               // Refusal::timed_out if there was no answer in time
    std::string text;                // description of the error; empty if done
    std::vector<std::byte> bytes{};  // the data of the reply as the gateway sent them
  };
  // layout_id: of the output layout for CommandKind::output_write, else 0.
  virtual Answer call(const LineId& id, const line::Command& command, Duration timeout,
                      std::uint64_t layout_id, Listener& listener) = 0;

  // The same for a request that the gateway executes itself. Refusal::bad_request: this client has
  // no commands.
  virtual Answer call_gateway(const LineId& /*id*/, const request::GatewayRequest& /*request*/,
                              Duration /*timeout*/, Listener& /*listener*/) {
    return {.reply = {.error = line::to_error(line::Refusal::bad_request)},
            .text = "this client has no commands"};
  }

  // Publishes an OutputWrite, which has no reply, for that incarnation of the gateway; 0 = any.
  // Returns false if this client was created without outputs, or DDS refused the sample.
  virtual bool write_outputs(const LineId& /*id*/, std::uint64_t /*incarnation*/,
                             const line::OutputWrite& /*write*/) {
    return false;
  }
};

}  // namespace linegate::console
