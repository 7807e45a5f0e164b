// SPDX-License-Identifier: Apache-2.0
/* linegate.h: the client library in C (C99): values of CAN lines by name, outputs, commands and
 * events, from gateways in a DDS domain. Link the library
 * linegate-client: linegate::client of the CMake package, or pkg-config linegate-client. Its
 * functions have the symbol version LINEGATE_1 unless they say otherwise. What client.h says of its
 * classes holds for the functions of the same names.
 *
 * A client runs in the threads of its callers: call-backs are called and held outputs are written
 * within linegate_poll(), linegate_call_wait() and linegate_line_wait() alone. Functions of one
 * client may be called in several threads; each waits until the others have returned, and ends a
 * linegate_poll() early. After fork() the child has none of this: it may use no client, and ends
 * with _exit() or begins another program.
 *
 * A client is a pointer. Lines, groups, calls and subscriptions are numbers above 0 that belong to
 * their client. Each function checks them, also those of a client that was closed. A function that
 * returns int returns 0 or more, or one of the LINEGATE_ERROR_ numbers below 0. Strings are in
 * UTF-8 and end with 0. Times are UTC in nanoseconds since 1970-01-01 by the clock of the gateway,
 * 0 = never; time-outs are in milliseconds.
 *
 * Later versions of the library add functions, members at the ends of structs with a member `size`,
 * and numbers at the ends of enumerations. */
#ifndef LINEGATE_LINEGATE_H
#define LINEGATE_LINEGATE_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
  LINEGATE_OK = 0,
  LINEGATE_ERROR_ARGUMENT = -1, /* a null pointer, or a number that is not valid */
  LINEGATE_ERROR_NOT_READY =
      -2, /* the line or its layout was not received, or its gateway is lost */
  LINEGATE_ERROR_AMBIGUOUS = -3, /* several gateways have a line of that name: GATEWAY/LINE */
  LINEGATE_ERROR_NAME = -4,      /* no such output or group */
  LINEGATE_ERROR_TYPE = -5,      /* the value is not of the type of the output */
  LINEGATE_ERROR_RANGE = -6, /* it does not fit the type of the output, or is beyond its limits */
  LINEGATE_ERROR_TOO_LONG = -7, /* more than 4096 outputs; or a buffer is too short */
  LINEGATE_ERROR_CLOSED = -8,   /* the client was closed */
  LINEGATE_ERROR_TIMEOUT = -9,  /* the time has passed */
  LINEGATE_ERROR_FAILED = -10,  /* of a call: linegate_call_result() has the reason */
  LINEGATE_ERROR_MEMORY = -11,  /* no memory, or a failure of the DDS library */
  LINEGATE_ERROR_FULL = -12     /* 65,536 lines, groups, calls and subscriptions were not freed */
};
/* In words; never NULL. */
const char* linegate_error_text(int error);
/* "0.1.0" */
const char* linegate_version(void);

/* ---- client ---- */

typedef struct linegate_client linegate_client;

typedef struct linegate_options {
  size_t size;          /* sizeof(linegate_options) */
  uint32_t domain;      /* 0..232 */
  uint32_t strength;    /* ownership strength of outputs: the strongest client wins */
  const char* profile;  /* file of QoS profiles; NULL: the installed one, else a built-in one */
  const char* identity; /* folder of an identity for DDS-Security; NULL: the environment variable
                           LINEGATE_SECURITY, or without */
  const char* name;     /* unique in the domain; NULL: host, process ID and a number */
  int read_only;        /* not 0: with an identity of role viewer, which sends no requests */
  /* Interfaces of this host for DDS, and hosts of gateways that multicast does not reach: names or
   * IPv4 addresses, separated by commas. NULL: those of the profile, and none. */
  const char* interfaces;
  const char* peers;
  /* Discovery servers of Fast DDS instead of multicast and peers: [ID@]HOST[:PORT], separated by
   * commas; the ID is the position in this list, and the port 11811, if they are not given. NULL:
   * none. */
  const char* discovery_servers;
  /* Not 0: receive process images by multicast from gateways with dds: {fan_out: multicast}; from
   * others by unicast. Only without an identity. */
  int multicast;
} linegate_options;

