#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Devices without a node-ID on a real CAN interface: one is present before the gateway starts, which assigns its
node-ID before it boots the network; another appears later. Then a device of the gateway itself, on a line in the
role device, gets its node-ID from the manager of another gateway, stores it, and has it after both were killed."""

import os

from actors import FOLDER, Actor, Site, Witness, check, eventually, play

EDS = os.path.abspath(os.path.join(os.path.dirname(__file__), "../../../bridges/sim/eds"))
MASTER, SLAVE = 0x7E5, 0x7E4
GIVE, STORE = 0x11, 0x17

MANAGER = f"""\
schema: 1
gateway: {{name: manager}}
lines:
  - name: hall
    interface: socketcan:vcan0
    bit_rate: 500kbit
    access: all
    lss: {{assign: true, period: 1s, store: true}}
    nodes:
      - {{id: 12, name: doors, eds: {EDS}/digital-io.eds, heartbeat: 2s}}
      - {{id: 20, name: gate, eds: {EDS}/encoder.eds, heartbeat: 2s}}
      - {{id: 30, name: late, eds: {EDS}/drive.eds, heartbeat: 2s}}
      - {{id: 40, name: ours, eds: {EDS}/analog-io.eds, serial: 4711, heartbeat: 2s}}
"""
BELOW = f"""\
schema: 1
gateway: {{name: below}}
lines:
  - name: ours
    interface: socketcan:vcan0
    bit_rate: 500kbit
    role: device
    storage: {FOLDER}/kept
    devices:
      - {{id: 7, name: mixer, eds: {EDS}/analog-io.eds, serial: 4711, lss: true}}
"""


class Scenario(Site):
    def __init__(self):
        super().__init__()
        self.bus = Witness("vcan0")

    def simulate(self, *devices):
        options = [word for device in devices for word in ("--device", device)]
        return Actor("devices", self.programs.linegate, "simulate", "socketcan:vcan0", *options)

    def operational(self, node):
        return any(one["node"] == node and one["state"] == "operational" for one in self.command("nodes", "hall"))

    def first(self, identifier, *data):
        """Returns the time of the first frame whose data begin with these bytes."""
        times = [time for time, _, got in self.bus.frames(identifier) if got[:len(data)] == bytes(data)]
        return times[0] if times else None

    def booted(self, node):
        eventually(f"node {node} is operational", lambda: self.operational(node))
        given, boot_up = self.first(MASTER, GIVE, node), self.first(0x700 + node, 0)
        check(f"node {node} has its node-ID by LSS", given is not None and boot_up is not None and given < boot_up)

    def run(self):
        self.simulate("digital-io:12:unconfigured", "encoder:20")
        eventually("the configured device is there", lambda: self.first(0x700 + 20, 0))
        manager = self.gateway("manager", MANAGER)
        self.booted(12)
        eventually("node 20 is operational", lambda: self.operational(20))
        reset = self.first(0x000, 0x82, 0x00)
        check("the network boots when node-IDs are given", reset > self.first(MASTER, GIVE, 12))
        check("a device that has a node-ID is given none", self.first(MASTER, GIVE, 20) is None)
        self.simulate("drive:30:unconfigured")
        self.booted(30)
        below = self.gateway("below", BELOW)
        self.booted(40)
        check("it said that it stored its node-ID", self.first(SLAVE, STORE, 0) is not None)
        manager.kill()
        below.kill()
        self.bus.catch_up("vcan0")
        asked, ups = len(self.bus.frames(MASTER)), self.bus.boot_ups(40)
        self.gateway("below-again", BELOW)
        eventually("it has it after power-off", lambda: self.bus.boot_ups(40) > ups)
        check("without being asked", len(self.bus.frames(MASTER)) == asked)


play(lambda: Scenario().run())
