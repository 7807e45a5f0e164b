// SPDX-License-Identifier: Apache-2.0
#include "tests/interop/known_values.h"

#include <stdio.h>

#include "tests/interop/compare.h"

#define UTC 1700000000000000000LL
#define INCARNATION 0x0123456789ABCDEFULL
#define LAYOUT 0xFEDCBA9876543210ULL
#define ENTRIES 300
#define LAST_EVENT 1500
#define MOST_PROPERTIES 128

#define ADDRESS(s)                         \
  do {                                     \
    TEXT((s)->gateway, "known-gateway");   \
    TEXT((s)->line, "line1");              \
    NUMBER((s)->incarnation, INCARNATION); \
  } while (0)

void pattern(uint8_t* data, size_t size, uint8_t seed) {
  for (size_t i = 0; i < size; ++i)
    data[i] = (uint8_t)(i * 3 + seed);
}

/* count: the number of properties, of which the first two have known values. */
static void compare_properties(const dds_sequence_linegate_v1_Property* properties,
                               uint32_t count) {
  NUMBER(properties->_length, count);
  if (properties->_length != count)
    return;
  TEXT(properties->_buffer[0].name, "first");
  TEXT(properties->_buffer[0].value, "1");
  TEXT(properties->_buffer[1].name, "second");
  TEXT(properties->_buffer[1].value, "zwei");
}

static void compare_counters(const linegate_v1_Counters* count) {
  NUMBER(count->frames_received, 1000);
  NUMBER(count->frames_sent, 1001);
  NUMBER(count->frames_unused, 1002);
  NUMBER(count->frames_malformed, 1003);
  NUMBER(count->frames_lost, 1004);
  NUMBER(count->bus_errors, 1005);
  NUMBER(count->rpdos, 1006);
  NUMBER(count->tpdos, 1007);
  NUMBER(count->tpdos_coalesced, 1008);
  NUMBER(count->syncs, 1009);
  NUMBER(count->emcys, 1010);
  NUMBER(count->heartbeats_lost, 1011);
  NUMBER(count->sdo_transfers, 1012);
  NUMBER(count->sdo_aborts, 1013);
  NUMBER(count->commands, 1014);
  NUMBER(count->commands_refused, 1015);
  NUMBER(count->output_writes, 1016);
  NUMBER(count->output_writes_refused, 1017);
  NUMBER(count->events, 1018);
  NUMBER(count->events_lost, 1019);
  NUMBER(count->receptions_lost, 1024);
  NUMBER(count->fd_frames_received, 1020);
  NUMBER(count->fd_frames_sent, 1021);
  NUMBER(count->usdo_transfers, 1022);
  NUMBER(count->usdo_aborts, 1023);
}

void compare_gateway_state(const linegate_v1_GatewayState* s) {
  TEXT(s->gateway, "known-gateway");
  NUMBER(s->incarnation, INCARNATION);
  NUMBER(s->time, UTC + 1);
  NUMBER(s->clock, linegate_v1_CLOCK_SYNCHRONISED);
  TEXT(s->version, "1.2.3");
  NUMBER(s->started, UTC + 7);
  NUMBER(s->configuration, 0xFEEDF00D01234567ULL);
  NUMBER(s->configured, UTC + 8);
  NUMBER(s->reloads, 9);
  NUMBER(s->reloads_refused, 10);
  NUMBER(s->events, 11);
  NUMBER(s->participants, 12);
  NUMBER(s->participants_most, 13);
  NUMBER(s->lines._length, 1);
  NUMBER(s->counters._length, 3);
  if (s->lines._length != 1 || s->counters._length != 3)
    return;
  TEXT(s->lines._buffer[0].name, "line1");
  TEXT(s->lines._buffer[0].interface_uri, "virtual:known");
  TEXT(s->counters._buffer[0].name, "first");
  NUMBER(s->counters._buffer[0].value, 14);
  TEXT(s->counters._buffer[1].name, "second");
  NUMBER(s->counters._buffer[1].value, 0xFFFFFFFFFFFFFFFFULL);
  TEXT(s->counters._buffer[2].name, "event-stream");
  NUMBER(s->counters._buffer[2].value, 0xFACE000000000001ULL);
}

