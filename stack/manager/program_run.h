// SPDX-License-Identifier: Apache-2.0
// The download of a program to one node (CiA 302-2, steps 7 and 8 of the boot slave process), step
// by step: returns the next transfer, and takes its result. It makes no transfers itself, see
// NodeTasks.
//
//   1F56h is the expected software?        then there is nothing to do
//   1F51h = 0 stop                         unless it already reads 0; then poll until it reads 0
//   1F51h = 3 clear
//   the program -> 1F50h                   in blocks, or in segments if the device has no blocks
//   1F57h until it is not busy             its error code ends the run
//   1F56h is the expected software?
//   1F51h = 1 start                        then poll until it reads 1
//
// A device may restart when its program is stopped or started; the run waits until it answers
// again.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "stack/base/abort_code.h"
#include "stack/manager/node_tasks.h"
#include "stack/manager/plan.h"
#include "stack/manager/shared_source.h"
#include "stack/manager/state.h"

namespace linegate::manager {

// The error code in bits 1 to 7 of 1F57h in words.
std::string_view describe_flash_status(std::uint32_t status);

struct ProgramOrder {
  std::uint8_t node = 0;
  std::uint8_t number = 1;  // number of the program: sub-index of 1F50h, 1F51h, 1F56h, 1F57h
  bool check = false;  // true: load only if the node has another software; false: load in any case
  std::uint32_t expected = 0;  // software identification (1F55h); 0 = not known
  bool update = true;          // false: another software is reported and kept
  SharedBytes program;         // nullptr or empty: there is no program to load
};

class ProgramRun {
 public:
  // Every step handles its own repetitions.
  static constexpr sdo::Priority kPriority = sdo::Priority::boot;
  static constexpr unsigned kRepeats = 0;

  enum class Result : std::uint8_t {
    loaded,        // and started
    unchanged,     // the node has the expected software
    unverifiable,  // none is expected, or 1F56h cannot be read (boot status G)
    // Another software, and an update is not permitted, or there is no program to load (H)
    forbidden,
    failed,  // the download failed (I)
  };

  explicit ProgramRun(ProgramOrder order);

  std::uint8_t node() const { return order_.node; }
  std::optional<TaskStep> wanted();
  void take(AbortCode abort, std::span<const std::byte> data);
  // The node sent its boot-up message. If it had acknowledged bytes of the program, its SDO server
  // has lost the transfer: a failure of the transfer is reported as a restart of the node.
  void boot_up();

  // Valid once wanted() returns nothing.
  Result result() const { return result_; }
  // The cause of a failure. Kind::last: the node restarted while 1F50h was written.
  const BootFinding& finding() const { return finding_; }

  // Number of program bytes that the node acknowledged, and number of all bytes.
  std::size_t done() const { return source_ != nullptr ? source_->acknowledged() : 0; }
  std::size_t total() const { return order_.program != nullptr ? order_.program->size() : 0; }

 private:
  enum class Step : std::uint8_t {
    identify,
    control,
    stop,
    stopped,
    clear,
    download,
    flash,
    verify,
    start,
    started,
    end,
  };

  void silent();
  void identified(AbortCode abort, std::span<const std::byte> data);
  void to_update();
  void polled(bool stopped, AbortCode abort, std::span<const std::byte> data);
  void flashed(AbortCode abort, std::span<const std::byte> data);
  void verified(AbortCode abort, std::span<const std::byte> data);
  void downloaded(AbortCode abort);
  void to(Step step);
  void finish(Result result);
  void fail(Result result, AbortCode abort);
  void differs(Result result, std::uint32_t expected, std::uint32_t found);

  ProgramOrder order_;
  std::unique_ptr<SharedSource> source_;
  Step step_ = Step::end;
  unsigned attempts_ = 0;   // of the present step
  bool restarted_ = false;  // during the download
  od::Address object_{};    // of the present step
  Result result_ = Result::loaded;
  BootFinding finding_;
};

}  // namespace linegate::manager
