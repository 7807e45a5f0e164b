// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/pdo_check.h"

#include <algorithm>
#include <ranges>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/manager/boot_event.h"
#include "stack/od/objects.h"
#include "stack/pdo/parameters.h"

namespace linegate::manager {
namespace {

constexpr std::uint32_t kMeansOfCobId = can::CobId::kInvalidBit | can::CobId::kExtendedBit;

// What a value means for the PDO.
std::uint64_t meaning_of(od::Address address, std::span<const std::byte> value) {
  const std::uint64_t number = load_le(value);
  if (!od::objects::is_pdo_communication(address.index)) {
    return number;
  }
  if (address.sub == 1) {
    const can::CobId cob_id{static_cast<std::uint32_t>(number)};
    return cob_id.valid() ? (number & kMeansOfCobId) | cob_id.id() : can::CobId::kInvalidBit;
  }
  const bool is_event =
      address.sub == 2 && number <= 0xFF && pdo::is_event_driven(static_cast<std::uint8_t>(number));
  return is_event ? pdo::kEventProfile : number;
}

}  // namespace

bool is_same_parameter(od::Address address, std::span<const std::byte> expected,
                       std::span<const std::byte> found) {
  constexpr std::size_t kLongest = sizeof(std::uint64_t);
  return !found.empty() && found.size() <= kLongest && expected.size() <= kLongest &&
         meaning_of(address, expected) == meaning_of(address, found);
}

bool changes_pdo(std::span<const AssumedPdo> pdos, od::Address address,
                 std::span<const std::byte> value) {
  return std::ranges::any_of(pdos, [&](const AssumedPdo& pdo) {
    const auto parameter = std::ranges::find(pdo.parameters, address, &ObjectWrite::address);
    return parameter != pdo.parameters.end() && !is_same_parameter(address, parameter->data, value);
  });
}

PdoCheck::PdoCheck(std::vector<AssumedPdo> pdos, std::span<const ObjectWrite> written)
    : pdos_(std::move(pdos)), written_(written.begin(), written.end()) {
  skip_written();
}

const ObjectWrite* PdoCheck::written(od::Address address) const {
  const auto last =
      std::ranges::find(written_ | std::views::reverse, address, &ObjectWrite::address);
  return last == written_.rend() ? nullptr : &*last;
}

// What was written is known: it is as expected, or the configuration of the node contradicts the
// image.
void PdoCheck::skip_written() {
  for (; pdo_ < pdos_.size() && !fault_; ++pdo_, next_ = 0) {
    const std::vector<ObjectWrite>& parameters = pdos_[pdo_].parameters;
    for (; next_ < parameters.size(); ++next_) {
      const ObjectWrite& expected = parameters[next_];
      const ObjectWrite* const was = written(expected.address);
      if (was == nullptr) {
        return;
      }
      if (!is_same_parameter(expected.address, expected.data, was->data)) {
        fault_ = {.object = expected.address, .expected = expected.data, .found = was->data};
        return;
      }
    }
  }
}

TaskStep PdoCheck::step() const {
  LINEGATE_ASSERT(!done(), "a transfer is left");
  const AssumedPdo& pdo = pdos_[pdo_];
  if (corrects_) {
    const ObjectWrite& write = pdo.remedy[next_];
    return {.address = write.address, .write = true, .data = write.data};
  }
  return {.address = pdo.parameters[next_].address};
}

void PdoCheck::take(AbortCode abort, std::span<const std::byte> data) {
  LINEGATE_ASSERT(!done(), "a transfer has ended");
  const AssumedPdo& pdo = pdos_[pdo_];
  if (corrects_) {
    const ObjectWrite& write = pdo.remedy[next_];
    if (abort != AbortCode::none) {
      fault_ = {.object = write.address, .expected = write.data, .abort = abort};
    } else if (++next_ == pdo.remedy.size()) {
      corrects_ = false;
      next_ = 0;
      ++pdo_;
      skip_written();
    }
    return;
  }
  const ObjectWrite& expected = pdo.parameters[next_];
  if (is_communication_error(abort)) {
    fault_ = {.object = expected.address, .expected = expected.data, .abort = abort};
  } else if (abort != AbortCode::none || is_same_parameter(expected.address, expected.data, data)) {
    ++next_;
    skip_written();
  } else {
    differs(expected, data);
  }
}

void PdoCheck::differs(const ObjectWrite& expected, std::span<const std::byte> found) {
  const std::vector<ObjectWrite>& remedy = pdos_[pdo_].remedy;
  if (std::ranges::find(remedy, expected.address, &ObjectWrite::address) == remedy.end()) {
    fault_ = {.object = expected.address,
              .expected = expected.data,
              .found = {found.begin(), found.end()}};
    return;
  }
  corrects_ = true;
  next_ = 0;
}

}  // namespace linegate::manager
