// SPDX-License-Identifier: Apache-2.0
/* Named topics read with Cyclone DDS, with types that idlc generated from what `linegate idl`
   printed: compares the inputs and outputs of every_type.eds with the values of named.py. Then
   writes some of the outputs by name, and waits until they have the new values.
   cyclone_named DOMAIN: ends with 0 if all are right within 60 s. */
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "every_type.h"
#include "tests/interop/cyclone.h"
#include "tests/interop/every_value.h"

typedef plant_press_all_set_6496a29b850773f3 set_t;

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
      make_reader(participant, &plant_press_every_outputs_41c5ad8c1defa64f_desc,
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
