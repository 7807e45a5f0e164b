# SPDX-License-Identifier: Apache-2.0
"""liblinegate-client by ctypes: the structs and functions of linegate.h."""

from __future__ import annotations

import ctypes
import os
from ctypes import (CFUNCTYPE, POINTER, Structure, c_char, c_char_p, c_double, c_int, c_int32, c_int64, c_size_t,
                    c_uint, c_uint8, c_uint16, c_uint32, c_uint64, c_void_p)
from typing import Any

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
                ("value", c_void_p), ("length", c_size_t)]


class LssAddress(Structure):
    """linegate_lss_address."""
    _fields_ = [("vendor", c_uint32), ("product", c_uint32), ("revision", c_uint32), ("serial", c_uint32)]


class JournalQuery(Structure):
    """linegate_journal_query."""
    _fields_ = [("size", c_size_t), ("flags", c_uint32), ("most", c_uint32), ("line", c_char_p), ("text", c_char_p),
                ("node", c_uint8), ("kind", c_uint8), ("severity", c_uint8), ("since", c_int64), ("until", c_int64),
                ("cursor_position", c_uint64), ("cursor_check", c_uint64)]


class Delivery(Structure):
    """linegate_delivery."""
    _fields_ = [("size", c_size_t), ("way", c_int32), ("wait", c_int32), ("pdo", c_uint32),
                ("missing", POINTER(c_uint32)), ("missing_count", c_size_t)]


class ScannedNode(Structure):
    """linegate_scanned_node."""
    _fields_ = [("size", c_size_t), ("node", c_uint8), ("abort", c_uint32), ("values", c_size_t)]


class ObjectValue(Structure):
    """linegate_object_value."""
    _fields_ = [("size", c_size_t), ("index", c_uint16), ("sub", c_uint8), ("value", c_void_p), ("length", c_size_t)]


class Configuration(Structure):
    """linegate_configuration."""
    _fields_ = [("size", c_size_t), ("node", c_uint8), ("letter", c_char), ("ok", c_uint8), ("abort", c_uint32),
                ("differences", c_size_t)]


class Difference(Structure):
    """linegate_difference."""
    _fields_ = [("size", c_size_t), ("index", c_uint16), ("sub", c_uint8), ("abort", c_uint32), ("expected", c_void_p),
                ("expected_length", c_size_t), ("found", c_void_p), ("found_length", c_size_t)]


class ProgramFault(Structure):
    """linegate_program_fault."""
    _fields_ = [("size", c_size_t), ("index", c_uint16), ("sub", c_uint8), ("value", c_uint32)]


class LssResult(Structure):
    """linegate_lss_result."""
    _fields_ = [("size", c_size_t), ("outcome", c_uint8), ("error", c_uint8), ("specific_error", c_uint8),
                ("node", c_uint8), ("address", LssAddress), ("assignments", c_size_t)]


class LssAssignment(Structure):
    """linegate_lss_assignment."""
    _fields_ = [("size", c_size_t), ("verdict", c_uint8), ("node", c_uint8), ("error", c_uint8),
                ("specific_error", c_uint8), ("address", LssAddress)]


class Connection(Structure):
    """linegate_connection."""
    _fields_ = [("size", c_size_t), ("number", c_uint32), ("client", c_uint8), ("server", c_uint8),
                ("client_object", c_uint16), ("server_object", c_uint16), ("request_id", c_uint16),
                ("response_id", c_uint16), ("state", c_uint8), ("abort", c_uint32)]


class JournalPage(Structure):
    """linegate_journal_page."""
    _fields_ = [("size", c_size_t), ("events", c_size_t), ("values", c_size_t), ("cursor_position", c_uint64),
                ("cursor_check", c_uint64), ("more", c_int), ("unknown_entry", c_int)]


class HistoryValue(Structure):
    """linegate_history_value."""
    _fields_ = [("size", c_size_t), ("line", c_char_p), ("name", c_char_p), ("unit", c_char_p), ("time", c_int64),
                ("value", c_uint64), ("scale", c_double), ("offset", c_double), ("type", c_uint16), ("bits", c_uint16),
                ("node", c_uint8), ("output", c_uint8), ("valid", c_uint8)]


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



def _typed(*arguments: Any) -> tuple[Any, list[Any]]:
    """Begins a command to a line, with a time-out."""
    return c_int, [c_void_p, c_int, *arguments, c_int]


def _result(of: Any, *places: Any) -> tuple[Any, list[Any]]:
    """A part of the result of a call."""
    return c_int, [c_void_p, c_int, *places, POINTER(of)]


