// SPDX-License-Identifier: Apache-2.0
#include "stack/line/scanned_outputs.h"

#include <algorithm>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/line/mpdo_service.h"
#include "stack/pdo/record.h"

namespace linegate::line {

using image::Direction;

ScannedOutputs::ScannedOutputs(const LineConfig& config, node::Node& node,
                               image::ProcessImage& image, const FlyingMasterService& flying)
    : config_(config), node_(node), image_(image), flying_(flying) {
  const std::vector<image::Entry>& entries = image.layout(Direction::outputs).entries;
  for (std::uint32_t i = 0; i < entries.size() && !config.mpdo_scanner.empty(); ++i) {
    if (entries[i].node == config.node_id && entries[i].local_pdo == 0) {
      outputs_.push_back({.entry = i});
    }
  }
}

void ScannedOutputs::written(std::uint32_t bit_offset, std::uint32_t bits, bool always) {
  const std::vector<image::Entry>& entries = image_.layout(Direction::outputs).entries;
  bool any = false;
  for (Output& output : outputs_) {
    const image::Entry& entry = entries[output.entry];
    output.written = entry.bit_offset < bit_offset + bits &&
                     entry.bit_offset + entry.bit_length > bit_offset &&
                     image_.is_known(Direction::outputs, output.entry);
    const std::uint64_t value = image_.read_entry(Direction::outputs, output.entry);
    if (output.written && (always || output.sent != value)) {
      output = {.entry = output.entry, .due = true, .written = true};
    }
    any = any || output.written;
  }
  if (!any) {
    return;
  }
  send();
  for (const Output& output : outputs_) {
    if (output.written) {
      image_.set_entry_valid(Direction::outputs, output.entry, output.confirmed);
    }
  }
}

// An MPDO that the engine refuses stays due until the own node is Operational or the engine has
// room.
void ScannedOutputs::send() {
  const std::vector<image::Entry>& entries = image_.layout(Direction::outputs).entries;
  due_ = false;
  if (flying_.is_passive()) {
    return;  // see follow_role()
  }
  for (Output& output : outputs_) {
    if (!output.due) {
      continue;
    }
    const image::Entry& entry = entries[output.entry];
    const AbortCode why = node_.pdos().send_mpdo({entry.index, entry.sub});
    if (why == AbortCode::device_state || why == AbortCode::out_of_memory) {
      due_ = true;
      continue;
    }
    output.due = false;
    if (why == AbortCode::none) {
      output.sent = image_.read_entry(Direction::outputs, output.entry);
    } else {
      confirm(output);  // it is not sent: the scanner list lacks it
    }
  }
}

void ScannedOutputs::confirm(Output& output) {
  output.number = 0;
  output.confirmed = true;
  image_.set_entry_valid(Direction::outputs, output.entry, true);
}

void ScannedOutputs::follow_state() {
  const std::uint64_t starts = node_.counters().starts;
  if (std::exchange(starts_, starts) == starts || node_.state() != nmt::State::operational) {
    return;
  }
  invalidate();
  send();
}

void ScannedOutputs::invalidate() {
  for (Output& output : outputs_) {
    if (image_.is_known(Direction::outputs, output.entry)) {
      output = {.entry = output.entry, .due = true};
      image_.set_entry_valid(Direction::outputs, output.entry, false);
    }
  }
}

void ScannedOutputs::follow_role() {
  const bool passive = flying_.is_passive();
  if (std::exchange(passive_, passive) && !passive) {
    send();
  }
}

void ScannedOutputs::drop() {
  std::vector<od::Address> objects;
  const std::vector<image::Entry>& entries = image_.layout(Direction::outputs).entries;
  for (Output& output : outputs_) {
    const image::Entry& entry = entries[output.entry];
    objects.push_back({entry.index, entry.sub});
    output = {.entry = output.entry, .due = image_.is_known(Direction::outputs, output.entry)};
    image_.set_entry_valid(Direction::outputs, output.entry, false);
  }
  node_.pdos().drop_mpdos(objects);
}

void ScannedOutputs::handed_out(const can::Frame& frame, std::uint64_t number) {
  const bool may_be_own = frame.data[0] == std::byte{config_.node_id};
  for (Output& output : outputs_) {
    const bool waits = output.sent && !output.due && !output.confirmed && output.number == 0;
    if (!may_be_own || !waits || !can::same_content(frame_of(output.entry), frame)) {
      continue;
    }
    if (number == 0) {
      confirm(output);
    } else {
      output.number = number;
    }
  }
  if (due_) {
    send();
  }
}

void ScannedOutputs::acknowledged(std::uint64_t number) {
  for (Output& output : outputs_) {
    if (output.number != 0 && output.number <= number) {
      confirm(output);
    }
  }
}

void ScannedOutputs::lost(std::uint64_t first, std::uint64_t last) {
  for (Output& output : outputs_) {
    if (output.number >= first && output.number <= last) {
      output = {.entry = output.entry, .due = true};
      due_ = true;
    }
  }
  if (due_) {
    send();
  }
}

ScannedOutputs::Progress ScannedOutputs::progress(std::uint32_t entry) const {
  const auto output = std::ranges::find(outputs_, entry, &Output::entry);
  if (output == outputs_.end() || output->confirmed) {
    return Progress::confirmed;
  }
  return output->due ? Progress::waits : Progress::sent;
}

can::Frame ScannedOutputs::frame_of(std::uint32_t entry) const {
  const image::Entry& place = image_.layout(Direction::outputs).entries[entry];
  pdo::Mpdo mpdo{
      .mode = pdo::MpdoMode::source, .node = config_.node_id, .address = {place.index, place.sub}};
  store_le(std::span(mpdo.value), image_.read_entry(Direction::outputs, entry));
  return mpdo_frame(node_.dictionary(), tpdo(), pdo::encode(mpdo));
}

std::uint16_t ScannedOutputs::tpdo() const {
  const od::Dictionary& dictionary = node_.dictionary();
  for (const pdo::Parameters& own : config_.forwarding.tpdos) {
    if (pdo::read_mpdo_mode(dictionary, pdo::PdoKind::tpdo, own.number) == pdo::MpdoMode::source) {
      return own.number;
    }
  }
  return 0;
}

}  // namespace linegate::line
