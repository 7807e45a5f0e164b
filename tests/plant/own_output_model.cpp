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
          output.ways.push_back({.tpdo = tpdo.number, .cob_id = tpdo.cob_id, .bit = bit});
        }
        bit += mapping.bits;
      }
      if (tpdo.mpdo == pdo::MpdoMode::source && is_in_list(config.mpdo_scanner, address)) {
        output.ways.push_back(
            {.tpdo = tpdo.number, .by_mpdo = true, .cob_id = tpdo.cob_id, .bit = 32});
      }
    }
    outputs_.push_back(std::move(output));
  }
}

const OwnOutputModel::Output* OwnOutputModel::find(std::size_t entry) const {
  const auto found = std::ranges::find(outputs_, entry, &Output::entry);
  return found == outputs_.end() ? nullptr : &*found;
}

void OwnOutputModel::note_value(std::size_t entry, std::uint64_t value) {
  for (auto& [tag, asked] : asked_) {
    if (asked.entry == entry) {
      asked.values.push_back(value);
    }
  }
}

void OwnOutputModel::commanded(const line::Command& command) {
  const auto* const output = std::get_if<line::SingleOutput>(&command.request);
  if (output == nullptr || find(output->entry) == nullptr) {
    return;
  }
  const std::uint64_t value =
      bits_of(output->data, 0, static_cast<unsigned>(8 * output->data.size()));
  note_value(output->entry, value);
  asked_[command.tag] = {.entry = output->entry, .after = submitted_, .values = {value}};
}

void OwnOutputModel::written(const line::OutputWrite& write) {
  for (const line::OutputValue& value : write.values) {
    note_value(value.entry, bits_of(value.data, 0, 8U * value.length));
  }
  zeroes_ = zeroes_ || (write.reactions & line::kZeroOutputs) != 0;
}

std::string OwnOutputModel::answered(const line::Reply& reply) {
  const auto found = asked_.find(reply.tag);
  if (found == asked_.end()) {
    return {};
  }
  const Asked asked = std::move(found->second);
  asked_.erase(found);
  if (!reply.ok()) {
    return {};
  }
  const Output& output = *find(asked.entry);
  const auto* const way = std::get_if<line::WrittenByPdo>(&reply.data);
  if (way == nullptr) {
    return output.ways.empty() ? "" : "a PDO sends the output, and the answer names none";
  }
  const std::string pdo = "PDO " + std::to_string(way->pdo);
  if (std::ranges::find(output.ways, way->pdo, &Way::tpdo) == output.ways.end()) {
    return pdo + " does not send the output";
  }
  const bool operational = line_.state().own_state == nmt::State::operational;
  if (way->wait == line::PdoWait::operational && operational) {
    return "it waits for the own node, which is Operational";
  }
  const bool sent = std::ranges::find(asked.sent_by, way->pdo) != asked.sent_by.end();
  if (way->wait != line::PdoWait::none) {
    return !asked.sent_by.empty() ? "the value was sent, and the answer is that it waits" : "";
  }
  ++writes_sent_;
  return sent ? "" : "no frame of " + pdo + " with the value was acknowledged";
}

void OwnOutputModel::before_receive(const can::Frame& frame) {
  const auto control = frame.id == can::kNmtId ? nmt::decode_node_control(frame) : std::nullopt;
  if (control && control->command != nmt::Command::start &&
      control->addresses(line_.config().node_id) && line_.state().role == line::Role::device) {
    started_after_ = submitted_;
  }
}

bool OwnOutputModel::carries(const Output& output, const Way& way, const can::Frame& frame) const {
  if (frame.id != way.cob_id.id() || frame.extended() || frame.remote()) {
    return false;
  }
  const auto mpdo = way.by_mpdo ? pdo::decode_mpdo(frame) : std::nullopt;
  const image::Entry& entry = line_.layout(image::Direction::outputs).entries[output.entry];
  return !way.by_mpdo || (mpdo && mpdo->address == od::Address{entry.index, entry.sub});
}

void OwnOutputModel::submitted(const can::Frame& frame) {
  ++submitted_;
  for (Output& output : outputs_) {
    for (Way& way : output.ways) {
      if (carries(output, way, frame)) {
        const image::Entry& entry = line_.layout(image::Direction::outputs).entries[output.entry];
        way.under_way.emplace_back(submitted_, bits_of(frame.data, way.bit, entry.bit_length));
      }
    }
  }
}

void OwnOutputModel::acknowledged(std::uint64_t number) {
  acknowledged_ = number;
  for (Output& output : outputs_) {
    for (Way& way : output.ways) {
      for (; !way.under_way.empty() && way.under_way.front().first <= number;
           way.under_way.pop_front()) {
        std::tie(way.number, way.value) = way.under_way.front();
        note_acknowledged(output, way);
      }
    }
  }
}

void OwnOutputModel::note_acknowledged(const Output& output, const Way& way) {
  for (auto& [tag, asked] : asked_) {
    if (asked.entry == output.entry && way.number > asked.after &&
        (std::ranges::find(asked.values, way.value) != asked.values.end() ||
         (zeroes_ && way.value == 0))) {
      asked.sent_by.push_back(way.tpdo);
    }
  }
}

void OwnOutputModel::lost(std::uint64_t first, std::uint64_t last) {
  for (Output& output : outputs_) {
    for (Way& way : output.ways) {
      std::erase_if(way.under_way, [first, last](const auto& frame) {
        return frame.first >= first && frame.first <= last;
      });
    }
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
  if (output.ways.empty()) {
    return {};
  }
  const image::Entry& entry = line_.layout(image::Direction::outputs).entries[output.entry];
  const std::uint64_t value = bits_of(snapshot_.bytes, entry.bit_offset, entry.bit_length);
  ++compared_;
  return std::ranges::any_of(
             output.ways,
             [&](const Way& way) { return way.number > started_after_ && way.value == value; })
             ? std::string()
             : "no newest frame since the start of the own node has its value";
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
