// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/pdo_check.h"

#include <algorithm>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/od/objects.h"
#include "stack/pdo/parameters.h"

namespace linegate::manager {
namespace {

constexpr unsigned kCorrections = 2;  // of one PDO
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
  const bool is_cob_id = od::objects::is_pdo_communication(address.index) && address.sub == 1;
  if (is_cob_id && found.size() != expected.size()) {
    return false;
  }
  return !found.empty() && found.size() <= kLongest && expected.size() <= kLongest &&
         meaning_of(address, expected) == meaning_of(address, found);
}

bool is_as_assumed(const AssumedPdo& pdo, const ObjectWrite& parameter,
                   std::span<const std::byte> found) {
  if (pdo.taken == nullptr) {
    return is_same_parameter(parameter.address, parameter.data, found);
  }
  return found.size() > sizeof(std::uint64_t) ||
         std::ranges::find(*pdo.taken, meaning_of(parameter.address, found)) == pdo.taken->end();
}

bool changes_pdo(std::span<const AssumedPdo> pdos, od::Address address,
                 std::span<const std::byte> value) {
  return std::ranges::any_of(pdos, [&](const AssumedPdo& pdo) {
    const auto parameter = std::ranges::find(pdo.parameters, address, &ObjectWrite::address);
    return parameter != pdo.parameters.end() &&
           (value.empty() || !is_as_assumed(pdo, *parameter, value));
  });
}

bool ends_transmission(std::span<const AssumedPdo> pdos, od::Address address,
                       std::span<const std::byte> value, bool has_sync) {
  const auto pdo = std::ranges::find_if(pdos, [address](const AssumedPdo& each) {
    return each.sent && address == od::Address{each.sent->record, 2};
  });
  if (pdo == pdos.end()) {
    return false;
  }
  if (value.size() != 1) {
    return value.empty();  // the node refuses another length
  }
  const auto type = std::to_integer<std::uint8_t>(value[0]);
  if (pdo::is_on_request(type)) {
    return !pdo::is_on_request(pdo->sent->type);
  }
  return pdo::is_synchronous(type) && !has_sync && !pdo::is_synchronous(pdo->sent->type);
}

bool is_unreadable(AbortCode abort) {
  return abort == AbortCode::unsupported_access || abort == AbortCode::write_only ||
         abort == AbortCode::no_object || abort == AbortCode::no_sub_index;
}

PdoCheck::PdoCheck(std::vector<AssumedPdo> pdos, std::span<const ObjectWrite> written)
    : pdos_(std::move(pdos)), written_(written.begin(), written.end()) {
  skip_written();
}

const ObjectWrite* PdoCheck::written(od::Address address) const {
  const auto last =
      std::find_if(written_.rbegin(), written_.rend(),
                   [address](const ObjectWrite& write) { return write.address == address; });
  return last == written_.rend() ? nullptr : &*last;
}

// What was written is known: it is as expected, or the configuration of the node contradicts the
// image.
void PdoCheck::skip_written() {
  for (; pdo_ < pdos_.size() && !fault_; ++pdo_, next_ = 0, corrections_ = 0, found_cob_id_ = 0) {
    const std::vector<ObjectWrite>& parameters = pdos_[pdo_].parameters;
    for (; next_ < parameters.size(); ++next_) {
      const ObjectWrite& expected = parameters[next_];
      const ObjectWrite* const was = written(expected.address);
      if (was == nullptr) {
        return;
      }
      if (!is_as_assumed(pdos_[pdo_], expected, was->data)) {
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
    return {.address = pdo.remedy[next_].address, .write = true, .data = remedy_value()};
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
      skip_written();
    }
    return;
  }
  if (abort == AbortCode::timeout && !std::exchange(repeats_, true)) {
    return;
  }
  repeats_ = false;
  const ObjectWrite& expected = pdo.parameters[next_];
  if (abort != AbortCode::none && !is_unreadable(abort)) {
    fault_ = {.object = expected.address, .expected = expected.data, .abort = abort};
  } else if (abort != AbortCode::none || is_as_assumed(pdo, expected, data)) {
    note_cob_id(expected.address, data);
    ++next_;
    skip_written();
  } else {
    note_cob_id(expected.address, data);
    differs(expected, data);
  }
}

void PdoCheck::note_cob_id(od::Address address, std::span<const std::byte> data) {
  if (od::objects::is_pdo_communication(address.index) && address.sub == 1 &&
      data.size() == sizeof found_cob_id_) {
    found_cob_id_ = load_le<std::uint32_t>(data.data());
  }
}

// A node may refuse to change bits 0 to 29 while the PDO exists, or bit 30 at all.
std::vector<std::byte> PdoCheck::remedy_value() const {
  const ObjectWrite& write = pdos_[pdo_].remedy[next_];
  const bool is_cob_id =
      od::objects::is_pdo_communication(write.address.index) && write.address.sub == 1;
  if (!is_cob_id || found_cob_id_ == 0) {
    return write.data;
  }
  std::vector<std::byte> out(sizeof found_cob_id_);
  const auto wanted = static_cast<std::uint32_t>(load_le(std::span(write.data)));
  const std::uint32_t value =
      next_ == 0 ? found_cob_id_ | can::CobId::kInvalidBit
                 : (wanted & ~can::CobId::kNoRtrBit) | (found_cob_id_ & can::CobId::kNoRtrBit);
  store_le(std::span(out), value);
  return out;
}

void PdoCheck::differs(const ObjectWrite& expected, std::span<const std::byte> found) {
  const std::vector<ObjectWrite>& remedy = pdos_[pdo_].remedy;
  if (corrections_ == kCorrections ||
      std::ranges::find(remedy, expected.address, &ObjectWrite::address) == remedy.end()) {
    fault_ = {.object = expected.address,
              .expected = expected.data,
              .found = {found.begin(), found.end()}};
    return;
  }
  corrects_ = true;
  ++corrections_;
  next_ = 0;
}

}  // namespace linegate::manager
