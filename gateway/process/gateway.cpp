// SPDX-License-Identifier: Apache-2.0
#include "gateway/process/gateway.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "gateway/publish/access.h"
#include "gateway/publish/dds_edge.h"
#include "gateway/publish/dds_peers.h"
#include "gateway/runtime/channels.h"
#include "gateway/runtime/clock.h"
#include "gateway/runtime/device_runner.h"
#include "gateway/runtime/scan_plan.h"
#include "stack/od/objects.h"

namespace linegate::gateway {
namespace {

// Waits for one full round of the executor, which is running: the second visit follows the round of
// the first.
void await_round(Executor& executor) {
  for (int i = 0; i < 2; ++i) {
    executor.visit([] {});
  }
}

std::string by(const std::optional<SignalSender>& sender) {
  return sender ? fmt::format(" (by process {} of user {})", sender->process, sender->user)
                : std::string();
}

// A reload cannot change them.
config::Plant dds_settings_of(config::Plant plant) {
  plant.lines.clear();
  plant.bindings.clear();
  return plant;
}

void append(std::vector<Diagnostic>& to, std::vector<Diagnostic> from) {
  to.insert(to.end(), from.begin(), from.end());
}

}  // namespace

std::string versions() {
  return "linegate " LINEGATE_VERSION ", DDS contract linegate::v1";
}

Loaded<std::unique_ptr<Gateway>> Gateway::make(const config::Plant& plant,
                                               std::uint64_t incarnation) {
  Loaded<std::unique_ptr<Gateway>> loaded;
  std::unique_ptr<Gateway> gateway(new Gateway());
  gateway->identity_ = identity_of(plant, dds_participants_of_profile(plant.dds_profile));
  gateway->executor_plans_ = plant.executors;
  auto lines = make_lines(plant, difference({}, plant).started, loaded.diagnostics);
  if (!has_errors(loaded.diagnostics)) {
    auto edge = make_dds_edge(plant, incarnation);
    append(loaded.diagnostics, std::move(edge.diagnostics));
    gateway->edge_ = edge.value ? std::move(*edge.value) : nullptr;
  }
  if (has_errors(loaded.diagnostics)) {
    return loaded;
  }
  gateway->info_.event_stream = incarnation;
  if (plant.journal) {
    gateway->journal_ = std::make_unique<JournalThread>(
        JournalThread::Options{.plan = *plant.journal, .incarnation = incarnation});
  }
  gateway->publisher_ =
      std::make_unique<Publisher>(*gateway->edge_, gateway->hosts_, gateway->journal_.get());
  if (plant.journal) {
    gateway->pages_ = std::make_unique<JournalServer>(
        plant.journal->file, gateway->publisher_->pages(), gateway->publisher_->wakeup());
  }
  gateway->peers_ = std::make_unique<PeerThread>(
      [settings = dds_settings_of(plant), ends = gateway->peer_ends_](bool events) {
        return make_dds_peers(settings, events, ends);
      });
  gateway->publisher_->add_counter("routed-emcys-lost", gateway->peers_->emcys_lost());
  gateway->requests_ = std::make_unique<RequestReceiver>(
      *gateway->edge_, gateway->hosts_,
      PublisherInlets{gateway->publisher_->refusals(), gateway->publisher_->notices(),
                      gateway->publisher_->wakeup()},
      gateway->publisher_->clients(), versions(), gateway->pages_.get());
  append(loaded.diagnostics, gateway->apply_lines(std::move(lines), plant));
  if (!has_errors(loaded.diagnostics)) {
    gateway->info_.version = LINEGATE_VERSION;
    gateway->info_.started = gateway->info_.configured = monotonic_now();
    gateway->report(event::GatewayStarted{static_cast<std::uint32_t>(gateway->hosts_.size())},
                    fmt::format("gateway started with {} lines", gateway->hosts_.size()));
    loaded.value = std::move(gateway);
  }
  return loaded;
}

void Gateway::set_reload_sender(const std::optional<SignalSender>& sender) {
  reload_sender_ = sender;
}

// Called by the main thread, like all functions that report on the gateway itself.
void Gateway::report(const EventData& what, std::string text) {
  info_.configuration = configuration_hash(identity_);
  info_.lines.clear();
  for (const auto& host : hosts_) {
    info_.lines.push_back({host->name(), host->plan.interface.uri});
  }
  GatewayNews news;
  news.event.time = monotonic_now();
  news.event.data = what;
  news.text = std::move(text);
  news.info = info_;
  publisher_->report(std::move(news));
}

void Gateway::refuse_reload(const std::vector<Diagnostic>& diagnostics) {
  const auto is_error = [](const Diagnostic& d) { return d.severity == Severity::error; };
  const auto first = std::ranges::find_if(diagnostics, is_error);
  ++info_.reloads_refused;
  report(event::GatewayReloadRefused{static_cast<std::uint32_t>(
             std::ranges::count_if(diagnostics, is_error))},
         "not reloaded" + by(reload_sender_) + ", everything runs as before: " +
             (first == diagnostics.end() ? std::string("no reason given") : to_string(*first)));
}

Gateway::~Gateway() {
  stop();
}

std::vector<Gateway::NewLine> Gateway::make_lines(const config::Plant& plant,
                                                  const std::vector<std::string>& names,
                                                  std::vector<Diagnostic>& diagnostics) {
  std::vector<NewLine> out;
  for (const auto& plan : plant.lines) {
    if (std::find(names.begin(), names.end(), plan.config.name) == names.end()) {
      continue;
    }
    auto made = line::Line::make(plan.config);
    if (!made.value) {
      append(diagnostics, std::move(made.diagnostics));
      continue;
    }
    const line::Line& line = **made.value;
    auto host = std::make_unique<LineHost>(plan, line.layout(image::Direction::inputs),
                                           line.layout(image::Direction::outputs));
    out.push_back({std::move(*made.value), std::move(host), nullptr});
  }
  return out;
}

std::vector<Diagnostic> Gateway::apply_lines(std::vector<NewLine> lines,
                                             const config::Plant& plant) {
  std::vector<Diagnostic> diagnostics;
  std::vector<std::unique_ptr<LineHost>> before = std::exchange(hosts_, {});
  std::vector<LineHost*> started;
  for (const NewLine& made : lines) {
    made.host->executor = &executor_for(plant, made.host->plan);
  }
  std::vector<const BoundLink*> known;
  for (const auto& link : links_) {
    known.push_back(link.get());
  }
  link_lines(plant, lines, before);
  for (NewLine& made : lines) {
    offer_named_groups(*made.host, diagnostics);
    make_runner(made, diagnostics);
  }
  for (const auto& plan : plant.lines) {
    const auto called_so = [&](const auto& host) {
      return host != nullptr && host->name() == plan.config.name;
    };
    if (const auto there = std::find_if(before.begin(), before.end(), called_so);
        there != before.end()) {
      hosts_.push_back(std::move(*there));
      continue;
    }
    const auto made = std::find_if(lines.begin(), lines.end(),
                                   [&](const NewLine& line) { return called_so(line.host); });
    if (made != lines.end()) {
      made->host->executor->add(std::move(made->runner));
      started.push_back(made->host.get());
      hosts_.push_back(std::move(made->host));
    }
  }
  bind_ends(known, started);
  join_routes(started);
  publisher_->set_lines(hosts_);
  requests_->set_lines(hosts_);
  peers_->set_lines(hosts_);
  return diagnostics;
}

// The outputs of a manager and of devices have one layout while the line exists. A configuration
// whose names collide is refused when it is read.
void Gateway::offer_named_groups(const LineHost& host, std::vector<Diagnostic>& diagnostics) {
  const config::NamedTopics& topics = host.plan.named;
  if (topics.groups.empty()) {
    return;
  }
  const named::GroupTypes made = named::group_types(
      host.name(), host.layout(image::Direction::outputs), topics.groups, topics.aliases);
  for (const std::string& collision : made.collisions) {
    diagnostics.push_back({Severity::warning, host.name(), 0, 0, collision});
  }
  if (!edge_->set_named_groups(host.name(), made.types)) {
    diagnostics.push_back({Severity::warning, host.name(), 0, 0,
                           "not all of its named groups can be written: DDS has no readers"});
  }
}

void Gateway::make_runner(NewLine& made, std::vector<Diagnostic>& diagnostics) {
  LineHost& host = *made.host;
  host.storage = storage_for(host, diagnostics);
  run_devices(host, diagnostics);
  host.port.direct = edge_->make_direct_images(host.plan, host.layouts);
  made.runner = std::make_unique<LineRunner>(std::move(made.line), channel_for(host), host.plan,
                                             host.port, publisher_->wakeup(), host.storage);
  std::vector<BoundSource> sources;
  std::vector<BoundTarget> targets;
  for (const auto& link : links_) {
    if (link->bindings.front().from == host.name()) {
      sources.emplace_back(*link);
    }
    if (link->bindings.front().to == host.name()) {
      targets.emplace_back(*link);
      link->runner = link->taker == nullptr ? made.runner.get() : nullptr;
    }
  }
  made.runner->bind(std::move(sources), std::move(targets));
  if (host.interface() != 0) {
    made.runner->route(std::make_unique<RouteEnd>());
    host.port.peers = &peers_->wakeup();
  }
  host.runner = made.runner.get();
}

Executor& Gateway::executor_for(const config::Plant& plant, const config::LinePlan& line) {
  const std::string& name = line.executor;
  const auto there = std::find_if(executors_.begin(), executors_.end(), [&](const auto& other) {
    return !name.empty() && other.name == name;
  });
  if (there != executors_.end()) {
    return *there->executor;
  }
  const auto planned = std::find_if(plant.executors.begin(), plant.executors.end(),
                                    [&](const auto& other) { return other.name == name; });
  config::ExecutorPlan plan;
  if (!name.empty() && planned != plant.executors.end()) {
    plan = *planned;
  } else {
    plan.name = name.empty() ? line.config.name : name;
  }
  executors_.push_back({name, std::make_unique<Executor>(std::move(plan))});
  return *executors_.back().executor;
}

std::vector<NodeStorage> Gateway::storage_for(const LineHost& host,
                                              std::vector<Diagnostic>& diagnostics) {
  const std::string& folder = host.plan.storage;
  const line::LineConfig& config = host.plan.config;
  std::vector<NodeStorage> out;
  if (folder.empty()) {
    return out;
  }
  if (const auto problem = make_parameter_folder(folder)) {
    diagnostics.push_back(*problem);
  }
  const auto add = [&](line::ParameterSet of, const std::string& path) {
    out.push_back({of, &storage_.add(path, host.executor->wakeup())});
  };
  if (config.devices.empty()) {
    add({}, parameter_path(folder, host.name(), config.node_id));
  }
  for (const line::DeviceConfig& device : config.devices) {
    if (device.device.find(od::objects::kStoreParameters) != nullptr) {
      add({.device = device.id}, parameter_path(folder, host.name(), device.id));
    }
    if (device.lss) {
      add({.device = device.id, .kind = line::ParameterSet::Kind::lss},
          lss_path(folder, host.name(), device.id));
    }
  }
  return out;
}

void Gateway::run_devices(LineHost& host, std::vector<Diagnostic>& diagnostics) {
  const config::LinePlan& plan = host.plan;
  if (plan.simulated.empty()) {
    return;
  }
  auto devices = make_devices(plan.simulated, plan.storage, plan.config.name);
  if (!devices.value) {
    append(diagnostics, std::move(devices.diagnostics));
    return;
  }
  if (devices_ == nullptr) {
    config::ExecutorPlan executor;
    executor.name = "devices";
    devices_ = std::make_unique<Executor>(std::move(executor));
  }
  auto runner =
      std::make_unique<DeviceRunner>(std::move(*devices.value),
                                     open_channel(plan.interface, plan.config.bit_rate, network_,
                                                  Use::transmit, plan.config.data_bit_rate),
                                     plan.interface.uri, false);
  host.devices = runner.get();
  devices_->add(std::move(runner));
}

std::unique_ptr<can_bridge::Channel> Gateway::channel_for(LineHost& host) {
  const config::LinePlan& plan = host.plan;
  const Use use = plan.config.role == line::Role::observer ? Use::observe : Use::transmit;
  auto channel =
      open_channel(plan.interface, plan.config.bit_rate, network_, use, plan.config.data_bit_rate);
  if (!plan.record) {
    return channel;
  }
  host.recording =
      &recorder_.add(host.name(), name_in_log(plan.interface, host.name()), *plan.record);
  return std::make_unique<RecordingChannel>(std::move(channel), *host.recording);
}

// Threads that are already running continue.
void Gateway::start() {
  if (journal_ != nullptr) {
    journal_->start();  // before events get their numbers
  }
  publisher_->start();
  if (pages_ != nullptr) {
    pages_->start();
  }
  storage_.start();
  recorder_.start();
  if (devices_ != nullptr) {
    devices_->start();
    await_round(*devices_);  // the devices are switched on before a line starts
  }
  for (auto& [name, executor] : executors_) {
    executor->start();
  }
  peers_->start();
  requests_->start();
}

void Gateway::stop() {
  if (requests_ != nullptr) {
    requests_->stop();
  }
  if (pages_ != nullptr && !pages_->stop()) {
    spdlog::error("the disk of the journal does not respond: requests to read it are not answered");
    (void)pages_.release();
  }
  for (auto& [name, executor] : executors_) {
    executor->request_stop();
  }
  for (auto& [name, executor] : executors_) {
    executor->join();
  }
  if (peers_ != nullptr) {
    peers_->stop();
  }
  storage_.stop();
  recorder_.stop();
  if (devices_ != nullptr) {
    devices_->request_stop();
    devices_->join();
  }
  if (publisher_ != nullptr) {
    publisher_->stop();
  }
  stop_journal();
}

// A disk that hangs must not delay the end, and with it the last samples: the journal then exists
// until the process ends.
void Gateway::stop_journal() {
  if (journal_ == nullptr) {
    return;
  }
  if (!journal_->stop()) {
    spdlog::error("the disk of the journal does not respond: its last events are not stored");
    (void)journal_.release();
    return;
  }
  while (const auto news = journal_->pop_news()) {
    spdlog::info("at the end: {}", journal_->describe(*news));
  }
  if (const std::uint64_t lost = journal_->lost_at_stop(); lost != 0) {
    spdlog::error("the gateway ends with {} events that the journal could not store", lost);
  }
}

void Gateway::report_journal() {
  if (journal_ == nullptr) {
    return;
  }
  while (const auto news = journal_->pop_news()) {
    report(*news, journal_->describe(*news));
  }
}

void Gateway::report_edge() {
  while (const auto notice = edge_->pop_notice(monotonic_now())) {
    report(notice->event, notice->text);
  }
  while (const auto notice = peer_ends_->pop(monotonic_now())) {
    report(notice->event, notice->text);
  }
}

std::vector<std::string> Gateway::edge_conditions() const {
  const Instant now = monotonic_now();
  std::vector<std::string> out{edge_->condition(now), peer_ends_->condition(now)};
  std::erase(out, std::string());
  return out;
}

Gateway::Reload Gateway::reload(const config::Plant& wanted) {
  Reload out;
  out.difference = difference(identity_, wanted);
  std::vector<std::string> come = out.difference.started;
  std::vector<std::string> go = out.difference.stopped;
  come.insert(come.end(), out.difference.changed.begin(), out.difference.changed.end());
  go.insert(go.end(), out.difference.changed.begin(), out.difference.changed.end());
  out.diagnostics = out.difference.refusals;
  auto lines = make_lines(wanted, come, out.diagnostics);
  for (const NewLine& line : lines) {
    if (const auto problem = make_parameter_folder(line.host->plan.storage)) {
      out.diagnostics.push_back(*problem);
    }
  }
  if (has_errors(out.diagnostics)) {
    refuse_reload(out.diagnostics);
    return out;
  }
  out.done = true;
  if (!out.difference.empty()) {
    change(go, come, std::move(lines), wanted, out.diagnostics, out.difference.rerouted);
    identity_ = identity_of(wanted, identity_.dds_profile_participants);
    executor_plans_ = wanted.executors;
  }
  ++info_.reloads;
  info_.configured = monotonic_now();
  const config::PlanDifference& changes = out.difference;
  const std::size_t changed =
      changes.started.size() + changes.stopped.size() + changes.changed.size();
  report(event::GatewayReloaded{.changed = static_cast<std::uint32_t>(changed),
                                .lines = static_cast<std::uint32_t>(hosts_.size())},
         "reloaded" + by(reload_sender_) + ": " + describe(changes));
  return out;
}

// The remaining lines fill their rings meanwhile, which have room for about a second.
void Gateway::change(const std::vector<std::string>& go, const std::vector<std::string>& come,
                     std::vector<NewLine> lines, const config::Plant& wanted,
                     std::vector<Diagnostic>& diagnostics,
                     const std::vector<std::string>& rerouted) {
  requests_->stop();
  unbind_ends(go, false);
  stop_lines(go);
  unbind_ends(go, true);
  peers_->stop();
  publisher_->stop();
  storage_.stop();
  recorder_.stop();
  forget_lines(go);
  set_routes(rerouted, wanted);
  for (const std::string& name : come) {
    if (!edge_->add_line(name)) {
      diagnostics.push_back({Severity::warning, wanted.file, 0, 0,
                             "line " + name + " cannot be published: DDS has no writers"});
    }
  }
  append(diagnostics, apply_lines(std::move(lines), wanted));
  start();
}

std::optional<std::vector<Diagnostic>> Gateway::apply_scans() {
  std::vector<std::pair<std::string, AppliedScan>> taken;
  for (const auto& host : hosts_) {
    for (AppliedScan scan; host->port.scans.pop(scan);) {
      taken.emplace_back(host->name(), std::move(scan));
    }
  }
  if (taken.empty()) {
    return std::nullopt;
  }
  std::vector<Diagnostic> diagnostics;
  for (const auto& [name, scan] : taken) {
    apply_scan(name, scan, diagnostics);
  }
  return diagnostics;
}

// If the result cannot be used, the line keeps its configuration; it is made anew if its nodes were
// reset.
void Gateway::apply_scan(const std::string& name, const AppliedScan& scan,
                         std::vector<Diagnostic>& diagnostics) {
  const config::LinePlan& present = host(name).plan;
  Loaded<config::LinePlan> wanted = plan_of(present, scan);
  append(diagnostics, std::move(wanted.diagnostics));
  if (!wanted.value && !scan.request.restore) {
    LineHost& kept = host(name);
    kept.executor->visit([&] { kept.runner->scan_kept(); });
    return;
  }
  config::Plant plant = plant_with(wanted.value ? *std::move(wanted.value) : present);
  auto lines = make_lines(plant, {name}, diagnostics);
  if (lines.empty()) {
    plant = plant_with(present);
    lines = make_lines(plant, {name}, diagnostics);
  }
  requests_->stop();
  for (const NewLine& made : lines) {
    hand_on_commands(host(name), *made.host);
  }
  change({name}, {name}, std::move(lines), plant, diagnostics);
}

// Queued commands refer to the previous output layout.
void Gateway::hand_on_commands(LineHost& from, LineHost& to) {
  constexpr auto kOutputs = image::Direction::outputs;
  const bool same_outputs = from.layout(kOutputs).id == to.layout(kOutputs).id;
  from.executor->visit([&] {
    for (line::Command command; from.port.commands.pop(command);) {
      if (!same_outputs && is_of_outputs(line::kind(command))) {
        requests_->refuse(command.tag, line::Refusal::stale_layout);
      } else {
        to.port.commands.push(command);
      }
    }
    for (request::GatewayCommand command; from.port.interface_commands.pop(command);) {
      to.port.interface_commands.push(command);
    }
  });
}

config::Plant Gateway::plant_with(config::LinePlan line) const {
  config::Plant plant;
  plant.executors = executor_plans_;
  for (const auto& host : hosts_) {
    config::LinePlan& plan = plant.lines.emplace_back();
    plan.config.name = host->name();
    if (plan.config.name == line.config.name) {
      plan = line;
    }
  }
  return plant;
}

LineHost& Gateway::host(const std::string& name) {
  return **std::find_if(hosts_.begin(), hosts_.end(),
                        [&](const auto& host) { return host->name() == name; });
}

void Gateway::stop_lines(const std::vector<std::string>& names) {
  std::vector<Runner*> devices;
  for (auto& [name, executor] : executors_) {
    std::vector<Runner*> runners;
    for (const std::string& line : names) {
      if (host(line).executor == executor.get()) {
        runners.push_back(host(line).runner);
      }
    }
    executor->send_away(runners);
  }
  for (const std::string& line : names) {
    if (Runner* runner = host(line).devices) {
      devices.push_back(runner);
    }
  }
  leave_routes(names);
  if (!devices.empty()) {
    devices_->send_away(devices);
  }
}

void Gateway::forget_lines(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    const LineHost& gone = host(name);
    for (const NodeStorage& storage : gone.storage) {
      storage_.remove(*storage.file);
    }
    if (gone.recording != nullptr) {
      recorder_.remove(*gone.recording);
    }
    edge_->remove_line(name);
    std::erase_if(links_, [&](const auto& link) {
      const config::Binding& first = link->bindings.front();
      return first.from == name || first.to == name;
    });
    std::erase_if(hosts_, [&](const auto& other) { return other.get() == &gone; });
  }
  std::erase_if(executors_, [&](const NamedExecutor& named) {
    return std::none_of(hosts_.begin(), hosts_.end(),
                        [&](const auto& host) { return host->executor == named.executor.get(); });
  });
}

std::vector<WatchedThread> Gateway::threads() {
  std::vector<WatchedThread> out;
  const auto watch = [&out](Executor* executor) {
    out.push_back({"exec " + executor->name(), &executor->rounds(),
                   [executor] { executor->wakeup().signal(); }});
  };
  for (const auto& [name, executor] : executors_) {
    watch(executor.get());
  }
  if (devices_ != nullptr) {
    watch(devices_.get());
  }
  out.push_back({"publisher", &publisher_->rounds(), [this] { publisher_->wakeup().signal(); }});
  out.push_back({"requests", &requests_->rounds(), [this] { requests_->wake(); }});
  return out;
}

std::vector<ShownLine> Gateway::shown_lines() {
  std::vector<ShownLine> out;
  for (const auto& host : hosts_) {
    if (const line::LineState* state = host->shown.fetch()) {
      host->last_shown = *state;
    }
    out.push_back({host->name(), host->last_shown});
  }
  return out;
}

}  // namespace linegate::gateway
