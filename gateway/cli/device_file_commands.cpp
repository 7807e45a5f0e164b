// SPDX-License-Identifier: Apache-2.0
// Commands that write device files of a plant.yaml.
#include <memory>
#include <string>

#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/cli/problems_as_json.h"
#include "gateway/tools/device_file.h"

namespace linegate::gateway {
namespace {

struct DeviceFileArguments {
  std::string plant, node;
  bool concise = false;
};

}  // namespace

void add_eds(CommandLine& line) {
  const auto arguments = std::make_shared<DeviceFileArguments>();
  CLI::App* eds = line.app().add_subcommand(
      "eds", "print the EDS of a line's own node, or of LINE:DEVICE in the role device");
  eds->add_option("plant", arguments->plant)->required();
  eds->add_option("line", arguments->node, "LINE, or LINE:DEVICE in the role device")->required();
  line.on(eds, [&line, arguments] {
    return with_problems_as_json(line.common().json, [&] {
      return print_device_file(arguments->plant, arguments->node, DeviceFileKind::eds);
    });
  });
}

void add_dcf(CommandLine& line) {
  const auto arguments = std::make_shared<DeviceFileArguments>();
  CLI::App* dcf = line.app().add_subcommand(
      "dcf", "print the DCF of a node, with each value that is written to it");
  dcf->add_option("plant", arguments->plant)->required();
  dcf->add_option("node", arguments->node, "LINE:NODE")->required();
  dcf->add_flag("--concise", arguments->concise, "concise DCF, as 1F22h holds it (binary)");
  line.on(dcf, [&line, arguments] {
    const auto kind = arguments->concise ? DeviceFileKind::concise : DeviceFileKind::dcf;
    return with_problems_as_json(line.common().json, [&] {
      return print_device_file(arguments->plant, arguments->node, kind);
    });
  });
}

}  // namespace linegate::gateway
