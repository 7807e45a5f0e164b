# SPDX-License-Identifier: Apache-2.0
"""The commands to a line as functions with typed parameters and results, beside Line.sdo_read(), sdo_write() and nmt().

    press = linegate.commands.Commands(client.line("press"))
    for result in press.boot(8).result():  # with asyncio: await press.boot(8)
        print(result.node, result.letter)

What they do is in linegate.idl, at the CommandKind that each names. Each takes `timeout` and `attempts` as
Line.request() does. A parameter that is out of range raises an error at once, or refuses the call. Values of objects
are bytes, little-endian; SDO abort codes are those of CiA 301, 0 = none.
"""

from __future__ import annotations

import ctypes
import enum
import operator
import struct
from dataclasses import dataclass
from typing import Any, Callable, Generator, Generic, List, Optional, Sequence, TypeVar

from . import Call, CallError, Event, Line, Outcome, Output, _checked, _encoded, _lib, _setting, _structure
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


class _Fields:
    """The fields of the data of a reply (COMMANDS.md)."""

    def __init__(self, data: bytes) -> None:
        self._data, self._at = data, 0

    @property
    def more(self) -> bool:
        """Whether there is another one."""
        return self._at < len(self._data)

    def bytes(self, length: int) -> bytes:
        """So many."""
        self._at += length
        if self._at > len(self._data):
            raise ValueError("the data end too early")
        return self._data[self._at - length:self._at]

    def numbers(self, layout: str) -> Any:
        """As struct.unpack()."""
        return struct.unpack("<" + layout, self.bytes(struct.calcsize("<" + layout)))

    def number(self, size: int) -> int:
        """An unsigned one of that size."""
        return int.from_bytes(self.bytes(size), "little")

    def sized(self, size: int) -> bytes:
        """Bytes after their length, which has that size."""
        return self.bytes(self.number(size))


class Answer(Call, Generic[T]):
    """A call with a result: `await` it, or call result()."""

    def __init__(self, of: Call, parse: Callable[[bytes], T]) -> None:  # pylint: disable=super-init-not-called
        self._call, self._parse = of, parse  # the call ends with its last handle
        self._client, self._number = of._client, of._number

    def __del__(self) -> None:
        pass

    def _parsed(self, data: bytes) -> T:
        try:
            return self._parse(data)
        except (ValueError, struct.error) as error:
            raise Malformed(self.outcome, 0, f"malformed data of a reply: {error}") from error

    def result(self) -> T:  # type: ignore[override]
        """Polls until it is done, without an event loop. Raises CallError."""
        return self._parsed(self._call.result())

    def __await__(self) -> Generator[Any, None, T]:  # type: ignore[override]
        data = yield from self._call.__await__()
        return self._parsed(data)


class BootAnswer(Answer[List["BootResult"]]):
    """Of boot(): the library has the words of the results."""

    def __init__(self, of: Call) -> None:
        super().__init__(of, lambda _data: [])

    def _parsed(self, data: bytes) -> List["BootResult"]:
        out: List[BootResult] = []
        boot = c.BootResult(size=ctypes.sizeof(c.BootResult))
        while (found := _lib.linegate_call_boot(self._client._handle, self._number, len(out), boot)) == 0:
            out.append(BootResult(boot.node, _text(boot.letter.rstrip(b"\0")), boot.index, boot.sub, boot.reason,
                                  boot.abort, boot.expected, boot.found, _text(boot.text), bool(boot.ok)))
        if found == -13:
            raise Malformed(self.outcome, 0, "malformed data of a reply")
        if found != -4:  # the end of the list
            _checked(found)
        return out