void compare_line_state(const linegate_v1_LineState* s) {
  ADDRESS(s);
  NUMBER(s->time, UTC + 1);
  NUMBER(s->clock, linegate_v1_CLOCK_SYNCHRONISED);
  NUMBER(s->role, linegate_v1_ROLE_DEVICE);
  NUMBER(s->access, linegate_v1_ACCESS_ALL);
  TEXT(s->interface_uri, "virtual:known");
  NUMBER(s->bit_rate, 500000);
  NUMBER(s->network_id, 7);
  NUMBER(s->node_id, 100);
  NUMBER(s->own_state, linegate_v1_NMT_PRE_OPERATIONAL);
  NUMBER(s->manager, linegate_v1_MANAGER_STOPPED);
  NUMBER(s->bus, linegate_v1_BUS_ERROR_PASSIVE);
  NUMBER(s->transmit_errors, 130);
  NUMBER(s->receive_errors, 5);
  NUMBER(s->load_permille, 421);
  NUMBER(s->nodes_configured, 3);
  NUMBER(s->nodes_operational, 2);
  NUMBER(s->flying_master, linegate_v1_FLYING_MASTER_SLAVE);
  NUMBER(s->active_master, 9);
  NUMBER(s->master_priority, 1);
  compare_counters(&s->count);
  compare_properties(&s->properties, 2);
}

void compare_output_state(const linegate_v1_OutputState* s) {
  ADDRESS(s);
  NUMBER(s->group, 3);
  NUMBER(s->time, UTC + 4);
  NUMBER(s->clock, linegate_v1_CLOCK_SYNCHRONISED);
  TEXT(s->name, "left");
  TEXT(s->owner, "hmi");
  NUMBER(s->applied, 77);
  NUMBER(s->refused, 2);
  NUMBER(s->applied_time, UTC + 7);
  NUMBER(s->refused_time, UTC + 8);
  NUMBER(s->refusal, linegate_v1_OUTPUT_REFUSAL_NOT_ARMED);
  TEXT(s->refused_client, "old");
  NUMBER(s->arming, 9);
  NUMBER(s->arming_wanted, true);
  NUMBER(s->watchdog_ns, 100000000);
  NUMBER(s->watchdog_left_ns, 40000000);
  NUMBER(s->waiting_count, 5);
  NUMBER(s->waiting._length, 2);
  NUMBER(s->waiting._buffer[0].entry, 12);
  NUMBER(s->waiting._buffer[0].reason, linegate_v1_OUTPUT_WAIT_NODE);
  NUMBER(s->waiting._buffer[1].entry, 13);
  NUMBER(s->waiting._buffer[1].reason, linegate_v1_OUTPUT_WAIT_VALUES);
}

void compare_node_state(const linegate_v1_NodeState* s) {
  ADDRESS(s);
  NUMBER(s->node, 42);
  NUMBER(s->time, UTC + 2);
  NUMBER(s->clock, linegate_v1_CLOCK_SYNCHRONISED);
  TEXT(s->name, "drive1");
  NUMBER(s->configured, true);
  NUMBER(s->state, linegate_v1_NMT_OPERATIONAL);
  NUMBER(s->presence, linegate_v1_PRESENCE_MISSING);
  NUMBER(s->since, UTC + 5);
  NUMBER(s->last_heard, UTC + 6);
  NUMBER(s->heartbeat_monitored, true);
  NUMBER(s->boot, 'K');
  NUMBER(s->boot_text[0] != 0, true);
  NUMBER(s->device_type, 0x00020192);
  NUMBER(s->vendor, 0x11);
  NUMBER(s->product, 0x22);
  NUMBER(s->revision, 0x33);
  NUMBER(s->serial, 0x44);
  NUMBER(s->error_register, 0x81);
  NUMBER(s->last_emcy, 0x8130);
  NUMBER(s->emcy_count, 6);
  NUMBER(s->heartbeats_lost, 2);
  NUMBER(s->cause, linegate_v1_STATE_CAUSE_ITSELF);
  NUMBER(s->spontaneous_changes, 3);
  compare_properties(&s->properties, MOST_PROPERTIES);
  if (s->properties._length == MOST_PROPERTIES) {
    TEXT(s->properties._buffer[MOST_PROPERTIES - 1].name, "last");
    TEXT(s->properties._buffer[MOST_PROPERTIES - 1].value, "128");
  }
}

