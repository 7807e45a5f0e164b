# SPDX-License-Identifier: Apache-2.0
"""Values of CAN lines by name, outputs, commands and events, from Linegate gateways in a DDS domain.

With asyncio:

    async with linegate.Client() as client:
        press = client.line("press")
        await press.ready()
        print(press.read("angle.Position value"))

Without: call Client.poll() in a loop. Call-backs are called within poll(), or by the event loop, one at a time.

A held group of outputs is written only while the application polls, or its event loop runs: when that hangs, the
watchdog of the gateway reacts. Times are UTC in nanoseconds by the clock of the gateway, 0 = never; time-outs are in
seconds.
"""

from __future__ import annotations

import _thread
import asyncio
import contextlib
import ctypes
import enum
import numbers
import operator
import os
import threading
import time
import weakref
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from queue import SimpleQueue
from types import TracebackType
from typing import Any, AsyncIterator, Callable, Generator, Mapping, Optional, Sequence, Union
from urllib.parse import quote

from . import _library as c

__all__ = ["Call", "CallError", "Client", "Error", "Event", "EventReader", "Group", "GroupError", "GroupState", "Line",
           "LineChange", "LineStatus", "NotReady", "Outcome", "Quality", "Snapshot", "Subscription", "Value", "commands", "version"]

Data = Union[None, bool, int, float, str, bytes]
Output = Union[bool, int, float, str, bytes, bytearray, memoryview]

_POLL_MS = 100  # the longest poll of an event loop
_GROWTH = 4096  # of a position, between two functions
_MOST_WAITING = 10_000  # items of a stream that its consumer did not take
_MOST_TIMEOUT = 86_400.0  # seconds, of a command
_MOST_WATCHDOG = 2_147_483  # seconds, as milliseconds in an int
_MOST_FAILED = 8  # exceptions that poll() has not raised yet
_INTEGERS = (ctypes.c_uint8, ctypes.c_uint16, ctypes.c_uint32, ctypes.c_uint64, ctypes.c_int32, ctypes.c_int64)
_lib = c.load()


def version() -> str:
    """Of the library."""
    return _lib.linegate_version().decode()


class Error(Exception):
    """A function failed; `code` is a LINEGATE_ERROR_ number of linegate.h."""

    def __init__(self, code: int, text: str) -> None:
        super().__init__(text)
        self.code = code


class NotReady(Error):
    """The line or its layout was not received, or its gateway is lost."""


class CallError(Error):
    """A command failed."""

    def __init__(self, outcome: "Outcome", code: int, text: str) -> None:
        super().__init__(-10, text)
        self.outcome = outcome
        self.reason = code  # by outcome: SDO abort code, errno, or Refusal of linegate.idl


class GroupError(Error):
    """A group of outputs is not held: it was refused, or lost."""

    def __init__(self, state: "GroupState", text: str) -> None:
        super().__init__(-10, text)
        self.state = state


class LineStatus(enum.IntEnum):
    """linegate_status."""
    WAITING = 0  # not, or not completely, received
    READY = 1  # values, outputs and commands are possible
    SILENT = 2  # its gateway published nothing for 3 s
    LOST = 3  # its gateway ended or is unreachable, or removed the line
    AMBIGUOUS = 4  # several gateways have a line of that name

    @property
    def text(self) -> str:
        """In words."""
        return _lib.linegate_status_text(self.value).decode()


class Quality(enum.IntEnum):
    """linegate_quality: how far a value can be relied on."""
    GOOD = 0
    NO_LINE = 1
    NO_DATA = 2
    NO_NAME = 3
    NOT_RECEIVED = 4
    NODE_MISSING = 5
    NOT_SENT = 6
    GATEWAY_SILENT = 7
    GATEWAY_LOST = 8
    NAME_AMBIGUOUS = 9

    @property
    def text(self) -> str:
        """In words."""
        return _lib.linegate_quality_text(self.value).decode()


class GroupState(enum.IntEnum):
    """linegate_group_state_number."""
    IDLE = 0  # nothing is written: not armed yet, or released
    TAKING = 1  # is written; the gateway did not report that it applies the values
    HELD = 2  # the gateway applies the values
    REFUSED = 3  # the gateway refused them; nothing is written
    LOST = 4  # nothing is written, and the values are discarded


class Outcome(enum.IntEnum):
    """linegate_outcome."""
    PENDING = 0
    DONE = 1
    SDO_ABORT = 2
    INTERFACE_ERROR = 3
    REFUSED = 4


@dataclass(frozen=True)
class Value:
    """A value by name. `data` is the last one, whatever the quality; None: there is none. With a scale or offset in
    plant.yaml or its device file it is a float in its unit, and `raw` is the value in the PDO."""
    name: str
    data: Data
    quality: Quality
    known: bool  # outputs: it was written, or has a default
    time: int  # of the last PDO that carried it
    unit: str = ""  # of data: "bar"; empty: none or unknown
    raw: Data = None  # not scaled

    @property
    def good(self) -> bool:
        """Whether the value can be relied on."""
        return self.quality == Quality.GOOD

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit and self.data is not None else ""
        return f"{self.name} = {self.data}{unit}, {self.quality.text}"


