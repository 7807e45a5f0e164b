// SPDX-License-Identifier: Apache-2.0
/* Compares one member after the other; prints each difference with the name of the member. */
#ifndef LINEGATE_TESTS_INTEROP_COMPARE_H
#define LINEGATE_TESTS_INTEROP_COMPARE_H

#include <stddef.h>
#include <stdint.h>

/* Number of comparisons, and number of those that failed. */
extern int compared;
extern int different;

void compare_number(const char* what, int64_t is, int64_t should);
void compare_text(const char* what, const char* is, const char* should);
void compare_bytes(const char* what, const uint8_t* is, size_t length, const uint8_t* should,
                   size_t should_length);

#define NUMBER(member, should) compare_number(#member, (int64_t)(member), (int64_t)(should))
#define TEXT(member, should) compare_text(#member, member, should)
#define BYTES(member, should, length) \
  compare_bytes(#member, (member)._buffer, (member)._length, should, length)

#endif
