#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""EMCYs of a network of another gateway (`routes:` with `emcy: true`), as the bus of the near gateway sees them: each once, as the
forwarded EMCY of its source, in both directions at the same time without a loop. After the process
with DDS was killed, no EMCY that is older than 2 s is sent: it is counted, and an event reports it.

peer_emcys.py LINEGATED LINEGATE PROFILES PROCESS   PROCESS: of the DDS of hall-a, same or own
"""

import os
import signal
import struct
import time

from peer_kill import child
from plant_process import EDS, Plant, expect, own_domain, run_test, simulated, until, write
from udp_bus import Bus, unpacked

BUS_A, BUS_B = ("239.74.163.21", 43131), ("239.74.163.22", 43132)
NODES = f"nodes: [{{id: 5, name: io, eds: {EDS}/digital-io.eds}}]"
PLANT_B = f"""schema: 1
gateway: {{name: hall-b}}
routes: [{{to: 1, via: hall-a/hall, emcy: true}}]
lines:
  - {{name: press, interface: "udp:{BUS_B[0]}:{BUS_B[1]}", network_id: 7, enter: [{{from: 1, services: [emcy]}}], {NODES}}}
"""
PLANT_A = f"""schema: 1
gateway: {{name: hall-a}}
dds: {{process: PROCESS}}
routes: [{{to: 7, via: hall-b/press, emcy: true}}]
lines:
  - {{name: hall, interface: "udp:{BUS_A[0]}:{BUS_A[1]}", network_id: 1, enter: [{{from: 7, services: [emcy]}}], {NODES}}}
  - {{name: shut, interface: "simulated:", network_id: 2}}
