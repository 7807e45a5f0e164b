// SPDX-License-Identifier: Apache-2.0
#include "stack/pdo/link.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string_view>

#include "stack/base/byte_order.h"
#include "stack/image/limits.h"
#include "stack/image/network_variables.h"
#include "stack/image/scaling.h"
#include "stack/od/objects.h"
#include "stack/pdo/mapping.h"
#include "stack/pdo/object_names.h"

namespace linegate::pdo {
namespace {

using image::Direction;

constexpr Duration kMaxEventTimer = std::chrono::milliseconds(0xFFFF);

std::uint64_t number(const od::DeviceDescription& device, od::Address address) {
  const od::VariableDescription* variable = device.find(address);
  return variable == nullptr || variable->value.size() > 8
             ? 0
             : load_le(std::span<const std::byte>(variable->value));
}

std::string identifier_text(std::uint32_t value) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string text;
  for (; text.size() < 3 || value != 0; value >>= 4U) {
    text.insert(text.begin(), kDigits[value & 0xFU]);
  }
  return text;
}

std::string node_name(const RemoteNode& node) {
  return node.name.empty() ? "node" + std::to_string(node.id) : node.name;
}

bool whole_bytes(std::uint32_t bits) {
  return bits % 8 == 0;
}

// Allocates locations in one area, PDO by PDO.
class Placement {
 public:
  // Begins a PDO with values of these lengths.
  void begin_pdo(const std::vector<Mapping>& mapping) {
    std::uint32_t alignment = 1;
    for (const Mapping& entry : mapping) {
      const std::uint32_t bytes = entry.bits / 8U;
      const bool aligned = whole_bytes(entry.bits) && (bytes == 2 || bytes == 4 || bytes == 8);
      alignment = aligned ? std::max(alignment, bytes) : alignment;
    }
    end_bits();
    align(alignment);
  }

  // Returns the first bit of the next value.
  std::uint32_t place(std::uint32_t bits) {
    if (whole_bytes(bits)) {
      end_bits();
      align(bits <= 64 ? bits / 8 : 1);
    }
    const std::uint32_t at = next_bit_;
    next_bit_ += bits;
    return at;
  }

  std::uint32_t bytes() {
    end_bits();
    return next_bit_ / 8;
  }

 private:
  void end_bits() { next_bit_ = (next_bit_ + 7) / 8 * 8; }
  void align(std::uint32_t bytes) { next_bit_ = (next_bit_ / 8 + bytes - 1) / bytes * bytes * 8; }

  std::uint32_t next_bit_ = 0;
};

// Appends fillers, which replace values beyond the network variables in the manager's mapping
// record.
void add_fillers(std::vector<Mapping>& mapping, std::uint32_t bits) {
  constexpr std::array kFillers = {od::DataType::unsigned8,  od::DataType::unsigned16,
                                   od::DataType::unsigned24, od::DataType::unsigned32,
                                   od::DataType::unsigned40, od::DataType::unsigned48,
                                   od::DataType::unsigned56, od::DataType::unsigned64};
  while (bits != 0) {
    const std::uint32_t bytes = std::min(bits / 8, 8U);
    const od::DataType filler = bytes == 0 ? od::DataType::boolean : kFillers[bytes - 1];
    const unsigned length = od::bit_size(filler);
    mapping.push_back({{static_cast<std::uint16_t>(filler), 0}, static_cast<std::uint8_t>(length)});
    bits -= length;
  }
}

class Linker {
 public:
  explicit Linker(std::span<const RemoteNode> nodes) {
    for (const RemoteNode& node : nodes) {
      nodes_.push_back(&node);
    }
    std::ranges::sort(nodes_, {}, &RemoteNode::id);
    plan_.outputs.direction = Direction::outputs;
  }

  Loaded<LinkPlan> run() {
    for (const RemoteNode* node : nodes_) {
      for (const Parameters& tpdo : node->pdos.tpdos) {
        link_tpdo(*node, tpdo);
      }
    }
    for (const RemoteNode* node : nodes_) {
      for (const Parameters& srdo : node->srdos) {
        link_srdo(*node, srdo);
      }
    }
    for (const RemoteNode* node : nodes_) {
      for (const Parameters& rpdo : node->pdos.rpdos) {
        link_rpdo(*node, rpdo);
      }
    }
    finish(plan_.inputs, plan_.rpdos.size(), inputs_);
    finish(plan_.outputs, plan_.tpdos.size(), outputs_);
    Loaded<LinkPlan> loaded;
    loaded.diagnostics = std::move(diagnostics_);
    if (!has_errors(loaded.diagnostics)) {
      loaded.value = std::move(plan_);
    }
    return loaded;
  }

