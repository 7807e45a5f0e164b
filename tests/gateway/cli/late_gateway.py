#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A gateway whose network is not there when it starts: a cable without carrier, or no address yet; or not when its processes
with DDS die and start again. Once it is there, another host finds the gateway, and it reaches the gateway of that host; the
numbers of its events continue. Each gateway runs on a host of its own (network namespaces).

late_gateway.py LINEGATED LINEGATE PROCESS   PROCESS: of its DDS, same or own; same: it warns that it must be started again
"""

import json
import os
import signal
import subprocess

from doctor import DOMAIN, Setup
from peer_kill import child
from plant_process import EDS, PATIENCE, Failure, end, expect, run_test, until

DEVICE = f"""simulate: [{{node: 8, profile: digital-io}}], nodes: [{{id: 8, name: io, eds: {EDS}/digital-io.eds}}]"""
HALL = f"""schema: 1
gateway: {{name: hall}}
dds: {{process: PROCESS}}
routes: [{{to: 7, via: desk/store}}]
lines: [{{name: press, interface: "simulated:", network_id: 1, access: all, {DEVICE}}}]
"""
STORE = f"""schema: 1
gateway: {{name: desk}}
lines: [{{name: store, interface: "simulated:", network_id: 7, access: all, {DEVICE}}}]
"""
VENDOR = "19527"
PROCESSES = ("linegated-dds", "linegated-peers")
ABSENCES = {
    "carrier": ([("link", "set", "eth0", "down")], [("link", "set", "eth0", "up")], "desk"),
    "address": ([("address", "flush", "dev", "eth0")], [("address", "add", "10.77.0.1/24", "dev", "eth0")], "hall"),
}


class Hosts(Setup):
    def __init__(self, folder, linegated, linegate, process):
        super().__init__(folder, linegated, linegate)
        self.hall, self.desk = self.connected()
        self.by_name = {"hall": self.hall, "desk": self.desk}
        self.file("hall.yaml", HALL.replace("PROCESS", process))
        self.file("desk.yaml", STORE)

    def log(self, name):
        try:
            with open(os.path.join(self.folder, f"{name}.log"), encoding="utf-8") as file:
                return file.read()
        except FileNotFoundError:
            return ""

    def start(self, name):
        """Starts a gateway, and returns it when its participants exist."""
        with open(os.path.join(self.folder, f"{name}.log"), "w", encoding="utf-8") as log:
            program = self.by_name[name].start(self.linegated, os.path.join(self.folder, f"{name}.yaml"), "--dds-domain", DOMAIN,
                                               "--dds-profile", self.profiles, stdout=log, stderr=subprocess.STDOUT)
        until(f"{name} is ready", lambda: "info ready" in self.log(name))
        return program

    def reads(self, host, target):
        """Reads an object from that host; the device answers."""
        told = self.ask(host, "--timeout", "10", "sdo", "read", target, "1018:01", "u32", wait=PATIENCE)
        expect(f"{target} is read: {told.stderr}", told.stdout.strip(), VENDOR)


def comes_late(hosts, what, process):
    absent, present, at = ABSENCES[what]
    for words in absent:
        hosts.by_name[at].run("ip", *words)
    gateway = hosts.start("hall")
    hosts.reads(hosts.hall, "hall/press:8")
    for words in present:
        hosts.by_name[at].run("ip", *words)
    if process == "same":
        until("it warns", lambda: "does not use before linegated is started again" in hosts.log("hall"))
    else:
        hosts.reads(hosts.desk, "hall/press:8")
        until_read(hosts, "hall/7:8")
        for name in ("DDS process", "DDS routes process"):
            expect(f"the log names the cause for the {name}", f"info the {name} " in hosts.log("hall") and
                   "is replaced: network interface eth0 has the address" in hosts.log("hall"), True)
        if " error " in hosts.log("hall"):
            raise Failure(f"errors of the gateway: {hosts.log('hall')}")
    end(gateway)


def dies_in_a_cut(hosts):
    """Its processes die while the cable is cut: the next ones start without the interface."""
    gateway = hosts.start("hall")
    hosts.reads(hosts.desk, "hall/press:8")
    until_read(hosts, "hall/7:8")
    hosts.desk.run("ip", "link", "set", "eth0", "down")
    for name in PROCESSES:
        before = child(gateway, name)
        os.kill(before, signal.SIGKILL)
        until(f"another {name} runs", lambda: child(gateway, name) not in (before, None))
    until("it receives commands", lambda: hosts.ask(hosts.hall, "sdo", "read", "hall/press:8", "1018:01", "u32",
                                                    wait=PATIENCE).stdout.strip() == VENDOR)
    hosts.desk.run("ip", "link", "set", "eth0", "up")
    hosts.reads(hosts.desk, "hall/press:8")
    until_read(hosts, "hall/7:8")
    events = hosts.ask(hosts.desk, "--json", "events", "hall/press", "--once", wait=PATIENCE).stdout
    numbers = [event["number"] for event in map(json.loads, events.splitlines())]
    expect("the numbers of its events", numbers, list(range(1, len(numbers) + 1)))
    end(gateway)


def until_read(hosts, target):
    """Waits until a device is read over another gateway."""
    until(f"{target} is read", lambda: hosts.ask(hosts.hall, "--timeout", "10", "sdo", "read", target, "1018:01", "u32",
                                                 wait=PATIENCE).stdout.strip() == VENDOR)


def test(folder, linegated, linegate, process):
    hosts = Hosts(folder, linegated, linegate, process)
    try:
        hosts.start("desk")
        for what in ABSENCES:
            comes_late(hosts, what, process)
        if process == "own":
            dies_in_a_cut(hosts)
    finally:
        hosts.close()


if __name__ == "__main__":
    run_test(test, own_network=True)
