// SPDX-License-Identifier: Apache-2.0
// The program of a simulated device and the flash memory it is in (CiA 302-2): objects 1F50h,
// 1F51h, 1F56h and 1F57h, sub-index 1. OWN: a program is
//
//   "LGFW", U32 software identification, U16 CRC of what follows (as CiA 301 has it), anything
//
// Anything else is taken, and told by 1F57h. The device stops and starts with a restart, as one
// with a boot loader does; its flash memory takes 1 MB a second.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "stack/base/time.h"
#include "stack/od/dictionary.h"
#include "stack/od/stream.h"

namespace linegate::sim {

// A program that a simulated device accepts.
std::vector<std::byte> make_program(std::uint32_t identification,
                                    std::span<const std::byte> content);

class ProgramMemory final : public od::Hook {
 public:
  // Of a device whose dictionary has these objects; otherwise nothing ever happens. The dictionary
  // must outlive it. The device runs the software that 1F56h is described with.
  explicit ProgramMemory(od::Dictionary& dictionary);
  ~ProgramMemory() override;

  // The time of what comes next.
  void set_time(Instant now) { now_ = now; }
  // When the device is to restart; kNever if not.
  Instant restart_at() const { return restart_at_; }
  // Once when that time has come.
  bool take_restart(Instant now);

  // od::Hook
  AbortCode before_read(od::Address address, const od::Variable& variable) override;
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  void written(od::Address address) override;
  Result<od::ByteSink*> open_sink(od::Address address, std::optional<std::uint32_t> size) override;

 private:
  class Sink;

  void taken(std::span<const std::byte> program);
  std::uint32_t flash_status() const;

  od::Dictionary& dictionary_;
  Instant now_{};
  bool running_ = true;
  bool cleared_ = false;
  std::uint32_t identification_ = 0;  // 0: no program
  std::uint32_t error_ = 0;           // of 1F57h, bits 1 to 7
  Instant busy_until_{};
  Instant restart_at_ = kNever;
  std::unique_ptr<Sink> sink_;
};

}  // namespace linegate::sim