 private:
  struct Owner {
    const RemoteNode* node = nullptr;
    std::uint16_t pdo = 0;
    std::size_t local = 0;  // number of the manager's PDO
  };
  using Owners = std::map<std::uint32_t, Owner>;

  static std::uint32_t key(can::CobId cob_id) {
    return cob_id.id() | (cob_id.raw & can::CobId::kExtendedBit);
  }

  void report(Severity severity, const RemoteNode& node, std::string_view kind, std::uint16_t pdo,
              const std::string& what) {
    diagnostics_.push_back(
        {severity, node.device->file, 0, 0,
         std::string(kind) + " " + std::to_string(pdo) + " of " + node_name(node) + " " + what});
  }

  static std::string text(const Owner& owner, std::string_view kind) {
    return std::string(kind) + " " + std::to_string(owner.pdo) + " of " + node_name(*owner.node);
  }

  void link_tpdo(const RemoteNode& node, const Parameters& remote) {
    const auto [it, added] = senders_.insert({key(remote.cob_id), {&node, remote.number}});
    if (!added) {
      report(Severity::error, node, "TPDO", remote.number,
             "has the COB-ID of " + text(it->second, "TPDO"));
      return;
    }
    Parameters local;
    local.cob_id = {key(remote.cob_id) | (remote.cob_id.raw & can::CobId::kNoRtrBit)};
    local.type = is_synchronous(remote.type) ? remote.type : kEventProfile;
    local.event_timer = std::min<Duration>(node.deadline, kMaxEventTimer);
    plan_.rpdos.push_back(link(node, remote, local, plan_.rpdos.size() + 1, plan_.inputs, inputs_));
  }

  void link_srdo(const RemoteNode& node, const Parameters& remote) {
    const auto number = static_cast<std::uint16_t>(remote.number - image::kFirstSrdo + 1);
    const auto [it, added] = senders_.insert({key(remote.cob_id), {&node, remote.number}});
    if (!added) {
      report(Severity::error, node, "SRDO", number,
             "has the COB-IDs of an SRDO of " + node_name(*it->second.node));
      return;
    }
    Parameters local;
    local.cob_id = remote.cob_id;
    plan_.rpdos.push_back(link(node, remote, local, plan_.rpdos.size() + 1, plan_.inputs, inputs_));
  }

  void link_rpdo(const RemoteNode& node, const Parameters& remote) {
    if (const auto it = senders_.find(key(remote.cob_id)); it != senders_.end()) {
      report(Severity::note, node, "RPDO", remote.number,
             "is linked to " + text(it->second, "TPDO") + " and not an output");
      return;
    }
    const auto [it, added] =
        receivers_.insert({key(remote.cob_id), {&node, remote.number, plan_.tpdos.size() + 1}});
    if (!added) {
      report(Severity::warning, node, "RPDO", remote.number,
             "has the COB-ID of " + text(it->second, "RPDO") + ", whose output values it gets too");
      plan_.tpdos[it->second.local - 1U].also.push_back(node.id);
      return;
    }
    Parameters local;
    local.cob_id = {key(remote.cob_id) | can::CobId::kNoRtrBit};
    local.type = is_synchronous(remote.type) ? remote.type : kEventProfile;
    local.event_timer = is_synchronous(remote.type) ? Duration{} : half(remote.event_timer);
    local.inhibit = is_synchronous(remote.type) ? Duration{} : remote.inhibit;
    plan_.tpdos.push_back(
        link(node, remote, local, plan_.tpdos.size() + 1, plan_.outputs, outputs_));
  }

  static Duration half(Duration time) {
    return std::chrono::floor<std::chrono::milliseconds>(time / 2);
  }