/* options: NULL = all members 0. Returns NULL, and the reason in `error` (of `error_size` bytes;
 * may be NULL). */
linegate_client* linegate_connect(const linegate_options* options, char* error, size_t error_size);
/* Releases all groups. NULL is ignored. Not within a call-back. */
int linegate_close(linegate_client* client);
/* Receives samples, calls call-backs, and writes held outputs. Returns when something was received,
 * or the time has passed; may return early. Call it at least every 100 ms while outputs are held.
 */
int linegate_poll(linegate_client* client, int timeout_ms);
/* Ends the present linegate_poll(), or the next one. */
int linegate_wake(linegate_client* client);

/* ---- lines ---- */

typedef enum linegate_status {
  LINEGATE_STATUS_WAITING,  /* not, or not completely, received */
  LINEGATE_STATUS_READY,    /* values, outputs and commands are possible */
  LINEGATE_STATUS_SILENT,   /* its gateway published nothing for 3 s */
  LINEGATE_STATUS_LOST,     /* its gateway ended or is unreachable, or removed the line */
  LINEGATE_STATUS_AMBIGUOUS /* several gateways have a line of that name */
} linegate_status;
/* In words; never NULL. */
const char* linegate_status_text(int status);

/* Returns the number of a line by name: "LINE", or "GATEWAY/LINE". It need not exist yet. */
int linegate_line(linegate_client* client, const char* name);
/* Returns a linegate_status. */
int linegate_line_status(linegate_client* client, int line);
/* Polls until it is ready, at most for that time: LINEGATE_ERROR_TIMEOUT. */
int linegate_line_wait(linegate_client* client, int line, int timeout_ms);
/* Copies the name of an input (outputs: 0) or output (1) by its place from 0 on. Returns its
 * length; LINEGATE_ERROR_NAME: there is none; LINEGATE_ERROR_TOO_LONG: it was cut. */
int linegate_line_name(linegate_client* client, int line, int outputs, size_t place, char* name,
                       size_t name_size);

/* ---- values ---- */

typedef enum linegate_quality {
  LINEGATE_GOOD,    /* inputs: received from a node that is present; outputs: sent to the node */
  LINEGATE_NO_LINE, /* the line was not received yet */
  LINEGATE_NO_DATA, /* its layout or its image was not received yet */
  LINEGATE_NO_NAME, /* the layout has no such name */
  LINEGATE_NOT_RECEIVED,   /* inputs: no value was received from the node */
  LINEGATE_NODE_MISSING,   /* inputs: the node does not answer, or its heartbeat was lost */
  LINEGATE_NOT_SENT,       /* outputs: the newest value was not sent yet */
  LINEGATE_GATEWAY_SILENT, /* the gateway published nothing for 3 s; the value is the last one */
  LINEGATE_GATEWAY_LOST,   /* the gateway ended or is unreachable; likewise */
  LINEGATE_NAME_AMBIGUOUS  /* several gateways have a line of that name */
} linegate_quality;
const char* linegate_quality_text(int quality);

typedef enum linegate_type {
  LINEGATE_NONE,     /* there is no value */
  LINEGATE_BOOLEAN,  /* integer: 0 or 1 */
  LINEGATE_INTEGER,  /* integer; also TIME_OF_DAY and TIME_DIFFERENCE, in nanoseconds */
  LINEGATE_UNSIGNED, /* unsigned_integer */
  LINEGATE_REAL,     /* real */
  LINEGATE_TEXT,     /* bytes, in UTF-8, ends with 0 */
  LINEGATE_BYTES     /* bytes */
} linegate_type;

#define LINEGATE_VALUE_BYTES 256
#define LINEGATE_UNIT_BYTES 36

