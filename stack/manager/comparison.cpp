// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/comparison.h"

#include <algorithm>
#include <map>

#include "stack/od/objects.h"

namespace linegate::manager {
namespace {

bool is_command(od::Address address) {
  return address.index == od::objects::kStoreParameters ||
         address.index == od::objects::kRestoreDefaults;
}

}  // namespace

Comparison::Comparison(std::uint8_t node, std::span<const ObjectWrite> writes) : node_(node) {
  std::map<od::Address, const ObjectWrite*> last;
  for (const ObjectWrite& write : writes) {
    if (!is_command(write.address)) {
      last[write.address] = &write;
    }
  }
  expected_.reserve(last.size());
  for (const auto& [address, write] : last) {
    expected_.push_back(*write);
  }
}

std::optional<TaskStep> Comparison::wanted() {
  if (next_ == expected_.size() || end_ != AbortCode::none) {
    return std::nullopt;
  }
  return TaskStep{.address = expected_[next_].address};
}

void Comparison::take(AbortCode abort, std::span<const std::byte> data) {
  if (abort == AbortCode::timeout) {
    end_ = abort;
    return;
  }
  const ObjectWrite& expected = expected_[next_++];
  if (abort == AbortCode::write_only ||
      (abort == AbortCode::none && std::ranges::equal(data, expected.data))) {
    return;
  }
  differences_.push_back({.object = expected.address,
                          .expected = expected.data,
                          .abort = abort,
                          .found = {data.begin(), data.end()}});
}

}  // namespace linegate::manager
