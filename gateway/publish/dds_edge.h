// SPDX-License-Identifier: Apache-2.0
// The edge that publishes over DDS, and what else the gateway needs of bridges/dds. dds_edge.cpp is
// the only file of the gateway that includes that bridge, besides cli/remote_client.cpp, which is a
// subscriber.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/config/plant.h"
#include "gateway/publish/data_edge.h"
#include "stack/base/diagnostic.h"

namespace linegate::gateway {

// incarnation: random per start, not 0. Without a value, a diagnostic says why.
Loaded<std::unique_ptr<DataEdge>> make_dds_edge(const config::Plant& plant,
                                                std::uint64_t incarnation);

// What makes a file of QoS profiles unusable (errors) or dangerous (warnings). An empty name is the
// installed file, or the copy built in. Opens no socket.
std::vector<Diagnostic> check_dds_profiles(const std::string& file);
// Where an empty name leads: a path, or "(built-in ...)".
std::string dds_profiles_in_use(const std::string& file);

// While it lives, `log` receives the warnings and errors of the DDS library, from its threads: only
// hand the text on. Afterwards, and with an empty function, the library is silent. One at a time.
class DdsLibraryLog {
 public:
  explicit DdsLibraryLog(std::function<void(Severity, std::string_view text)> log);
  ~DdsLibraryLog();
  DdsLibraryLog(const DdsLibraryLog&) = delete;
  DdsLibraryLog& operator=(const DdsLibraryLog&) = delete;
};

}  // namespace linegate::gateway
