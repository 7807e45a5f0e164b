// SPDX-License-Identifier: Apache-2.0
// A warning of Fast DDS 2.9.1 that states nothing wrong.
//
// Whenever a secured participant receives a submessage, AESGCMGMAC_Transform::lookup_writer() logs
// "No key material yet" for each own endpoint without a peer: 450 times a second while one client
// reads 1000 samples a second. Each one wakes the thread of the library's log and, with DDS in a
// process of its own, the thread of the gateway that reads the output of that process.
#pragma once

#include <string_view>

namespace linegate::dds::guard {

inline constexpr std::string_view kKeyWarning = "No key material yet";

// From now on the library does not log it in this process. Returns false if its call cannot be
// replaced: then it still does.
bool leave_out_key_warnings();

}  // namespace linegate::dds::guard
