// SPDX-License-Identifier: Apache-2.0
/* A subscriber with Cyclone DDS that prints every received sample of LineState, ImageLayout,
   ProcessImage, NodeState and Event, one JSON object per sample, until it is ended. Tests
   compare the output with the frames of devices.

     cyclone_images DOMAIN

   Members are named as in idl/linegate.idl; enumerations are numbers, bytes are hexadecimal. */
#include <inttypes.h>
#include <stdio.h>

#include "tests/interop/cyclone.h"

#define AT_ONCE 16
#define EVENTS 1000

static void print_text(const char* name, const char* text) {
  printf(", \"%s\": \"", name);
  for (; *text != 0; ++text) {
    const unsigned char c = (unsigned char)*text;
    if (c == '"' || c == '\\' || c < 0x20)
      printf("\\u%04x", c);
    else
      putchar(c);
  }
  putchar('"');
}

static void print_number(const char* name, uint64_t number) {
  printf(", \"%s\": %" PRIu64, name, number);
}

static void print_bytes(const char* name, const dds_sequence_octet* bytes) {
  printf(", \"%s\": \"", name);
  for (uint32_t i = 0; i < bytes->_length; ++i)
    printf("%02X", bytes->_buffer[i]);
  putchar('"');
}

/* The first members of all five. */
#define PRINT_ADDRESS(topic, s)                  \
  do {                                           \
    printf("{\"topic\": \"" topic "\"");         \
    print_text("gateway", s->gateway);           \
    print_text("line", s->line);                 \
    print_number("incarnation", s->incarnation); \
  } while (0)

static void print_entry(const linegate_v1_LayoutEntry* entry) {
  printf("{\"bit_offset\": %" PRIu32, entry->bit_offset);
  print_number("bit_length", entry->bit_length);
  print_number("node", entry->node);
  print_number("index", entry->index);
  print_number("sub", entry->sub);
  print_text("name", entry->name);
  putchar('}');
}

static void print_layout(const void* sample) {
  const linegate_v1_ImageLayout* s = sample;
  PRINT_ADDRESS("ImageLayout", s);
  print_number("direction", s->direction);
  print_number("layout_id", s->layout_id);
  print_number("part", s->part);
  print_number("parts", s->parts);
  print_number("byte_size", s->byte_size);
  print_number("first_entry", s->first_entry);
  printf(", \"entries\": [");
  for (uint32_t i = 0; i < s->entries._length; ++i) {
    if (i > 0)
      printf(", ");
    print_entry(&s->entries._buffer[i]);
  }
  printf("]}\n");
}

static void print_image(const void* sample) {
  const linegate_v1_ProcessImage* s = sample;
  PRINT_ADDRESS("ProcessImage", s);
  print_number("direction", s->direction);
  print_number("layout_id", s->layout_id);
  print_number("sequence_number", s->sequence_number);
  print_bytes("bytes", &s->bytes);
  print_bytes("valid", &s->valid);
  printf("}\n");
}

static void print_line(const void* sample) {
  const linegate_v1_LineState* s = sample;
  PRINT_ADDRESS("LineState", s);
  print_number("manager", s->manager);
  print_number("bus", s->bus);
  print_number("transmit_errors", s->transmit_errors);
  print_number("receive_errors", s->receive_errors);
  print_number("load_permille", s->load_permille);
  print_number("bit_rate", s->bit_rate);
  print_number("frames_lost", s->count.frames_lost);
  print_number("bus_errors", s->count.bus_errors);
  printf("}\n");
}

static void print_node(const void* sample) {
  const linegate_v1_NodeState* s = sample;
  PRINT_ADDRESS("NodeState", s);
  print_number("node", s->node);
  print_text("name", s->name);
  print_number("state", s->state);
  print_number("presence", s->presence);
  print_number("cause", s->cause);
  print_number("spontaneous_changes", s->spontaneous_changes);
  print_number("heartbeats_lost", s->heartbeats_lost);
  printf("}\n");
}

static void print_event(const void* sample) {
  const linegate_v1_Event* s = sample;
  PRINT_ADDRESS("Event", s);
  print_number("number", s->number);
  print_number("time", (uint64_t)s->time);
  print_number("kind", s->kind);
  print_number("severity", s->severity);
  print_number("node", s->node);
  print_number("code", s->code);
  print_number("value", s->value);
  print_bytes("data", &s->data);
  print_text("text", s->text);
  printf("}\n");
}

struct subscription {
  dds_entity_t reader;
  void (*print)(const void* sample);
};

static void print_all(const struct subscription* from) {
  void* samples[AT_ONCE] = {NULL};
  dds_sample_info_t info[AT_ONCE];
  int taken;
  while ((taken = dds_take(from->reader, samples, info, AT_ONCE, AT_ONCE)) > 0) {
    for (int i = 0; i < taken; ++i) {
      if (info[i].valid_data)
        from->print(samples[i]);
    }
    dds_return_loan(from->reader, samples, taken);
    samples[0] = NULL;
  }
  die_if_failed(taken, "take");
}

int main(int argc, char** argv) {
  if (argc != 2)
    return 2;
  setvbuf(stdout, NULL, _IOLBF, 0);
  const dds_durability_kind_t late = DDS_DURABILITY_TRANSIENT_LOCAL;
  const dds_entity_t participant = participant_in_domain(argv[1]);
#define SUBSCRIBE(Type, TOPIC, depth) \
  make_reader(participant, &linegate_v1_##Type##_desc, linegate_v1_TOPIC_##TOPIC, late, depth)
  const struct subscription subscriptions[] = {
      {SUBSCRIBE(LineState, LINE_STATE, 1), print_line},
      {SUBSCRIBE(ImageLayout, IMAGE_LAYOUT, 1), print_layout},
      {SUBSCRIBE(ProcessImage, PROCESS_IMAGE, 1), print_image},
      {SUBSCRIBE(NodeState, NODE_STATE, 1), print_node},
      {SUBSCRIBE(Event, EVENT, EVENTS), print_event},
  };
  const size_t count = sizeof subscriptions / sizeof subscriptions[0];
  const dds_entity_t waitset = die_if_failed(dds_create_waitset(participant), "waitset");
  for (size_t i = 0; i < count; ++i) {
    dds_set_status_mask(subscriptions[i].reader, DDS_DATA_AVAILABLE_STATUS);
    dds_waitset_attach(waitset, subscriptions[i].reader, 0);
  }
  for (;;) {
    for (size_t i = 0; i < count; ++i)
      print_all(&subscriptions[i]);
    die_if_failed(dds_waitset_wait(waitset, NULL, 0, DDS_INFINITY), "wait");
  }
}
