// SPDX-License-Identifier: Apache-2.0
#include "stack/line/diagnosis_service.h"

#include "stack/line/build.h"
#include "stack/line/scan_service.h"
#include "stack/od/objects.h"

namespace linegate::line {

DiagnosisService::DiagnosisService(ServiceHost& host, const LineConfig& config, node::Node& node,
                                   manager::Manager& manager, const ScanService& scanning,
                                   EventLog& events)
    : Service(host),
      node_(node),
      manager_(manager),
      scanning_(scanning),
      events_(events),
      diagnosis_(diagnosis_options(config), node.dictionary(), *this),
      objects_(node.dictionary(), diagnosis_, config.node_id),
      foreign_manager_(node.dispatch(), events) {
  events_.set_listener(&diagnosis_);
}

DiagnosisService::~DiagnosisService() {
  events_.set_listener(nullptr);
}

// After a fatal error all nodes are stopped, the own one too.
void DiagnosisService::advance(Instant now) {
  if (diagnosis_.pop_failure() && host().manages()) {
    manager_.halt(now);
  }
  diagnosis_.update(now);
}

Instant DiagnosisService::next_wake() const {
  return diagnosis_.failed() ? Instant{} : diagnosis_.next_wake();
}

void DiagnosisService::nmt_received(std::uint16_t index, const can::Frame& frame) {
  if (index != 0 || host().manages()) {
    foreign_manager_.receive(index, frame);
  }
}

diagnosis::NetworkFacts DiagnosisService::network() const {
  constexpr od::Address kNmtStartup{od::objects::kNmtStartup, 0};
  constexpr std::uint64_t kSlavesNotStarted = 1U << 3U;
  const std::uint64_t bits = node_.dictionary().number(kNmtStartup).value_or(0);
  return {.running = host().is_running(),
          .manages = host().manages(),
          .own = node_.state(),
          .manager = manager_.state(),
          .starts_nodes = (bits & kSlavesNotStarted) == 0,
          .scanning = scanning_.scans_all()};
}

}  // namespace linegate::line
