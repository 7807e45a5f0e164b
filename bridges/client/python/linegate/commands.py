# SPDX-License-Identifier: Apache-2.0
"""The commands to a line as functions with typed parameters and results, beside Line.sdo_read(), sdo_write() and nmt().

    press = linegate.commands.Commands(client.line("press"))
    for result in press.boot(8).result():  # with asyncio: await press.boot(8)
        print(result.node, result.letter)

What they do is in linegate.idl, at the CommandKind that each names. Each takes `timeout` and `attempts` as
Line.request() does. Each begins the function of the same name of linegate.h, which has the ranges of the numbers: one that is out
of its range is not sent, and its call fails with CallError, whose text names the parameter and its range, as "node is
not 1..127". A parameter of another type raises TypeError at once, a number that its type in linegate.h cannot hold
Error with code -6, and bytes or texts of a wrong form ValueError. Values of objects are bytes, little-endian; SDO abort
codes are those of CiA 301, 0 = none.
"""

from __future__ import annotations

import ctypes
import enum
import itertools
import struct
from dataclasses import dataclass
from typing import Any, Callable, Generator, Generic, Iterator, List, Optional, Sequence, TypeVar

from . import (Call, CallError, Event, Line, Outcome, Output, _checked, _encoded, _event, _lib, _number, _octets, _setting,
               _structure, _text, _whole)
from . import _library as c

T = TypeVar("T")
LONG = 600.0  # seconds, for commands that wait for devices


class Kind(enum.IntEnum):
    """CommandKind of linegate.idl."""
    SDO_READ, SDO_WRITE, LOCAL_READ, LOCAL_WRITE, OUTPUT_WRITE, EMCY_SEND, NMT, VERSIONS = range(8)
    NETWORK_READ, NETWORK_WRITE, BUS_RESTART, ROUTING_TRACE, SCAN, BUS_FAULT, BOOT, CONFIGURE = range(8, 16)
    PROGRAM, LSS, OBJECT_WRITE, PDO_TRIGGER, CAN_SEND, CAN_LISTEN, OBJECT_CREATE, SCAN_APPLY = range(16, 24)
    PDO_REQUEST, MPDO_WRITE, JOURNAL_READ, CONNECTION_OPEN, CONNECTION_CLOSE, CONNECTION_LIST, SLEEP = range(24, 31)


class Malformed(CallError):
    """The data of a reply are not those of its command."""


class Answer(Call, Generic[T]):
    """A call with a result: `await` it, or call result()."""

    def __init__(self, of: Call, read: Callable[[Call], T]) -> None:  # pylint: disable=super-init-not-called
        self._call, self._read = of, read  # the call ends with its last handle
        self._client, self._number = of._client, of._number

    def __del__(self) -> None:
        pass

    def result(self) -> T:  # type: ignore[override]
        """Polls until it is done, without an event loop. Raises CallError."""
        self._call.result()
        return self._read(self._call)

    def __await__(self) -> Generator[Any, None, T]:  # type: ignore[override]
        yield from self._call.__await__()
        return self._read(self._call)


class ProgramAnswer(Answer[None]):
    """Of program()."""

    def __init__(self, of: Call) -> None:
        super().__init__(of, lambda _call: None)

    @property
    def fault(self) -> Optional["ProgramFault"]:
        """What the device reported of a download that failed; None: nothing."""
        if self.outcome != Outcome.SDO_ABORT:
            return None
        fault = _one(self._call, _lib.linegate_call_program_fault, c.ProgramFault)
        return None if fault is None else ProgramFault(fault.index, fault.sub, fault.value)


@dataclass(frozen=True)
class Delivery:
    """How a value was sent. way: "" (own node, or carried by no PDO), "sdo" or "pdo". wait: what its PDO waits for,
    COMMANDS.md; 0: sent. missing: entries of the output layout that were never written."""
    way: str
    pdo: int = 0
    wait: int = 0
    missing: Sequence[int] = ()


