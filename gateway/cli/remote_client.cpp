// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/remote_client.h"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>

#include "bridges/dds/client.h"
#include "bridges/request/request.h"
#include "gateway/client/identity.h"
#include "gateway/runtime/signals.h"

namespace linegate::gateway {
namespace {

console::LineId id_of(const dds::Source& source) {
  return {source.gateway, source.line};
}

// The newest start of the gateway of each line.
using Incarnations = std::map<console::LineId, std::uint64_t>;

// Passes samples from DDS to the console.
class Forward final : public dds::ClientListener {
 public:
  Forward(console::Listener& listener, Incarnations& incarnations)
      : listener_(listener), incarnations_(incarnations) {}

  void on_gateway(const dds::Source& source, const dds::GatewayInfo& info) override {
    console::GatewayView view{.version = info.version,
                              .time = source.time,
                              .started = info.started,
                              .configured = info.configured,
                              .configuration = info.configuration,
                              .reloads = info.reloads,
                              .reloads_refused = info.reloads_refused,
                              .events = info.events,
                              .event_stream = info.event_stream,
                              .participants = info.participants,
                              .participants_most = info.participants_most};
    for (const dds::GatewayInfo::Line& line : info.lines) {
      view.lines.emplace_back(line.name, line.interface_uri);
    }
    for (const dds::NamedCounter& counter : info.counters) {
      view.counters.emplace_back(counter.name, counter.value);
    }
    listener_.on_gateway(source.gateway, view);
  }
  void on_line(const dds::Source& source, const dds::LineInfo& info, const line::LineState& state,
               const std::vector<dds::Property>& properties) override {
    console::LineView view{.interface_uri = info.interface_uri,
                           .bit_rate = info.bit_rate,
                           .access = std::string(dds::name(info.access)),
                           .time = source.time,
                           .state = state};
    view.incarnation = source.incarnation;
    incarnations_[id_of(source)] = source.incarnation;
    for (const dds::Property& property : properties) {
      view.properties.emplace_back(property.name, property.value);
    }
    listener_.on_line(id_of(source), view);
  }
  void on_node(const dds::Source& source, const dds::NodeInfo& info, const line::NodeState& state,
               const std::vector<dds::Property>& properties) override {
    console::NodeView view{.name = info.name, .since = info.since, .state = state};
    view.incarnation = source.incarnation;
    for (const dds::Property& property : properties) {
      view.properties.emplace_back(property.name, property.value);
    }
    listener_.on_node(id_of(source), view);
  }
  void on_output_state(const dds::Source& source, const line::OutputState& state) override {
    listener_.on_output_state(
        id_of(source), {.state = state, .time = source.time, .incarnation = source.incarnation});
  }
  void on_layout(const dds::Source& source, const image::Layout& layout) override {
    listener_.on_layout(id_of(source), layout);
  }
  void on_image(const dds::Source& source, const image::Snapshot& image) override {
    listener_.on_image(id_of(source), image);
  }
  void on_event(const dds::Source& source, const dds::ReceivedEvent& event, std::string_view text,
                const std::vector<dds::Property>& /*properties*/) override {
    const std::span<const std::byte> bytes = event.fields.bytes();
    listener_.on_event(id_of(source), {.number = event.number,
                                       .time = event.time,
                                       .kind = event.kind,
                                       .severity = event.severity,
                                       .node = event.node,
                                       .data = event.data,
                                       .code = event.fields.code,
                                       .value = event.fields.value,
                                       .bytes = {bytes.begin(), bytes.end()},
                                       .text = std::string(text)});
  }
  void on_line_gone(std::string_view gateway, std::string_view line) override {
    incarnations_.erase({std::string(gateway), std::string(line)});
    listener_.on_line_gone({std::string(gateway), std::string(line)});
  }
  void on_node_gone(std::string_view gateway, std::string_view line, std::uint8_t node) override {
    listener_.on_node_gone({std::string(gateway), std::string(line)}, node);
  }
  void on_output_state_gone(std::string_view gateway, std::string_view line,
                            std::uint16_t group) override {
    listener_.on_output_state_gone({std::string(gateway), std::string(line)}, group);
  }
  void on_unreadable(std::uint64_t samples) override { listener_.on_unreadable(samples); }
  void on_left_out(std::uint64_t samples) override { listener_.on_left_out(samples); }

