// SPDX-License-Identifier: Apache-2.0
// The imports of one library are replaced, and no others.
#include "bridges/dds/guard/imports.h"

#include <gtest/gtest.h>

namespace linegate::dds::guard {
namespace {

TEST(Imports, OfAnUnknownLibraryOrFunctionAreRefused) {
  int never = 0;
  EXPECT_FALSE(replace_import("libfastrtps.so", "no_function_has_this_name", &never));
  EXPECT_FALSE(replace_import("libno-such-library.so", "recv", &never));
}

}  // namespace
}  // namespace linegate::dds::guard
