#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""DDS in a process of its own, which is killed, aborted and stopped, loops, and uses up its memory (the last two by
tests/gateway/process/dds_faults.cpp), while a device sends heartbeats and the gateway SYNC: the gateway receives every
frame of the bus, SYNC goes on, no heartbeat is lost, the device is not booted again, and each end is reported."""

import os
import signal

from actors import Site, Witness, Actor, check, eventually, play, read, write_file

EDS = os.path.abspath(os.path.join(os.path.dirname(__file__), "../../../bridges/sim/eds"))
NODE = 5
SYNC = 0x80
TPDO = 0x180 + NODE
FROM_DEVICE = [function + NODE for function in (0x80, 0x180, 0x280, 0x380, 0x480, 0x580, 0x700)]
PLANT = f"""\
schema: 1
gateway: {{name: guest}}
dds: {{process: own, memory: 100MB}}
lines:
  - name: hall
    interface: socketcan:vcan0
    bit_rate: 500kbit
    access: all
    sync: 50ms
    nodes:
      - {{id: {NODE}, name: io, eds: {EDS}/digital-io.eds, heartbeat: 200ms}}
"""
SILENT = "was ended: it did not respond"
# What ends the DDS process, and the reason in the log.
ENDS = {
    "kill": (signal.SIGKILL, "was ended by signal 9 (Killed)"),
    "abort": (signal.SIGABRT, "was ended by signal 6 (Aborted)"),
    "stop": (signal.SIGSTOP, SILENT),
    "loop for a datagram": (signal.SIGUSR1, SILENT),
    "memory": (signal.SIGUSR2, "more than the permitted 100 MB"),
    "loop in the thread that serves the gateway": (signal.SIGRTMIN, SILENT),
    "loop in a timer": (signal.SIGRTMIN + 1, SILENT),
}


class Hall(Site):
    def __init__(self):
        super().__init__("dds-faults")
        self.bus = Witness("vcan0")
        self.device = Actor("device", self.programs.linegate, "simulate", "socketcan:vcan0", "--device", f"digital-io:{NODE}")
        eventually("the device is there", lambda: self.bus.boot_ups(NODE) > 0)
        self.before = self.frames_of_others()
        self.linegated = Actor("hall", self.programs.linegated, write_file("hall.yaml", PLANT),
                               environment={"LD_PRELOAD": self.programs.dds_faults})
        eventually("the device is operational", self.operational)

    def operational(self):
        return any(node["node"] == NODE and node["state"] == "operational" for node in self.command("nodes", "hall"))

    def dds(self):
        """The process ID of the DDS process; 0 if it does not run."""
        for entry in os.listdir("/proc"):
            if entry.isdigit():
                try:
                    name, rest = read(f"/proc/{entry}/stat").rsplit(") ", 1)
                except OSError:
                    continue
                if name.endswith("(linegated-dds") and rest[0] != "Z":
                    return int(entry)
        return 0

    def counters(self):
        return self.command("lines")["lines"][0]["counters"]

    def frames_of_others(self):
        return sum(len(self.bus.frames(identifier)) for identifier in FROM_DEVICE)


def longest_pause(frames):
    times = [frame[0] for frame in frames]
    return max(later - earlier for earlier, later in zip(times, times[1:]))


def scenario():
    hall = Hall()
    heartbeats_lost = hall.counters()["heartbeats_lost"]
    boot_ups = hall.bus.boot_ups(NODE)
    load = Actor("load", "cangen", "vcan0", "-g", "10", "-I", f"{TPDO:X}", "-L", "2", "-D", "i")
    for end, (number, reason) in ENDS.items():
        process = hall.dds()
        check(f"a DDS process runs before: {end}", process != 0)
        syncs = len(hall.bus.frames(SYNC))
        os.kill(process, number)
        eventually("SYNC goes on", lambda so_far=syncs: len(hall.bus.frames(SYNC)) > so_far + 10)
        eventually("another DDS process runs", lambda gone=process: hall.dds() not in (0, gone))
        eventually("the log has the reason", lambda its=(process, reason): any(
            f"the DDS process {its[0]} " in line and its[1] in line for line in hall.linegated.text().splitlines()))
        check("the device is operational", hall.operational())
    load.kill()
    check("it was not booted again", hall.bus.boot_ups(NODE) == boot_ups)
    check("no heartbeat is lost", hall.counters()["heartbeats_lost"] == heartbeats_lost)
    print(f"longest pause of SYNC: {longest_pause(hall.bus.frames(SYNC)) * 1000:.0f} ms")
    hall.device.kill()
    hall.bus.catch_up("vcan0")
    others = hall.frames_of_others() - hall.before + 1  # and the frame of catch_up
    print(f"frames of others on the bus: {others}")
    eventually("the gateway received each of them", lambda: hall.counters()["frames_received"] == others)
    log = hall.linegated.text()
    check("an event has the reason", "gateway: the DDS process was ended by signal 9 (Killed); it is started again" in log)
    check("the gateway ends well", hall.linegated.stop() == 0)


play(scenario)
