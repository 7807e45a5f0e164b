// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/configuration_objects.h"

#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/manager/network_list.h"
#include "stack/manager/plan.h"
#include "stack/od/objects.h"

namespace linegate::manager {
namespace {

constexpr std::uint16_t kHooked[] = {od::objects::kConciseDcf, od::objects::kConfigureSlave};

std::vector<std::byte> little_endian(std::uint32_t value) {
  std::vector<std::byte> out(sizeof value);
  store_le(std::span(out), value);
  return out;
}

}  // namespace

std::vector<od::ObjectDescription> configuration_objects(std::span<const NodePlan> plans) {
  using od::Access;
  std::vector<od::ObjectDescription> out{
      node_array(od::objects::kConciseDcf, Access::rw),
      node_array(od::objects::kConfigureSlave, Access::wo, kAllNodes),
      node_array(od::objects::kExpectedDate, Access::rw),
      node_array(od::objects::kExpectedTime, Access::rw),
  };
  for (const NodePlan& plan : plans) {
    out[0].variables[plan.id].value = write_concise_dcf(plan.writes);
    out[2].variables[plan.id].value = little_endian(plan.expected.date);
    out[3].variables[plan.id].value = little_endian(plan.expected.time);
  }
  return out;
}

ConfigurationObjects::ConfigurationObjects(od::Dictionary& dictionary,
                                           std::span<const NodePlan> plans)
    : dictionary_(dictionary) {
  for (const NodePlan& plan : plans) {
    extents_[plan.id] = {.restore = plan.restore, .store = plan.store};
    pdos_[plan.id] = plan.pdos;
  }
  for (const std::uint16_t index : kHooked) {
    LINEGATE_ASSERT(dictionary_.set_hook(index, this).ok(), "the object exists");
  }
}

ConfigurationObjects::~ConfigurationObjects() {
  for (const std::uint16_t index : kHooked) {
    LINEGATE_ASSERT(dictionary_.set_hook(index, nullptr).ok(), "the object exists");
  }
}

ConfigurationOrder ConfigurationObjects::order(std::uint8_t node) const {
  const auto number = [&](std::uint16_t index) {
    return static_cast<std::uint32_t>(dictionary_.number({index, node}).value_or(0));
  };
  return {.node = node,
          .writes = writes(node),
          .expected = {.date = number(od::objects::kExpectedDate),
                       .time = number(od::objects::kExpectedTime)},
          .restore = restore(node),
          .store = extents_[node].store,
          .pdos = pdos_[node]};
}

// Bit 7 of 1F81h selects whether, 1F8Ah which sub-index of 1011h.
std::uint8_t ConfigurationObjects::restore(std::uint8_t node) const {
  constexpr std::uint64_t kRestoreBit = 1U << 7U;
  const auto assignment = dictionary_.number({od::objects::kSlaveAssignment, node});
  if (!assignment) {
    return extents_[node].restore;
  }
  const bool wanted = (*assignment & kRestoreBit) != 0;
  return wanted ? static_cast<std::uint8_t>(
                      dictionary_.number({od::objects::kRestoreConfiguration, node}).value_or(0))
                : std::uint8_t{0};
}

bool ConfigurationObjects::has_configuration(std::uint8_t node) const {
  const auto domain = dictionary_.find({od::objects::kConciseDcf, node});
  return domain && domain->size != 0;
}

std::vector<ObjectWrite> ConfigurationObjects::writes(std::uint8_t node) const {
  const auto domain = dictionary_.find({od::objects::kConciseDcf, node});
  if (!domain) {
    return {};
  }
  auto read = read_concise_dcf(domain->bytes());
  return read ? *std::move(read) : std::vector<ObjectWrite>{};
}

AbortCode ConfigurationObjects::check_write(od::Address address, std::span<const std::byte> value) {
  if (address.index == od::objects::kConfigureSlave) {
    return check_request(address.sub, value);
  }
  return read_concise_dcf(value).ok() ? AbortCode::none : AbortCode::length_mismatch;
}

AbortCode ConfigurationObjects::check_request(std::uint8_t sub,
                                              std::span<const std::byte> value) const {
  if (load_le(value) != kConf) {
    return AbortCode::local_control;
  }
  if (sub != kAllNodes) {
    return may_configure(sub);
  }
  AbortCode why = AbortCode::invalid_value;
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    const AbortCode answer = may_configure(node);
    if (answer == AbortCode::none) {
      return answer;
    }
    why = answer == AbortCode::invalid_value ? why : answer;
  }
  return why;
}

AbortCode ConfigurationObjects::may_configure(std::uint8_t node) const {
  const AbortCode why = may_configure_ != nullptr ? may_configure_(node) : AbortCode::local_control;
  return why == AbortCode::none && !has_configuration(node) ? AbortCode::no_data : why;
}

void ConfigurationObjects::written(od::Address address) {
  if (address.index == od::objects::kConfigureSlave) {
    for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
      const bool meant = address.sub == kAllNodes || address.sub == node;
      if (meant && may_configure(node) == AbortCode::none) {
        requests_.set(node);
      }
    }
    return;
  }
  const std::vector<ObjectWrite> now = writes(address.sub);
  ConfigurationDate expected = date_of(now);
  if (!expected.known() && extents_[address.sub].store != 0 && !now.empty()) {
    expected = fingerprint_of(now);
  }
  dictionary_.set({od::objects::kExpectedDate, address.sub}, expected.date);
  dictionary_.set({od::objects::kExpectedTime, address.sub}, expected.time);
}

}  // namespace linegate::manager
