// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/pdo_follower.h"

#include <algorithm>
#include <optional>
#include <span>

#include "bridges/console/emcy_identifier.h"
#include "bridges/console/explain.h"
#include "bridges/console/value_text.h"
#include "stack/base/byte_order.h"
#include "stack/can/frame.h"
#include "stack/od/objects.h"

namespace linegate::console {
namespace {

using observer::KnownPdo;

std::string pdo_name(const KnownPdo& pdo) {
  return (pdo.kind == pdo::PdoKind::tpdo ? "TPDO " : "RPDO ") +
         std::to_string(pdo.parameters.number);
}

const KnownPdo* find_pdo(const std::vector<KnownPdo>& pdos, const KnownPdo& wanted) {
  const auto found = std::find_if(pdos.begin(), pdos.end(), [&](const KnownPdo& pdo) {
    return pdo.kind == wanted.kind && pdo.parameters.number == wanted.parameters.number;
  });
  return found == pdos.end() ? nullptr : &*found;
}

// Compares identifier and contents of the PDOs.
bool is_same(const KnownPdo& left, const KnownPdo& right) {
  return left.parameters.cob_id.raw == right.parameters.cob_id.raw &&
         left.parameters.mpdo == right.parameters.mpdo &&
         std::equal(
             left.parameters.mapping.begin(), left.parameters.mapping.end(),
             right.parameters.mapping.begin(), right.parameters.mapping.end(),
             [](const pdo::Mapping& a, const pdo::Mapping& b) { return a.raw() == b.raw(); });
}

std::uint32_t number_at(const od::DeviceDescription& device, od::Address address) {
  const od::VariableDescription* const found = device.find(address);
  return found == nullptr || found->value.size() > 4
             ? 0
             : static_cast<std::uint32_t>(load_le(std::span<const std::byte>(found->value)));
}

// A PDO from its records, whether or not the device file has the mapped objects. Nothing if it is
// not valid, or if its mapping is not fully known.
std::optional<KnownPdo> read_record(const od::DeviceDescription& device, pdo::PdoKind kind,
                                    std::uint16_t number) {
  const auto communication = static_cast<std::uint16_t>(communication_base(kind) + number - 1);
  const auto mapping = static_cast<std::uint16_t>(mapping_base(kind) + number - 1);
  const auto* const cob_id = device.find({communication, 1});
  KnownPdo out{.kind = kind};
  out.parameters.number = number;
  out.parameters.cob_id.raw = number_at(device, {communication, 1});
  const std::uint32_t count = number_at(device, {mapping, 0});
  if (cob_id == nullptr || cob_id->value.size() != 4 || !out.parameters.cob_id.valid()) {
    return std::nullopt;
  }
  if (count == pdo::kSourceMode || count == pdo::kDestinationMode) {
    out.parameters.mpdo =
        count == pdo::kSourceMode ? pdo::MpdoMode::source : pdo::MpdoMode::destination;
    return out;
  }
  if (count == 0 || count > pdo::kMaxMapped) {
    return std::nullopt;
  }
  unsigned bits = 0;
  for (std::uint8_t sub = 1; sub <= count; ++sub) {
    const auto entry = pdo::Mapping::from_raw(number_at(device, {mapping, sub}));
    bits += entry.bits;
    if (entry.bits == 0 || bits > 8 * can::kMaxFdData) {
      return std::nullopt;
    }
    out.parameters.mapping.push_back(entry);
  }
  return out;
}

std::vector<KnownPdo> known_ones(const observer::PdoKnowledge& knowledge) {
  std::vector<KnownPdo> out = knowledge.pdos();
  std::erase_if(out, [](const KnownPdo& pdo) { return !pdo.complete; });
  for (const od::ObjectDescription& object : knowledge.device().objects) {
    for (const auto kind : {pdo::PdoKind::tpdo, pdo::PdoKind::rpdo}) {
      const auto number = static_cast<std::uint16_t>(object.index - communication_base(kind) + 1);
      if (object.index < communication_base(kind) || number > pdo::kMaxPdo ||
          !knowledge.is_known(kind, number)) {
        continue;
      }
      const auto read = read_record(knowledge.device(), kind, number);
      if (read && find_pdo(out, *read) == nullptr) {
        out.push_back(*read);
      }
    }
  }
  return out;
}

// Whether the COB-ID or the mapping of the PDO may be another one.
bool is_doubted(const std::set<od::Address>& doubted, const KnownPdo& pdo) {
  const auto record = static_cast<std::uint16_t>(pdo.parameters.number - 1);
  const auto communication = static_cast<std::uint16_t>(communication_base(pdo.kind) + record);
  const auto mapping = static_cast<std::uint16_t>(mapping_base(pdo.kind) + record);
  return std::any_of(doubted.begin(), doubted.end(), [&](od::Address address) {
    return address.index == mapping || address == od::Address{communication, 1};
  });
}

}  // namespace

PdoFollower::PdoFollower(const od::DeviceDescription& device, std::uint8_t node)
    : knowledge_(device, node), pdos_(known_ones(knowledge_)) {
}

std::string PdoFollower::follow(const observer::Transfer& transfer) {
  using Seen = observer::PdoKnowledge::Seen;
  if (transfer.address.index == od::objects::kStoreParameters && transfer.download) {
    stored_doubted_ = doubted_;
  }
  const bool certain = doubted_.erase(transfer.address) != 0;
  if (certain && stores_by_itself(knowledge_.device())) {
    stored_doubted_ = doubted_;
  }
  if (!knowledge_.learn(transfer.address, transfer.kept(),
                        transfer.download ? Seen::written : Seen::read) &&
      !certain) {
    return {};
  }
  return update();
}

std::string PdoFollower::doubt(od::Address address) {
  if (!od::objects::is_pdo_record(address.index)) {
    return {};
  }
  doubted_.insert(address);
  if (stores_by_itself(knowledge_.device())) {
    stored_doubted_ = doubted_;
  }
  return update();
}

std::string PdoFollower::reset() {
  before_reset_ = pdos_;
  knowledge_.reset();
  doubted_ = stored_doubted_;
  return update();
}

std::string PdoFollower::start() {
  before_reset_.reset();
  return update();
}

std::string PdoFollower::boot_up() {
  before_reset_.reset();
  knowledge_.boot_up();
  doubted_ = stored_doubted_;
  return update();
}

std::vector<KnownPdo> PdoFollower::present() const {
  std::vector<KnownPdo> out = known_ones(knowledge_);
  std::erase_if(out, [this](const KnownPdo& pdo) { return is_doubted(doubted_, pdo); });
  return out;
}

std::string PdoFollower::update() {
  std::vector<KnownPdo> before = present();
  if (before_reset_) {
    std::erase_if(before, [this](const KnownPdo& pdo) {
      const KnownPdo* const old = find_pdo(*before_reset_, pdo);
      return old == nullptr || !is_same(*old, pdo);
    });
  }
  before.swap(pdos_);
  return changes(before);
}

bool PdoFollower::is_known(const KnownPdo& pdo) const {
  const std::uint16_t number = pdo.parameters.number;
  const auto record = static_cast<std::uint16_t>(communication_base(pdo.kind) + number - 1);
  const od::VariableDescription* const cob_id = knowledge_.device().find({record, 1});
  return !before_reset_ && !is_doubted(doubted_, pdo) && knowledge_.is_known(pdo.kind, number) &&
         cob_id != nullptr && cob_id->value.size() == sizeof(std::uint32_t);
}

std::string PdoFollower::changes(const std::vector<KnownPdo>& before) const {
  std::string out;
  const auto add = [&out](const std::string& text) { out += (out.empty() ? "" : "; ") + text; };
  for (const KnownPdo& old : before) {
    if (find_pdo(pdos_, old) == nullptr) {
      add(pdo_name(old) + (is_known(old) ? " is not in use now" : " is not known now"));
    }
  }
  for (const KnownPdo& pdo : pdos_) {
    const KnownPdo* const old = find_pdo(before, pdo);
    if (old != nullptr && is_same(*old, pdo)) {
      continue;
    }
    std::string objects = pdo.parameters.mpdo == pdo::MpdoMode::none ? "" : " multiplexed";
    for (const pdo::Mapping& mapping : pdo.parameters.mapping) {
      objects +=
          (objects.empty() ? " " : ", ") + object_text(&knowledge_.device(), mapping.address);
    }
    add(pdo_name(pdo) + " is now on " +
        hex_digits(pdo.parameters.cob_id.id(), pdo.parameters.cob_id.extended() ? 8 : 3) +
        "h:" + objects);
  }
  return out;
}

}  // namespace linegate::console