class ProgramAnswer(Answer[None]):
    """Of program()."""

    def __init__(self, of: Call) -> None:
        super().__init__(of, lambda _data: None)

    @property
    def fault(self) -> Optional["ProgramFault"]:
        """What the device reported of a download that failed; None: nothing."""
        result = self._call._result()
        data = self._call._bytes(result) if result.outcome == Outcome.SDO_ABORT else b""
        return ProgramFault(*struct.unpack("<HBI", data)) if len(data) == 7 else None


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

    def __bytes__(self) -> bytes:
        return struct.pack("<4I", self.vendor, self.product, self.revision, self.serial)


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
    node-ID."""
    outcome: int
    error: int
    specific_error: int
    data: bytes

    @property
    def ok(self) -> bool:
        """Whether it is done."""
        return self.outcome == 0

    @property
    def address(self) -> LssAddress:
        """Of lss_inquire_address() and lss_fastscan()."""
        return LssAddress(*struct.unpack("<4I", self.data[:16])) if len(self.data) >= 16 else LssAddress()

    @property
    def node(self) -> int:
        """Of lss_inquire_node_id(); 255: none, 0: it is not done."""
        return self.data[0] if self.data else 0

    @property
    def assignments(self) -> List[LssAssignment]:
        """Of lss_assign_node_ids()."""
        fields, out = _Fields(self.data), []
        while fields.more:
            head = fields.numbers("4B")
            out.append(LssAssignment(*head, LssAddress(*fields.numbers("4I"))))
        return out


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


def _journal_event(fields: _Fields) -> Event:
    stream, _incarnation, number, time, _clock, kind, severity, node, code, value = fields.numbers("QQQqBBBBII")
    line, data = _text(fields.sized(1)), fields.sized(1)
    return Event("", line, "", _text(fields.sized(2)), number, stream, time, kind, severity, node, code, value, data, 0,
                 False)


def _series(fields: _Fields) -> dict[str, Any]:
    direction, node, kind, bits = fields.numbers("BBHH")
    line, name = _text(fields.sized(1)), _text(fields.sized(2))
    scale, offset = fields.numbers("dd")
    return {"line": line, "output": direction != 0, "node": node, "name": name, "unit": _text(fields.sized(1)),
            "type": kind, "bits": bits, "scale": scale, "offset": offset}


def _history(fields: _Fields) -> List[HistoryValue]:
    series: List[dict[str, Any]] = []
    out = []
    while fields.more:
        number = fields.number(2)
        if number == len(series):
            series.append(_series(fields))
        if number >= len(series):
            raise ValueError("a series without its description")
        time, _clock, valid, bits = fields.numbers("qBBQ")
        out.append(HistoryValue(**series[number], time=time, value=bits if valid else None))
    return out


def _page(data: bytes) -> JournalPage:
    fields = _Fields(data)
    flags, cursor = fields.number(1), fields.bytes(16)
    fields.bytes(16)
    events: List[Event] = []
    values = _history(fields) if flags & 4 else []
    while fields.more:
        events.append(_journal_event(fields))
    return JournalPage(events, values, cursor, bool(flags & 1), bool(flags & 8))


def _delivery(data: bytes) -> Delivery:
    fields = _Fields(data)
    if not fields.more:
        return Delivery("")
    if fields.number(1) == 0:
        return Delivery("sdo")
    pdo, wait, missing = *fields.numbers("HB"), []
    while fields.more:
        missing.append(fields.number(4))
    return Delivery("pdo", pdo, wait, missing)


def _list_of(parse: Callable[[_Fields], T]) -> Callable[[bytes], List[T]]:
    def parsed(data: bytes) -> List[T]:
        fields, out = _Fields(data), []
        while fields.more:
            out.append(parse(fields))
        return out
    return parsed


def _object(fields: _Fields) -> ListedObject:
    index, sub, kind, access, flags = fields.numbers("HBHBB")
    name = fields.sized(1).decode(errors="replace")
    return ListedObject(index, sub, kind, access, bool(flags & 1), bool(flags & 2), bool(flags & 4), name, fields.sized(1))


def _scanned(fields: _Fields) -> ScannedNode:
    node, abort = fields.numbers("BI")
    inner = _Fields(fields.sized(4))
    values = [ObjectValue(*inner.numbers("HB"), inner.sized(4)) for _ in range(inner.number(4))]
    return ScannedNode(node, abort, values)


def _number(fields: _Fields) -> int:
    return fields.number(2)


def _identifier(number: int) -> int:
    if not 0 <= operator.index(number) < 1 << 29:
        raise ValueError("an identifier has at most 29 bits")
    return number


def _letter(number: int) -> str:
    return chr(number) if number else ""


def _configuration(fields: _Fields) -> Configuration:
    node, letter, abort, count = fields.numbers("BBII")
    differences = [Difference(*fields.numbers("HBI"), fields.sized(4), fields.sized(4)) for _ in range(count)]
    return Configuration(node, _letter(letter), abort, differences)


def _connection(fields: _Fields) -> SdoConnection:
    return SdoConnection(*fields.numbers("IBBHHHHBI"))


def _lss(data: bytes) -> LssResult:
    fields = _Fields(data)
    return LssResult(*fields.numbers("3B"), data[3:])


def _text(data: bytes) -> str:
    return data.decode(errors="replace")


class Commands:
    """Of a line. node: 1 to 127; 0 = all where it says so."""

    def __init__(self, line: Line) -> None:
        self._line = line

    def _call(self, kind: Kind, parse: Callable[[bytes], T], options: dict[str, Any], **members: Any) -> Answer[T]:
        return Answer(self._line.request(kind, **members, **options), parse)

    def write_object(self, node: int, index: int, sub: int, value: bytes, *, by_sdo: bool = False,
                     keep_pdo: bool = False, **options: Any) -> Answer[Delivery]:
        """OBJECT_WRITE: by PDO if one carries the object, else by SDO."""
        return self._call(Kind.OBJECT_WRITE, _delivery, options, node=node, index=index, sub=sub, data=value,
                          code=int(by_sdo) | int(keep_pdo) << 1)

    def write_output(self, name: str, value: Output, *, raw: bool = False, **options: Any) -> Answer[Delivery]:
        """OUTPUT_WRITE: one output, by a person, by its name, in its unit; raw: the value in the PDO. The line must be
        ready."""
        setting = _setting(name, value, raw)
        return Answer(self._line._begin(_lib.linegate_write_output, setting, **options), _delivery)

    def read_network(self, network: int, node: int, index: int, sub: int, **options: Any) -> Call:
        """NETWORK_READ: of a device in another network."""
        return self._line.request(Kind.NETWORK_READ, code=network, node=node, index=index, sub=sub, **options)

    def write_network(self, network: int, node: int, index: int, sub: int, value: bytes, **options: Any) -> Call:
        """NETWORK_WRITE."""
        return self._line.request(Kind.NETWORK_WRITE, code=network, node=node, index=index, sub=sub, data=value, **options)

    def read_own(self, index: int, sub: int, *, node: int = 0, **options: Any) -> Call:
        """LOCAL_READ: of the own dictionary of the line. node: of a device in role device, 0 = the only one."""
        return self._line.request(Kind.LOCAL_READ, node=node, index=index, sub=sub, **options)

    def write_own(self, index: int, sub: int, value: bytes, *, node: int = 0, as_owner: bool = False,
                  **options: Any) -> Call:
        """LOCAL_WRITE."""
        return self._line.request(Kind.LOCAL_WRITE, node=node, index=index, sub=sub, data=value, code=int(as_owner),
                                  **options)

    def list_objects(self, first: int = 0, last: int = 0xFFFF, *, node: int = 0,
                     **options: Any) -> Answer[List[ListedObject]]:
        """LOCAL_READ of a list. node: 0, or the one whose device file is listed."""
        return self._call(Kind.LOCAL_READ, _list_of(_object), options, node=node, index=first, entry=last, code=2)

    def create_object(self, described: ListedObject, *, image_byte: Optional[int] = None, **options: Any) -> Call:
        """OBJECT_CREATE: with its default in `value`; `application` has no effect. image_byte: its bytes are those of the
        image from there on."""
        value = bytes(described.value)
        to = _structure(c.Object, size=ctypes.sizeof(c.Object), index=described.index, sub=described.sub,
                        type=described.type, access=described.access, mappable=int(described.mappable),
                        stored=int(described.stored), name=_encoded(described.name), value=value, length=len(value))
        if image_byte is not None and not 0 <= operator.index(image_byte) < 1 << 32:
            raise ValueError("image_byte is not in the image")
        return self._line._begin(_lib.linegate_create_object, to, -1 if image_byte is None else image_byte, **options)

    def remove_object(self, index: int, **options: Any) -> Call:
        """OBJECT_CREATE, code 1."""
        return self._line.request(Kind.OBJECT_CREATE, index=index, code=1, **options)

    def scan(self, node: int = 0, *, timeout: float = LONG, **options: Any) -> Answer[List[ScannedNode]]:
        """SCAN. node 0: all."""
        return self._call(Kind.SCAN, _list_of(_scanned), options, node=node, timeout=timeout)

    def apply_scan(self, node: int = 0, *, set_up: bool = False, restore: bool = False, timeout: float = LONG,
                   **options: Any) -> Answer[List[ScannedNode]]:
        """SCAN_APPLY. node 0: all."""
        return self._call(Kind.SCAN_APPLY, _list_of(_scanned), options, node=node, timeout=timeout,
                          code=int(set_up) | int(restore) << 1)

    def boot(self, node: int = 0, *, timeout: float = LONG, **options: Any) -> Answer[List[BootResult]]:
        """BOOT. node 0: all of the network list."""
        return BootAnswer(self._line.request(Kind.BOOT, node=node, timeout=timeout, **options))

    def compare(self, node: int = 0, *, timeout: float = LONG, **options: Any) -> Answer[List[Configuration]]:
        """CONFIGURE, code 0: compares with the configuration. node 0: all."""
        return self._call(Kind.CONFIGURE, _list_of(_configuration), options, node=node, timeout=timeout)

    def configure(self, node: int = 0, *, timeout: float = LONG, **options: Any) -> Answer[List[Configuration]]:
        """CONFIGURE, code 1: boots and configures. node 0: all."""
        return self._call(Kind.CONFIGURE, _list_of(_configuration), options, node=node, timeout=timeout, code=1)

    def program(self, node: int, number: int, program: bytes, *, timeout: float = LONG, **options: Any) -> ProgramAnswer:
        """PROGRAM: loads a program, number from 1."""
        return ProgramAnswer(self._line.request(Kind.PROGRAM, node=node, sub=number, data=program, timeout=timeout,
                                                **options))

    def _lss(self, code: int, arguments: bytes, options: dict[str, Any]) -> Answer[LssResult]:
        return self._call(Kind.LSS, _lss, options, code=code, data=arguments)

    def lss_switch_global(self, configuration: bool, **options: Any) -> Answer[LssResult]:
        """LSS, code 0."""
        return self._lss(0, bytes([int(configuration)]), options)

    def lss_switch_selective(self, address: LssAddress, **options: Any) -> Answer[LssResult]:
        """LSS, code 1."""
        return self._lss(1, bytes(address), options)

    def lss_set_node_id(self, node: int, *, unchecked: bool = False, **options: Any) -> Answer[LssResult]:
        """LSS, code 2. node: 255 = none. unchecked: without the check that no other device uses it."""
        return self._lss(2, bytes([node, 1] if unchecked else [node]), options)

    def lss_set_bit_timing(self, table: int, index: int, **options: Any) -> Answer[LssResult]:
        """LSS, code 3."""
        return self._lss(3, bytes([table, index]), options)

    def lss_activate_bit_timing(self, delay_ms: int, **options: Any) -> Answer[LssResult]:
        """LSS, code 4."""
        return self._lss(4, delay_ms.to_bytes(2, "little"), options)

    def lss_store(self, **options: Any) -> Answer[LssResult]:
        """LSS, code 5."""
        return self._lss(5, b"", options)

    def lss_inquire_address(self, **options: Any) -> Answer[LssResult]:
        """LSS, code 6."""
        return self._lss(6, b"", options)

    def lss_inquire_node_id(self, **options: Any) -> Answer[LssResult]:
        """LSS, code 7."""
        return self._lss(7, b"", options)

    def lss_identify(self, lowest: LssAddress, highest_revision: int, highest_serial: int,
                     **options: Any) -> Answer[LssResult]:
        """LSS, code 8."""
        return self._lss(8, struct.pack("<6I", lowest.vendor, lowest.product, lowest.revision, highest_revision,
                                        lowest.serial, highest_serial), options)

    def lss_identify_unconfigured(self, **options: Any) -> Answer[LssResult]:
        """LSS, code 9."""
        return self._lss(9, b"", options)

    def lss_fastscan(self, known: int = 0, address: LssAddress = LssAddress(), *, timeout: float = LONG,
                     **options: Any) -> Answer[LssResult]:
        """LSS, code 10. known: bit 0 vendor to 3 serial number of the address are known."""
        return self._lss(10, bytes([known]) + bytes(address) if known else b"", {"timeout": timeout, **options})

    def lss_assign_node_ids(self, *, timeout: float = LONG, **options: Any) -> Answer[LssResult]:
        """LSS, code 11."""
        return self._lss(11, b"", {"timeout": timeout, **options})

    def trigger_pdo(self, number: int, *, node: int = 0, **options: Any) -> Answer[List[int]]:
        """PDO_TRIGGER: by the number of the PDO, with `node` by that of its RPDO. Result: their numbers."""
        return self._call(Kind.PDO_TRIGGER, _list_of(_number), options, code=number, node=node)

    def trigger_pdos_of(self, output: str, **options: Any) -> Answer[List[int]]:
        """PDO_TRIGGER: all that carry that output. The line must be ready. Result: their numbers."""
        return Answer(self._line._begin(_lib.linegate_trigger_pdos_of, _encoded(output), **options), _list_of(_number))

    def request_pdo(self, node: int, number: int, **options: Any) -> Call:
        """PDO_REQUEST. node 0: number is that of an RPDO of the own node."""
        return self._line.request(Kind.PDO_REQUEST, node=node, code=number, **options)

    def write_mpdo(self, node: int, index: int, sub: int, value: bytes, *, tpdo: int = 0, **options: Any) -> Answer[int]:
        """MPDO_WRITE: 1 to 4 bytes. node 0: all. tpdo 0: the first in that mode. Result: its number."""
        return self._call(Kind.MPDO_WRITE, lambda data: _Fields(data).number(2), options, node=node, index=index, sub=sub,
                          data=value, code=tpdo)

    def send_emcy(self, code: int, error_register: int, manufacturer: bytes = bytes(5), *, node: int = 0,
                  **options: Any) -> Call:
        """EMCY_SEND. manufacturer: 5 bytes. node: of a device in role device, 0 = the only one."""
        return self._line.request(Kind.EMCY_SEND, node=node, code=code, error_register=error_register, data=manufacturer,
                                  **options)

    def send_frame(self, identifier: int, data: bytes, *, extended: bool = False, fd: bool = False,
                   bit_rate_switch: bool = False, **options: Any) -> Call:
        """CAN_SEND: a frame that no service of the line uses. Up to 8 bytes; fd: up to 64."""
        if len(data) > (64 if fd else 8) or bit_rate_switch and not fd:
            raise ValueError("a classical frame has at most 8 bytes and one bit rate, one of CAN FD 64 bytes")
        return self._line.request(Kind.CAN_SEND, entry=_identifier(identifier) | int(extended) << 31, data=data,
                                  sub=4 + int(bit_rate_switch) if fd else 0, **options)

    def send_remote_frame(self, identifier: int, length: int, *, extended: bool = False, **options: Any) -> Call:
        """CAN_SEND: a remote frame. length: that is requested."""
        return self._line.request(Kind.CAN_SEND, entry=_identifier(identifier) | int(extended) << 31 | 1 << 30,
                                  code=length, **options)

    def listen(self, seconds: int, identifier: int = 0, mask: int = 0, *, extended: Optional[bool] = None,
               **options: Any) -> Call:
        """CAN_LISTEN: such frames as events for that time, 0 = no more. mask: the bits of the identifier that are
        compared. extended: only frames with 29-bit, or 11-bit, identifiers."""
        bits = _identifier(mask) | int(extended is not None) << 31
        return self._line.request(Kind.CAN_LISTEN, code=seconds, entry=_identifier(identifier) | int(bool(extended)) << 31,
                                  data=bits.to_bytes(4, "little"), **options)

    def trace_routing(self, seconds: int, **options: Any) -> Call:
        """ROUTING_TRACE: 1 to 3600 s."""
        return self._line.request(Kind.ROUTING_TRACE, code=seconds, **options)

    def open_connection(self, client: int, server: int, *, timeout: float = LONG,
                        **options: Any) -> Answer[List[SdoConnection]]:
        """CONNECTION_OPEN: an SDO connection between two nodes."""
        return self._call(Kind.CONNECTION_OPEN, _list_of(_connection), options, node=client, code=server, timeout=timeout)

    def close_connection(self, number: int, *, timeout: float = LONG, **options: Any) -> Call:
        """CONNECTION_CLOSE."""
        return self._line.request(Kind.CONNECTION_CLOSE, entry=number, timeout=timeout, **options)

    def connections(self, **options: Any) -> Answer[List[SdoConnection]]:
        """CONNECTION_LIST."""
        return self._call(Kind.CONNECTION_LIST, _list_of(_connection), options)

    def check_sleep(self, **options: Any) -> Answer[List[int]]:
        """SLEEP, code 0: whether all nodes can sleep. Result: the node-IDs of nodes that object."""
        return self._call(Kind.SLEEP, list, options, code=0)

    def sleep(self, **options: Any) -> Answer[List[int]]:
        """SLEEP, code 1: checks, and sleeps without an objection. Result likewise."""
        return self._call(Kind.SLEEP, list, options, code=1)

    def sleep_unchecked(self, **options: Any) -> Call:
        """SLEEP, code 2."""
        return self._line.request(Kind.SLEEP, code=2, **options)

    def wake_up(self, **options: Any) -> Call:
        """SLEEP, code 3."""
        return self._line.request(Kind.SLEEP, code=3, **options)

    def object_to_sleep(self, object_: bool, **options: Any) -> Call:
        """SLEEP, code 4 and 5: the own node objects, or consents again."""
        return self._line.request(Kind.SLEEP, code=4 if object_ else 5, **options)

    def versions(self, **options: Any) -> Answer[str]:
        """VERSIONS of the gateway."""
        return self._call(Kind.VERSIONS, _text, options)

    def restart_bus(self, **options: Any) -> Call:
        """BUS_RESTART: after bus-off."""
        return self._line.request(Kind.BUS_RESTART, **options)

    def set_bus_faults(self, faults: str, **options: Any) -> Answer[str]:
        """BUS_FAULT of a simulated bus. Result: all faults."""
        return self._call(Kind.BUS_FAULT, _text, options, data=faults.encode())

    def read_journal(self, *, line: Optional[str] = None, node: Optional[int] = None, kind: Optional[int] = None,
                     severity: int = 0, text: str = "", since: Optional[int] = None, until: Optional[int] = None,
                     cursor: bytes = bytes(16), newest_first: bool = False, most: int = 0, values: bool = False,
                     **options: Any) -> Answer[JournalPage]:
        """JOURNAL_READ: events; or with `values` those of the value history, whose names are like `text`. line "": of the
        gateway itself. since (inclusive), until (exclusive): UTC in nanoseconds. cursor: of the page before. most: events
        of the page, 0 = as many as fit."""
        conditions = (line, node, kind, since, until)
        flags = sum(1 << bit for bit, value in enumerate(conditions) if value is not None)
        flags |= int(newest_first) << 6 | int(values) << 7
        data = struct.pack("<HBBBqqQQ", flags, node or 0, kind or 0, severity, since or 0, until or 0, 0, 0) + cursor
        for one in ((line or "").encode(), text.encode()):
            data += bytes([len(one)]) + one
        return self._call(Kind.JOURNAL_READ, _page, options, entry=most, data=data)