_DATA = (c_char_p, c_size_t)
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
    "linegate_sdo_read": _typed(c_uint, c_uint, c_uint),
    "linegate_sdo_write": _typed(c_uint, c_uint, c_uint, *_DATA),
    "linegate_nmt": _typed(c_uint, c_uint),
    "linegate_write_object": _typed(c_uint, c_uint, c_uint, *_DATA, c_uint),
    "linegate_write_output": _typed(POINTER(Setting)),
    "linegate_read_network": _typed(c_uint, c_uint, c_uint, c_uint),
    "linegate_write_network": _typed(c_uint, c_uint, c_uint, c_uint, *_DATA),
    "linegate_read_own": _typed(c_uint, c_uint, c_uint),
    "linegate_write_own": _typed(c_uint, c_uint, *_DATA, c_uint, c_int),
    "linegate_list_objects": _typed(c_uint, c_uint, c_uint),
    "linegate_create_object": _typed(POINTER(Object), c_int64),
    "linegate_remove_object": _typed(c_uint),
    "linegate_scan": _typed(c_uint),
    "linegate_apply_scan": _typed(c_uint, c_int, c_int),
    "linegate_boot": _typed(c_uint),
    "linegate_compare": _typed(c_uint),
    "linegate_configure": _typed(c_uint),
    "linegate_program": _typed(c_uint, c_uint, *_DATA),
    "linegate_lss_switch_global": _typed(c_int),
    "linegate_lss_switch_selective": _typed(POINTER(LssAddress)),
    "linegate_lss_set_node_id": _typed(c_uint, c_int),
    "linegate_lss_set_bit_timing": _typed(c_uint, c_uint),
    "linegate_lss_activate_bit_timing": _typed(c_uint),
    "linegate_lss_store": _typed(),
    "linegate_lss_inquire_address": _typed(),
    "linegate_lss_inquire_node_id": _typed(),
    "linegate_lss_identify": _typed(POINTER(LssAddress), c_uint32, c_uint32),
    "linegate_lss_identify_unconfigured": _typed(),
    "linegate_lss_fastscan": _typed(c_uint, POINTER(LssAddress)),
    "linegate_lss_assign_node_ids": _typed(),
    "linegate_trigger_pdo": _typed(c_uint, c_uint),
    "linegate_trigger_pdos_of": _typed(c_char_p),
    "linegate_request_pdo": _typed(c_uint, c_uint),
    "linegate_write_mpdo": _typed(c_uint, c_uint, c_uint, *_DATA, c_uint),
    "linegate_send_emcy": _typed(c_uint, c_uint, c_char_p, c_uint),
    "linegate_send_frame": _typed(c_uint32, *_DATA, c_uint),
    "linegate_send_remote_frame": _typed(c_uint32, c_uint, c_int),
    "linegate_listen": _typed(c_uint, c_uint32, c_uint32, c_int),
    "linegate_trace_routing": _typed(c_uint),
    "linegate_open_connection": _typed(c_uint, c_uint),
    "linegate_close_connection": _typed(c_uint32),
    "linegate_connections": _typed(),
    "linegate_check_sleep": _typed(),
    "linegate_sleep": _typed(),
    "linegate_sleep_unchecked": _typed(),
    "linegate_wake_up": _typed(),
    "linegate_object_to_sleep": _typed(c_int),
    "linegate_versions": _typed(),
    "linegate_restart_bus": _typed(),
    "linegate_set_bus_faults": _typed(c_char_p),
    "linegate_read_journal": _typed(POINTER(JournalQuery)),
    "linegate_call_wait": (c_int, [c_void_p, c_int]),
    "linegate_call_delivery": _result(Delivery),
    "linegate_call_object": _result(Object, c_size_t),
    "linegate_call_scanned": _result(ScannedNode, c_size_t),
    "linegate_call_scanned_value": _result(ObjectValue, c_size_t, c_size_t),
    "linegate_call_boot": _result(BootResult, c_size_t),
    "linegate_call_configuration": _result(Configuration, c_size_t),
    "linegate_call_difference": _result(Difference, c_size_t, c_size_t),
    "linegate_call_program_fault": _result(ProgramFault),
    "linegate_call_lss": _result(LssResult),
    "linegate_call_assignment": _result(LssAssignment, c_size_t),
    "linegate_call_pdo": (c_int, [c_void_p, c_int, c_size_t]),
    "linegate_call_objection": (c_int, [c_void_p, c_int, c_size_t]),
    "linegate_call_connection": _result(Connection, c_size_t),
    "linegate_call_page": _result(JournalPage),
    "linegate_call_event": _result(Event, c_size_t),
    "linegate_call_history_value": _result(HistoryValue, c_size_t),
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
