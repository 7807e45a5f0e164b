// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/report.h"

#include <string_view>

namespace linegate::dds::guard {
namespace {

std::string_view meaning(Reason reason) {
  switch (reason) {
    case Reason::none:
      break;
    case Reason::header:
      return "no RTPS 2 header";
    case Reason::submessage:
      return "a submessage exceeds its datagram, or is cut";
    case Reason::sequence_number:
      return "impossible sequence numbers";
    case Reason::sequence_set:
      return "malformed set of sequence numbers";
    case Reason::fragment:
      return "fragments that do not make up a sample";
    case Reason::parameters:
      return "malformed inline QoS";
    case Reason::discovery:
      return "malformed discovery data";
    case Reason::statistics:
      return "misplaced Fast DDS statistics";
    case Reason::rate:
      return "sequence numbers advance faster than samples can";
    case Reason::writers:
      return "more writers than the guard can follow";
    case Reason::protection:
      return "malformed DDS-Security submessages";
    case Reason::unprotected:
      return "plain submessages in a domain that requires protection";
    case Reason::reliability:
      return "a reader that is not of the reliability that it announced";
    case Reason::participants:
      return "new participants, while the places left are for configured peers";
    case Reason::endpoints:
      return "participants announce more endpoints than they may";
    case Reason::gap:
      return "more numbers above a missing one than a reader may keep";
    case Reason::stream:
      return "their octets are no RTCP messages";
    case Reason::reader:
      return "two threads of Fast DDS read from them; it opens them again";
  }
  return "no reason";
}

// What the guard does for that reason, and to what.
std::string deed(std::uint64_t count, Reason reason) {
  const std::string many = count == 1 ? "" : "s";
  if (reason == Reason::gap)
    return " GAP" + many + " left out";
  if (reason == Reason::stream || reason == Reason::reader)
    return " TCP connection" + many + " ended";
  return " datagram" + many + " dropped";
}

std::string sentence(std::uint64_t count, Reason reason) {
  return std::to_string(count) + deed(count, reason) +
         " by the DDS guard: " + std::string(meaning(reason)) + " (" +
         std::string(to_string(reason)) + ")";
}

}  // namespace

std::vector<std::string> Report::update(const Counters& counters, Instant now) {
  std::vector<std::string> out;
  for (std::size_t i = 1; i < kReasons; ++i) {
    Reported& it = reported_[i];
    const std::uint64_t count = counters.dropped[i];
    if (count == it.count || now < it.next)
      continue;
    out.push_back(sentence(count - it.count, static_cast<Reason>(i)));
    it = {count, now + kPeriod};
  }
  return out;
}

}  // namespace linegate::dds::guard
