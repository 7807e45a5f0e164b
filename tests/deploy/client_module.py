#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The Python module of the client library over a library of its own, without a gateway: what becomes of exceptions that
come while the library calls back, of signal handlers that poll or close, of consumers that are late, and of calls of
several threads.

client_module.py CC.
"""

import _thread
import asyncio
import ctypes
import dis
import faulthandler
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
sys.path[:0] = [os.path.join(ROOT, "bridges", "client", "python"), os.path.join(ROOT, "tests", "gateway", "cli")]
from plant_process import expect, raised  # noqa: E402 pylint: disable=wrong-import-position


class Functions:
    """Of which each exists."""

    def __getattr__(self, name):
        return lambda *arguments: 1


LOAD, ctypes.CDLL = ctypes.CDLL, lambda name: Functions()
import linegate  # noqa: E402 pylint: disable=wrong-import-position
from linegate import _library as c  # noqa: E402 pylint: disable=wrong-import-position
ctypes.CDLL = LOAD

# Python then runs the handler of the signal at the first instruction of the call-back, if that is in the main thread.
SOURCE = """
#include <signal.h>
void report(void (*call_back)(void*, const void*), const void* event, int with_signal) {
  if (with_signal)
    raise(SIGINT);
  call_back(0, event);
}
"""


class Library(Functions):
    """With what a client needs that follows events. Each poll reports one event."""

    def __init__(self, helper):
        self.report = helper.report
        self.report.argtypes, self.report.restype = [c.ON_EVENT, ctypes.POINTER(c.Event), ctypes.c_int], None
        self.number = 0
        self.call_back = self.on_values = self.on_line = None
        self.lines, self.attempts, self.calls, self.freed, self.meanwhile = 0, {}, [], [], None
        self.woken = threading.Event()
        self.polls = -1  # that report something; -1: all
        self.with_signal = False

    def linegate_follow_events(self, _client, _start, call_back, _user):
        self.call_back = call_back
        return 5

    def linegate_subscribe(self, _client, _line, _names, _count, call_back, _user):
        self.on_values = call_back
        return 6

    def linegate_subscribe_lines(self, _client, call_back, _user):
        self.on_line = call_back
        return 7

    def linegate_line(self, _client, _name):
        self.lines += 1
        return 100 + self.lines

    def linegate_set_attempts(self, _client, line, attempts):
        self.attempts[line] = attempts
        meanwhile, self.meanwhile = self.meanwhile, None
        if meanwhile:
            meanwhile()
        return 0

    def linegate_sdo_read(self, _client, line, node, *_arguments):
        self.calls.append((node, self.attempts.get(line, 1)))
        return len(self.calls)

    def linegate_free(self, _client, number):
        self.freed.append(number)
        return 0

    def linegate_wake(self, _client):
        self.woken.set()
        return 0

    def linegate_line_wait(self, client, _line, _timeout):
        return self.linegate_poll(client, 0)

    def linegate_event_position(self, _client, _number, buffer, _size):
        text = f"9:{self.number}:gw/press".encode()
        if buffer is not None:
            buffer.value = text
        return len(text)

    def linegate_poll(self, _client, timeout):
        if timeout > 10_000:
            while not self.woken.wait(0.3):  # again, because Python does not notice one directly before it begins to wait
                signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)
            self.woken.clear()
            return 0
        time.sleep(0.001)  # as long as an event loop needs for a turn
        if self.polls == 0 or (self.polls > 0 and not (self.on_values and self.on_line)):
            return 0
        self.polls -= 1
        self.number += 1
        if self.on_values:
            self.on_values(None, (c.Value * 1)(), 1, c.Image(sequence=self.number, lost=2))
        if self.on_line:
            self.on_line(None, b"gw", str(self.number).encode(), 1, 0, 0)
        if self.call_back is None:
            return 0
        event = c.Event(gateway=b"gw", line=b"press", number=self.number, stream=9)
        self.report(self.call_back, event, int(self.with_signal))
        return 0


def a_signal_loses_no_event(library):
    seen = []
    with linegate.Client() as client:
        reader = client.follow_events(lambda event: seen.append(event.number))
        client.poll()
        expect("an event", (seen, reader.position), ([1], "9:1:gw/press"))
        library.with_signal = True
        raised(KeyboardInterrupt, client.poll)
        library.with_signal = False
        expect("the position", reader.position, f"9:{seen[-1]}:gw/press")
        client.poll()
        expect("events", (seen, reader.position), ([1, 2, 3], "9:3:gw/press"))


def what_a_conversion_raises_is_raised_by_poll(_library):
    """As if the memory had ended."""
    seen, convert, failures = [], linegate._event, [MemoryError()]  # pylint: disable=protected-access

    def failing(of):
        if failures:
            raise failures.pop()
        return convert(of)
    with linegate.Client() as client:
        reader = client.follow_events(seen.append)
        linegate._event = failing  # pylint: disable=protected-access
        try:
            raised(MemoryError, client.poll)
        finally:
            linegate._event = convert  # pylint: disable=protected-access
        expect("passed on at the second attempt", [event.number for event in seen], [1])
        client.poll()
        expect("numbers", [event.number for event in seen], [1, 2])
        expect("the position", reader.position, "9:2:gw/press")


def a_conversion_that_always_fails_holds_nothing_back(library):
    seen = []

    def failing(_of):
        raise MemoryError
    convert, linegate._event = linegate._event, failing  # pylint: disable=protected-access
    try:
        with linegate.Client() as client:
            client.follow_events(seen.append)
            client.on_line(lambda change: seen.append(change.line))
            press = client.line("press")
            for _ in range(3):
                press.sdo_read(1, 0x1018)
                raised(MemoryError, client.poll)
            expect("changes of lines", seen, ["1", "2", "3"])
            expect("calls that are freed", len(library.freed), 3)
            expect("a line", press.wait(1), True)
    finally:
        linegate._event = convert  # pylint: disable=protected-access


class AtInstruction:
    """Calls a function once within the main thread, where Python may run signal handlers: after the first instruction of a
    function, after a call, and in loops."""

    def __init__(self, number, function):
        self.left, self.function, self.may_run = number, function, False

    def trace(self, frame, what, _argument):
        frame.f_trace_opcodes = True
        if what == "opcode":
            self.left -= self.may_run
            if self.may_run and self.left == -1:
                self.function()
            self.may_run = dis.opname[frame.f_code.co_code[frame.f_lasti]].startswith(("RESUME", "CALL", "JUMP_BACKWARD"))
        return self.trace

    def __enter__(self):
        sys.settrace(self.trace)
        return self

    def __exit__(self, *_error):
        sys.settrace(None)


def a_signal_handler_may_poll_at_any_instruction(_library):
    seen, place = [], 0
    with linegate.Client() as client:
        client.follow_events(lambda event: seen.append(event.number))
        while True:
            before = len(seen)
            with AtInstruction(place, client.poll) as handler:
                client.poll()
            if handler.left >= 0:
                break
            place += 1
            expect(f"events, with a signal at instruction {place}", len(seen) - before, 2)
    expect("instructions", place > 10, True)


def a_signal_handler_may_close_at_any_instruction(_library):
    place = 0
    while True:
        client = linegate.Client()
        client.poll()
        with AtInstruction(place, client.close) as handler:
            client.poll()
        client.close()
        if handler.left >= 0:
            break
        place += 1


def interrupted():
    raise KeyboardInterrupt


def an_interrupted_poll_leaves_nothing(_library):
    threads, place = _thread._count(), 0  # pylint: disable=protected-access
    while True:
        with linegate.Client() as client:
            client.follow_events(lambda event: None)
            with AtInstruction(place, interrupted) as handler:
                try:
                    client.poll()
                except KeyboardInterrupt:
                    pass
            client.poll()
        while _thread._count() > threads:  # pylint: disable=protected-access
            time.sleep(0.001)
        if handler.left >= 0:
            break
        place += 1


def a_signal_handler_ends_the_poll_it_interrupts(library):
    """Also a poll of an hour."""
    done = []
    with linegate.Client() as client:
        def handle(*_arguments):
            client.poll()
            done.append(1)
        before = signal.signal(signal.SIGINT, handle)
        try:
            client.poll(3600)
        finally:
            signal.signal(signal.SIGINT, before)
        expect("polls of the handler", bool(done), True)
        library.woken.clear()
        raised(KeyboardInterrupt, lambda: client.poll(3600))
        client.poll()  # after that one


def a_call_back_that_is_interrupted_is_called_again(_library):
    seen = []

    def interrupted(event):
        seen.append(event.number)
        if len(seen) == 1:
            signal.raise_signal(signal.SIGINT)
    with linegate.Client() as client:
        reader = client.follow_events(interrupted)
        raised(KeyboardInterrupt, client.poll)
        expect("the position", reader.position, "9:0:gw/press")
        client.poll()
        expect("numbers", seen, [1, 1, 2])

        def wrong(event):
            raise IndexError(event.number)
        reader.cancel()
        client.follow_events(wrong)
        raised(IndexError, client.poll)


async def is_late(client, library):
    """Until the library has reported four times."""
    while library.polls != 0:
        await asyncio.sleep(0.001)
    await client._turn()  # pylint: disable=protected-access


def late_consumers_are_informed(library):
    library.polls = 1

    async def use():
        async with linegate.Client() as client:
            values, changes = client.line("press").changes("ram.In"), client.lines()
            await asyncio.gather(anext(values), anext(changes))
            library.polls = 4
            await is_late(client, library)
            expect("values", [(one.sequence, one.lost) for one in [await anext(values), await anext(values)]],
                   [(4, 8), (5, 2)])
            expect("changes", [(await anext(changes)).line for _ in range(2)], ["2", "3"])
            return (await asyncio.gather(anext(changes), return_exceptions=True))[0]
    most, linegate._MOST_WAITING = linegate._MOST_WAITING, 2  # pylint: disable=protected-access
    try:
        error = asyncio.run(asyncio.wait_for(use(), 30))
    finally:
        linegate._MOST_WAITING = most  # pylint: disable=protected-access
    expect("the error", (type(error), getattr(error, "code", 0)), (linegate.Error, -7))


def calls_of_several_threads_have_their_own_attempts(library):
    with linegate.Client() as client:
        press = client.line("press")
        press.sdo_read(1, 0x1018, attempts=0)

        def others():
            """Of another thread, and of a signal handler."""
            other.start()
            other.join(0.2)  # it may have to wait
            press.sdo_read(6, 0x1018, attempts=5)
            press.sdo_read(5, 0x1018)
        other = threading.Thread(target=press.sdo_read, args=(2, 0x1018))
        library.meanwhile = others
        press.sdo_read(3, 0x1018, attempts=5)
        other.join()
        press.sdo_read(4, 0x1018, attempts=2)
        press.sdo_read(7, 0x1018, attempts=5)
        expect("attempts by node", sorted(library.calls), [(1, 1), (2, 1), (3, 5), (4, 2), (5, 1), (6, 5), (7, 5)])
        expect("lines of the library", library.lines - len([one for one in library.freed if one > 100]), 3)


def functions_at_the_end_of_python_may_poll(_library):
    """As those of atexit."""
    program = (f"import atexit, sys; sys.argv = ['', {sys.argv[1]!r}, 'at the end']; sys.path.insert(0, {os.path.dirname(__file__)!r})\n"
               "import client_module\n"
               "atexit.register(client_module.main, *sys.argv[1:])")
    done = subprocess.run([sys.executable, "-B", "-c", program], capture_output=True, text=True, check=False)
    expect("a program that polls at its end", (done.returncode, done.stderr), (0, ""))


def polls_pass_events_on(_library):
    seen = []
    with linegate.Client() as client:
        client.follow_events(lambda event: seen.append(event.number))
        client.poll()
        expect("events", seen, [1])


TESTS = (functions_at_the_end_of_python_may_poll, a_signal_loses_no_event, what_a_conversion_raises_is_raised_by_poll,
         a_conversion_that_always_fails_holds_nothing_back, a_signal_handler_may_poll_at_any_instruction,
         a_signal_handler_may_close_at_any_instruction, an_interrupted_poll_leaves_nothing,
         a_signal_handler_ends_the_poll_it_interrupts, a_call_back_that_is_interrupted_is_called_again,
         late_consumers_are_informed, calls_of_several_threads_have_their_own_attempts)


def main(compiler, *at_the_end):
    faulthandler.dump_traceback_later(50, exit=True)  # where it hangs
    with tempfile.TemporaryDirectory() as folder:
        library_file = os.path.join(folder, "helper.so")
        subprocess.run([compiler, "-x", "c", "-shared", "-fPIC", "-o", library_file, "-"], input=SOURCE, text=True, check=True)
        helper = ctypes.CDLL(library_file)
    for test in (polls_pass_events_on,) if at_the_end else TESTS:
        linegate._lib = Library(helper)  # pylint: disable=protected-access
        test(linegate._lib)  # pylint: disable=protected-access
    faulthandler.cancel_dump_traceback_later()


if __name__ == "__main__":
    main(*sys.argv[1:])
