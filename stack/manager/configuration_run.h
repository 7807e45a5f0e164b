// SPDX-License-Identifier: Apache-2.0
// The configuration of one node (CiA 302-3), step by step: what is wanted of it next, and what came
// of it. No transfers in here, see NodeTasks.
//
//   1020h:1 and :2 are the expected date and time?   nothing is to be done
//   load -> 1011h                                    then the node is to be reset, and begins anew
//   all writes of the concise DCF, in their order
//   1020h:1 and :2 get the expected date and time, if no write of the concise DCF was for them
//   save -> 1010h
//
// Nothing is stored without a date in 1020h: the device would be configured at every boot, and its
// memory would wear out.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/manager/configuration_report.h"
#include "stack/manager/node_tasks.h"
#include "stack/manager/plan.h"

namespace linegate::manager {

// Devices may need so long for their flash memory.
inline constexpr Duration kSaveTimeout = std::chrono::seconds(15);
inline constexpr Duration kLoadTimeout = std::chrono::seconds(3);

// What is wanted of a node.
struct ConfigurationOrder {
  std::uint8_t node = 0;
  std::vector<ObjectWrite> writes;  // 1F22h
  ConfigurationDate expected;       // 1F26h, 1F27h
  std::uint8_t restore = 0;         // sub-index of 1011h, 0 = nothing is restored
  std::uint8_t store = 0;           // sub-index of 1010h, 0 = nothing is stored
  bool check = true;                // false: not compared with 1020h
};

class ConfigurationRun {
 public:
  static constexpr sdo::Priority kPriority = sdo::Priority::boot;
  static constexpr unsigned kRepeats = 0;

  enum class Result : std::uint8_t {
    applied,
    unchanged,  // the node has it already
    restored,   // reset the node, and begin anew without `restore`
    failed,
  };

  explicit ConfigurationRun(ConfigurationOrder order);

  std::uint8_t node() const { return order_.node; }
  std::optional<TaskStep> wanted();
  void take(AbortCode abort, std::span<const std::byte> data);

  // Once wanted() gives nothing.
  Result result() const { return result_; }
  // Result::failed: why, and with which object. Result::applied: none, or why the node could not be
  // given its date in 1020h.
  AbortCode abort() const { return abort_; }
  od::Address object() const { return object_; }
  // The same with the value that was to be written.
  Difference fault() const;

  // How many of how many writes were done.
  std::size_t done() const { return write_; }
  std::size_t total() const { return order_.writes.size(); }

 private:
  enum class Step : std::uint8_t { date, time, restore, write, sign_date, sign_time, store, end };

  TaskStep next_write() const;
  void after_check();
  void written();
  void after_writes();
  void dated();
  void fail(AbortCode abort);

  ConfigurationOrder order_;
  Step step_ = Step::end;
  std::size_t write_ = 0;
  od::Address object_{};  // of the step under way
  std::vector<std::byte> value_;
  Result result_ = Result::applied;
  AbortCode abort_ = AbortCode::none;
};

}  // namespace linegate::manager