@dataclass(frozen=True)
class ObjectValue:
    """A value that was read."""
    index: int
    sub: int
    value: bytes


@dataclass(frozen=True)
class ListedObject:
    """An object of a dictionary. access: 0 ro, 1 wo, 2 rw, 3 rwr, 4 rww, 5 const."""
    index: int
    sub: int
    type: int  # CiA 301 data type
    access: int
    mappable: bool = False  # PDOs can map it
    stored: bool = False  # by 1010h
    application: bool = False
    name: str = ""
    value: bytes = b""  # empty: not readable, or longer than 255 bytes


@dataclass(frozen=True)
class ScannedNode:
    """What a scan read from a node. abort: that ended it early."""
    node: int
    abort: int
    values: Sequence[ObjectValue]


@dataclass(frozen=True)
class BootResult:
    """Of a boot process. letter: error status of CiA 302-2, "" = booted. reason: 0 none, 1 a transfer was aborted, 2 a
    value differs, 3 the object was written last. text: in words. ok: it was booted, or was running."""
    node: int
    letter: str
    index: int
    sub: int
    reason: int
    abort: int
    expected: int
    found: int
    text: str
    ok: bool


@dataclass(frozen=True)
class Difference:
    """An object that differs from the configuration."""
    index: int
    sub: int
    abort: int
    expected: bytes
    found: bytes


@dataclass(frozen=True)
class Configuration:
    """The configuration of a node, compared or applied."""
    node: int
    letter: str
    abort: int
    differences: Sequence[Difference]

    @property
    def ok(self) -> bool:
        """Whether it is as configured."""
        return not (self.letter or self.abort or self.differences)


@dataclass(frozen=True)
class ProgramFault:
    """Of a failed program download: what the device reported."""
    index: int
    sub: int
    value: int


@dataclass(frozen=True)
class LssAddress:
    """1018h:1 to 4."""
    vendor: int = 0
    product: int = 0
    revision: int = 0
    serial: int = 0


@dataclass(frozen=True)
class LssAssignment:
    """A device that a round of assignment found. verdict: COMMANDS.md."""
    verdict: int
    node: int
    error: int
    specific_error: int
    address: LssAddress


@dataclass(frozen=True)
class LssResult:
    """outcome: 0 done, 1 no response, 2 refused, 3 several devices are in configuration state, 4 another device uses the
    node-ID. error, specific_error: of a refusal. address: of lss_inquire_address() and lss_fastscan(). node: of
    lss_inquire_node_id(); 255: none, 0: it is not done. assignments: of lss_assign_node_ids()."""
    outcome: int
    error: int
    specific_error: int
    address: LssAddress = LssAddress()
    node: int = 0
    assignments: Sequence[LssAssignment] = ()

    @property
    def ok(self) -> bool:
        """Whether it is done."""
        return self.outcome == 0


@dataclass(frozen=True)
class SdoConnection:
    """Between two nodes. state: 0 opening, 1 open, 2 closing, 3 stale."""
    number: int
    client: int
    server: int
    client_object: int
    server_object: int
    request_id: int
    response_id: int
    state: int
    abort: int


@dataclass(frozen=True)
class HistoryValue:
    """A stored value. It holds from its time on, until the next one of the same line, direction, node and name. type:
    CiA 301 data type. bits: its size. value: its bits; None: no value is valid, or known. That in the unit is that of
    the bits * scale + offset."""
    line: str
    output: bool
    node: int
    name: str
    unit: str
    type: int
    bits: int
    scale: float
    offset: float
    time: int
    value: Optional[int]


@dataclass(frozen=True)
class JournalPage:
    """Events that a journal has stored, without `gateway` and `name`, or values. cursor: of the next page. more: it does
    not reach the end. unknown_entry: the gateway stores no entry that fulfils the conditions."""
    events: Sequence[Event]
    values: Sequence[HistoryValue]
    cursor: bytes
    more: bool
    unknown_entry: bool


# --- results: the structs of linegate.h ---

