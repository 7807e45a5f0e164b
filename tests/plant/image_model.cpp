// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/image_model.h"

#include <algorithm>

#include "stack/pdo/parameters.h"

#include "tests/plant/output_fields.h"

namespace linegate::plant {
namespace {

std::uint32_t key(std::uint32_t id, bool extended) {
  return id | (extended ? 0x8000'0000U : 0U);
}

// The RUN indicator shows the own state (CiA 303-3). Line::state() also contains it, but examines
// every node, and this function is called after every call of a line.
bool is_operational(const line::Line& line) {
  return line.indicators().run == node::Pattern::on;
}
bool is_pre_operational(const line::Line& line) {
  return line.indicators().run == node::Pattern::blinking;
}
// PDOs received before Operational count only for an NMT master (1F80h bit 0).
bool is_master(line::Line& line) {
  constexpr od::Address kStartup{0x1F80, 0};
  return line.config().role == line::Role::manager &&
         (line.dictionary().number(kStartup).value_or(0) & 1U) != 0;
}

bool bit(std::span<const std::byte> bytes, unsigned position) {
  return (std::to_integer<unsigned>(bytes[position / 8]) >> (position % 8) & 1U) != 0;
}

}  // namespace

ImageModel::ImageModel(line::Line& line) : line_(line) {
  for (const line::NodeConfig& node : line.config().nodes) {
    add_node(node, line.layout(image::Direction::inputs));
  }
}

void ImageModel::add_node(const line::NodeConfig& node, const image::Layout& layout) {
  const Loaded<pdo::DevicePdos> described = pdos_in(node.device, line_.config().canopen_fd);
  for (const pdo::Parameters& tpdo : described.value->tpdos) {
    Pdo pdo;
    pdo.synchronous = pdo::is_synchronous(tpdo.type);
    unsigned position = 0;
    std::vector<bool> used(layout.entries.size(), false);
    for (const pdo::Mapping& mapping : tpdo.mapping) {
      for (std::size_t i = 0; i < layout.entries.size(); ++i) {
        const image::Entry& entry = layout.entries[i];
        if (!used[i] && entry.node == node.id && entry.remote_pdo == tpdo.number &&
            od::Address{entry.index, entry.sub} == mapping.address) {
          used[i] = true;
          pdo.fields.push_back({.entry = i, .frame_bit = position, .bits = mapping.bits});
          break;
        }
      }
      position += mapping.bits;
    }
    pdo.bytes = (position + 7) / 8;
    pdos_[key(tpdo.cob_id.id(), tpdo.cob_id.extended())] = std::move(pdo);
  }
}

void ImageModel::before_receive(const can::Frame& frame) {
  const auto it = pdos_.find(key(frame.id, frame.extended()));
  if (it == pdos_.end() || frame.remote() || frame.length < it->second.bytes) {
    return;
  }
  Pdo& pdo = it->second;
  const unsigned exact = frame.fd() ? can::fd_length(pdo.bytes) : pdo.bytes;
  if (is_pre_operational(line_) && is_master(line_) && frame.length == exact) {
    pdo.pending = true;
    pdo.shadow = frame;
  } else if (!is_operational(line_)) {
    return;
  } else if (pdo.synchronous) {
    pdo.pending = true;
    pdo.shadow = frame;
  } else {
    pdo.has_value = true;
    pdo.value = frame;
  }
}

void ImageModel::after_call(std::span<const Event> events) {
  const bool reset = std::ranges::any_of(events, [](const Event& event) {
    const auto* const own = event.get<event::OwnState>();
    return own != nullptr && own->state == nmt::State::initialising;
  });
  const bool synced = line_.sync_count() != syncs_;
  syncs_ = line_.sync_count();
  const bool operational = is_operational(line_);
  const bool pre_operational = is_pre_operational(line_);
  const bool master = is_master(line_);
  for (auto& [id, pdo] : pdos_) {
    pdo.pending = pdo.pending && !reset;
    if (!operational) {
      pdo.pending = pdo.pending && pre_operational && master;
    } else if (pdo.pending && (synced || !pdo.synchronous)) {
      pdo.pending = false;
      pdo.has_value = true;
      pdo.value = pdo.shadow;
    }
  }
}

std::string ImageModel::compare(line::Line& line, Instant now) {
  line.snapshot(image::Direction::inputs, snapshot_, now, false);
  const image::Layout& layout = line.layout(image::Direction::inputs);
  for (const auto& [id, pdo] : pdos_) {
    for (const Field& field : pdo.fields) {
      if (!snapshot_.is_valid(field.entry)) {
        continue;
      }
      const image::Entry& entry = layout.entries[field.entry];
      if (!pdo.has_value) {
        return entry.name + " is valid although its PDO was never received";
      }
      for (unsigned i = 0; i < field.bits; ++i) {
        if (bit(snapshot_.bytes, entry.bit_offset + i) !=
            bit(pdo.value.data, field.frame_bit + i)) {
          return entry.name + " differs from the last frame of its PDO at bit " + std::to_string(i);
        }
      }
    }
  }
  return {};
}

}  // namespace linegate::plant
