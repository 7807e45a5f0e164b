#include "gateway/gateway.h"

#include <algorithm>
#include <utility>

#include "gateway/channels.h"
#include "gateway/device_runner.h"
#include "gateway/line_runner.h"

namespace linegate::gateway {
namespace {

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
  append(loaded.diagnostics, gateway->make_lines(plant));
  if (!has_errors(loaded.diagnostics)) {
    append(loaded.diagnostics, gateway->make_bridge(plant, incarnation));
  }
  if (has_errors(loaded.diagnostics)) {
    return loaded;
  }
  gateway->publisher_ = std::make_unique<Publisher>(*gateway->bridge_, gateway->hosts_);
  for (std::size_t i = 0; i < gateway->hosts_.size(); ++i) {
    LineHost& host = *gateway->hosts_[i];
    host.executor = &gateway->executor_for(plant, host.plan);
    host.executor->add(std::make_unique<LineRunner>(
        std::move(gateway->lines_[i]),
        open_channel(host.plan.interface, host.plan.config.bit_rate, gateway->network_), host.plan,
        host.port, gateway->publisher_->wakeup(), gateway->storage_for(host, loaded.diagnostics)));
    append(loaded.diagnostics, gateway->add_devices(host.plan));
  }
  gateway->lines_.clear();
  gateway->intake_ =
      std::make_unique<Intake>(*gateway->bridge_, gateway->hosts_, gateway->publisher_->refusals(),
                               gateway->publisher_->wakeup(), versions());
  if (!has_errors(loaded.diagnostics)) {
    loaded.value = std::move(gateway);
  }
  return loaded;
}

Gateway::~Gateway() {
  stop();
}

std::vector<Diagnostic> Gateway::make_lines(const config::Plant& plant) {
  std::vector<Diagnostic> diagnostics;
  for (const auto& plan : plant.lines) {
    auto made = line::Line::make(plan.config);
    if (!made.value) {
      append(diagnostics, std::move(made.diagnostics));
      continue;
    }
    const line::Line& line = **made.value;
    hosts_.push_back(std::make_unique<LineHost>(plan, line.layout(image::Direction::inputs),
                                                line.layout(image::Direction::outputs)));
    lines_.push_back(std::move(*made.value));
  }
  return diagnostics;
}

std::vector<Diagnostic> Gateway::make_bridge(const config::Plant& plant,
                                             std::uint64_t incarnation) {
  dds::GatewayOptions options;
  options.gateway = plant.gateway;
  options.incarnation = incarnation;
  options.domain = plant.dds_domain;
  options.profile_file = plant.dds_profile;
  options.last_words = plant.dds_last_words;
  for (const auto& line : plant.lines) {
    options.lines.push_back(line.config.name);
  }
  auto made = dds::GatewayBridge::make(options);
  if (made.value) {
    bridge_ = std::move(*made.value);
  }
  return std::move(made.diagnostics);
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
    plan.name = line.config.name;
  }
  executors_.push_back({name, std::make_unique<Executor>(std::move(plan))});
  return *executors_.back().executor;
}

KeptFile* Gateway::storage_for(const LineHost& host, std::vector<Diagnostic>& diagnostics) {
  const std::string& folder = host.plan.storage;
  if (folder.empty()) {
    return nullptr;
  }
  if (const auto problem = make_parameter_folder(folder)) {
    diagnostics.push_back(*problem);
  }
  return &keeper_.add(parameter_path(folder, host.name(), host.plan.config.node_id),
                      host.executor->wakeup());
}

std::vector<Diagnostic> Gateway::add_devices(const config::LinePlan& line) {
  if (line.simulated.empty()) {
    return {};
  }
  auto devices = make_devices(line.simulated, line.storage, line.config.name);
  if (!devices.value) {
    return std::move(devices.diagnostics);
  }
  if (devices_ == nullptr) {
    config::ExecutorPlan plan;
    plan.name = "devices";
    devices_ = std::make_unique<Executor>(std::move(plan));
  }
  devices_->add(std::make_unique<DeviceRunner>(
      std::move(*devices.value), open_channel(line.interface, line.config.bit_rate, network_),
      line.interface.uri, false));
  return {};
}

void Gateway::start() {
  publisher_->start();
  keeper_.start();
  if (devices_ != nullptr) {
    devices_->start();
  }
  for (auto& [name, executor] : executors_) {
    executor->start();
  }
  intake_->start();
}

void Gateway::stop() {
  if (intake_ != nullptr) {
    intake_->stop();
  }
  for (auto& [name, executor] : executors_) {
    executor->request_stop();
  }
  for (auto& [name, executor] : executors_) {
    executor->join();
  }
  keeper_.stop();
  if (devices_ != nullptr) {
    devices_->request_stop();
    devices_->join();
  }
  if (publisher_ != nullptr) {
    publisher_->stop();
  }
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
  out.push_back({"intake", &intake_->rounds(), [this] { intake_->wake(); }});
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
