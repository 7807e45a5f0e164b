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
  LINEGATE_ERROR_AMBIGUOUS = -3, /* several gateways have that line: GATEWAY/LINE; or that name */
  LINEGATE_ERROR_NAME = -4,      /* no such output or group */
  LINEGATE_ERROR_TYPE = -5,      /* the value is not of the type of the output */
  LINEGATE_ERROR_RANGE = -6, /* it does not fit the type of the output, or is beyond its limits */
  LINEGATE_ERROR_TOO_LONG = -7,  /* more than 4096 outputs; or a buffer is too short */
  LINEGATE_ERROR_CLOSED = -8,    /* the client was closed */
  LINEGATE_ERROR_TIMEOUT = -9,   /* the time has passed */
  LINEGATE_ERROR_FAILED = -10,   /* of a call: linegate_call_result() has the reason */
  LINEGATE_ERROR_MEMORY = -11,   /* no memory, or a failure of the DDS library */
  LINEGATE_ERROR_FULL = -12,     /* 65,536 lines, groups, calls and subscriptions were not freed */
  LINEGATE_ERROR_MALFORMED = -13 /* the gateway answered in a form that this version cannot read */
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
  /* Receive these lines alone: GATEWAY/LINE, separated by commas, of gateways with dds:
   * {partitions: true}; nothing is received of other gateways. NULL: all lines. Only without an
   * identity. Since LINEGATE_2; the options of a program that was built before end here. */
  const char* lines;
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
  LINEGATE_STATUS_AMBIGUOUS /* several gateways have it, or its gateway has a namesake */
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
  LINEGATE_NAME_AMBIGUOUS  /* as of LINEGATE_STATUS_AMBIGUOUS */
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

/* size: in call-backs that of the version of the library: an older one does not set the members
 * behind it. For linegate_call_event() set by the caller, as of each struct there. */
