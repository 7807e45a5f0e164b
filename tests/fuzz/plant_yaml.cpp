// SPDX-License-Identifier: Apache-2.0
// The input is a plant.yaml. Promises: no crash, every finding has a text and a place in the file,
// an error never comes with a plant, and every line of a plant can be created.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

#include "gateway/config/plant.h"
#include "stack/line/line.h"

#include "tests/fuzz/expect.h"
#include "tests/paths.h"

namespace {

// Device files are found relative to this path, as for the sample plants.
const std::string kFile = linegate::paths::in_repository("deploy/plants/fuzz.yaml");

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto loaded = linegate::config::read(text, kFile);
  LINEGATE_EXPECT(loaded.ok() == !linegate::has_errors(loaded.diagnostics));
  // YAML 1.2 breaks lines at a carriage return as well.
  const auto line_ends =
      std::count_if(text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; });
  for (const linegate::Diagnostic& diagnostic : loaded.diagnostics) {
    LINEGATE_EXPECT(!diagnostic.text.empty());
    LINEGATE_EXPECT(diagnostic.file != kFile || diagnostic.line <= line_ends + 1);
  }
  if (loaded.ok()) {
    LINEGATE_EXPECT(!loaded.value->lines.empty());
    for (const auto& plan : loaded.value->lines) {
      LINEGATE_EXPECT(linegate::line::Line::make(plan.config).ok());
    }
  }
  return 0;
}
