#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Clients whose network is not there when they start: a cable without carrier, or no address yet. Once it is, commands of
`linegate` and a client of the library use it; a client that holds outputs when its host gets another address goes on. Gateway
and clients run on hosts of their own (network namespaces).

late_cable.py LINEGATED LINEGATE CLIENT   CLIENT: the library liblinegate-client.so
"""

import os
import subprocess
import sys

from doctor import DOMAIN, Setup
from plant_process import EDS, PATIENCE, SOURCES, expect, run_test, until

PLANT = f"""schema: 1
gateway: {{name: hall}}
lines:
  - {{name: press, interface: "simulated:", access: all, simulate: [{{node: 8, profile: digital-io}}],
     nodes: [{{id: 8, name: io, eds: {EDS}/digital-io.eds}}]}}
"""
FIRST_PORT = 7400 + 250 * int(DOMAIN) + 10  # of unicast, of the first participant of a host; the next has FIRST_PORT + 2
VENDOR = "19527"
BEGIN = """
import sys, time, linegate
IN, OUT = "io.Read input 8-bit.Inputs 1 to 8", "io.Write output 8-bit.Outputs "
client = linegate.Client(domain=int(sys.argv[1]), profile=sys.argv[2])
press = client.line("hall/press")
print("connected", flush=True)
def reach(what, condition):
    last = time.monotonic() + 60
    while not condition():
        client.poll(0.05)
        assert time.monotonic() < last, what
"""
READS = BEGIN + """
assert press.wait(60)
reach("a value", lambda: press.read(IN).good)
print(int.from_bytes(press.sdo_read(8, 0x1018, 1).result(), "little"), flush=True)
"""
# Holds until standard input has a line.
HOLDS = BEGIN + """
import select
assert press.wait(60)
reach("outputs", lambda: OUT + "1 to 8" in press.outputs())
group, states, lines = press.group("", watchdog=2.0), [], []
group.set(OUT + "1 to 8", 5)
group.set(OUT + "9 to 16", 6)
changes = group.on_state(lambda it: states.append(it.state.name))
status = client.on_line(lambda it: lines.append(it.status.name))
group.arm()
reach("held", lambda: group.state == linegate.GroupState.HELD)
print("held", flush=True)
while not select.select([sys.stdin], [], [], 0)[0]:
    client.poll(0.05)
print(set(states) - {"TAKING"}, lines, press.sdo_read(8, 0x6200, 1).result(), flush=True)
"""


class Hosts(Setup):
    def __init__(self, folder, linegated, linegate, library):
        super().__init__(folder, linegated, linegate)
        self.hall, self.desk = self.connected()
        self.environment = {**os.environ, "PYTHONPATH": os.path.join(SOURCES, "bridges", "client", "python"),
                            "LINEGATE_CLIENT_LIBRARY": library}

    def start(self):
        with open(self.file("log", ""), "a", encoding="utf-8") as log:
            return self.hall.start(self.linegated, self.file("hall.yaml", PLANT), "--dds-domain", DOMAIN, "--dds-profile",
                                   self.profiles, stderr=log)

    def command(self, *words):
        """Starts a command of `linegate` at the desk."""
        return self.desk.start(self.linegate, "--domain", DOMAIN, "--profile", self.profiles, "--wait", str(PATIENCE), *words,
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def client(self, host, program):
        return host.start(sys.executable, "-B", "-c", program, DOMAIN, self.profiles, stdin=subprocess.PIPE,
                          stdout=subprocess.PIPE, text=True, env=self.environment)

    def participants(self):
        """The numbers of the participants that the desk has, by their ports."""
        with open(f"/proc/{self.desk.keeper.pid}/net/udp", encoding="utf-8") as file:
            text = file.read()
        return [i for i in range(20) if f":{FIRST_PORT + 2 * i:04X} " in text]


def says(what, program, *wanted):
    out, errors = program.communicate(timeout=2 * PATIENCE)
    expect(f"{what}: {out}{errors or ''}", all(one in out for one in wanted), True)


def come_late(hosts, absent, present):
    """Clients that start while the network is absent."""
    for words in absent:
        hosts.desk.run("ip", *words)
    commands = {
        "sdo": (hosts.command("sdo", "read", "hall/press:8", "1018:01"), VENDOR),
        "lines": (hosts.command("lines"), "press"),
        "image": (hosts.command("image", "press"), "io."),
    }
    client = hosts.client(hosts.desk, READS)
    expect("the client", client.stdout.readline(), "connected\n")
    until("all have participants", lambda: len(hosts.participants()) == len(commands) + 1)
    for words in present:
        hosts.desk.run("ip", *words)
    for what, (command, wanted) in commands.items():
        says(what, command, wanted)
    says("the client", client, VENDOR)


def holds_on(hosts):
    """The host of a client that holds outputs gets another address."""
    client = hosts.client(hosts.desk, HOLDS)
    expect("the client", (client.stdout.readline(), client.stdout.readline()), ("connected\n", "held\n"))
    hosts.desk.run("ip", "address", "add", "10.78.0.2/24", "dev", "eth0")
    until("it has another participant, and that one alone", lambda: hosts.participants() == [1])
    out, _ = client.communicate("end\n", timeout=PATIENCE)
    expect("its states", out.strip(), r"{'HELD'} ['READY'] b'\x05'")


def test(folder, linegated, linegate, library):
    hosts = Hosts(folder, linegated, linegate, library)
    try:
        hosts.start()
        says("the gateway is found", hosts.command("sdo", "read", "hall/press:8", "1018:01"), VENDOR)
        come_late(hosts, [("link", "set", "eth0", "down")], [("link", "set", "eth0", "up")])
        come_late(hosts, [("address", "flush", "dev", "eth0")], [("address", "add", "10.77.0.2/24", "dev", "eth0")])
        holds_on(hosts)
    finally:
        hosts.close()


if __name__ == "__main__":
    run_test(test, own_network=True)
