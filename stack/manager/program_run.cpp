// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/program_run.h"

#include <array>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/od/objects.h"

namespace linegate::manager {
namespace {

constexpr std::uint8_t kStop = 0;
constexpr std::uint8_t kStart = 1;
constexpr std::uint8_t kClear = 3;

// While the device writes its flash memory
constexpr Duration kFlashTimeout = std::chrono::seconds(15);
constexpr Duration kPollEvery = std::chrono::milliseconds(100);
constexpr unsigned kMostSilent = 3;       // requests to a device before its program is stopped
constexpr unsigned kMostRestarting = 50;  // requests to a device that may be restarting
constexpr unsigned kMostBusy = 1'200;     // questions for 1F57h: 2 minutes

std::uint32_t number_of(std::span<const std::byte> data) {
  return static_cast<std::uint32_t>(load_le(data.first(std::min<std::size_t>(data.size(), 4))));
}

bool is_missing(AbortCode abort) {
  return abort == AbortCode::no_object || abort == AbortCode::no_sub_index;
}

}  // namespace

std::string_view describe_flash_status(std::uint32_t status) {
  constexpr std::array<std::string_view, 8> kWords{
      "ok",
      "no valid program",
      "format of the program is unknown",
      "format or CRC error in the program",
      "not cleared before it was written",
      "write error",
      "address error",
      "secured",
  };
  const std::uint32_t code = status >> 1U & 0x7FU;
  constexpr std::uint32_t kManufacturer = 64;
  if (code < kWords.size()) {
    return kWords[code];
  }
  return code < kManufacturer ? "unspecified error" : "error of the manufacturer's own";
}

ProgramRun::ProgramRun(ProgramOrder order) : order_(std::move(order)) {
  if (!order_.check) {
    to_update();
  } else if (order_.expected != 0) {
    to(Step::identify);
  } else {
    finding_.object = {od::objects::kExpectedSoftware, order_.node};
    finish(Result::unverifiable);
  }
}

std::optional<TaskStep> ProgramRun::wanted() {
  const auto read = [&](std::uint16_t index, Duration after = {}) {
    return TaskStep{.address = {index, order_.number}, .after = after};
  };
  const auto control = [&](std::uint8_t command) {
    return TaskStep{.address = {od::objects::kProgramControl, order_.number},
                    .write = true,
                    .data = {std::byte{command}},
                    .timeout = command == kClear ? kFlashTimeout : Duration::zero()};
  };
  std::optional<TaskStep> out;
  switch (step_) {
    case Step::identify:
    case Step::verify:
      out = read(od::objects::kSoftwareIdentification);
      break;
    case Step::control:
      out = read(od::objects::kProgramControl);
      break;
    case Step::stopped:
    case Step::started:
      out = read(od::objects::kProgramControl, kPollEvery);
      break;
    case Step::stop:
      out = control(kStop);
      break;
    case Step::clear:
      out = control(kClear);
      break;
    case Step::start:
      out = control(kStart);
      break;
    case Step::download:
      source_ = std::make_unique<SharedSource>(order_.program);
      out = TaskStep{.address = {od::objects::kProgramData, order_.number},
                     .write = true,
                     .source = source_.get(),
                     .timeout = kFlashTimeout};
      break;
    case Step::flash:
      out = read(od::objects::kFlashStatus, kPollEvery);
      break;
    case Step::end:
      return std::nullopt;
  }
  object_ = out->address;
  return out;
}

void ProgramRun::take(AbortCode abort, std::span<const std::byte> data) {
  ++attempts_;
  switch (step_) {
    case Step::identify:
      identified(abort, data);
      return;
    case Step::control:
      if (abort == AbortCode::timeout) {
        silent();
        return;
      }
      to(abort == AbortCode::none && number_of(data) == kStop ? Step::clear : Step::stop);
      return;
    case Step::stop:
      // A device that restarts immediately may not answer.
      if (abort == AbortCode::none || abort == AbortCode::timeout) {
        to(Step::stopped);
      } else {
        fail(Result::failed, abort);
      }
      return;
    case Step::stopped:
      polled(true, abort, data);
      return;
    case Step::clear:
      abort == AbortCode::none ? to(Step::download) : fail(Result::failed, abort);
      return;
    case Step::download:
      downloaded(abort);
      return;
    case Step::flash:
      flashed(abort, data);
      return;
    case Step::verify:
      verified(abort, data);
      return;
    case Step::start:
      if (abort == AbortCode::none || abort == AbortCode::timeout) {
        to(Step::started);
      } else {
        fail(Result::failed, abort);
      }
      return;
    case Step::started:
      polled(false, abort, data);
      return;
    case Step::end:
      break;
  }
  LINEGATE_ASSERT(false, "an ended run has no transfer");
}

// The program is not stopped yet, so a device that does not answer is absent.
void ProgramRun::silent() {
  if (attempts_ >= kMostSilent) {
    fail(Result::failed, AbortCode::timeout);
  }
}

void ProgramRun::identified(AbortCode abort, std::span<const std::byte> data) {
  if (abort != AbortCode::none) {
    fail(Result::unverifiable, abort);
  } else if (number_of(data) == order_.expected) {
    finish(Result::unchanged);
  } else if (!order_.update || total() == 0) {
    differs(Result::forbidden, order_.expected, number_of(data));
  } else {
    to_update();
  }
}

void ProgramRun::to_update() {
  if (total() == 0) {
    object_ = {od::objects::kProgramData, order_.number};
    fail(Result::failed, AbortCode::no_data);
  } else {
    to(Step::control);
  }
}

void ProgramRun::boot_up() {
  restarted_ = restarted_ || (step_ == Step::download && done() > 0);
}

void ProgramRun::downloaded(AbortCode abort) {
  if (abort == AbortCode::none) {
    to(Step::flash);
  } else if (restarted_) {
    finding_ = {.kind = BootFinding::Kind::last, .object = object_};
    finish(Result::failed);
  } else {
    fail(Result::failed, abort);
  }
}

// Processes 1F51h after a stop or a start.
void ProgramRun::polled(bool stopped, AbortCode abort, std::span<const std::byte> data) {
  const Step next = stopped ? Step::clear : Step::end;
  if (abort == AbortCode::none && number_of(data) == (stopped ? kStop : kStart)) {
    to(next);
  } else if (abort == AbortCode::write_only || (!stopped && is_missing(abort))) {
    to(next);  // 1F51h cannot be read, or the running program has no program control
  } else if (abort != AbortCode::none && abort != AbortCode::timeout) {
    fail(Result::failed, abort);
  } else if (attempts_ >= kMostRestarting) {
    abort == AbortCode::none ? differs(Result::failed, stopped ? kStop : kStart, number_of(data))
                             : fail(Result::failed, abort);
  }
}

void ProgramRun::flashed(AbortCode abort, std::span<const std::byte> data) {
  const std::uint32_t status = number_of(data);
  constexpr std::uint32_t kBusy = 1;
  constexpr std::uint32_t kErrorBits = 0xFE;
  if (is_missing(abort)) {
    to(order_.expected != 0 ? Step::verify : Step::start);
  } else if (abort != AbortCode::none && abort != AbortCode::timeout) {
    fail(Result::failed, abort);
  } else if (abort == AbortCode::none && (status & kBusy) == 0) {
    if ((status & kErrorBits) != 0) {
      differs(Result::failed, 0, status);
    } else {
      to(order_.expected != 0 ? Step::verify : Step::start);
    }
  } else if (attempts_ >= kMostBusy) {
    abort == AbortCode::none ? differs(Result::failed, 0, status) : fail(Result::failed, abort);
  }
}

void ProgramRun::verified(AbortCode abort, std::span<const std::byte> data) {
  if (abort != AbortCode::none) {
    fail(Result::failed, abort);
  } else if (number_of(data) != order_.expected) {
    differs(Result::failed, order_.expected, number_of(data));
  } else {
    to(Step::start);
  }
}

void ProgramRun::to(Step step) {
  step_ = step;
  attempts_ = 0;
}

void ProgramRun::finish(Result result) {
  result_ = result;
  step_ = Step::end;
}

void ProgramRun::fail(Result result, AbortCode abort) {
  finding_ = {.kind = BootFinding::Kind::abort, .object = object_, .abort = abort};
  finish(result);
}

void ProgramRun::differs(Result result, std::uint32_t expected, std::uint32_t found) {
  finding_ = {
      .kind = BootFinding::Kind::value, .object = object_, .expected = expected, .found = found};
  finish(result);
}

}  // namespace linegate::manager