typedef struct linegate_event {
  size_t size;
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
/* Each begins a call and returns its number: COMMAND_SDO_READ, COMMAND_SDO_WRITE, COMMAND_NMT, and
 * any command by its members. timeout_ms: until the answer, waiting for the line included; at most
 * 24 hours. node: 1 to 127, of linegate_nmt() also 0 = all. A number out of its range refuses the
 * call at once, as those of the typed commands below. */
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

/* ---- typed commands ---- */

/* The other commands of the contract, with their parameters. What they do is in linegate.idl, at
 * the CommandKind that the comment of each names, and in COMMANDS.md. Each begins a call and
 * returns its number; it is tried as linegate_set_attempts() says. A number out of its range is not
 * sent: it refuses the call at once, with REFUSAL_BAD_REQUEST, and the text of its result names the
 * parameter and its range, as "node is not 1..127". A null pointer, more than 16 MiB of data, and
 * flags that do not exist are LINEGATE_ERROR_ARGUMENT. node: 1 to 127; 0 = all where it says so.
 * index: 0 to FFFFh. sub: 0 to 255. Values of objects are bytes, little-endian. All of this section
 * and of the next one is since LINEGATE_2. */

/* A time-out in milliseconds for commands that wait for devices: scan, boot, configure, program,
 * LSS fastscan and assignment, SDO connections. */
#define LINEGATE_LONG 600000

enum {
  LINEGATE_BY_SDO = 1,  /* by SDO in any case */
  LINEGATE_KEEP_PDO = 2 /* the PDO is sent by linegate_trigger_pdo() */
};
/* COMMAND_OBJECT_WRITE: by PDO if one carries the object, else by SDO. flags: 0, or a sum of the
 * above. Result: linegate_call_delivery(). */
int linegate_write_object(linegate_client* client, int line, unsigned node, unsigned index,
                          unsigned sub, const void* value, size_t length, unsigned flags,
                          int timeout_ms);
/* COMMAND_OUTPUT_WRITE: one output, by a person, by its name, in its unit unless it is raw. The
 * line must be ready. Result: linegate_call_delivery(). */
int linegate_write_output(linegate_client* client, int line, const linegate_setting* output,
                          int timeout_ms);
/* COMMAND_NETWORK_READ, COMMAND_NETWORK_WRITE: of a device in another network (CiA 302-7). network:
 * 1 to 65535. */
int linegate_read_network(linegate_client* client, int line, unsigned network, unsigned node,
                          unsigned index, unsigned sub, int timeout_ms);
int linegate_write_network(linegate_client* client, int line, unsigned network, unsigned node,
                           unsigned index, unsigned sub, const void* value, size_t length,
                           int timeout_ms);
/* COMMAND_LOCAL_READ, COMMAND_LOCAL_WRITE: the own object dictionary of the line. node: of a device
 * in role device, 0 = the only one. as_owner: not 0: as the device itself, LOCAL_WRITE_OWN. */
int linegate_read_own(linegate_client* client, int line, unsigned index, unsigned sub,
                      unsigned node, int timeout_ms);
int linegate_write_own(linegate_client* client, int line, unsigned index, unsigned sub,
                       const void* value, size_t length, unsigned node, int as_owner,
                       int timeout_ms);
/* COMMAND_LOCAL_READ of a list. node: 0, or the one whose device file is listed. Result:
 * linegate_call_object(). */
int linegate_list_objects(linegate_client* client, int line, unsigned first, unsigned last,
                          unsigned node, int timeout_ms);

typedef struct linegate_object {
  size_t size; /* sizeof(linegate_object) */
  uint16_t index;
  uint8_t sub;
  uint8_t access;      /* 0 ro, 1 wo, 2 rw, 3 rwr, 4 rww, 5 const */
  uint16_t type;       /* CiA 301 data type */
  uint8_t mappable;    /* not 0: PDOs can map it */
  uint8_t stored;      /* not 0: by 1010h */
  uint8_t application; /* not 0: of an application; has no effect in linegate_create_object() */
  const char* name;    /* at most 255 bytes */
  const void* value;   /* empty: not readable, or longer than 255 bytes */
  size_t length;       /* of value */
} linegate_object;
/* COMMAND_OBJECT_CREATE: with its default in `value`. index: 2000h to 5EFFh or 6000h to 9FFFh. sub:
 * 0 to 254. image_byte: its bytes are those of the image from there on; below 0: they are not. */
int linegate_create_object(linegate_client* client, int line, const linegate_object* object,
                           int64_t image_byte, int timeout_ms);
int linegate_remove_object(linegate_client* client, int line, unsigned index, int timeout_ms);

/* COMMAND_SCAN. node: 0 = all. Result: linegate_call_scanned(). */
int linegate_scan(linegate_client* client, int line, unsigned node, int timeout_ms);
/* COMMAND_SCAN_APPLY. set_up, restore: not 0: SCAN_SET_UP, SCAN_RESTORE. Result likewise. */
int linegate_apply_scan(linegate_client* client, int line, unsigned node, int set_up, int restore,
                        int timeout_ms);
/* COMMAND_BOOT. node: 0 = all of the network list. Result: linegate_call_boot(). */
int linegate_boot(linegate_client* client, int line, unsigned node, int timeout_ms);
/* COMMAND_CONFIGURE, code 0 and 1. node: 0 = all. Result: linegate_call_configuration(). */
int linegate_compare(linegate_client* client, int line, unsigned node, int timeout_ms);
int linegate_configure(linegate_client* client, int line, unsigned node, int timeout_ms);
/* COMMAND_PROGRAM. number: of the program, 1 to 255. program: 1 byte to 16 MiB. Result of a
 * failure: linegate_call_program_fault(). */
int linegate_program(linegate_client* client, int line, unsigned node, unsigned number,
                     const void* program, size_t length, int timeout_ms);

/* 1018h:1 to 4. */
typedef struct linegate_lss_address {
  uint32_t vendor;
  uint32_t product;
  uint32_t revision;
  uint32_t serial;
} linegate_lss_address;
/* COMMAND_LSS, codes 0 to 11 (CiA 305). The call is done whatever the outcome is. Result:
 * linegate_call_lss(). */
int linegate_lss_switch_global(linegate_client* client, int line, int configuration,
                               int timeout_ms);
int linegate_lss_switch_selective(linegate_client* client, int line,
                                  const linegate_lss_address* address, int timeout_ms);
/* node: 1 to 127; 255 = none. unchecked: not 0: without the check that no other device uses it. */
int linegate_lss_set_node_id(linegate_client* client, int line, unsigned node, int unchecked,
                             int timeout_ms);
/* table: 0 = that of CiA 305, to 255; index: 0 to 255, in it. */
int linegate_lss_set_bit_timing(linegate_client* client, int line, unsigned table, unsigned index,
                                int timeout_ms);
/* delay_ms: 0 to 65535. */
int linegate_lss_activate_bit_timing(linegate_client* client, int line, unsigned delay_ms,
                                     int timeout_ms);
int linegate_lss_store(linegate_client* client, int line, int timeout_ms);
int linegate_lss_inquire_address(linegate_client* client, int line, int timeout_ms);
int linegate_lss_inquire_node_id(linegate_client* client, int line, int timeout_ms);
int linegate_lss_identify(linegate_client* client, int line, const linegate_lss_address* lowest,
                          uint32_t highest_revision, uint32_t highest_serial, int timeout_ms);
int linegate_lss_identify_unconfigured(linegate_client* client, int line, int timeout_ms);
/* known: bit 0 vendor, 1 product, 2 revision, 3 serial number of `address` are known. 0: address
 * may be NULL. */
int linegate_lss_fastscan(linegate_client* client, int line, unsigned known,
                          const linegate_lss_address* address, int timeout_ms);
/* Further results: linegate_call_assignment(). */
int linegate_lss_assign_node_ids(linegate_client* client, int line, int timeout_ms);

/* COMMAND_PDO_TRIGGER: by the number of the PDO, 1 to 65535, with `node` by that of its RPDO, 1 to
 * 512; or all that carry that output. Result: linegate_call_pdo(). */
int linegate_trigger_pdo(linegate_client* client, int line, unsigned number, unsigned node,
                         int timeout_ms);
int linegate_trigger_pdos_of(linegate_client* client, int line, const char* output, int timeout_ms);
/* COMMAND_PDO_REQUEST. number: of a TPDO of the node, 1 to 512; node 0: of an RPDO of the own node,
 * 1 to 65535. */
int linegate_request_pdo(linegate_client* client, int line, unsigned node, unsigned number,
                         int timeout_ms);
/* COMMAND_MPDO_WRITE: 1 to 4 bytes. node 0 = all. tpdo: 1 to 512; 0 = the first in that mode.
 * Result: linegate_call_pdo(). */
int linegate_write_mpdo(linegate_client* client, int line, unsigned node, unsigned index,
                        unsigned sub, const void* value, size_t length, unsigned tpdo,
                        int timeout_ms);
/* COMMAND_EMCY_SEND. code: 0 to FFFFh. error_register: 0 to 255. manufacturer: 5 bytes; NULL:
 * zeros. node: of a device in role device, 0 = the only one. */
int linegate_send_emcy(linegate_client* client, int line, unsigned code, unsigned error_register,
                       const uint8_t* manufacturer, unsigned node, int timeout_ms);

enum {
  LINEGATE_EXTENDED = 1, /* with a 29-bit identifier */
  LINEGATE_FD = 2,       /* a frame of CAN FD: up to 64 bytes */
  LINEGATE_BIT_RATE_SWITCH = 4
};
/* COMMAND_CAN_SEND: a frame that no service of the line uses. identifier: 0 to 7FFh; extended: to
 * 1FFFFFFFh. length: 0 to 8; of CAN FD also 12, 16, 20, 24, 32, 48 or 64. flags: 0, or a sum of the
 * above. */
int linegate_send_frame(linegate_client* client, int line, uint32_t identifier, const void* data,
                        size_t length, unsigned flags, int timeout_ms);
/* length: that is requested, 0 to 8. extended: not 0: with a 29-bit identifier. */
int linegate_send_remote_frame(linegate_client* client, int line, uint32_t identifier,
                               unsigned length, int extended, int timeout_ms);
/* COMMAND_CAN_LISTEN: such frames as events for that time, at most 3600 s, 0 = no more. identifier,
 * mask: 0 to 1FFFFFFFh. mask: the bits of the identifier that are compared. extended: 1 only frames
 * with 29-bit, 0 with 11-bit identifiers, below 0: both. */
int linegate_listen(linegate_client* client, int line, unsigned seconds, uint32_t identifier,
                    uint32_t mask, int extended, int timeout_ms);
/* COMMAND_ROUTING_TRACE: 1 s to 1 h. */
int linegate_trace_routing(linegate_client* client, int line, unsigned seconds, int timeout_ms);

/* COMMAND_CONNECTION_OPEN, COMMAND_CONNECTION_CLOSE, COMMAND_CONNECTION_LIST: SDO connections
 * between two nodes. Result of the first and the last: linegate_call_connection(). */
int linegate_open_connection(linegate_client* client, int line, unsigned client_node,
                             unsigned server_node, int timeout_ms);
int linegate_close_connection(linegate_client* client, int line, uint32_t number, int timeout_ms);
int linegate_connections(linegate_client* client, int line, int timeout_ms);

/* COMMAND_SLEEP, code 0 to 5. Result of the first two: linegate_call_objection(). */
int linegate_check_sleep(linegate_client* client, int line, int timeout_ms);
int linegate_sleep(linegate_client* client, int line, int timeout_ms);
int linegate_sleep_unchecked(linegate_client* client, int line, int timeout_ms);
int linegate_wake_up(linegate_client* client, int line, int timeout_ms);
/* object: not 0: the own node objects to sleep; 0: it consents again. */
int linegate_object_to_sleep(linegate_client* client, int line, int object, int timeout_ms);

/* Of the gateway: COMMAND_VERSIONS, COMMAND_BUS_RESTART, COMMAND_BUS_FAULT. Data of the first and
 * the last: a text, without a 0 at its end; of set_bus_faults all faults, or, if it is refused, the
 * error in words. */
int linegate_versions(linegate_client* client, int line, int timeout_ms);
int linegate_restart_bus(linegate_client* client, int line, int timeout_ms);
int linegate_set_bus_faults(linegate_client* client, int line, const char* faults, int timeout_ms);

enum {
  LINEGATE_JOURNAL_NODE = 2, /* the number of the flag in COMMANDS.md */
  LINEGATE_JOURNAL_KIND = 4,
  LINEGATE_JOURNAL_SINCE = 8,
  LINEGATE_JOURNAL_UNTIL = 16,
  LINEGATE_JOURNAL_NEWEST_FIRST = 64,
  LINEGATE_JOURNAL_VALUES = 128 /* of the value history, instead of events */
};
typedef struct linegate_journal_query {
  size_t size;      /* sizeof(linegate_journal_query) */
  uint32_t flags;   /* a sum of LINEGATE_JOURNAL_ numbers: the members below that are conditions */
  uint32_t most;    /* of the page; 0: as many as fit */
  const char* line; /* "": the gateway itself; NULL: all */
  const char* text; /* part of the text; of values: name, `*` = any text; NULL: all */
  uint8_t node;     /* 0: events of the line itself */
  uint8_t kind;     /* EventKind of linegate.idl; not of values */
  uint8_t severity; /* this one and worse: 0 information, 1 warning, 2 error; not of values */
  int64_t since;    /* inclusive */
  int64_t until;    /* exclusive */
  uint64_t cursor_position; /* of the page before; 0, 0: none */
  uint64_t cursor_check;
} linegate_journal_query;
/* COMMAND_JOURNAL_READ. Result: linegate_call_page(). */
int linegate_read_journal(linegate_client* client, int line, const linegate_journal_query* query,
                          int timeout_ms);

/* ---- results of typed commands ---- */

/* Each copies a part of the result of a call: of the only one, or of the one at a place, from 0 on.
 * What it points to exists until linegate_free() of the call, or the end of the client. `size` of
 * each struct is sizeof, set by the caller. Abort codes are those of CiA 301, 0 = none. Returns
 * LINEGATE_OK; LINEGATE_ERROR_NAME: there is none at that place; LINEGATE_ERROR_FAILED: the call
 * failed, or is pending; LINEGATE_ERROR_ARGUMENT: it is of another command;
 * LINEGATE_ERROR_MALFORMED: the command was carried out, and its result cannot be read. */

/* How a value of an object or output was sent. */
typedef struct linegate_delivery {
  size_t size;
  int32_t way;  /* 0 the own node, or no PDO carries the output, 1 by SDO, 2 by PDO */
  int32_t wait; /* what its PDO waits for, COMMANDS.md; 0: the bus acknowledged the frame */
  uint32_t pdo; /* its number on the line */
  const uint32_t* missing; /* wait 2: entries of the output layout that were never written */
  size_t missing_count;
} linegate_delivery;
int linegate_call_delivery(linegate_client* client, int call, linegate_delivery* delivery);

int linegate_call_object(linegate_client* client, int call, size_t place, linegate_object* object);

typedef struct linegate_scanned_node {
  size_t size;
  uint8_t node;
  uint32_t abort; /* that ended it early */
  size_t values;  /* their number */
} linegate_scanned_node;
int linegate_call_scanned(linegate_client* client, int call, size_t place,
                          linegate_scanned_node* node);
typedef struct linegate_object_value {
  size_t size;
  uint16_t index;
  uint8_t sub;
  const void* value;
  size_t length;
} linegate_object_value;
/* A value of the node at a place. */
int linegate_call_scanned_value(linegate_client* client, int call, size_t place, size_t value_place,
                                linegate_object_value* value);

typedef struct linegate_boot_result {
  size_t size;
  uint8_t node;
  char letter;    /* error status of CiA 302-2; 0: booted */
  uint8_t reason; /* 0 none, 1 a transfer was aborted, 2 a value differs, 3 object written last */
  uint8_t ok;     /* 1: it was booted, or was running */
  uint16_t index; /* the object that caused the failure */
  uint8_t sub;
  uint32_t abort;
  uint32_t expected;
  uint32_t found;
  const char* text; /* in words */
} linegate_boot_result;
int linegate_call_boot(linegate_client* client, int call, size_t place, linegate_boot_result* boot);

/* The configuration of a node, compared or applied. */
typedef struct linegate_configuration {
  size_t size;
  uint8_t node;
  char letter;        /* of its boot, as in linegate_boot_result */
  uint8_t ok;         /* 1: it is as configured */
  uint32_t abort;     /* that ended it */
  size_t differences; /* their number */
} linegate_configuration;
int linegate_call_configuration(linegate_client* client, int call, size_t place,
                                linegate_configuration* configuration);
typedef struct linegate_difference {
  size_t size;
  uint16_t index;
  uint8_t sub;
  uint32_t abort; /* why it could not be read or written */
  const void* expected;
  size_t expected_length;
  const void* found;
  size_t found_length;
} linegate_difference;
/* A difference of the node at a place. */
int linegate_call_difference(linegate_client* client, int call, size_t place,
                             size_t difference_place, linegate_difference* difference);

typedef struct linegate_program_fault {
  size_t size;
  uint16_t index; /* of the object that the device reported */
  uint8_t sub;
  uint32_t value;
} linegate_program_fault;
/* Of a call that failed with LINEGATE_SDO_ABORT. */
int linegate_call_program_fault(linegate_client* client, int call, linegate_program_fault* fault);

typedef struct linegate_lss_result {
  size_t size;
  uint8_t outcome; /* 0 done, 1 no response, 2 refused, 3 several devices are in configuration
                      state, 4 another device uses the node-ID */
  uint8_t error;   /* of a refusal */
  uint8_t specific_error;
  uint8_t node;                 /* of inquire_node_id; 255: none */
  linegate_lss_address address; /* of inquire_address and fastscan */
  size_t assignments;           /* of assign_node_ids: their number */
} linegate_lss_result;
int linegate_call_lss(linegate_client* client, int call, linegate_lss_result* result);
/* A device that linegate_lss_assign_node_ids() found. */
typedef struct linegate_lss_assignment {
  size_t size;
  uint8_t verdict; /* COMMANDS.md, below COMMAND_LSS */
  uint8_t node;    /* 0: none */
  uint8_t error;
  uint8_t specific_error;
  linegate_lss_address address;
} linegate_lss_assignment;
int linegate_call_assignment(linegate_client* client, int call, size_t place,
                             linegate_lss_assignment* assignment);

/* Returns the number of a PDO, or LINEGATE_ERROR_NAME. */
int linegate_call_pdo(linegate_client* client, int call, size_t place);
/* Returns the node-ID of a node that objects to sleep, or LINEGATE_ERROR_NAME. */
int linegate_call_objection(linegate_client* client, int call, size_t place);

typedef struct linegate_connection {
  size_t size;
  uint32_t number;
  uint8_t client; /* node-IDs */
  uint8_t server;
  uint16_t client_object; /* 1280h to 12FFh; 0: not found yet */
  uint16_t server_object; /* 1201h to 127Fh */
  uint16_t request_id;    /* CAN-IDs; 0: not assigned yet */
  uint16_t response_id;
  uint8_t state;  /* 0 opening, 1 open, 2 closing, 3 stale */
  uint32_t abort; /* stale: of the write that should have released it */
} linegate_connection;
int linegate_call_connection(linegate_client* client, int call, size_t place,
                             linegate_connection* connection);

typedef struct linegate_journal_page {
  size_t size;
  size_t events;            /* their number */
  size_t values;            /* their number */
  uint64_t cursor_position; /* of the next page */
  uint64_t cursor_check;
  int more;          /* 1: the page does not reach the end */
  int unknown_entry; /* 1: the gateway stores no entry that fulfils the conditions */
} linegate_journal_page;
int linegate_call_page(linegate_client* client, int call, linegate_journal_page* page);
/* `gateway` and `name` of the event are empty. Its `size` is sizeof, set by the caller. */
int linegate_call_event(linegate_client* client, int call, size_t place, linegate_event* event);
/* From its time on, until the next one of the same line, direction, node and name. */
typedef struct linegate_history_value {
  size_t size;
  const char* line;
  const char* name;
  const char* unit;
  int64_t time;
  uint64_t value; /* its bits */
  double scale;   /* the value in the unit is that of the bits * scale + offset */
  double offset;
  uint16_t type; /* CiA 301 data type */
  uint16_t bits; /* its size, 1 to 64 */
  uint8_t node;
  uint8_t output; /* 1: of an output */
  uint8_t valid;  /* 0: no value is valid, or known */
} linegate_history_value;
int linegate_call_history_value(linegate_client* client, int call, size_t place,
                                linegate_history_value* value);

#ifdef __cplusplus
}
#endif

#endif
