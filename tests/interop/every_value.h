// SPDX-License-Identifier: Apache-2.0
/* The samples of every_type.yaml, with types that idlc generated from what `linegate idl` printed:
   compares the inputs and outputs of every_type.eds with the values of named.py. For one source
   file of a program each. */
#ifndef LINEGATE_TESTS_INTEROP_EVERY_VALUE_H
#define LINEGATE_TESTS_INTEROP_EVERY_VALUE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "every_type.h"
#include "tests/interop/cyclone.h"

typedef plant_press_every_inputs_26c77fbdaf07453c inputs_t;
typedef plant_press_every_outputs_41c5ad8c1defa64f outputs_t;

static int wrong = 0;

#define EXPECT(condition)                                \
  do {                                                   \
    if (!(condition)) {                                  \
      printf("line %d: not %s\n", __LINE__, #condition); \
      ++wrong;                                           \
    }                                                    \
  } while (false)

/* The members of inputs have no prefix, those of outputs Set_. */
#define EXPECT_VALUES(v, PREFIX)                                           \
  do {                                                                     \
    static const uint8_t octets[8] = {0, 1, 2, 3, 0xFC, 0xFD, 0xFE, 0xFF}; \
    EXPECT((v)->PREFIX##Flag);                                             \
    EXPECT(!(v)->PREFIX##Second_flag);                                     \
    EXPECT((v)->PREFIX##Signed_16 == -300);                                \
    EXPECT((v)->PREFIX##Unsigned_16 == 65000);                             \
    EXPECT((v)->PREFIX##Signed_24 == -70000);                              \
    EXPECT((v)->PREFIX##Unsigned_24 == 16000000);                          \
    EXPECT((v)->PREFIX##Signed_32 == -2000000000);                         \
    EXPECT((v)->PREFIX##Unsigned_32 == 4000000000);                        \
    EXPECT((v)->PREFIX##Signed_40 == -500000000000);                       \
    EXPECT((v)->PREFIX##Unsigned_40 == 1000000000000);                     \
    EXPECT((v)->PREFIX##Signed_48 == -100000000000000);                    \
    EXPECT((v)->PREFIX##Unsigned_48 == 200000000000000);                   \
    EXPECT((v)->PREFIX##Signed_56 == -30000000000000000);                  \
    EXPECT((v)->PREFIX##Unsigned_56 == 70000000000000000);                 \
    EXPECT((v)->PREFIX##Signed_64 == -9000000000000000000);                \
    EXPECT((v)->PREFIX##Unsigned_64 == 18000000000000000000u);             \
    EXPECT((v)->PREFIX##Time_of_day == 1796000400001000000);               \
    EXPECT((v)->PREFIX##Duration == 86400002000000);                       \
    EXPECT((v)->PREFIX##Real_64 == -0.1);                                  \
    EXPECT((v)->PREFIX##Real_32_m_s == 1.5F);                              \
    EXPECT(strcmp((v)->PREFIX##Visible, "Press 01") == 0);                 \
    EXPECT(strcmp((v)->PREFIX##Unicode,                                    \
                  "\xE2\x82\xAC"                                           \
                  "5 m") == 0);                                            \
    EXPECT(memcmp((v)->PREFIX##Octets, octets, sizeof octets) == 0);       \
  } while (false)

static void expect_inputs(const inputs_t* sample) {
  EXPECT(strcmp(sample->gateway, "types") == 0);
  EXPECT(strcmp(sample->line, "press") == 0);
  EXPECT(sample->incarnation != 0 && sample->sequence_number != 0);
  EXPECT(sample->received.pdo1 > 1700000000000000000 && sample->time >= sample->received.pdo18);
  EXPECT(sample->values.class_ == -5);
  EXPECT(sample->values.n24V_supply == 240);
  EXPECT(memcmp(sample->values.Domain, "\0\0\0\0\0\0\0\0", 8) == 0);
  EXPECT_VALUES(&sample->values, );
}

static void expect_outputs(const outputs_t* sample) {
  EXPECT(strcmp(sample->line, "press") == 0);
  EXPECT(sample->known.Set_Flag && sample->known.Set_Domain);
  EXPECT(sample->sent.pdo1 > 1700000000000000000);
  EXPECT(sample->values.Set_class == -5);
  EXPECT(sample->values.Set_24V_supply == 240);
  EXPECT(memcmp(sample->values.Set_Domain, "\1\2\3\4\5\6\7\10", 8) == 0);
  EXPECT(sample->waits.Set_Flag == 0 && sample->waits.Set_Domain == 0);
  EXPECT_VALUES(&sample->values, Set_);
}

static bool all_set(const bool* marks, size_t size) {
  for (size_t i = 0; i < size; ++i) {
    if (!marks[i])
      return false;
  }
  return true;
}

/* Takes the newest sample; returns true if all its values but the last are valid, and were
   compared. */
static bool take_inputs(dds_entity_t reader) {
  void* samples[1] = {NULL};
  dds_sample_info_t info[1];
  const int n = dds_take(reader, samples, info, 1, 1);
  const inputs_t* const sample = samples[0];
  const bool done = n == 1 && info[0].valid_data &&
                    all_set((const bool*)&sample->valid,
                            offsetof(inputs_t, valid.Domain) - offsetof(inputs_t, valid));
  if (done)
    expect_inputs(sample);
  if (n > 0)
    dds_return_loan(reader, samples, n);
  return done;
}

static bool take_outputs(dds_entity_t reader) {
  void* samples[1] = {NULL};
  dds_sample_info_t info[1];
  const int n = dds_take(reader, samples, info, 1, 1);
  const outputs_t* const sample = samples[0];
  const bool done =
      n == 1 && info[0].valid_data && all_set((const bool*)&sample->valid, sizeof sample->valid);
  if (done)
    expect_outputs(sample);
  if (n > 0)
    dds_return_loan(reader, samples, n);
  return done;
}

#endif
