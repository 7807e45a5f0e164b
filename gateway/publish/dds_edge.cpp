// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/dds_edge.h"

#include <algorithm>
#include <array>
#include <ctime>
#include <map>
#include <system_error>
#include <utility>

#include <spdlog/spdlog.h>

#include "bridges/dds/address_change.h"
#include "bridges/dds/event_codec.h"
#include "bridges/dds/exposure.h"
#include "bridges/dds/guard/report.h"
#include "bridges/dds/library_log.h"
#include "bridges/dds/profiles.h"
#include "bridges/dds/publisher.h"
#include "bridges/dds/values.h"
#include "gateway/config/plan_difference.h"
#include "gateway/exchange/bell.h"
#include "gateway/publish/dds_process.h"
#include "gateway/runtime/direct_images.h"
#include "gateway/security/documents.h"
#include "gateway/security/files.h"
#include "gateway/security/fingerprint.h"
#include "gateway/security/identity_check.h"
#include "gateway/security/identity_watch.h"
#include "gateway/security/revoked_names.h"

namespace linegate::gateway {
namespace {

dds::Access to_dds(config::Access access) {
  switch (access) {
    case config::Access::off:
      return dds::Access::off;
    case config::Access::read:
      return dds::Access::read;
    case config::Access::all:
      break;
  }
  return dds::Access::all;
}

dds::ClockMap to_dds(const ClockMap& clock) {
  switch (clock.quality) {
    case ClockQuality::unknown:
      break;
    case ClockQuality::free_running:
      return {clock.offset, dds::ClockQuality::free_running};
    case ClockQuality::synchronised:
      return {clock.offset, dds::ClockQuality::synchronised};
  }
  return {clock.offset, dds::ClockQuality::unknown};
}

std::vector<dds::Property> to_dds(const std::vector<Property>& properties) {
  std::vector<dds::Property> out;
  out.reserve(properties.size());
  for (const Property& property : properties) {
    out.push_back({property.name, property.value});
  }
  return out;
}

dds::GatewayInfo to_dds(const GatewayInfo& info) {
  dds::GatewayInfo out{.version = info.version,
                       .started = info.started,
                       .configuration = info.configuration,
                       .configured = info.configured,
                       .reloads = info.reloads,
                       .reloads_refused = info.reloads_refused,
                       .events = info.events,
                       .event_stream = info.event_stream,
                       .participants = info.participants,
                       .participants_most = info.participants_most};
  for (const GatewayInfo::Line& line : info.lines) {
    out.lines.push_back({line.name, line.interface_uri});
  }
  for (const NamedCounter& counter : info.counters) {
    out.counters.push_back({counter.name, counter.value});
  }
  return out;
}

ClientRight from_dds(dds::ClientRight right) {
  switch (right) {
    case dds::ClientRight::unlimited:
      return ClientRight::unlimited;
    case dds::ClientRight::none:
      break;
    case dds::ClientRight::operate:
      return ClientRight::operate;
    case dds::ClientRight::engineer:
      return ClientRight::engineer;
  }
  return ClientRight::none;
}

// All participants with one certificate are one client.
ClientIdentity from_dds(dds::Participant from) {
  ClientIdentity out{from.prefix, std::move(from.host), from_dds(from.right),
                     std::move(from.subject)};
  if (!out.subject.empty())
    std::fill(out.id.begin() + security::Fingerprint().size(), out.id.end(), std::uint8_t{0});
  return out;
}

// One device stands for all of a line: permissions do not distinguish devices.
security::NamedTopics named_topics_of(const config::Plant& plant) {
  security::NamedTopics out;
  for (const config::LinePlan& line : plant.lines) {
    for (const auto direction : {image::Direction::inputs, image::Direction::outputs}) {
      if (line.named.published)
        out.published.push_back(
            named::DeviceType{.line = line.config.name, .device = "DEVICE", .direction = direction}
                .topic());
    }
    for (const named::Group& group : line.named.groups)
      out.received.push_back(
          named::GroupType{.line = line.config.name, .group = group.name}.topic());
    if (!line.remote_inputs.empty())
      out.followed = {"linegate/v1/LineState", "linegate/v1/ImageLayout",
                      "linegate/v1/ProcessImage"};
  }
  return out;
}

// The lines of other gateways to which requests are addressed, "GATEWAY/LINE" each.
std::vector<std::string> addressed_lines_of(const config::Plant& plant) {
  std::vector<std::string> out;
  for (const config::LinePlan& line : plant.lines) {
    for (const routing::Interface& each : line.config.routing.interfaces) {
      if (each.way != nullptr) {
        const routing::GatewayLine to = each.way->addressed();
        out.push_back(to.gateway + '/' + to.line);
      }
    }
  }
  std::ranges::sort(out);
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

RemoteSource from_dds(const dds::RemoteSource& source) {
  return {{source.line.gateway, source.line.line}, source.incarnation};
}

// Passes requests from the bridge to the handler.
class Requests final : public dds::GatewayHandler {
 public:
  explicit Requests(RequestHandler& handler) : handler_(handler) {}

  void on_output_write(dds::OutputMessage message) override {
    handler_.on_output_write({std::move(message.line), std::move(message.client),
                              std::move(message.write), from_dds(std::move(message.from)),
                              message.by_name});
  }
  void on_command(dds::CommandMessage message) override {
    handler_.on_command({std::move(message.line), std::move(message.client), message.layout_id,
                         std::move(message.command), from_dds(std::move(message.from))});
  }
  void on_gateway_command(dds::GatewayCommandMessage message) override {
    handler_.on_gateway_command({std::move(message.line), std::move(message.client),
                                 std::move(message.command), from_dds(std::move(message.from))});
  }
  void on_output_refused(const dds::RequestOrigin& origin, std::uint16_t group,
                         line::OutputRefusal refusal, std::string_view why) override {
    handler_.on_output_refused({origin.line, origin.client, from_dds(origin.from)}, group, refusal,
                               why);
  }
  void on_command_refused(const dds::RequestOrigin& origin, std::uint8_t kind,
                          line::Refusal refusal, std::string_view why) override {
    handler_.on_command_refused({origin.line, origin.client, from_dds(origin.from)}, kind, refusal,
                                why);
  }
  void on_unreadable(std::uint64_t samples) override { handler_.on_unreadable(samples); }
  void on_misfit(std::string_view topic, std::string_view policy) override {
    handler_.on_misfit(topic, policy);
  }
  void on_remote_state(const dds::RemoteSource& source, std::int64_t time) override {
    handler_.on_remote_state(from_dds(source), time);
  }
  void on_remote_layout(const dds::RemoteSource& source, const image::Layout& layout) override {
    handler_.on_remote_layout(from_dds(source), layout);
  }
  void on_remote_image(const dds::RemoteSource& source, const image::Snapshot& image) override {
    handler_.on_remote_image(from_dds(source), image);
  }

 private:
  RequestHandler& handler_;
};

class DdsEdge final : public DataEdge {
 public:
  // revoked: null without DDS-Security. identities: null without a process of the endpoints that
  // can be replaced.
  DdsEdge(std::unique_ptr<dds::GatewayBridge> bridge,
          std::shared_ptr<security::RevokedNames> revoked,
          std::unique_ptr<security::IdentityWatch> identities, dds::AddressChange addresses,
          std::shared_ptr<ProcessEnds> ends, std::shared_ptr<exchange::Bell> bell)
      : bridge_(std::move(bridge)),
        revoked_(std::move(revoked)),
        identities_(std::move(identities)),
        addresses_(std::move(addresses)),
        ends_(std::move(ends)),
        bell_(std::move(bell)) {}

  bool add_line(const std::string& line) override { return bridge_->add_line(line); }
  void remove_line(const std::string& line) override {
    bridge_->remove_line(line);
    if (const auto direct = direct_.find(line); direct != direct_.end()) {
      direct_before_ += direct->second->records().published();
      direct_.erase(direct);
    }
  }

  bool set_named_groups(const std::string& line, std::span<const named::GroupType> types) override {
    return bridge_->set_named_groups(line, types);
  }

  bool follow(const std::vector<config::RemoteLine>& lines) override {
    std::vector<dds::RemoteLine> wanted;
    wanted.reserve(lines.size());
    for (const config::RemoteLine& line : lines) {
      wanted.push_back({line.gateway, line.line});
    }
    return bridge_->follow(std::move(wanted));
  }

  void set_clock(const ClockMap& clock) override { bridge_->set_clock(to_dds(clock)); }
  void publish_line(const LineInfo& info, const line::LineState& state, Instant now,
                    const std::vector<Property>& properties) override {
    bridge_->publish(
        dds::LineInfo{info.name, info.interface_uri, info.bit_rate, to_dds(info.access)}, state,
        now, to_dds(properties));
  }
  void publish_node(std::string_view line, const NodeInfo& info, const line::NodeState& state,
                    Instant now, const std::vector<Property>& properties) override {
    bridge_->publish(line, dds::NodeInfo{info.name, info.since}, state, now, to_dds(properties));
  }
  void publish_output_state(std::string_view line, const line::OutputState& state,
                            Instant now) override {
    bridge_->publish(line, state, now);
  }
  void publish_layout(std::string_view line, const image::Layout& layout) override {
    bridge_->publish(line, layout);
  }
  void publish_image(std::string_view line, const image::Snapshot& snapshot) override {
    bridge_->publish(line, snapshot);
  }
  std::shared_ptr<DirectImages> make_direct_images(
      const config::LinePlan& plan, const std::array<image::Layout, 2>& layouts) override;
  void share_images(const std::string& line, const std::shared_ptr<DirectImages>& images) override {
    bridge_->share_images(line, shared_files(images));
  }
  void set_named_types(std::string_view line, image::Direction direction,
                       std::span<const named::DeviceType> types) override {
    bridge_->set_named_types(line, direction, types);
  }
  bool has_readers(const named::DeviceType& type) override { return bridge_->has_readers(type); }
  void watch_readers(std::function<void()> changed) override {
    bridge_->watch_readers(std::move(changed));
  }
  bool accepts_named(const named::DeviceType& type) const override {
    return bridge_->accepts_named(type);
  }
  void publish_named(const NamedSample& sample, const image::Snapshot& snapshot) override {
    bridge_->publish(sample.type, snapshot, sample.number, sample.times, sample.waits);
  }
  bool accepts_image(std::string_view line, image::Direction direction) const override {
    return bridge_->accepts_image(line, direction);
  }
  void publish_pdo_update(std::string_view line, const image::Layout& layout,
                          const image::Snapshot& snapshot, const image::PdoMark& mark,
                          std::uint32_t receptions) override {
    bridge_->publish_pdo_update(line, layout, snapshot, mark, receptions);
  }
  void publish_reception(std::string_view line, const image::Layout& layout,
                         const pdo::Reception& reception) override {
    bridge_->publish(line, layout, reception);
  }
  void publish_gateway(const GatewayInfo& info, Instant now) override {
    bridge_->publish(to_dds(info), now);
  }
  void publish_event(std::string_view line, const Event& event, std::string_view text) override {
    bridge_->publish(line, event, text);
  }

  EventMembers members(const EventData& data) const override {
    const dds::EventFields fields = dds::pack(data);
    return {fields.code, fields.value, {fields.bytes().begin(), fields.bytes().end()}};
  }

  std::uint64_t failed_samples() const override { return bridge_->counters().failed; }
  std::size_t participants() const override { return bridge_->discovery().participants; }
  EdgeStatistics statistics() const override;
  std::size_t namesakes() const override { return bridge_->namesakes(); }
  std::vector<std::string> other_gateways() const override { return bridge_->other_gateways(); }

  void poll(Duration timeout, RequestHandler& handler) override {
    if (revoked_)
      revoked_->update(monotonic_now());
    if (!end_access())
      follow_addresses();
    Requests requests(handler);
    bridge_->poll(timeout, requests);
  }
  void wake() override { bridge_->wake(); }
  std::vector<std::string> warnings(Instant now) override {
    return guard_.update(bridge_->guard_counters(), now);
  }
  std::optional<EdgeNotice> pop_notice(Instant now) override { return ends_->pop(now); }
  std::string condition(Instant now) const override { return ends_->condition(now); }
  void reply(const line::Reply& reply) override { bridge_->reply(reply); }

 private:
  bool end_access();
  void follow_addresses();
  std::uint64_t direct_samples() const {
    std::uint64_t out = direct_before_;
    for (const auto& [line, direct] : direct_) {
      out += direct->records().published();
    }
    return out;
  }

  std::unique_ptr<dds::GatewayBridge> bridge_;
  std::shared_ptr<security::RevokedNames> revoked_;  // used by the thread that polls
  std::unique_ptr<security::IdentityWatch> identities_;
  dds::AddressChange addresses_;
  std::uint64_t starts_ = 0;                    // of the process that addresses_ knows
  std::shared_ptr<ProcessEnds> ends_;           // of the DDS process; none without one
  const std::shared_ptr<exchange::Bell> bell_;  // of the DDS process; none without one
  std::map<std::string, std::shared_ptr<DirectImages>> direct_;  // by line
  std::uint64_t direct_before_ = 0;                              // images of lines that are no more
  dds::guard::Report guard_;
};

// A layout that changes, the value history, and named topics need the publisher. A system that
// cannot protect the memory leaves the images to it, too.
std::shared_ptr<DirectImages> DdsEdge::make_direct_images(
    const config::LinePlan& plan, const std::array<image::Layout, 2>& layouts) {
  if (bell_ == nullptr || plan.config.role == line::Role::observer ||
      !plan.history.entries.empty() || plan.named.published) {
    return nullptr;
  }
  try {
    return direct_[plan.config.name] = std::make_shared<DirectImages>(plan, layouts, bell_);
  } catch (const std::system_error& error) {
    spdlog::warn("{}: images take the longer way: {}", plan.config.name, error.what());
    return nullptr;
  }
}

// Participants with an identity that was revoked or has expired must no longer receive anything.
// Returns whether the process was asked to end.
bool DdsEdge::end_access() {
  if (!identities_)
    return false;
  const Instant now = monotonic_now();
  const std::string reason = identities_->due(now, std::time(nullptr), bridge_->next_expiry());
  if (reason.empty() || !bridge_->replace_process(reason))
    return false;
  identities_->note_replaced(now);
  addresses_.ends(now);
  return true;
}

// A participant of this process cannot be replaced.
void DdsEdge::follow_addresses() {
  const Instant now = monotonic_now();
  const bool same_process = bell_ == nullptr;
  const std::uint64_t starts = same_process ? 1 : bridge_->process_starts();
  if (std::exchange(starts_, starts) != starts)
    addresses_.started(now);
  const std::string reason = addresses_.due(now);
  if (reason.empty())
    return;
  if (same_process) {
    spdlog::warn(
        "{}, which DDS does not use before linegated is started again; with `dds: {{process: "
        "own}}` it would",
        reason);
    addresses_.started(now);  // it is reported once
  } else if (bridge_->replace_process(reason)) {
    addresses_.ends(now);
  }
}

EdgeStatistics DdsEdge::statistics() const {
  const dds::DiscoveryCounters discovery = bridge_->discovery();
  const dds::guard::Counters guard = bridge_->guard_counters();
  EdgeStatistics out{discovery.participants,
                     discovery.most,
                     {{"discovery-discovered", discovery.discovered},
                      {"discovery-gone", discovery.gone},
                      {"discovery-endpoints", guard.endpoints},
                      {"samples-published", bridge_->counters().samples + direct_samples()},
                      {"samples-failed", bridge_->counters().failed},
                      {"guard-received", guard.received}}};
  for (std::size_t i = 1; i < dds::guard::kReasons; ++i) {
    const auto reason = static_cast<dds::guard::Reason>(i);
    out.counters.push_back({"guard-dropped-" + std::string(to_string(reason)), guard.of(reason)});
  }
  if (const std::uint64_t starts = bridge_->process_starts(); starts != 0) {
    out.counters.push_back({"dds-process-starts", starts});
  }
  return out;
}

}  // namespace

Loaded<std::unique_ptr<DataEdge>> make_dds_edge(const config::Plant& plant,
                                                std::uint64_t incarnation) {
  dds::GatewayOptions options;
  options.gateway = plant.gateway;
  options.incarnation = incarnation;
  options.domain = plant.dds_domain;
  options.participants = plant.dds_participants;
  options.network = {.interfaces = plant.dds_interfaces,
                     .peers = plant.dds_peers,
                     .servers = plant.dds_servers,
                     .multicast_images = plant.dds_multicast};
  options.profile_file = plant.dds_profile;
  options.guard = plant.dds_guard;
  options.partitions = plant.dds_partitions;
  options.last_words = plant.dds_last_words;
  std::shared_ptr<security::RevokedNames> revoked;
  std::unique_ptr<security::IdentityWatch> identities;
  if (!plant.dds_security.empty()) {
    const security::Files files = security::files_in(plant.dds_security);
    options.security = dds::security_with(files);
    options.security.request_partition = security::requests_of_gateway(plant.gateway);
    revoked = std::make_shared<security::RevokedNames>(files.revoked_names);
    if (plant.dds_own_process)
      identities = std::make_unique<security::IdentityWatch>(files);
    options.security.is_holder = security::is_holder;
    options.security.is_revoked = [revoked](std::string_view right, std::string_view name) {
      return revoked->contains(right, name, monotonic_now());
    };
  }
  for (const auto& line : plant.lines) {
    options.lines.push_back(line.config.name);
  }
  dds::AddressChange addresses(dds::AddressWatch(plant.dds_interfaces));
  auto ends = std::make_shared<ProcessEnds>(event::DdsProcess::endpoints);
  const auto bell = plant.dds_own_process ? std::make_shared<exchange::Bell>() : nullptr;
  auto made = plant.dds_own_process ? make_bridge_to_process(options, plant, ends, bell)
                                    : dds::GatewayBridge::make(options);
  Loaded<std::unique_ptr<DataEdge>> out;
  out.diagnostics = std::move(made.diagnostics);
  if (made.value) {
    out.value =
        std::make_unique<DdsEdge>(std::move(*made.value), std::move(revoked), std::move(identities),
                                  std::move(addresses), std::move(ends), bell);
  }
  return out;
}

std::vector<Diagnostic> check_dds_profiles(const std::string& file) {
  return dds::check_profiles(file);
}

std::string dds_profiles_in_use(const std::string& file) {
  return dds::profiles_in_use(file);
}

std::uint32_t dds_participants_of_profile(const std::string& file) {
  static_assert(config::kUsualDdsParticipants == dds::kMostParticipants);
  return static_cast<std::uint32_t>(
      std::min<std::size_t>(dds::participants_of_profile(file), UINT32_MAX));
}

std::vector<Diagnostic> check_dds_identity(const config::Plant& plant, std::time_t now) {
  auto out =
      security::check_gateway(plant.dds_security, plant.gateway, now, named_topics_of(plant));
  const auto of_routes = security::check_requests(plant.dds_routes_security, plant.dds_security,
                                                  addressed_lines_of(plant), now);
  out.insert(out.end(), of_routes.begin(), of_routes.end());
  return out;
}

std::vector<Diagnostic> check_dds_permissions(const config::Plant& plant) {
  auto out = security::check_named_topics(plant.dds_security, named_topics_of(plant));
  const auto of_routes =
      security::check_request_lines(plant.dds_routes_security, addressed_lines_of(plant));
  out.insert(out.end(), of_routes.begin(), of_routes.end());
  return out;
}

std::vector<Diagnostic> check_dds_exposure(const config::Plant& plant) {
  std::string lines;
  std::string buses;  // that EMCYs of other gateways are sent on
  for (const config::LinePlan& line : plant.lines) {
    if (line.commands == config::Access::all || line.outputs == config::Access::all)
      lines += (lines.empty() ? "" : ", ") + line.config.name;
    if (!line.remote_emcys.empty())
      buses += (buses.empty() ? "" : ", ") + line.config.name;
  }
  if (!plant.dds_security.empty() && !plant.dds_own_process)
    return {{Severity::warning, plant.file, 0, 0,
             "with `dds: {process: same}` an identity that is revoked or expires continues to read "
             "until the gateway is restarted: use `process: own`, the default"}};
  if ((lines.empty() && buses.empty()) || !plant.dds_security.empty())
    return {};
  std::string transports;
  for (const std::string& transport : dds::open_transports(plant.dds_profile, plant.dds_interfaces))
    transports += (transports.empty() ? "" : "; ") + transport;
  if (transports.empty())
    return {};
  std::string actions = lines.empty() ? "" : "send commands or outputs to " + lines;
  std::string remedy = lines.empty() ? "" : "set access: read";
  if (!buses.empty()) {
    actions += (lines.empty() ? "" : ", and ") + ("put EMCYs on the bus of " + buses) +
               " (routes with `emcy: true`)";
    remedy += std::string(lines.empty() ? "" : " and ") + "remove `emcy: true`";
  }
  return {{Severity::warning, dds_profiles_in_use(plant.dds_profile), 0, 0,
           "DDS is open without DDS-Security (" + transports + "), and every host that reaches " +
               "it may " + actions +
               ": secure DDS (linegate security, dds: {security: FOLDER}), keep it on "
               "this host (dds: {interfaces: [lo]}), or " +
               remedy}};
}

DdsLibraryLog::DdsLibraryLog(std::function<void(Severity, std::string_view text)> log) {
  dds::set_library_log(std::move(log));
}

DdsLibraryLog::~DdsLibraryLog() {
  dds::set_library_log({});
}

}  // namespace linegate::gateway