def _found(result: int) -> bool:
    """Whether a function of linegate.h has a result at that place. Raises its errors."""
    if result == -4:  # the end of a list
        return False
    if result == -13:
        raise Malformed(Outcome.DONE, 0, "the command was carried out, and the data of its reply are malformed")
    _checked(result)
    return True


def _one(call: Call, function: Callable[..., int], of: Any, *places: int) -> Any:
    """The struct at these places; None: there is none."""
    to = of(size=ctypes.sizeof(of))
    return to if _found(function(call._client._handle, call._number, *places, to)) else None


def _all(call: Call, function: Callable[..., int], of: Any, *places: int) -> Iterator[Any]:
    """The structs of a list, in its order."""
    for place in itertools.count():
        one = _one(call, function, of, *places, place)
        if one is None:
            return
        yield one


def _numbers(function: Callable[..., int]) -> Callable[[Call], List[int]]:
    """Of a function that returns the numbers of a list."""
    def read(call: Call) -> List[int]:
        out: List[int] = []
        while _found(number := function(call._client._handle, call._number, len(out))):
            out.append(number)
        return out
    return read


def _bytes_at(address: Optional[int], length: int) -> bytes:
    return ctypes.string_at(address, length) if address and length else b""


def _delivery(call: Call) -> Delivery:
    one = _one(call, _lib.linegate_call_delivery, c.Delivery)
    return Delivery(("", "sdo", "pdo")[one.way], one.pdo, one.wait, one.missing[:one.missing_count])


def _objects(call: Call) -> List[ListedObject]:
    return [ListedObject(one.index, one.sub, one.type, one.access, bool(one.mappable), bool(one.stored),
                         bool(one.application), _text(one.name), _bytes_at(one.value, one.length))
            for one in _all(call, _lib.linegate_call_object, c.Object)]


def _scanned(call: Call) -> List[ScannedNode]:
    out = []
    for place, node in enumerate(_all(call, _lib.linegate_call_scanned, c.ScannedNode)):
        values = [ObjectValue(one.index, one.sub, _bytes_at(one.value, one.length))
                  for one in _all(call, _lib.linegate_call_scanned_value, c.ObjectValue, place)]
        out.append(ScannedNode(node.node, node.abort, values))
    return out


def _boots(call: Call) -> List[BootResult]:
    return [BootResult(one.node, _letter(one.letter), one.index, one.sub, one.reason, one.abort, one.expected, one.found,
                       _text(one.text), bool(one.ok))
            for one in _all(call, _lib.linegate_call_boot, c.BootResult)]


def _letter(letter: bytes) -> str:
    return _text(letter.rstrip(b"\0"))


def _configurations(call: Call) -> List[Configuration]:
    out = []
    for place, node in enumerate(_all(call, _lib.linegate_call_configuration, c.Configuration)):
        differences = [Difference(one.index, one.sub, one.abort, _bytes_at(one.expected, one.expected_length),
                                  _bytes_at(one.found, one.found_length))
                       for one in _all(call, _lib.linegate_call_difference, c.Difference, place)]
        out.append(Configuration(node.node, _letter(node.letter), node.abort, differences))
    return out


def _address(of: Any) -> LssAddress:
    return LssAddress(of.vendor, of.product, of.revision, of.serial)


def _lss(call: Call) -> LssResult:
    one = _one(call, _lib.linegate_call_lss, c.LssResult)
    assignments = [LssAssignment(each.verdict, each.node, each.error, each.specific_error, _address(each.address))
                   for each in _all(call, _lib.linegate_call_assignment, c.LssAssignment)]
    return LssResult(one.outcome, one.error, one.specific_error, _address(one.address), one.node, assignments)


def _connections(call: Call) -> List[SdoConnection]:
    return [SdoConnection(one.number, one.client, one.server, one.client_object, one.server_object, one.request_id,
                          one.response_id, one.state, one.abort)
            for one in _all(call, _lib.linegate_call_connection, c.Connection)]


