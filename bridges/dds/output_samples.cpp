// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/output_samples.h"

#include <algorithm>
#include <bit>

#include "bridges/dds/bytes.h"
#include "stack/image/layout.h"

namespace linegate::dds {
namespace {

using line::OutputRefusal;

constexpr unsigned kNmtReactions =
    line::kNmtPreOperational | line::kNmtStop | line::kNmtResetCommunication | line::kNmtResetNode;
constexpr unsigned kKnownReactions =
    line::kZeroOutputs | kNmtReactions | line::kSendEmcy | line::kHeartbeatOff;

OutputCheck check(const v1::OutputWrite& from) {
  const OutputCheck watchdog = check_watchdog(from.reactions(), Duration{from.watchdog_ns()});
  if (watchdog.refusal != OutputRefusal::none)
    return watchdog;
  if (from.values().size() > kMaxOutputValues || from.bytes().size() > kMaxOutputRuns) {
    return {OutputRefusal::bad_length, "more values or bytes than the contract allows"};
  }
  for (const v1::OutputValue& value : from.values()) {
    if (value.data().empty() || value.data().size() > line::OutputValue::kMaxLength) {
      return {OutputRefusal::bad_length, "a value is not 1 to 32 bytes long"};
    }
  }
  std::size_t all = 0;
  for (const v1::OutputBytes& run : from.bytes()) {
    if (run.data().empty() || run.data().size() > kChunkBytes) {
      return {OutputRefusal::bad_length, "a run of bytes is not 1 to 8192 bytes long"};
    }
    if (run.offset() > image::kMaxAreaBytes - run.data().size()) {
      return {OutputRefusal::bad_length, "a run of bytes ends beyond any output area"};
    }
    // A line keeps the buffers of writes: this limits their size.
    all += run.data().size();
    if (all > image::kMaxAreaBytes) {
      return {OutputRefusal::bad_length, "the runs of bytes are longer than any output area"};
    }
  }
  return {};
}

}  // namespace

OutputCheck check_watchdog(std::uint8_t reactions, Duration watchdog) {
  if ((reactions & ~kKnownReactions) != 0)
    return {OutputRefusal::bad_reaction, "reactions has bits that mean nothing"};
  if (std::popcount(reactions & kNmtReactions) > 1)
    return {OutputRefusal::bad_reaction, "reactions has more than one NMT reaction"};
  if (watchdog < Duration::zero())
    return {OutputRefusal::bad_reaction, "watchdog_ns is negative"};
  return {};
}

bool to_wire(const line::OutputWrite& from, v1::OutputWrite& to) {
  if (from.values.size() > kMaxOutputValues || from.bytes.size() > kMaxOutputRuns)
    return false;
  to.group(from.group);
  to.layout_id(from.layout_id);
  to.arming(from.arming);
  to.watchdog_ns(from.watchdog.count());
  to.reactions(from.reactions);
  to.values().resize(from.values.size());
  for (std::size_t i = 0; i < from.values.size(); ++i) {
    const line::OutputValue& value = from.values[i];
    if (value.length > value.data.size())
      return false;
    to.values()[i].entry(value.entry);
    copy_bytes(std::span(value.data).first(value.length), to.values()[i].data());
  }
  to.bytes().resize(from.bytes.size());
  for (std::size_t i = 0; i < from.bytes.size(); ++i) {
    if (from.bytes[i].data.size() > kChunkBytes)
      return false;
    to.bytes()[i].offset(from.bytes[i].offset);
    copy_bytes(from.bytes[i].data, to.bytes()[i].data());
  }
  return true;
}

OutputCheck from_wire(const v1::OutputWrite& from, line::OutputWrite& to) {
  const OutputCheck result = check(from);
  if (result.refusal != OutputRefusal::none)
    return result;
  to.group = from.group();
  to.layout_id = from.layout_id();
  to.arming = from.arming();
  to.watchdog = Duration{from.watchdog_ns()};
  to.reactions = from.reactions();
  to.values.resize(from.values().size());
  for (std::size_t i = 0; i < to.values.size(); ++i) {
    const auto& data = from.values()[i].data();
    to.values[i].entry = from.values()[i].entry();
    to.values[i].length = static_cast<std::uint8_t>(data.size());
    to.values[i].data.fill(std::byte{0});
    std::transform(data.begin(), data.end(), to.values[i].data.begin(),
                   [](std::uint8_t octet) { return std::byte{octet}; });
  }
  to.bytes.resize(from.bytes().size());
  for (std::size_t i = 0; i < to.bytes.size(); ++i) {
    to.bytes[i].offset = from.bytes()[i].offset();
    copy_bytes(from.bytes()[i].data(), to.bytes[i].data);
  }
  return {};
}

}  // namespace linegate::dds