@dataclass(frozen=True)
class Snapshot:
    """Values of one moment, in the order of their names."""
    values: Sequence[Value]
    time: int  # of the newest image
    sequence: int  # of that image
    # Call-backs: images that this client did not receive since the last one, and items of changes() that were left out.
    lost: int

    @property
    def good(self) -> bool:
        """Whether all of them are good."""
        return all(value.good for value in self.values)

    def __getitem__(self, place: int) -> Value:
        return self.values[place]

    def __len__(self) -> int:
        return len(self.values)


@dataclass(frozen=True)
class LineChange:
    """A change of a line."""
    gateway: str
    line: str
    status: LineStatus
    restarted: bool  # by another start of the gateway
    layout_changed: bool  # names and places of the values are others


@dataclass(frozen=True)
class Event:
    """Something that happened on a line (`line` is empty: in the gateway itself)."""
    gateway: str
    line: str
    name: str  # of the kind: "heartbeat-lost"; empty: unknown to this version
    text: str
    number: int
    stream: int  # of the number
    time: int
    kind: int  # EventKind of linegate.idl
    severity: int  # 0 information, 1 warning, 2 error
    node: int  # 1..127, 0 = the line itself
    code: int  # by kind
    value: int
    data: bytes
    # Of an EventReader: numbers of the line directly before this one without an event, at most so many are lost: a
    # gateway that was killed leaves numbers out. And whether its journal was lost.
    missed: int
    journal_lost: bool


def _error(code: int, of: str = "") -> Error:
    text = (of + ": " if of else "") + _lib.linegate_error_text(code).decode()
    return (NotReady if code == -2 else Error)(code, text)


def _encoded(text: str, of: str = "a name") -> bytes:
    if not isinstance(text, str):
        raise TypeError(f"{of} is a str, not {type(text).__name__}")
    if "\0" in text:
        raise ValueError(f"{of} has no character 0")
    return text.encode()


def _joined(of: str, names: Sequence[str]) -> bytes:
    """Names with commas between them. A str would be a sequence of its characters."""
    if isinstance(names, str):
        raise TypeError(f"{of} is a list of str, not a str")
    return ",".join(_encoded(name, f"an item of {of}").decode() for name in names).encode()


def _setting(name: str, value: Output, raw: bool) -> c.Setting:
    to = c.Setting(name=_encoded(name), raw=int(raw))
    if isinstance(value, (str, bytes, bytearray, memoryview)):
        to.type = 5 if isinstance(value, str) else 6
        data = value.encode() if isinstance(value, str) else bytes(value)
        if isinstance(value, str) and "\0" in value:
            raise _error(-6, name)
        to.bytes, to.length = data, len(data)
    elif isinstance(value, numbers.Real) and not isinstance(value, numbers.Integral):
        to.type, to.real = 4, float(value)
    else:
        number = _index(name, value, "a bool, int, float, str or bytes")
        if not -(1 << 63) <= number < 1 << 64:
            raise _error(-6, name)
        to.type = 2 if number < 1 << 63 else 3
        to.integer, to.unsigned_integer = (number, 0) if number < 1 << 63 else (0, number)
    return to


def _checked(result: int) -> int:
    """The result of a C function; raises its error."""
    if result >= 0:
        return result
    raise _error(result)


def _number(name: str, value: int, most: int = 0xFFFF_FFFF) -> int:
    """For an argument of a type that ends there, whose range is smaller: the C function refuses what is beyond it, with the
    range. ctypes would cut the number to another one."""
    number = _index(name, value)
    return number if 0 <= number <= most else most


def _whole(name: str, value: int) -> int:
    """For an argument whose range are all numbers of 32 bits."""
    number = _index(name, value)
    if not 0 <= number < 1 << 32:
        raise Error(-6, f"{name} is not 0..FFFFFFFFh")
    return number


def _attempts(value: int) -> int:
    """0 and 1 are the same; in the library 0 would be the number of an earlier call."""
    return max(1, _whole("attempts", value))


def _index(name: str, value: Any, wanted: str = "an integer") -> int:
    try:
        return operator.index(value)
    except TypeError:
        raise TypeError(f"{name} is {wanted}, not {type(value).__name__}") from None


def _octets(name: str, value: bytes) -> bytes:
    if not isinstance(value, (bytes, bytearray, memoryview)):
        raise TypeError(f"{name} of a command is bytes, not {type(value).__name__}: see int.to_bytes()")
    return bytes(value)


def _milliseconds(seconds: float, name: str = "timeout", most: float = 3600.0) -> int:
    """Of a time, at most that many seconds."""
    try:
        seconds = float(seconds / 1)
    except TypeError:
        raise TypeError(f"{name} is a number of seconds, not {type(seconds).__name__}") from None
    if seconds != seconds:
        raise ValueError(f"{name} is no number")
    return round(max(0.0, min(seconds, most)) * 1000)


def _watchdog(seconds: float) -> int:
    milliseconds = _milliseconds(seconds, "watchdog", _MOST_WATCHDOG)
    if not 0 <= seconds <= _MOST_WATCHDOG:
        raise Error(-1, f"watchdog is not 0..{_MOST_WATCHDOG} s")
    return max(1, milliseconds) if seconds > 0 else 0


def _structure(of: Any, /, **members: Any) -> Any:
    """ctypes would cut numbers that do not fit, and ignore names that do not exist."""
    types = dict(of._fields_)
    for name, value in members.items():
        if name not in types:
            raise TypeError(f"there is no member {name}")
        if not issubclass(types[name], _INTEGERS):
            continue
        number = _index(name, value)
        lowest = -(1 << 8 * ctypes.sizeof(types[name]) - 1) if types[name](-1).value < 0 else 0
        highest = lowest + (1 << 8 * ctypes.sizeof(types[name])) - 1
        if not lowest <= number <= highest:
            raise Error(-6, f"{name} is not {lowest}..{highest}")
    return of(**members)


