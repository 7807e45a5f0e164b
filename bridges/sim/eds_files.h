// SPDX-License-Identifier: Apache-2.0
// The EDS files of this folder, built into the library.
#pragma once

#include <string_view>

namespace linegate::sim {

extern const std::string_view kDigitalIoEds;
extern const std::string_view kAnalogIoEds;
extern const std::string_view kEncoderEds;
extern const std::string_view kDriveEds;
extern const std::string_view kFdIoEds;

}  // namespace linegate::sim
