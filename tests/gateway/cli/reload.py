#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""SIGHUP: a running linegated applies the changes of its plant.yaml, and changes nothing else; a file with errors
changes nothing, and all errors are reported.

reload.py LINEGATED LINEGATE PROFILES
"""

import json
import os
import shutil
import signal
import subprocess
import threading
import time

import plant_process
from plant_process import Console, Failure, PATIENCE, end, run_test

LINE = """  - name: {name}
    interface: "simulated:"
    network_id: {network}
    heartbeat: {heartbeat}
    simulate: [{{node: 8, profile: digital-io}}]
"""
HEAD = """schema: 1
gateway: {{name: reload}}
dds: {{domain: {domain}, profile: {profiles}}}
lines:
"""
JOINED = """  - name: {name}
    interface: "simulated:"
    network_id: {network}
    nodes: [{{id: 8, name: io, eds: {eds}, heartbeat: 100ms}}]
    simulate: [{{node: 8, profile: digital-io}}]
"""
EDS = os.path.join(plant_process.EDS, "digital-io.eds")


class Gateway(Console):
    def __init__(self, linegated, linegate, profiles, folder):
        domain = plant_process.own_domain()
        super().__init__(linegate, profiles, domain)
        self.head = HEAD.format(domain=domain, profiles=profiles)
        self.plant = os.path.join(folder, "plant.yaml")
        self.write({"stays": 1, "changes": 2, "goes": 3})
        self.process = subprocess.Popen([linegated, self.plant], stderr=subprocess.PIPE, text=True)
        self.log = []
        self.news = threading.Condition()
        threading.Thread(target=self.read_log, daemon=True).start()

    def write(self, lines, heartbeat="100ms", extra=""):
        with open(self.plant, "w", encoding="utf-8") as file:
            file.write(self.head)
            for name, network in lines.items():
                file.write(LINE.format(name=name, network=network, heartbeat=heartbeat if name == "changes" else "1s"))
            file.write(extra)

    def read_log(self):
        for line in self.process.stderr:
            with self.news:
                self.log.append(line.rstrip("\n"))
                self.news.notify_all()

    def count(self, text):
        return sum(text in line for line in self.log)

    def await_log(self, text, times=1):
        with self.news:
            if not self.news.wait_for(lambda: self.count(text) >= times, PATIENCE):
                raise Failure(f"not in the log {times} times: {text}\n" + "\n".join(self.log))

    def reload(self, answer, times=1):
        self.process.send_signal(signal.SIGHUP)
        self.await_log(answer, times)

    def await_input(self, line, address):
        """Waits until that input is not 0."""
        last = time.monotonic() + PATIENCE
        while time.monotonic() < last:
            told = self.ask("--json", "image", line)
            if told.returncode == 0 and self.value(told.stdout.splitlines()[0], *address):
                return
        raise Failure(f"nothing is forwarded to {line}\n" + "\n".join(self.log))

    @staticmethod
    def value(image, index, sub):
        """Returns a value of an image in the console's JSON, where inputs come first; 0 if the image lacks it."""
        entries = json.loads(image)["entries"]
        return next((entry["value"] for entry in entries if (entry["index"], entry["sub"]) == (index, sub)), 0)

    def await_lines(self, names):
        """Waits until these are the only lines, and returns them by name, as received by a new subscriber."""
        last = time.monotonic() + PATIENCE
        while set(lines := {line["line"]: line for line in self.lines()}) != names:
            if time.monotonic() > last:
                raise Failure(f"lines {set(lines)} instead of {names}")
        return lines


def await_reload_event(gateway, kind, text):
    """Waits for the gateway's event of a reload: it names the process that sent the signal, this one."""
    expected = text.format(f"by process {os.getpid()} of user {os.getuid()}")
    last = time.monotonic() + PATIENCE
    while time.monotonic() < last:
        events = map(json.loads, gateway.ask("--json", "events", "--once").stdout.splitlines())
        texts = [event["text"] for event in events if (event["line"], event["kind"]) == ("", kind)]
        if any(expected in text for text in texts):
            return
    raise Failure(f"no event {kind} with {expected!r}: {texts}")


