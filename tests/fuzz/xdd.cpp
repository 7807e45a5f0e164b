// SPDX-License-Identifier: Apache-2.0
// The input is a whole XDD or XDC. Promises: no crash, every finding has a place in the file, an
// error never comes with a description, and every description can become a dictionary.
#include "bridges/xdd/xdd.h"

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "stack/od/dictionary.h"

#include "tests/fuzz/expect.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto loaded = linegate::xdd::read(text, "fuzz.xdd", 127);
  LINEGATE_EXPECT(loaded.ok() == !linegate::has_errors(loaded.diagnostics));
  for (const linegate::Diagnostic& diagnostic : loaded.diagnostics) {
    LINEGATE_EXPECT(diagnostic.line <= size + 1);
    LINEGATE_EXPECT(!diagnostic.text.empty());
  }
  if (loaded.ok()) {
    const linegate::od::Dictionary dictionary(loaded.value->device);
    LINEGATE_EXPECT(dictionary.indices().size() == loaded.value->device.objects.size());
  }
  return 0;
}