typedef struct linegate_value {
  int32_t type;    /* linegate_type */
  int32_t quality; /* linegate_quality; `number` is for any type */
  int32_t known;   /* outputs: it was written, or has a default */
  uint32_t length; /* of bytes; without the 0 at the end of a text */
  int64_t time;    /* of the last PDO that carried it; 0: none since linegate_connect() */
  int64_t integer; /* the value by `type`; the others are 0, but see raw */
  uint64_t unsigned_integer;
  double real;
  double number;                       /* of any type of number; 0 for text and bytes */
  uint8_t bytes[LINEGATE_VALUE_BYTES]; /* a longer value is cut */
  /* A value with a scale or offset in plant.yaml or its device file is a LINEGATE_REAL in its unit.
   * Then raw_type is the type of the value in the PDO, which is integer, unsigned_integer or raw.
   */
  double raw;                     /* the value in the PDO as a number; else the same as number */
  int32_t raw_type;               /* linegate_type; the same as `type` unless the value is scaled */
  char unit[LINEGATE_UNIT_BYTES]; /* of number, in UTF-8: "bar"; empty = none or unknown */
} linegate_value;

typedef struct linegate_image {
  int64_t time;      /* of the newest image */
  uint64_t sequence; /* of that image */
  uint64_t lost;     /* call-backs: images that this client did not receive since the last one */
} linegate_image;

/* The values of `count` names, of one moment for each direction. Names are those of `linegate
 * image`, of inputs, else of outputs; "inputs:NAME" and "outputs:NAME" name the direction. image:
 * NULL, or where to store it. Returns the number of values whose quality is LINEGATE_GOOD. */
int linegate_read(linegate_client* client, int line, const char* const* names, size_t count,
                  linegate_value* values, linegate_image* image);

typedef void (*linegate_on_values)(void* user, const linegate_value* values, size_t count,
                                   const linegate_image* image);
/* Calls back at the beginning, and when value or quality of one of them changes. Returns the number
 * of the subscription. */
int linegate_subscribe(linegate_client* client, int line, const char* const* names, size_t count,
                       linegate_on_values call_back, void* user);

typedef void (*linegate_on_line)(void* user, const char* gateway, const char* line, int status,
                                 int restarted, int layout_changed);
/* Calls back for each line at the beginning and when its status changes, its gateway was restarted,
 * or its layout is another one. */
int linegate_subscribe_lines(linegate_client* client, linegate_on_line call_back, void* user);

typedef struct linegate_event {
  const char* gateway;
  const char* line; /* empty: of the gateway itself */
  const char* name; /* of the kind: "heartbeat-lost"; empty: unknown to this version */
  const char* text; /* in words */
  uint64_t number;
  uint64_t stream; /* of the number */
  int64_t time;
  uint32_t code; /* by kind */
  uint32_t value;
  uint8_t kind;     /* EventKind of linegate.idl */
  uint8_t severity; /* 0 information, 1 warning, 2 error */
  uint8_t node;     /* 1..127, 0 = the line itself */
  uint8_t length;   /* of data */
  uint8_t data[64];
  uint64_t missed;  /* of linegate_follow_events(): numbers of the line directly before this one
                       without an event, at most so many are lost: a gateway that was killed leaves
                       numbers out */
  int journal_lost; /* whether its journal was lost, or the gateway has none and was started
                       again */
} linegate_event;
typedef void (*linegate_on_event)(void* user, const linegate_event* event);
/* Calls back for each event of all lines and gateways from now on, as they are received. */
int linegate_subscribe_events(linegate_client* client, linegate_on_event call_back, void* user);
/* Calls back for the events of all lines and gateways, those of a line in their order and each
 * once; what this client did not receive is read from the journals of the gateways. after:
 * linegate_event_position() of this or an earlier run, or "" for the oldest events that the
 * journals have, as for a line that the position does not name; NULL: from now on, and of a line
 * that appears later, once its state was received. With an identity
 * of role viewer, and of gateways without a journal, events that were not received are reported as
 * missed. Returns the number of the subscription. */
