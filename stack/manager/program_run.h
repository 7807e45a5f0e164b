// SPDX-License-Identifier: Apache-2.0
// The download of a program to one node (CiA 302-2, steps 7 and 8 of the boot slave process), step
// by step: what is wanted of the node next, and what came of it. No transfers in here, see
// NodeTasks.
//
//   1F56h is the expected software?        nothing is to be done
//   1F51h = 0 stop                         unless it reads 0 already; then until it reads 0
//   1F51h = 3 clear
//   the program -> 1F50h                   in blocks, or in segments if the device knows no blocks
//   1F57h until it is not busy             its error code ends it
//   1F56h is the expected software?
//   1F51h = 1 start                        then until it reads 1
//
// A device may restart when its program is stopped or started: it is given time to answer again.
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
  std::uint8_t number = 1;     // of the program: sub-index of 1F50h, 1F51h, 1F56h, 1F57h
  bool check = false;          // first whether the node has it; else it is loaded in any case
  std::uint32_t expected = 0;  // software identification (1F55h); 0 = none is known
  bool update = true;          // false: another software is told and stays
  SharedBytes program;         // nullptr or empty: there is none to be loaded
};

class ProgramRun {
 public:
  // Every step has its own ways of being repeated.
  static constexpr sdo::Priority kPriority = sdo::Priority::boot;
  static constexpr unsigned kRepeats = 0;

  enum class Result : std::uint8_t {
    loaded,        // and started
    unchanged,     // the node has the expected software
    unverifiable,  // none is expected, or 1F56h cannot be read (boot status G)
    forbidden,     // another software, and it may not be updated, or there is none to load (H)
    failed,        // (I)
  };

  explicit ProgramRun(ProgramOrder order);

  std::uint8_t node() const { return order_.node; }
  std::optional<TaskStep> wanted();
  void take(AbortCode abort, std::span<const std::byte> data);

  // Once wanted() gives nothing.
  Result result() const { return result_; }
  // What went wrong.
  const BootFinding& finding() const { return finding_; }

  // Bytes of the program that were sent, and all of them.
  std::size_t done() const { return source_ != nullptr ? source_->position() : 0; }
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
  void to(Step step);
  void finish(Result result);
  void fail(Result result, AbortCode abort);
  void differs(Result result, std::uint32_t expected, std::uint32_t found);

  ProgramOrder order_;
  std::unique_ptr<SharedSource> source_;
  Step step_ = Step::end;
  unsigned attempts_ = 0;  // of the present step
  od::Address object_{};   // of the step under way
  Result result_ = Result::loaded;
  BootFinding finding_;
};

}  // namespace linegate::manager
