// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/request_model.h"

#include <utility>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"

namespace linegate::plant {
namespace {

bool is_on_request(std::uint8_t type) {
  return type == pdo::kRtrOnSync || type == pdo::kRtrEvent;
}

std::uint64_t mask_of(unsigned bits) {
  return bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
}

// In the form of a frame.
std::uint64_t values_of(const RequestModel::Producer& producer, const pdo::Parameters& pdo) {
  std::uint64_t out = 0;
  unsigned position = 0;
  for (const pdo::Mapping& mapping : pdo.mapping) {
    out |= (producer.value(mapping.address) & mask_of(mapping.bits)) << position;
    position += mapping.bits;
  }
  return out;
}

bool has_cob_id(const can::Frame& frame, const can::CobId& cob_id) {
  return frame.id == cob_id.id() && frame.extended() == cob_id.extended();
}

bool is_request(const can::Frame& frame, const pdo::Parameters& pdo) {
  return frame.remote() && has_cob_id(frame, pdo.cob_id);
}

bool is_sync(const can::Frame& frame) {
  return frame.id == can::kSyncId && !frame.extended() && !frame.remote();
}

}  // namespace

RequestModel::RequestModel(const od::DeviceDescription& file) : node_(file.node_id) {
  const Loaded<pdo::DevicePdos> described = pdo::describe_pdos(file);
  if (!described.ok()) {
    return;
  }
  for (const pdo::Parameters& tpdo : described.value->tpdos) {
    if (is_on_request(tpdo.type)) {
      pdos_.push_back({.file = tpdo});
    }
  }
}

void RequestModel::forget(Pdo& pdo) {
  pdo.requested = false;
  pdo.at_sync.reset();
  pdo.at_doubtful.reset();
}

void RequestModel::before_receive(const Producer& producer, const can::Frame& frame) {
  for (Pdo& pdo : pdos_) {
    if (!producer.is_operational || !producer.is_configured(pdo.file)) {
      forget(pdo);
    } else if (is_request(frame, pdo.file)) {
      pdo.requested = true;
      pdo.at_request.before = values_of(producer, pdo.file);
    } else if (is_sync(frame) && frame.length == 0) {
      pdo.at_sync = Sample{values_of(producer, pdo.file), 0};
      pdo.at_doubtful.reset();
    } else if (is_sync(frame)) {
      pdo.at_doubtful = Sample{values_of(producer, pdo.file), 0};
    }
  }
}

void RequestModel::after_receive(const Producer& producer, const can::Frame& frame) {
  for (Pdo& pdo : pdos_) {
    std::optional<Sample>& at_sync = frame.length == 0 ? pdo.at_sync : pdo.at_doubtful;
    if (is_request(frame, pdo.file)) {
      pdo.at_request.after = values_of(producer, pdo.file);
    } else if (is_sync(frame) && at_sync) {
      at_sync->after = values_of(producer, pdo.file);
    }
  }
}

const RequestModel::Sample& RequestModel::newest(const Pdo& pdo) {
  return pdo.file.type == pdo::kRtrOnSync && pdo.at_sync ? *pdo.at_sync : pdo.at_request;
}

bool RequestModel::is_newest(const Pdo& pdo, std::uint64_t value) {
  const auto is_one = [value](const Sample& sample) {
    return value == sample.before || value == sample.after;
  };
  const bool doubtful = pdo.file.type == pdo::kRtrOnSync && pdo.at_doubtful;
  return is_one(newest(pdo)) || (doubtful && is_one(*pdo.at_doubtful));
}

std::string RequestModel::submitted(const Producer& producer, const can::Frame& frame) {
  for (Pdo& pdo : pdos_) {
    if (frame.remote() || !has_cob_id(frame, pdo.file.cob_id) ||
        !producer.is_configured(pdo.file)) {
      continue;
    }
    if (!std::exchange(pdo.requested, false)) {
      return name(pdo) + " was not requested";
    }
    unsigned bits = 0;
    for (const pdo::Mapping& mapping : pdo.file.mapping) {
      bits += mapping.bits;
    }
    const std::uint64_t value = load_le<std::uint64_t>(frame.data.data()) & mask_of(bits);
    if (!is_newest(pdo, value)) {
      return name(pdo) + " has " + std::to_string(value) + " instead of the newest " +
             std::to_string(newest(pdo).after);
    }
    ++answered_;
  }
  return {};
}

std::string RequestModel::after_turn(const Producer& producer, bool has_room) {
  for (Pdo& pdo : pdos_) {
    if (!producer.is_operational || !producer.is_configured(pdo.file)) {
      forget(pdo);
    } else if (pdo.requested && has_room) {
      return name(pdo) + " was requested and is not submitted";
    }
  }
  return {};
}

std::string RequestModel::name(const Pdo& pdo) const {
  return "TPDO " + std::to_string(pdo.file.number) + " of node " + std::to_string(node_) +
         " with transmission type " + std::to_string(pdo.file.type);
}

}  // namespace linegate::plant
