// SPDX-License-Identifier: Apache-2.0
// Why is nothing received?
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/doctor/checks.h"
#include "gateway/doctor/examine.h"
#include "gateway/doctor/report.h"
#include "gateway/publish/dds_edge.h"
#include "gateway/runtime/exit_code.h"

namespace linegate::gateway {

void add_doctor(CommandLine& line) {
  const auto hosts = std::make_shared<std::vector<std::string>>();
  CLI::App* command = line.app().add_subcommand(
      "doctor", "find out why gateways are not received, or only in part; changes nothing");
  command->add_option("host", *hosts,
                      "hosts on which a gateway should run: their UDP ports are probed");
  line.on(command, [&line, hosts] {
    const DdsLibraryLog silent({});
    const CommonOptions& common = line.common();
    const doctor::Observations seen = doctor::examine({.domain = common.domain,
                                                       .profile = common.profile,
                                                       .identity = common.security,
                                                       .interfaces = common.interfaces,
                                                       .peers = common.peers,
                                                       .servers = common.servers,
                                                       .multicast = common.multicast,
                                                       .hosts = *hosts,
                                                       .time = seconds(common.wait)});
    const doctor::Findings found = doctor::run_checks(seen);
    if (common.json) {
      std::cout << doctor::report_json(seen, found) << '\n';
    } else {
      doctor::print_report(std::cout, seen, found);
    }
    return found.empty() ? kExitOk : kExitFailed;
  });
}

}  // namespace linegate::gateway
