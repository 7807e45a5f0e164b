// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "stack/base/abort_code.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/manager/plan.h"
#include "stack/scan/scanned_node.h"

namespace linegate::scan {
namespace {

constexpr std::size_t kNodeHead = 9;

void put(std::vector<std::byte>& out, std::uint32_t number) {
  out.resize(out.size() + sizeof number);
  store_le(std::span(out).last(sizeof number), number);
}

}  // namespace

std::vector<std::byte> write_report(std::span<const ScannedNode> nodes) {
  std::vector<std::byte> out;
  for (const ScannedNode& node : nodes) {
    const std::vector<std::byte> values = manager::write_concise_dcf(node.values);
    out.push_back(std::byte{node.id});
    put(out, static_cast<std::uint32_t>(node.end));
    put(out, static_cast<std::uint32_t>(values.size()));
    out.insert(out.end(), values.begin(), values.end());
  }
  return out;
}

Result<std::vector<ScannedNode>> read_report(std::span<const std::byte> data) {
  const Error broken = to_error(AbortCode::length_mismatch);
  std::vector<ScannedNode> out;
  while (!data.empty()) {
    if (data.size() < kNodeHead) {
      return broken;
    }
    ScannedNode node{.id = std::to_integer<std::uint8_t>(data[0])};
    node.end = static_cast<AbortCode>(load_le(data.subspan(1, 4)));
    const std::uint64_t size = load_le(data.subspan(5, 4));
    data = data.subspan(kNodeHead);
    if (size > data.size() || node.id < can::kMinNodeId || node.id > can::kMaxNodeId) {
      return broken;
    }
    auto values = manager::read_concise_dcf(data.first(size));
    if (!values) {
      return values.error();
    }
    node.values = *std::move(values);
    out.push_back(std::move(node));
    data = data.subspan(size);
  }
  return out;
}

}  // namespace linegate::scan
