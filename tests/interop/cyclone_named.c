// SPDX-License-Identifier: Apache-2.0
/* Named topics read with Cyclone DDS, with types that idlc generated from what `linegate idl`
   printed: compares the inputs and outputs of every_type.eds with the values of named.py. Then
   writes some of the outputs by name, and waits until they have the new values.
   cyclone_named DOMAIN: ends with 0 if all are right within 60 s. */
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "every_type.h"
#include "tests/interop/cyclone.h"

typedef plant_press_every_inputs_26c77fbdaf07453c inputs_t;
typedef plant_press_every_outputs_c3600e3d770d8694 outputs_t;
typedef plant_press_all_set_6496a29b850773f3 set_t;

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

/* With the QoS of OutputWrite. */
static dds_entity_t make_set_writer(dds_entity_t participant) {
  const dds_entity_t topic = make_topic(participant, &plant_press_all_set_6496a29b850773f3_desc,
                                        "plant/press/all/outputs/set");
  dds_qos_t* const qos = reliable_qos(DDS_DURABILITY_VOLATILE, DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_ownership(qos, DDS_OWNERSHIP_EXCLUSIVE);
  dds_qset_ownership_strength(qos, 5);
  dds_qset_deadline(qos, DDS_SECS(1));
  dds_qset_liveliness(qos, DDS_LIVELINESS_MANUAL_BY_TOPIC, DDS_SECS(1));
  const dds_entity_t writer =
      die_if_failed(dds_create_writer(participant, topic, qos, NULL), "writer");
  dds_delete_qos(qos);
  return writer;
}

static set_t new_values(void) {
  set_t sample;
  memset(&sample, 0, sizeof sample);
  strcpy(sample.gateway, "types");
  strcpy(sample.line, "press");
  strcpy(sample.client, "cyclone");
  sample.group = 1;
  sample.arming = 1;
  sample.given.every_Set_Signed_24 = true;
  sample.values.every_Set_Signed_24 = -8000000;
  sample.given.every_Set_Visible = true;
  strcpy(sample.values.every_Set_Visible, "M\xC3\xBCll");
  sample.given.every_Set_Real_64 = true;
  sample.values.every_Set_Real_64 = 2.5;
  return sample;
}

static bool has_new_values(dds_entity_t reader) {
  void* samples[1] = {NULL};
  dds_sample_info_t info[1];
  const int n = dds_take(reader, samples, info, 1, 1);
  const outputs_t* const sample = samples[0];
  const bool done = n == 1 && info[0].valid_data && sample->values.Set_Signed_24 == -8000000;
  if (done) {
    EXPECT(strcmp(sample->values.Set_Visible, "M\xC3\xBCll") == 0);
    EXPECT(sample->values.Set_Real_64 == 2.5);
    EXPECT(sample->values.Set_Signed_16 == -300); /* not given */
    EXPECT(sample->values.Set_Real_32_m_s == 1.5F);
  }
  if (n > 0)
    dds_return_loan(reader, samples, n);
  return done;
}

static bool write_outputs(dds_entity_t participant, dds_entity_t outputs) {
  const dds_entity_t writer = make_set_writer(participant);
  const set_t sample = new_values();
  for (int tenths = 0; tenths < 300; ++tenths) {
    EXPECT(dds_write(writer, &sample) == DDS_RETCODE_OK);
    dds_sleepfor(DDS_MSECS(100));
    if (has_new_values(outputs))
      return true;
  }
  return false;
}

int main(int argc, char** argv) {
  if (argc != 2)
    return 2;
  const dds_entity_t participant = participant_in_domain(argv[1]);
  const dds_entity_t inputs =
      make_reader(participant, &plant_press_every_inputs_26c77fbdaf07453c_desc,
                  "plant/press/every/inputs", DDS_DURABILITY_TRANSIENT_LOCAL, 1);
  const dds_entity_t outputs =
      make_reader(participant, &plant_press_every_outputs_c3600e3d770d8694_desc,
                  "plant/press/every/outputs", DDS_DURABILITY_TRANSIENT_LOCAL, 1);
  bool has_inputs = false;
  bool has_outputs = false;
  for (int tenths = 0; tenths < 600 && !(has_inputs && has_outputs); ++tenths) {
    has_inputs = has_inputs || take_inputs(inputs);
    has_outputs = has_outputs || take_outputs(outputs);
    dds_sleepfor(DDS_MSECS(100));
  }
  EXPECT(has_inputs);
  EXPECT(has_outputs);
  EXPECT(has_outputs && write_outputs(participant, outputs));
  printf("%d wrong\n", wrong);
  return wrong == 0 ? 0 : 1;
}
