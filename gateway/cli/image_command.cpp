// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string>

#include "gateway/cli/command_line.h"
#include "gateway/cli/commands.h"

namespace linegate::gateway {
namespace {

struct ImageArguments {
  std::string line;
  bool outputs = false;
};

}  // namespace

void add_image(CommandLine& line) {
  const auto arguments = std::make_shared<ImageArguments>();
  CLI::App* image =
      line.app().add_subcommand("image", "print the process image of a line, or of all lines");
  image->add_option("line", arguments->line);
  image->add_flag("-o,--outputs", arguments->outputs, "print outputs instead of inputs");
  line.on(image, {.images = true}, [arguments](console::Context& c) {
    return console::image(
        c, arguments->line,
        arguments->outputs ? image::Direction::outputs : image::Direction::inputs);
  });
}

}  // namespace linegate::gateway