int linegate_follow_events(linegate_client* client, const char* after, linegate_on_event call_back,
                           void* user);
/* Where the application is, the event of a call-back that runs included: a text to be stored, of
 * some 40 bytes for each line. Returns its length, also with NULL. */
int linegate_event_position(linegate_client* client, int subscription, char* text, size_t size);
/* Ends the call-backs of a subscription. */
int linegate_unsubscribe(linegate_client* client, int subscription);

/* ---- outputs ---- */

typedef enum linegate_group_state_number {
  LINEGATE_GROUP_IDLE,    /* nothing is written: not armed yet, or released */
  LINEGATE_GROUP_TAKING,  /* is written; the gateway did not report that it applies the values */
  LINEGATE_GROUP_HELD,    /* the gateway applies the values */
  LINEGATE_GROUP_REFUSED, /* the gateway refused them; nothing is written */
  LINEGATE_GROUP_LOST     /* nothing is written, and the values are discarded */
} linegate_group_state_number;

/* A group of outputs by name or number; "" = 0, of a line without groups. watchdog_ms: time without
 * a sample after which the gateway reacts, 0 = never; reactions: WATCHDOG_ bits of linegate.idl, 1
 * = the outputs become 0. Nothing is written before linegate_arm(), and nothing after a loss until
 * the next linegate_arm(). */
int linegate_group(linegate_client* client, int line, const char* name, int watchdog_ms,
                   unsigned reactions);
/* Values are in the unit of the output, and rounded to the nearest value that its PDO can carry.
 * Those that are set between two linegate_poll() are sent together. They need a line that is ready.
 */
int linegate_set_integer(linegate_client* client, int group, const char* name, int64_t value);
int linegate_set_unsigned(linegate_client* client, int group, const char* name, uint64_t value);
int linegate_set_real(linegate_client* client, int group, const char* name, double value);
int linegate_set_bytes(linegate_client* client, int group, const char* name, const void* bytes,
                       size_t length);
/* A text in UTF-8: for VISIBLE_STRING characters up to U+00FF, for UNICODE_STRING any. Outputs of
 * OCTET_STRING and DOMAIN have its bytes. A shorter text is filled with zeros. */
int linegate_set_text(linegate_client* client, int group, const char* name, const char* text);
/* The value in the PDO: without scaling, and beyond the limits of the output. */
int linegate_set_raw_integer(linegate_client* client, int group, const char* name, int64_t value);
int linegate_set_raw_unsigned(linegate_client* client, int group, const char* name, uint64_t value);
int linegate_set_raw_real(linegate_client* client, int group, const char* name, double value);
typedef struct linegate_setting {
  const char* name;
  int32_t type; /* linegate_type: which of the following members has the value */
  int32_t raw;  /* not 0: the value in the PDO, of a type of number */
  int64_t integer;
  uint64_t unsigned_integer;
  double real;
  const void* bytes; /* of LINEGATE_TEXT and LINEGATE_BYTES */
  size_t length;     /* of bytes */
} linegate_setting;
/* Sets all of these values, or none of them. failed (may be NULL): the place of the first that is
 * not possible, from 0 on. */
int linegate_set(linegate_client* client, int group, const linegate_setting* settings, size_t count,
                 size_t* failed);
/* Begins to write. Outputs that were not set since the last loss or release keep their values: if
 * another client held the group within the time of its watchdog, those of that client. Another
 * client that is stronger, or was first, keeps the group: the state is then
 * LINEGATE_GROUP_TAKING until that one ends. */