def _text(raw: Optional[bytes]) -> str:
    return (raw or b"").decode(errors="replace")


def _event(of: Any) -> Event:
    return Event(_text(of.gateway), _text(of.line), _text(of.name), _text(of.text), of.number, of.stream, of.time,
                 of.kind, of.severity, of.node, of.code, of.value, bytes(of.data[:of.length]), of.missed,
                 bool(of.journal_lost))


def _place_before(event: Event) -> tuple[str, str]:
    """The line of an event, and the position before it, as linegate_event_position() has them."""
    line = quote(event.gateway, safe="") + "/" + quote(event.line, safe="")
    return line, f"{event.stream}:{event.number - 1}:{line}"


def _names(names: Sequence[str]) -> Any:
    return (ctypes.c_char_p * len(names))(*(_encoded(name) for name in names))


def _data(value: c.Value) -> Data:
    raw = bytes(value.bytes[:value.length])
    by_type: Sequence[Callable[[], Data]] = (
        lambda: None, lambda: bool(value.integer), lambda: value.integer, lambda: value.unsigned_integer,
        lambda: value.real, lambda: _text(raw), lambda: raw)
    return by_type[value.type]() if 0 <= value.type < len(by_type) else raw


def _raw(value: c.Value, data: Data) -> Data:
    """The value in the PDO: `data`, unless that is scaled."""
    if value.raw_type == value.type and value.raw == value.number:
        return data
    by_type: Sequence[Callable[[], Data]] = (lambda: None, lambda: bool(value.integer), lambda: value.integer,
                                             lambda: value.unsigned_integer)
    return by_type[value.raw_type]() if 0 <= value.raw_type < len(by_type) else value.raw


def _value(name: str, value: c.Value) -> Value:
    data = _data(value)
    return Value(name, data, Quality(value.quality), bool(value.known), value.time, _text(value.unit),
                 _raw(value, data))


def _snapshot(names: Sequence[str], values: Any, image: c.Image) -> Snapshot:
    return Snapshot(tuple(_value(name, values[i]) for i, name in enumerate(names)), image.time, image.sequence,
                    image.lost)


def _with_lost(dropped: Snapshot, following: Snapshot) -> Snapshot:
    """The following one, which counts the dropped one."""
    return replace(following, lost=following.lost + dropped.lost + 1)


def _close_forgotten(handle: int, process: int) -> None:
    """Of a client that nobody closed, at the latest at the end of the program: the gateway then knows at once. A child
    after fork() may not use it."""
    if os.getpid() == process:
        _lib.linegate_close(handle)


class Subscription:
    """Call-backs until cancel(), or the end of the client."""

    def __init__(self, client: "Client", number: int, callback: Any, alive: list[bool]) -> None:
        self._client, self._number, self._alive = client, number, alive
        client._callbacks[number] = callback  # ctypes does not keep it

    def cancel(self) -> None:
        """Ends the call-backs, also those of what was received already."""
        self._alive.clear()
        if self._number in self._client._callbacks:
            _lib.linegate_unsubscribe(self._client._handle, self._number)  # waits for a call-back that is running
            self._client._callbacks.pop(self._number, None)


class EventReader(Subscription):
    """The events of all lines and gateways, those of a line in their order and each once: for the call-back of
    Client.follow_events(), or in `async for`."""

    def __init__(self, client: "Client", after: Optional[str], call_back: Optional[Callable[[Event], None]]) -> None:
        self._waiting: deque[Event] = deque()  # the application does not have them yet
        self._dropped: dict[str, str] = {}  # by line: the position before the first one that was dropped
        self._late = False  # events are dropped
        self._end = ""  # the position at cancel()
        alive = [True]

        def happened(_user: Any, of: Any) -> None:
            event = _event(of.contents)
            if call_back is not None:
                self._waiting.append(event)
                client._due.append((alive, lambda: self._pass(call_back)))
            elif self._late or len(self._waiting) >= _MOST_WAITING:
                self._late = True
                if event.stream and event.number:
                    self._dropped.setdefault(*_place_before(event))
            else:
                self._waiting.append(event)
        callback = c.ON_EVENT(client._kept(happened))
        start = None if after is None else _encoded(after, "a position")
        super().__init__(client, _checked(_lib.linegate_follow_events(client._handle, start, callback, None)), callback,
                         alive)
        client._readers.add(self)

    def _pass(self, call_back: Callable[[Event], None]) -> None:
        event = self._waiting[0]
        del self._waiting[0]  # after popleft() Python may run a signal handler before the event is stored
        try:
            call_back(event)
        except (KeyboardInterrupt, SystemExit):
            self._waiting.appendleft(event)
            raise

    @property
    def position(self) -> str:
        """Where the application is, the event that it has last included: a text to be stored. With it as `after` the
        next event follows, whatever became of the application and the gateways meanwhile. An event whose call-back
        KeyboardInterrupt or SystemExit ended is not included."""
        if not self._alive:
            return self._end
        size = _checked(_lib.linegate_event_position(self._client._handle, self._number, None, 0))
        buffer = ctypes.create_string_buffer(size + _GROWTH)
        _checked(_lib.linegate_event_position(self._client._handle, self._number, buffer, len(buffer)))
        places = {one.rpartition(":")[2]: one for one in _text(buffer.value).split(" ") if one}
        places.update(self._dropped)
        places.update(_place_before(event) for event in reversed(list(self._waiting)) if event.stream and event.number)
        return " ".join(places.values())

    def cancel(self) -> None:
        """Ends the call-backs, also those of what was received already. The position remains, as at the end of the
        client."""
        self._end = self.position
        super().cancel()
        self._client._readers.discard(self)

    def __aiter__(self) -> "EventReader":
        return self

    async def __anext__(self) -> Event:
        """Ends after cancel(). Raises Error when the application was late by more than 10,000 events: follow again from
        the position."""
        await self._client._until(lambda: bool(self._waiting or self._late or not self._alive))
        if not self._alive:
            raise StopAsyncIteration
        if self._waiting:
            return self._waiting.popleft()
        self.cancel()
        raise Error(-7, "more than 10,000 events waited: follow them again from the position")


