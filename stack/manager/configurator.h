// SPDX-License-Identifier: Apache-2.0
// The configuration manager of a line (CiA 302-3): applies the concise DCFs in the own object
// dictionary to nodes, as a step of their boot slave processes, several at once; and compares nodes
// with them, at any time.
//
// An object that cannot be written is reported as event::ConfigurationError.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/manager/boot_step.h"
#include "stack/manager/comparison.h"
#include "stack/manager/configuration_objects.h"
#include "stack/manager/configuration_run.h"
#include "stack/manager/node_report.h"
#include "stack/manager/node_tasks.h"
#include "stack/od/dictionary.h"
#include "stack/sdo/arbiter.h"

namespace linegate::manager {

class Configurator {
 public:
  // All references must outlive this object. See ConfigurationObjects for the dictionary and the
  // plans. sdo_timeout: for each answer of a node that is compared.
  Configurator(od::Dictionary& dictionary, std::span<const NodePlan> plans, sdo::Arbiter& sdo,
               EventLog& events, Duration sdo_timeout);

  ConfigurationObjects& objects() { return objects_; }
  const ConfigurationObjects& objects() const { return objects_; }

  // --- applying ---------------------------------------------------------------------------------

  // The configuration step of the node's boot slave process; this object must outlive it. Ends with
  // J if the node refuses an object.
  std::unique_ptr<BootStep> make_step(std::uint8_t node);
  // The node's next configuration is applied without comparing 1020h first.
  void force(std::uint8_t node) { forced_.set(node); }
  // Why the node's last configuration failed; nothing if it succeeded or there was none.
  const std::optional<Difference>& fault(std::uint8_t node) const { return faults_[node]; }

  // --- comparing --------------------------------------------------------------------------------

  // Starts a comparison, which ends with one NodeReport. False if the node is being configured or
  // compared. client: see sdo::Request::client.
  bool verify(std::uint8_t node, Instant now, std::uint32_t client = 0);
  // Ends the comparison without a report.
  void cancel_verify(std::uint8_t node) { (void)comparisons_.cancel(node); }
  std::optional<NodeReport> pop_report();

  // --- both -------------------------------------------------------------------------------------

  struct Progress {
    std::size_t done = 0;  // number of objects
    std::size_t total = 0;
  };
  // The progress of the configuration or comparison of that node; all 0 if there is none.
  Progress progress(std::uint8_t node) const;

  void advance(Instant now);
  Instant next_wake() const { return comparisons_.next_wake(); }

 private:
  class Step;

  ConfigurationOrder begin(std::uint8_t node);
  void ended(const ConfigurationRun& run, Instant now);

  EventLog& events_;
  ConfigurationObjects objects_;
  NodeTasks<Comparison> comparisons_;
  std::array<const ConfigurationRun*, 128> runs_{};  // in progress, by node-ID
  std::bitset<128> forced_;
  std::array<std::optional<Difference>, 128> faults_;
  std::deque<NodeReport> reports_;
};

}  // namespace linegate::manager
