// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "stack/base/abort_code.h"
#include "stack/base/byte_order.h"
#include "stack/manager/plan.h"

namespace linegate::manager {
namespace {

constexpr std::size_t kCount = 4;
constexpr std::size_t kHead = 7;  // index, sub-index, size

void append(std::vector<std::byte>& out, std::uint64_t value, std::size_t size) {
  out.resize(out.size() + size);
  store_le(std::span(out).last(size), value);
}

std::uint64_t take(std::span<const std::byte>& data, std::size_t size) {
  const std::uint64_t value = load_le(data.first(size));
  data = data.subspan(size);
  return value;
}

}  // namespace

std::vector<std::byte> write_concise_dcf(std::span<const ObjectWrite> writes) {
  std::vector<std::byte> out;
  if (writes.empty()) {
    return out;
  }
  append(out, writes.size(), kCount);
  for (const ObjectWrite& write : writes) {
    append(out, write.address.index, 2);
    append(out, write.address.sub, 1);
    append(out, write.data.size(), 4);
    out.insert(out.end(), write.data.begin(), write.data.end());
  }
  return out;
}

Result<std::vector<ObjectWrite>> read_concise_dcf(std::span<const std::byte> data) {
  std::vector<ObjectWrite> out;
  if (data.empty()) {
    return out;
  }
  if (data.size() < kCount) {
    return to_error(AbortCode::length_mismatch);
  }
  for (std::uint64_t left = take(data, kCount); left != 0; --left) {
    if (data.size() < kHead) {
      return to_error(AbortCode::length_mismatch);
    }
    ObjectWrite write;
    write.address.index = static_cast<std::uint16_t>(take(data, 2));
    write.address.sub = static_cast<std::uint8_t>(take(data, 1));
    const std::uint64_t size = take(data, 4);
    if (size > data.size()) {
      return to_error(AbortCode::length_mismatch);
    }
    const auto value = data.first(static_cast<std::size_t>(size));
    write.data.assign(value.begin(), value.end());
    data = data.subspan(value.size());
    out.push_back(std::move(write));
  }
  if (!data.empty()) {
    return to_error(AbortCode::length_mismatch);
  }
  return out;
}

}  // namespace linegate::manager
