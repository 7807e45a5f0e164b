// SPDX-License-Identifier: Apache-2.0
// The input is a whole EDS or DCF. Promises: no crash, every finding has a place in the file, an
// error never comes with a description, every description can become a dictionary, and the file
// that is written from it can be read.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "stack/eds/reader.h"
#include "stack/eds/writer.h"
#include "stack/od/dictionary.h"

#include "tests/fuzz/expect.h"

namespace {

using linegate::Diagnostic;
using linegate::eds::DataSheet;

// A few lines of input can describe megabytes of text.
bool is_short(const DataSheet& sheet) {
  std::size_t variables = 0;
  for (const auto& object : sheet.device.objects) {
    variables += object.variables.size();
  }
  return variables < 2000;
}

void check_written(const DataSheet& sheet, std::uint8_t node_id) {
  const auto again = linegate::eds::read(linegate::eds::write_dcf(sheet), "again.dcf", node_id);
  LINEGATE_EXPECT(again.ok());
  LINEGATE_EXPECT(again.value->device.objects.size() == sheet.device.objects.size());
  LINEGATE_EXPECT(linegate::eds::read(linegate::eds::write_eds(sheet), "again.eds", node_id).ok());
}

void check(std::string_view text, std::uint8_t node_id) {
  const auto loaded = linegate::eds::read(text, "fuzz.eds", node_id);
  LINEGATE_EXPECT(loaded.ok() == !linegate::has_errors(loaded.diagnostics));
  const auto line_ends =
      std::count_if(text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; });
  for (const Diagnostic& diagnostic : loaded.diagnostics) {
    LINEGATE_EXPECT(diagnostic.line <= line_ends + 1);
    LINEGATE_EXPECT(diagnostic.column <= text.size() + 1);
    LINEGATE_EXPECT(!diagnostic.text.empty());
  }
  if (!loaded.ok()) {
    return;
  }
  const auto& device = loaded.value->device;
  const linegate::od::Dictionary dictionary(device);
  LINEGATE_EXPECT(dictionary.indices().size() == device.objects.size());
  if (node_id != 0 && is_short(*loaded.value)) {
    check_written(*loaded.value, node_id);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  check(text, 0);
  check(text, 127);
  return 0;
}