class Call:
    """A command under way, or its result: `await` it, or call result(). It goes on when the task that awaits it is
    cancelled, as by asyncio.wait_for(), and without its object: cancel() ends it."""

    def __init__(self, client: "Client", number: int) -> None:
        self._client, self._number = client, number

    def __del__(self) -> None:
        self._client._unused.append(self._number)  # freed by the next poll; the call goes on

    def _result(self) -> c.Result:
        result = c.Result()
        _checked(_lib.linegate_call_result(self._client._handle, self._number, result))
        return result

    @property
    def outcome(self) -> Outcome:
        """PENDING, DONE, or the kind of the error."""
        return Outcome(self._result().outcome)

    @property
    def done(self) -> bool:
        """Whether it has ended."""
        return self.outcome != Outcome.PENDING

    @property
    def progress(self) -> tuple[int, int]:
        """Amount done and total of a long command, by its last report; 0 = unknown."""
        result = self._result()
        return result.progress_done, result.progress_total

    def _data(self) -> bytes:
        result = self._result()
        if result.outcome != Outcome.DONE:
            raise CallError(Outcome(result.outcome), result.code, _text(result.text))
        return self._bytes(result)

    def _bytes(self, result: c.Result) -> bytes:
        """The data of the reply, also of a call that failed."""
        buffer = ctypes.create_string_buffer(max(1, result.length))
        length = _checked(_lib.linegate_call_data(self._client._handle, self._number, buffer, result.length))
        return buffer.raw[:length]

    def result(self) -> bytes:
        """Polls until it is done, without an event loop. Returns the data of the reply; raises CallError."""
        self._client._forbid_loop()
        self._client._free()
        while self._result().outcome == Outcome.PENDING:
            _checked(self._client._poll(_lib.linegate_poll, _POLL_MS))
        return self._data()

    def __await__(self) -> Generator[Any, None, bytes]:
        yield from self._client._until(lambda: self.done).__await__()
        return self._data()

    def cancel(self) -> None:
        """Ends a call that is pending. The gateway may carry it out nevertheless."""
        _checked(_lib.linegate_call_cancel(self._client._handle, self._number))


class Group:
    """A group of outputs. Nothing is written before arm() or hold(), and nothing after a loss until the next one: this
    is a decision of the application. A loss discards all values of the group."""

    def __init__(self, line: "Line", number: int) -> None:
        self._client, self._line, self._number = line._client, line, number

    def _state(self) -> tuple[GroupState, str]:
        text = ctypes.create_string_buffer(256)
        state = _checked(_lib.linegate_group_state(self._client._handle, self._number, text, len(text)))
        return GroupState(state), _text(text.value)

    @property
    def state(self) -> GroupState:
        """Its state."""
        return self._state()[0]

    @property
    def text(self) -> str:
        """Its state in words, with the reason."""
        return self._state()[1]

    @property
    def owner(self) -> str:
        """The client whose values the gateway applied last; empty: none."""
        owner = ctypes.create_string_buffer(256)
        _checked(_lib.linegate_group_owner(self._client._handle, self._number, owner, len(owner)))
        return _text(owner.value)

    def set(self, name: str, value: Output, raw: bool = False) -> None:
        """The value of an output from now on, in its unit if it is scaled; values that are set between two polls are
        sent together. str: of VISIBLE_STRING (characters up to U+00FF) and UNICODE_STRING; bytes: of any type that is
        no number, as many as it has. raw: the value in the PDO, without scaling, and beyond the limits of the output.
        Raises NotReady if the line is not ready."""
        self._set({name: value}, raw)

    def _set(self, values: Mapping[str, Output], raw: bool = False) -> None:
        """All of them, or none."""
        settings = (c.Setting * len(values))(*(_setting(name, value, raw) for name, value in values.items()))
        failed = ctypes.c_size_t()
        result = _lib.linegate_set(self._client._handle, self._number, settings, len(values), failed)
        if result < 0:
            raise _error(result, list(values)[failed.value] if failed.value < len(values) else "")

    def arm(self) -> None:
        """Begins to write. Outputs that were not set since the last loss or release keep their values: if another client
        held the group within the time of its watchdog, those of that client. Raises NotReady if the line is not
        ready."""
        _checked(_lib.linegate_arm(self._client._handle, self._number))

    def release(self) -> None:
        """Stops writing: after its time the watchdog reacts."""
        _checked(_lib.linegate_release(self._client._handle, self._number))

    async def hold(self, values: Mapping[str, Output]) -> None:
        """Waits until the line is ready, sets the values, arms the group, and waits until the gateway applies them: while
        a client that is stronger, or was first, holds the group (`owner`), for as long as that one does. Raises Error if
        a value is not possible: then none is set. Raises GroupError if the gateway refuses them or the group is lost
        meanwhile. Releases the group if it is cancelled."""
        while True:
            await self._line.ready()
            try:
                self._set(values)
                self.arm()
                break
            except NotReady:
                await self._client._turn()
        try:
            await self._client._until(lambda: self.state != GroupState.TAKING)
        except BaseException:  # cancelled: the values must not be applied later
            _lib.linegate_release(self._client._handle, self._number)
            raise
        state, text = self._state()
        if state != GroupState.HELD:
            raise GroupError(state, text)

    async def ended(self) -> str:
        """Waits until nothing is written any more. Returns the state in words, with the reason."""
        await self._client._until(lambda: self.state not in (GroupState.TAKING, GroupState.HELD))
        return self.text

    def on_state(self, call_back: Callable[["Group"], None]) -> Subscription:
        """Calls back when the state changes."""
        alive = [True]

        def changed(_user: Any, _group: int, _state: int) -> None:
            self._client._due.append((alive, lambda: call_back(self)))
        callback = c.ON_GROUP(self._client._kept(changed))
        return Subscription(self._client, _checked(_lib.linegate_subscribe_group(
            self._client._handle, self._number, callback, None)), callback, alive)


