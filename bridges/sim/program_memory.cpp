// SPDX-License-Identifier: Apache-2.0
#include "bridges/sim/program_memory.h"

#include <algorithm>
#include <array>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/od/objects.h"
#include "stack/sdo/block.h"

namespace linegate::sim {
namespace {

constexpr std::array kHooked{od::objects::kProgramData, od::objects::kProgramControl,
                             od::objects::kSoftwareIdentification, od::objects::kFlashStatus};

enum Control : std::uint8_t { kStop, kStart, kReset, kClear };

// Codes of 1F57h.
constexpr std::uint32_t kOk = 0;
constexpr std::uint32_t kNoProgram = 1;
constexpr std::uint32_t kUnknownFormat = 2;
constexpr std::uint32_t kWrongCrc = 3;
constexpr std::uint32_t kNotCleared = 4;

constexpr std::array kMagic{std::byte{'L'}, std::byte{'G'}, std::byte{'F'}, std::byte{'W'}};
constexpr std::size_t kHead = 10;

constexpr Duration kPerByte = std::chrono::microseconds(1);
constexpr Duration kRestartDelay = std::chrono::milliseconds(50);

}  // namespace

std::vector<std::byte> make_program(std::uint32_t identification,
                                    std::span<const std::byte> content) {
  std::vector<std::byte> out(kHead);
  std::ranges::copy(kMagic, out.begin());
  store_le(std::span(out).subspan(4, 4), identification);
  store_le(std::span(out).subspan(8, 2), sdo::crc_of(content));
  out.insert(out.end(), content.begin(), content.end());
  return out;
}

class ProgramMemory::Sink final : public od::ByteSink {
 public:
  explicit Sink(ProgramMemory& owner) : owner_(owner) {}

  AbortCode write(std::span<const std::byte> piece) override {
    bytes_.insert(bytes_.end(), piece.begin(), piece.end());
    return AbortCode::none;
  }
  AbortCode finish() override {
    owner_.taken(bytes_);
    return AbortCode::none;
  }
  bool rewind() override {
    bytes_.clear();
    return true;
  }

 private:
  ProgramMemory& owner_;
  std::vector<std::byte> bytes_;
};

ProgramMemory::ProgramMemory(od::Dictionary& dictionary) : dictionary_(dictionary) {
  identification_ = static_cast<std::uint32_t>(
      dictionary_.number({od::objects::kSoftwareIdentification, 1}).value_or(0));
  for (const std::uint16_t index : kHooked) {
    (void)dictionary_.set_hook(index, this).ok();  // most devices have no program
  }
}

ProgramMemory::~ProgramMemory() {
  for (const std::uint16_t index : kHooked) {
    if (dictionary_.has_object(index)) {
      LINEGATE_ASSERT(dictionary_.set_hook(index, nullptr).ok(), "the object exists");
    }
  }
}

bool ProgramMemory::pop_restart(Instant now) {
  if (restart_at_ > now) {
    return false;
  }
  restart_at_ = kNever;
  return true;
}

AbortCode ProgramMemory::before_read(od::Address address, const od::Variable& variable) {
  if (address.sub != 1 || address.index == od::objects::kProgramData) {
    return AbortCode::none;
  }
  const std::uint32_t value =
      address.index == od::objects::kProgramControl           ? std::uint32_t{running_}
      : address.index == od::objects::kSoftwareIdentification ? identification_
                                                              : flash_status();
  store_le(std::span(variable.data, variable.size), value);
  return AbortCode::none;
}

AbortCode ProgramMemory::check_write(od::Address address, std::span<const std::byte> value) {
  if (address.index != od::objects::kProgramControl) {
    return AbortCode::none;
  }
  const std::uint64_t command = load_le(value);
  if (command > kClear) {
    return AbortCode::invalid_value;
  }
  const bool possible = (command != kClear || !running_) &&
                        (command != kStart || identification_ != 0) && now_ >= busy_until_;
  return possible ? AbortCode::none : AbortCode::device_state;
}

void ProgramMemory::written(od::Address address) {
  if (address.index != od::objects::kProgramControl) {
    return;
  }
  const auto command = std::to_integer<std::uint8_t>(*dictionary_.find(address)->data);
  if (command == kClear) {
    identification_ = 0;
    error_ = kNoProgram;
    cleared_ = true;
    return;
  }
  running_ = command != kStop;
  restart_at_ = now_ + kRestartDelay;
}

Result<od::ByteSink*> ProgramMemory::open_sink(od::Address address,
                                               std::optional<std::uint32_t> /*size*/) {
  if (address.index != od::objects::kProgramData) {
    return nullptr;
  }
  if (running_) {
    return to_error(AbortCode::device_state);
  }
  sink_ = std::make_unique<Sink>(*this);
  return sink_.get();
}

void ProgramMemory::taken(std::span<const std::byte> program) {
  busy_until_ = now_ + kPerByte * static_cast<Duration::rep>(program.size());
  identification_ = 0;
  if (!std::exchange(cleared_, false)) {
    error_ = kNotCleared;
  } else if (program.size() < kHead || !std::ranges::equal(program.first(4), kMagic)) {
    error_ = kUnknownFormat;
  } else if (load_le(program.subspan(8, 2)) != sdo::crc_of(program.subspan(kHead))) {
    error_ = kWrongCrc;
  } else {
    error_ = kOk;
    identification_ = static_cast<std::uint32_t>(load_le(program.subspan(4, 4)));
  }
}

std::uint32_t ProgramMemory::flash_status() const {
  constexpr std::uint32_t kBusy = 1;
  return now_ < busy_until_ ? kBusy : error_ << 1U;
}

}  // namespace linegate::sim
