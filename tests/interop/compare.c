// SPDX-License-Identifier: Apache-2.0
#include "tests/interop/compare.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

int compared = 0;
int different = 0;

void compare_number(const char* what, int64_t is, int64_t should) {
  ++compared;
  if (is == should)
    return;
  ++different;
  printf("%s is %" PRId64 ", not %" PRId64 "\n", what, is, should);
}

void compare_text(const char* what, const char* is, const char* should) {
  ++compared;
  if (strcmp(is, should) == 0)
    return;
  ++different;
  printf("%s is \"%s\", not \"%s\"\n", what, is, should);
}

void compare_bytes(const char* what, const uint8_t* is, size_t length, const uint8_t* should,
                   size_t should_length) {
  ++compared;
  if (length == should_length && (length == 0 || memcmp(is, should, length) == 0))
    return;
  ++different;
  printf("%s: %zu bytes are not the %zu bytes they should be\n", what, length, should_length);
}
