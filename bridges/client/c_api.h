// SPDX-License-Identifier: Apache-2.0
// For tests: a client in C with a link of their own.
#pragma once

#include "bridges/client/client.h"
#include "bridges/client/linegate.h"

namespace linegate::client {

// As linegate_connect().
linegate_client* adopt(Client client);

}  // namespace linegate::client
