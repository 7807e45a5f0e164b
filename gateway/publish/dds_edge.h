// SPDX-License-Identifier: Apache-2.0
// Implements DataEdge with DDS, and wraps the other functions of bridges/dds that the gateway
// needs. dds_edge.cpp and dds_process.cpp are the only files of the gateway that include that
// bridge, besides cli/remote_client.cpp, which is a subscriber.
#pragma once

#include <cstdint>
#include <ctime>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/config/plant.h"
#include "gateway/publish/data_edge.h"
#include "stack/base/diagnostic.h"

namespace linegate::gateway {

// incarnation: random for each start, not 0. Without a value, a diagnostic states the reason.
Loaded<std::unique_ptr<DataEdge>> make_dds_edge(const config::Plant& plant,
                                                std::uint64_t incarnation);

// The only argument of a program that shall call run_dds_process() first in main(): the gateway
// starts it so for `dds: {process: own}`.
inline constexpr std::string_view kDdsProcessArgument = "--dds-process";
// Holds the DDS endpoints of the gateway that started this process, until that gateway ends.
[[noreturn]] void run_dds_process();

// Reports what makes a file of QoS profiles unusable (errors) or dangerous (warnings). An empty
// name selects the installed file, or the built-in copy. Opens no socket.
std::vector<Diagnostic> check_dds_profiles(const std::string& file);
// The file that an empty name selects: a path, or "(built-in ...)".
std::string dds_profiles_in_use(const std::string& file);
// The limit of other participants with this file, if plant.yaml has none; the default if the file
// is unusable.
std::uint32_t dds_participants_of_profile(const std::string& file);

// What prevents the identities of the gateway and of its requests to other gateways at the time
// `now` (security::check_gateway, check_requests); empty without DDS-Security.
std::vector<Diagnostic> check_dds_identity(const config::Plant& plant, std::time_t now);
// Of these the errors about named topics and lines of other gateways, of a configuration that a
// running gateway loads.
std::vector<Diagnostic> check_dds_permissions(const config::Plant& plant);

// A warning if every host of a network may command the plant: a line permits commands or outputs,
// and DDS is open on an interface other than loopback without DDS-Security; or if identities that
// are revoked would continue to read. Opens no socket.
std::vector<Diagnostic> check_dds_exposure(const config::Plant& plant);

// While it exists, `log` receives the warnings and errors of the DDS library. It is called in
// threads of the library and must only forward the text. Afterwards, and with an empty function,
// they are discarded. At most one object at a time.
class DdsLibraryLog {
 public:
  explicit DdsLibraryLog(std::function<void(Severity, std::string_view text)> log);
  ~DdsLibraryLog();
  DdsLibraryLog(const DdsLibraryLog&) = delete;
  DdsLibraryLog& operator=(const DdsLibraryLog&) = delete;
};

}  // namespace linegate::gateway