 private:
  console::Listener& listener_;
  Incarnations& incarnations_;
};

class RemoteClient final : public console::Client {
 public:
  // Over TCP, Fast DDS 2.9.1 may wait for ever for the end of a thread that has ended.
  static constexpr std::chrono::seconds kTimeToEnd{10};

  explicit RemoteClient(std::unique_ptr<dds::Client> client) : client_(std::move(client)) {}
  ~RemoteClient() override {
    const TimeToEnd limit(kTimeToEnd);
    client_.reset();
  }
  RemoteClient(const RemoteClient&) = delete;
  RemoteClient& operator=(const RemoteClient&) = delete;

  bool may_receive_layouts() const override { return client_->layout_peers() != 0; }
  void poll(Duration timeout, console::Listener& listener) override {
    Forward forward(listener, incarnations_);
    client_->poll(timeout, forward);
  }

  std::string name() const override { return client_->name(); }

  console::Discovery discovery() const override {
    dds::Peers peers = client_->peers();
    return {.gateways = std::move(peers.gateways), .unchanged = peers.unchanged};
  }

  Answer call(const console::LineId& id, const line::Command& command, Duration timeout,
              std::uint64_t layout_id, console::Listener& listener) override {
    Forward forward(listener, incarnations_);
    return to_answer(client_->call(target_of(id), command, timeout, forward, layout_id));
  }

  Answer call_gateway(const console::LineId& id, const request::GatewayRequest& request,
                      Duration timeout, console::Listener& listener) override {
    Forward forward(listener, incarnations_);
    const dds::Target target = request::only_reads(request::kind(request))
                                   ? dds::Target{.gateway = id.gateway, .line = id.line}
                                   : target_of(id);
    return to_answer(client_->call_gateway(target, request, timeout, forward));
  }

  bool write_outputs(const console::LineId& id, std::uint64_t incarnation,
                     const line::OutputWrite& write) override {
    return client_->write_outputs(
        {.gateway = id.gateway, .line = id.line, .incarnation = incarnation}, write);
  }

 private:
  static Answer to_answer(dds::CommandResult result) {
    return {.reply = std::move(result.reply),
            .text = std::move(result.text),
            .bytes = std::move(result.bytes)};
  }

  // A gateway that starts again must not carry out a repetition of what it was sent before.
  dds::Target target_of(const console::LineId& id) const {
    const auto found = incarnations_.find(id);
    return {.gateway = id.gateway,
            .line = id.line,
            .incarnation = found == incarnations_.end() ? 0 : found->second};
  }

  std::unique_ptr<dds::Client> client_;
  Incarnations incarnations_;
};

}  // namespace

Loaded<std::unique_ptr<console::Client>> make_remote_client(const RemoteClientOptions& options) {
  dds::ClientOptions client;
  Loaded<std::unique_ptr<console::Client>> out;
  if (!options.security.empty()) {
    out.diagnostics =
        use_identity(options.security, options.commands || options.outputs, client.security);
    if (has_errors(out.diagnostics))
      return out;
  }
  for (const std::string& line : options.only) {
    if (!dds::is_line_name(line))
      out.diagnostics.push_back({Severity::error, "--only", 0, 0, line + " is not GATEWAY/LINE"});
  }
  if (!options.only.empty() && client.security.enabled())
    out.diagnostics.push_back(
        {Severity::error, "--only", 0, 0, "is for gateways without DDS-Security"});
  if (has_errors(out.diagnostics))
    return out;
  client.only = options.only;
  client.domain = options.domain;
  client.profile_file = options.profile;
  client.network = {.interfaces = options.interfaces,
                    .peers = options.peers,
                    .servers = options.servers,
                    .multicast_images = options.multicast};
  client.layouts = options.layouts;
  client.images = options.images;
  client.output_states = options.images;
  client.pdos = false;
  client.events = options.events;
  client.commands = options.commands;
  client.outputs = options.outputs;
  client.follow_interfaces = true;
  auto made = dds::Client::make(client);
  out.diagnostics.insert(out.diagnostics.end(), made.diagnostics.begin(), made.diagnostics.end());
  if (made.value) {
    out.value = std::make_unique<RemoteClient>(std::move(*made.value));
  }
  return out;
}

}  // namespace linegate::gateway