class Line:
    """A line by name. It need not exist yet."""

    def __init__(self, client: "Client", name: str) -> None:
        self.name = name
        self._client = client
        self._groups: dict[tuple[str, int, int], Group] = {}
        self._numbers: dict[int, int] = {}  # by `attempts`
        self._number = _checked(_lib.linegate_line(client._handle, _encoded(name)))

    @property
    def status(self) -> LineStatus:
        """Whether it is ready."""
        return LineStatus(_checked(_lib.linegate_line_status(self._client._handle, self._number)))

    def wait(self, timeout: float) -> bool:
        """Polls until it is ready, at most for that time, without an event loop. Returns whether it is."""
        self._client._forbid_loop()
        end = time.monotonic() + _milliseconds(timeout) / 1000
        while True:
            left = max(0, round((end - time.monotonic()) * 1000))
            result = self._client._poll(_lib.linegate_line_wait, self._number, min(left, _POLL_MS))
            if result != -9 or left <= _POLL_MS:
                return result != -9 and _checked(result) == 0

    async def ready(self) -> None:
        """Waits until it is ready."""
        await self._client._until(lambda: self.status == LineStatus.READY)

    def _list(self, outputs: int) -> list[str]:
        out: list[str] = []
        name = ctypes.create_string_buffer(1024)
        while True:
            length = _lib.linegate_line_name(self._client._handle, self._number, outputs, len(out), name, len(name))
            if length == -4:
                return out
            _checked(length)
            out.append(_text(name.value))

    def inputs(self) -> list[str]:
        """The names of the inputs; empty if the layout was not received."""
        return self._list(0)

    def outputs(self) -> list[str]:
        """The names of the outputs."""
        return self._list(1)

    def read(self, *names: str) -> Snapshot:
        """The values of these names, of one moment for each direction. Names are those of `linegate image`;
        "inputs:NAME" and "outputs:NAME" name the direction."""
        values, image = (c.Value * len(names))(), c.Image()
        _checked(_lib.linegate_read(self._client._handle, self._number, _names(names), len(names), values, image))
        return _snapshot(names, values, image)

    def on_change(self, names: Sequence[str], call_back: Callable[[Snapshot], None]) -> Subscription:
        """Calls back at the beginning, and when value or quality of one of them changes."""
        names, alive = (names,) if isinstance(names, str) else tuple(names), [True]

        def changed(_user: Any, values: Any, _count: int, image: Any) -> None:
            now = _snapshot(names, values, image.contents)
            self._client._due.append((alive, lambda: call_back(now)))
        callback = c.ON_VALUES(self._client._kept(changed))
        return Subscription(self._client, _checked(_lib.linegate_subscribe(
            self._client._handle, self._number, _names(names), len(names), callback, None)), callback, alive)

    async def changes(self, *names: str) -> AsyncIterator[Snapshot]:
        """What on_change() calls back with, as a stream. A consumer that is late by more than 10,000 items misses the
        oldest: the next one counts them in `lost`."""
        async for snapshot in self._client._stream(lambda put: self.on_change(names, put), _with_lost):
            yield snapshot

    def group(self, name: str = "", *, watchdog: float = 1.0, reactions: int = 1) -> Group:
        """A group of outputs by name or number; "": of a line without groups. watchdog: time without a sample after
        which the gateway reacts, 0 = never. reactions: WATCHDOG_ bits of linegate.idl, 1: the outputs become 0. The
        same arguments give the same object."""
        key = (name, _watchdog(watchdog), _number("reactions", reactions))
        if key not in self._groups:
            self._groups[key] = Group(self, _checked(_lib.linegate_group(self._client._handle, self._number,
                                                                         _encoded(name), *key[1:])))
        return self._groups[key]

    def request(self, kind: int, *, timeout: float = 10.0, attempts: int = 1, data: bytes = b"",
                **members: int) -> Call:
        """A command by the members of a CommandRequest: linegate.idl, COMMANDS.md. attempts: how often it is tried, again
        if it was not begun because a queue was full (REFUSAL_BUSY); one that only reads also after the SDO abort 0504
        0000h. After that abort a write may have been carried out, so it is not repeated."""
        data = _octets("data", data)
        request = _structure(c.Request, size=ctypes.sizeof(c.Request), kind=kind, data=data, length=len(data),
                             attempts=_attempts(attempts), **members)
        if self._client._task is None:
            self._client._free()
        return Call(self._client, _checked(_lib.linegate_request_call(self._client._handle, self._number, request,
                                                                      _milliseconds(timeout, most=_MOST_TIMEOUT))))

    def _begin(self, function: Callable[..., int], *arguments: Any, timeout: float = 10.0, attempts: int = 1) -> Call:
        """A command by a function of linegate.h."""
        attempts, milliseconds = _attempts(attempts), _milliseconds(timeout, most=_MOST_TIMEOUT)
        if self._client._task is None:
            self._client._free()
        return Call(self._client, _checked(function(self._client._handle, self._number_for(attempts), *arguments,
                                                    milliseconds)))

    def _number_for(self, attempts: int) -> int:
        """The library has `attempts` by number of a line, not by call. Each value has its own number and is set only once,
        because a signal handler or another thread may begin a call between linegate_set_attempts() and the call."""
        if attempts <= 1:
            return self._number
        if attempts not in self._numbers:
            handle = self._client._handle
            number = _checked(_lib.linegate_line(handle, _encoded(self.name)))
            _checked(_lib.linegate_set_attempts(handle, number, attempts))
            if self._numbers.setdefault(attempts, number) != number:
                _lib.linegate_free(handle, number)
        return self._numbers[attempts]

    def sdo_read(self, node: int, index: int, sub: int = 0, *, timeout: float = 10.0, attempts: int = 1) -> Call:
        """SDO_READ: reads an object of a device. node: 1 to 127; index: 0 to FFFFh; sub: 0 to 255. A call with another
        number fails with CallError, whose text names it and its range."""
        return self._begin(_lib.linegate_sdo_read, _number("node", node), _number("index", index), _number("sub", sub),
                           timeout=timeout, attempts=attempts)

    def sdo_write(self, node: int, index: int, sub: int, value: bytes, *, timeout: float = 10.0,
                  attempts: int = 1) -> Call:
        """SDO_WRITE: writes an object of a device. Numbers as of sdo_read(); value: little-endian."""
        value = _octets("value", value)
        return self._begin(_lib.linegate_sdo_write, _number("node", node), _number("index", index), _number("sub", sub),
                           value, len(value), timeout=timeout, attempts=attempts)

    def nmt(self, node: int, command: int, *, timeout: float = 10.0, attempts: int = 1) -> Call:
        """NMT: sends an NMT command: NMT_ of linegate.idl (1 start, 2 stop, 128 pre-operational, ...); node: 1 to 127, 0 =
        all."""
        return self._begin(_lib.linegate_nmt, _number("node", node), _number("command", command), timeout=timeout,
                           attempts=attempts)


