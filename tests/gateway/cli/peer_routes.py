#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Networks that are reached over another gateway (`routes:` with via: GATEWAY/LINE), each gateway on a host of its own. SDOs
are read and written; the rules of the other gateway hold; kill -9, SIGTERM, a cut network and a second gateway of the same
name during a write never make it a refusal, nor carry it out later or twice; a loop of routes ends.

peer_routes.py LINEGATED LINEGATE CLIENT PROCESS   CLIENT: the library liblinegate-client.so; PROCESS: of the DDS of
                                                   hall-a, same or own
"""

import json
import os
import signal
import subprocess
import sys
import time

from doctor import DOMAIN, Setup
from plant_process import EDS, PATIENCE, SOURCES, Failure, expect, run_test, until, write

IO = f"{{id: 5, name: io, eds: {EDS}/digital-io.eds}}"
# Node 99 does not exist: a write to it is under way until its time-out.
PLANT_B = f"""schema: 1
gateway: {{name: hall-b}}
routes: [{{to: 20, via: hall-a/hall}}]
lines:
  - {{name: press, interface: "simulated:", network_id: 7, access: all, sdo_timeout: 10s,
     simulate: [{{node: 5, profile: digital-io}}], nodes: [{IO}]}}
  - {{name: quick, interface: "simulated:", network_id: 9, access: all,
     simulate: [{{node: 5, profile: digital-io}}], nodes: [{IO}]}}
  - {{name: pack, interface: "simulated:", network_id: 8, access: all}}
  - {{name: store, interface: "simulated:", network_id: 6, access: all, enter: [{{from: pack}}],
     simulate: [{{node: 5, profile: digital-io}}], nodes: [{IO}]}}
  - {{name: shut, interface: "simulated:", network_id: 5, access: read,
     simulate: [{{node: 5, profile: digital-io}}], nodes: [{IO}]}}
  - {{name: closed, interface: "simulated:", network_id: 4, access: all,
     simulate: [{{node: 5, profile: digital-io}}], nodes: [{IO}]}}
"""
PLANT_A = """schema: 1
gateway: {name: hall-a}
dds: {process: PROCESS}
routes:
  - {to: 7, via: hall-b/press}
  - {to: 9, via: hall-b/quick, timeout: 1s}
  - {to: 6, via: hall-b/store, enter: pack}
  - {to: 5, via: hall-b/shut}
  - {to: 4, via: hall-b/closed, enter: pack}
  - {to: 20, via: hall-b/press}
  - {to: 30, via: hall-c/press}
lines:
  - {name: hall, interface: "simulated:", network_id: 1, access: all}
"""
# One client writes eight values to network 9, each without waiting for the one before. It reports each value that was sent, and
# then the outcome of each.
WRITES = """
import sys, time, linegate
with linegate.Client(domain=int(sys.argv[1]), profile=sys.argv[2]) as client:
    line = client.line("hall-a/hall")
    assert line.wait(60)
    commands, calls = linegate.commands.Commands(line), {}
    for value in range(100, 108):
        calls[value] = commands.write_network(9, 5, 0x6200, 1, bytes([value]), timeout=10)
        client.poll(0.05)
        print("sent", value, flush=True)
    for value, call in calls.items():
        try:
            call.result()
            print(value, "done", flush=True)
        except linegate.Error as error:
            print(value, error, flush=True)
