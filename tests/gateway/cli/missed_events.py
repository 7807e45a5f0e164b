#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A subscriber is killed, misses 100,000 events, and is started again with the last event that it had: it has each event of
the line once and in order. So it has when the gateway is killed and started again, which continues the stream, and when
its journal is lost, which begins another one.

missed_events.py LINEGATED LINEGATE PROFILES EVENT_READER

LINEGATE_MISSED_EVENTS: another number of events.
"""

import contextlib
import os
import pathlib
import subprocess
import time

from history import History
from plant_process import Failure, Plant, expect, run_test, until, write

EVENTS = int(os.environ.get("LINEGATE_MISSED_EVENTS", "100000"))
FEW = 50
PER_SECOND = 8_000
PATIENCE = 120

PLANT = """schema: 1
gateway: {{name: plant}}
journal: {{file: {file}}}
lines:
  - name: press
    role: observer
    interface: "replay:{log}"
"""


def write_log(path, events):
    """A log of EMCYs of one node, each with other data: one event for each frame."""
    with open(path, "w", encoding="utf-8") as file:
        for number in range(events):
            file.write(f"({1000 + number / PER_SECOND:.6f}) can0 085#001001{number:010X}\n")


class Reader:
    """The subscriber, which prints into a file."""

    def __init__(self, program, profiles, path, position=()):
        self.path = path
        with open(path, "w", encoding="utf-8") as output:
            self.process = subprocess.Popen([program, "0", profiles, "plant", "press", *position], stdout=output)

    def lines(self):
        with open(self.path, encoding="utf-8") as file:
            return [line.split() for line in file if line.endswith("\n")]

    def events(self):
        """Stream and number of each event, in the order in which they were passed on."""
        return [(words[1], int(words[2])) for words in self.lines() if words[0] == "event"]

    def kill(self):
        self.process.kill()
        self.process.wait()
        return self.events()


def in_journal(history):
    return [(event["stream"], event["number"]) for event in history.events("press")]


def await_all(reader, history, what):
    """Waits until the reader has the newest event of the journal."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        stored = in_journal(history)
        if reader.events()[-1:] == stored[-1:]:
            return stored
        time.sleep(0.5)
    raise Failure(f"{what}: the reader ended with {reader.lines()[-3:]}, the journal with {stored[-1:]}")


def same(what, found, wanted):
    if found != wanted:
        at = next((i for i, (a, b) in enumerate(zip(found, wanted)) if a != b), min(len(found), len(wanted)))
        raise Failure(f"{what}: {len(found)} events, expected {len(wanted)}; from {at} on "
                      f"{found[at:at + 3]}, expected {wanted[at:at + 3]}")


def test(folder, *programs):
    with contextlib.ExitStack() as stack:
        run(folder, stack, *programs)


def run(folder, stack, linegated, linegate, profiles, event_reader):
    """stack ends the gateways if the test fails."""
    file, log = f"{folder}/journal.db", f"{folder}/emcys.log"
    history = History(linegate, file)
    plant = Plant(linegated, linegate, profiles, "0")
    path = write(f"{folder}/plant.yaml", PLANT.format(file=file, log=log))

    def start_gateway():
        gateway = plant.gateway(path)
        stack.callback(gateway.kill)
        return gateway

    def start_reader(name, position=()):
        return Reader(event_reader, profiles, f"{folder}/{name}", position)

    # It is away while the events are published, by the next run of the gateway.
    write_log(log, FEW)
    with plant.running(path):
        first = start_reader("first")
        until("the first events", lambda: len(history.events("--kind", "interface-failed")) == 1)
        await_all(first, history, "at the start")
        had = first.kill()
    write_log(log, EVENTS)
    begin = time.monotonic()
    gateway = start_gateway()
    while time.monotonic() < begin + PATIENCE and len(history.events("--kind", "interface-failed")) == 1:
        time.sleep(0.5)
    expect("the EMCYs in the journal", len(history.events("--kind", "emcy")), FEW + EVENTS)
    stream, number = had[-1]
    second = start_reader("second", (stream, str(number)))
    stored = await_all(second, history, "after the reader was away")
    same("the events of both readers", had + second.events(), stored[-len(had) - len(second.events()):])
    expect("missing events", [line for line in second.lines() if line[0] != "event"], [])
    if len(second.events()) < EVENTS:
        raise Failure(f"the reader missed only {len(second.events())} events")
    print(f"{len(second.events())} events after the reader was away, "
          f"{time.monotonic() - begin:.1f} s after the first of them")

    # The gateway is killed: the stream continues, and numbers are skipped.
    write_log(log, FEW)
    gateway.kill()
    gateway.wait()
    gateway = start_gateway()
    until("the events of the next run", lambda: len(history.events("--kind", "interface-failed")) == 3)
    stored = await_all(second, history, "after the gateway was killed")
    same("the events of both runs", had + second.events(), stored[-len(had) - len(second.events()):])
    expect("the streams", {of for of, _ in second.events()}, {stream})
    skipped = [line for line in second.lines() if line[0] == "missing"]
    expect("the numbers that are skipped", len(skipped), 1)

    # The journal is lost while the reader is away.
    had = second.kill()
    gateway.terminate()
    gateway.wait()
    for lost in pathlib.Path(folder).glob("journal.db*"):
        lost.unlink()
    gateway = start_gateway()
    until("the events of the new stream", lambda: len(history.events("--kind", "interface-failed")) == 1)
    third = start_reader("third", (had[-1][0], str(had[-1][1])))
    stored = await_all(third, history, "after the journal was lost")
    same("the events of the new stream", third.events(), stored)
    new = stored[0][0]
    expect("the new stream", third.lines()[0], ["stream", stream, new, "lost"])
    third.kill()
    gateway.terminate()
    expect("the end of the gateway", gateway.wait(), 0)


if __name__ == "__main__":
    run_test(test, own_network=True)