def _work(requests: deque[Any], bell: SimpleQueue[Any], _end: Any) -> None:
    """The thread of a _Worker."""
    while bell.get() is None:
        while requests:
            function, arguments, answer = requests[0]
            try:
                result = function(*arguments)
            except BaseException as failed:  # pylint: disable=broad-except
                result = failed
            del requests[0]
            answer.put(result)


class _Worker:
    """A thread that calls functions of the library, one after the other. Not an Executor: that one holds locks while it
    runs Python code, and a signal handler that comes there and polls would wait for them for ever. Functions of deque,
    SimpleQueue and _thread are not interrupted."""

    def __init__(self) -> None:
        self.requests: deque[Any] = deque()  # function, arguments, queue of the result; the first one may be running
        self.bell: SimpleQueue[Any] = SimpleQueue()
        # The end of this object rings with the reference, which ends the thread. Python does not wait for the thread at its
        # own end: _close_forgotten() has ended what it may have called.
        _thread.start_new_thread(_work, (self.requests, self.bell, weakref.ref(self, self.bell.put)))


class Client:
    """A client in a DDS domain; the arguments are those of linegate_options. Raises Error if it cannot connect."""

    def __init__(self, domain: int = 0, *, profile: Optional[str] = None, identity: Optional[str] = None,
                 name: Optional[str] = None, strength: int = 0, read_only: bool = False,
                 interfaces: Sequence[str] = (), peers: Sequence[str] = (),
                 discovery_servers: Sequence[str] = (), multicast: bool = False, lines: Sequence[str] = ()) -> None:
        self._callbacks: dict[int, Any] = {}
        self._due: deque[tuple[list[bool], Callable[[], None]]] = deque()  # call-backs; empty list: not wanted any more
        self._lines: dict[str, Line] = {}
        self._readers: set[EventReader] = set()
        self._unused: deque[int] = deque()  # numbers to be freed
        self._task: Optional[asyncio.Task[None]] = None
        self._loop: Optional[asyncio.AbstractEventLoop] = None  # of the task
        self._waiting: list[tuple[Callable[[], bool], asyncio.Future[None]]] = []  # checked after each poll of the task
        self._ending = False
        self._delivering = 0  # call-backs that run
        self._failed: deque[BaseException] = deque(maxlen=_MOST_FAILED)  # what functions that the library called raised
        self._worker: Optional[_Worker] = None  # of polls of the main thread
        self._handle: Optional[int] = None
        self._closed = ctypes.c_char()  # no client has its address
        error = ctypes.create_string_buffer(1024)
        encoded = [None if text is None else _encoded(text, of) for of, text in
                   (("profile", profile), ("identity", identity), ("name", name))]
        encoded += [_joined(of, names) for of, names in
                    (("interfaces", interfaces), ("peers", peers), ("discovery_servers", discovery_servers),
                     ("lines", lines))]
        options = _structure(c.Options, size=ctypes.sizeof(c.Options), domain=domain, strength=strength,
                             profile=encoded[0], identity=encoded[1], name=encoded[2], read_only=int(read_only),
                             interfaces=encoded[3], peers=encoded[4], discovery_servers=encoded[5],
                             multicast=int(multicast), lines=encoded[6])
        self._handle = _lib.linegate_connect(options, error, len(error))
        if not self._handle:
            raise Error(-8, _text(error.value))
        self._at_end = weakref.finalize(self, _close_forgotten, self._handle, os.getpid())

    def close(self) -> None:
        """Releases all groups. Not within a call-back."""
        if self._delivering:
            raise Error(-1, "a client is not closed within a call-back")
        for reader in list(self._readers):
            reader.cancel()
        closed = ctypes.addressof(self._closed)
        if self._handle != closed:
            _checked(_lib.linegate_close(self._handle))
        self._at_end.detach()
        self._worker = None
        self._handle = closed  # the address of the client may be that of another one later
        self._callbacks.clear()
        self._due.clear()

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, kind: Optional[type[BaseException]], error: Optional[BaseException],
                 trace: Optional[TracebackType]) -> None:
        self.close()

    def poll(self, timeout: float = 0.1) -> None:
        """Receives samples, calls call-backs, and writes held outputs, without an event loop. Returns when something
        was received, or the time has passed; may return early. Call it at least every 100 ms while outputs are held.
        What a call-back raises ends it; the next one continues. A call-back that KeyboardInterrupt or SystemExit ended,
        as of a signal handler, is called again. A sample that could not be converted is reported by the exception, after
        the call-backs."""
        self._forbid_loop()
        _checked(self._poll(_lib.linegate_poll, _milliseconds(timeout)))
        self._free()
        while self._due:
            self._deliver()
        if self._failed:  # after the call-backs: one sample that always fails must not hold them back
            raise self._failed.popleft()

    def line(self, name: str) -> Line:
        """A line: "LINE", or "GATEWAY/LINE"."""
        if name not in self._lines:
            self._lines[name] = Line(self, name)
        return self._lines[name]

    def on_line(self, call_back: Callable[[LineChange], None]) -> Subscription:
        """Calls back for each line at the beginning, and when its status changes, its gateway was restarted, or its
        layout is another one."""
        alive = [True]

        def changed(_user: Any, gateway: bytes, line: bytes, status: int, restarted: int, layout: int) -> None:
            change = LineChange(_text(gateway), _text(line), LineStatus(status), bool(restarted), bool(layout))
            self._due.append((alive, lambda: call_back(change)))
        callback = c.ON_LINE(self._kept(changed))
        return Subscription(self, _checked(_lib.linegate_subscribe_lines(self._handle, callback, None)), callback, alive)

    async def lines(self) -> AsyncIterator[LineChange]:
        """What on_line() calls back with, as a stream. Raises Error when the application was late by more than 10,000
        changes, after those: a new stream begins with the present state of each line."""
        async for change in self._stream(self.on_line):
            yield change

    def on_event(self, call_back: Callable[[Event], None]) -> Subscription:
        """Calls back for each event of all lines and gateways from now on, as they are received."""
        alive = [True]

        def happened(_user: Any, of: Any) -> None:
            event = _event(of.contents)
            self._due.append((alive, lambda: call_back(event)))
        callback = c.ON_EVENT(self._kept(happened))
        number = _checked(_lib.linegate_subscribe_events(self._handle, callback, None))
        return Subscription(self, number, callback, alive)

    def follow_events(self, call_back: Callable[[Event], None], after: Optional[str] = None) -> EventReader:
        """Calls back for the events of all lines and gateways, those of a line in their order and each once; what this
        client did not receive is read from the journals of the gateways. `after`: EventReader.position of this or an
        earlier run, or "" for the oldest events that the journals have, as for a line that the position does not name;
        None: from now on, and of a line that appears later, once its state was received. With an identity of role
        viewer, and of gateways without a journal, events that were not received are reported as missed."""
        return EventReader(self, after, call_back)

    def events(self, after: Optional[str] = None) -> EventReader:
        """The same, for `async for`."""
        return EventReader(self, after, None)

    # --- with an event loop ---

    async def __aenter__(self) -> "Client":
        if self._task is not None:
            raise Error(-1, "the client is, or was, in `async with` already: make another one")
        self._loop = asyncio.get_running_loop()
        self._task = asyncio.create_task(self._run())
        return self

    async def __aexit__(self, kind: Optional[type[BaseException]], error: Optional[BaseException],
                        trace: Optional[TracebackType]) -> None:
        self._ending = True
        _lib.linegate_wake(self._handle)
        try:
            if self._task is not None:
                await asyncio.wait([self._task])
        finally:  # also if this task is cancelled meanwhile
            self.close()

    async def _run(self) -> None:
        """Polls in a thread, one poll for each turn of the event loop: the loop does not wait for samples, and held
        outputs are not written any more when it hangs."""
        loop = asyncio.get_running_loop()
        try:
            with ThreadPoolExecutor(1, "linegate") as thread:
                while not self._ending:
                    polled = await loop.run_in_executor(thread, _lib.linegate_poll, self._handle, _POLL_MS)
                    self._free()
                    while self._failed:
                        loop.call_exception_handler({"message": "a sample was not passed on by linegate",
                                                     "exception": self._failed.popleft()})
                    while self._due:
                        try:
                            self._deliver()
                        except (Exception, asyncio.CancelledError) as failed:  # pylint: disable=broad-except
                            loop.call_exception_handler({"message": "a call-back of linegate failed",
                                                         "exception": failed})
                    self._ending = self._ending or polled < 0
                    self._check_waiting()
        finally:  # also when the application cancels all tasks: nobody waits any more
            self._ending = True
            self._check_waiting()

    def _check_waiting(self) -> None:
        """Between two polls, because a C function that meets a poll ends it."""
        waiting, self._waiting = self._waiting, []
        for condition, future in waiting:
            if future.done():
                continue
            try:
                if self._ending:
                    raise Error(-8, "the client has ended")
                if condition():
                    future.set_result(None)
                else:
                    self._waiting.append((condition, future))
            except Exception as failed:  # pylint: disable=broad-except
                future.set_exception(failed)

    async def _turn(self) -> None:
        """Waits for the end of the next poll."""
        await self._after_poll(lambda: True)

    async def _after_poll(self, condition: Callable[[], bool]) -> None:
        if self._task is None or self._ending:
            raise Error(-8, "the client is not in `async with`, or has ended")
        if self._loop is not asyncio.get_running_loop():
            raise Error(-1, "the client is in `async with` of another event loop")
        future: asyncio.Future[None] = self._loop.create_future()
        self._waiting.append((condition, future))
        await future

    async def _until(self, condition: Callable[[], bool]) -> None:
        if not condition():
            await self._after_poll(condition)

    async def _stream(self, subscribe: Callable[[Callable[[Any], None]], Subscription],
                      merge: Optional[Callable[[Any, Any], Any]] = None) -> AsyncIterator[Any]:
        """merge: makes one item of the oldest two, for a consumer that is late; without it, that is an error."""
        items: deque[Any] = deque()
        late = False

        def put(item: Any) -> None:
            nonlocal late
            late = late or (merge is None and len(items) >= _MOST_WAITING)
            if late:
                return
            items.append(item)
            if merge is not None and len(items) > _MOST_WAITING:
                oldest = items.popleft()
                items[0] = merge(oldest, items[0])
        subscription = subscribe(put)
        try:
            while True:
                await self._until(lambda: bool(items) or late)
                if not items:
                    raise Error(-7, "more than 10,000 items waited: begin a new stream")
                yield items.popleft()
        finally:
            subscription.cancel()

    def _forbid_loop(self) -> None:
        if self._task is not None:
            raise Error(-1, "with an event loop, await instead: it polls itself")

    def _deliver(self) -> None:
        """The oldest of the call-backs that are due, if it is still wanted."""
        if not self._due:
            return  # a signal handler has polled meanwhile
        due = self._due[0]
        del self._due[0]  # after popleft() Python may run a signal handler before it is stored
        if not due[0]:
            return
        self._delivering += 1
        try:
            due[1]()
        except (KeyboardInterrupt, SystemExit):
            self._due.appendleft(due)
            raise
        finally:
            self._delivering -= 1

    def _kept(self, function: Callable[..., None]) -> Callable[..., None]:
        """A function that the library calls. What it raises is kept for poll(), because ctypes prints and drops it; and it
        is called a second time, because the library counts the event as passed on."""
        def call(*arguments: Any) -> None:
            try:
                function(*arguments)
            except BaseException as failed:  # pylint: disable=broad-except
                self._failed.append(failed)
                try:
                    function(*arguments)
                except BaseException:  # pylint: disable=broad-except
                    pass  # the first one is reported
        return call

    def _poll(self, function: Callable[..., int], *arguments: Any) -> int:
        """A function of the library that calls back. Python runs signal handlers in the main thread, before the first
        instruction of any function: what they raise there would be dropped by ctypes, together with the event. Hence
        another thread calls it."""
        worker = None
        if threading.current_thread() is threading.main_thread() and self._at_end.alive:
            try:
                worker = self._worker = self._worker or _Worker()
            except RuntimeError:
                pass  # Python ends, and starts no thread any more
        if worker is None:
            return function(self._handle, *arguments)
        answer: SimpleQueue[Any] = SimpleQueue()
        result: Any = None
        if worker.requests:  # this is a signal handler within a poll, or a poll was interrupted: that one ends
            _lib.linegate_wake(self._handle)
        try:
            worker.requests.append((function, (self._handle, *arguments), answer))
            worker.bell.put(None)
            result = answer.get()
        finally:
            if result is None:  # nobody waits for it any more, and it would write held outputs
                _lib.linegate_wake(self._handle)
        if isinstance(result, BaseException):
            raise result
        return result

    def _free(self) -> None:
        with contextlib.suppress(IndexError):  # another thread may take the last one
            while True:
                _lib.linegate_free(self._handle, self._unused.popleft())


from . import commands  # noqa: E402  pylint: disable=wrong-import-position
