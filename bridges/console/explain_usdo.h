// SPDX-License-Identifier: Apache-2.0
// Explains USDO frames of CANopen FD in words (stack/usdo/protocol.h).
#pragma once

#include <optional>
#include <string>

#include "stack/can/frame.h"
#include "stack/od/description.h"

namespace linegate::console {

// device: object dictionary of the server, nullptr if unknown. object: of the session, for frames
// that do not name it; nothing if it is not known. Precondition: usdo::well_formed(frame) and
// usdo::has_fields(frame).
std::string explain_usdo(const can::Frame& frame, const od::DeviceDescription* device,
                         std::optional<od::Address> object);

}  // namespace linegate::console
