// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/configuration_run.h"

#include <limits>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/od/objects.h"

namespace linegate::manager {
namespace {

constexpr std::uint32_t kSave = 0x6576'6173;  // "save"
constexpr std::uint32_t kLoad = 0x6461'6F6C;  // "load"

TaskStep download(od::Address address, std::uint32_t value, Duration timeout = {}) {
  TaskStep step{.address = address, .write = true, .timeout = timeout};
  step.data.resize(sizeof value);
  store_le(std::span(step.data), value);
  return step;
}

// What is written behind the check of the PDOs: it stores what that writes, and begins the error
// control, of which the boot process awaits the first message.
bool comes_last(od::Address address) {
  switch (address.index) {
    case od::objects::kGuardTime:
    case od::objects::kLifeTimeFactor:
    case od::objects::kProducerHeartbeatTime:
    case od::objects::kVerifyConfiguration:
    case od::objects::kStoreParameters:
      return true;
    default:
      return false;
  }
}

// nullopt: the value is empty, or has more than 32 bits.
std::optional<std::uint32_t> boot_value(std::span<const std::byte> data) {
  if (data.empty() || data.size() > sizeof(std::uint64_t) ||
      load_le(data) > std::numeric_limits<std::uint32_t>::max()) {
    return std::nullopt;
  }
  return static_cast<std::uint32_t>(load_le(data));
}

bool is_number(std::span<const std::byte> data, std::uint32_t expected) {
  return data.size() == sizeof expected && load_le(data) == expected;
}

}  // namespace

ConfigurationRun::ConfigurationRun(ConfigurationOrder order) : order_(std::move(order)) {
  if (order_.read_only) {
    order_ = {.node = order_.node, .pdos = std::move(order_.pdos), .read_only = true};
    for (AssumedPdo& pdo : order_.pdos) {
      pdo.remedy.clear();
      std::erase_if(pdo.parameters, [](const ObjectWrite& parameter) {
        return od::objects::is_pdo_communication(parameter.address.index) &&
               parameter.address.sub == 2;
      });
    }
  }
  const std::vector<ObjectWrite>& writes = order_.writes;
  for (pdos_at_ = writes.size(); pdos_at_ > 0 && comes_last(writes[pdos_at_ - 1].address);) {
    --pdos_at_;
  }
  if (order_.check && order_.expected.known()) {
    step_ = Step::date;
  } else {
    after_check();
  }
}

std::optional<TaskStep> ConfigurationRun::wanted() {
  std::optional<TaskStep> out;
  switch (step_) {
    case Step::date:
      out = TaskStep{.address = {od::objects::kVerifyConfiguration, 1}};
      break;
    case Step::time:
      out = TaskStep{.address = {od::objects::kVerifyConfiguration, 2}};
      break;
    case Step::restore:
      out = download({od::objects::kRestoreDefaults, order_.restore}, kLoad, kLoadTimeout);
      break;
    case Step::write:
      out = next_write();
      break;
    case Step::pdos:
      out = pdos_.step();
      break;
    case Step::sign_date:
      out = download({od::objects::kVerifyConfiguration, 1}, order_.expected.date);
      break;
    case Step::sign_time:
      out = download({od::objects::kVerifyConfiguration, 2}, order_.expected.time);
      break;
    case Step::store:
      out = download({od::objects::kStoreParameters, order_.store}, kSave, kSaveTimeout);
      break;
    case Step::end:
      return std::nullopt;
  }
  object_ = out->address;
  value_ = out->data;
  return out;
}

void ConfigurationRun::take(AbortCode abort, std::span<const std::byte> data) {
  const bool good = abort == AbortCode::none;
  switch (step_) {
    case Step::date:
      if (good && is_number(data, order_.expected.date)) {
        step_ = Step::time;
      } else {
        after_check();
      }
      return;
    case Step::time:
      if (good && is_number(data, order_.expected.time)) {
        result_ = Result::unchanged;
        step_ = Step::end;
      } else {
        after_check();
      }
      return;
    case Step::restore:
    case Step::write:
    case Step::store:
      good ? written() : fail(abort);
      return;
    case Step::pdos:
      pdos_.take(abort, data);
      if (pdos_.done()) {
        after_pdos();
      }
      return;
    case Step::sign_date:
    case Step::sign_time:
      abort_ = abort;
      good ? dated() : void(step_ = Step::end);
      return;
    case Step::end:
      break;
  }
  LINEGATE_ASSERT(false, "an ended run has no transfer");
}

Difference ConfigurationRun::fault() const {
  if (pdos_.fault()) {
    return *pdos_.fault();
  }
  return {.object = object_, .expected = value_, .abort = abort_};
}

BootFinding ConfigurationRun::finding() const {
  const Difference why = fault();
  const auto found = boot_value(why.found);
  AbortCode abort = why.abort;
  if (abort == AbortCode::none && !found) {
    abort = why.found.empty() ? AbortCode::length_too_low : AbortCode::length_too_high;
  }
  if (abort != AbortCode::none) {
    return {.kind = BootFinding::Kind::abort, .object = why.object, .abort = abort};
  }
  return {.kind = BootFinding::Kind::value,
          .object = why.object,
          .expected = boot_value(why.expected).value_or(0),
          .found = *found};
}

TaskStep ConfigurationRun::next_write() const {
  LINEGATE_ASSERT(write_ < order_.writes.size(), "a write is left");
  const ObjectWrite& write = order_.writes[write_];
  TaskStep step{.address = write.address, .write = true, .data = write.data};
  if (write.address.index == od::objects::kStoreParameters) {
    step.timeout = kSaveTimeout;
  } else if (write.address.index == od::objects::kRestoreDefaults) {
    step.timeout = kLoadTimeout;
  }
  return step;
}

void ConfigurationRun::after_check() {
  if (order_.restore != 0) {
    step_ = Step::restore;
  } else {
    write_next();
  }
}

void ConfigurationRun::write_next() {
  if (write_ == pdos_at_ && !std::exchange(pdos_begun_, true)) {
    pdos_ = PdoCheck(order_.pdos, order_.writes);
    step_ = Step::pdos;
    if (pdos_.done()) {
      after_pdos();
    }
  } else if (write_ == order_.writes.size()) {
    after_writes();
  } else {
    step_ = Step::write;
  }
}

// A restore, a write or a store succeeded.
void ConfigurationRun::written() {
  if (step_ != Step::write) {
    result_ = step_ == Step::restore ? Result::restored : Result::applied;
    step_ = Step::end;
  } else {
    ++write_;
    write_next();
  }
}

void ConfigurationRun::after_pdos() {
  if (pdos_.fault()) {
    object_ = pdos_.fault()->object;
    fail(pdos_.fault()->abort);
    if (order_.read_only && abort_ == AbortCode::none) {
      result_ = Result::unlike;
    }
  } else {
    write_next();
  }
}

void ConfigurationRun::after_writes() {
  const bool said = date_of(order_.writes).known();
  step_ = !order_.expected.known() ? Step::end : said ? Step::sign_time : Step::sign_date;
  if (step_ == Step::sign_time) {
    dated();
  }
}

// The write to 1020h:1 or :2 succeeded.
void ConfigurationRun::dated() {
  if (step_ == Step::sign_date) {
    step_ = Step::sign_time;
  } else {
    step_ = order_.store != 0 ? Step::store : Step::end;
  }
}

void ConfigurationRun::fail(AbortCode abort) {
  result_ = Result::failed;
  abort_ = abort;
  step_ = Step::end;
}

}  // namespace linegate::manager
