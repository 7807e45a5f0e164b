// SPDX-License-Identifier: Apache-2.0
// The program of a simulated device and its flash memory (CiA 302-2): objects 1F50h, 1F51h, 1F56h
// and 1F57h, sub-index 1. The program format is our own:
//
//   "LGFW", U32 software identification, U16 CRC of the rest (the CRC of CiA 301), any bytes
//
// Other data are accepted and reported as an error by 1F57h. Stopping and starting the program
// restarts the device, as with a boot loader. The flash memory is written at 1 MB/s.
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

// Makes a program that a simulated device accepts.
std::vector<std::byte> make_program(std::uint32_t identification,
                                    std::span<const std::byte> content);

class ProgramMemory final : public od::Hook {
 public:
  // dictionary must outlive this object; without the objects above there is no effect. The device
  // starts with the software identification that 1F56h has by default.
  explicit ProgramMemory(od::Dictionary& dictionary);
  ~ProgramMemory() override;

  // Sets the time of the next access.
  void set_time(Instant now) { now_ = now; }
  // When the device is due to restart; kNever if not.
  Instant restart_at() const { return restart_at_; }
  // Returns true once when the restart is due.
  bool pop_restart(Instant now);

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
