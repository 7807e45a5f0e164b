// SPDX-License-Identifier: Apache-2.0
// Compares a node with its configuration: reads each object that the configuration writes and
// compares it with the last value written there, and the parameters of the PDOs of the image.
// Writes nothing.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/manager/node_report.h"
#include "stack/manager/node_tasks.h"
#include "stack/manager/plan.h"

namespace linegate::manager {

class Comparison {
 public:
  static constexpr sdo::Priority kPriority = sdo::Priority::background;
  static constexpr unsigned kRepeats = 1;

  // Commands (1010h, 1011h) are left out, because they do not return the written value. Objects
  // that turn out to be write-only are skipped, and so are parameters of `pdos` that the node
  // does not have.
  Comparison(std::uint8_t node, std::span<const ObjectWrite> writes,
             std::span<const AssumedPdo> pdos = {});

  std::uint8_t node() const { return node_; }
  std::optional<TaskStep> wanted();
  void take(AbortCode abort, std::span<const std::byte> data);

  // none: every object was read. timeout: the node stopped answering, and the remaining objects
  // were not read.
  AbortCode end() const { return end_; }
  void give_up(AbortCode why) { end_ = why; }
  std::vector<Difference> pop_differences() { return std::move(differences_); }
  // Number of objects read, and number of all objects.
  std::size_t done() const { return next_; }
  std::size_t total() const { return expected_.size(); }

 private:
  std::uint8_t node_;
  struct Expected {
    ObjectWrite object;
    // Of a PDO parameter that the configuration does not write
    std::optional<AssumedPdo> pdo{};
  };
  std::vector<Expected> expected_;  // ascending, each object once
  std::size_t next_ = 0;
  AbortCode end_ = AbortCode::none;
  std::vector<Difference> differences_;
};

}  // namespace linegate::manager
