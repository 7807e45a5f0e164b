// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/own_output_model.h"

#include <algorithm>
#include <tuple>

#include "stack/nmt/node_control.h"
#include "stack/pdo/mpdo.h"

#include "tests/plant/output_fields.h"

namespace linegate::plant {
namespace {

bool is_in_list(const std::vector<std::uint32_t>& scanner, od::Address address) {
  return std::ranges::any_of(scanner, [address](std::uint32_t raw) {
    return pdo::ScannerList::entry(raw).contains(address);
  });
}

}  // namespace

OwnOutputModel::OwnOutputModel(line::Line& line) : line_(line) {
  const line::LineConfig& config = line.config();
  const std::vector<image::Entry>& entries = line.layout(image::Direction::outputs).entries;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (entries[i].local_pdo != 0 || config.role == line::Role::observer) {
      continue;
    }
    const od::Address address{entries[i].index, entries[i].sub};
    Output output{.entry = i};
    for (const pdo::Parameters& tpdo : config.forwarding.tpdos) {
      unsigned bit = 0;
      for (const pdo::Mapping& mapping : tpdo.mapping) {
        if (mapping.address == address) {
          output.is_sent = true;
          output.cob_id = tpdo.cob_id;
          output.bit = bit;
        }
        bit += mapping.bits;
      }
      if (tpdo.mpdo == pdo::MpdoMode::source && is_in_list(config.mpdo_scanner, address)) {
        output.is_sent = output.by_mpdo = true;
        output.cob_id = tpdo.cob_id;
        output.bit = 32;
      }
    }
    outputs_.push_back(std::move(output));
  }
}

void OwnOutputModel::before_receive(const can::Frame& frame) {
  const auto control = frame.id == can::kNmtId ? nmt::decode_node_control(frame) : std::nullopt;
  if (control && control->command != nmt::Command::start &&
      control->addresses(line_.config().node_id) && line_.state().role == line::Role::device) {
    started_after_ = submitted_;
  }
}

bool OwnOutputModel::carries(const Output& output, const can::Frame& frame) const {
  if (!output.is_sent || frame.id != output.cob_id.id() || frame.extended() || frame.remote()) {
    return false;
  }
  const auto mpdo = output.by_mpdo ? pdo::decode_mpdo(frame) : std::nullopt;
  const image::Entry& entry = line_.layout(image::Direction::outputs).entries[output.entry];
  return !output.by_mpdo || (mpdo && mpdo->address == od::Address{entry.index, entry.sub});
}

void OwnOutputModel::submitted(const can::Frame& frame) {
  ++submitted_;
  for (Output& output : outputs_) {
    if (carries(output, frame)) {
      const image::Entry& entry = line_.layout(image::Direction::outputs).entries[output.entry];
      output.under_way.emplace_back(submitted_, bits_of(frame.data, output.bit, entry.bit_length));
    }
  }
}

void OwnOutputModel::acknowledged(std::uint64_t number) {
  acknowledged_ = number;
  for (Output& output : outputs_) {
    for (; !output.under_way.empty() && output.under_way.front().first <= number;
         output.under_way.pop_front()) {
      std::tie(output.number, output.value) = output.under_way.front();
    }
  }
}

void OwnOutputModel::lost(std::uint64_t first, std::uint64_t last) {
  for (Output& output : outputs_) {
    std::erase_if(output.under_way, [first, last](const auto& frame) {
      return frame.first >= first && frame.first <= last;
    });
  }
}

void OwnOutputModel::set_bus(bool on) {
  is_off_bus_ = !on;
  if (!on) {
    started_after_ = submitted_;
  }
}

std::string OwnOutputModel::compare(Instant now, bool at_rest) {
  if (outputs_.empty()) {
    return {};
  }
  const bool operational = line_.state().own_state == nmt::State::operational;
  if (!operational) {
    started_after_ = submitted_;
  }
  line_.snapshot(image::Direction::outputs, snapshot_, now, true);
  for (const Output& output : outputs_) {
    const std::string& name = line_.layout(image::Direction::outputs).entries[output.entry].name;
    if (!snapshot_.is_valid(output.entry)) {
      if (at_rest && operational && !is_off_bus_ && snapshot_.is_known(output.entry)) {
        return "the output " + name + " is not valid at rest";
      }
      continue;
    }
    std::string text = operational ? check_valid(output) : "the own node is not Operational";
    if (!text.empty()) {
      return "the output " + name + " is valid, and " + text;
    }
  }
  return check_waits(operational);
}

std::string OwnOutputModel::check_valid(const Output& output) {
  if (!snapshot_.is_known(output.entry)) {
    return "it was never written";
  }
  if (is_off_bus_) {
    return "the line is off the bus";
  }
  if (!output.is_sent) {
    return {};
  }
  if (output.number <= started_after_) {
    return "no frame with it was acknowledged since the start of the own node";
  }
  ++compared_;
  const image::Entry& entry = line_.layout(image::Direction::outputs).entries[output.entry];
  return output.value == bits_of(snapshot_.bytes, entry.bit_offset, entry.bit_length)
             ? std::string()
             : "the newest frame with it has another value";
}

std::string OwnOutputModel::check_waits(bool operational) const {
  using enum line::OutputWait;
  for (std::size_t group = 0; group < line_.output_groups(); ++group) {
    line::OutputState state;
    line_.output_state(group, state);
    for (const auto& [entry, reason] : state.waits) {
      if (std::ranges::find(outputs_, entry, &Output::entry) == outputs_.end()) {
        continue;
      }
      const bool known = snapshot_.is_known(entry);
      const bool bus_holds =
          is_off_bus_ ? reason == bus : reason != bus || acknowledged_ < submitted_;
      if (snapshot_.is_valid(entry) || (reason == value) == known ||
          (known && (reason == own_node) == operational) || (known && operational && !bus_holds)) {
        return "an own output waits for another reason than " +
               std::to_string(static_cast<unsigned>(reason));
      }
    }
  }
  return {};
}

}  // namespace linegate::plant
