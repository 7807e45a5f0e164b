// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/configuration_report.h"

#include <utility>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"

namespace linegate::manager {
namespace {

class ReportWriter {
 public:
  void number(std::uint64_t value, std::size_t size) {
    out_.resize(out_.size() + size);
    store_le(std::span(out_).last(size), value);
  }
  void bytes(std::span<const std::byte> data) {
    number(data.size(), 4);
    out_.insert(out_.end(), data.begin(), data.end());
  }
  std::vector<std::byte> take() { return std::move(out_); }

 private:
  std::vector<std::byte> out_;
};

// Beyond the end it returns 0 and empty data, and good() is false.
class ReportReader {
 public:
  explicit ReportReader(std::span<const std::byte> data) : data_(data) {}

  bool good() const { return good_; }
  bool done() const { return data_.empty(); }
  std::size_t left() const { return data_.size(); }

  std::span<const std::byte> raw(std::size_t size) {
    good_ = good_ && size <= data_.size();
    const auto out = good_ ? data_.first(size) : std::span<const std::byte>{};
    data_ = good_ ? data_.subspan(size) : std::span<const std::byte>{};
    return out;
  }
  std::uint64_t number(std::size_t size) { return load_le(raw(size)); }
  std::vector<std::byte> bytes() {
    const auto data = raw(static_cast<std::size_t>(number(4)));
    return {data.begin(), data.end()};
  }

 private:
  std::span<const std::byte> data_;
  bool good_ = true;
};

Difference read_difference(ReportReader& from) {
  Difference out;
  out.object.index = static_cast<std::uint16_t>(from.number(2));
  out.object.sub = static_cast<std::uint8_t>(from.number(1));
  out.abort = static_cast<AbortCode>(from.number(4));
  out.expected = from.bytes();
  out.found = from.bytes();
  return out;
}

NodeReport read_node(ReportReader& from) {
  constexpr std::size_t kLeastDifference = 15;
  NodeReport out;
  out.node = static_cast<std::uint8_t>(from.number(1));
  out.boot = static_cast<char>(from.number(1));
  out.end = static_cast<AbortCode>(from.number(4));
  const std::uint64_t count = from.number(4);
  if (count > from.left() / kLeastDifference) {
    (void)from.raw(from.left() + 1);  // the remaining bytes cannot hold this number: fail
    return out;
  }
  for (std::uint64_t i = 0; i < count; ++i) {
    out.differences.push_back(read_difference(from));
  }
  return out;
}

}  // namespace

std::vector<std::byte> write_configuration_report(std::span<const NodeReport> nodes) {
  ReportWriter out;
  for (const NodeReport& node : nodes) {
    out.number(node.node, 1);
    out.number(static_cast<std::uint8_t>(node.boot), 1);
    out.number(static_cast<std::uint32_t>(node.end), 4);
    out.number(node.differences.size(), 4);
    for (const Difference& difference : node.differences) {
      out.number(difference.object.index, 2);
      out.number(difference.object.sub, 1);
      out.number(static_cast<std::uint32_t>(difference.abort), 4);
      out.bytes(difference.expected);
      out.bytes(difference.found);
    }
  }
  return out.take();
}

Result<std::vector<NodeReport>> read_configuration_report(std::span<const std::byte> data) {
  std::vector<NodeReport> out;
  ReportReader from(data);
  while (!from.done()) {
    NodeReport node = read_node(from);
    if (!from.good() || node.node < can::kMinNodeId || node.node > can::kMaxNodeId) {
      return to_error(AbortCode::length_mismatch);
    }
    out.push_back(std::move(node));
  }
  return out;
}

}  // namespace linegate::manager
