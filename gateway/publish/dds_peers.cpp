// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/dds_peers.h"

#include <string>
#include <utility>

#include <spdlog/spdlog.h>

#include "bridges/dds/client.h"
#include "bridges/dds/guard/stall.h"
#include "gateway/publish/peer_process.h"
#include "gateway/security/documents.h"
#include "gateway/security/files.h"
#include "gateway/security/fingerprint.h"
#include "gateway/security/identity_check.h"
#include "stack/base/events.h"
#include "stack/routing/config.h"

namespace linegate::gateway {
namespace {

constexpr std::size_t kLongestClientName = 64;
constexpr std::string_view kOfRoutes = " routes";

// Without a stream numbers are those of the incarnation.
PeerEvent peer_event(const dds::Source& source, const dds::ReceivedEvent& event) {
  PeerEvent out{.stream = event.stream == 0 ? source.incarnation : event.stream,
                .number = event.number,
                .time = event.time.time_since_epoch().count(),
                .node = event.node};
  routing::ForwardedEmcy emcy;
  if (const auto* const routed = event.get<event::EmcyRouted>()) {
    out.routed = true;
    emcy = {.code = routed->code,
            .error_register = routed->error_register,
            .network = routed->source,
            .node = routed->source_node,
            .hops = routed->hops,
            .number = routed->number};
  } else if (const auto* const own = event.get<event::Emcy>()) {
    emcy = {.code = own->code,
            .error_register = own->error_register,
            .node = event.node,
            .number = static_cast<std::uint8_t>(event.number)};
  } else {
    return out;
  }
  const bool is_valid = emcy.node >= 1 && emcy.node <= can::kMaxNodeId && emcy.hops >= 1 &&
                        emcy.hops <= routing::kMaxHops && (emcy.network == 0) != out.routed;
  out.emcy = is_valid ? std::optional(emcy) : std::nullopt;
  return out;
}

class DdsPeers final : public LocalPeers {
 public:
  explicit DdsPeers(std::unique_ptr<dds::Client> client) : client_(std::move(client)) {}

  void set_lines(const std::vector<routing::GatewayLine>& addressed,
                 const std::vector<routing::GatewayLine>& /*emcys*/) override {
    for (const routing::GatewayLine& line : addressed) {
      client_->prepare({.gateway = line.gateway, .line = line.line});
    }
  }
  std::uint64_t send(const routing::GatewayLine& to, std::uint64_t incarnation,
                     const line::Request& request, Duration timeout) override {
    return client_->send({.gateway = to.gateway, .line = to.line, .incarnation = incarnation},
                         line::Command{.request = request}, timeout);
  }
  void cancel(std::uint64_t id) override { client_->cancel(id); }
  void poll(Duration timeout, PeerHandler& handler) override {
    Listener listener(handler);
    client_->poll(timeout, listener);
  }
  void wake() override { client_->wake(); }
  dds::guard::Stall longest_stall() const override { return client_->longest_stall(); }
  void watch_timers() override { client_->watch_timers(); }

 private:
  class Listener final : public dds::ClientListener {
   public:
    explicit Listener(PeerHandler& handler) : handler_(handler) {}
    void on_line(const dds::Source& source, const dds::LineInfo& /*info*/,
                 const line::LineState& state,
                 const std::vector<dds::Property>& /*properties*/) override {
      handler_.on_state({source.gateway, source.line}, source.incarnation,
                        source.time.time_since_epoch().count(), state.network_id);
    }
    void on_event(const dds::Source& source, const dds::ReceivedEvent& event,
                  std::string_view /*text*/,
                  const std::vector<dds::Property>& /*properties*/) override {
      const PeerEvent of = peer_event(source, event);
      if (of.stream != 0) {  // no gateway publishes one without a stream and an incarnation
        handler_.on_event({source.gateway, source.line}, source.incarnation, of);
      }
    }
    void on_line_gone(std::string_view gateway, std::string_view line) override {
      handler_.on_gone({std::string(gateway), std::string(line)});
    }
    void on_reply(const dds::Target& /*target*/, const dds::CommandResult& result) override {
      handler_.on_answer(result.id, result.reply);
    }

   private:
    PeerHandler& handler_;
  };

  std::unique_ptr<dds::Client> client_;
};

std::string client_name(const std::string& gateway) {
  std::string out = gateway.substr(0, kLongestClientName - kOfRoutes.size());
  return out += kOfRoutes;
}

PeerSettings settings_of(const config::Plant& plant, bool events) {
  return {.gateway = plant.gateway,
          .domain = plant.dds_domain,
          .interfaces = plant.dds_interfaces,
          .peers = plant.dds_peers,
          .servers = plant.dds_servers,
          .profile = plant.dds_profile,
          .guard = plant.dds_guard,
          .secured = !plant.dds_security.empty(),
          .identity = plant.dds_routes_security,
          .events = events};
}

// Returns false if the folder has no identity.
bool set_identity(const std::string& folder, dds::Security& out) {
  const auto identity = security::identity_of(folder);
  if (!identity) {
    return false;
  }
  out = dds::security_with(security::files_in(folder));
  out.is_holder = security::is_holder;
  out.right = std::string(security::name(identity->role)) + "/" + identity->name;
  return true;
}

}  // namespace

Loaded<std::unique_ptr<LocalPeers>> make_local_peers(
    const PeerSettings& settings, const std::function<void(dds::Security&)>& add_functions) {
  Loaded<std::unique_ptr<LocalPeers>> out;
  dds::ClientOptions options;
  options.name = client_name(settings.gateway);
  options.domain = settings.domain;
  options.network = {
      .interfaces = settings.interfaces, .peers = settings.peers, .servers = settings.servers};
  options.profile_file = settings.profile;
  options.guard = settings.guard;
  options.nodes = options.output_states = options.layouts = options.images = false;
  options.pdos = options.receptions = false;
  options.events = settings.events;
  options.of_gateway = true;
  // Without it the client would be one without DDS-Security.
  if (settings.secured && !set_identity(settings.identity, options.security)) {
    out.diagnostics.push_back(
        {Severity::error, settings.identity, 0, 0, "is no identity for the requests of routes"});
    return out;
  }
  if (add_functions) {
    add_functions(options.security);
  }
  auto made = dds::Client::make(options);
  out.diagnostics = std::move(made.diagnostics);
  if (made.value) {
    out.value = std::make_unique<DdsPeers>(std::move(*made.value));
  }
  return out;
}

std::unique_ptr<PeerClient> make_dds_peers(const config::Plant& plant, bool events,
                                           std::shared_ptr<ProcessEnds> ends) {
  const PeerSettings settings = settings_of(plant, events);
  if (plant.dds_own_process) {
    return make_peer_process(plant, settings, std::move(ends));
  }
  auto made = make_local_peers(settings, {});
  for (const Diagnostic& diagnostic : made.diagnostics) {
    spdlog::warn("routes over other gateways: {}", to_string(diagnostic));
  }
  if (!made.value) {
    spdlog::error("routes over other gateways do not work: DDS refuses their client");
    return nullptr;
  }
  return std::move(*made.value);
}

}  // namespace linegate::gateway
