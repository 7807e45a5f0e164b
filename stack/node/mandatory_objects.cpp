// SPDX-License-Identifier: Apache-2.0
#include "stack/base/assert.h"
#include "stack/can/cob_id.h"
#include "stack/node/impl.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"

namespace linegate::node {
namespace {

void add_missing(od::Dictionary& dictionary, const od::ObjectDescription& object) {
  if (!dictionary.has_object(object.index)) {
    LINEGATE_ASSERT(dictionary.add(object).ok(), "the description makes sense");
  }
}

}  // namespace

void add_mandatory_objects(od::Dictionary& dictionary, std::uint8_t node_id) {
  using enum od::Access;
  add_missing(dictionary, od::catalogued_variable(od::objects::kDeviceType, ro, 0));
  add_missing(dictionary, od::catalogued_variable(od::objects::kErrorRegister, ro, 0));
  add_missing(dictionary,
              od::catalogued_variable(od::objects::kEmcyCobId, rw, can::kEmcyBase + node_id));
  add_missing(dictionary, od::catalogued_variable(od::objects::kProducerHeartbeatTime, rw, 0));
  add_missing(dictionary, od::identity_object());
}

}  // namespace linegate::node
