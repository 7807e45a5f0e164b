# SPDX-License-Identifier: Apache-2.0
"""liblinegate-client by ctypes: the structs and functions of linegate.h."""

from __future__ import annotations

import ctypes
import os
from ctypes import (CFUNCTYPE, POINTER, Structure, c_char, c_char_p, c_double, c_int, c_int32, c_int64, c_size_t,
                    c_uint, c_uint8, c_uint16, c_uint32, c_uint64, c_void_p)

VALUE_BYTES = 256
UNIT_BYTES = 36


class Options(Structure):
    """linegate_options."""
    _fields_ = [("size", c_size_t), ("domain", c_uint32), ("strength", c_uint32), ("profile", c_char_p),
                ("identity", c_char_p), ("name", c_char_p), ("read_only", c_int), ("interfaces", c_char_p),
                ("peers", c_char_p), ("discovery_servers", c_char_p), ("multicast", c_int), ("lines", c_char_p)]


class Value(Structure):
    """linegate_value."""
    _fields_ = [("type", c_int32), ("quality", c_int32), ("known", c_int32), ("length", c_uint32), ("time", c_int64),
                ("integer", c_int64), ("unsigned_integer", c_uint64), ("real", c_double), ("number", c_double),
                ("bytes", c_uint8 * VALUE_BYTES), ("raw", c_double), ("raw_type", c_int32), ("unit", c_char * UNIT_BYTES)]


class Image(Structure):
    """linegate_image."""
    _fields_ = [("time", c_int64), ("sequence", c_uint64), ("lost", c_uint64)]


class Setting(Structure):
    """linegate_setting."""
    _fields_ = [("name", c_char_p), ("type", c_int32), ("raw", c_int32), ("integer", c_int64),
                ("unsigned_integer", c_uint64), ("real", c_double), ("bytes", c_char_p), ("length", c_size_t)]


class Event(Structure):
    """linegate_event."""
    _fields_ = [("size", c_size_t), ("gateway", c_char_p), ("line", c_char_p), ("name", c_char_p), ("text", c_char_p),
                ("number", c_uint64), ("stream", c_uint64), ("time", c_int64), ("code", c_uint32),
                ("value", c_uint32), ("kind", c_uint8), ("severity", c_uint8), ("node", c_uint8),
                ("length", c_uint8), ("data", c_uint8 * 64), ("missed", c_uint64), ("journal_lost", c_int)]


class Request(Structure):
    """linegate_request."""
    _fields_ = [("size", c_size_t), ("kind", c_uint8), ("node", c_uint8), ("index", c_uint16), ("sub", c_uint8),
                ("nmt", c_uint8), ("code", c_uint16), ("error_register", c_uint8), ("entry", c_uint32),
                ("layout_id", c_uint64), ("data", c_char_p), ("length", c_size_t), ("attempts", c_uint)]


class Object(Structure):
    """linegate_object."""
    _fields_ = [("size", c_size_t), ("index", c_uint16), ("sub", c_uint8), ("access", c_uint8), ("type", c_uint16),
                ("mappable", c_uint8), ("stored", c_uint8), ("application", c_uint8), ("name", c_char_p),
                ("value", c_char_p), ("length", c_size_t)]


class BootResult(Structure):
    """linegate_boot_result."""
    _fields_ = [("size", c_size_t), ("node", c_uint8), ("letter", c_char), ("reason", c_uint8), ("ok", c_uint8),
                ("index", c_uint16), ("sub", c_uint8), ("abort", c_uint32), ("expected", c_uint32), ("found", c_uint32),
                ("text", c_char_p)]


class Result(Structure):
    """linegate_result."""
    _fields_ = [("outcome", c_int32), ("code", c_uint32), ("length", c_uint64), ("number", c_uint64),
                ("progress_done", c_uint32), ("progress_total", c_uint32), ("text", c_char * 256)]


