// SPDX-License-Identifier: Apache-2.0
// Outputs that go by MPDO: objects of the own node in the outputs of the image, which the object
// scanner list names (CiA 301 7.2.2.6) and no PDO carries.
#include <algorithm>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/line/line_impl.h"
#include "stack/pdo/record.h"

namespace linegate::line {

using image::Direction;

void Line::Impl::find_scanned_outputs() {
  const std::vector<image::Entry>& entries = image.layout(Direction::outputs).entries;
  for (std::uint32_t i = 0; i < entries.size() && !config.mpdo_scanner.empty(); ++i) {
    if (entries[i].node == config.node_id && entries[i].local_pdo == 0) {
      scanned_outputs.push_back({.entry = i});
    }
  }
}

void Line::Impl::scanned_written(std::uint32_t bit_offset, std::uint32_t bits, bool always) {
  const std::vector<image::Entry>& entries = image.layout(Direction::outputs).entries;
  bool any = false;
  for (ScannedOutput& scanned : scanned_outputs) {
    const image::Entry& entry = entries[scanned.entry];
    scanned.written = entry.bit_offset < bit_offset + bits &&
                      entry.bit_offset + entry.bit_length > bit_offset &&
                      image.is_known(Direction::outputs, scanned.entry);
    const std::uint64_t value = image.read_entry(Direction::outputs, scanned.entry);
    if (scanned.written && (always || scanned.sent != value)) {
      scanned = {.entry = scanned.entry, .due = true, .written = true};
    }
    any = any || scanned.written;
  }
  if (!any) {
    return;
  }
  send_scanned();
  for (const ScannedOutput& scanned : scanned_outputs) {
    if (scanned.written) {
      image.set_entry_valid(Direction::outputs, scanned.entry, scanned.confirmed);
    }
  }
}

// What the engine does not take now stays due: until the own node is Operational, or has room.
void Line::Impl::send_scanned() {
  const std::vector<image::Entry>& entries = image.layout(Direction::outputs).entries;
  scanned_due = false;
  for (ScannedOutput& scanned : scanned_outputs) {
    if (!scanned.due) {
      continue;
    }
    const image::Entry& entry = entries[scanned.entry];
    const AbortCode why = node.pdos().send_mpdo({entry.index, entry.sub});
    if (why == AbortCode::device_state || why == AbortCode::out_of_memory) {
      scanned_due = true;
      continue;
    }
    scanned.due = false;
    if (why == AbortCode::none) {
      scanned.sent = image.read_entry(Direction::outputs, scanned.entry);
    } else {
      confirm_scanned(scanned);  // it goes nowhere: the list does not have it
    }
  }
}

void Line::Impl::confirm_scanned(ScannedOutput& scanned) {
  scanned.number = 0;
  scanned.confirmed = true;
  image.set_entry_valid(Direction::outputs, scanned.entry, true);
}

// On entering Operational all that are known are sent: the engine dropped what waited when it was
// left, be it for a moment only.
void Line::Impl::follow_scanned() {
  const bool operational = node.state() == nmt::State::operational;
  const std::uint64_t starts = node.counters().starts;
  if (std::exchange(scanned_starts, starts) != starts && operational) {
    for (ScannedOutput& scanned : scanned_outputs) {
      if (image.is_known(Direction::outputs, scanned.entry)) {
        scanned = {.entry = scanned.entry, .due = true};
        image.set_entry_valid(Direction::outputs, scanned.entry, false);
      }
    }
    send_scanned();
  }
}

// The TPDO in source address mode; 0 if there is none.
std::uint16_t Line::Impl::scanner_tpdo() const {
  const od::Dictionary& dictionary = node.dictionary();
  for (const pdo::Parameters& own : config.forwarding.tpdos) {
    if (pdo::read_mpdo_mode(dictionary, pdo::PdoKind::tpdo, own.number) == pdo::MpdoMode::source) {
      return own.number;
    }
  }
  return 0;
}

// With the newest value.
can::Frame Line::Impl::scanned_frame(const ScannedOutput& scanned) const {
  const image::Entry& entry = image.layout(Direction::outputs).entries[scanned.entry];
  pdo::Mpdo mpdo{
      .mode = pdo::MpdoMode::source, .node = config.node_id, .address = {entry.index, entry.sub}};
  store_le(std::span(mpdo.value), image.read_entry(Direction::outputs, scanned.entry));
  return mpdo_frame(scanner_tpdo(), pdo::encode(mpdo));
}

// A frame was handed out; number 0: no acknowledgement is expected.
void Line::Impl::scanned_handed_out(const can::Frame& frame, std::uint64_t number) {
  const bool may_be_own = frame.data[0] == std::byte{config.node_id};
  for (ScannedOutput& scanned : scanned_outputs) {
    const bool waits = scanned.sent && !scanned.due && !scanned.confirmed && scanned.number == 0;
    if (!may_be_own || !waits || !can::same_content(scanned_frame(scanned), frame)) {
      continue;
    }
    if (number == 0) {
      confirm_scanned(scanned);
    } else {
      scanned.number = number;
    }
  }
  if (scanned_due) {
    send_scanned();
  }
}

void Line::Impl::scanned_acknowledged(std::uint64_t number) {
  for (ScannedOutput& scanned : scanned_outputs) {
    if (scanned.number != 0 && scanned.number <= number) {
      confirm_scanned(scanned);
    }
  }
}

void Line::Impl::scanned_lost(std::uint64_t first, std::uint64_t last) {
  for (ScannedOutput& scanned : scanned_outputs) {
    if (scanned.number >= first && scanned.number <= last) {
      scanned = {.entry = scanned.entry, .due = true};
      scanned_due = true;
    }
  }
  if (scanned_due) {
    send_scanned();
  }
}

// Of an output that no PDO carries: what it waits for, or that it was sent.
void Line::Impl::answer_scanned(Command command, Instant now) {
  const auto scanned = std::ranges::find(scanned_outputs, command.entry, &ScannedOutput::entry);
  if (scanned == scanned_outputs.end() || scanned->confirmed) {
    reply(command.tag, Error{});
    return;
  }
  const std::uint16_t tpdo = scanner_tpdo();
  if (scanned->due) {
    const bool operational = node.state() == nmt::State::operational;
    reply(command.tag, Error{}, way_of(tpdo, operational ? PdoWait::turn : PdoWait::operational));
    return;
  }
  answer_when_sent({.command = std::move(command),
                    .frames = {{.frame = scanned_frame(*scanned), .any_value = true}},
                    .data = way_of(tpdo, PdoWait::none)},
                   now);
}

}  // namespace linegate::line