def run(gateway):
    for name in ("stays", "changes", "goes"):
        gateway.await_log(f"{name}: node 8: boot-up")
    before = gateway.await_lines({"stays", "changes", "goes"})

    gateway.write({"stays": 1, "changes": 2, "comes": 4}, heartbeat="200ms")
    gateway.reload("reloaded: lines changed: changes; started: comes; stopped: goes; unchanged: 1")
    await_reload_event(gateway, "gateway-reloaded", "reloaded ({}): lines changed: changes; started: comes")
    gateway.await_log("changes: started as manager", 2)
    gateway.await_log("comes: node 8: boot-up")
    gateway.await_log("goes: stopped")
    after = gateway.await_lines({"stays", "changes", "comes"})
    for name in ("stays", "changes"):
        if after[name]["counters"]["frames_received"] < before[name]["counters"]["frames_received"]:
            raise Failure(f"the counters of {name} went back")
    if gateway.count("stays: started") != 1 or gateway.count("stays: stopped") != 0:
        raise Failure("a line that stays the same was disturbed")

    gateway.write({"stays": 1}, extra="  - {name: bad, interfce: x}\n  - {name: worse, interface: 'nonsense:'}\n")
    gateway.reload("not reloaded: everything runs as before")
    for part in ("interfce", "nonsense"):
        gateway.await_log(part)
    await_reload_event(gateway, "gateway-reload-refused", "not reloaded ({}), everything runs as before")
    os.remove(gateway.plant)
    os.mkdir(gateway.plant)  # can be opened but not read, as on a failing disk
    gateway.reload("not reloaded: everything runs as before", 2)
    told = gateway.ask("check", gateway.plant)
    if told.returncode < 0 or "error" not in told.stderr:
        raise Failure(f"linegate check of a folder: {told}")
    os.rmdir(gateway.plant)
    gateway.write({"stays": 1, "changes": 2, "comes": 4}, heartbeat="200ms", extra="executors: [{name: unused}]\n")
    gateway.reload("reloaded: lines changed: none; started: none; stopped: none; unchanged: 3")
    forwarding(gateway)
    entered(gateway)
    end(gateway.process)


def joined(rules):
    lines = "".join(JOINED.format(name=name, network=network, eds=EDS) for name, network in (("from", 5), ("to", 6)))
    return f"{lines}forward:\n{rules}  - from.io.6000:1 -> to.io.6200:2\n" if rules else lines


def forwarding(gateway):
    """Lines that are connected by rules are replaced together. The running light is never 0; byte 2 of the inputs
    mirrors it."""
    others = {"stays": 1, "changes": 2, "comes": 4}
    gateway.write(others, heartbeat="200ms", extra=joined(""))
    gateway.reload("reloaded: lines changed: none; started: from, to; stopped: none; unchanged: 3")
    gateway.write(others, heartbeat="200ms", extra=joined("  - from.io.6000:4 -> to.io.6200:1\n"))
    gateway.reload("reloaded: lines changed: from, to; started: none; stopped: none; unchanged: 3")
    gateway.await_input("to", (0x6000, 2))
    rule = "  - {from: 'from.io.6000:4', to: 'to.io.6200:1', when_lost: zero}\n"
    gateway.write(others, heartbeat="200ms", extra=joined(rule))
    gateway.reload("reloaded: lines changed: from, to; started: none; stopped: none; unchanged: 3", 2)
    gateway.await_input("to", (0x6000, 2))
    gateway.await_log("to: started as manager", 3)
    renamed = joined(rule).replace("name: io,", "name: motion,", 1).replace("from.io.", "from.motion.")
    gateway.write(others, heartbeat="200ms", extra=renamed)
    gateway.reload("reloaded: lines changed: from; started: none; stopped: none; unchanged: 4")
    gateway.await_input("to", (0x6000, 2))
    gateway.await_log("from: started as manager", 4)
    if gateway.count("to: started as manager") != 3:
        raise Failure("a line that follows one whose node was renamed was disturbed")
    gateway.write(others, heartbeat="200ms")
    gateway.reload("reloaded: lines changed: none; started: none; stopped: from, to; unchanged: 3")


def entered(gateway):
    """If one line may be entered, all lines route. Other lines are added and removed, which changes routes only."""
    others = {"stays": 1, "changes": 2, "comes": 4}
    hall = "  - {name: hall, interface: 'virtual:hall', network_id: 7, enter: all}\n"
    more = "  - {name: more, interface: 'virtual:more', network_id: 6}\n"
    gateway.write(others, heartbeat="200ms", extra=hall)
    gateway.reload("reloaded: lines changed: stays, changes, comes; started: hall; stopped: none; unchanged: 0")
    gateway.await_log("stays: started as manager", 2)
    before = gateway.plant + ".before"
    shutil.copy(gateway.plant, before)
    gateway.write(others, heartbeat="200ms", extra=more + hall)
    answer = "lines changed: none; started: more; stopped: none; unchanged: 4; other routes: stays, changes, comes, hall"
    told = gateway.ask("check", gateway.plant, "--against", before)
    if told.returncode != 0 or told.stdout.strip() != answer:
        raise Failure(f"linegate check --against: {told}")
    gateway.reload("reloaded: " + answer)
    gateway.write(others, heartbeat="200ms", extra=hall)
    gateway.await_log("more: started as manager")
    gateway.reload("reloaded: lines changed: none; started: none; stopped: more; unchanged: 4; other routes: stays,")
    if gateway.count("stays: started as manager") != 2:
        raise Failure("a line was disturbed by one that came and went")


def test(folder, linegated, linegate, profiles):
    gateway = Gateway(linegated, linegate, profiles, folder)
    try:
        run(gateway)
    finally:
        gateway.process.kill()


if __name__ == "__main__":
    run_test(test)