ON_VALUES = CFUNCTYPE(None, c_void_p, POINTER(Value), c_size_t, POINTER(Image))
ON_LINE = CFUNCTYPE(None, c_void_p, c_char_p, c_char_p, c_int, c_int, c_int)
ON_EVENT = CFUNCTYPE(None, c_void_p, POINTER(Event))
ON_GROUP = CFUNCTYPE(None, c_void_p, c_int, c_int)
NAMES = POINTER(c_char_p)

# By function: type of the result, types of the arguments.
FUNCTIONS = {
    "linegate_error_text": (c_char_p, [c_int]),
    "linegate_version": (c_char_p, []),
    "linegate_connect": (c_void_p, [POINTER(Options), c_char_p, c_size_t]),
    "linegate_close": (c_int, [c_void_p]),
    "linegate_poll": (c_int, [c_void_p, c_int]),
    "linegate_wake": (c_int, [c_void_p]),
    "linegate_status_text": (c_char_p, [c_int]),
    "linegate_line": (c_int, [c_void_p, c_char_p]),
    "linegate_line_status": (c_int, [c_void_p, c_int]),
    "linegate_line_wait": (c_int, [c_void_p, c_int, c_int]),
    "linegate_line_name": (c_int, [c_void_p, c_int, c_int, c_size_t, c_char_p, c_size_t]),
    "linegate_quality_text": (c_char_p, [c_int]),
    "linegate_read": (c_int, [c_void_p, c_int, NAMES, c_size_t, POINTER(Value), POINTER(Image)]),
    "linegate_subscribe": (c_int, [c_void_p, c_int, NAMES, c_size_t, ON_VALUES, c_void_p]),
    "linegate_subscribe_lines": (c_int, [c_void_p, ON_LINE, c_void_p]),
    "linegate_subscribe_events": (c_int, [c_void_p, ON_EVENT, c_void_p]),
    "linegate_follow_events": (c_int, [c_void_p, c_char_p, ON_EVENT, c_void_p]),
    "linegate_event_position": (c_int, [c_void_p, c_int, c_char_p, c_size_t]),
    "linegate_unsubscribe": (c_int, [c_void_p, c_int]),
    "linegate_group": (c_int, [c_void_p, c_int, c_char_p, c_int, c_uint]),
    "linegate_set": (c_int, [c_void_p, c_int, POINTER(Setting), c_size_t, POINTER(c_size_t)]),
    "linegate_arm": (c_int, [c_void_p, c_int]),
    "linegate_release": (c_int, [c_void_p, c_int]),
    "linegate_group_state": (c_int, [c_void_p, c_int, c_char_p, c_size_t]),
    "linegate_group_owner": (c_int, [c_void_p, c_int, c_char_p, c_size_t]),
    "linegate_subscribe_group": (c_int, [c_void_p, c_int, ON_GROUP, c_void_p]),
    "linegate_request_call": (c_int, [c_void_p, c_int, POINTER(Request), c_int]),
    "linegate_set_attempts": (c_int, [c_void_p, c_int, c_uint]),
    "linegate_write_output": (c_int, [c_void_p, c_int, POINTER(Setting), c_int]),
    "linegate_trigger_pdos_of": (c_int, [c_void_p, c_int, c_char_p, c_int]),
    "linegate_create_object": (c_int, [c_void_p, c_int, POINTER(Object), c_int64, c_int]),
    "linegate_call_wait": (c_int, [c_void_p, c_int]),
    "linegate_call_boot": (c_int, [c_void_p, c_int, c_size_t, POINTER(BootResult)]),
    "linegate_call_result": (c_int, [c_void_p, c_int, POINTER(Result)]),
    "linegate_call_data": (c_int, [c_void_p, c_int, c_char_p, c_size_t]),
    "linegate_call_cancel": (c_int, [c_void_p, c_int]),
    "linegate_free": (c_int, [c_void_p, c_int]),
}


def load() -> ctypes.CDLL:
    """The library; LINEGATE_CLIENT_LIBRARY is the path of another one than the installed."""
    library = ctypes.CDLL(os.environ.get("LINEGATE_CLIENT_LIBRARY", "liblinegate-client.so.1"))
    for name, (result, arguments) in FUNCTIONS.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library
