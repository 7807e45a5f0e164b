// SPDX-License-Identifier: Apache-2.0
// The configuration of one node (CiA 302-3), step by step: returns the next transfer, and takes its
// result. It makes no transfers itself, see NodeTasks.
//
// Of a node that is kept alive (read_only) the PDOs of the image are read. Otherwise:
//
//   1020h:1 and :2 are the expected date and time?   then there is nothing to do
//   load -> 1011h                                    then the node is reset, and the run starts
//   again
//   all writes of the concise DCF, in their order; before the last ones, to the error control,
//   1020h and 1010h, the PDOs of the image are read, and one that differs is written (pdo_check.h)
//   1020h:1 and :2 get the expected date and time, unless the concise DCF wrote them
//   save -> 1010h
//
// Nothing is stored without a date in 1020h: the device would be configured at every boot, which
// would wear out its memory.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/manager/node_report.h"
#include "stack/manager/node_tasks.h"
#include "stack/manager/pdo_check.h"
#include "stack/manager/plan.h"

namespace linegate::manager {

// Time that devices may need for their flash memory.
inline constexpr Duration kSaveTimeout = std::chrono::seconds(15);
inline constexpr Duration kLoadTimeout = std::chrono::seconds(3);

// The expected configuration of a node.
struct ConfigurationOrder {
  std::uint8_t node = 0;
  std::vector<ObjectWrite> writes;  // 1F22h
  ConfigurationDate expected;       // 1F26h, 1F27h
  std::uint8_t restore = 0;         // sub-index of 1011h; 0 = restore nothing
  std::uint8_t store = 0;           // sub-index of 1010h; 0 = store nothing
  std::vector<AssumedPdo> pdos{};   // of the image
  bool read_only = false;           // only the PDOs are read, and nothing is written
  bool check = true;                // false: configure without comparing 1020h
};

class ConfigurationRun {
 public:
  static constexpr sdo::Priority kPriority = sdo::Priority::boot;
  static constexpr unsigned kRepeats = 0;

  enum class Result : std::uint8_t {
    applied,
    unchanged,  // the node already has this configuration
    restored,   // reset the node, and start again without `restore`
    unlike,     // ConfigurationOrder::read_only: a PDO differs
    failed,
  };

  explicit ConfigurationRun(ConfigurationOrder order);

  std::uint8_t node() const { return order_.node; }
  bool read_only() const { return order_.read_only; }
  // Result::failed: see PdoCheck::may_succeed_later().
  bool may_succeed_later() const { return pdos_.may_succeed_later(); }
  std::optional<TaskStep> wanted();
  void take(AbortCode abort, std::span<const std::byte> data);

  // Valid once wanted() returns nothing.
  Result result() const { return result_; }
  // Result::failed: the abort code and the object; none: the PDO parameter `object` of the node
  // differs from that of the image. Result::applied: none, or why 1020h of the node could not be
  // written.
  AbortCode abort() const { return abort_; }
  od::Address object() const { return object_; }
  // The same, with the value of the failed write, or what was found instead.
  Difference fault() const;
  // The fault as the cause of boot status J. A found value that is not a number of at most 32 bits
  // is one of the wrong length: length_too_low if it is empty, otherwise length_too_high.
  BootFinding finding() const;

  // Number of completed writes, and number of all writes.
  std::size_t done() const { return write_; }
  std::size_t total() const { return order_.writes.size(); }

 private:
  enum class Step : std::uint8_t {
    date,
    time,
    restore,
    write,
    pdos,
    sign_date,
    sign_time,
    store,
    end
  };

  TaskStep next_write() const;
  void after_check();
  void write_next();
  void written();
  void after_writes();
  void after_pdos();
  void dated();
  void fail(AbortCode abort);

  ConfigurationOrder order_;
  Step step_ = Step::end;
  std::size_t write_ = 0;
  std::size_t pdos_at_ = 0;  // the write before which the PDOs are read
  bool pdos_begun_ = false;
  PdoCheck pdos_;
  od::Address object_{};  // of the present step
  std::vector<std::byte> value_;
  Result result_ = Result::applied;
  AbortCode abort_ = AbortCode::none;
};

}  // namespace linegate::manager
