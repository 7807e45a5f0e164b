// SPDX-License-Identifier: Apache-2.0
#include "stack/scan/survey.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/od/objects.h"

namespace linegate::scan {
namespace {

// Records of each kind; the mapping record follows at this distance
constexpr std::uint16_t kRecords = 0x200;
constexpr od::Address kIdentity{od::objects::kIdentity, 0};
constexpr od::Address kInterruptEnable{od::objects::cia401::kAnalogueInterrupts, 0};
constexpr std::uint16_t kModules = 401;  // device profile of 1000h
constexpr std::uint64_t kMostIdentity = 4;
constexpr std::uint64_t kMostCommunication = 6;
constexpr std::uint64_t kMostMapped = 64;
constexpr std::uint8_t kReserved = 4;  // sub-index of PDO communication records that no record has

constexpr std::array<od::Address, 12> kHead{{{od::objects::kDeviceType, 0},
                                             {od::objects::kSyncCobId, 0},
                                             {od::objects::kSyncPeriod, 0},
                                             {od::objects::kDeviceName, 0},
                                             {od::objects::kHardwareVersion, 0},
                                             {od::objects::kSoftwareVersion, 0},
                                             {od::objects::kGuardTime, 0},
                                             {od::objects::kLifeTimeFactor, 0},
                                             {od::objects::kEmcyCobId, 0},
                                             {od::objects::kProducerHeartbeatTime, 0},
                                             kInterruptEnable,
                                             kIdentity}};

}  // namespace

const std::vector<std::byte>* ScannedNode::find(od::Address address) const {
  const auto at = std::ranges::find(values, address, &manager::ObjectWrite::address);
  return at == values.end() ? nullptr : &at->data;
}

std::optional<std::uint64_t> ScannedNode::number(od::Address address) const {
  const std::vector<std::byte>* const data = find(address);
  if (data == nullptr || data->empty() || data->size() > sizeof(std::uint64_t)) {
    return std::nullopt;
  }
  return load_le(std::span<const std::byte>(*data));
}

void Survey::take(AbortCode abort, std::vector<std::byte> data) {
  if (!wanted_) {
    return;
  }
  const od::Address address = *wanted_;
  if (abort == AbortCode::timeout) {
    give_up(abort);
    return;
  }
  // A node that answers is present, even if it refuses 1000h.
  present_ = true;
  if (abort == AbortCode::none) {
    node_.values.push_back({address, std::move(data)});
  }
  advance(abort == AbortCode::none ? node_.number(address) : std::nullopt);
  if (!wanted_) {
    std::ranges::sort(node_.values, {}, &manager::ObjectWrite::address);
  }
}

void Survey::give_up(AbortCode why) {
  node_.end = why;
  wanted_.reset();
  part_ = Part::done;
  std::ranges::sort(node_.values, {}, &manager::ObjectWrite::address);
}

void Survey::advance(std::optional<std::uint64_t> value) {
  switch (part_) {
    case Part::head:
      next_head(value);
      return;
    case Part::identity:
      next_identity(value);
      return;
    case Part::communication:
      next_communication(value);
      return;
    case Part::mapping:
      next_mapping(value);
      return;
    case Part::done:
      wanted_.reset();
      return;
  }
}

void Survey::ask(Part part, od::Address address) {
  part_ = part;
  wanted_ = address;
}

void Survey::next_head(std::optional<std::uint64_t> value) {
  if (kHead[head_] == kIdentity) {
    entries_ = std::min(value.value_or(0), kMostIdentity);
    if (entries_ > 0) {
      ask(Part::identity, {kIdentity.index, 1});
    } else {
      begin_record(od::objects::kRpdoCommunication);
    }
    return;
  }
  ++head_;
  LINEGATE_ASSERT(head_ < kHead.size(), "the identity is the last of the head");
  const bool has_modules =
      (node_.number({od::objects::kDeviceType, 0}).value_or(0) & 0xFFFFU) == kModules;
  if (kHead[head_] == kInterruptEnable && !has_modules) {
    ++head_;
  }
  ask(Part::head, kHead[head_]);
}

void Survey::next_identity(std::optional<std::uint64_t> /*value*/) {
  if (wanted_->sub < entries_) {
    ask(Part::identity, {kIdentity.index, static_cast<std::uint8_t>(wanted_->sub + 1)});
  } else {
    begin_record(od::objects::kRpdoCommunication);
  }
}

void Survey::begin_record(std::uint16_t index) {
  record_ = index;
  ask(Part::communication, {index, 0});
}

void Survey::end_record() {
  const auto next = static_cast<std::uint16_t>(record_ + 1);
  if (next < od::objects::kRpdoCommunication + kRecords ||
      (next > od::objects::kTpdoCommunication &&
       next < od::objects::kTpdoCommunication + kRecords)) {
    begin_record(next);
  } else if (next == od::objects::kRpdoCommunication + kRecords) {
    begin_record(od::objects::kTpdoCommunication);
  } else {
    part_ = Part::done;
    wanted_.reset();
  }
}

void Survey::next_communication(std::optional<std::uint64_t> value) {
  const std::uint8_t sub = wanted_->sub;
  if (sub == 0) {
    if (!value) {
      end_record();
      return;
    }
    entries_ = std::min(*value, kMostCommunication);
  }
  const auto next = static_cast<std::uint8_t>(sub + 1 == kReserved ? sub + 2 : sub + 1);
  if (next <= entries_) {
    ask(Part::communication, {record_, next});
  } else {
    ask(Part::mapping, {static_cast<std::uint16_t>(record_ + kRecords), 0});
  }
}

void Survey::next_mapping(std::optional<std::uint64_t> value) {
  if (wanted_->sub == 0) {
    // 254 and 255 mark MPDOs, which have one mapped object, or a list in another object.
    entries_ = value.value_or(0) <= kMostMapped ? value.value_or(0) : 0;
  }
  if (wanted_->sub < entries_) {
    ask(Part::mapping, {wanted_->index, static_cast<std::uint8_t>(wanted_->sub + 1)});
  } else {
    end_record();
  }
}

}  // namespace linegate::scan
