// SPDX-License-Identifier: Apache-2.0
#include "stack/diagnosis/objects.h"

#include <span>
#include <string>
#include <utility>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"

namespace linegate::diagnosis {
namespace {

using od::Access;
using od::DataType;
using od::ObjectType;

constexpr std::uint8_t kAllNodes = 128;  // sub-index of 1F82h
constexpr std::uint8_t kLists = 7;
constexpr std::uint8_t kClasses = static_cast<std::uint8_t>(kEmcyClasses.size());

od::VariableDescription read_only(std::uint8_t sub, std::string name, DataType type,
                                  std::uint64_t value = 0) {
  return od::number_variable(sub, std::move(name), type, Access::ro, value);
}

od::ObjectDescription count_of(std::uint16_t index, std::string name) {
  od::ObjectDescription out{.index = index, .name = name, .type = ObjectType::variable};
  out.variables.push_back(read_only(0, std::move(name), DataType::unsigned8));
  return out;
}

od::ObjectDescription entries(std::uint16_t index, const std::string& name, DataType type,
                              std::uint8_t count) {
  od::ObjectDescription out{.index = index, .name = name, .type = ObjectType::array};
  out.variables.push_back(read_only(0, "Number of entries", DataType::unsigned8, count));
  for (unsigned sub = 1; sub <= count; ++sub) {
    out.variables.push_back(
        read_only(static_cast<std::uint8_t>(sub), name + ' ' + std::to_string(sub), type));
  }
  return out;
}

od::ObjectDescription status() {
  od::ObjectDescription out{.index = od::objects::kManagerStatus,
                            .name = "Status of the CANopen manager",
                            .type = ObjectType::record};
  out.variables = {read_only(0, "Number of entries", DataType::unsigned8, 3),
                   read_only(1, "Event indication", DataType::unsigned16),
                   read_only(2, "State", DataType::unsigned16),
                   read_only(3, "Communication state", DataType::unsigned8)};
  return out;
}

od::ObjectDescription task_times() {
  od::ObjectDescription out{.index = od::objects::kTaskTimes,
                            .name = "Task time configuration",
                            .type = ObjectType::record};
  out.variables = {read_only(0, "Number of entries", DataType::unsigned8, 3),
                   read_only(1, "Cycle of the main task in ms", DataType::unsigned8, 0),
                   read_only(2, "Longest time for a receive queue in ms", DataType::unsigned8, 0),
                   read_only(3, "Processor time in percent", DataType::unsigned8, 100)};
  return out;
}

constexpr const char* kListNames[kLists] = {
    "Assigned slaves", "Configured slaves",      "Fault slaves",    "Operational slaves",
    "Stopped slaves",  "Pre-operational slaves", "Emergency slaves"};
constexpr const char* kClassNames[kClasses] = {
    "Generic error count",        "Device hardware error count", "Device software error count",
    "Communication error count",  "Protocol error count",        "External error count",
    "Device-specific error count"};

const NodeList& list(const NodeLists& lists, std::size_t number) {
  const NodeList* const all[kLists] = {
      &lists.assigned, &lists.configured,      &lists.fault,    &lists.operational,
      &lists.stopped,  &lists.pre_operational, &lists.emergency};
  return *all[number];
}

}  // namespace

Result<void> add_objects(od::Dictionary& dictionary) {
  std::vector<od::ObjectDescription> all{
      status(), task_times(),
      entries(od::objects::kEmcysOfNodes, "Node error count", DataType::unsigned8, can::kMaxNodeId),
      entries(od::objects::kEmcyHistory, "Emergency history", DataType::domain, can::kMaxNodeId)};
  for (std::uint8_t i = 0; i < kLists; ++i) {
    all.push_back(entries(static_cast<std::uint16_t>(od::objects::kNodeLists + i), kListNames[i],
                          DataType::unsigned32, NodeList::kWords));
  }
  for (std::uint8_t i = 0; i < kClasses; ++i) {
    all.push_back(
        count_of(static_cast<std::uint16_t>(od::objects::kEmcysOfClasses + i), kClassNames[i]));
  }
  for (const od::ObjectDescription& object : all) {
    if (const auto added = dictionary.add(object); !added) {
      return added;
    }
  }
  return {};
}

Objects::Objects(od::Dictionary& dictionary, Diagnosis& diagnosis, std::uint8_t own_node)
    : dictionary_(dictionary), diagnosis_(diagnosis), own_node_(own_node) {
  set_hooks(this);
  (void)dictionary_.add_hook(od::objects::kRequestNmt, *this).ok();  // a device has no 1F82h
}

Objects::~Objects() {
  set_hooks(nullptr);
  dictionary_.remove_hook(od::objects::kRequestNmt, *this);
}

void Objects::set_hooks(od::Hook* hook) {
  const auto set = [&](std::uint16_t first, unsigned count) {
    for (unsigned i = 0; i < count; ++i) {
      LINEGATE_ASSERT(dictionary_.set_hook(static_cast<std::uint16_t>(first + i), hook).ok(),
                      "the object exists");
    }
  };
  set(od::objects::kManagerStatus, 1);
  set(od::objects::kNodeLists, kLists);
  set(od::objects::kEmcysOfNodes, 1);
  set(od::objects::kEmcysOfClasses, kClasses);
  set(od::objects::kEmcyHistory, 1);
}

void Objects::written(od::Address address) {
  if (address.index == od::objects::kRequestNmt) {
    diagnosis_.requested(address.sub == kAllNodes ? std::uint8_t{0} : address.sub);
  }
}

AbortCode Objects::before_read(od::Address address, const od::Variable& variable) {
  if (address.index == od::objects::kRequestNmt) {
    return AbortCode::none;
  }
  const bool counts_entries = address.sub == 0 && (address.index < od::objects::kEmcysOfClasses ||
                                                   address.index == od::objects::kEmcyHistory);
  if (counts_entries) {
    return AbortCode::none;
  }
  if (address.index == od::objects::kEmcyHistory) {
    if (address.sub == own_node_) {
      return AbortCode::local_control;
    }
    (void)dictionary_.restore(address, diagnosis_.emcys().history(address.sub));
    return AbortCode::none;
  }
  store_le(std::span(variable.data, variable.size), number(address));
  return AbortCode::none;
}

std::uint64_t Objects::number(od::Address address) const {
  if (address.index == od::objects::kManagerStatus) {
    const std::uint8_t communication = diagnosis_.communication();
    switch (address.sub) {
      case 1:
        return diagnosis_.events();
      case 2:
        return diagnosis_.network_state() | static_cast<std::uint64_t>(communication) << 8U;
      default:
        return communication;
    }
  }
  if (address.index == od::objects::kEmcysOfNodes) {
    return diagnosis_.emcys().count(address.sub);
  }
  if (address.index >= od::objects::kEmcysOfClasses) {
    return diagnosis_.emcys().of_class(address.index - od::objects::kEmcysOfClasses);
  }
  return list(diagnosis_.lists(), address.index - od::objects::kNodeLists).word(address.sub - 1U);
}

}  // namespace linegate::diagnosis