"""
CUT = 2.5  # seconds: longer than the time-out of the route to quick, shorter than the lease of a participant
VENDOR = "47 4C 00 00"
# What the console prints for abort codes.
TIMEOUT, READ_ONLY, NO_OBJECT = "SDO protocol timed out", "attempt to write a read-only object", "object does not exist"
NOT_PERMITTED, NO_ROUTE = "local control", "invalid value for parameter"
NO_LINE = "hall-a has no line '7' and no route to network 7; its lines: hall; networks it reaches: "


class Halls(Setup):
    def __init__(self, folder, linegated, linegate, library, process):
        super().__init__(folder, linegated, linegate)
        self.client_so = library
        self.b, self.a = self.connected()
        self.plant_a = PLANT_A.replace("PROCESS", process)

    def start(self, host, name, text):
        plant = write(os.path.join(self.folder, f"{name}.yaml"), text)
        return host.start(self.linegated, plant, "--dds-domain", DOMAIN, "--dds-profile", self.profiles)

    def start_b(self, host=None):
        return self.start(host or self.b, "b", PLANT_B)

    def sdo(self, *words, host=None):
        """What `linegate sdo` prints, and its errors."""
        told = self.ask(host or self.a, "--timeout", "10", "sdo", *words, wait=PATIENCE)
        return (told.stdout + told.stderr).strip()

    def reads(self, network):
        """Waits until the device in that network is read."""
        told = []

        def is_read():
            told.append(self.sdo("read", f"hall-a/{network}:5", "1018:01"))
            return VENDOR in told[-1]
        try:
            until(f"network {network} is read", is_read)
        except Failure as failure:
            raise Failure(f"{failure}: {told[-1]}") from failure

    def write(self, network, value, node=5):
        return self.sdo("write", f"hall-a/{network}:{node}", "6200:01", "u8", str(value))

    def value(self, line="press"):
        """Of the device in hall-b, without hall-a."""
        return self.sdo("read", f"hall-b/{line}:5", "6200:01", "u8", host=self.b)

    def events(self, line, kind):
        host = self.a if line.startswith("hall-a") else self.b
        told = self.ask(host, "--json", "events", line, "--once", wait=PATIENCE)
        return [one["text"] for one in map(json.loads, told.stdout.splitlines()) if one["kind"] == kind]

    def unanswered(self):
        return len(self.events("hall-a/hall", "routing-unanswered"))

    def start_write(self, target, value):
        return self.a.start(self.linegate, "--domain", DOMAIN, "--profile", self.profiles, "--wait", str(PATIENCE), "--timeout",
                            "10", "sdo", "write", f"hall-a/{target}", "6200:01", "u8", str(value), stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True)


def said(console):
    return "".join(console.communicate(timeout=2 * PATIENCE)).strip()


class Writing:
    """A write that is under way in hall-b for the duration of a block, and what it becomes."""

    def __init__(self, halls):
        self.halls = halls

    def __enter__(self):
        self.console = self.halls.start_write("7:99", 1)
        time.sleep(1.5)

    def __exit__(self, kind, *_):
        if kind is None:
            expect("the write ends with", TIMEOUT in (told := said(self.console)) or told, True)


def reads_and_writes(halls):
    halls.reads(7)
    halls.reads(6)
    halls.reads(5)
    for value in (17, 18):
        said = halls.write(7, value)
        told = halls.value()
        expect(f"the value after the write ({said})", told, str(value))
    accepted = halls.events("hall-b/press", "command-accepted")
    expect(f"each write once, {accepted}", len(accepted), 2)
    expect("its client", all("hall-a routes" in text for text in accepted), True)
    told = halls.ask(halls.a, "--json", "routes", wait=PATIENCE).stdout
    routes = {one["first"]: one["line"] for one in json.loads(told)["routes"] if one["gateway"] == "hall-a"}
    expect("the route that linegate shows", routes[7], "hall-b/press")


def rules_hold(halls):
    for network, code in ((6, READ_ONLY), (5, NOT_PERMITTED), (4, NOT_PERMITTED)):
        told = halls.write(network, 1)
        expect(f"write to network {network}: {told}", code in told, True)
    told = halls.sdo("read", "hall-a/4:5", "1018:01")
    expect(f"network 4 is closed: {told}", NOT_PERMITTED in told, True)
    told = halls.sdo("read", "hall-a/30:5", "1018:01")
    expect(f"hall-c does not exist: {told}", TIMEOUT in told, True)
    told = halls.sdo("read", "hall-a/7:5", "5FFF:01")
    expect(f"the abort of the device: {told}", NO_OBJECT in told, True)
    expect("no write is uncertain", halls.unanswered(), 0)


def loops_end(halls):
    told = halls.sdo("read", "hall-a/20:5", "1018:01")
    expect(f"a loop is cut: {told}", NO_ROUTE in told, True)


def is_killed(halls, b):
    with Writing(halls):
        b.kill()
    expect("uncertain writes", halls.unanswered(), 1)
    b = halls.start_b()
    halls.reads(7)
    with Writing(halls):
        b.send_signal(signal.SIGTERM)
        expect("hall-b ends", b.wait(timeout=PATIENCE), 0)
    expect("uncertain writes", halls.unanswered(), 2)
    halls.start_b()
    halls.reads(7)


def is_cut(halls):
    """Writes that are on their way when the network is cut are carried out in time, or not at all."""
    python = os.path.join(SOURCES, "bridges", "client", "python")
    client = halls.a.start(sys.executable, "-B", "-c", WRITES, DOMAIN, halls.profiles, stdout=subprocess.PIPE, text=True,
                           env={**os.environ, "PYTHONPATH": python, "LINEGATE_CLIENT_LIBRARY": halls.client_so})
    while (told := client.stdout.readline()) != "sent 103\n":
        expect(f"the client sends, and says {told}", told.startswith("sent "), True)
    halls.b.run("ip", "link", "set", "eth0", "down")
    begin = time.monotonic()
    before = halls.value("quick")
    time.sleep(max(0, begin + CUT - time.monotonic()))
    halls.b.run("ip", "link", "set", "eth0", "up")
    ends = dict(line.split(" ", 1) for line in client.communicate(timeout=PATIENCE)[0].splitlines() if not line.startswith("sent"))
    done = {value for value, told in ends.items() if told == "done"}
    expect(f"the ends: {ends}", len(ends) == 8 and all(told == "done" or TIMEOUT in told for told in ends.values()), True)
    halls.reads(9)
    time.sleep(1)
    expect(f"the value is {before} as at the cut, or one of those that were written, {done}",
           (value := halls.value("quick")) in {before, *done} or value, True)
    halls.write(9, 23)
    expect("the next one is", halls.value("quick"), "23")


def is_reloaded(halls, a):
    """Routes change while the line runs: to another way, to none over a gateway, and back."""
    def reload(text):
        write(os.path.join(halls.folder, "a.yaml"), text)
        a.send_signal(signal.SIGHUP)
    before = halls.unanswered()
    reload(halls.plant_a.replace("hall-b/press}", "hall-b/press, enter: pack}", 1))
    until("press is closed to devices of pack", lambda: NOT_PERMITTED in halls.sdo("read", "hall-a/7:5", "1018:01"))
    text = halls.plant_a
    routes = text.index("routes:"), text.index("lines:")
    reload(f"{text[:routes[0]]}routes: [{{to: 70, via: hall:9}}]\n{text[routes[1]:]}")
    until("no route leads to network 7", lambda: NO_LINE in halls.sdo("read", "hall-a/7:5", "1018:01"))
    reload(text)
    halls.reads(7)
    expect("no write became uncertain", halls.unanswered(), before)


def is_doubled(halls):
    """A second gateway with the name of the first one."""
    other = halls.start_b(halls.a)
    until("none of the two is asked", lambda: TIMEOUT in halls.sdo("read", "hall-a/7:5", "1018:01"))
    other.kill()
    halls.reads(7)


def ends(halls, a):
    """hall-a ends during a write."""
    with Writing(halls):
        a.send_signal(signal.SIGTERM)
        expect("hall-a ends", a.wait(timeout=PATIENCE), 0)


def test(folder, linegated, linegate, library, process):
    halls = Halls(folder, linegated, linegate, library, process)
    try:
        a = halls.start(halls.a, "a", halls.plant_a)
        b = halls.start_b()
        reads_and_writes(halls)
        rules_hold(halls)
        loops_end(halls)
        is_killed(halls, b)
        is_cut(halls)
        is_reloaded(halls, a)
        is_doubled(halls)
        ends(halls, a)
    finally:
        halls.close()


if __name__ == "__main__":
    run_test(test, own_network=True)
