// SPDX-License-Identifier: Apache-2.0
// The certificate in a message of the authentication handshake (DDS-Security 1.1 9.3.2.5).
#pragma once

#include <optional>

#include "bridges/dds/guard/wire.h"

namespace linegate::dds::guard {

// The octets from the begin of the certificate in PEM to the end of the message; empty if it has
// none. Nothing if it has more than one object in PEM, or another one: the library would perhaps
// read another certificate than the one that is returned.
std::optional<Octets> certificate_in(Octets message);

}  // namespace linegate::dds::guard
