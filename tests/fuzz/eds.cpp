// The input is a whole EDS or DCF. Whatever it is: no crash, every finding has a place in the file,
// an error never comes with a description, and every description makes a dictionary.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "stack/eds/reader.h"
#include "stack/od/dictionary.h"

#include "tests/fuzz/expect.h"

namespace {

using linegate::Diagnostic;

void check(std::string_view text, std::uint8_t node_id) {
  const auto loaded = linegate::eds::load(text, "fuzz.eds", node_id);
  LINEGATE_EXPECT(loaded.ok() == !linegate::has_errors(loaded.diagnostics));
  const auto line_ends =
      std::count_if(text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r'; });
  for (const Diagnostic& diagnostic : loaded.diagnostics) {
    LINEGATE_EXPECT(diagnostic.line <= line_ends + 1);
    LINEGATE_EXPECT(diagnostic.column <= text.size() + 1);
    LINEGATE_EXPECT(!diagnostic.text.empty());
  }
  if (loaded.ok()) {
    const linegate::od::Dictionary dictionary(*loaded.value);
    LINEGATE_EXPECT(dictionary.indices().size() == loaded.value->objects.size());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  check(text, 0);
  check(text, 127);
  return 0;
}
