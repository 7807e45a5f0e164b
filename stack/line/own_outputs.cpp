// SPDX-License-Identifier: Apache-2.0
#include "stack/line/own_outputs.h"

#include <utility>

namespace linegate::line {

using image::Direction;

OwnOutputs::OwnOutputs(const LineConfig& config, node::Node& node, image::ProcessImage& image,
                       const FlyingMasterService& flying)
    : config_(config), node_(node), image_(image), flying_(flying), transmitted_(image) {
  const std::vector<image::Entry>& entries = image.layout(Direction::outputs).entries;
  std::vector<std::uint32_t> own;
  for (std::uint32_t i = 0; i < entries.size(); ++i) {
    if (entries[i].node == config.node_id && entries[i].local_pdo == 0) {
      own.push_back(i);
      values_.push_back(image.read_entry(Direction::outputs, i));
    }
  }
  if (own.empty()) {
    return;
  }
  first_ = own.front();
  node.pdos().follow_transmission();
  image.set_listener(*this);
  transmitted_.assign(own);
}

od::Address OwnOutputs::address_of(std::uint32_t entry) const {
  const image::Entry& place = image_.layout(Direction::outputs).entries[entry];
  return {place.index, place.sub};
}

// Also called for values that other nodes write, which request nothing unless TPDOs are requested
// by themselves (Engine::set_auto_notify()).
void OwnOutputs::output_written(std::uint32_t entry) {
  const std::uint64_t value = image_.read_entry(Direction::outputs, entry);
  if (std::exchange(values_[entry - first_], value) != value) {
    transmitted_.changed(entry);
  } else {
    transmitted_.written(entry);
  }
}

void OwnOutputs::written(std::uint32_t bit_offset, std::uint32_t bits, bool always, Instant now) {
  const std::vector<image::Entry>& entries = image_.layout(Direction::outputs).entries;
  if (values_.empty() || bit_offset + bits <= entries[first_].bit_offset) {
    return;  // these outputs are behind all others
  }
  transmitted_.follow(node_.pdos());
  for (std::uint32_t i = first_; i < first_ + values_.size(); ++i) {
    const image::Entry& entry = entries[i];
    const bool is_written = entry.bit_offset < bit_offset + bits &&
                            entry.bit_offset + entry.bit_length > bit_offset &&
                            image_.is_known(Direction::outputs, i);
    if (!is_written || (transmitted_.is_scanned(i) && flying_.is_passive())) {
      continue;
    }
    if (always && transmitted_.is_scanned(i)) {
      node_.pdos().value_changed(address_of(i), now);
    }
    transmitted_.request(address_of(i), node_.pdos(), now);
  }
}

void OwnOutputs::advance(Instant now) {
  if (values_.empty()) {
    return;
  }
  transmitted_.follow(node_.pdos());
  const bool passive = flying_.is_passive();
  if (std::exchange(passive_, passive) && !passive) {
    transmitted_.request_mpdos(node_.pdos(), now);
  } else if (!passive) {
    transmitted_.request_new_mpdos(node_.pdos(), now);
  }
}

void OwnOutputs::give_up() {
  std::vector<od::Address> scanned;
  for (std::uint32_t i = first_; i < first_ + values_.size(); ++i) {
    if (transmitted_.is_scanned(i)) {
      scanned.push_back(address_of(i));
      transmitted_.changed(i);
    }
  }
  node_.pdos().drop_mpdos(scanned);
}

void OwnOutputs::state_changed(nmt::State state, Instant now) {
  if (values_.empty()) {
    return;
  }
  transmitted_.follow(node_.pdos());
  transmitted_.set_operational(state == nmt::State::operational);
  if (state == nmt::State::operational && !flying_.is_passive()) {
    transmitted_.request_mpdos(node_.pdos(), now);
  }
}

void OwnOutputs::tpdo_transmitted(std::uint16_t number, std::span<const std::byte> differs) {
  transmitted_.follow(node_.pdos());
  transmitted_.transmitted(number, differs);
}

void OwnOutputs::mpdo_transmitted(od::Address source) {
  transmitted_.follow(node_.pdos());
  transmitted_.transmitted(source);
}

void OwnOutputs::lose_bus() {
  if (!values_.empty()) {
    node_.pdos().forget_transmission();
    transmitted_.lose_bus();
  }
}

void OwnOutputs::find_bus(Instant now) {
  passive_ = flying_.is_passive();
  transmitted_.find_bus(node_.pdos(), now, !passive_);
}

bool OwnOutputs::is_reset(std::uint32_t entry) const {
  return image_.read_entry(Direction::outputs, entry) != values_[entry - first_];
}

OutputWait OwnOutputs::reason_of(std::uint32_t entry, bool stuck) const {
  return transmitted_.reason_of(entry, node_.pdos(), stuck);
}

std::vector<FramesUnderWay::Awaited> OwnOutputs::frames_of(std::uint32_t entry) {
  transmitted_.follow(node_.pdos());
  return transmitted_.frames_of(entry, node_);
}

}  // namespace linegate::line