"""
OWN = 0x80 + 127  # EMCYs of the own node of a line
COLLISION = 0x8150  # of the simulated node 5, in whose name the test sends
TOO_OLD = 2  # seconds
FLOOD = 2_000  # EMCYs


class Watched(Bus):
    """A bus whose EMCYs of the own node are recorded."""

    def __init__(self, address):
        self.emcys = []  # (code, error register, network, node, hops)
        super().__init__(*address)

    def listen(self):
        while True:
            frame = unpacked(self.socket.recv(2048))
            if frame is not None and frame[0] == OWN and len(frame[1]) == 8:
                emcy = struct.unpack("<HBHBB", frame[1][:7])
                if emcy[0] != COLLISION:
                    self.emcys.append(emcy)

    def fail(self, code, register=0x11, node=5):
        """A node sends an EMCY."""
        self.send(0x80 + node, struct.pack("<HB", code, register) + b"maker")

    def codes(self):
        return [emcy[0] for emcy in self.emcys]


class Passage:
    """EMCYs of node 5 on one bus, which a gateway sends on another."""

    def __init__(self, of, to):
        self.of, self.to = of, to
        self.next = 0x8100

    def try_one(self, pause):
        """Returns the code of an EMCY and whether it was sent on the other bus after that time."""
        self.next += 1
        self.of.fail(self.next)
        time.sleep(pause)
        return self.next, self.next in self.to.codes()

    def wait(self, what="an EMCY passes"):
        """Until one passes. Returns the codes of all that were sent."""
        sent = []

        def is_there():
            sent.append(self.try_one(0.3)[0])
            return any(code in self.to.codes() for code in sent)
        until(what, is_there)
        time.sleep(1)  # all of them
        return sent


class Halls(Plant):
    def __init__(self, linegated, linegate, profiles):
        super().__init__(linegated, linegate, profiles, own_domain())
        self.a, self.b = Watched(BUS_A), Watched(BUS_B)
        self.passes = Passage(self.b, self.a).wait

    def lost(self):
        told = self.json("gateways")["gateways"]
        return next(one["counters"]["routed-emcys-lost"] for one in told if one["gateway"] == "hall-a")

    def losses(self):
        """The events of losses of EMCYs."""
        return [one["text"] for one in self.stream("events", "hall-a/hall", "--once")
                if one.get("kind") == "routing-refused" and "EMCYs" in one["text"]]


def each_passes_once(halls):
    halls.passes()
    before = len(halls.a.emcys)
    codes = list(range(0x9001, 0x900B))
    for code in codes:
        halls.b.fail(code)
        time.sleep(0.1)
    until("all of them arrive", lambda: len(halls.a.emcys) >= before + len(codes))
    time.sleep(1)
    expect("EMCYs on the bus of hall-a", halls.a.emcys[before:], [(code, 0x11, 7, 5, 1) for code in codes])
    expect("none returns to the bus of hall-b", halls.b.emcys, [])
    halls.a.fail(0xA001)
    until("it arrives in hall-b", lambda: halls.b.emcys)
    time.sleep(1)
    expect("EMCYs on the bus of hall-b", halls.b.emcys, [(0xA001, 0x11, 1, 5, 1)])
    expect("it does not return", 0xA001 in halls.a.codes(), False)


def a_flood_is_limited(halls):
    """Of node 5 in hall-b: those of node 6 arrive, and an event reports the others."""
    halls.passes()
    before, lost = len(halls.a.emcys), halls.lost()
    codes = []
    for i in range(FLOOD):
        halls.b.fail(0xC000 + i)
        if i % (FLOOD // 5) == 0:
            codes.append(0xD000 + i)
            halls.b.fail(codes[-1], node=6)
        time.sleep(0.001)

    def of(node):
        return [emcy[0] for emcy in halls.a.emcys[before:] if emcy[3] == node]
    until("those of node 6 arrive", lambda: of(6) == codes)
    until("the others are counted", lambda: halls.lost() - lost >= FLOOD - len(of(5)))
    seconds = 10  # at least as long as they were sent
    expect(f"few of node 5: {len(of(5))}", 0 < len(of(5)) <= 16 + 4 * seconds, True)
    until("an event reports them", lambda: any("too many" in text for text in halls.losses()))


def none_is_old(halls, what, interrupt):
    """interrupt(): no EMCY passes meanwhile; it sends the EMCY 0xB001 at its beginning."""
    halls.passes()
    lost = halls.lost()
    interrupt()
    sent = halls.passes()
    time.sleep(2)
    expect(f"{what}: the old EMCY", 0xB001 in halls.a.codes(), False)
    expect(f"{what}: new ones", [code for code in sent if halls.a.codes().count(code) > 1], [])
    until(f"{what}: it is counted", lambda: halls.lost() > lost)
    until(f"{what}: an event reports it", halls.losses)


def kill(gateway):
    """So often that the next process starts after more than TOO_OLD."""
    begin = time.monotonic()
    while time.monotonic() - begin < 2 * TOO_OLD:
        pid = child(gateway, "linegated-peers")
        if pid is not None:
            os.kill(pid, signal.SIGKILL)
        time.sleep(0.05)


def test(folder, linegated, linegate, profiles, process):
    halls = Halls(linegated, linegate, profiles)
    plant_a = write(os.path.join(folder, "a.yaml"), PLANT_A.replace("PROCESS", process))
    with simulated(linegate, f"udp:{BUS_A[0]}:{BUS_A[1]}", {5: "digital-io"}), \
            simulated(linegate, f"udp:{BUS_B[0]}:{BUS_B[1]}", {5: "digital-io"}), \
            halls.running(write(os.path.join(folder, "b.yaml"), PLANT_B)), halls.running(plant_a) as a:
        each_passes_once(halls)
        a_flood_is_limited(halls)

        def killed():
            kill_once = child(a, "linegated-peers")
            os.kill(kill_once, signal.SIGKILL)
            halls.b.fail(0xB001)
            kill(a)
        if process == "own":
            none_is_old(halls, "killed", killed)


if __name__ == "__main__":
    run_test(test, own_network=True)
