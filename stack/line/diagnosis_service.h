// SPDX-License-Identifier: Apache-2.0
// The diagnosis of a line (objects 5F00h to 5F80h). Stops a network in the state fatal error, and
// reports another NMT master on the bus. It has no commands. Private to stack/line.
#pragma once

#include "stack/diagnosis/diagnosis.h"
#include "stack/diagnosis/foreign_manager.h"
#include "stack/diagnosis/objects.h"
#include "stack/line/config.h"
#include "stack/line/service.h"
#include "stack/manager/manager.h"
#include "stack/node/node.h"

namespace linegate::line {

class ScanService;

class DiagnosisService final : public Service, diagnosis::Source {
 public:
  // Precondition: the dictionary of the node has diagnosis::add_objects(). All must outlive the
  // service. It receives events from now on.
  DiagnosisService(ServiceHost& host, const LineConfig& config, node::Node& node,
                   manager::Manager& manager, const ScanService& scanning, EventLog& events);
  ~DiagnosisService() override;

  bool needs_master() const override { return false; }
  void advance(Instant now) override;
  Instant next_wake() const override;
  void end(Refusal /*why*/, Instant /*now*/) override {}

  diagnosis::Diagnosis& diagnosis() { return diagnosis_; }
  const diagnosis::Diagnosis& diagnosis() const { return diagnosis_; }
  // Pass it each frame of can::Service::nmt that the own node did not send; index: see
  // ForeignManager.
  void nmt_received(std::uint16_t index, const can::Frame& frame);

 private:
  // diagnosis::Source
  diagnosis::NetworkFacts network() const override;
  const NodeState& node_seen(std::uint8_t node) const override { return manager_.node(node); }

  node::Node& node_;
  manager::Manager& manager_;
  const ScanService& scanning_;
  EventLog& events_;
  diagnosis::Diagnosis diagnosis_;
  diagnosis::Objects objects_;
  diagnosis::ForeignManager foreign_manager_;
};

}  // namespace linegate::line