static void compare_entry(const linegate_v1_LayoutEntry* entry, uint32_t i) {
  char name[64];
  snprintf(name, sizeof name, "node%u.Input %u", i / 4, i % 4);
  NUMBER(entry->bit_offset, i * 16);
  NUMBER(entry->bit_length, 16);
  NUMBER(entry->data_type, 6);
  NUMBER(entry->node, 1 + i / 4);
  NUMBER(entry->index, 0x6401);
  NUMBER(entry->sub, 1 + i % 4);
  NUMBER(entry->remote_pdo, 2);
  NUMBER(entry->local_pdo, 1 + i / 4);
  NUMBER(entry->variable_index, 0xA580);
  NUMBER(entry->variable_sub, 1 + i % 254);
  NUMBER(entry->profile, 401);
  NUMBER(entry->product_code, 0x12345678);
  TEXT(entry->name, name);
  TEXT(entry->unit, "bar");
  NUMBER(entry->scale * 4, 1);
  NUMBER(-entry->offset, i);
  NUMBER(entry->given, (uint32_t)linegate_v1_GIVEN_LOW + (i % 2 == 0 ? linegate_v1_GIVEN_HIGH : 0) +
                           (i % 3 == 0 ? linegate_v1_GIVEN_INITIAL : 0));
  NUMBER(entry->low * -2, 3);
  NUMBER(entry->high * 2, i % 2 == 0 ? 199 : 0);
  NUMBER(entry->initial * 2, i % 3 == 0 ? 5 : 0);
  NUMBER(entry->access, linegate_v1_OBJECT_RWR);
  NUMBER(entry->transmission_type, 254);
  NUMBER(entry->inhibit_ns, 100000);
  NUMBER(entry->event_timer_ns, 50000000);
  NUMBER(entry->group + 1, i % 4 == 0 ? 0 : 8);
}

void compare_image_layout(const linegate_v1_ImageLayout* s) {
  const uint32_t first = s->part * 256u;
  ADDRESS(s);
  NUMBER(s->direction, linegate_v1_DIRECTION_INPUTS);
  NUMBER(s->part < 2, true);
  NUMBER(s->layout_id, LAYOUT);
  NUMBER(s->parts, 2);
  NUMBER(s->byte_size, ENTRIES * 2);
  NUMBER(s->entry_count, ENTRIES);
  NUMBER(s->first_entry, first);
  NUMBER(s->entries._length, s->part == 0 ? 256 : ENTRIES - 256);
  for (uint32_t i = 0; i < s->entries._length; ++i) {
    compare_entry(&s->entries._buffer[i], first + i);
  }
}

static void compare_stamp(const linegate_v1_PdoStamp* stamp) {
  NUMBER(stamp->node, 2);
  NUMBER(stamp->remote_pdo, 2);
  NUMBER(stamp->local_pdo, 2);
  NUMBER(stamp->first_entry, 4);
  NUMBER(stamp->entries, 4);
  NUMBER(stamp->frames, 3);
  NUMBER(stamp->time, UTC + 900);
}

