// SPDX-License-Identifier: Apache-2.0
/* A subscriber with Cyclone DDS: reads every topic of dds_peer and compares it, reads 20 KiB by
   SDO and receives an abort code, and writes an output.

     cyclone_peer DOMAIN       exits with 0 if nothing differs */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/interop/compare.h"
#include "tests/interop/cyclone.h"
#include "tests/interop/known_values.h"

#define DEADLINE DDS_SECS(30)
#define EVENTS 1000

static dds_entity_t participant;

/* Takes the next sample into a loan. Returns false after the deadline. */
static bool take(dds_entity_t from, void** sample, const char* what) {
  const dds_time_t end = dds_time() + DEADLINE;
  dds_sample_info_t info;
  while (dds_time() < end) {
    sample[0] = NULL;
    const int taken = dds_take(from, sample, &info, 1, 1);
    if (taken > 0 && info.valid_data)
      return true;
    if (taken > 0)
      dds_return_loan(from, sample, taken);
    if (taken <= 0)
      dds_sleepfor(DDS_MSECS(5));
  }
  printf("%s: nothing received\n", what);
  ++different;
  return false;
}

#define RECEIVE(Type, TOPIC, durability, depth, count, compare)                          \
  do {                                                                                   \
    void* sample[1];                                                                     \
    const dds_entity_t from = make_reader(participant, &linegate_v1_##Type##_desc,       \
                                          linegate_v1_TOPIC_##TOPIC, durability, depth); \
    for (int i = 0; i < (count) && different == 0 && take(from, sample, #Type); ++i) {   \
      compare(sample[0]);                                                                \
      dds_return_loan(from, sample, 1);                                                  \
    }                                                                                    \
    dds_delete(from);                                                                    \
    printf("%s: %d members compared, %d differ\n", #Type, compared, different);          \
  } while (0)

static void receive_all(void) {
  const dds_durability_kind_t late = DDS_DURABILITY_TRANSIENT_LOCAL;
  RECEIVE(GatewayState, GATEWAY_STATE, late, 1, 1, compare_gateway_state);
  RECEIVE(LineState, LINE_STATE, late, 1, 1, compare_line_state);
  RECEIVE(NodeState, NODE_STATE, late, 1, 1, compare_node_state);
  RECEIVE(OutputState, OUTPUT_STATE, late, 1, 1, compare_output_state);
  RECEIVE(ImageLayout, IMAGE_LAYOUT, late, 1, 2, compare_image_layout);
  RECEIVE(ProcessImage, PROCESS_IMAGE, late, 1, 1, compare_process_image);
  RECEIVE(PdoUpdate, PDO_UPDATE, DDS_DURABILITY_VOLATILE, 1, 1, compare_pdo_update);
  RECEIVE(PdoReception, PDO_RECEPTION, DDS_DURABILITY_VOLATILE, 1, 1, compare_pdo_reception);
  RECEIVE(Event, EVENT, late, EVENTS, EVENTS, compare_event);
}

static void wait_for_reader(dds_entity_t writer, const char* what) {
  const dds_time_t end = dds_time() + DEADLINE;
  dds_publication_matched_status_t status = {0};
  do {
    dds_get_publication_matched_status(writer, &status);
    if (status.current_count > 0)
      return;
    dds_sleepfor(DDS_MSECS(5));
  } while (dds_time() < end);
  printf("%s: no reader\n", what);
  exit(2);
}

static linegate_v1_CommandRequest request(uint64_t id, uint16_t index) {
  linegate_v1_CommandRequest r;
  memset(&r, 0, sizeof r);
  strcpy(r.gateway, "known-gateway");
  strcpy(r.line, "line1");
  strcpy(r.client, "cyclone");
  r.id = id;
  r.kind = linegate_v1_COMMAND_SDO_READ;
  r.node = 9;
  r.index = index;
  r.sub = 20; /* KiB */
  r.last = true;
  return r;
}

/* Assembles the reply to request `id`. */
static size_t receive_reply(dds_entity_t replies, uint64_t id, uint8_t* data, size_t room,
                            linegate_v1_CommandReply* head) {
  void* sample[1];
  size_t have = 0;
  bool last = false;
  while (!last && take(replies, sample, "CommandReply")) {
    const linegate_v1_CommandReply* reply = sample[0];
    if (reply->id == id && strcmp(reply->client, "cyclone") == 0 && reply->offset == have &&
        have + reply->data._length <= room) {
      memcpy(data + have, reply->data._buffer, reply->data._length);
      have += reply->data._length;
      last = reply->last;
      *head = *reply;
    }
    dds_return_loan(replies, sample, 1);
  }
  return have;
}

static void exchange_commands(void) {
  static uint8_t data[32768];
  static uint8_t should[20480];
  linegate_v1_CommandReply head;
  memset(&head, 0, sizeof head);
  dds_qos_t* q = reliable_qos(DDS_DURABILITY_VOLATILE, DDS_HISTORY_KEEP_ALL, 0);
  const dds_entity_t writer =
      die_if_failed(dds_create_writer(participant,
                                      make_topic(participant, &linegate_v1_CommandRequest_desc,
                                                 linegate_v1_TOPIC_COMMAND_REQUEST),
                                      q, NULL),
                    "CommandRequest");
  dds_delete_qos(q);
  const dds_entity_t replies =
      make_reader(participant, &linegate_v1_CommandReply_desc, linegate_v1_TOPIC_COMMAND_REPLY,
                  DDS_DURABILITY_TRANSIENT_LOCAL, 16);
  wait_for_reader(writer, "CommandRequest");

  linegate_v1_CommandRequest r = request(1, 0x2000);
  die_if_failed(dds_write(writer, &r), "write CommandRequest");
  const size_t size = receive_reply(replies, 1, data, sizeof data, &head);
  pattern(should, sizeof should, 9);
  compare_bytes("data of the SDO upload", data, size, should, sizeof should);
  TEXT(head.gateway, "known-gateway");
  TEXT(head.line, "line1");
  NUMBER(head.incarnation, 0x0123456789ABCDEFULL);
  NUMBER(head.domain, linegate_v1_RESULT_DONE);
  NUMBER(head.code, 0);
  TEXT(head.text, "");
  NUMBER(head.total, sizeof should);

  r = request(2, 0x1234);
  die_if_failed(dds_write(writer, &r), "write CommandRequest");
  NUMBER(receive_reply(replies, 2, data, sizeof data, &head), 0);
  NUMBER(head.domain, linegate_v1_RESULT_SDO);
  NUMBER(head.code, 0x06020000);
  TEXT(head.text, "object does not exist in the object dictionary");
  printf("CommandReply: %d members compared, %d differ\n", compared, different);
}

static void write_output(void) {
  dds_qos_t* q = reliable_qos(DDS_DURABILITY_VOLATILE, DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_ownership(q, DDS_OWNERSHIP_EXCLUSIVE);
  dds_qset_ownership_strength(q, 5);
  dds_qset_deadline(q, DDS_SECS(1));
  dds_qset_liveliness(q, DDS_LIVELINESS_MANUAL_BY_TOPIC, DDS_SECS(1));
  const dds_entity_t writer = die_if_failed(
      dds_create_writer(
          participant,
          make_topic(participant, &linegate_v1_OutputWrite_desc, linegate_v1_TOPIC_OUTPUT_WRITE), q,
          NULL),
      "OutputWrite");
  dds_delete_qos(q);
  wait_for_reader(writer, "OutputWrite");
  uint8_t value[2] = {0x12, 0x34};
  uint8_t run[100] = {0};
  linegate_v1_OutputValue values[1] = {{.entry = 7}};
  values[0].data._buffer = value;
  values[0].data._length = values[0].data._maximum = sizeof value;
  linegate_v1_OutputBytes runs[1] = {{.offset = 64}};
  runs[0].data._buffer = run;
  runs[0].data._length = runs[0].data._maximum = sizeof run;
  linegate_v1_OutputWrite w;
  memset(&w, 0, sizeof w);
  strcpy(w.gateway, "known-gateway");
  strcpy(w.line, "line1");
  strcpy(w.client, "cyclone");
  w.group = 2;
  w.layout_id = 0xABC;
  w.arming = 3;
  w.watchdog_ns = 250000000;
  w.reactions = linegate_v1_WATCHDOG_ZERO_OUTPUTS | linegate_v1_WATCHDOG_SEND_EMCY;
  w.values._buffer = values;
  w.values._length = w.values._maximum = 1;
  w.bytes._buffer = runs;
  w.bytes._length = w.bytes._maximum = 1;
  /* The reader may have matched later than this writer, so volatile samples are repeated. */
  for (int i = 0; i < 20; ++i) {
    die_if_failed(dds_write(writer, &w), "write OutputWrite");
    dds_sleepfor(DDS_MSECS(25));
  }
}

int main(int argc, char** argv) {
  if (argc < 2)
    return 2;
  setvbuf(stdout, NULL, _IOLBF, 0);
  participant = participant_in_domain(argv[1]);
  receive_all();
  if (different == 0)
    exchange_commands();
  if (different == 0)
    write_output();
  dds_delete(participant);
  printf("%d compared, %d different\n", compared, different);
  return different == 0 ? 0 : 1;
}
