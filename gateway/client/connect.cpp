// SPDX-License-Identifier: Apache-2.0
// Connects the client library to a DDS domain with the subscriber's half of bridges/dds.
#include <chrono>
#include <cstdlib>
#include <exception>
#include <memory>
#include <string>
#include <utility>

#include "bridges/client/link.h"
#include "bridges/dds/client.h"
#include "gateway/client/identity.h"

namespace linegate::client {
namespace {

constexpr std::uint32_t kMaxDomain = 232;
constexpr std::size_t kMaxName = 64;

class DdsLink final : public Link {
 public:
  explicit DdsLink(std::unique_ptr<dds::Client> client) : client_(std::move(client)) {}

  void poll(linegate::Duration timeout, dds::ClientListener& listener) override {
    client_->poll(timeout, listener);
  }
  void wake() override { client_->wake(); }
  std::uint64_t send(const dds::Target& target, const request::Request& request,
                     linegate::Duration timeout, std::uint64_t layout_id) override {
    return client_->send_request(target, request, timeout, timeout, layout_id);
  }
  void cancel(std::uint64_t id) override { client_->cancel(id); }
  bool write_outputs(const dds::Target& target, const line::OutputWrite& write) override {
    return client_->write_outputs(target, write);
  }
  dds::Peers peers() const override { return client_->peers(); }
  std::string name() const override { return client_->name(); }
  Instant now() const override {
    return Instant{std::chrono::steady_clock::now().time_since_epoch()};
  }
  std::int64_t utc() const override {
    return linegate::Duration(std::chrono::system_clock::now().time_since_epoch()).count();
  }

 private:
  std::unique_ptr<dds::Client> client_;
};

std::string text_of(const std::vector<Diagnostic>& found) {
  std::string out;
  for (const Diagnostic& one : found) {
    if (one.severity == Severity::error)
      out += (out.empty() ? "" : "\n") + to_string(one);
  }
  return out.empty() ? "the DDS library created no participant" : out;
}

// As the console: a program need not know whether its plant is secured.
std::string identity_of(const Options& options) {
  if (!options.identity.empty())
    return options.identity;
  const char* folder = secure_getenv("LINEGATE_SECURITY");
  return folder == nullptr ? "" : folder;
}

std::shared_ptr<Core> connect(const Options& options) {
  if (options.domain > kMaxDomain)
    return make_core(nullptr, "domain is above 232");
  if (options.name.size() > kMaxName)
    return make_core(nullptr, "name is longer than 64 bytes");
  for (const std::string& line : options.lines) {
    if (!dds::is_line_name(line))
      return make_core(nullptr, "\"" + line + "\" is not GATEWAY/LINE");
  }
  dds::ClientOptions client;
  client.only = options.lines;
  client.name = options.name;
  client.domain = options.domain;
  client.profile_file = options.profile;
  client.pdos = false;
  client.receptions = false;
  client.commands = !options.read_only;
  client.outputs = !options.read_only;
  client.output_strength = options.strength;
  client.follow_interfaces = true;
  client.network = {.interfaces = options.interfaces,
                    .peers = options.peers,
                    .servers = options.discovery_servers,
                    .multicast_images = options.multicast};
  if (const std::string identity = identity_of(options); !identity.empty()) {
    const auto found = gateway::use_identity(identity, !options.read_only, client.security);
    if (has_errors(found) || !client.security.enabled())
      return make_core(nullptr, text_of(found));
    if (!options.lines.empty())
      return make_core(nullptr, "with an identity the option lines has no effect: remove it");
  }
  auto made = dds::Client::make(client);
  if (!made.value)
    return make_core(nullptr, text_of(made.diagnostics));
  return make_core(std::make_unique<DdsLink>(std::move(*made.value)));
}

// The DDS and cryptographic libraries throw.
std::shared_ptr<Core> connect_or_say_why(const Options& options) {
  try {
    return connect(options);
  } catch (const std::exception& failed) {
    return make_core(nullptr, failed.what());
  }
}

}  // namespace

Client::Client(const Options& options) : Client(connect_or_say_why(options)) {
}

}  // namespace linegate::client
