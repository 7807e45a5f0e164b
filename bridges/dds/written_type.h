// SPDX-License-Identifier: Apache-2.0
// The type support of a writer.
#pragma once

#include <fastdds/dds/topic/TypeSupport.hpp>

#include "bridges/dds/keyed_type.h"
#include "bridges/dds/payload_handover.h"

namespace linegate::dds {

template <class PubSubType>
class WrittenType : public KeyedType<PubSubType> {
 public:
  bool serialize(void* sample, eprosima::fastrtps::rtps::SerializedPayload_t* payload) override {
    payload_is_free(payload->data);
    return PubSubType::serialize(sample, payload);
  }
};

}  // namespace linegate::dds