void compare_process_image(const linegate_v1_ProcessImage* s) {
  uint8_t bytes[ENTRIES * 2];
  uint8_t changed[40] = {0xF0};
  uint8_t valid[40] = {0};
  for (uint32_t i = 0; i < sizeof bytes; ++i)
    bytes[i] = (uint8_t)(i * 7);
  valid[8] = 0x01;
  valid[15] = 0x80;
  ADDRESS(s);
  NUMBER(s->direction, linegate_v1_DIRECTION_INPUTS);
  NUMBER(s->layout_id, LAYOUT);
  NUMBER(s->sequence_number, 17);
  NUMBER(s->time, UTC + 1000);
  NUMBER(s->clock, linegate_v1_CLOCK_SYNCHRONISED);
  NUMBER(s->sync_count, 99);
  BYTES(s->bytes, bytes, sizeof bytes);
  BYTES(s->changed, changed, sizeof changed);
  BYTES(s->valid, valid, sizeof valid);
  NUMBER(s->pdos._length, 1);
  if (s->pdos._length == 1)
    compare_stamp(&s->pdos._buffer[0]);
}

/* A value of the second PDO. */
static void compare_pdo_value(const linegate_v1_PdoValue* value, uint32_t i) {
  const uint32_t at = (4 + i) * 2;
  const uint8_t data[2] = {(uint8_t)(at * 7), (uint8_t)((at + 1) * 7)};
  NUMBER(value->entry, 4 + i);
  NUMBER(value->index, 0x6401);
  NUMBER(value->sub, 1 + i);
  NUMBER(value->data_type, 6);
  NUMBER(value->bit_length, 16);
  BYTES(value->data, data, sizeof data);
}

/* Published repeatedly, each time with the next number. */
void compare_pdo_reception(const linegate_v1_PdoReception* s) {
  ADDRESS(s);
  NUMBER(s->number >= 1, 1);
  NUMBER(s->time, UTC + 900);
  NUMBER(s->clock, linegate_v1_CLOCK_SYNCHRONISED);
  NUMBER(s->node, 2);
  NUMBER(s->pdo, 2);
  NUMBER(s->lost, 17);
  NUMBER(s->values._length, 4);
  for (uint32_t i = 0; i < s->values._length; ++i)
    compare_pdo_value(&s->values._buffer[i], i);
}

void compare_pdo_update(const linegate_v1_PdoUpdate* s) {
  ADDRESS(s);
  NUMBER(s->node, 2);
  NUMBER(s->pdo, 2);
  NUMBER(s->time, UTC + 900);
  NUMBER(s->clock, linegate_v1_CLOCK_SYNCHRONISED);
  NUMBER(s->receptions, 3);
  NUMBER(s->values._length, 4);
  for (uint32_t i = 0; i < s->values._length; ++i)
    compare_pdo_value(&s->values._buffer[i], i);
}

/* Called for the last thousand events, in order. */
void compare_event(const linegate_v1_Event* s) {
  static uint64_t expected = LAST_EVENT - 999;
  const uint8_t data[5] = {1, 2, 3, 4, 5};
  char text[64];
  snprintf(text, sizeof text, "node 42: EMCY 8130h, number %u", (unsigned)expected);
  ADDRESS(s);
  NUMBER(s->number, expected);
  NUMBER(s->time, UTC + (int64_t)expected);
  NUMBER(s->clock, linegate_v1_CLOCK_SYNCHRONISED);
  NUMBER(s->kind, linegate_v1_EVENT_EMCY);
  NUMBER(s->severity, linegate_v1_SEVERITY_WARNING);
  NUMBER(s->node, 42);
  NUMBER(s->code, 0x8130);
  NUMBER(s->value, 0x11);
  BYTES(s->data, data, sizeof data);
  TEXT(s->text, text);
  compare_properties(&s->properties, 3);
  if (s->properties._length == 3) {
    TEXT(s->properties._buffer[2].name, "stream");
    TEXT(s->properties._buffer[2].value, "face000000000001");
  }
  ++expected;
}