def _history(one: Any) -> HistoryValue:
    return HistoryValue(_text(one.line), bool(one.output), one.node, _text(one.name), _text(one.unit), one.type, one.bits,
                        one.scale, one.offset, one.time, one.value if one.valid else None)


def _page(call: Call) -> JournalPage:
    page = _one(call, _lib.linegate_call_page, c.JournalPage)
    return JournalPage([_event(one) for one in _all(call, _lib.linegate_call_event, c.Event)],
                       [_history(one) for one in _all(call, _lib.linegate_call_history_value, c.HistoryValue)],
                       struct.pack("<QQ", page.cursor_position, page.cursor_check), bool(page.more),
                       bool(page.unknown_entry))


def _words(call: Call) -> str:
    return _text(call._data())


def _lss_address(name: str, of: LssAddress) -> Any:
    """1018h:1 to 4, of 32 bits each."""
    if not isinstance(of, LssAddress):
        raise TypeError(f"{name} is an LssAddress, not {type(of).__name__}")
    return c.LssAddress(*(_whole(f"{name}.{part}", getattr(of, part)) for part in ("vendor", "product", "revision",
                                                                                   "serial")))


class Commands:
    """Of a line. node: 1 to 127; 0 = all where it says so. index: 0 to FFFFh. sub: 0 to 255."""

    def __init__(self, line: Line) -> None:
        self._line = line

    def _begin(self, function: Callable[..., int], options: dict[str, Any], *arguments: Any, **numbers: int) -> Call:
        """Begins a function of linegate.h: arguments as they are, and numbers of the type unsigned, in their order."""
        return self._line._begin(function, *arguments, *(_number(*one) for one in numbers.items()), **options)

    def _send(self, function: Callable[..., int], options: dict[str, Any], value: bytes, *more: Any,
              **numbers: int) -> Call:
        """The same with bytes behind the numbers, and more arguments behind them."""
        value = _octets("value", value)
        return self._line._begin(function, *(_number(*one) for one in numbers.items()), value, len(value), *more, **options)

    def write_object(self, node: int, index: int, sub: int, value: bytes, *, by_sdo: bool = False,
                     keep_pdo: bool = False, **options: Any) -> Answer[Delivery]:
        """OBJECT_WRITE: by PDO if one carries the object, else by SDO. by_sdo: by SDO in any case. keep_pdo: the PDO is
        sent by trigger_pdo()."""
        flags = int(bool(by_sdo)) | int(bool(keep_pdo)) << 1
        return Answer(self._send(_lib.linegate_write_object, options, value, flags, node=node, index=index, sub=sub),
                      _delivery)

    def write_output(self, name: str, value: Output, *, raw: bool = False, **options: Any) -> Answer[Delivery]:
        """OUTPUT_WRITE: one output, by a person, by its name, in its unit; raw: the value in the PDO. The line must be
        ready."""
        return Answer(self._begin(_lib.linegate_write_output, options, _setting(name, value, raw)), _delivery)

    def read_network(self, network: int, node: int, index: int, sub: int, **options: Any) -> Call:
        """NETWORK_READ: of a device in another network, 1 to 65535."""
        return self._begin(_lib.linegate_read_network, options, network=network, node=node, index=index, sub=sub)

    def write_network(self, network: int, node: int, index: int, sub: int, value: bytes, **options: Any) -> Call:
        """NETWORK_WRITE: to a device in another network, 1 to 65535."""
        return self._send(_lib.linegate_write_network, options, value, network=network, node=node, index=index, sub=sub)

    def read_own(self, index: int, sub: int, *, node: int = 0, **options: Any) -> Call:
        """LOCAL_READ: of the own dictionary of the line. node: of a device in role device, 0 = the only one."""
        return self._begin(_lib.linegate_read_own, options, index=index, sub=sub, node=node)

    def write_own(self, index: int, sub: int, value: bytes, *, node: int = 0, as_owner: bool = False,
                  **options: Any) -> Call:
        """LOCAL_WRITE: to the own dictionary of the line. as_owner: as the device itself."""
        return self._send(_lib.linegate_write_own, options, value, _number("node", node), int(bool(as_owner)), index=index,
                          sub=sub)

    def list_objects(self, first: int = 0, last: int = 0xFFFF, *, node: int = 0,
                     **options: Any) -> Answer[List[ListedObject]]:
        """LOCAL_READ of a list. node: 0, or the one whose device file is listed."""
        return Answer(self._begin(_lib.linegate_list_objects, options, first=first, last=last, node=node), _objects)

    def create_object(self, described: ListedObject, *, image_byte: Optional[int] = None, **options: Any) -> Call:
        """OBJECT_CREATE: with its default in `value`; `application` has no effect. index: 2000h to 5EFFh or 6000h to 9FFFh.
        sub: 0 to 254. image_byte: its bytes are those of the image from there on."""
        if not isinstance(described, ListedObject):
            raise TypeError(f"described is a ListedObject, not {type(described).__name__}")
        value = _octets("value", described.value)
        buffer = ctypes.create_string_buffer(value, max(1, len(value)))
        to = _structure(c.Object, size=ctypes.sizeof(c.Object), index=_number("index", described.index, 0xFFFF),
                        sub=_number("sub", described.sub, 0xFF), type=_number("type", described.type, 0xFFFF),
                        access=_number("access", described.access, 0xFF), mappable=int(bool(described.mappable)),
                        stored=int(bool(described.stored)), name=_encoded(described.name),
                        value=ctypes.addressof(buffer), length=len(value))
        byte = -1 if image_byte is None else _whole("image_byte", image_byte)
        return self._begin(_lib.linegate_create_object, options, to, byte)

    def remove_object(self, index: int, **options: Any) -> Call:
        """OBJECT_CREATE, code 1: removes an object that create_object() made."""
        return self._begin(_lib.linegate_remove_object, options, index=index)

    def scan(self, node: int = 0, *, timeout: float = LONG, **options: Any) -> Answer[List[ScannedNode]]:
        """SCAN. node 0: all."""
        return Answer(self._begin(_lib.linegate_scan, {"timeout": timeout, **options}, node=node), _scanned)

    def apply_scan(self, node: int = 0, *, set_up: bool = False, restore: bool = False, timeout: float = LONG,
                   **options: Any) -> Answer[List[ScannedNode]]:
        """SCAN_APPLY: SCAN_SET_UP, SCAN_RESTORE. node 0: all."""
        return Answer(self._line._begin(_lib.linegate_apply_scan, _number("node", node), int(bool(set_up)),
                                        int(bool(restore)), timeout=timeout, **options), _scanned)

    def boot(self, node: int = 0, *, timeout: float = LONG, **options: Any) -> Answer[List[BootResult]]:
        """BOOT. node 0: all of the network list."""
        return Answer(self._begin(_lib.linegate_boot, {"timeout": timeout, **options}, node=node), _boots)

    def compare(self, node: int = 0, *, timeout: float = LONG, **options: Any) -> Answer[List[Configuration]]:
        """CONFIGURE, code 0: compares with the configuration. node 0: all."""
        return Answer(self._begin(_lib.linegate_compare, {"timeout": timeout, **options}, node=node), _configurations)

    def configure(self, node: int = 0, *, timeout: float = LONG, **options: Any) -> Answer[List[Configuration]]:
        """CONFIGURE, code 1: boots and configures. node 0: all."""
        return Answer(self._begin(_lib.linegate_configure, {"timeout": timeout, **options}, node=node), _configurations)

    def program(self, node: int, number: int, program: bytes, *, timeout: float = LONG, **options: Any) -> ProgramAnswer:
        """PROGRAM: loads a program, number 1 to 255, of 1 byte to 16 MiB."""
        program = _octets("program", program)
        return ProgramAnswer(self._send(_lib.linegate_program, {"timeout": timeout, **options}, program, node=node,
                                        number=number))

    def lss_switch_global(self, configuration: bool, **options: Any) -> Answer[LssResult]:
        """LSS, code 0: to configuration or waiting state."""
        return Answer(self._begin(_lib.linegate_lss_switch_global, options, int(bool(configuration))), _lss)

    def lss_switch_selective(self, address: LssAddress, **options: Any) -> Answer[LssResult]:
        """LSS, code 1: the device with that address to configuration state."""
        return Answer(self._begin(_lib.linegate_lss_switch_selective, options, _lss_address("address", address)), _lss)

    def lss_set_node_id(self, node: int, *, unchecked: bool = False, **options: Any) -> Answer[LssResult]:
        """LSS, code 2. node: 1 to 127; 255 = none. unchecked: without the check that no other device uses it."""
        return Answer(self._line._begin(_lib.linegate_lss_set_node_id, _number("node", node), int(bool(unchecked)),
                                        **options), _lss)

    def lss_set_bit_timing(self, table: int, index: int, **options: Any) -> Answer[LssResult]:
        """LSS, code 3. table: 0 = that of CiA 305, to 255; index: 0 to 255, in it."""
        return Answer(self._begin(_lib.linegate_lss_set_bit_timing, options, table=table, index=index), _lss)

    def lss_activate_bit_timing(self, delay_ms: int, **options: Any) -> Answer[LssResult]:
        """LSS, code 4. delay_ms: 0 to 65535."""
        return Answer(self._begin(_lib.linegate_lss_activate_bit_timing, options, delay_ms=delay_ms), _lss)

    def lss_store(self, **options: Any) -> Answer[LssResult]:
        """LSS, code 5: node-ID and bit timing."""
        return Answer(self._begin(_lib.linegate_lss_store, options), _lss)

    def lss_inquire_address(self, **options: Any) -> Answer[LssResult]:
        """LSS, code 6: of the device in configuration state."""
        return Answer(self._begin(_lib.linegate_lss_inquire_address, options), _lss)

    def lss_inquire_node_id(self, **options: Any) -> Answer[LssResult]:
        """LSS, code 7: of the device in configuration state."""
        return Answer(self._begin(_lib.linegate_lss_inquire_node_id, options), _lss)

    def lss_identify(self, lowest: LssAddress, highest_revision: int, highest_serial: int,
                     **options: Any) -> Answer[LssResult]:
        """LSS, code 8: whether a device has an address in this range."""
        return Answer(self._begin(_lib.linegate_lss_identify, options, _lss_address("lowest", lowest),
                                  _whole("highest_revision", highest_revision), _whole("highest_serial", highest_serial)),
                      _lss)

    def lss_identify_unconfigured(self, **options: Any) -> Answer[LssResult]:
        """LSS, code 9: whether a device has no node-ID."""
        return Answer(self._begin(_lib.linegate_lss_identify_unconfigured, options), _lss)

    def lss_fastscan(self, known: int = 0, address: LssAddress = LssAddress(), *, timeout: float = LONG,
                     **options: Any) -> Answer[LssResult]:
        """LSS, code 10. known: bit 0 vendor to 3 serial number of the address are known."""
        return Answer(self._line._begin(_lib.linegate_lss_fastscan, _number("known", known),
                                        _lss_address("address", address), timeout=timeout, **options), _lss)

    def lss_assign_node_ids(self, *, timeout: float = LONG, **options: Any) -> Answer[LssResult]:
        """LSS, code 11: node-IDs as configured, to all devices without one."""
        return Answer(self._begin(_lib.linegate_lss_assign_node_ids, {"timeout": timeout, **options}), _lss)

    def trigger_pdo(self, number: int, *, node: int = 0, **options: Any) -> Answer[List[int]]:
        """PDO_TRIGGER: by the number of the PDO, 1 to 65535, with `node` by that of its RPDO, 1 to 512. Result: their
        numbers."""
        return Answer(self._begin(_lib.linegate_trigger_pdo, options, number=number, node=node),
                      _numbers(_lib.linegate_call_pdo))

    def trigger_pdos_of(self, output: str, **options: Any) -> Answer[List[int]]:
        """PDO_TRIGGER: all that carry that output. The line must be ready. Result: their numbers."""
        return Answer(self._begin(_lib.linegate_trigger_pdos_of, options, _encoded(output)),
                      _numbers(_lib.linegate_call_pdo))

    def request_pdo(self, node: int, number: int, **options: Any) -> Call:
        """PDO_REQUEST. number: of a TPDO of the node, 1 to 512; node 0: of an RPDO of the own node, 1 to 65535."""
        return self._begin(_lib.linegate_request_pdo, options, node=node, number=number)

    def write_mpdo(self, node: int, index: int, sub: int, value: bytes, *, tpdo: int = 0, **options: Any) -> Answer[int]:
        """MPDO_WRITE: 1 to 4 bytes. node 0: all. tpdo: 1 to 512; 0: the first in that mode. Result: its number."""
        return Answer(self._send(_lib.linegate_write_mpdo, options, value, _number("tpdo", tpdo), node=node, index=index,
                                 sub=sub), lambda call: _numbers(_lib.linegate_call_pdo)(call)[0])

    def send_emcy(self, code: int, error_register: int, manufacturer: bytes = bytes(5), *, node: int = 0,
                  **options: Any) -> Call:
        """EMCY_SEND. code: 0 to FFFFh. error_register: 0 to 255. manufacturer: up to 5 bytes. node: of a device in role
        device, 0 = the only one."""
        manufacturer = _octets("manufacturer", manufacturer)
        if len(manufacturer) > 5:
            raise ValueError("manufacturer is not 0..5 bytes")
        return self._line._begin(_lib.linegate_send_emcy, _number("code", code), _number("error_register", error_register),
                                 manufacturer.ljust(5, b"\0"), _number("node", node), **options)

    def send_frame(self, identifier: int, data: bytes, *, extended: bool = False, fd: bool = False,
                   bit_rate_switch: bool = False, **options: Any) -> Call:
        """CAN_SEND: a frame that no service of the line uses. identifier: 0 to 7FFh; extended: to 1FFFFFFFh. data: up to 8
        bytes; fd: also 12, 16, 20, 24, 32, 48 or 64."""
        data = _octets("data", data)
        flags = int(bool(extended)) | int(bool(fd)) << 1 | int(bool(bit_rate_switch)) << 2
        return self._send(_lib.linegate_send_frame, options, data, flags, identifier=identifier)

    def send_remote_frame(self, identifier: int, length: int, *, extended: bool = False, **options: Any) -> Call:
        """CAN_SEND: a remote frame. length: that is requested, 0 to 8."""
        return self._line._begin(_lib.linegate_send_remote_frame, _number("identifier", identifier),
                                 _number("length", length), int(bool(extended)), **options)

    def listen(self, seconds: int, identifier: int = 0, mask: int = 0, *, extended: Optional[bool] = None,
               **options: Any) -> Call:
        """CAN_LISTEN: such frames as events for that time, at most 3600 s, 0 = no more. identifier, mask: 0 to 1FFFFFFFh.
        mask: the bits of the identifier that are compared. extended: only frames with 29-bit, or 11-bit, identifiers."""
        return self._line._begin(_lib.linegate_listen, _number("seconds", seconds), _number("identifier", identifier),
                                 _number("mask", mask), -1 if extended is None else int(bool(extended)), **options)

    def trace_routing(self, seconds: int, **options: Any) -> Call:
        """ROUTING_TRACE: 1 to 3600 s."""
        return self._begin(_lib.linegate_trace_routing, options, seconds=seconds)

    def open_connection(self, client: int, server: int, *, timeout: float = LONG,
                        **options: Any) -> Answer[List[SdoConnection]]:
        """CONNECTION_OPEN: an SDO connection between two nodes. client, server: 1 to 127."""
        return Answer(self._begin(_lib.linegate_open_connection, {"timeout": timeout, **options}, client=client,
                                  server=server), _connections)

    def close_connection(self, number: int, *, timeout: float = LONG, **options: Any) -> Call:
        """CONNECTION_CLOSE."""
        return self._line._begin(_lib.linegate_close_connection, _whole("number", number), timeout=timeout, **options)

    def connections(self, **options: Any) -> Answer[List[SdoConnection]]:
        """CONNECTION_LIST."""
        return Answer(self._begin(_lib.linegate_connections, options), _connections)

    def check_sleep(self, **options: Any) -> Answer[List[int]]:
        """SLEEP, code 0: whether all nodes can sleep. Result: the node-IDs of nodes that object."""
        return Answer(self._begin(_lib.linegate_check_sleep, options), _numbers(_lib.linegate_call_objection))

    def sleep(self, **options: Any) -> Answer[List[int]]:
        """SLEEP, code 1: checks, and sleeps without an objection. Result likewise."""
        return Answer(self._begin(_lib.linegate_sleep, options), _numbers(_lib.linegate_call_objection))

    def sleep_unchecked(self, **options: Any) -> Call:
        """SLEEP, code 2: without a check."""
        return self._begin(_lib.linegate_sleep_unchecked, options)

    def wake_up(self, **options: Any) -> Call:
        """SLEEP, code 3: wakes the network."""
        return self._begin(_lib.linegate_wake_up, options)

    def object_to_sleep(self, object_: bool, **options: Any) -> Call:
        """SLEEP, code 4 and 5: the own node objects, or consents again."""
        return self._begin(_lib.linegate_object_to_sleep, options, int(bool(object_)))

    def versions(self, **options: Any) -> Answer[str]:
        """VERSIONS of the gateway."""
        return Answer(self._begin(_lib.linegate_versions, options), _words)

    def restart_bus(self, **options: Any) -> Call:
        """BUS_RESTART: after bus-off."""
        return self._begin(_lib.linegate_restart_bus, options)

    def set_bus_faults(self, faults: str, **options: Any) -> Answer[str]:
        """BUS_FAULT of a simulated bus. Result: all faults."""
        return Answer(self._begin(_lib.linegate_set_bus_faults, options, _encoded(faults)), _words)

    def read_journal(self, *, line: Optional[str] = None, node: Optional[int] = None, kind: Optional[int] = None,
                     severity: int = 0, text: str = "", since: Optional[int] = None, until: Optional[int] = None,
                     cursor: bytes = bytes(16), newest_first: bool = False, most: int = 0, values: bool = False,
                     **options: Any) -> Answer[JournalPage]:
        """JOURNAL_READ: events; or with `values` those of the value history, whose names are like `text`. line "": of the
        gateway itself. node: 0 to 127. kind: 0 to 255, of events. severity: 0 to 2, of events. since (inclusive), until
        (exclusive): UTC in nanoseconds. cursor: of the page before. most: events of the page, 0 = as many as fit."""
        if len(_octets("cursor", cursor)) != 16:
            raise ValueError("cursor is not the 16 bytes of a page")
        position, check = struct.unpack("<QQ", cursor)
        conditions = (node, kind, since, until)
        flags = sum(2 << bit for bit, value in enumerate(conditions) if value is not None)
        flags |= int(bool(newest_first)) << 6 | int(bool(values)) << 7
        query = _structure(c.JournalQuery, size=ctypes.sizeof(c.JournalQuery), flags=flags, most=most,
                           line=None if line is None else _encoded(line), text=_encoded(text),
                           node=_number("node", node or 0, 0xFF), kind=kind or 0,
                           severity=_number("severity", severity, 0xFF), since=since or 0, until=until or 0,
                           cursor_position=position, cursor_check=check)
        return Answer(self._begin(_lib.linegate_read_journal, options, query), _page)
