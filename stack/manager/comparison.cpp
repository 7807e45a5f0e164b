// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/comparison.h"

#include <algorithm>
#include <map>
#include <utility>

#include "stack/manager/pdo_check.h"
#include "stack/od/objects.h"

namespace linegate::manager {
namespace {

bool is_command(od::Address address) {
  return address.index == od::objects::kStoreParameters ||
         address.index == od::objects::kRestoreDefaults;
}

}  // namespace

Comparison::Comparison(std::uint8_t node, std::span<const ObjectWrite> writes,
                       std::span<const AssumedPdo> pdos)
    : node_(node) {
  std::map<od::Address, Expected> last;
  for (const ObjectWrite& write : writes) {
    if (!is_command(write.address)) {
      last[write.address] = {.object = write};
    }
  }
  for (const AssumedPdo& pdo : pdos) {
    for (const ObjectWrite& parameter : pdo.parameters) {
      last.try_emplace(parameter.address,
                       Expected{.object = parameter, .pdo = AssumedPdo{.taken = pdo.taken}});
    }
  }
  expected_.reserve(last.size());
  for (auto& [address, expected] : last) {
    expected_.push_back(std::move(expected));
  }
}

std::optional<TaskStep> Comparison::wanted() {
  if (next_ == expected_.size() || end_ != AbortCode::none) {
    return std::nullopt;
  }
  return TaskStep{.address = expected_[next_].object.address};
}

void Comparison::take(AbortCode abort, std::span<const std::byte> data) {
  if (abort == AbortCode::timeout) {
    end_ = abort;
    return;
  }
  const auto& [expected, pdo] = expected_[next_++];
  const bool is_same =
      pdo ? is_as_assumed(*pdo, expected, data) : std::ranges::equal(data, expected.data);
  if (abort == AbortCode::write_only || (pdo && is_unreadable(abort)) ||
      (abort == AbortCode::none && is_same)) {
    return;
  }
  differences_.push_back({.object = expected.address,
                          .expected = expected.data,
                          .abort = abort,
                          .found = {data.begin(), data.end()}});
}

}  // namespace linegate::manager