int linegate_arm(linegate_client* client, int group);
/* Stops writing: after its time the watchdog reacts. */
int linegate_release(linegate_client* client, int group);
/* Returns a LINEGATE_GROUP_ number. text (may be NULL): the state in words, with its reason. */
int linegate_group_state(linegate_client* client, int group, char* text, size_t text_size);
/* The client whose values the gateway applied last. Returns the length. */
int linegate_group_owner(linegate_client* client, int group, char* owner, size_t owner_size);
typedef void (*linegate_on_group)(void* user, int group, int state);
/* Calls back when the state changes. Returns the number of the subscription. */
int linegate_subscribe_group(linegate_client* client, int group, linegate_on_group call_back,
                             void* user);

/* ---- commands ---- */

typedef enum linegate_outcome {
  LINEGATE_PENDING,
  LINEGATE_DONE,
  LINEGATE_SDO_ABORT,       /* code: SDO abort code of CiA 301 */
  LINEGATE_INTERFACE_ERROR, /* code: errno of the gateway's host */
  LINEGATE_REFUSED          /* code: Refusal of linegate.idl; 10 timed out, 13 cancelled */
} linegate_outcome;

/* The members of a CommandRequest: linegate.idl, COMMANDS.md. */
typedef struct linegate_request {
  size_t size;  /* sizeof(linegate_request) */
  uint8_t kind; /* CommandKind */
  uint8_t node;
  uint16_t index;
  uint8_t sub;
  uint8_t nmt;
  uint16_t code;
  uint8_t error_register;
  uint32_t entry;
  uint64_t layout_id;
  const void* data;
  size_t length;
  unsigned attempts; /* 0: linegate_set_attempts(). It is tried again after REFUSAL_BUSY; if it only
                        reads, also after the SDO abort 0504 0000h. After that abort a write may
                        have been carried out, so it is not repeated */
} linegate_request;

/* How often commands to this line that begin from now on are tried, as `attempts` of
 * linegate_request, which has precedence; 1 at first, 0 as 1. Since LINEGATE_2. */
int linegate_set_attempts(linegate_client* client, int line, unsigned attempts);
/* Each begins a call and returns its number. timeout_ms: until the answer, waiting for the line
 * included. */
int linegate_sdo_read(linegate_client* client, int line, unsigned node, unsigned index,
                      unsigned sub, int timeout_ms);
int linegate_sdo_write(linegate_client* client, int line, unsigned node, unsigned index,
                       unsigned sub, const void* value, size_t length, int timeout_ms);
int linegate_nmt(linegate_client* client, int line, unsigned node, unsigned command,
                 int timeout_ms);
int linegate_request_call(linegate_client* client, int line, const linegate_request* request,
                          int timeout_ms);
/* Polls until the call is done. Returns the length of its data, or LINEGATE_ERROR_FAILED. */
int linegate_call_wait(linegate_client* client, int call);

typedef struct linegate_result {
  int32_t outcome;        /* linegate_outcome */
  uint32_t code;          /* by outcome */
  uint64_t length;        /* of the data of the reply */
  uint64_t number;        /* they as a little-endian number of up to 8 bytes, else 0 */
  uint32_t progress_done; /* of a long command, by its last report; 0 = unknown */
  uint32_t progress_total;
  char text[256]; /* the error in words; empty if done */
} linegate_result;
int linegate_call_result(linegate_client* client, int call, linegate_result* result);
/* Copies at most `size` bytes of the data of the reply. Returns the number of bytes copied. */
int linegate_call_data(linegate_client* client, int call, void* data, size_t size);
/* Ends a call that is pending: refused, with code 13. The gateway may carry it out nevertheless. */
int linegate_call_cancel(linegate_client* client, int call);
typedef void (*linegate_on_call)(void* user, int call);
/* Calls back once when the call is done, within linegate_poll(). */
int linegate_call_notify(linegate_client* client, int call, linegate_on_call call_back, void* user);
/* Ends a line, a group (which is released) or a call (which goes on, without its call-back). Its
 * number is not used again. */
int linegate_free(linegate_client* client, int number);

#ifdef __cplusplus
}
#endif

#endif