  LinkedPdo link(const RemoteNode& node, const Parameters& remote, Parameters local,
                 std::size_t local_number, image::Layout& layout, Placement& placement) {
    LinkedPdo pdo;
    local.number = static_cast<std::uint16_t>(local_number);
    pdo.parameters = std::move(local);
    pdo.node = node.id;
    pdo.remote_pdo = remote.number;
    placement.begin_pdo(remote.mapping);
    for (const Mapping& mapping : remote.mapping) {
      if (is_dummy(mapping)) {
        pdo.parameters.mapping.push_back(mapping);
      } else {
        const Mapping value = value_of(node, mapping);
        const std::uint32_t at = placement.place(value.bits);
        pdo.targets.push_back({pdo.mapped_bits, at, value.bits});
        add_entry(node, value, at, pdo, layout);
        add_timing(remote, layout.entries.back());
        add_fillers(pdo.parameters.mapping, std::uint32_t{mapping.bits} - value.bits);
      }
      pdo.mapped_bits = static_cast<std::uint16_t>(pdo.mapped_bits + mapping.bits);
    }
    return pdo;
  }

  // The part of the entry that is the value.
  static Mapping value_of(const RemoteNode& node, const Mapping& mapping) {
    const od::VariableDescription* variable = node.device->find(mapping.address);
    const bool lowest = variable != nullptr && is_boolean_in_a_byte(mapping, variable->type);
    return {mapping.address, lowest ? std::uint8_t{1} : mapping.bits};
  }

  const ObjectNames& names_of(const RemoteNode& node) {
    return names_.try_emplace(node.id, *node.device).first->second;
  }

  void add_entry(const RemoteNode& node, const Mapping& mapping, std::uint32_t bit_offset,
                 LinkedPdo& pdo, image::Layout& layout) {
    image::Entry entry;
    const od::VariableDescription* variable = node.device->find(mapping.address);
    entry.bit_offset = bit_offset;
    entry.bit_length = mapping.bits;
    entry.type = variable == nullptr ? od::DataType::none : variable->type;
    entry.node = node.id;
    entry.index = mapping.address.index;
    entry.sub = mapping.address.sub;
    entry.remote_pdo = pdo.remote_pdo;
    entry.local_pdo = pdo.parameters.number;
    const std::optional<od::Address> shown =
        image::variable_address(layout.direction, entry.type, bit_offset, mapping.bits);
    if (shown) {
      entry.variable_index = shown->index;
      entry.variable_sub = shown->sub;
      pdo.parameters.mapping.push_back({*shown, mapping.bits});
    } else {
      add_fillers(pdo.parameters.mapping, mapping.bits);
    }
    entry.profile = static_cast<std::uint16_t>(number(*node.device, {od::objects::kDeviceType, 0}));
    entry.product_code =
        static_cast<std::uint32_t>(number(*node.device, od::objects::kProductCode));
    if (variable != nullptr) {
      image::describe_value(*variable, entry);
    }
    entry.name = node_name(node) + "." +
                 (mapping.address == od::Address{0, 0}
                      ? "COB-ID " + identifier_text(pdo.parameters.cob_id.id()) + "h"
                      : names_of(node).of(mapping.address));
    layout.entries.push_back(std::move(entry));
  }

  static void add_timing(const Parameters& remote, image::Entry& entry) {
    entry.transmission_type = remote.number == 0 ? std::uint8_t{0} : remote.type;
    entry.inhibit = remote.inhibit;
    entry.event_timer = remote.event_timer;
  }

  void finish(image::Layout& layout, std::size_t pdos, Placement& placement) {
    image::make_names_unique(layout);
    layout.byte_size = placement.bytes();
    refuse_above(image::kMaxAreaBytes, layout.byte_size, "bytes", layout);
    refuse_above(image::kMaxEntries, layout.entries.size(), "entries", layout);
    refuse_above(image::kMaxPdos, pdos, "PDOs", layout);
    layout.id = image::layout_id(layout);
  }

  void refuse_above(std::size_t most, std::size_t number, std::string_view unit,
                    const image::Layout& layout) {
    if (number > most) {
      diagnostics_.push_back({Severity::error,
                              {},
                              0,
                              0,
                              "the " + std::string(image::name(layout.direction)) + " need " +
                                  std::to_string(number) + ' ' + std::string(unit) +
                                  ", more than " + std::to_string(most)});
    }
  }

  std::vector<const RemoteNode*> nodes_;
  std::map<std::uint8_t, ObjectNames> names_;  // by node-ID
  LinkPlan plan_;
  std::vector<Diagnostic> diagnostics_;
  Placement inputs_;
  Placement outputs_;
  Owners senders_;
  Owners receivers_;
};

}  // namespace

Loaded<LinkPlan> plan_links(std::span<const RemoteNode> nodes) {
  return Linker(nodes).run();
}

}  // namespace linegate::pdo
