// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"
#include "gateway/cli/problems_as_json.h"
#include "gateway/runtime/signals.h"
#include "gateway/tools/record.h"

namespace linegate::gateway {

void add_record(CommandLine& line) {
  const auto options = std::make_shared<RecordOptions>();
  CLI::App* command = line.app().add_subcommand(
      "record", "record the frames of an interface as candump log; sends nothing");
  command->add_option("interface", options->uri, "e.g. socketcan:can0")->required();
  command->add_option("-o,--output", options->file.file, "log file; default: the standard output");
  command
      ->add_option("--max-size", options->file.max_size,
                   "size at which the file is renamed to FILE.1, e.g. 100MB")
      ->transform(CLI::AsSizeValue(true))
      ->check(CLI::Range(1000.0, 1e12));
  command->add_option("--files", options->file.files, "largest number of files")
      ->check(CLI::Range(1, 10'000));
  line.on(command, [&line, options] {
    block_stop_signals();
    limit_end(kEndLimit);
    return with_problems_as_json(line.common().json, [&] { return record(*options); });
  });
}

}  // namespace linegate::gateway
