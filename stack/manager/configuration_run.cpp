// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/configuration_run.h"

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

bool is_number(std::span<const std::byte> data, std::uint32_t expected) {
  return data.size() == sizeof expected && load_le(data) == expected;
}

}  // namespace

ConfigurationRun::ConfigurationRun(ConfigurationOrder order) : order_(std::move(order)) {
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
  return {.object = object_, .expected = value_, .abort = abort_};
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
    step_ = Step::write;
    if (order_.writes.empty()) {
      after_writes();
    }
  }
}

// A restore, a write or a store succeeded.
void ConfigurationRun::written() {
  if (step_ != Step::write) {
    result_ = step_ == Step::restore ? Result::restored : Result::applied;
    step_ = Step::end;
  } else if (++write_ == order_.writes.size()) {
    after_writes();
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
