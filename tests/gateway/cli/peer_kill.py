#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A gateway with DDS in processes of its own writes to a network of another gateway, and these processes are killed at
random moments. The recording of the other gateway's bus shows how often each write was carried out: once at most, once if
it was answered, never if it was refused; and each that was carried out without an answer is an event.

peer_kill.py LINEGATED LINEGATE PROFILES [SEED]
"""

import json
import os
import random
import re
import signal
import subprocess
import time

from plant_process import EDS, PATIENCE, Failure, Plant, expect, own_domain, run_test, until, write

ROUNDS = 12
NODES = (5, 99)  # node 99 does not exist: a write to it is under way until its time-out
PLANT_B = f"""schema: 1
gateway: {{name: hall-b}}
lines:
  - {{name: press, interface: "simulated:", network_id: 7, access: all, sdo_timeout: 10s, record: RECORD,
     simulate: [{{node: 5, profile: digital-io}}], nodes: [{{id: 5, name: io, eds: {EDS}/digital-io.eds}}]}}
"""
PLANT_A = """schema: 1
gateway: {name: hall-a}
dds: {process: own}
journal: {file: JOURNAL}
routes: [{to: 7, via: hall-b/press}]
lines:
  - {name: hall, interface: "simulated:", network_id: 1, access: all}
"""
PROCESSES = ("linegated-peers",) * 5 + ("linegated-dds",)  # one that dies soon is started after a pause
VENDOR = "47 4C 00 00"
TIMEOUT, NO_ROOM, REFUSED = "SDO protocol timed out", "out of memory", ("local control", "device state", "general")
LOST = "no answer", "no gateway", "no line"  # while the process of the near gateway's own endpoints does not run


def child(gateway, name):
    """The process of that name that the gateway has started; None: it does not run."""
    for entry in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{entry}/stat", encoding="utf-8") as file:
                text = file.read()
        except OSError:
            continue
        state, parent = text[text.rindex(")") + 2:].split()[:2]
        if f"({name})" in text and int(parent) == gateway.pid and state != "Z":
            return int(entry)
    return None


class Halls(Plant):
    def __init__(self, linegated, linegate, profiles, record, chance):
        super().__init__(linegated, linegate, profiles, own_domain())
        self.record, self.chance = record, chance
        self.ends = {}  # what the console printed, by node and value

    def reads(self):
        until("network 7 is read", lambda: VENDOR in self.ask("sdo", "read", "hall-a/7:5", "1018:01").stdout)

    def start_write(self, node, value):
        return subprocess.Popen([*self.console, "--timeout", "12", "sdo", "write", f"hall-a/7:{node}", "6200:01", "u8",
                                 str(value)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def round(self, gateway, values):
        """Writes these values, and kills a process meanwhile."""
        consoles = {}
        for value in values:
            node = self.chance.choice(NODES)
            consoles[node, value] = self.start_write(node, value)
            time.sleep(self.chance.uniform(0, 0.3))
        name = self.chance.choice(PROCESSES)
        time.sleep(self.chance.uniform(0, 2.0))
        pid = child(gateway, name)
        if pid is not None:
            os.kill(pid, signal.SIGKILL)
        for key, console in consoles.items():
            self.ends[key] = console.communicate(timeout=4 * PATIENCE)[0].strip()
        self.reads()
        return name

    def carried_out(self):
        """How often hall-b has written each value, by node and value."""
        out = {}
        with open(self.record, encoding="ascii") as file:
            for node, value in re.findall(r" 6([0-9A-F]{2})#2F006201([0-9A-F]{2})", file.read()):
                key = int(node, 16), int(value, 16)
                out[key] = out.get(key, 0) + 1
        return out

    def unanswered(self):
        """The number of writes that are reported as uncertain."""
        texts = [one["text"] for one in self.stream("history", "hall-a/hall") if one.get("kind") == "routing-unanswered"]
        suppressed = (re.search(r"\((\d+) more suppressed\)", text) for text in texts)
        return len(texts) + sum(int(one[1]) for one in suppressed if one)


def its_ends_are_events(halls):
    """Those of both processes, of the gateway itself. More than one within a minute are joined."""
    for process in ("DDS process", "DDS routes process"):
        def is_there(words=f"the {process} was ended by signal 9 (Killed)"):
            told = map(json.loads, halls.ask("--json", "events", "--once").stdout.splitlines())
            return any(one.get("kind") == "dds-process-ended" and one["text"].startswith(words) for one in told)
        until(f"an event reports the end of the {process}", is_there)


def check(halls):
    done = halls.carried_out()
    print("ends:", {key: told[:60] for key, told in halls.ends.items()})
    expect("writes that were carried out more than once", {key: count for key, count in done.items() if count > 1}, {})
    expect("writes that nobody requested", set(done) - set(halls.ends), set())
    uncertain = 0
    for key, told in halls.ends.items():
        if not told:
            expect(f"{key} is answered, and was carried out", done.get(key, 0), 1)
        elif NO_ROOM in told or any(text in told for text in REFUSED):
            expect(f"{key} is refused ({told}), and was carried out", done.get(key, 0), 0)
        elif TIMEOUT in told:
            uncertain += done.get(key, 0)
        elif not any(text in told for text in LOST):
            raise Failure(f"{key}: {told}")
    answered = sum(not told for told in halls.ends.values())
    events = halls.unanswered()
    print(f"{len(halls.ends)} writes, {answered} answered, {uncertain} carried out without an answer, {events} events")
    expect("each write that was carried out without an answer is an event", events >= uncertain, True)
    expect("some writes were answered, and some were not", answered > 0 and uncertain > 0, True)


def test(folder, linegated, linegate, profiles, seed=None):
    seed = seed or str(random.randrange(1 << 32))
    print("seed", seed, flush=True)
    record = os.path.join(folder, "press.log")
    halls = Halls(linegated, linegate, profiles, record, random.Random(seed))
    plant_a = write(os.path.join(folder, "a.yaml"), PLANT_A.replace("JOURNAL", os.path.join(folder, "journal.db")))
    with halls.running(write(os.path.join(folder, "b.yaml"), PLANT_B.replace("RECORD", record))):
        with halls.running(plant_a) as gateway:
            until("both processes run", lambda: all(child(gateway, name) for name in PROCESSES))
            halls.reads()
            for name in set(PROCESSES):
                os.kill(child(gateway, name), signal.SIGKILL)
            its_ends_are_events(halls)
            halls.reads()
            for number in range(ROUNDS):
                name = halls.round(gateway, range(5 * number + 1, 5 * number + 6))
                print(f"round {number}: {name} was killed", flush=True)
            time.sleep(1)  # the recording is written
            check(halls)


if __name__ == "__main__":
    run_test(test)
