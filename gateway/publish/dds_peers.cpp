// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/dds_peers.h"

#include <string>
#include <utility>

#include <spdlog/spdlog.h>

#include "bridges/dds/client.h"

namespace linegate::gateway {
namespace {

constexpr std::size_t kLongestClientName = 64;
constexpr std::string_view kOfRoutes = " routes";

class DdsPeers final : public PeerClient {
 public:
  explicit DdsPeers(std::unique_ptr<dds::Client> client) : client_(std::move(client)) {}

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

 private:
  class Listener final : public dds::ClientListener {
   public:
    explicit Listener(PeerHandler& handler) : handler_(handler) {}
    void on_line(const dds::Source& source, const dds::LineInfo& /*info*/,
                 const line::LineState& /*state*/,
                 const std::vector<dds::Property>& /*properties*/) override {
      handler_.on_state({source.gateway, source.line}, source.incarnation,
                        source.time.time_since_epoch().count());
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

}  // namespace

std::unique_ptr<PeerClient> make_dds_peers(const config::Plant& plant) {
  dds::ClientOptions options;
  options.name = plant.gateway.substr(0, kLongestClientName - kOfRoutes.size());
  options.name += kOfRoutes;
  options.domain = plant.dds_domain;
  options.network = {
      .interfaces = plant.dds_interfaces, .peers = plant.dds_peers, .servers = plant.dds_servers};
  options.profile_file = plant.dds_profile;
  options.guard = plant.dds_guard;
  options.nodes = options.output_states = options.layouts = options.images = false;
  options.pdos = options.receptions = options.events = false;
  options.of_gateway = true;
  auto made = dds::Client::make(options);
  for (const Diagnostic& diagnostic : made.diagnostics) {
    spdlog::warn("routes over other gateways: {}", to_string(diagnostic));
  }
  if (!made.value) {
    spdlog::error("routes over other gateways do not work: DDS refuses their client");
    return nullptr;
  }
  return std::make_unique<DdsPeers>(std::move(*made.value));
}

}  // namespace linegate::gateway
