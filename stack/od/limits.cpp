// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>

#include "stack/base/byte_order.h"
#include "stack/od/data_type.h"

namespace linegate::od {
namespace {

double load_real(std::span<const std::byte> bytes) {
  if (bytes.size() == 4) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(load_le(bytes)));
  }
  return std::bit_cast<double>(load_le(bytes));
}

template <class Load>
AbortCode compare(std::span<const std::byte> value, std::span<const std::byte> low,
                  std::span<const std::byte> high, Load load) {
  if (!low.empty() && !high.empty() && load(high) < load(low)) {
    return AbortCode::max_less_than_min;
  }
  const auto number = load(value);
  if (!low.empty() && number < load(low)) {
    return AbortCode::value_too_low;
  }
  if (!high.empty() && number > load(high)) {
    return AbortCode::value_too_high;
  }
  return AbortCode::none;
}

bool is_limit(DataType type, std::span<const std::byte> limit) {
  return limit.empty() || limit.size() == byte_size(type);
}

}  // namespace

AbortCode check_limits(DataType type, std::span<const std::byte> value,
                       std::span<const std::byte> low, std::span<const std::byte> high) {
  if ((low.empty() && high.empty()) || !is_limit(type, low) || !is_limit(type, high) ||
      value.size() != byte_size(type)) {
    return AbortCode::none;
  }
  if (is_signed(type)) {
    return compare(value, low, high, load_le_signed);
  }
  if (is_integer(type)) {
    return compare(value, low, high, [](std::span<const std::byte> b) { return load_le(b); });
  }
  if (is_real(type)) {
    return std::isnan(load_real(value)) ? AbortCode::invalid_value
                                        : compare(value, low, high, load_real);
  }
  return AbortCode::none;
}

}  // namespace linegate::od
